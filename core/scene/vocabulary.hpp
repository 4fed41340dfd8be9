// Every field of a scene: its name in a problem file, its meaning, its dimension, and whether it is required. Functions
// tell this to a visitor, so it is written once. The reader of problem files, the checks, the search for unused
// parameters and the JSON Schema are visitors.
//
//   describe(visitor, body);      // visitor.name("name", body.name, ...), visitor.number("mass", body.mass, ...), ...
//
// A visitor offers (FieldInfo holds description, need and dimension; X may be const):
//   name(key, string&, says)                    a name that others refer to
//   text(key, string&, says)                    any text
//   reference(key, string&, To, says)           the name of a body, joint, force, sensor, parameter, objective
//   references(key, vector<string>&, To, says)
//   texts(key, vector<string>&, says)           a text, or a list of them
//   reference_or(key, string&, To, says, f)     the same, or an object: {"objective": name}, and the fields of f
//   choice(key, T&, Choice<T>[], says)          one of a few words that stand for values; true and false as such
//   word(key, string&, Words, says)             one of a few words
//   type(key, word, rows, says)                 the type of an object; returns its row, nullptr when there is none
//   number(key, Field&, says)                   a number or an expression over parameters and definitions
//   vector(key, VectorField&, says)             three of them
//   point(key, PointField&, body, says)         a point or vector of that body, by name or by its coordinates
//   inertia, orientation, points                the forms that the problem format gives them
//   expression(key, Expression&, Names, says)   an expression over further names, too; also optional<Expression>
//   time_law(key, Expression&, optional<SampledLaw>&, says)  an expression of t, or samples from a file
//   laws(key, LawVector&, Names, says)          three of them
//   plain(key, double&, Range, says)            a number without parameters; also long, int, bool, optional
//   level(key, optional<double>&, Choice<double>[], Range, says)  a number, or one of a few words for numbers
//   instead_of(key, object, Words)              if the key is given, that object must not have these fields
//   object(key, T&, says)                       describe(visitor, T) inside; also optional<T>
//   group(key, says, f)                         f(visitor) inside: fields that are nested in the file only
//   list(key, vector<T>&, says)                 describe(visitor, T) for each
//   named(key, vector<T>&, says)                the same if the file has an object, its keys the names
//   values_of(key, vector<pair<string, double>>&, To, Range, says)  numbers by the name of a parameter or body
//   tolerance(key, double&, optional<KindTolerances>&, says)  a number, or one for each kind of component
//   version(key, number, says)                  that number and no other
//   misplaced(key, where)                       a field of other objects of this kind, which `where` names
//   rest_unknown()                              the type is unknown, hence also the other fields
#pragma once

#include <concepts>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <variant>

#include "core/scene/scene.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt {

struct FieldInfo {
  std::string_view description;
  Need need = Need::optional;
  std::optional<Dimension> dimension = {};  // nullopt: any
};

enum class ElementKind { body, joint, drive, force, sensor, parameter, objective };
inline constexpr std::size_t kElementKinds = 7;
inline constexpr std::string_view kObjectiveKey = "objective";  // in the object of a reference_or

// Names that an expression may use besides parameters and definitions.
enum class Scope {
  none,
  tsda_law,
  rsda_law,
  time_law,
  state,  // t and sensors of (t, q, v)
  sensor,
  objective  // as sensor: t and all sensors
};

template <class T>
struct Choice {
  std::string_view word;
  T value;
};

struct Words {
  std::string_view available;
};

struct Range {
  double least = -std::numeric_limits<double>::infinity();
  bool open = false;  // least itself is not allowed
};
inline constexpr Range kAny{};
inline constexpr Range kPositive{0, true};
inline constexpr Range kNotNegative{0, false};

template <class T, class Of>
concept Like = std::same_as<std::remove_const_t<T>, Of>;

// Makes an object one of that type, unless it is constant or has no type.
void become(auto& object, const TypeRow& row) {
  if constexpr (requires { set_type(object, row.name); }) set_type(object, row.name);
}

inline constexpr Choice<ParameterScale> kParameterScales[] = {
    {"linear", ParameterScale::linear}, {"log", ParameterScale::log}, {"log10", ParameterScale::log10}};
