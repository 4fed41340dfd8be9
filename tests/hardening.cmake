# Reads the program: its tables of functions are read-only. Reads the libraries: they call what the options insert (the
# program alone does not show it, since it holds static libraries of others, too).
function(expect file option pattern what)
  execute_process(COMMAND ${READELF} --wide ${option} ${file} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  if(NOT text MATCHES "${pattern}")
    message(SEND_ERROR "${file}: ${what} is missing: '${pattern}' in readelf ${option}")
  endif()
endfunction()

expect(${PROGRAM} --dynamic "BIND_NOW" "-z now")
expect(${PROGRAM} --program-headers "GNU_RELRO" "-z relro")
expect(${PROGRAM} --program-headers "GNU_STACK[^\n]* RW " "a stack that is not executable")
expect(${PROGRAM} --dyn-syms "__glibcxx_assert_fail" "-D_GLIBCXX_ASSERTIONS")
foreach(library IN ITEMS ${CORE} ${OPTIM} ${APP})
  expect(${library} --syms " __stack_chk_fail[@\n]" "-fstack-protector-strong")
endforeach()
