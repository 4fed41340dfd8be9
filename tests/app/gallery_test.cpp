// The gallery of problem files: what they show holds, and their numbers are those of independent solutions
// (gallery_reference.json, with its sources).
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "app/json/read_problem.hpp"
#include "app/terminal/exit_code.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/scene/type_table.hpp"
#include "core/simulate/simulation.hpp"
#include "optim/objective/evaluator.hpp"
#include "source_folder.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
namespace fs = std::filesystem;

namespace {

Problem accurately(const std::string& name, double rtol) {
  Problem problem = read_problem(file_of(name));
  problem.scene.simulation.accuracy.reset();
  problem.scene.simulation.integrator.type = "dopri853";
  problem.scene.simulation.integrator.rtol = rtol, problem.scene.simulation.integrator.atol = 1e-2 * rtol;
  return problem;
}

}  // namespace

TEST_CASE("the gallery shows every joint, drive, force and sensor", "[gallery]") {
  auto type_in = [](std::string_view kind, std::string_view type) { return std::string(kind) + std::string(type); };
  std::set<std::string> shown;
  for (const std::string& name : gallery()) {
    const Scene scene = read_problem(file_of(name)).scene;
    for (const Joint& j : scene.joints) shown.insert(type_in("joint ", j.type));
    for (const Drive& d : scene.drives) shown.insert(type_in("drive ", d.type));
    for (const Force& force : scene.forces) shown.insert(type_in("force ", type_of(force)));
    for (const Sensor& s : scene.sensors) shown.insert(type_in("sensor ", s.quantity));
  }
  auto all_of = [&](std::string_view kind, std::span<const TypeRow> rows) {
    for (const TypeRow& row : rows) {
      INFO(kind << row.name);
      CHECK(shown.contains(type_in(kind, row.name)));
    }
  };
  all_of("joint ", kJointTypes);
  all_of("drive ", kDriveTypes);
  shown.insert("force user");  // calls code that is not in problems/: examples/plugin.json
  all_of("force ", kForceTypes);
  all_of("sensor ", kSensorQuantities);
}

TEST_CASE("values and gradients of the gallery are those of independent solutions to 1e-8", "[gallery]") {
  const auto reference = json_of(fs::path(MBSOPT_SOURCE_DIR) / "tests/app/gallery_reference.json");
  CHECK(reference.at("problems").size() >= 16);
  for (const auto& [name, expected] : reference.at("problems").items()) {
    const Problem problem = accurately(name, 1e-11);
    Evaluator evaluator(problem.scene, objectives_of(problem));
    const Evaluation& e = evaluator.gradients(evaluator.start());
    INFO(name << ": " << e.message);
    REQUIRE(e.ok);
    for (std::size_t i = 0; i < evaluator.objectives().size(); ++i) {
      const Eigen::Index row = static_cast<Eigen::Index>(i);
      const auto& objective = expected.at("objectives").at(evaluator.objectives()[i].name());
      INFO(evaluator.objectives()[i].name());
      CHECK(e.psi(row) == Approx(objective.at("value").get<double>()).epsilon(1e-8));
      // An entry's size is judged with its parameter's; small ones carry the rounding of the largest.
      auto size = [&](std::size_t k) { return std::max(std::abs(problem.scene.parameters[k].value), 1e-3); };
      double largest = 0;
      for (std::size_t k = 0; k < problem.scene.parameters.size(); ++k)
        largest = std::max(largest, size(k) * std::abs(e.psi_rho(row, static_cast<Eigen::Index>(k))));
      CHECK(objective.at("gradient").size() == problem.scene.parameters.size());
      for (std::size_t k = 0; k < problem.scene.parameters.size(); ++k) {
        const auto& entry = objective.at("gradient").at(problem.scene.parameters[k].name);
        const double derivative = entry[0], error = entry[1];
        INFO(problem.scene.parameters[k].name);
        CHECK(std::abs(e.psi_rho(row, static_cast<Eigen::Index>(k)) - derivative) <=
              10 * error + 1e-8 * std::max(std::abs(derivative), 1e-3 * largest / size(k)));
      }
    }
  }
}

TEST_CASE("check holds on every problem file", "[gallery]") {
  // Shorter runs where there are many bodies, parameters or steps: differences take hundreds of simulations.
  const std::map<std::string, std::string> end_times{{"chain/gradient", "0.05"},
                                                     {"five_bar/sensitivities", "0.2"},
                                                     {"double_pendulum/inverse_dynamics", "0.4"},
                                                     {"governor/stiff_flyball", "0.3"},
                                                     {"four_bar/windows", "1.2"}};
  const TemporaryFolder folder;
  int files = 0;
  for (const std::string& name : gallery()) {
#ifdef __SANITIZE_ADDRESS__
    if (files % 8 != 0 && ++files) continue;  // twenty times slower: every eighth file is enough for the sanitizers
#endif
    std::vector<std::string> arguments{"check", file_of(name).string(), "--out",
                                       folder.file("out" + std::to_string(files++)), "--quiet"};
    if (const auto found = end_times.find(name); found != end_times.end())
      arguments.insert(arguments.end(), {"--set", "simulation.end_time=" + found->second});
    const CommandOutcome outcome = run_command(arguments);
    INFO(name << "\n" << outcome.out << outcome.err);
    CHECK(outcome.exit_code == kDone);
  }
  CHECK(files >= 30);
}

