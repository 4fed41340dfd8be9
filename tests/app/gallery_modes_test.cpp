// Modes of the gallery's mechanisms, beside the equilibria that they have.
#include <catch2/catch.hpp>

#include "app/json/read_problem.hpp"
#include "optim/objective/followed_mode.hpp"
#include "optim/problem/parameter_values.hpp"

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
  Eigen::VectorXd found = Eigen::VectorXd::Zero(rho.size());
  followed.add_gradient(rho, {}, found);
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
