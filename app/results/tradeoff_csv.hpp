// tradeoff.csv: a row per setting, measured or skipped; docs/tradeoffs.md lists the columns.
#pragma once

#include <string>

#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt::inline app {

std::string to_csv(const Tradeoff& tradeoff);
std::string to_csv(const PenaltyStudy& study);  // a row per alpha

}  // namespace mbsopt::inline app
