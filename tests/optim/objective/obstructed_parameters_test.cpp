#include "optim/objective/obstructed_parameters.hpp"

#include <catch2/catch.hpp>

#include "optim/objective/evaluator.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

// A coupler on three parallel cranks: it closes only where all three have one length.
Scene three_cranks(const std::string& third) {
  Scene s;
  add_parameters(s, {{"L", 1.0}, {"free", 1.0}, {"width", 2.0}});
  s.gravity = vec("0", "-9.81", "0");
  const std::string lengths[] = {"L", "L", third}, at[] = {"0", "width/2", "width"};
  for (int i = 0; i < 3; ++i) {
    const std::string crank = fmt::format("crank{}", i);
    s.bodies.push_back(plain_body(crank, 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec(at[i], "0", "0")));
    s.bodies.back().orientation = turned("1");
  }
  s.bodies.push_back(plain_body("coupler", 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec("L*cos(1)", "L*sin(1)", "0")));
  for (int i = 0; i < 3; ++i) {
    const std::string crank = fmt::format("crank{}", i);
    s.joints.push_back(hinge(fmt::format("low{}", i), "ground", vec(at[i], "0", "0"), crank, vec("0", "0", "0")));
    s.joints.push_back(
        hinge(fmt::format("high{}", i), crank, vec(lengths[i], "0", "0"), "coupler", vec(at[i], "0", "0")));
  }
  s.sensors.push_back(point_sensor("x", "position", "coupler", vec("0", "0", "0"), "x"));
  s.simulation.end_time = 0.2;
  return s;
}

std::vector<Objective> end_of_x() {
  ObjectiveSpec spec;
  spec.name = "end", spec.terminal = f("x");
  return {Objective(three_cranks("L"), spec)};
}

}  // namespace

TEST_CASE("a parameter for which a redundant loop closes only once is an error that names it", "[gradient]") {
  const GradientMethod method = GENERATE(GradientMethod::tlm, GradientMethod::adjoint, GradientMethod::differences);
  EvaluatorOptions options;
  options.method = method;
  Evaluator evaluator(three_cranks("free"), end_of_x(), {}, options);
  CHECK(evaluator.values(evaluator.start()).ok);
  VectorXd locked = evaluator.start();
  locked(1) *= 1.01;
  CHECK_THROWS_WITH(evaluator.gradients(locked), Catch::Contains("parameters.free"));
  CHECK_THROWS_WITH(evaluator.gradients(evaluator.start()),
                    Catch::Contains("parameters.free") && !Catch::Contains("parameters.width"));
}

TEST_CASE("what the loop follows, and what is not varied, is no error", "[gradient]") {
  Evaluator one_length(three_cranks("L"), end_of_x(), {"L", "width"});
  CHECK(one_length.gradients(one_length.start()).ok);
  Evaluator fixed(three_cranks("free"), end_of_x(), {"width"});
  CHECK(fixed.gradients(fixed.start()).ok);
}
