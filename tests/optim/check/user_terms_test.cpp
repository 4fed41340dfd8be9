#include "optim/check/user_terms.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/force/user_force.hpp"
#include "optim/check/gradient_check.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;
using Catch::Contains;
using Eigen::Vector3d;
using Eigen::Vector4d;

namespace {

// F = -rho_c |rdot|^2 rdot at the centre of mass and a load -rho_k p on the Euler parameters; parts may be wrong.
struct Drag final : UserForce {
  enum Wrong { none, in_K, in_C, in_Q_rho };
  explicit Drag(Wrong part = none) : wrong(part) {}
  std::vector<std::string> bodies() const override { return {"bar2"}; }
  static constexpr Eigen::Index c = 4, k = 2;
  void Q(double, VecIn q, VecIn v, VecIn rho, VecOut out) const override {
    const Vector3d w = v.head<3>();
    out.head<3>() = -(1 + rho(c)) * w.squaredNorm() * w;
    out.tail<4>() = -1e-2 * rho(k) * q.tail<4>().cwiseProduct(Vector4d(0, 1, 2, 3));
  }
  void K(double, VecIn, VecIn, VecIn rho, MatOut out) const override {
    out.diagonal().tail<4>() = (wrong == in_K ? 1.1e-2 : 1e-2) * rho(k) * Vector4d(0, 1, 2, 3);
  }
  void C(double, VecIn, VecIn v, VecIn rho, MatOut out) const override {
    const Vector3d w = v.head<3>();
    out.topLeftCorner<3, 3>() =
        (1 + rho(c)) * (w.squaredNorm() * Eigen::Matrix3d::Identity() + (wrong == in_C ? 1 : 2) * w * w.transpose());
  }
  void Q_rho(double, VecIn q, VecIn v, VecIn, MatOut out) const override {
    const Vector3d w = v.head<3>();
    out.col(c).head<3>() = -w.squaredNorm() * w;
    if (wrong != in_Q_rho) out.col(k).tail<4>() = -1e-2 * q.tail<4>().cwiseProduct(Vector4d(0, 1, 2, 3));
  }
  Wrong wrong;
};

// rho_k v_0^2, terminal rho_k q_1
struct Speed final : RunningCost {
  explicit Speed(double part) : wrong(part) {}
  double g(double, VecIn y, VecIn rho) const override { return rho(2) * y(28) * y(28); }
  void add_g_y(double, VecIn y, VecIn rho, double scale, VecOut out) const override {
    out(28) += scale * 2 * rho(2) * y(28);
  }
  void add_g_rho(double, VecIn y, VecIn, double scale, VecOut out) const override {
    out(2) += (1 + wrong) * scale * y(28) * y(28);
  }
  double wrong;
};
struct Height final : TerminalCost {
  explicit Height(double part) : wrong(part) {}
  double value(VecIn y, VecIn) const override { return y(1); }
  void adjoint_init(VecIn, VecIn, VecOut lambda, VecOut) const override { lambda(1) = 1 + wrong; }
  double wrong;
};

// A load -sin(e_0) p on the Euler parameters, whose K may be wrong by a part.
struct Sine final : UserForce {
  explicit Sine(double part) : wrong(part) {}
  std::vector<std::string> bodies() const override { return {"stone"}; }
  void Q(double, VecIn q, VecIn, VecIn, VecOut out) const override { out.tail<4>() = -std::sin(q(3)) * q.tail<4>(); }
  void K(double, VecIn q, VecIn, VecIn, MatOut out) const override {
    out.bottomRightCorner<4, 4>() = (1 + wrong) * std::sin(q(3)) * Eigen::Matrix4d::Identity();
    out.col(3).tail<4>() += (1 + wrong) * std::cos(q(3)) * q.tail<4>();
  }
  void C(double, VecIn, VecIn, VecIn, MatOut) const override {}
  void Q_rho(double, VecIn, VecIn, VecIn, MatOut) const override {}
  double wrong;
};

// Added mass rho_k in the direction of the body's first axis, whose derivatives may be wrong.
struct Fin final : UserForce, InertialLoad {
  enum Wrong { none, in_M, in_L_q, in_L_v, in_L_rho };
  using VecIn = UserForce::VecIn;
  using VecOut = UserForce::VecOut;
  using MatOut = UserForce::MatOut;
  static constexpr Eigen::Index k = 2;
  explicit Fin(Wrong part) : wrong(part) {}
  std::vector<std::string> bodies() const override { return {"bar2"}; }
  void Q(double, VecIn, VecIn, VecIn, VecOut) const override {}
  void K(double, VecIn, VecIn, VecIn, MatOut) const override {}
  void C(double, VecIn, VecIn, VecIn, MatOut) const override {}
  void Q_rho(double, VecIn, VecIn, VecIn, MatOut) const override {}
  const InertialLoad* inertia() const override { return this; }
  // -rho_k e_0^2 rddot_x - e_0 v_x
  void L(VecIn q, VecIn v, VecIn z, VecIn rho, VecOut out) const override {
    out(0) = -rho(k) * q(3) * q(3) * z(0) - q(3) * v(0);
  }
  void M(VecIn q, VecIn rho, MatOut out) const override { out(0, 0) = (wrong == in_M ? 2 : 1) * rho(k) * q(3) * q(3); }
  void L_q(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut out) const override {
    out(0, 3) = -(wrong == in_L_q ? 1 : 2) * rho(k) * q(3) * z(0) - v(0);
  }
  void L_v(VecIn q, VecIn, VecIn, VecIn, MatOut out) const override { out(0, 0) = -(wrong == in_L_v ? 2 : 1) * q(3); }
  void L_rho(VecIn q, VecIn, VecIn z, VecIn, MatOut out) const override {
    out(0, k) = -(wrong == in_L_rho ? 2 : 1) * q(3) * q(3) * z(0);
  }
  Wrong wrong;
};

Scene swinging() {
  Scene s = five_bar::problem(1e-6).scene;
  s.simulation.end_time = 0.4;
  return s;
}

}  // namespace

