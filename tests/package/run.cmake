# Installs the build to a folder of its own, then configures, builds and runs projects that use it: one that has a folder
# core/ of its own, the one of docs/library.md, and examples/.
set(work ${BUILD}/package_test)
# Users optimise more; -O1 compiles the same programs in less time.
set(release -DCMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG")
file(REMOVE_RECURSE ${work})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/prefix
                OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${work}/consumer -G ${GENERATOR}
                        -DCMAKE_PREFIX_PATH=${work}/prefix ${release} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${work}/consumer COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${work}/consumer/consumer COMMAND_ERROR_IS_FATAL ANY)

file(READ ${SOURCE}/../../docs/library.md page)
string(REGEX MATCH "```cmake\n([^`]*)```.*```c\\+\\+\n([^`]*)```" found "${page}")
file(WRITE ${work}/library/CMakeLists.txt "${CMAKE_MATCH_1}")
file(WRITE ${work}/library/swing.cpp "${CMAKE_MATCH_2}")
execute_process(COMMAND ${CMAKE_COMMAND} -S ${work}/library -B ${work}/library/build -G ${GENERATOR}
                        -DCMAKE_PREFIX_PATH=${work}/prefix ${release} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${work}/library/build COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${work}/library/build/swing COMMAND_ERROR_IS_FATAL ANY)

file(GLOB headers ${work}/prefix/include/mbsopt/*.hpp)
list(LENGTH headers count)
if(count GREATER 40)
  message(FATAL_ERROR "${count} public headers; at most 40 are wanted")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/../../examples -B ${work}/examples -G ${GENERATOR}
                        -DCMAKE_PREFIX_PATH=${work}/prefix ${release} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${work}/examples COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_CTEST_COMMAND} --test-dir ${work}/examples --output-on-failure COMMAND_ERROR_IS_FATAL ANY)
find_program(PYTHON python3)
if(PYTHON)
  execute_process(COMMAND ${PYTHON} ${SOURCE}/resume.py ${work}/examples/own_program
                          ${SOURCE}/../../examples/own_program.json ${work}/resume COMMAND_ERROR_IS_FATAL ANY)
endif()
