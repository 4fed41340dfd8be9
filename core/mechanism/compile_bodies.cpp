// Bodies: their inertia, and the guess of their initial state.
#include "core/mechanism/compilation.hpp"
#include "core/mechanism/mechanism.hpp"

namespace mbsopt {
namespace {

FieldVector3 unit_vector(const Compilation& model, std::size_t k) {
  FieldVector3 e{model.fields.constant(0), model.fields.constant(0), model.fields.constant(0)};
  e[k] = model.fields.constant(1);
  return e;
}

}  // namespace

FieldVector4 orientation_of(const Compilation& model, const OrientationField& field, const std::string& where) {
  if (const auto* e = std::get_if<EulerParametersField>(&field)) {
    const FieldVector4 p = model.fields.values(e->e, where);
    if (numbers(p).norm() == 0) throw SceneError(where + ": Euler parameters must not all be zero");
    return unit(p);
  }
  if (const auto* a = std::get_if<AxisAngleField>(&field)) {
    const FieldVector3 axis = model.fields.values(a->axis, where + ".axis");
    return euler_parameters(model.unit_axis(axis, where + ".axis"), model.fields.value(a->angle, where + ".angle"));
  }
  const FieldVector3 rpy = model.fields.values(std::get<RollPitchYawField>(field).rpy, where + ".rpy");
  FieldVector4 p = euler_parameters(unit_vector(model, 2), rpy[2]);
  p = quaternion_product(p, euler_parameters(unit_vector(model, 1), rpy[1]));
  return quaternion_product(p, euler_parameters(unit_vector(model, 0), rpy[0]));
}

namespace {

// J = tr(S) I - S with S = m U U': xx yy zz xy xz yz.
FieldVector<6> tensor_of(const Compilation& model, const ConsistentInertiaField& I, const FieldValue& m,
                         const std::string& where) {
  const FieldValue x = model.fields.value(I.x, where + ".x"), y = model.fields.value(I.y, where + ".y"),
                   z = model.fields.value(I.z, where + ".z"), xy = model.fields.value(I.xy, where + ".xy"),
                   xz = model.fields.value(I.xz, where + ".xz"), yz = model.fields.value(I.yz, where + ".yz");
  const FieldValue Sxx = x * x + xy * xy + xz * xz, Syy = y * y + yz * yz, Szz = z * z;
  const FieldValue Sxy = xy * y + xz * yz, Sxz = xz * z, Syz = yz * z;
  return {m * (Syy + Szz), m * (Sxx + Szz), m * (Sxx + Syy), -m * Sxy, -m * Sxz, -m * Syz};
}

FieldVector<6> inertia(const Compilation& model, const Body& body, const FieldValue& mass, const std::string& where) {
  if (body.consistent_inertia) return tensor_of(model, *body.consistent_inertia, mass, where + ".consistent");
  const InertiaField& I = body.inertia;
  return model.fields.values(std::array<Field, 6>{I.xx, I.yy, I.zz, I.xy, I.xz, I.yz}, where);
}

void add_body(Compilation& model, const Body& body, BodyData& out, FieldVector3& com, FieldVector4& p, FieldVector3& r,
              const std::string& where) {
  const FieldValue mass = model.fields.value(body.mass, where + ".mass");
  if (mass.value() < 0) throw SceneError(where + ".mass: is negative, a mass must not be");
  out.mass = mass.value();
  out.slot_mass = model.fields.slot(mass);
  const Vec<6> x = numbers(model.keep(out.slot_J, inertia(model, body, mass, where + ".inertia")));
  out.J << x(0), x(3), x(4), x(3), x(1), x(5), x(4), x(5), x(2);
  com = model.fields.values(body.com, where + ".com");
  out.com = numbers(model.keep(out.slot_com, com));

  p = orientation_of(model, body.orientation, where + ".orientation");
  r = model.fields.values(body.position, where + ".position") + rotated(p, com);
  const FieldVector<7> q{r[0], r[1], r[2], p[0], p[1], p[2], p[3]};
  out.q = numbers(model.keep(out.slot_q, q));
  out.velocity = numbers(model.keep(out.slot_velocity, model.fields.values(body.velocity, where + ".velocity")));
  out.angular_velocity = numbers(
      model.keep(out.slot_angular_velocity, model.fields.values(body.angular_velocity, where + ".angular_velocity")));
}

}  // namespace

void compile_bodies(Compilation& model) {
  model.data.n = static_cast<int>(model.scene.bodies.size());
  if (model.data.n == 0) throw SceneError("bodies: a scene needs at least one body besides the ground");
  model.data.bodies.resize(model.scene.bodies.size() + 1);
  model.data.bodies[0].q << 0, 0, 0, 1, 0, 0, 0;
  model.data.body_names = {"ground"};
  model.com.resize(model.data.bodies.size());
  for (FieldValue& c : model.com[0]) c = model.fields.constant(0);
  model.orientation.resize(model.data.bodies.size());
  model.position.resize(model.data.bodies.size());
  for (FieldValue& c : model.position[0]) c = model.fields.constant(0);
  for (std::size_t k = 0; k < 4; ++k) model.orientation[0][k] = model.fields.constant(k == 0 ? 1 : 0);
  for (std::size_t i = 0; i < model.scene.bodies.size(); ++i) {
    add_body(model, model.scene.bodies[i], model.data.bodies[i + 1], model.com[i + 1], model.orientation[i + 1],
             model.position[i + 1], child_path("bodies", i));
    model.data.body_names.push_back(model.scene.bodies[i].name);
  }
}

}  // namespace mbsopt