TEST_CASE("a wrong derivative of a force or cost in C++ is named, and only that one", "[check]") {
  const Scene s = swinging();
  const auto found = [&](Drag::Wrong wrong, double in_running, double in_terminal) {
    const Objective objective("both", std::make_shared<Speed>(in_running), std::make_shared<Height>(in_terminal));
    return wrong_user_terms(s, {objective}, {std::make_shared<Drag>(wrong)});
  };
  CHECK(found(Drag::none, 0, 0).empty());
  const struct {
    Drag::Wrong force;
    double running, terminal;
    const char* said;
  } cases[] = {{Drag::in_K, 0, 0, "user force 0 (on 'bar2'): its K = -dQ/dq is wrong"},
               {Drag::in_C, 0, 0, "user force 0 (on 'bar2'): its C = -dQ/dv is wrong"},
               {Drag::in_Q_rho, 0, 0, "user force 0 (on 'bar2'): its Q_rho is wrong"},
               {Drag::none, 1e-4, 0, "objective 'both': its running cost's gradient in rho is wrong"},
               {Drag::none, 0, 1e-4, "objective 'both': its terminal cost's gradient in y is wrong"}};
  for (const auto& c : cases) {
    const std::vector<std::string> said = found(c.force, c.running, c.terminal);
    INFO(c.said);
    REQUIRE(said.size() == 1);
    CHECK_THAT(said[0], Contains(c.said) && Contains("differences say"));
  }
}

TEST_CASE("a wrong derivative of a mass term in C++ is named, and only that one", "[check]") {
  const auto found = [&](Fin::Wrong wrong) { return wrong_user_terms(swinging(), {}, {std::make_shared<Fin>(wrong)}); };
  CHECK(found(Fin::none).empty());
  const std::pair<Fin::Wrong, const char*> cases[] = {{Fin::in_M, "its M = -dL/dz is wrong"},
                                                      {Fin::in_L_q, "its L_q is wrong"},
                                                      {Fin::in_L_v, "its L_v is wrong"},
                                                      {Fin::in_L_rho, "its L_rho is wrong"}};
  for (const auto& [wrong, sentence] : cases) {
    const std::vector<std::string> said = found(wrong);
    INFO(sentence);
    REQUIRE(said.size() == 1);
    CHECK_THAT(said[0], Contains(sentence));
  }
}

TEST_CASE("a wrong derivative along a turn is found at any size", "[check]") {
  const double size = GENERATE(1e-6, 1.0, 1e4, 1e8);
  INFO(size << " m");
  Scene s;
  s.bodies.push_back(testing::plain_body("stone", 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, {size, 0.0, 0.0}));
  s.bodies[0].orientation = testing::turned("0.3");
  s.gravity = {0.0, 0.0, 0.0};
  s.simulation.end_time = 0.1;
  CHECK(wrong_user_terms(s, {}, {std::make_shared<Sine>(0)}).empty());
  const std::vector<std::string> said = wrong_user_terms(s, {}, {std::make_shared<Sine>(1e-4)});
  REQUIRE(said.size() == 1);
  CHECK_THAT(said[0], Contains("its K = -dQ/dq is wrong") && Contains("a turn of 'stone'"));
}

TEST_CASE("a check with a wrong force in C++ does not pass, and says which force", "[check]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 0.2;
  GradientCheckOptions options;
  options.timing = {1, 1, 0}, options.free_steps = false, options.continuous = false, options.rungs = 4;
  options.user_forces = {std::make_shared<Drag>(Drag::in_C)};
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  CHECK_FALSE(check.passed());
  REQUIRE(check.wrong_terms.size() == 1);
  CHECK_THAT(check.wrong_terms[0], Contains("user force 0") && Contains("C = -dQ/dv"));
}
