// Designs of the gallery whose answers are known.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "app/json/read_problem.hpp"
#include "app/terminal/exit_code.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

nlohmann::json designed(const std::string& name, const std::vector<std::string>& sets = {}) {
  const TemporaryFolder folder;
  std::vector<std::string> arguments{"design", file_of(name).string(), "--out", folder.file("out")};
  for (const std::string& set : sets) arguments.insert(arguments.end(), {"--set", set});
  const CommandOutcome outcome = run_command(arguments);
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  return json_of(folder.path / "out/result.json");
}

double value(const nlohmann::json& result, const char* parameter) {
  return result.at("parameters").at(parameter).at("value").get<double>();
}

// Watt's governor of governor/spring.json at rest in the frame that turns at Omega; theta: of the arms. Potential:
//   V = 2 m g z_b + M g z_s + (1/2) k (l - free)^2 - Omega^2 (m r_b^2 + I_x sin^2 + I_z cos^2),   l = top - z_s
struct TurningGovernor {
  double g = 9.81, eye = 0.03, top = 0.5, arm = 0.3, pin = 0.18, rod = 0.2, m = 1.5, M = 2, I_x = 0.002, I_z = 0.001;

  double height(double theta) const {
    return top - pin * std::cos(theta) - std::sqrt(rod * rod - std::pow(pin * std::sin(theta), 2));
  }
  double theta(double wanted_height) const {
    double low = 0, high = 1.5;
    for (int i = 0; i < 100; ++i) {
      const double middle = (low + high) / 2;
      (height(middle) < wanted_height ? low : high) = middle;
    }
    return low;
  }
  // k (l - free) from dV/dtheta = 0.
  double spring_force(double wanted_height, double Omega) const {
    const double t = theta(wanted_height), s = std::sin(t), c = std::cos(t);
    const double z_t = pin * s + pin * pin * s * c / std::sqrt(rod * rod - pin * pin * s * s);
    return (2 * m * g * arm * s + M * g * z_t - 2 * m * (eye + arm * s) * arm * c * Omega * Omega -
            2 * (I_x - I_z) * s * c * Omega * Omega) /
           z_t;
  }
};

}  // namespace

TEST_CASE("four_bar/reaction_limit: the true peak of the joint's force is at most 33 N", "[gallery]") {
  const std::string type = GENERATE("ipopt", "slsqp", "mma");
  INFO(type);
  const nlohmann::json result = designed("four_bar/reaction_limit", {"design.optimizer.type=" + type});
  CHECK(result.at("optimizer").at("status") == "converged");
  // The motion of the design, sampled far more densely than the run that judged it.
  Problem problem = read_problem(file_of("four_bar/reaction_limit"));
  Eigen::VectorXd rho(static_cast<Eigen::Index>(problem.scene.parameters.size()));
  for (std::size_t k = 0; k < problem.scene.parameters.size(); ++k)
    rho(static_cast<Eigen::Index>(k)) = value(result, problem.scene.parameters[k].name.c_str());
  SimulationSettings settings = problem.scene.simulation;
  const Mechanism mechanism(problem.scene, rho);
  const int F = mechanism.sensor("F");
  double peak = 0;
  Sampling sampling;
  constexpr int kSamples = 150000;
  for (int i = 0; i <= kSamples; ++i) sampling.times.push_back(settings.end_time * i / kSamples);
  sampling.observe = [&](std::size_t, const StatePoint& at) { peak = std::max(peak, mechanism.sensor_value(F, at)); };
  REQUIRE(simulate(mechanism, settings, {}, sampling).ok());
  CHECK(peak <= 33);
  CHECK(peak > 33 * (1 - 2e-6));
}

TEST_CASE("quarter_car/loads: the worst comfort of four cases is least, the travel is held in each", "[gallery]") {
  const nlohmann::json result = designed("quarter_car/loads");
  CHECK(result.at("optimizer").at("status") == "converged");
  struct Load {
    double m, c_factor, h;
  };
  const std::map<std::string, Load> loads{
      {"empty", {250, 1, 0.05}}, {"loaded", {420, 1, 0.04}}, {"cold", {300, 1.3, 0.05}}, {"worn", {300, 0.6, 0.03}}};
  double worst = 0, longest = 0;
  CHECK(result.at("cases").size() == 4);
  for (const auto& [name, of_case] : result.at("cases").items()) {
    const nlohmann::json& travel = of_case.at("objectives").at("maximum_of 0.5 - strut_length");
    CHECK(travel.at("true_value").get<double>() <= 0.04);
    longest = std::max(longest, travel.at("true_value").get<double>());
    const double comfort = of_case.at("objectives").at("comfort").at("value").get<double>();
    worst = std::max(worst, comfort);
    // h^2/2 (k_t c/m^2 + (m + m_w) k^2/(m^2 c)), the integral over a road's step h by Parseval's theorem
    const auto [m, c_factor, h] = loads.at(name);
    const double k = value(result, "k"), c = c_factor * value(result, "c");
    CHECK(comfort == Approx(h * h / 2 * (180000 * c + (m + 40) * k * k / c) / (m * m)).epsilon(1e-6));
  }
  CHECK(longest > 0.04 * (1 - 2e-6));
  const nlohmann::json& comfort = result.at("objectives").at("comfort");
  CHECK(comfort.at("true_value").get<double>() == Approx(worst).epsilon(1e-12));
  CHECK(comfort.at("value").get<double>() >= worst);
}

