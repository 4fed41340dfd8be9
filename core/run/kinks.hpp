// The instants at which the laws of a mechanism and the running costs of a run jump or have kinks.
#pragma once

#include <span>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/run/cost.hpp"

namespace mbsopt {

std::vector<KinkedSignal> kinks_of(const Mechanism& mechanism, std::span<const Cost> costs);

}  // namespace mbsopt
