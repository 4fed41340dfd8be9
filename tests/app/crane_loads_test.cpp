// crane/loads.json: signals, drives, initial conditions and end times of cases, a schedule as a table of time, sway and
// settling. The reference integrates the pendulum on the moving trolley in small fixed steps that end at all kinks.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "app/terminal/exit_code.hpp"
#include "core/expression/curve.hpp"
#include "optim/problem/csv_table.hpp"
#include "source_folder.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

Curve curve(const std::string& file, const std::string& time, double factor, const std::string& column,
            double column_factor, Interpolation how) {
  const CsvTable table = read_csv(MBSOPT_SOURCE_DIR "/data/crane/" + file);
  std::vector<double> t = table.column(time), x = table.column(column);
  const double first = t[0];
  for (double& value : t) value = factor * (value - first);
  for (double& value : x) value *= column_factor;
  return Curve(how, t, x);
}

struct CraneCase {
  std::string name, travel = "trolley.csv", wind = "breeze.csv";
  double m = 500, theta = 0, end = 6;
};

struct Expected {
  double effort = 0, highest = -1, lowest = 1, settled = 0;
};

//   L theta'' = -g sin(theta) + (wind(t)/m - x''(t)) cos(theta) - b(t) theta'/(m L)      by RK4
Expected expected(const CraneCase& c, const std::array<double, 3>& b) {
  constexpr double g = 9.81, L = 2, h = 2.5e-4;
  const Curve travel = curve(c.travel, "t", 1, "x", 1, Interpolation::spline);
  const Curve wind = curve(c.wind, "stamp", 1e-3, "wind [kN]", 1e3, Interpolation::hold);
  const Curve schedule(Interpolation::linear, {0, 2, 4, 6}, {b[0], b[1], b[2], b[2]});
  using State = std::array<double, 3>;  // theta, its rate, the effort
  double F = 0;                         // in a step the wind is that of its middle
  const auto rate = [&](double t, const State& y) {
    const double brake = schedule.at(t) * y[1];
    const double theta_tt =
        (-g * std::sin(y[0]) + (F / c.m - travel.at(t, 2)) * std::cos(y[0]) - brake / (c.m * L)) / L;
    const double off = L * std::sin(y[0]);
    return State{y[1], theta_tt, 1e-4 * brake * brake + 100 * off * off};
  };
  const auto moved = [](const State& y, double step, const State& k) {
    return State{y[0] + step * k[0], y[1] + step * k[1], y[2] + step * k[2]};
  };
  State y{c.theta, 0, 0};
  Expected result;
  const long steps = std::lround(c.end / h);
  for (long i = 0; i <= steps; ++i) {
    const double t = static_cast<double>(i) * h, window = std::clamp((t - 4.8) / 0.2, 0.0, 1.0);
    result.highest = std::max(result.highest, y[0]), result.lowest = std::min(result.lowest, y[0]);
    result.settled = std::max(result.settled, window * std::abs(y[0]));
    F = wind.at(t + h / 2);
    const State k1 = rate(t, y), k2 = rate(t + h / 2, moved(y, h / 2, k1)), k3 = rate(t + h / 2, moved(y, h / 2, k2)),
                k4 = rate(t + h, moved(y, h, k3));
    if (i == steps) break;
    for (std::size_t k = 0; k < 3; ++k) y[k] += h / 6 * (k1[k] + 2 * k2[k] + 2 * k3[k] + k4[k]);
  }
  result.effort = y[2];
  return result;
}

std::vector<CraneCase> crane_cases() {
  std::vector<CraneCase> cases(5);
  cases[0].name = "planned";
  cases[1].name = "light", cases[1].m = 250;
  cases[2].name = "gusty", cases[2].wind = "gusts.csv";
  cases[3].name = "swinging", cases[3].theta = 5 * std::numbers::pi / 180;
  cases[4].name = "slow", cases[4].travel = "slow.csv", cases[4].end = 5.8;
  return cases;
}

constexpr const char* kSettled = "maximum_of table(t, [0, 4.8, 5, 6], [0, 0, 1, 1])*abs(swing)";

}  // namespace

TEST_CASE("crane/loads: effort, sway and settling of each case are those of its equation", "[gallery][cases]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"simulate", file_of("crane/loads").string(), "--out", folder.file("out"), "--quiet"});
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const nlohmann::json cases = json_of(folder.path / "out/result.json").at("cases");
  for (const CraneCase& c : crane_cases()) {
    INFO(c.name);
    const Expected e = expected(c, {500, 1000, 2000});
    const nlohmann::json& found = cases.at(c.name).at("objectives");
    CHECK(found.at("effort").at("value").get<double>() == Approx(e.effort).epsilon(1e-7));
    // The reference looks at its steps only, peaks lie between them: h^2 theta''/8 = 2e-8.
    CHECK(found.at("peak_to_peak_of swing").at("true_value").get<double>() ==
          Approx(e.highest - e.lowest).epsilon(1e-6));
    CHECK(found.at(kSettled).at("true_value").get<double>() == Approx(e.settled).epsilon(1e-5));
  }
}

TEST_CASE("crane/loads: at the optimum sway and settling keep their limits in each case", "[gallery][cases]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome = run_command(
      {"design", file_of("crane/loads").string(), "--out", folder.file("out"), "--quiet", "--threads", "2"});
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const nlohmann::json result = json_of(folder.path / "out/result.json");
  CHECK(result.at("optimizer").at("status") == "converged");
  const auto value = [&](const char* name) { return result.at("parameters").at(name).at("value").get<double>(); };
  double sum = 0, sway = 0, settled = 0;
  for (const CraneCase& c : crane_cases()) {
    const Expected e = expected(c, {value("b1"), value("b2"), value("b3")});
    sum += (c.name == "gusty" ? 0.5 : 1) * e.effort;
    sway = std::max(sway, e.highest - e.lowest), settled = std::max(settled, e.settled);
  }
  CHECK(result.at("objectives").at("effort").at("value").get<double>() == Approx(sum).epsilon(1e-6));
  CHECK(sway <= 0.45 * (1 + 1e-7));  // of the reference's own error
  CHECK(settled <= 6 * std::numbers::pi / 180 * (1 + 1e-7));
  CHECK(sway > 0.45 * (1 - 1e-4));
  CHECK(settled > 6 * std::numbers::pi / 180 * (1 - 1e-4));
}
