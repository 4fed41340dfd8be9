// The provenance of a result: enough to repeat it, and nothing that changes from run to run. The machine of a run.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace mbsopt::inline app {

std::string program_version();
std::string sha256_of_file(const std::string& path);  // lower-case hex; empty where it cannot be read

// {"command_line", "input", "input_sha256", "data_sha256": {file: hash}, "libraries": {name: version}} Names of data
// files are relative to the problem file's folder, wherever the command runs. Throws std::runtime_error if a file
// cannot be read.
nlohmann::ordered_json provenance(const std::vector<std::string>& arguments, const std::string& input_as_stored,
                                  const std::string& problem_file, const std::vector<std::string>& data_files);

// The machine that measured times: {"cpu": "Intel(R) Core(TM) i7-8700", "cores": 12, "load": 0.4}. The load is the
// average number of running processes over the last minute, or null if the system does not give it.
nlohmann::ordered_json machine_json();
// "Intel(R) Core(TM) i7-8700, 12 cores"
std::string machine_name(const nlohmann::ordered_json& machine);

}  // namespace mbsopt::inline app