inline constexpr Choice<FormulationType> kFormulations[] = {
    {"augmented_lagrangian", FormulationType::augmented_lagrangian}, {"penalty", FormulationType::penalty}};
inline constexpr Choice<LinearSolver> kLinearSolvers[] = {{"cholesky", LinearSolver::cholesky},
                                                          {"quasidefinite", LinearSolver::quasidefinite}};
inline constexpr Choice<ModelChoice> kModels[] = {
    {"auto", ModelChoice::automatic}, {"planar", ModelChoice::planar}, {"spatial", ModelChoice::spatial}};
inline constexpr Choice<Solve> kSolves[] = {
    {"auto", Solve::automatic}, {"kinematics", Solve::kinematics}, {"dynamics", Solve::dynamics}};
inline constexpr Choice<Projection> kProjections[] = {{"none", Projection::none},
                                                      {"velocity", Projection::velocity},
                                                      {"position_velocity", Projection::position_velocity}};
inline constexpr Choice<double> kAccuracies[] = {{"draft", 1e-3}, {"engineering", 1e-5}, {"reference", 1e-9}};
inline constexpr Choice<Interpolation> kInterpolations[] = {
    {"hold", Interpolation::hold}, {"linear", Interpolation::linear}, {"spline", Interpolation::spline}};
inline constexpr Choice<double> kTimeZeros[] = {{"first", SampleColumn::kFirstRow}};
inline constexpr Choice<bool> kKinks[] = {{"locate", true}, {"ignore", false}};
inline constexpr Choice<bool> kFrames[] = {{"global", false}, {"body", true}};

void describe(auto& v, Like<Parameter> auto& p) {
  v.plain("value", p.value, kAny, {"where a run starts, SI", Need::required});
  v.plain("lower", p.lower, kAny, {"lower bound, SI"});
  v.plain("upper", p.upper, kAny, {"upper bound, SI"});
  v.choice("scale", p.scale, kParameterScales, {"how an optimiser scales the parameter"});
  v.text("unit", p.unit, {"SI unit of the value, such as N/m; expressions are checked against it"});
  v.plain("allow_unused", p.allow_unused, kAny, {"true: no error if nothing depends on the parameter"});
  v.object("prior", p.prior, {"what is known of it beforehand; a residual of its own in identify"});
}

void describe(auto& v, Like<Prior> auto& p) {
  std::string type = "normal";
  v.word("type", type, Words{"normal"}, {"distribution"});
  v.plain("mean", p.mean, kAny, {"in the parameter's unit", Need::required});
  v.plain("sigma", p.sigma, kPositive, {"standard deviation, in the parameter's unit", Need::required});
}

void describe(auto& v, Like<InertiaField> auto& i) {
  using dimension::kInertia;
  v.number("xx", i.xx, {"about x [kg m^2]", Need::required, kInertia});
  v.number("yy", i.yy, {"about y [kg m^2]", Need::required, kInertia});
  v.number("zz", i.zz, {"about z [kg m^2]", Need::required, kInertia});
  v.number("xy", i.xy, {"tensor entry, minus the product of inertia [kg m^2]", Need::optional, kInertia});
  v.number("xz", i.xz, {"tensor entry, minus the product of inertia [kg m^2]", Need::optional, kInertia});
  v.number("yz", i.yz, {"tensor entry, minus the product of inertia [kg m^2]", Need::optional, kInertia});
}

void describe(auto& v, Like<ConsistentInertiaField> auto& i) {
  using dimension::kLength;
  v.number("x", i.x, {"extent of the mass along x, root mean square about its centre [m]", Need::required, kLength});
  v.number("y", i.y, {"along y [m]", Need::required, kLength});
  v.number("z", i.z, {"along z [m]", Need::required, kLength});
  v.number("xy", i.xy, {"shear: S = m U U' with U = [x xy xz; 0 y yz; 0 0 z] [m]", Need::optional, kLength});
  v.number("xz", i.xz, {"shear [m]", Need::optional, kLength});
  v.number("yz", i.yz, {"shear [m]", Need::optional, kLength});
}

void describe(auto& v, Like<AxisAngleField> auto& o) {
  v.vector("axis", o.axis, {"direction, of any length", Need::required});
  v.number("angle", o.angle, {"right-handed about the axis [rad]", Need::required, dimension::kAngle});
}

