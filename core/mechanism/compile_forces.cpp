// Forces of the scene, and those written in C++.
#include <algorithm>
#include <optional>
#include <set>

#include "core/constraint/dot2.hpp"
#include "core/force/bound_force.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/compilation.hpp"
#include "core/mechanism/kinks_in_time.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/scene/scene_facts.hpp"
#include "core/scene/type_table.hpp"

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
    add_kinks_in_time(*result.program, symbols.input("t"), model.data.rho, model.data.kinks);
    return result;
  }
  const FieldVector<4> x = model.fields.values(coefficients, where);
  const Vec<4> v = numbers(model.keep(result.slot, x));
  result.k = v(0);
  result.c = v(1);
  result.x0 = v(2);
  result.f0 = v(3);
  return result;
}

void add(Compilation& model, const Tsda& f, int force, const std::string& where) {
  TsdaForce out;
  out.force = force;
  out.body1 = model.body_index(f.body1, where + ".body1");
  out.body2 = model.body_index(f.body2, where + ".body2");
  out.s1 = numbers(model.keep(out.slot1, model.point(out.body1, f.point1, where + ".point1")));
  out.s2 = numbers(model.keep(out.slot2, model.point(out.body2, f.point2, where + ".point2")));
  out.law = law(model, f.law, {"l", "ldot"}, {f.stiffness, f.damping, f.free_length, f.actuator}, where);
  model.data.forces->of<TsdaForce>().push_back(std::move(out));
}

template <class Torsional>  // Rsda, TorsionBar
requires requires(const Torsional& f) { f.free_angle; }
void add(Compilation& model, const Torsional& f, int force, const std::string& where) {
  RsdaForce out;
  out.force = force;
  if constexpr (requires { f.joint; }) {
    out.angle = model.angle_of(f.joint, where + ".joint");
  } else {
    const int body1 = model.body_index(f.body1, where + ".body1"), body2 = model.body_index(f.body2, where + ".body2");
    out.angle = model.angle_about(body1, body2, f.axis, where);
  }
  out.joint = model.data.angles[static_cast<std::size_t>(out.angle)];
  out.law = law(model, f.law, {"angle", "rate"}, {f.stiffness, f.damping, f.free_angle, 0.0}, where);
  model.data.forces->of<RsdaForce>().push_back(std::move(out));
}

// The components' inputs are all parameters, t and all sensors. The sensors in use are listed.
void set_components(Compilation& model, const LawVector& components, AppliedForce& out, const std::string& where) {
  Symbols symbols = model.fields.symbols();
  add_time_and_sensors(symbols, model.scene);
  const int t = symbols.input("t");
  std::set<int> used;
  for (std::size_t i = 0; i < components.size(); ++i) {
    try {
      out.components[i] = Program(components[i], symbols);
    } catch (const UnknownName& e) {
      throw SceneError(child_path(where + ".components", i) + ": " + e.what());
    }
    const std::vector<int>& inputs = out.components[i].used_inputs();
    used.insert(inputs.begin(), inputs.end());
    add_kinks_in_time(out.components[i], t, model.data.rho, model.data.kinks);
  }
  for (const int input : used) {
    if (input < t) out.parameters.push_back(input);
    if (input > t) out.sensors.push_back(input - t - 1);
  }
}

int moving_body(const Compilation& model, const std::string& name, const std::string& where) {
  const int body = model.body_index(name, where);
  if (body == 0) throw SceneError(where + ": is the ground, which never moves");
  return body;
}

template <class Applied>  // PointForce, Torque
requires requires(const Applied& f) { f.components; }
void add(Compilation& model, const Applied& f, int force, const std::string& where) {
  AppliedForce out;
  out.force = force;
  out.body = moving_body(model, f.body, where + ".body");
  if constexpr (requires { f.point; }) {
    out.s = numbers(model.keep(out.slot, model.point(out.body, f.point, where + ".point")));
  } else {
    out.is_torque = true;
  }
  out.in_body_axes = f.in_body_frame;
  set_components(model, f.components, out, where);
  model.data.applied.push_back(std::move(out));
}

