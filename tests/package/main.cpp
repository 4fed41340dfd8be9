// A project of its own: swings a rod, with a drag of its own and without, then minimises with Ipopt through the
// installed libraries.
#include <cmath>
#include <cstdio>
#include <mbsopt/differentiated_cost.hpp>
#include <mbsopt/differentiated_force.hpp>
#include <mbsopt/mbsopt.hpp>

namespace {

struct Sphere : mbsopt::NonlinearProgram {
  Sphere() : NonlinearProgram(2, 0) {}
  void evaluate(const Eigen::VectorXd& x, mbsopt::NlpPoint& p) override { p.f = x.squaredNorm(), p.f_x = 2 * x; }
};

struct Drag final : mbsopt::DifferentiatedForce<Drag> {
  std::vector<std::string> bodies() const override { return {"rod"}; }
  template <class T>
  void load(double, const VectorX<T>&, const VectorX<T>& v, const VectorX<T>&, VectorX<T>& Q) const {
    Q.template head<3>() = -0.1 * v.template head<3>();
  }
};

}  // namespace

int main() {
  mbsopt::Body rod;
  rod.name = "rod", rod.mass = 1.0, rod.com = {0.5, 0.0, 0.0};
  rod.inertia = {0.01, 0.1, 0.1, 0.0, 0.0, 0.0};
  mbsopt::Joint pin;
  pin.name = "pin", pin.type = "revolute", pin.body2 = "rod";
  pin.axis1 = mbsopt::VectorField{0.0, 1.0, 0.0}, pin.axis2 = pin.axis1;
  mbsopt::Scene scene;
  scene.bodies = {rod}, scene.joints = {pin};
  const mbsopt::Mechanism mechanism(scene, Eigen::VectorXd());
  const mbsopt::SimulationResult run = mbsopt::simulate(mechanism, scene.simulation);

  const mbsopt::Mechanism damped(scene, Eigen::VectorXd(), {}, {std::make_shared<Drag>()});
  const mbsopt::SimulationResult slower = mbsopt::simulate(damped, scene.simulation);
  if (!slower.ok() || slower.statistics.energy_final > slower.statistics.energy_initial - 1e-3) return 1;

  Sphere sphere;
  const mbsopt::NlpResult minimum = mbsopt::solve_with_ipopt(sphere, Eigen::Vector2d(1, 2));
  std::printf("energy drift %.1e J, minimum at %.1e\n", run.statistics.energy_drift, minimum.x.norm());
  return run.ok() && run.statistics.energy_drift < 1e-3 && minimum.x.norm() < 1e-6 ? 0 : 1;
}