void describe(auto& v, Like<RollPitchYawField> auto& o) {
  v.vector("rpy", o.rpy, {"about the fixed axes x, y, z, in this order [rad]", Need::required, dimension::kAngle});
}

void describe(auto& v, Like<Shape> auto& s) {
  v.word("type", s.type, Words{"rod box sphere cylinder"}, {"shape that is drawn", Need::required});
  v.point("from", s.from, "", {"one end, a point of the body"});
  v.point("to", s.to, "", {"the other end"});
  v.plain("radius", s.radius, kPositive, {"[m]"});
}

void describe(auto& v, Like<Body> auto& b) {
  using namespace dimension;
  v.name("name", b.name, {"name of the body; 'ground' is predefined", Need::required});
  v.number("mass", b.mass, {"[kg]", Need::required, kMass});
  v.vector("com", b.com, {"centre of mass in the body frame [m]", Need::optional, kLength});
  v.inertia("inertia", b.inertia, b.consistent_inertia,
            {"tensor entries about the centre of mass, body axes [kg m^2]", Need::required, kInertia});
  v.vector("position", b.position, {"of the body-frame origin, global [m]; a guess", Need::optional, kLength});
  v.orientation("orientation", b.orientation, {"of the body frame; a guess"});
  v.vector("velocity", b.velocity, {"of the body-frame origin, global [m/s]; a guess", Need::optional, kVelocity});
  v.vector("angular_velocity", b.angular_velocity, {"global components [rad/s]; a guess", Need::optional, kRate});
  v.points("points", b.points, {"named points and vectors in the body frame [m]", Need::optional, kLength});
  v.list("shape", b.shapes, {"drawing only"});
}

void describe(auto& v, Like<Joint> auto& j) {
  using namespace dimension;
  const TypeRow* const type = v.type("type", j.type, std::span(kJointTypes), {"type of the joint", Need::required});
  v.name("name", j.name, {"name of the joint", Need::required});
  if (!type) return v.rest_unknown();
  const TypeRow& row = *type;
  become(j, row);
  const bool has_bodies = row["joint1"] == Need::unknown;
  v.reference("body1", j.body1, ElementKind::body, {"first body", has_bodies ? Need::optional : Need::unknown});
  v.reference("body2", j.body2, ElementKind::body, {"second body", has_bodies ? Need::required : Need::unknown});
  v.point("point1", j.point1, j.body1, {"point of body1 [m]", row["point1"], kLength});
  v.point("point2", j.point2, j.body2, {"point of body2 [m]", row["point2"], kLength});
  v.point("axis1", j.axis1, j.body1, {"direction in body1", row["axis1"]});
  v.point("axis2", j.axis2, j.body2, {"direction in body2", row["axis2"]});
  v.point("normal1", j.normal1, j.body1, {"direction in body1 from which the angle is measured", row["normal1"]});
  v.point("normal2", j.normal2, j.body2, {"direction in body2 to which the angle is measured", row["normal2"]});
  v.number("length", j.length, {"of the rod [m]", row["length"], kLength});
  v.reference("joint1", j.joint1, ElementKind::joint, {"joint that turns", row["joint1"]});
  v.reference("joint2", j.joint2, ElementKind::joint, {"joint that follows", row["joint2"]});
  v.number("ratio", j.ratio, {"angle of joint2 per angle of joint1", row["ratio"], Dimension{}});
  v.number("radius", j.radius, {"displacement of joint2 per radian of joint1 [m]", row["radius"], kLength});
  v.number("pitch", j.pitch, {"displacement per turn, right-handed [m]", row["pitch"], kLength});
}

void describe_samples(auto& v, auto& c, std::string_view file) {
  v.text(file, c.file, {"CSV file with a header row, relative to the problem file", Need::required});
  v.text("column", c.column,
         {"header of the column of values, with its unit (\"tau [N m]\") or without it", Need::required});
  v.text("time", c.time, {"header of the column of times"});
  v.text("unit", c.unit, {"of the values, instead of the unit in the header; without either they are SI"});
  v.text("time_unit", c.time_unit, {"of the times, instead of the unit in the header; without either they are in s"});
  v.level("time_zero", c.time_zero, kTimeZeros, kAny,
          {"time of the file at t = 0 [s], or first: that of the first row; 0 when absent", Need::optional,
           dimension::kTime});
}

