# The program, and the libraries as a CMake package:
#   find_package(mbsopt REQUIRED)
#   target_link_libraries(mine PRIVATE mbsopt::mbsopt)     # and #include <mbsopt/mbsopt.hpp>
#   target_link_libraries(mine PRIVATE mbsopt::program)    # also <mbsopt/program.hpp>: all commands in your program
#   target_link_libraries(mine PRIVATE mbsopt::headers)    # a plug-in: headers alone, <mbsopt/plugin.hpp>
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/mbsopt)
set_target_properties(mbsopt_core PROPERTIES EXPORT_NAME core)
set_target_properties(mbsopt_optim PROPERTIES EXPORT_NAME optim)
set_target_properties(mbsopt_json PROPERTIES EXPORT_NAME mbsopt)
set_target_properties(mbsopt_app PROPERTIES EXPORT_NAME program)
add_library(mbsopt_plugin_headers INTERFACE)
target_link_libraries(mbsopt_plugin_headers INTERFACE Eigen3::Eigen)
target_compile_features(mbsopt_plugin_headers INTERFACE cxx_std_20)
target_include_directories(mbsopt_plugin_headers INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                                           $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
set_target_properties(mbsopt_plugin_headers PROPERTIES EXPORT_NAME headers)
add_library(mbsopt::core ALIAS mbsopt_core)
add_library(mbsopt::optim ALIAS mbsopt_optim)
add_library(mbsopt::mbsopt ALIAS mbsopt_json)
add_library(mbsopt::program ALIAS mbsopt_app)
add_library(mbsopt::headers ALIAS mbsopt_plugin_headers)

install(TARGETS mbsopt RUNTIME COMPONENT program)
install(TARGETS mbsopt_core mbsopt_optim mbsopt_json mbsopt_app mbsopt_plugin_headers EXPORT mbsopt_targets
        ARCHIVE COMPONENT development)
install(CODE "execute_process(COMMAND \"${CMAKE_COMMAND}\" \"-DSOURCE=${PROJECT_SOURCE_DIR}\"
                \"-DINCLUDE=\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}\"
                -P \"${PROJECT_SOURCE_DIR}/cmake/mbsopt_headers.cmake\" COMMAND_ERROR_IS_FATAL ANY)" COMPONENT development)
install(EXPORT mbsopt_targets NAMESPACE mbsopt:: FILE mbsopt_targets.cmake DESTINATION ${package_dir}
        COMPONENT development)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/mbsopt-config.cmake.in
  ${PROJECT_BINARY_DIR}/mbsopt-config.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/mbsopt-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/mbsopt-config.cmake ${PROJECT_BINARY_DIR}/mbsopt-config-version.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindKLU.cmake
        DESTINATION ${package_dir} COMPONENT development)
