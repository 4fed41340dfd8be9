// Bodies that spin fast, against closed forms.
#include <boost/math/special_functions/ellint_1.hpp>
#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <numbers>

#include "tests/extremes/problem_runs.hpp"

using namespace mbsopt;
using namespace mbsopt::extremes;

// Landau, Lifshitz, "Mechanics" (1976), section 37, for M^2 > 2 E I2; tau = K(k) at the start, where w1 = 0.
TEST_CASE("a free body flung about its middle axis tumbles by Jacobi's elliptic functions", "[extremes]") {
  const double I1 = 0.2, I2 = 0.3, I3 = 0.4, w2 = 100, w3 = GENERATE(1.0, 1e-2, 1e-4);
  const double twice_E = I2 * w2 * w2 + I3 * w3 * w3;
  const double a = (I3 - I1) * I3 * w3 * w3;                  // M^2 - 2 E I1 - (I2 - I1) I2 w2^2
  const double b = (I3 - I2) * I2 * w2 * w2;                  // 2 E I3 - M^2
  const double c = (I2 - I1) * I2 * w2 * w2 + a;              // M^2 - 2 E I1
  const double complement = (I3 - I2) * a / ((I3 - I2) * c);  // 1 - k^2 = ((I3-I2) c - (I2-I1) b)/((I3-I2) c)
  const double k = std::sqrt(1 - complement), speed = std::sqrt((I3 - I2) * c / (I1 * I2 * I3));
  const double K = boost::math::ellint_1(k), period = 4 * K / speed;
  REQUIRE(twice_E > 0);

  Json p = problem("tumbling");
  p["gravity"] = {0, 0, 0};
  p["bodies"] = {{{"name", "body"}, {"mass", 1}, {"inertia", {I1, I2, I3}}, {"angular_velocity", {0, w2, w3}}}};
  p["simulation"]["end_time"] = period * GENERATE(0.37, 1.1);
  for (const char* axis : {"x", "y", "z"}) {
    p["sensors"][axis] = {{"quantity", "angular_velocity"}, {"body", "body"}, {"frame", "body"}, {"component", axis}};
    p["objectives"][axis] = {{"terminal", axis}};
  }
  set_accuracy(p, "dopri853", 1e-13);
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE(run.ok());
  const double tau = K + speed * p["simulation"]["end_time"].get<double>();
  double cn = 0, dn = 0;
  const double sn = boost::math::jacobi_elliptic(k, tau, &cn, &dn);
  // cn(K + u) < 0 for small u > 0, and so is w1' = (I2 - I3) w2 w3/I1.
  INFO("k = " << k << ", 1 - k^2 = " << complement);
  // Near the unstable axis an error grows as exp(speed t): what rtol leaves, times that growth over a quarter period.
  const double growth = std::exp(std::min(K, speed * p["simulation"]["end_time"].get<double>()));
  const double bound = 1e-11 * w2 * std::max(1.0, growth);
  CHECK(std::abs(run("x") - std::sqrt(b / (I1 * (I3 - I1))) * cn) < bound);
  CHECK(std::abs(run("y") - std::sqrt(b / (I2 * (I3 - I2))) * sn) < bound);
  CHECK(std::abs(run("z") - std::sqrt(c / (I3 * (I3 - I1))) * dn) < bound);
  CHECK(run.statistics().energy_drift < 1e-9 * twice_E / 2);
}

// Steady precession: (I3 w3 - I1 W cos(theta)) W sin(theta) = m g l sin(theta), I1 about the tip, w3 the whole spin
// about the axis. Goldstein, "Classical Mechanics" (1980), section 5-7.
TEST_CASE("a top of 1000 rad/s precesses steadily", "[extremes]") {
  const double m = 0.5, g = 9.81, l = 0.1, I3 = 4e-4, I1 = 6e-4 + m * l * l, theta = 0.6, w3 = 1000;
  const double A = I1 * std::cos(theta), B = I3 * w3, C = m * g * l;  // A W^2 - B W + C = 0, the slow root
  const double W = 2 * C / (B + std::sqrt(B * B - 4 * A * C));
#ifdef __SANITIZE_ADDRESS__
  const double end = 0.2;
#else
  const double end = 2;
#endif
  Json p = problem("top");
  p["gravity"] = {0, 0, -g};
  // The axis leans by theta in the x-z plane: angular velocity W z + (w3 - W cos(theta)) axis.
  const double s = w3 - W * std::cos(theta);
  p["bodies"] = {{{"name", "top"},
                  {"mass", m},
                  {"com", {0, 0, l}},
                  {"inertia", {6e-4, 6e-4, I3}},
                  {"orientation", {{"axis", {0, 1, 0}}, {"angle", theta}}},
                  {"angular_velocity", {s * std::sin(theta), 0, W + s * std::cos(theta)}},
                  {"points", {{"centre", {0, 0, l}}}}}};
  p["joints"] = {{{"name", "tip"},
                  {"type", "spherical"},
                  {"body1", "ground"},
                  {"body2", "top"},
                  {"point1", {0, 0, 0}},
                  {"point2", "O"}}};
  for (const char* axis : {"x", "y", "z"}) {
    p["sensors"][axis] = {{"quantity", "position"}, {"body", "top"}, {"point", "centre"}, {"component", axis}};
    p["objectives"][axis] = {{"terminal", axis}};
  }
  p["simulation"]["end_time"] = end;
  set_accuracy(p, "dopri853", 1e-10);
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(std::abs(run("x") - l * std::sin(theta) * std::cos(W * end)) < 1e-6 * l);
  CHECK(std::abs(run("y") - l * std::sin(theta) * std::sin(W * end)) < 1e-6 * l);
  CHECK(std::abs(run("z") - l * std::cos(theta)) < 1e-6 * l);
}
