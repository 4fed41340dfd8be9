#pragma once

#include <string>
#include <string_view>

namespace mbsopt {

// A text as a cell of a CSV file. A comma, a quote or a line's end puts it in quotes (RFC 4180). An apostrophe precedes
// a text that a spreadsheet would run as a formula (OWASP, "CSV injection").
std::string csv_cell(std::string_view text);

}  // namespace mbsopt