void add(Compilation& model, const BushingSpec& f, int force, const std::string& where) {
  Bushing out;
  out.force = force;
  out.body1 = model.body_index(f.body1, where + ".body1");
  out.body2 = model.body_index(f.body2, where + ".body2");
  out.s1 = numbers(model.keep(out.slot1, model.point(out.body1, f.point1, where + ".point1")));
  out.s2 = numbers(model.keep(out.slot2, model.point(out.body2, f.point2, where + ".point2")));
  // R0 = A(p1)'A(p2), row by row
  const FieldVector4 relative =
      quaternion_product(inverse(model.orientation[at(out.body1)]), model.orientation[at(out.body2)]);
  FieldVector<9> R0;
  for (const int k : {0, 1, 2}) {
    const FieldVector3 column = rotated(relative, model.fields.constants(Vector3d::Unit(k)));
    for (std::size_t i = 0; i < 3; ++i) R0[3 * i + at(k)] = column[i];
  }
  const Vec<9> entries = numbers(model.keep(out.slot_R0, R0));
  for (int i = 0; i < 3; ++i) out.R0.row(i) = entries.segment<3>(3 * i).transpose();
  FieldVector<12> law;
  auto next = law.begin();
  const auto add_part = [&](const VectorField& field, const char* key) {
    next = std::ranges::copy(model.fields.values(field, where + key), next).out;
  };
  add_part(f.stiffness, ".stiffness");
  add_part(f.damping, ".damping");
  add_part(f.torsional_stiffness, ".torsional_stiffness");
  add_part(f.torsional_damping, ".torsional_damping");
  const Vec<12> x = numbers(model.keep(out.slot_law, law));
  out.K = x.segment<3>(0);
  out.C = x.segment<3>(3);
  out.Kt = x.segment<3>(6);
  out.Ct = x.segment<3>(9);
  model.data.forces->of<Bushing>().push_back(std::move(out));
}

void add(Compilation& model, const FrictionSpec& f, int force, const std::string& where) {
  const Joint& joint = model.scene.joints[model.joint_index(f.joint, where + ".joint")];
  FrictionLaw law;
  // Without breakaway the level is coulomb at any Stribeck velocity.
  const FieldVector<FrictionLaw::kFields> x{
      model.fields.value(f.coulomb, where + ".coulomb"),
      model.fields.value(f.smooth_velocity, where + ".smooth_velocity"),
      model.fields.value(f.viscous, where + ".viscous"),
      model.fields.value(f.breakaway.value_or(f.coulomb), where + ".breakaway"),
      model.fields.value(f.stribeck_velocity.value_or(1.0), where + ".stribeck_velocity")};
  const Vec<FrictionLaw::kFields> v = numbers(model.keep(law.slot, x));
  law.coulomb = v(0);
  law.smooth = v(1);
  law.viscous = v(2);
  law.breakaway = v(3);
  law.stribeck = v(4);
  if (!(law.smooth > 0)) throw SceneError(where + ".smooth_velocity: must be greater than 0");
  if (!(law.stribeck > 0)) throw SceneError(where + ".stribeck_velocity: must be greater than 0");
  if (is_sliding(f.motion, joint.type)) {
    model.data.forces->of<SlidingFriction>().push_back(
        {force, model.joint_displacement(f.joint, where + ".joint"), -1, law});
  } else {
    const int angle = model.angle_of(f.joint, where + ".joint");
    model.data.forces->of<TurningFriction>().push_back(
        {force, model.data.angles[static_cast<std::size_t>(angle)], angle, law});
  }
}

// k d^n (1 + a ddot), never negative, where d > 0. The input of the law and its rate have names that no file uses.
constexpr std::array<const char*, 2> kWay = {"way__", "rate__"};

std::string one_sided(const OneSided& f, const std::string& depth, const std::string& rate) {
  std::string force = "(" + f.stiffness.text() + ")*max(" + depth + ",0)";
  if (!f.exponent.is_number() || f.exponent.number() != 1) force += "^(" + f.exponent.text() + ")";
  if (f.damping.is_number() && f.damping.number() == 0) return force;
  return force + "*max(1+(" + f.damping.text() + ")*" + rate + ",0)";
}

void add(Compilation& model, const StopSpec& f, int force, const std::string& where) {
  std::string resistance = "0";
  if (f.upper) resistance += "+" + one_sided(f, "way__-(" + f.upper->text() + ")", "rate__");
  if (f.lower) resistance += "-" + one_sided(f, "(" + f.lower->text() + ")-way__", "(-rate__)");
  Law resists = law(model, Expression::parse(resistance), kWay, {}, where);
  const Joint& joint = model.scene.joints[model.joint_index(f.joint, where + ".joint")];
  if (is_sliding(f.motion, joint.type)) {
    model.data.forces->of<SlidingForce>().push_back(
        {force, model.joint_displacement(f.joint, where + ".joint"), -1, std::move(resists)});
  } else {
    const int angle = model.angle_of(f.joint, where + ".joint");
    model.data.forces->of<RsdaForce>().push_back(
        {force, model.data.angles[static_cast<std::size_t>(angle)], angle, std::move(resists)});
  }
}

