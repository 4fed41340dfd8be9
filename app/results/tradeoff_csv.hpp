// tradeoff.csv: a row per setting that was measured, or that was to be; columns in docs/tradeoffs.md.
#pragma once

#include <string>

#include "optim/tradeoff/penalty_study.hpp"
#include "optim/tradeoff/tradeoff.hpp"

namespace mbsopt {

std::string to_csv(const Tradeoff& tradeoff);
std::string to_csv(const PenaltyStudy& study);  // a row per alpha

}  // namespace mbsopt
