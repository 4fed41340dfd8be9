#include "core/force/differentiated_force.hpp"

#include <catch2/catch.hpp>

#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// CubicDrag, written once.
struct Drag final : DifferentiatedForce<Drag> {
  Eigen::Index drag;
  explicit Drag(Eigen::Index parameter) : drag(parameter) {}
  std::vector<std::string> bodies() const override { return {"coupler"}; }
  template <class T>
  void load(double, const VectorX<T>& q, const VectorX<T>& v, const VectorX<T>& rho, VectorX<T>& Q) const {
    Q.template head<3>() = -rho(drag) * v.template head<3>().squaredNorm() * v.template head<3>();
    for (int k = 1; k < 4; ++k) Q(3 + k) = -1.3 * k * q(3 + k);
  }
};

// A spring and damper between two bodies' centres, with functions of numbers.
struct Link final : DifferentiatedForce<Link> {
  std::vector<std::string> bodies() const override { return {"crank", "rocker"}; }
  template <class T>
  void load(double t, const VectorX<T>& q, const VectorX<T>& v, const VectorX<T>& rho, VectorX<T>& Q) const {
    const VectorX<T> d = q.segment(7, 3) - q.segment(0, 3), ddot = v.segment(7, 3) - v.segment(0, 3);
    const T l = sqrt(d.squaredNorm()), ldot = d.dot(ddot) / l;
    const T tension = rho(0) * sin(l) + exp(-l) * ldot * (1 + t);
    Q.segment(0, 3) = tension / l * d;
    Q.segment(7, 3) = -tension / l * d;
  }
};

struct EndPlace final : TerminalCost {
  double value(VecIn y, VecIn) const override { return y(7) * y(9); }
  void adjoint_init(VecIn y, VecIn, VecOut lambda, VecOut mu) const override {
    lambda.setZero(), mu.setZero();
    lambda(7) = y(9), lambda(9) = y(7);
  }
};

}  // namespace

TEST_CASE("automatic differentiation gives the derivatives that are written by hand", "[force]") {
  const CubicDrag by_hand("coupler", 8);
  const Drag automatic(8);
  const VectorXd q = VectorXd::Random(7), v = VectorXd::Random(7), rho = VectorXd::Random(9);
  VectorXd Q1 = VectorXd::Zero(7), Q2 = Q1;
  by_hand.Q(0.3, q, v, rho, Q1), automatic.Q(0.3, q, v, rho, Q2);
  CHECK((Q1 - Q2).norm() < 1e-15);
  MatrixXd one = MatrixXd::Zero(7, 7), two = one;
  by_hand.K(0.3, q, v, rho, one), automatic.K(0.3, q, v, rho, two);
  CHECK((one - two).norm() < 1e-15);
  one.setZero(), two.setZero();
  by_hand.C(0.3, q, v, rho, one), automatic.C(0.3, q, v, rho, two);
  CHECK((one - two).norm() < 1e-14);
  one = two = MatrixXd::Zero(7, 9);
  by_hand.Q_rho(0.3, q, v, rho, one), automatic.Q_rho(0.3, q, v, rho, two);
  CHECK((one - two).norm() < 1e-15);
}

TEST_CASE("derivatives of a force between two bodies equal central differences", "[force]") {
  const Link link;
  const VectorXd q = VectorXd::Random(14), v = VectorXd::Random(14), rho = VectorXd::Random(3);
  const auto Q = [&](const VectorXd& at_q, const VectorXd& at_v, const VectorXd& at_rho) {
    VectorXd out = VectorXd::Zero(14);
    link.Q(0.3, at_q, at_v, at_rho, out);
    return out;
  };
  MatrixXd K = MatrixXd::Zero(14, 14), C = K, Q_rho = MatrixXd::Zero(14, 3);
  link.K(0.3, q, v, rho, K), link.C(0.3, q, v, rho, C), link.Q_rho(0.3, q, v, rho, Q_rho);
  constexpr double h = 1e-5;  // error of differences: h^2 and rounding/h, 1e-10
  for (Eigen::Index k = 0; k < 14; ++k) {
    const VectorXd e = h * VectorXd::Unit(14, k);
    CHECK((K.col(k) + (Q(q + e, v, rho) - Q(q - e, v, rho)) / (2 * h)).norm() < 1e-8);
    CHECK((C.col(k) + (Q(q, v + e, rho) - Q(q, v - e, rho)) / (2 * h)).norm() < 1e-8);
  }
  for (Eigen::Index k = 0; k < 3; ++k) {
    const VectorXd e = h * VectorXd::Unit(3, k);
    CHECK((Q_rho.col(k) - (Q(q, v, rho + e) - Q(q, v, rho - e)) / (2 * h)).norm() < 1e-8);
  }
}

TEST_CASE("a run's gradients with a force by automatic differentiation are those by hand, TLM and adjoint", "[force]") {
  Scene scene = every_force_four_bar();
  scene.simulation.end_time = 0.1;
  const VectorXd rho = nominal(scene);
  const Mechanism by_hand(scene, rho, {}, {std::make_shared<CubicDrag>("coupler", rho.size() - 1)});
  const Mechanism automatic(scene, rho, {}, {std::make_shared<Drag>(rho.size() - 1)});
  std::vector<Cost> costs(1);
  costs[0].terminal = point_cost(std::make_shared<EndPlace>(), by_hand);
  const SimulationResult reference = simulate_adjoint(by_hand, scene.simulation, costs);
  const SimulationResult adjoint = simulate_adjoint(automatic, scene.simulation, costs);
  const SimulationResult tlm = simulate_tlm(automatic, scene.simulation, costs);
  REQUIRE(reference.ok());
  CHECK(std::abs(reference.psi_rho(0, rho.size() - 1)) > 1e-6);
  CHECK((adjoint.psi_rho - reference.psi_rho).norm() < 1e-11 * reference.psi_rho.norm());
  CHECK((tlm.psi_rho - reference.psi_rho).norm() < 1e-10 * reference.psi_rho.norm());
}
