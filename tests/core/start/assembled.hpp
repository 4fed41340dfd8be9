// Assemblies of small scenes in tests, and their derivatives against differences.
#pragma once

#include <catch2/catch.hpp>
#include <random>

#include "core/mechanism/mechanism_data.hpp"
#include "core/start/assembly.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

namespace mbsopt::testing {

inline AssemblyResult assemble(const Scene& scene, const Eigen::VectorXd& rho) {
  const Mechanism mechanism(scene, rho);
  return Assembly(mechanism, 0).result();
}
inline AssemblyResult assemble(const Scene& scene) { return assemble(scene, nominal(scene)); }

// Rows of y by central differences, extrapolated once: error O(h^4).
inline Eigen::MatrixXd differences(const Scene& scene) {
  const Eigen::VectorXd rho = nominal(scene);
  Eigen::MatrixXd D(assemble(scene).y.size(), rho.size());
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    auto slope = [&](double h) {
      Eigen::VectorXd up = rho, down = rho;
      up(k) += h, down(k) -= h;
      const AssemblyResult a = assemble(scene, up), b = assemble(scene, down);
      INFO(a.message << b.message);
      REQUIRE(a.ok);
      REQUIRE(b.ok);
      return Eigen::VectorXd((a.y - b.y) / (2 * h));
    };
    D.col(k) = (4 * slope(1e-4) - slope(2e-4)) / 3;
  }
  return D;
}

// The derivatives of the assembled state, two ways, against differences of whole assemblies.
// Rows of positions and velocities are compared in units of size.
inline void check_derivatives(const Scene& scene, double size = 1) {
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  Eigen::MatrixXd y_rho = assembly.tangent();
  REQUIRE(y_rho.allFinite());
  Eigen::MatrixXd D = differences(scene);
  for (Eigen::Index i = 0; i < y_rho.rows(); i += 7) y_rho.middleRows(i, 3) /= size, D.middleRows(i, 3) /= size;
  for (Eigen::Index k = 0; k < D.cols(); ++k) {
    INFO(scene.parameters[static_cast<std::size_t>(k)].name);
    CHECK((y_rho.col(k) - D.col(k)).lpNorm<Eigen::Infinity>() < 1e-8 * (1 + D.col(k).lpNorm<Eigen::Infinity>()));
  }
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd y_bar = Eigen::MatrixXd::NullaryExpr(y_rho.rows(), 3, [&] { return normal(random); });
  Eigen::MatrixXd rho_bar = Eigen::MatrixXd::Ones(y_rho.cols(), 3);
  Eigen::MatrixXd y_bar_in_metres = y_bar;
  for (Eigen::Index i = 0; i < y_bar.rows(); i += 7) y_bar_in_metres.middleRows(i, 3) /= size;
  assembly.add_adjoint(y_bar_in_metres, rho_bar);
  rho_bar.array() -= 1;  // it adds
  CHECK((rho_bar - y_rho.transpose() * y_bar).cwiseAbs().maxCoeff() < 1e-13 * (1 + rho_bar.cwiseAbs().maxCoeff()));
}

}  // namespace mbsopt::testing
