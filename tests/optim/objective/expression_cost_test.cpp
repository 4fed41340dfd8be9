#include "optim/objective/expression_cost.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "core/start/assembly.hpp"
#include "optim/objective/objective.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;
using Eigen::VectorXd;

namespace {

// The five-bar with sensors of every kind that a cost may use, at a state away from rest.
struct Setting {
  explicit Setting(const std::vector<bool>& active = {}) : scene(make_scene()), rho(values(scene)), active_(active) {
    const Mechanism mechanism(scene, rho, active);
    y = Assembly(mechanism, 0).result().y;
    for (Eigen::Index i = 0; i < y.size(); ++i) y(i) += 0.05 * std::sin(3.0 * static_cast<double>(i) + 1);
    angles = Assembly(mechanism, 0).result().angles;
  }
  static Scene make_scene() {
    Scene s = five_bar::problem().scene;
    s.definitions = {{"reach", Expression::parse("sqrt(r2_x^2 + r2_y^2)")}, {"total", Expression::parse("m1 + m2")}};
    Sensor energy;
    energy.name = "energy", energy.quantity = "energy", energy.component = "total";
    Sensor angle;
    angle.name = "swing", angle.quantity = "angle", angle.joint = "A";
    Sensor rate = angle;
    rate.name = "swing_rate", rate.quantity = "rate";
    s.sensors.insert(s.sensors.end(), {energy, angle, rate});
    Sensor product;  // before the sensors that it measures by
    product.name = "product", product.quantity = "expression";
    product.value = Expression::parse("swing*swing_rate + total*t");
    s.sensors.insert(s.sensors.begin(), product);
    return s;
  }
  static VectorXd values(const Scene& s) {
    VectorXd rho(static_cast<Eigen::Index>(s.parameters.size()));
    for (Eigen::Index k = 0; k < rho.size(); ++k) rho(k) = s.parameters[static_cast<std::size_t>(k)].value + 0.1;
    return rho;
  }
  double value(const std::string& text, const VectorXd& y_at, const VectorXd& rho_at) const {
    const Mechanism mechanism(scene, rho_at, active_);
    return CostExpression(Expression::parse(text), scene).bind(mechanism)->value({0.7, y_at, angles});
  }

  Scene scene;
  VectorXd rho, y, angles;

 private:
  std::vector<bool> active_;
};

}  // namespace

TEST_CASE("an expression sensor in a cost stands for its expression", "[cost]") {
  const Setting s;
  const Mechanism mechanism(s.scene, s.rho);
  CHECK(s.value("product^2", s.y, s.rho) == s.value("(swing*swing_rate + total*t)^2", s.y, s.rho));
  CHECK(s.value("product", s.y, s.rho) ==
        Approx(mechanism.sensor_value(mechanism.sensor("product"), {0.7, s.y, s.angles})).epsilon(1e-15));
  CHECK(CostExpression(Expression::parse("2*swing - r2_x"), s.scene).is_linear());
  CHECK_FALSE(CostExpression(Expression::parse("product"), s.scene).is_linear());
}

TEST_CASE("a cost's gradient in state and parameters equals central differences of its value", "[cost]") {
  const Setting s;
  const std::string text =
      GENERATE(as<std::string>{}, "(r2_x - 0.1)^2 + t*r2_y", "energy*k1/100", "exp(-t)*swing*swing_rate", "total*reach",
               "product^2*L01 + r2_x", "smooth_abs(r2_x, 0.01)*L01^2 + m3", "m1*c1 + 3");
  INFO(text);
  const Mechanism mechanism(s.scene, s.rho);
  const std::shared_ptr<const PointCost> cost = CostExpression(Expression::parse(text), s.scene).bind(mechanism);
  const double scale = -1.7;
  VectorXd y_bar = VectorXd::Constant(s.y.size(), 2), rho_bar = VectorXd::Constant(s.rho.size(), 3);  // adds to it
  const double value = cost->add_gradient({0.7, s.y, s.angles}, scale, y_bar, rho_bar);
  CHECK(value == cost->value({0.7, s.y, s.angles}));
  const double h = 1e-6;
  for (Eigen::Index i = 0; i < s.y.size(); ++i) {
    const VectorXd d = h * VectorXd::Unit(s.y.size(), i);
    const double difference = (s.value(text, s.y + d, s.rho) - s.value(text, s.y - d, s.rho)) / (2 * h);
    CHECK(y_bar(i) - 2 == Approx(scale * difference).epsilon(1e-6).margin(1e-6));
  }
  for (Eigen::Index k = 0; k < s.rho.size(); ++k) {
    const VectorXd d = h * VectorXd::Unit(s.rho.size(), k);
    const double difference = (s.value(text, s.y, s.rho + d) - s.value(text, s.y, s.rho - d)) / (2 * h);
    CHECK(rho_bar(k) - 3 == Approx(scale * difference).epsilon(1e-6).margin(1e-6));
  }
}

