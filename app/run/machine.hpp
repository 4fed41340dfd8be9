// The machine that measured times.
#pragma once

#include "app/files/result_json.hpp"

namespace mbsopt {

// {"cpu": "Intel(R) Core(TM) i7-8700", "cores": 12, "load": 0.4}. The load is the average number of running processes
// over the last minute, or null if the system does not give it.
Json machine_json();
// "Intel(R) Core(TM) i7-8700, 12 cores"
std::string machine_name(const Json& machine);

}  // namespace mbsopt
