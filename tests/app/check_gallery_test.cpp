// Checks of right gradients pass, whatever jumps the steps of differences make.
#include <catch2/catch.hpp>
#include <string>

#include "app/json/read_problem.hpp"
#include "optim/check/gradient_check.hpp"
#include "tests/app/gallery_files.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

struct Checked {
  std::string file, integrator;
  double rtol, atol;
};

}  // namespace

TEST_CASE("right gradients pass the check at loose tolerances, where free differences jump", "[check][gallery]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Checked c = GENERATE(
      Checked{"friction/ramp", "dopri5", 1e-4, 1e-6}, Checked{"double_pendulum/gradient", "dopri5", 3e-5, 3e-5},
      Checked{"pendulum/driven_torque", "dopri5", 1e-3, 1e-3}, Checked{"pendulum/driven_torque", "dopri5", 1e-5, 1e-5},
      Checked{"pendulum/driven_torque", "bs3", 1e-4, 1e-6}, Checked{"five_bar/design", "dopri853", 1e-4, 1e-6});
  Problem problem = read_problem(file_of(c.file), {"simulation.integrator={}"});
  IntegratorSettings& integrator = problem.scene.simulation.integrator;
  integrator = {}, integrator.type = c.integrator, integrator.rtol = c.rtol, integrator.atol = c.atol;
  GradientCheckOptions options;
  options.timing = {1, 1, 0};
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  for (const CheckedEntry& e : check.entries) {
    INFO(c.file << " by " << c.integrator << " at " << c.rtol << ": " << e.objective << ", " << e.parameter << ": tlm "
                << e.tlm << ", free " << e.free << " +- " << e.free_error);
    CHECK(e.frozen_verdict != Verdict::disagrees);
    CHECK(e.free_verdict != Verdict::disagrees);
  }
}

// The numbers of two runs by CVODES on the same steps tell nothing of the derivatives' own error.
TEST_CASE("right gradients by CVODES pass the check where a parameter is in the objective alone", "[check][gallery]") {
  Problem problem = read_problem(file_of("pendulum/swing"),
                                 {R"(parameters.w={"value":2})", R"(objectives={"a":{"terminal":"w*theta"}})"});
  IntegratorSettings& integrator = problem.scene.simulation.integrator;
  integrator = {}, integrator.type = GENERATE(as<std::string>{}, "cvodes_adams", "cvodes_bdf");
  integrator.rtol = integrator.atol = 1e-7;
  GradientCheckOptions options;
  options.timing = {1, 1, 0};
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  for (const CheckedEntry& e : check.entries) {
    INFO(integrator.type << ": " << e.parameter << ": tlm " << e.tlm << ", free " << e.free << " +- " << e.free_error);
    CHECK(e.free_verdict != Verdict::disagrees);
  }
}
