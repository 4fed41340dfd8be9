// Bodies: their inertia, and the guess of their initial state.
#include "core/mechanism/compilation.hpp"
#include "core/mechanism/mechanism.hpp"

namespace mbsopt {
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
  const auto turn = [&](int k) { return euler_parameters(model.fields.constants(Vector3d::Unit(k)), rpy[at(k)]); };
  return quaternion_product(quaternion_product(turn(2), turn(1)), turn(0));
}

namespace {

// J = tr(S) I - S with S = m U U': xx yy zz xy xz yz.
FieldVector<6> tensor_of(const Compilation& model, const ConsistentInertiaField& I, const FieldValue& m,
                         const std::string& where) {
  const auto field = [&](const Field& value, const char* key) { return model.fields.value(value, where + key); };
  const FieldValue x = field(I.x, ".x"), y = field(I.y, ".y"), z = field(I.z, ".z");
  const FieldValue xy = field(I.xy, ".xy"), xz = field(I.xz, ".xz"), yz = field(I.yz, ".yz");
  const FieldValue Sxx = x * x + xy * xy + xz * xz, Syy = y * y + yz * yz, Szz = z * z;
  const FieldValue Sxy = xy * y + xz * yz, Sxz = xz * z, Syz = yz * z;
  return {m * (Syy + Szz), m * (Sxx + Szz), m * (Sxx + Syy), -m * Sxy, -m * Sxz, -m * Syz};
}

FieldVector<6> inertia(const Compilation& model, const Body& body, const FieldValue& mass, const std::string& where) {
  if (body.consistent_inertia) return tensor_of(model, *body.consistent_inertia, mass, where + ".consistent");
  const InertiaField& I = body.inertia;
  return model.fields.values(std::array<Field, 6>{I.xx, I.yy, I.zz, I.xy, I.xz, I.yz}, where);
}

void add_body(Compilation& model, const Body& body, const std::string& where) {
  BodyData out;
  const FieldValues& fields = model.fields;
  const FieldValue mass = fields.value(body.mass, where + ".mass");
  if (mass.value() < 0) throw SceneError(where + ".mass: is negative, a mass must not be");
  out.mass = mass.value();
  out.slot_mass = model.fields.slot(mass);
  const Vec<6> x = numbers(model.keep(out.slot_J, inertia(model, body, mass, where + ".inertia")));
  out.J << x(0), x(3), x(4), x(3), x(1), x(5), x(4), x(5), x(2);
  const FieldVector3 com = fields.values(body.com, where + ".com");
  out.com = numbers(model.keep(out.slot_com, com));
  const FieldVector4 p = orientation_of(model, body.orientation, where + ".orientation");
  const FieldVector3 r = fields.values(body.position, where + ".position") + rotated(p, com);
  const FieldVector<7> q{r[0], r[1], r[2], p[0], p[1], p[2], p[3]};
  out.q = numbers(model.keep(out.slot_q, q));
  out.velocity = numbers(model.keep(out.slot_velocity, fields.values(body.velocity, where + ".velocity")));
  out.angular_velocity =
      numbers(model.keep(out.slot_angular_velocity, fields.values(body.angular_velocity, where + ".angular_velocity")));
  model.com.push_back(com);
  model.orientation.push_back(p);
  model.position.push_back(r);
  model.data.bodies.push_back(out);
  model.data.body_names.push_back(body.name);
}

}  // namespace

void compile_bodies(Compilation& model) {
  model.data.n = static_cast<int>(model.scene.bodies.size());
  if (model.data.n == 0) throw SceneError("bodies: a scene needs at least one body besides the ground");
  const FieldVector3 origin = model.fields.constants(Vector3d::Zero());
  model.com = model.position = {origin};
  model.orientation.push_back({model.fields.constant(1), origin[0], origin[1], origin[2]});
  model.data.bodies.resize(1);
  model.data.bodies[0].q << 0, 0, 0, 1, 0, 0, 0;
  model.data.body_names = {"ground"};
  for (std::size_t i = 0; i < model.scene.bodies.size(); ++i)
    add_body(model, model.scene.bodies[i], child_path("bodies", i));
}

}  // namespace mbsopt
