#include "core/start/law_jumps.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "core/mechanism/mechanism.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// What is said of the law of a drive that turns a rod, between two times.
std::string words_about(const std::string& law, double from = 0, double to = 1) {
  Scene s;
  s.bodies.push_back(plain_body("rod", 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  Joint hinge;
  hinge.name = "hinge", hinge.type = "revolute", hinge.body1 = "ground", hinge.body2 = "rod";
  hinge.axis1 = hinge.axis2 = vec("0", "0", "1");
  s.joints.push_back(hinge);
  Drive motor;
  motor.name = "motor", motor.type = "angle", motor.joint = "hinge", motor.law = Expression::parse(law);
  s.drives.push_back(motor);
  const Mechanism mechanism(s, Eigen::VectorXd());
  return LawJumps(mechanism.data()).between(from, to);
}

}  // namespace

TEST_CASE("the end of a steep ramp is no jump of the rate, a kink is one", "[law_jumps]") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(0.2, 0.8), exponent(-5, -3);
  for (int i = 0; i < 4000; ++i) {
    const double begin = place(random), width = std::pow(10, exponent(random));
    const std::string x = fmt::format("min(1, max(0, (t - {:.17g})/{:.17g}))", begin, width);
    const double end = begin + width, from = end - 0.1 * place(random), to = end + 0.1 * place(random);
    INFO(x << " from " << from << " to " << to);
    CHECK(words_about(fmt::format("0.7*t + 0.2*({0})^2*(3 - 2*({0}))", x), from, to).empty());
  }
  for (int i = 0; i < 50; ++i) {
    const double t = place(random);
    INFO(t);
    CHECK_THAT(words_about(fmt::format("0.7*t + 1e-4*max(0, t - {:.17g})", t)),
               Catch::Contains("changes its rate by 0.0001 1/s"));
  }
}