void describe(auto& v, Like<SampledLaw> auto& l) {
  v.text("user", l.function,
         {"name of a function of a plug-in or of the program", l.function.empty() ? Need::optional : Need::required});
  if (l.function.empty()) return describe_samples(v, l, "csv");
  v.expression("argument", l.argument, Scope::time_law, {"of the function: of t and parameters; t when absent"});
}

void describe(auto& v, Like<Signal> auto& s) {
  describe_samples(v, s, "file");
  v.choice("interpolation", s.interpolation, kInterpolations,
           {"between samples: hold keeps the last value, linear has kinks, spline is C2"});
  v.number("delay", s.delay, {"gain f(t - delay) + offset [s]", Need::optional, dimension::kTime});
  v.number("gain", s.gain, {"factor of the samples"});
  v.number("offset", s.offset, {"added, in SI units"});
}

void describe(auto& v, Like<Drive> auto& d) {
  using namespace dimension;
  const TypeRow* const type = v.type("type", d.type, std::span(kDriveTypes), {"type of the drive", Need::required});
  v.name("name", d.name, {"name of the drive", Need::required});
  if (!type) return v.rest_unknown();
  const TypeRow& row = *type;
  become(d, row);
  v.reference("body", d.body, ElementKind::body, {"body whose coordinate is driven", row["body"]});
  v.word("coordinate", d.coordinate, Words{"x y z e0 e1 e2 e3"},
         {"of the centre of mass [m], or an Euler parameter", row["coordinate"]});
  v.reference("joint", d.joint, ElementKind::joint, {"joint that is driven", row["joint"]});
  v.reference("body1", d.body1, ElementKind::body, {"body of the first point", row["body1"]});
  v.reference("body2", d.body2, ElementKind::body, {"body of the second point", row["body2"]});
  v.point("point1", d.point1, d.body1, {"first point [m]", row["point1"], kLength});
  v.point("point2", d.point2, d.body2, {"second point [m]", row["point2"], kLength});
  v.time_law("law", d.law, d.samples,
             {"expression of t and parameters, or {\"csv\": file, \"time\": column, \"column\": column}, or {\"user\": "
              "function, \"argument\": expression}",
              Need::required, dimension_of_drive(d.type, d.coordinate)});
}

void describe(auto& v, Like<Tsda> auto& f, const TypeRow& row) {
  using namespace dimension;
  v.reference("body1", f.body1, ElementKind::body, {"first body", row["body1"]});
  v.reference("body2", f.body2, ElementKind::body, {"second body", row["body2"]});
  v.point("point1", f.point1, f.body1, {"point of body1 [m]", row["point1"], kLength});
  v.point("point2", f.point2, f.body2, {"point of body2 [m]", row["point2"], kLength});
  v.number("stiffness", f.stiffness, {"k [N/m]", row["stiffness"], kStiffness});
  v.number("damping", f.damping, {"c [N s/m]", row["damping"], kDamping});
  v.number("free_length", f.free_length, {"l0 [m]", row["free_length"], kLength});
  v.number("actuator", f.actuator, {"constant tension [N]", row["actuator"], kForce});
  v.expression("law", f.law, Scope::tsda_law,
               {"tension [N] as an expression of l, ldot and t, instead of the coefficients", row["law"], kForce});
}

void describe_torsion(auto& v, auto& f, const TypeRow& row) {
  using namespace dimension;
  v.number("stiffness", f.stiffness, {"k [N m/rad]", row["stiffness"], kTorque});
  v.number("damping", f.damping, {"c [N m s/rad]", row["damping"], kTorsionalDamping});
  v.number("free_angle", f.free_angle, {"angle without torque [rad]", row["free_angle"], kAngle});
  v.expression("law", f.law, Scope::rsda_law,
               {"resisting torque [N m] as an expression of angle, rate and t, instead of the coefficients", row["law"],
                kTorque});
}

void describe(auto& v, Like<Rsda> auto& f, const TypeRow& row) {
  v.reference("joint", f.joint, ElementKind::joint, {"joint on whose angle it acts", row["joint"]});
  describe_torsion(v, f, row);
}

