# ccache and a fast linker, where they are present.
find_program(MBSOPT_CCACHE ccache)
if(MBSOPT_CCACHE AND PROJECT_IS_TOP_LEVEL AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1
      CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime  # for precompiled headers
      ${MBSOPT_CCACHE})
endif()

find_program(MBSOPT_MOLD mold)
find_program(MBSOPT_LLD ld.lld)
if(PROJECT_IS_TOP_LEVEL AND MBSOPT_MOLD)
  add_link_options(-fuse-ld=mold)
elseif(PROJECT_IS_TOP_LEVEL AND MBSOPT_LLD)
  add_link_options(-fuse-ld=lld)
endif()
