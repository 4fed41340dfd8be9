#pragma once

#include <string>
#include <string_view>

namespace mbsopt {

// A text as a cell of a CSV file: quoted where a comma, a quote or a line's end would end it (RFC 4180), and with an
// apostrophe before what a spreadsheet would run as a formula (OWASP, "CSV injection").
std::string csv_cell(std::string_view text);

}  // namespace mbsopt