void describe(auto& v, Like<TorsionBar> auto& f, const TypeRow& row) {
  v.reference("body1", f.body1, ElementKind::body, {"first body, in which the axis is fixed", row["body1"]});
  v.reference("body2", f.body2, ElementKind::body, {"second body", row["body2"]});
  v.point("axis", f.axis, f.body1, {"axis about which it acts, in the axes of body1", row["axis"]});
  describe_torsion(v, f, row);
}

void describe(auto& v, Like<PointForce> auto& f, const TypeRow& row) {
  v.reference("body", f.body, ElementKind::body, {"body it acts on", row["body"]});
  v.point("point", f.point, f.body, {"point of the body [m]", row["point"], dimension::kLength});
  v.laws("components", f.components, Scope::state,
         {"x, y, z [N], expressions of t, parameters and sensors", row["components"], dimension::kForce});
  v.choice("frame", f.in_body_frame, kFrames, {"axes of the components", row["frame"]});
}

void describe(auto& v, Like<Torque> auto& f, const TypeRow& row) {
  v.reference("body", f.body, ElementKind::body, {"body it acts on", row["body"]});
  v.laws("components", f.components, Scope::state,
         {"x, y, z [N m], expressions of t, parameters and sensors", row["components"], dimension::kTorque});
  v.choice("frame", f.in_body_frame, kFrames, {"axes of the components", row["frame"]});
}

void describe(auto& v, Like<BushingSpec> auto& f, const TypeRow& row) {
  using namespace dimension;
  v.reference("body1", f.body1, ElementKind::body, {"first body, whose axes the coefficients refer to", row["body1"]});
  v.reference("body2", f.body2, ElementKind::body, {"second body", row["body2"]});
  v.point("point1", f.point1, f.body1, {"point of body1 [m]", row["point1"], kLength});
  v.point("point2", f.point2, f.body2, {"point of body2 [m]", row["point2"], kLength});
  v.vector("stiffness", f.stiffness, {"along x, y, z of body1 [N/m]", row["stiffness"], kStiffness});
  v.vector("damping", f.damping, {"along x, y, z of body1 [N s/m]", row["damping"], kDamping});
  v.vector("torsional_stiffness", f.torsional_stiffness,
           {"about x, y, z of body1 [N m/rad]", row["torsional_stiffness"], kTorque});
  v.vector("torsional_damping", f.torsional_damping,
           {"about x, y, z of body1 [N m s/rad]", row["torsional_damping"], kTorsionalDamping});
}

void describe(auto& v, Like<FrictionSpec> auto& f, const TypeRow& row) {
  v.reference("joint", f.joint, ElementKind::joint, {"joint it acts in", row["joint"]});
  v.word("motion", f.motion, Words{"rotation translation"},
         {"about or along the axis; when absent, about it where the joint has an angle", row["motion"]});
  v.number("coulomb", f.coulomb, {"torque [N m] or force [N] at high rates", row["coulomb"]});
  v.number("smooth_velocity", f.smooth_velocity,
           {"rate at which the Coulomb part is 0.71 of its level [rad/s], [m/s]", row["smooth_velocity"]});
  v.number("viscous", f.viscous, {"torque [N m s/rad] or force [N s/m] per rate", row["viscous"]});
  v.number(
      "breakaway", f.breakaway,
      {"torque [N m] or force [N] of dry friction at low rates; when absent, that at high rates", row["breakaway"]});
  v.number("stribeck_velocity", f.stribeck_velocity,
           {"rate at which 1/e of breakaway - coulomb is left [rad/s], [m/s]", row["stribeck_velocity"]});
}

void describe_one_sided(auto& v, auto& f, const TypeRow& row) {
  v.number("stiffness", f.stiffness, {"k, of the depth d: k d^n (1 + a ddot)", row["stiffness"]});
  v.number("exponent", f.exponent, {"n: 1 of a spring, 1.5 of two balls (Hertz)", row["exponent"], Dimension{}});
  v.number("damping", f.damping, {"a, of Hunt and Crossley [s/m], [s/rad]", row["damping"]});
}

