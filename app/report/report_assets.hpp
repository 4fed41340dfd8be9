// The style and the script of every report: report.css and script/*.js beside this file, embedded by CMake.
#pragma once

#include <string_view>

namespace mbsopt::inline app {

extern const std::string_view kReportStyle, kReportScript;

}  // namespace mbsopt::inline app
