// Modes of the gallery's mechanisms, beside the equilibria that they have.
#include <catch2/catch.hpp>
#include <numbers>

#include "app/json/read_problem.hpp"
#include "optim/design/design.hpp"
#include "optim/objective/followed_mode.hpp"
#include "optim/problem/parameter_values.hpp"
#include "source_folder.hpp"

using namespace mbsopt;

TEST_CASE("derivatives of modes are those of differences on the gallery", "[followed_mode]") {
  const auto [file, mode] = GENERATE(table<std::string, int>({{"spring_arm/equilibrium.json", 1},
                                                              {"bushing/engine_mount.json", 2},
                                                              {"bushing/engine_mount.json", 5},
                                                              {"quarter_car/ride.json", 1},
                                                              {"double_wishbone/quarter_car.json", 1},
                                                              {"chain/gradient.json", 3}}));
  const std::string value = GENERATE("frequency", "damping");
  CAPTURE(file, mode, value);
  Problem problem = read_problem(std::string(MBSOPT_SOURCE_DIR "/problems/") + file);
  problem.scene.equilibrium = true;
  const FollowedMode followed(problem.scene, {mode, value});
  const Eigen::VectorXd rho = parameter_values(problem.scene);
  const Eigen::VectorXd found = followed.slopes(rho, {}).front().gradient;
  const double scale = std::string(value) == "damping" ? 1.0 : followed.value(rho, {});  // a ratio may be 0
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const double size = rho(k) != 0 ? std::abs(rho(k)) : 1.0, h = 1e-3 * size;
    const auto at = [&](double x) {
      Eigen::VectorXd moved = rho;
      moved(k) += x;
      return followed.value(moved, {});
    };
    const double d1 = (at(h) - at(-h)) / (2 * h), d2 = (at(h / 2) - at(-h / 2)) / h,
                 d4 = (at(h / 4) - at(-h / 4)) / (h / 2), difference = (64 * d4 - 20 * d2 + d1) / 45;
    INFO(problem.scene.parameters[static_cast<std::size_t>(k)].name);
    CHECK(std::abs(found(k) - difference) * size < 1e-8 * scale);
  }
}

TEST_CASE("an anti-roll bar and its dampers are designed as their closed form says", "[followed_mode]") {
  const DesignResult result =
      run_design(read_problem(std::string(MBSOPT_SOURCE_DIR "/problems/") + "anti_roll/modes.json"));
  REQUIRE(result.status == SolverStatus::converged);
  // I omega^2 = k + 2 k_bar where the arms move against each other, k = I omega_heave^2; c = 2 zeta I omega
  const double I = 2 + 60 * 0.4 * 0.4, heave = 2 * std::numbers::pi * 1.2, roll = 2 * std::numbers::pi * 2;
  CHECK(result.variables[0].value == Approx(I * (roll * roll - heave * heave) / 2).epsilon(1e-7));
  CHECK(result.variables[1].value == Approx(2 * 0.3 * I * roll).epsilon(1e-5));  // the barrier stays off the limit
}
