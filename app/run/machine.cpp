#include "app/run/machine.hpp"

#include <fmt/format.h>
#include <stdlib.h>  // getloadavg

#include <fstream>
#include <string>
#include <thread>

#include "core/expression/counted.hpp"

namespace mbsopt {
namespace {

std::string cpu_model() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

}  // namespace

Json machine_json() {
  double load = 0;
  const bool told = getloadavg(&load, 1) == 1;
  return {{"cpu", cpu_model()}, {"cores", std::thread::hardware_concurrency()}, {"load", told ? Json(load) : Json()}};
}

std::string machine_name(const Json& machine) {
  return fmt::format("{}, {}", machine.at("cpu").get<std::string>(), counted(machine.at("cores").get<int>(), "core"));
}

}  // namespace mbsopt
