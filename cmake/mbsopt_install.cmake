# The program, and the libraries as a CMake package:
#   find_package(mbsopt REQUIRED)
#   target_link_libraries(mine PRIVATE mbsopt::core mbsopt::optim)
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/mbsopt)
set_target_properties(mbsopt_core PROPERTIES EXPORT_NAME core)
set_target_properties(mbsopt_optim PROPERTIES EXPORT_NAME optim)
add_library(mbsopt::core ALIAS mbsopt_core)
add_library(mbsopt::optim ALIAS mbsopt_optim)

install(TARGETS mbsopt RUNTIME COMPONENT program)
install(TARGETS mbsopt_core mbsopt_optim EXPORT mbsopt_targets ARCHIVE COMPONENT development)
install(DIRECTORY core optim DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/mbsopt COMPONENT development
        FILES_MATCHING PATTERN "*.hpp")
install(EXPORT mbsopt_targets NAMESPACE mbsopt:: FILE mbsopt_targets.cmake DESTINATION ${package_dir}
        COMPONENT development)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/mbsopt-config.cmake.in
  ${PROJECT_BINARY_DIR}/mbsopt-config.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/mbsopt-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/mbsopt-config.cmake ${PROJECT_BINARY_DIR}/mbsopt-config-version.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindKLU.cmake
        DESTINATION ${package_dir} COMPONENT development)
