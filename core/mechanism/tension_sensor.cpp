// The tension of a spring (tsda) or the resisting torque of a torsional one (rsda, torsion_bar) as a sensor. It is the
// value of the law
//   f(x, xdot, t, rho),   x = l or the joint's angle
//   f_y = f_x x_y + f_xdot xdot_y          f_rho = the law's own + through the geometry
#include "core/force/forces.hpp"
#include "core/mechanism/program_sensors.hpp"
#include "core/mechanism/sensor_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

// The numbers for one evaluation of a law that is an expression, one set per thread. They carry nothing from one call
// to the next, and grow at the first call only.
Law::Scratch& scratch_of_this_thread(const MechanismData& data, const Law& law) {
  static thread_local Law::Scratch scratch;
  if (!law.program) return scratch;
  scratch.inputs.resize(static_cast<std::size_t>(data.rho.size()) + 3);
  scratch.gradient.resize(scratch.inputs.size());
  law.program->grow(scratch.program);
  return scratch;
}

// Adds the gradient through the law's own coefficients, or through the parameters of its expression.
void add_law_gradient(const Law& law, double x, double xdot, const Law::Scratch& scratch, SensorGradient& to) {
  if (to.t_bar && law.program) *to.t_bar += to.scale * scratch.gradient.back();
  if (!law.program) return to.add_slot<4>(law.slot, law.field_gradient(x, xdot));
  for (const int k : to.data.active) to.rho_bar(k) += to.scale * scratch.gradient[static_cast<std::size_t>(k)];
}

struct TensionFunction final : SensorFunction {
  ForcePlace place;
  std::optional<Law> instead;  // of the force's own law

  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    double value = 0;
    d.forces->visit_law(place, [&](const auto& f) {
      const Law& of = instead ? *instead : f.law;
      Law::Scratch& scratch = scratch_of_this_thread(d, of);
      const auto [i, j] = f.bodies();
      const Frame b1 = body_at(at.y, i), b2 = body_at(at.y, j);
      const auto [x, xdot] = f.measured(at.angles, b1, b2);
      if (!to) {
        value = of.value(at.t, d.rho, x, xdot, scratch);
        return;
      }
      const Law::Value law = of.derivatives(at.t, d.rho, x, xdot, scratch);
      add_law_gradient(of, x, xdot, scratch, *to);
      FrameBar bar1 = FrameBar::zero(), bar2 = bar1;
      FieldGradient fields = to->fields();
      f.pull_back_measured(b1, b2, law.f_x, law.f_xdot, bar1, bar2, fields);
      to->add_frame(b1, i, bar1);
      to->add_frame(b2, j, bar2);
      value = law.f;
    });
    return value;
  }
};

}  // namespace

SensorPtr law_sensor(ForcePlace force, Program program) {
  auto out = std::make_shared<TensionFunction>();
  out->place = force;
  out->instead.emplace();
  out->instead->program = std::move(program);
  return out;
}

std::unique_ptr<SensorFunction> make_tension(Compilation& model, const Sensor& s, const std::string& where) {
  const std::vector<Force>& forces = model.scene.forces;
  const auto found = std::ranges::find(forces, s.force, &Force::name);
  if (found == forces.end()) throw SceneError(where + ".force: there is no force '" + s.force + "'");
  const int force = static_cast<int>(found - forces.begin());
  std::unique_ptr<TensionFunction> out;
  model.data.forces->for_each([&]<class Kind>(const Kind& f, ForcePlace place) {
    if (!HasLaw<Kind> || f.force != force) return;
    out = std::make_unique<TensionFunction>();
    out->place = place;
  });
  if (out) return out;
  throw SceneError(where + ".force: '" + s.force + "' is a " + std::string(type_of(*found)) +
                   "; only a tsda, rsda, torsion_bar, stop or contact has one number to measure");
}

}  // namespace mbsopt
