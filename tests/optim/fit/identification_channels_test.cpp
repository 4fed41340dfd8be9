// Channels of one experiment: sampled at different times, and replaced drives.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "optim/fit/identification.hpp"
#include "tests/optim/repetitions.hpp"

using namespace mbsopt;
using Catch::Matchers::Contains;

TEST_CASE("channels may be sampled at times of their own", "[identification]") {
  // The angle every 20 ms, the rate every 70 ms: cells of the other are empty, and few rows have both.
  Problem p = pendulum::problem(64.4, 0.06, 1.5, 1.5);
  p.scene.sensors.push_back(p.scene.sensors[0]);
  p.scene.sensors[1].name = "omega", p.scene.sensors[1].quantity = "rate";
  p.identification.emplace();
  p.identification->variables = {"w2", "c"};
  p.identification->experiments = {pendulum::experiment("run1", {"theta0", "omega0"})};
  ChannelSpec rate;
  rate.column = "omega", rate.sensor = "omega", rate.sigma = 0.1;
  p.identification->experiments[0].channels.push_back(rate);
  const CsvTable fine = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2.1, 1);
  CsvTable data;
  data.name = "mixed", data.header = {"t", "theta", "omega"}, data.columns.resize(3);
  for (std::size_t ms = 0; ms <= 2000; ms += 10) {
    if (ms % 20 != 0 && ms % 70 != 0) continue;
    data.columns[0].push_back(1e-3 * static_cast<double>(ms));
    data.columns[1].push_back(ms % 20 == 0 ? fine.columns[1][ms] : std::numeric_limits<double>::quiet_NaN());
    const double omega = ms == 0 ? 1.55
                                 : (8 * (fine.columns[1][ms + 1] - fine.columns[1][ms - 1]) -
                                    (fine.columns[1][ms + 2] - fine.columns[1][ms >= 2 ? ms - 2 : 0])) /
                                       12e-3;  // of fourth order in 1 ms
    data.columns[2].push_back(ms % 70 == 0 ? omega : std::numeric_limits<double>::quiet_NaN());
    data.lines.push_back(data.lines.size() + 2);
  }
  const IdentificationResult result = run_identification(p, {data});
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(result.parameters[0].value == Approx(64).epsilon(1e-6));
  const auto& channels = result.experiments[0].channels;
  CHECK(channels[0].samples == 101);
  CHECK(channels[1].samples == 29);
  CHECK(channels[0].missing == data.rows() - 101);
  CHECK(channels[1].rms < 1e-5);
  CHECK(result.samples == 130);
}

TEST_CASE("an experiment follows the law of its own that it gives a drive", "[identification][drives]") {
  // A base is driven, a weight of 2 kg follows on spring and damper; each run has another motion of the base.
  Problem p = repetitions::slider(80, 3);
  Body base = p.scene.bodies[0];
  base.name = "base", base.position = {-1.0, 0.0, 0.0};
  p.scene.bodies.push_back(base);
  Joint rail = p.scene.joints[0];
  rail.name = "track", rail.body2 = "base", rail.point1 = VectorField{-1.0, 0.0, 0.0};
  p.scene.joints.push_back(rail);
  Drive drive;
  drive.name = "shaker", drive.type = "displacement", drive.joint = "track", drive.law = Expression::parse("0.1*t^2");
  p.scene.drives = {drive};
  Tsda& spring = std::get<Tsda>(p.scene.forces[0].kind);
  spring.body1 = "base", spring.point1 = VectorField{0.0, 0.0, 0.0}, spring.free_length = 1.0;
  p.scene.parameters[2].value = 0;  // x0
  p.scene.conditions[0].rate = 0.0;
  p.identification.emplace();
  p.identification->variables = {"k", "c"};
  p.identification->experiments = {repetitions::slider_run("run1", {}), repetitions::slider_run("run2", {})};
  p.identification->experiments[1].drives = {{"shaker", Expression::parse("0.05*t^3"), {}}};

  // 2 x'' = -k (x - b) - c (x' - b'), k = 100, c = 4, by classical Runge-Kutta steps of 1 ms.
  const auto record = [](auto b, auto bdot) {
    CsvTable table;
    table.name = "shaken", table.header = {"t", "x"}, table.columns.resize(2);
    double x = 0, v = 0;
    constexpr double h = 1e-3;
    const auto f = [&](double t, double q, double u) { return (-100 * (q - b(t)) - 4 * (u - bdot(t))) / 2; };
    for (int i = 0; i <= 2000; ++i) {
      const double t = i * h;
      if (i % 20 == 0) {
        table.columns[0].push_back(t), table.columns[1].push_back(x);
        table.lines.push_back(table.lines.size() + 2);
      }
      const double v1 = v, a1 = f(t, x, v1), v2 = v + h / 2 * a1, a2 = f(t + h / 2, x + h / 2 * v1, v2);
      const double v3 = v + h / 2 * a2, a3 = f(t + h / 2, x + h / 2 * v2, v3), v4 = v + h * a3;
      const double a4 = f(t + h, x + h * v3, v4);
      x += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4), v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
    return table;
  };
  const CsvTable one = record([](double t) { return 0.1 * t * t; }, [](double t) { return 0.2 * t; });
  const CsvTable two = record([](double t) { return 0.05 * t * t * t; }, [](double t) { return 0.15 * t * t; });
  const IdentificationResult result = run_identification(p, {one, two});
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(result.parameters[0].value == Approx(100).epsilon(1e-5));
  CHECK(result.parameters[1].value == Approx(4).epsilon(1e-5));
  CHECK(result.experiments[1].rms < 1e-6);
  p.identification->experiments[1].drives[0].drive = "shaken";
  CHECK_THROWS_WITH(run_identification(p, {one, two}),
                    Contains("identification.experiments[1].drives[0].drive: there is no drive 'shaken'"));
}