TEST_CASE("governor/spring: the spring is that of the statics in the turning frame", "[gallery]") {
  const TurningGovernor governor;
  const double slow = governor.spring_force(0.20, 9), fast = governor.spring_force(0.26, 12);
  const double k = (slow - fast) / 0.06, free = governor.top - 0.20 - slow / k;
  CHECK(k == Approx(339.4776777870).epsilon(1e-11));
  const auto result = designed("governor/spring", {"simulation.integrator.rtol=1e-7"});
  CHECK(value(result, "k") == Approx(k).epsilon(1e-5));  // what is left of the motion at the sampling times
  CHECK(value(result, "free") == Approx(free).epsilon(1e-6));
}

TEST_CASE("double_wishbone/hard_points: the given suspension is found again", "[gallery]") {
  const std::string type = GENERATE("ipopt", "slsqp", "lbfgs");
  const auto result = designed("double_wishbone/hard_points", {"design.optimizer.type=" + type});
  CHECK(result.at("optimizer").at("type") == type);
  CHECK(value(result, "upper_y") == Approx(0.42).epsilon(1e-6));
  CHECK(value(result, "upper_z") == Approx(0.47).epsilon(1e-6));
  CHECK(value(result, "tie_z") == Approx(0.28).epsilon(1e-6));
}

// Reference: the true minimax at a mass ratio of 0.05, where Den Hartog's rule has 6.40844.
TEST_CASE("damper/absorber: both resonances are equally high, at the least height", "[gallery]") {
  const auto result = designed("damper/absorber", {});
  CHECK(result.at("optimizer").at("status") == "converged");
  CHECK(result.at("optimizer").at("objective_final").get<double>() * 360000 == Approx(6.40792).epsilon(2e-6));
}

// Reference: as below, both peaks by Newton's method, and golden section searches in c and in k.
TEST_CASE("quarter_car/compromise: the sum of comfort and strokes is least where the linear system has it",
          "[gallery]") {
  const auto result = designed("quarter_car/compromise", {});
  const nlohmann::json& optimizer = result.at("optimizer");
  CHECK(optimizer.at("status") == "converged");
  CHECK(optimizer.at("objective_final").get<double>() == Approx(48.6917157937).epsilon(1e-7));
  CHECK(value(result, "k") == Approx(17969.33).epsilon(1e-4));
  CHECK(value(result, "c") == Approx(6555.583).epsilon(1e-5));
  CHECK(result.at("objectives").at("comfort").at("value").get<double>() == Approx(16.62155169).epsilon(1e-5));
  const nlohmann::json& stroke = result.at("objectives").at("maximum_of 0.5 - strut_length");
  CHECK(stroke.at("true_value").get<double>() == Approx(0.028987309).epsilon(1e-5));
}

// Reference: the linear system by its matrix exponential, the peak of its travel by Newton's method, comfort by a
// Lyapunov equation, and a golden section search along the limit.
TEST_CASE("quarter_car/ride: the optimum is that of the linear system, with the true travel at its limit",
          "[gallery]") {
  constexpr double kComfort = 11.7692155910, kStiffness = 30239.5612, kDamping = 4306.6152;
  const std::string type = GENERATE("ipopt", "slsqp", "mma", "cobyla");
  INFO(type);
  const auto result = designed("quarter_car/ride", {"design.optimizer.type=" + type});
  CHECK(result.at("objectives").at("comfort").at("initial").get<double>() == Approx(8.916666667).epsilon(1e-8));
  const double comfort = result.at("objectives").at("comfort").at("value").get<double>();
  CHECK(comfort > kComfort);
  CHECK(comfort < kComfort * (1 + 2e-6));
  CHECK(value(result, "c") == Approx(kDamping).epsilon(1e-3));  // the objective is flat along the limit
  CHECK(value(result, "k") == Approx(kStiffness).epsilon(1e-3));
  const double travel = result.at("objectives").at("travel").at("true_value").get<double>();
  CHECK(travel <= 0.035);
  CHECK(travel > 0.035 * (1 - 2e-6));
  CHECK(result.at("objectives").at("travel").at("at_bound") == "upper");
  CHECK(result.at("objectives").at("grip").at("at_bound").is_null());
}
