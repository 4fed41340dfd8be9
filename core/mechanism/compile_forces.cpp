// Forces of the scene, and those written in C++.
#include <algorithm>

#include "core/mechanism/compilation.hpp"
#include "core/mechanism/mechanism.hpp"

namespace mbsopt {
namespace {

Law law(Compilation& model, const std::optional<Expression>& expression, const std::array<const char*, 2>& variables,
        const std::array<Field, 4>& coefficients, const std::string& where) {
  Law result;
  if (expression) {
    Symbols symbols = model.fields.symbols();
    for (const char* name : variables) symbols.add_input(name);
    symbols.add_input("t");
    try {
      result.program.emplace(*expression, symbols);
    } catch (const UnknownName& e) {
      throw SceneError(where + ".law: " + e.what());
    }
    model.data.largest_law = std::max(model.data.largest_law, symbols.inputs());
    return result;
  }
  const DualVector<4> x = model.fields.values(coefficients, where);
  const Vec<4> v = numbers(model.keep(result.slot, x));
  result.k = v(0), result.c = v(1), result.x0 = v(2), result.f0 = v(3);
  return result;
}

void add_force(Compilation& model, std::size_t i) {
  const Force& force = model.scene.forces[i];
  const std::string where = child_path("forces", i);
  if (const auto* f = std::get_if<Tsda>(&force.kind)) {
    TsdaForce out;
    out.force = static_cast<int>(i);
    out.body1 = model.body_index(f->body1, where + ".body1"), out.body2 = model.body_index(f->body2, where + ".body2");
    out.s1 = numbers(model.keep(out.slot1, model.point(out.body1, f->point1, where + ".point1")));
    out.s2 = numbers(model.keep(out.slot2, model.point(out.body2, f->point2, where + ".point2")));
    out.law = law(model, f->law, {"l", "ldot"}, {f->stiffness, f->damping, f->free_length, f->actuator}, where);
    model.data.tsda.push_back(std::move(out));
  } else {
    const Rsda& r = std::get<Rsda>(force.kind);
    RsdaForce out;
    out.force = static_cast<int>(i);
    out.joint_angle = model.angle_of(r.joint, where + ".joint");
    out.law = law(model, r.law, {"angle", "rate"}, {r.stiffness, r.damping, r.free_angle, 0.0}, where);
    model.data.rsda.push_back(std::move(out));
  }
}

void add_user_force(Compilation& model, std::shared_ptr<const UserForce> force) {
  UserForceData out;
  for (const std::string& name : force->bodies()) {
    const int body = model.body_index(name, "user force");
    if (body == 0) throw SceneError("user force: acts on the ground, which never moves");
    out.bodies.push_back(body);
  }
  out.force = std::move(force);
  model.data.user_forces.push_back(std::move(out));
}

}  // namespace

void compile_forces(Compilation& model) {
  for (std::size_t i = 0; i < model.scene.forces.size(); ++i) add_force(model, i);
}

void compile_user_forces(Compilation& model, std::vector<std::shared_ptr<const UserForce>> forces) {
  for (auto& force : forces) add_user_force(model, std::move(force));
}

}  // namespace mbsopt
