cmake_minimum_required(VERSION 3.25)
# cmake -DINPUT=file -DOUTPUT=file.cpp -DNAME=name -P embed_text.cmake
# configure_file, not string(CONCAT): CMake's lists would swallow semicolons and brackets.
file(READ ${INPUT} TEXT)
set(TEMPLATE "${OUTPUT}.in")
file(WRITE ${TEMPLATE} [[
#include <string_view>
namespace mbsopt {
extern const std::string_view @NAME@;
const std::string_view @NAME@ = R"embedded(@TEXT@)embedded";
}  // namespace mbsopt
]])
configure_file(${TEMPLATE} ${OUTPUT} @ONLY)
