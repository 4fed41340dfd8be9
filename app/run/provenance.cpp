#include "app/run/provenance.hpp"

#include <IpoptConfig.h>
#include <fmt/format.h>
#include <nlopt.h>
#include <stdlib.h>  // getloadavg
#include <sundials/sundials_config.h>
#include <CLI/Version.hpp>

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/files/json_text.hpp"
#include "app/files/sha256.hpp"
#include "core/expression/counted.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/regular_file.hpp"

namespace mbsopt::inline app {
namespace {

// Quotes a word if a shell needs it, so that the line can be pasted.
std::string shell_word(const std::string& word) {
  constexpr const char* plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
  if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string nlopt_version_text() {
  int major = 0, minor = 0, fix = 0;
  nlopt_version(&major, &minor, &fix);
  return fmt::format("{}.{}.{}", major, minor, fix);
}

nlohmann::ordered_json library_versions() {
  return {{"Eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"Ipopt", IPOPT_VERSION},
          {"NLopt", nlopt_version_text()},
          {"SUNDIALS", SUNDIALS_VERSION},
          {"fmt", fmt::format("{}.{}.{}", FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100)},
          {"nlohmann_json", fmt::format("{}.{}.{}", NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR,
                                        NLOHMANN_JSON_VERSION_PATCH)},
          {"CLI11", CLI11_VERSION},
          {"compiler", __VERSION__}};
}

// A run whose input has no checksum cannot be resumed.
std::string checksum_of(const std::string& file) {
  std::string checksum = sha256_of_file(file);
  if (checksum.empty()) throw CsvError(file + ": cannot be read");
  return checksum;
}

// A path relative to the folder: two files may have one base name. The result does not depend on the current folder.
std::string seen_from(const std::filesystem::path& folder, const std::filesystem::path& file) {
  return std::filesystem::absolute(file).lexically_normal().lexically_relative(folder).generic_string();
}

std::string cpu_model() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

}  // namespace

std::string program_version() { return MBSOPT_VERSION; }

std::string sha256_of_file(const std::string& path) {
  try {
    return sha256_of(content_of_regular_file(path));
  } catch (const FileError&) {
    return {};
  }
}

nlohmann::ordered_json provenance(const std::vector<std::string>& arguments, const std::string& input_as_stored,
                                  const std::string& problem_file, const std::vector<std::string>& data_files) {
  std::string command_line = "mbsopt";
  for (const std::string& argument : arguments) command_line += " " + shell_word(argument);
  nlohmann::ordered_json result{
      {"command_line", command_line}, {"input", input_as_stored}, {"input_sha256", checksum_of(problem_file)}};
  const std::filesystem::path folder = std::filesystem::absolute(problem_file).lexically_normal().parent_path();
  for (const std::string& file : data_files) result["data_sha256"][seen_from(folder, file)] = checksum_of(file);
  result["libraries"] = library_versions();
  return result;
}

Json machine_json() {
  double load = 0;
  const bool known = getloadavg(&load, 1) == 1;
  return {{"cpu", cpu_model()}, {"cores", std::thread::hardware_concurrency()}, {"load", known ? Json(load) : Json()}};
}

std::string machine_name(const Json& machine) {
  return fmt::format("{}, {}", machine.at("cpu").get<std::string>(), counted(machine.at("cores").get<int>(), "core"));
}

}  // namespace mbsopt::inline app
