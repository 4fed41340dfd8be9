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
                                              $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/mbsopt>)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wshadow)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE -Wno-restrict -Wno-stringop-overflow -Wno-array-bounds)  # false alarms
                                             # on "a" + std::string: GCC bug 105651
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
# which halves the time of a build. Each source still includes what it uses.
function(mbsopt_precompile target)
  target_precompile_headers(${target} PRIVATE <Eigen/Core> <algorithm> <array> <cmath> <functional> <limits> <map>
                            <memory> <optional> <span> <stdexcept> <string> <string_view> <utility> <vector> ${ARGN})
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${target} PRIVATE -fpch-preprocess)  # ccache's manual, "Precompiled headers"
  elseif(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
    target_compile_options(${target} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")  # the same page
  endif()
endfunction()

# mbsopt_unity(<target> <source>...): where MBSOPT_UNITY is on, sources are compiled together, eight at a time, so that
# templates that they share are made once. The sources given stay alone: headers of theirs define names that clash. The sanitizers' builds compile each source alone, which shows a missing include.
function(mbsopt_unity target)
  if(MBSOPT_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
    set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()