// ../shared/cases.md: two models, halved steps agree to 1e-12 (angles) and 1e-10 (rates). The published end point (IVP
// test set) is good to 1e-10 and 1e-8.
TEST_CASE("A03: Andrews' mechanism is right at 0.03 s to 1e-9", "[gallery]") {
  Problem problem = accurately("andrews/simulate", 1e-12);
  Scene& scene = problem.scene;
  scene.simulation.end_time = 0.03;
  Eigen::VectorXd rho(static_cast<Eigen::Index>(scene.parameters.size()));
  for (std::size_t k = 0; k < scene.parameters.size(); ++k)
    rho(static_cast<Eigen::Index>(k)) = scene.parameters[k].value;
  const Mechanism mechanism(scene, rho);
  const std::map<std::string, double> expected{
      {"beta", 15.8107711951538},     {"theta", -15.756371058412},    {"gamma", 0.0408222401196468},
      {"phi", -0.534730116342077},    {"delta", 0.524409965879955},   {"Omega", 0.534730116342077},
      {"eps", 1.04808074104194},      {"beta_rate", 1139.9203022591}, {"theta_rate", -1424.3792951775},
      {"gamma_rate", 11.0329119106},  {"phi_rate", 19.2933741050},    {"delta_rate", 0.5735699148},
      {"Omega_rate", -19.2933741050}, {"eps_rate", 0.3231791492}};
  bool reached = false;
  const Sampling sampling{{0.03}, [&](std::size_t, const StatePoint& at) {
                            reached = true;
                            for (const auto& [sensor, value] : expected) {
                              INFO(sensor);
                              const double found = mechanism.sensor_value(mechanism.sensor(sensor), at);
                              CHECK(std::abs(found - value) < 1e-9 * std::max(1.0, std::abs(value)));
                            }
                          }};
  const SimulationResult run = simulate(mechanism, scene.simulation, {}, sampling);
  INFO(run.message);
  REQUIRE(run.ok());
  CHECK(reached);
  CHECK(run.statistics.max_position_violation < 1e-12);
}

TEST_CASE("a planar loop of spatial revolutes: validate names the joint with redundant equations", "[gallery]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"validate", file_of("four_bar/redundant").string(), "--out", folder.file("out")});
  CHECK(outcome.exit_code == kDone);
  CHECK(outcome.out.find("23 equations of rank 20, 1 degree of freedom") != std::string::npos);
  CHECK(outcome.out.find("redundant: D (3 of 5)") != std::string::npos);
}

TEST_CASE("slider-crank timing, four-bar path syntheses and a balanced four-bar reach designs that meet their aims",
          "[gallery]") {
  const TemporaryFolder folder;
  struct Case {
    std::string name, objective;
    double at_most;
    std::map<std::string, double> design;  // the one the aims were made with, where it is the only one
  };
  const std::vector<Case> cases{
      {"slider_crank/timing", "timing", 1e-9, {{"r", 0.12}, {"rod_length", 0.4}, {"e", 0.03}, {"phase", 0.3}}},
      {"four_bar/path_synthesis", "path", 1e-4, {}},         // aims rounded to 0.1 mm: 9 points, 1e3 per m^2
      {"synthesis/eighteen_points", "path", 0.0099120, {}},  // the published value, docs/synthesis.md
      // Berkof and Lowen's counterweights: m_coupler/m L/2 of each link beyond its pivot
      {"four_bar/balanced", "unbalance", 1e-12, {{"crank_com", -0.25}, {"rocker_com", -0.4375}}}};
  for (const Case& c : cases) {
    const std::string out = folder.file(fs::path(c.name).filename().string());
    const CommandOutcome outcome = run_command({"design", file_of(c.name).string(), "--out", out, "--quiet"});
    INFO(c.name << "\n" << outcome.out << outcome.err);
    CHECK(outcome.exit_code == kDone);
    const auto result = json_of(fs::path(out) / "result.json");
    CHECK(result.at("optimizer").at("status") == "converged");
    CHECK(result.at("objectives").at(c.objective).at("value").get<double>() < c.at_most);
    for (const auto& [name, value] : c.design)
      CHECK(result.at("parameters").at(name).at("value").get<double>() == Approx(value).epsilon(1e-5));
  }
}
