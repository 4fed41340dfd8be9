// A regression test in a project's own Catch2: derivatives of its force and of what it minimises.
#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>
#include <mbsopt/mbsopt.hpp>

#include "drag.hpp"

TEST_CASE("the gradients of the pendulum with drag agree by all methods") {
  const mbsopt::Problem problem = mbsopt::read_problem(PENDULUM);
  mbsopt::GradientCheckOptions options;
  options.user_forces = {std::make_shared<Drag>()};
  const mbsopt::GradientCheck check = mbsopt::check_gradients(problem, options);
  INFO(check.message);
  for (const std::string& wrong : check.wrong_terms) FAIL_CHECK(wrong);
  CHECK(check.passed());
  CHECK((check.tlm - check.adjoint).cwiseAbs().maxCoeff() < 1e-10);
}
