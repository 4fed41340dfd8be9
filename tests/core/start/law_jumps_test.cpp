#include "core/start/law_jumps.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "core/mechanism/mechanism.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// Returns the objection to the law of a drive that turns a rod, between two times.
std::string words_about(const std::string& law, double from, double to) {
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

TEST_CASE("the end of a steep ramp is no jump of the rate, wherever the search for one ends", "[law_jumps]") {
  // Begin and width of the ramp, and an interval around its end.
  const double cases[][4] = {{0.6304, 0.0001648, 0.601549, 0.635429}, {0.6304, 0.0001648, 0.604711, 0.632621},
                             {0.4389, 0.0002713, 0.420882, 0.459402}, {0.4389, 0.0002713, 0.424109, 0.455589},
                             {0.2415, 0.0001476, 0.230571, 0.245941}, {0.2415, 0.0001476, 0.215128, 0.251948}};
  for (const auto& [begin, width, from, to] : cases) {
    const std::string x = fmt::format("min(1, max(0, (t - {})/{}))", begin, width);
    INFO(x << " from " << from << " to " << to);
    CHECK(words_about(fmt::format("0.5*sin(2*t)^2 + 0.2*({0})^2*(3 - 2*({0}))", x), from, to).empty());
  }
}

TEST_CASE("a kink of a law is a jump of its rate", "[law_jumps]") {
  const double t = GENERATE(0.25, 0.3141, 0.5, 0.77777);
  CHECK_THAT(words_about(fmt::format("0.7*t + 1e-4*max(0, t - {})", t), 0, 1),
             Catch::Contains("changes its rate by 0.0001 1/s"));
}
