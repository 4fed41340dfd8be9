// These benchmarks run `validate`, `simulate` and `gradient` of 100 to 10 000 bodies, twenty steps each, to show how
// their time and memory grow. Every command runs in a process of its own.
//   seconds   processor time of the process
//   mib       the most memory that it held
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include "app/command/command_line.hpp"
#include "bench/linkage.hpp"

using namespace mbsopt;
using namespace mbsopt::bench;

namespace {

Linkage free_bodies(int rods) {
  Linkage linkage = planar_chain(rods);
  linkage.hinges.clear();
  return linkage;
}

// One mass for all rods is the parameter; the objective is the energy at the end, which depends on every rod.
std::string problem_text(const Linkage& linkage) {
  const auto list = [](const Vector3d& x) { return fmt::format("[{}, {}, {}]", x(0), x(1), x(2)); };
  const auto name = [](int body) {
    return body == Linkage::kGround ? std::string("ground") : "rod" + std::to_string(body);
  };
  std::vector<std::string> bodies, joints;
  for (int i = 0; i < linkage.size(); ++i) {
    const Linkage::Rod& rod = linkage.rod(i);
    bodies.push_back(fmt::format(
        R"({{"name": "{}", "mass": "m", "inertia": {}, "position": {}, "velocity": {}, "angular_velocity": {}}})",
        name(i), list(rod.inertia), list(rod.centre), list(rod.velocity), list(rod.omega)));
  }
  for (std::size_t k = 0; k < linkage.hinges.size(); ++k) {
    const Linkage::Hinge& hinge = linkage.hinges[k];
    joints.push_back(fmt::format(R"({{"name": "hinge{}", "type": "revolute", "body1": "{}", "body2": "{}", )"
                                 R"("point1": {}, "point2": {}, "axis1": {}, "axis2": {}}})",
                                 k, name(hinge.body1), name(hinge.body2),
                                 list(hinge.point - linkage.centre(hinge.body1)),
                                 list(hinge.point - linkage.centre(hinge.body2)), list(hinge.axis), list(hinge.axis)));
  }
  return fmt::format(
      R"({{"format": 1, "name": "sizes", "gravity": {}, "parameters": {{"m": 1}}, "bodies": [
{}], "joints": [
{}], "sensors": {{"energy": {{"quantity": "energy", "component": "total"}}}},
"objectives": {{"end": {{"terminal": "energy"}}}},
"simulation": {{"end_time": 0.02, "output_step": 0.01, "integrator": {{"type": "dopri5", "step": 1e-3}}}}}})",
      list(linkage.gravity), fmt::join(bodies, ",\n"), fmt::join(joints, ",\n"));
}

void command(benchmark::State& state, const std::string& name, Linkage (*make)(int), int size) {
  std::string pattern = (std::filesystem::temp_directory_path() / "mbsopt_sizes_XXXXXX").string();
  const std::filesystem::path folder = ::mkdtemp(pattern.data());
  const std::string file = (folder / "problem.json").string(), out = (folder / "out").string();
  int bodies = 0;
  {
    const Linkage linkage = make(size);
    bodies = linkage.size();
    std::ofstream(file) << problem_text(linkage);
  }
  for (auto _ : state) {
    const pid_t child = ::fork();
    if (child == 0) {
      std::ostringstream words, errors;
      const int code = run_command_line({name, file, "--out", out, "--quiet"}, words, errors);
      if (code != 0) std::cerr << errors.str();
      ::_exit(code);
    }
    int status = 0;
    rusage used{};
    ::wait4(child, &status, 0, &used);
    if (status != 0) state.SkipWithError((name + " failed").c_str());
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    state.counters["bodies"] = bodies;
    state.counters["seconds"] = seconds(used.ru_utime) + seconds(used.ru_stime);
    state.counters["mib"] = static_cast<double>(used.ru_maxrss) / 1024;
  }
  std::filesystem::remove_all(folder);
}

const bool registered = [] {
  struct Kind {
    const char* name;
    Linkage (*make)(int size);
    int per_size;  // bodies of size 1, about
  };
  for (const Kind& kind : {Kind{"planar_chain", planar_chain, 1}, Kind{"spatial_chain", spatial_chain, 1},
                           Kind{"four_bars", four_bars, 2}, Kind{"free_bodies", free_bodies, 1}}) {
    for (const int bodies : {100, 1000, 10000}) {
      for (const std::string name : {"validate", "simulate", "gradient"}) {
        benchmark::RegisterBenchmark(
            fmt::format("sizes/{}/{}/{}", kind.name, bodies, name).c_str(),
            [=](benchmark::State& state) { command(state, name, kind.make, bodies / kind.per_size); })
            ->Iterations(1)
            ->Unit(benchmark::kMillisecond);
      }
    }
  }
  return true;
}();

}  // namespace