TEST_CASE("derivatives in parameters that are not wanted stay zero", "[cost]") {
  std::vector<bool> active(10, false);
  active[2] = true;  // k1
  const Setting s(active);
  const Mechanism mechanism(s.scene, s.rho, active);
  VectorXd y_bar = VectorXd::Zero(s.y.size()), rho_bar = VectorXd::Zero(s.rho.size());
  CostExpression(Expression::parse("energy + k1*L01 + m1"), s.scene)
      .bind(mechanism)
      ->add_gradient({0, s.y, s.angles}, 1, y_bar, rho_bar);
  for (Eigen::Index k = 0; k < rho_bar.size(); ++k) CHECK((rho_bar(k) != 0) == (k == 2));
}

TEST_CASE("one cost serves several threads", "[cost]") {
  const Setting s;
  const Mechanism mechanism(s.scene, s.rho);
  const auto cost = CostExpression(Expression::parse("energy*swing + reach^2 + t"), s.scene).bind(mechanism);
  const double expected = cost->value({0.7, s.y, s.angles});
  int wrong[4] = {0, 0, 0, 0};
  std::vector<std::thread> threads;
  for (int& count : wrong)
    threads.emplace_back([&] {
      VectorXd y_bar(s.y.size()), rho_bar(s.rho.size());
      for (int i = 0; i < 500; ++i) {
        y_bar.setZero(), rho_bar.setZero();
        count += cost->add_gradient({0.7, s.y, s.angles}, 1, y_bar, rho_bar) != expected;
      }
    });
  for (std::thread& t : threads) t.join();
  for (const int count : wrong) CHECK(count == 0);
}

TEST_CASE("an objective keeps the parts it has, and errors name the part", "[cost]") {
  using Catch::Matchers::Contains;
  const Setting s;
  ObjectiveSpec spec;
  spec.name = "track", spec.running = Expression::parse("0"), spec.terminal = Expression::parse("r2_x");
  spec.parameters_only = Expression::parse("k1*m1");
  spec.samples = {{2, Expression::parse("r2_y")}, {1, Expression::parse("r2_x")}};
  const Objective objective(s.scene, spec);
  const Mechanism mechanism(s.scene, s.rho);
  const Cost cost = objective.cost(mechanism);
  CHECK_FALSE(cost.running);  // the constant 0 costs nothing
  CHECK(cost.terminal);
  REQUIRE(cost.samples.size() == 2);
  CHECK(cost.samples[0].time == 1);
  CHECK(objective.parameters_only(s.rho) == Approx(s.rho(2) * s.rho(6)));
  const VectorXd gradient = objective.parameters_only_gradients(s.rho, {}, {2, 6}).front().gradient;
  CHECK(gradient(0) == s.rho(6));
  CHECK(gradient(1) == s.rho(2));

  spec.terminal = Expression::parse("r2_z");
  CHECK_THROWS_WITH(Objective(s.scene, spec), Contains("objectives.track.terminal: unknown name 'r2_z'"));
  spec.terminal.reset(), spec.parameters_only = Expression::parse("k1*r2_x");  // sensors need a state
  CHECK_THROWS_WITH(Objective(s.scene, spec), Contains("objectives.track.parameters_only: unknown name 'r2_x'"));
  spec.parameters_only.reset(), spec.samples[0].time = 7;
  CHECK_THROWS_WITH(Objective(s.scene, spec), Contains("samples[0].time: is 7 s, outside the simulated time 0 to 5 s"));
}
