// The machine that times were measured on.
#pragma once

#include "app/files/result_json.hpp"

namespace mbsopt {

// {"cpu": "Intel(R) Core(TM) i7-8700", "cores": 12, "load": 0.4}: the load is the average number of running processes
// over the last minute, null where the system does not tell.
Json machine_json();
// "Intel(R) Core(TM) i7-8700, 12 cores"
std::string machine_name(const Json& machine);

}  // namespace mbsopt