void describe(auto& v, Like<StopSpec> auto& f, const TypeRow& row) {
  v.reference("joint", f.joint, ElementKind::joint, {"joint it acts in", row["joint"]});
  v.word("motion", f.motion, Words{"rotation translation"},
         {"about or along the axis; when absent, about it where the joint has an angle", row["motion"]});
  v.number("lower", f.lower, {"angle [rad] or displacement [m] below which it acts", row["lower"]});
  v.number("upper", f.upper, {"the same above which it acts", row["upper"]});
  describe_one_sided(v, f, row);
}

void describe(auto& v, Like<ContactSpec> auto& f, const TypeRow& row) {
  using namespace dimension;
  v.reference("body1", f.body1, ElementKind::body, {"body of the plane, the first ball or the ring", row["body1"]});
  v.reference("body2", f.body2, ElementKind::body, {"body of the ball, or of a point", row["body2"]});
  v.point("point1", f.point1, f.body1, {"point of the plane, or centre [m]", row["point1"], kLength});
  v.point("point2", f.point2, f.body2, {"centre of the ball [m]", row["point2"], kLength});
  v.point("normal1", f.normal1, f.body1, {"out of a plane, in the axes of body1", row["normal1"]});
  v.number("radius1", f.radius1, {"of the first ball or the ring [m]", row["radius1"], kLength});
  v.number("radius2", f.radius2, {"of the ball; 0: a point [m]", row["radius2"], kLength});
  v.plain("inside", f.inside, kAny, {"whether the ball is inside of the ring of radius1"});
  describe_one_sided(v, f, row);
}

void describe(auto& v, Like<UserForceSpec> auto& f, const TypeRow& row) {
  v.text("force", f.force, {"name of a force of a plug-in or of the program", row["force"]});
  v.references("bodies", f.bodies, ElementKind::body,
               {"bodies of the force, in its order; when absent those that the force names", row["bodies"]});
  v.named("parameters", f.parameters,
          {"parameters of the force, each an expression of parameters of the problem", row["parameters"]});
}

void describe(auto& v, Like<Force> auto& f) {
  const TypeRow* const row = v.type("type", type_of(f), std::span(kForceTypes), {"type of the force", Need::required});
  v.name("name", f.name, {"name of the force", Need::required});
  if (!row) return v.rest_unknown();
  become(f, *row);
  std::visit([&](auto& kind) { describe(v, kind, *row); }, f.kind);
}

void describe(auto& v, Like<PointOnBody> auto& p) {
  v.reference("body", p.body, ElementKind::body, {"a body", Need::required});
  v.point("point", p.point, p.body, {"a point of it [m]", Need::optional, dimension::kLength});
}

void describe(auto& v, Like<Sensor> auto& s) {
  using dimension::kLength;
  const TypeRow* const type =
      v.type("quantity", s.quantity, std::span(kSensorQuantities), {"what is measured", Need::required});
  if (!type) return v.rest_unknown();
  const TypeRow& row = *type;
  become(s, row);
  v.reference("body", s.body, ElementKind::body, {"body it is on", row["body"]});
  v.point("point", s.point, s.body, {"point of the body [m]", row["point"], kLength});
  if (row["relative_to"] != Need::unknown)
    v.object("relative_to", s.relative_to, {"point whose position or velocity is subtracted"});
  v.word("component", s.component, Words{row.components}, {"which component", row["component"]});
  v.choice("frame", s.in_body_frame, kFrames, {"axes of the component", row["frame"]});
  v.reference("joint", s.joint, ElementKind::joint, {"joint that has it", row["joint"]});
  v.reference("body1", s.body1, ElementKind::body, {"body of the first point", row["body1"]});
  v.reference("body2", s.body2, ElementKind::body, {"body of the second point", row["body2"]});
  v.point("point1", s.point1, s.body1, {"first point [m]", row["point1"], kLength});
  v.point("point2", s.point2, s.body2, {"second point [m]", row["point2"], kLength});
  v.reference("force", s.force, ElementKind::force, {"a tsda, rsda, torsion_bar, stop or contact", row["force"]});
  v.word("kind", s.kind, Words{"force torque"}, {"which reaction", row["kind"]});
  v.reference("drive", s.drive, ElementKind::drive, {"a drive", row["drive"]});
  v.point("axis", s.axis, s.body1.empty() ? "ground" : s.body1, {"direction in the ground, or in body1", row["axis"]});
  v.expression("value", s.value, Scope::sensor,
               {"expression of t, parameters, definitions and other sensors", row["value"]});
  v.orientation("axes", s.axes,
                {"orientation of the sensor's axes in the body's axes, written like that of a body", row["axes"]});
}