// The way is the height over a plane, or the distance of the centres, along which the force acts.
void add(Compilation& model, const ContactSpec& f, int force, const std::string& where) {
  const int body1 = model.body_index(f.body1, where + ".body1"), body2 = model.body_index(f.body2, where + ".body2");
  const FieldVector3 point1 = model.point(body1, f.point1, where + ".point1"),
                     point2 = model.point(body2, f.point2, where + ".point2");
  const std::string radius2 = "(" + f.radius2.text() + ")", radius1 = f.radius1 ? "(" + f.radius1->text() + ")" : "0";
  const std::string pushes = f.inside ? one_sided(f, "way__-" + radius1 + "+" + radius2, "rate__")
                                      : "-" + one_sided(f, radius1 + "+" + radius2 + "-way__", "(-rate__)");
  Law resists = law(model, Expression::parse(pushes), kWay, {}, where);
  if (f.normal1) {
    SlidingForce out{force, {{body1, body2}, {}}, -1, std::move(resists)};
    out.joint.measure.s1 = numbers(model.keep(out.joint.slot1, point1));
    out.joint.measure.s2 = numbers(model.keep(out.joint.slot2, point2));
    out.joint.measure.s3 = numbers(model.keep(out.joint.slot3, model.direction(body1, f.normal1, where + ".normal1")));
    model.data.forces->of<SlidingForce>().push_back(std::move(out));
  } else {
    TsdaForce out;
    out.force = force;
    out.body1 = body1;
    out.body2 = body2;
    out.s1 = numbers(model.keep(out.slot1, point1));
    out.s2 = numbers(model.keep(out.slot2, point2));
    out.law = std::move(resists);
    model.data.forces->of<TsdaForce>().push_back(std::move(out));
  }
}

// where is the force's place in the scene, or "user force". name is its own name, for messages.
void add_user_force(Compilation& model, std::shared_ptr<const UserForce> force, std::vector<std::string> bodies,
                    std::optional<TermValues> values, const std::string& where, std::string name) {
  UserForceData out;
  for (const std::string& body : bodies) out.bodies.push_back(moving_body(model, body, where));
  if (out.bodies.empty()) throw SceneError(where + ": acts on no body");
  if (force->inertia() && out.bodies.size() != 1) throw SceneError(where + ": mass terms act on one body");
  out.force =
      std::make_shared<const BoundForce>(std::move(force), std::move(bodies), std::move(values), std::move(name));
  model.data.user_forces.push_back(std::move(out));
}

void add(Compilation& model, const UserForceSpec& f, int, const std::string& where) {
  if (!f.term)
    throw SceneError(where + ".force: '" + f.force + "' is a force written in C++, which nothing has provided");
  const auto count = static_cast<Eigen::Index>(f.parameters.size());
  TermValues values{Eigen::VectorXd(count), Eigen::MatrixXd::Zero(count, model.data.rho.size())};
  for (Eigen::Index i = 0; i < count; ++i) {
    const TermParameter& parameter = f.parameters[static_cast<std::size_t>(i)];
    const FieldValue x = model.fields.value(parameter.value, child_path(where + ".parameters", parameter.name));
    values.p(i) = x.value();
    for (std::size_t k = 0; k < model.data.active.size(); ++k)
      values.p_rho(i, model.data.active[k]) = x.derivatives()(static_cast<Eigen::Index>(k));
  }
  add_user_force(model, f.term, bodies_of(f), std::move(values), where, where + " (" + f.force + ")");
}

}  // namespace

void compile_forces(Compilation& model) {
  for (std::size_t i = 0; i < model.scene.forces.size(); ++i) {
    const std::string where = child_path("forces", i);
    std::visit([&](const auto& kind) { add(model, kind, static_cast<int>(i), where); }, model.scene.forces[i].kind);
  }
}

void compile_user_forces(Compilation& model, std::vector<std::shared_ptr<const UserForce>> forces) {
  for (std::size_t i = 0; i < forces.size(); ++i) {
    if (!forces[i]) throw SceneError("user force: there is none (null)");
    std::vector<std::string> bodies = forces[i]->bodies();
    std::string name = "user force " + std::to_string(i);
    add_user_force(model, std::move(forces[i]), std::move(bodies), {}, "user force", std::move(name));
  }
}

}  // namespace mbsopt
