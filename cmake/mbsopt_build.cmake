# mbsopt_sources(<variable> <folder>): every .cpp below a folder of the project; new files are seen at the next build.
function(mbsopt_sources variable folder)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.cpp)
  set(${variable} ${sources} PARENT_SCOPE)
endfunction()

# The release ends at once if an error overwrites the stack or overruns a buffer. If optim/ or app/ index past a
# container, it ends, too (docs/performance.md).
set(MBSOPT_HARDENED OFF)
if(PROJECT_IS_TOP_LEVEL AND CMAKE_BUILD_TYPE STREQUAL Release AND NOT MBSOPT_SANITIZE)
  set(MBSOPT_HARDENED ON)
endif()

# mbsopt_compile_options(<target>): what every target of ours is compiled with. Imported targets are SYSTEM, so the
# warnings are about our own code only.
function(mbsopt_compile_options target)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                              $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wshadow)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE -Wno-restrict -Wno-stringop-overflow -Wno-array-bounds)  # false alarms
                                             # on "a" + std::string: GCC bug 105651
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)  # collects its garbage from 1 GB on: a tenth less time, a fifth more memory
    target_compile_options(${target} PRIVATE "SHELL:--param ggc-min-heapsize=1048576")
  endif()
  if(MBSOPT_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(MBSOPT_NATIVE)  # PUBLIC: the alignment of Eigen's types depends on it
    target_compile_options(${target} PUBLIC $<BUILD_INTERFACE:-march=native>)
  endif()
  if(MBSOPT_HARDENED)
    target_compile_options(${target} PRIVATE -fstack-protector-strong -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2)
    if(NOT target STREQUAL mbsopt_core)
      target_compile_options(${target} PRIVATE -D_GLIBCXX_ASSERTIONS)
    endif()
  endif()
  if(MBSOPT_SANITIZE STREQUAL THREAD)
    target_compile_options(${target} PRIVATE -fsanitize=thread -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC $<BUILD_INTERFACE:-fsanitize=thread>)
  elseif(MBSOPT_SANITIZE)
    # A null access faults by itself and is reported so; checking each load for it and for alignment triples the code.
    target_compile_options(${target} PRIVATE -fsanitize=address,undefined -fno-sanitize=null,alignment
                                             -fno-sanitize-recover=all
                                             -fno-omit-frame-pointer)
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)  # false alarms: GCC's manual, -fsanitize
    endif()
    target_link_options(${target} PUBLIC $<BUILD_INTERFACE:-fsanitize=address,undefined>)
  endif()
endfunction()

# mbsopt_precompile(<target> <header>...): Eigen, the standard library and the headers given are parsed once per target,
# which halves the time of a build. Each source still includes what it uses. Where nothing is precompiled, Eigen's
# kernels are compiled in each source.
# mbsopt_precompile(<target> REUSE_FROM <other>): takes those of a target with the same options.
function(mbsopt_precompile target)
  if(ARGV1 STREQUAL REUSE_FROM)
    target_precompile_headers(${target} REUSE_FROM ${ARGV2})
  else()
    target_precompile_headers(${target} PRIVATE ${PROJECT_SOURCE_DIR}/core/linear/eigen_kernels.hpp
                              <algorithm> <array> <cmath> <functional> <limits> <map>
                              <memory> <optional> <span> <stdexcept> <string> <string_view> <utility> <vector> ${ARGN})
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${target} PRIVATE -fpch-preprocess)  # ccache's manual, "Precompiled headers"
  elseif(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
    target_compile_options(${target} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")  # the same page
  endif()
endfunction()

# mbsopt_unity(<target> <source>...): where MBSOPT_UNITY is on, sources of a folder are compiled together, so that
# templates that they share are made once. A group ends with its folder, or after ten sources (two minutes of one core at
# most); small folders share one. Thus a new source changes the groups of its folder only. The sources given stay alone:
# headers of theirs define names that clash. The sanitizers' builds compile each source alone, which shows a missing
# include.
function(mbsopt_unity target)
  if(NOT MBSOPT_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cpp$")
  list(REMOVE_ITEM sources ${ARGN})
  list(TRANSFORM ARGN PREPEND ${CMAKE_SOURCE_DIR}/ OUTPUT_VARIABLE alone)
  list(REMOVE_ITEM sources ${alone})
  set(group "")
  set(members 0)
  set(folder "")
  foreach(source IN LISTS sources)
    cmake_path(GET source PARENT_PATH parent)
    if(members GREATER_EQUAL 10 OR NOT parent STREQUAL folder AND (members GREATER_EQUAL 4 OR group STREQUAL ""))
      cmake_path(GET source STEM group)
      set(group ${target}_${group})
      set(members 0)
    endif()
    set(folder ${parent})
    math(EXPR members "${members} + 1")
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group})
  endforeach()
endfunction()