void describe(auto& v, Like<Limit> auto& l) {
  v.name("name", l.name, {"name of the limit", Need::required});
  v.reference("sensor", l.sensor, ElementKind::sensor, {"a position, displacement, distance or angle", Need::required});
  v.number("lower", l.lower, {"value below which the sensor never is"});
  v.number("upper", l.upper, {"value above which the sensor never is"});
  v.number("restitution", l.restitution, {"part of the rate after an impact, 0 to 1", Need::optional, Dimension{}});
}

void describe(auto& v, Like<Condition> auto& c) {
  v.reference("sensor", c.sensor, ElementKind::sensor, {"a sensor", Need::required});
  v.number("value", c.value, {"its value at the start"});
  v.number("rate", c.rate, {"time derivative of its value at the start"});
  v.number("acceleration", c.acceleration, {"of kinematics: second time derivative of its value"});
}

void describe(auto& v, Like<FormulationSettings> auto& f) {
  v.choice("type", f.type, kFormulations, {"form of the equations of motion"});
  if constexpr (!std::is_const_v<std::remove_reference_t<decltype(f)>>)
    if (f.type == FormulationType::penalty) f = FormulationSettings::penalty();
  v.plain("alpha", f.alpha, kPositive,
          {"penalty factor: absolute (penalty), or relative to the inertia each constraint sees"});
  v.plain("xi", f.xi, kNotNegative, {"damping ratio of the stabilisation"});
  v.plain("omega", f.omega, kNotNegative, {"natural frequency of the stabilisation [1/s]"});
  v.plain("iterations", f.iterations, kNotNegative, {"augmented Lagrangian: iterations at most"});
  v.plain("tolerance", f.tolerance, kNotNegative,
          {"augmented Lagrangian: relative, on the constraints' accelerations"});
  v.choice("projection", f.projection, kProjections, {"of the state onto the constraints after each step"});
  if (f.type == FormulationType::penalty) {
    v.choice("linear_solver", f.linear_solver, kLinearSolvers,
             {"of the penalty form: cholesky loses digits as alpha grows, quasidefinite does not"});
  } else {
    v.misplaced("linear_solver", "of the type 'penalty' only");
  }
}

void describe(auto& v, Like<IntegratorOptions> auto& o) {
  v.plain("min_step", o.min_step, kPositive, {"a step that would fall below it ends the run [s]"});
  v.plain("newton_tolerance", o.newton_tolerance, kPositive,
          {"implicit methods: error of the stages as a part of the tolerance, below 1; when absent sqrt(rtol), at most "
           "0.01; cvodes_bdf: 0.1"});
  v.plain("newton_iterations", o.newton_iterations, kPositive,
          {"implicit methods: iterations at most; when absent 10, of cvodes_bdf 3"});
  v.plain("factor_min", o.factor_min, kPositive,
          {"the next step is at least this part of the last one, below 1; when absent 0.2"});
  v.plain("factor_max", o.factor_max, kPositive,
          {"the next step is at most this multiple of the last one, at least 1.25; when absent 6"});
  v.plain("safety", o.safety, kPositive, {"part of the step that the error allows, below 1; when absent 0.9"});
  v.word("controller", o.controller, Words{"I PI PID"},
         {"of the step: from the last error, the last two, the last three; when absent PI"});
}

void describe(auto& v, Like<KindTolerances> auto& t) {
  v.plain("position", t.position, kPositive, {"of positions [m]; when absent the smallest of this object"});
  v.plain("angle", t.angle, kPositive,
          {"of Euler parameters (half an angle); when absent the smallest of this object"});
  v.plain("velocity", t.velocity, kPositive, {"of velocities [m/s]; when absent the smallest of this object"});
  v.plain("rate", t.rate, kPositive,
          {"of the rates of Euler parameters [1/s]; when absent the smallest of this object"});
  v.values_of("bodies", t.bodies, ElementKind::body, kPositive, {"of all components of a body, by its name"});
}

void describe(auto& v, Like<IntegratorSettings> auto& i) {
  v.word("type", i.type, Words{integrator_names()}, {"integration method"});
  v.tolerance("rtol", i.rtol, i.rtol_of, {"relative tolerance of a step: a number, or one for each kind of component"});
  v.tolerance("atol", i.atol, i.atol_of, {"absolute tolerance of a step: a number, or one for each kind of component"});
  v.plain("initial_step", i.initial_step, kPositive, {"[s]; chosen automatically when absent"});
  v.plain("max_step", i.max_step, kPositive, {"[s]"});
  v.plain("step", i.step, kPositive, {"fixed step [s]"});
  v.plain("max_steps", i.max_steps, kPositive, {"a run that needs more fails"});
  v.object("options", i.options, {"step-size control and Newton's method"});
}

void describe(auto& v, Like<SimulationSettings> auto& s) {
  v.plain("start_time", s.start_time, kAny, {"[s]", Need::optional, dimension::kTime});
  v.plain("end_time", s.end_time, kAny, {"[s]", Need::optional, dimension::kTime});
  v.plain("output_step", s.output_step, kPositive, {"of trajectory.csv [s]; 200 rows when absent"});
  v.plain("redundancy_tolerance", s.redundancy_tolerance, kNotNegative,
          {"rounding of points and axes (part of a length, rad) within which redundant equations of a loop are made to "
           "agree; 0: numbers are exact"});
  v.choice("model", s.model, kModels,
           {"three unknowns per body (planar) or six (spatial); auto: planar where joints hold all bodies in a plane"});
  v.choice("solve", s.solve, kSolves,
           {"where drives leave nothing free: positions solved at each instant (kinematics) or motion integrated "
            "(dynamics); auto: solved"});
  v.object("formulation", s.formulation, {"form of the equations of motion"});
  v.level("accuracy", s.accuracy, kAccuracies, kPositive,
          {"wanted relative error of the objectives (of the motion if there are none), which chooses integrator and "
           "tolerances: draft 1e-3, engineering 1e-5, reference 1e-9, or a number"});
  v.object("integrator", s.integrator, {"time integration"});
  v.instead_of("accuracy", "integrator", Words{"type rtol atol step options"});
  v.numbers("events", s.events, kAny,
            {"times at which a law may jump or have a kink: a step ends there [s]", Need::optional, dimension::kTime});
  v.choice("kinks", s.follows_kinks, kKinks,
           {"steps end where laws and costs have kinks or jump, and gradients follow these instants (locate); ignore "
            "them, for comparison"});
  v.plain("adjoint_memory_mib", s.adjoint_memory_mib, kPositive,
          {"memory of an adjoint run for the forward motion [MiB]; steps that do not fit are computed again"});
}

void describe(auto& v, Like<Scene> auto& s) {
  v.text("name", s.name, {"name of the problem; its results go to out/<name>/"});
  v.vector("gravity", s.gravity, {"[m/s^2]", Need::optional, dimension::kAcceleration});
  v.named("parameters", s.parameters, {"what may be designed or identified"});
  v.named("definitions", s.definitions, {"named sub-expressions"});
  v.named("signals", s.signals, {"functions of time from CSV files, which laws use by name"});
  v.list("bodies", s.bodies, {"rigid bodies", Need::required});
  v.list("joints", s.joints, {"joints between bodies"});
  v.list("drives", s.drives, {"rheonomic constraints: what follows a law of time"});
  v.list("forces", s.forces, {"springs, dampers and actuators"});
  v.group("initial", {"the state at the start time"}, [&](auto& inside) {
    inside.list("conditions", s.conditions, {"values and rates of sensors that the assembled state must have"});
    inside.plain("iterations", s.assembly_iterations, kPositive,
                 {"of the assembly of positions or velocities, at most"});
    inside.plain("equilibrium", s.equilibrium, kAny,
                 {"true: start at rest from the static equilibrium near the guess"});
  });
  v.named("sensors", s.sensors, {"what can be measured on a state"});
  v.list("limits", s.limits, {"bounds that sensors never pass: bodies strike them and rebound"});
  v.object("simulation", s.simulation, {"how the mechanism is simulated"});
}

}  // namespace mbsopt
