#include "core/scene/issues.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>

#include "core/expression/did_you_mean.hpp"
#include "core/expression/syntax_tree.hpp"
#include "core/scene/checker.hpp"
#include "core/scene/inertia_check.hpp"
#include "core/scene/signals.hpp"

namespace mbsopt {

namespace {

using Vector = std::array<double, 3>;

double norm(const Vector& v) { return std::hypot(v[0], v[1], v[2]); }
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
bool is_finite(const Vector& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }
Vector unit(const Vector& v) { return {v[0] / norm(v), v[1] / norm(v), v[2] / norm(v)}; }

// Returns a usable direction, and reports a zero vector.
std::optional<Vector> direction(Checker& checker, std::string_view key, const std::optional<PointField>& field,
                                const std::string& body) {
  if (!field) return std::nullopt;
  const auto v = checker.facts().value(*field, body);
  if (!v || !is_finite(*v)) return std::nullopt;
  if (norm(*v) > 0) return unit(*v);
  checker.issue(checker.path(key), "is a zero vector, a direction must not be");
  return std::nullopt;
}

bool angle_is_used(const Scene& scene, const std::string& joint, const std::string& joint_type) {
  for (const Force& force : scene.forces) {
    const auto* rsda = std::get_if<Rsda>(&force.kind);
    const auto* friction = std::get_if<FrictionSpec>(&force.kind);
    if (rsda && rsda->joint == joint) return true;
    if (friction && friction->joint == joint && !is_sliding(friction->motion, joint_type)) return true;
  }
  for (const Sensor& sensor : scene.sensors) {
    const TypeRow* const row = find_row(kSensorQuantities, sensor.quantity);
    if (sensor.joint == joint && row && (row->dimension == dimension::kAngle || row->dimension == dimension::kRate))
      return true;
  }
  for (const Drive& drive : scene.drives)
    if (drive.type == "angle" && drive.joint == joint) return true;
  return false;
}

void check_normals(Checker& checker, const Joint& joint, const std::optional<Vector>& axis1,
                   const std::optional<Vector>& axis2) {
  const auto normal1 = direction(checker, "normal1", joint.normal1, joint.body1);
  const auto normal2 = direction(checker, "normal2", joint.normal2, joint.body2);
  constexpr double kParallel = 1e-9, kSame = 1e-12;
  const auto check_angle = [&](std::string_view key, const std::optional<Vector>& n, const std::optional<Vector>& a) {
    if (n && a && 1 - std::abs(dot(*n, *a)) < kParallel * kParallel)
      checker.issue(checker.path(key), "is parallel to the axis; it must have a part perpendicular to it");
  };
  check_angle("normal1", normal1, axis1);
  check_angle("normal2", normal2, axis2);
  if (joint.normal1.has_value() != joint.normal2.has_value())
    checker.issue(checker.path(joint.normal1 ? "normal2" : "normal1"), "is missing; give both normals, or neither");
  if (joint.normal1 || joint.normal2 || !axis1 || !axis2) return;
  const Vector difference{(*axis1)[0] - (*axis2)[0], (*axis1)[1] - (*axis2)[1], (*axis1)[2] - (*axis2)[2]};
  if (norm(difference) > kSame && angle_is_used(checker.facts().scene(), joint.name, joint.type))
    checker.issue(checker.path(),
                  "its angle is used and axis1 differs from axis2: make them equal, or give normal1 and normal2");
}

void check_joint_has(Checker& checker, std::string_view key, const std::string& name, std::string_view what) {
  const Joint* const joint = checker.facts().joint(name);
  if (!joint || !find_row(kJointTypes, joint->type)) return;
  if (has_word(what == "angle" ? kJointsWithAngle : kJointsWithDisplacement, joint->type)) return;
  checker.issue(checker.path(key), "joint '" + name + "' is " + joint->type + " and has no " + std::string(what) +
                                       "; joints that have one: " +
                                       joined(words(what == "angle" ? kJointsWithAngle : kJointsWithDisplacement)));
}
void check_joint_has_angle(Checker& checker, const std::string& name) {
  check_joint_has(checker, "joint", name, "angle");
}

void check_two_bodies(Checker& checker, const std::string& body1, const std::string& body2, std::string_view what) {
  if (!body2.empty() && body1 == body2)
    checker.issue(checker.path("body2"), "is '" + body2 + "' like body1; " + std::string(what) + " needs two bodies");
}

void check_friction(Checker& checker, const FrictionSpec& friction) {
  using namespace dimension;
  const Joint* const joint = checker.facts().joint(friction.joint);
  const bool slides = joint && is_sliding(friction.motion, joint->type);
  check_joint_has(checker, "joint", friction.joint, slides ? "displacement" : "angle");
  const auto check = [&](std::string_view key, const auto& field, const Dimension& turning, const Dimension& sliding) {
    if (joint) checker.number(key, field, {"", Need::optional, slides ? sliding : turning});
  };
  check("coulomb", friction.coulomb, kTorque, kForce);
  check("smooth_velocity", friction.smooth_velocity, kRate, kVelocity);
  check("viscous", friction.viscous, kTorsionalDamping, kDamping);
  check("breakaway", friction.breakaway, kTorque, kForce);
  check("stribeck_velocity", friction.stribeck_velocity, kRate, kVelocity);
  if (friction.breakaway.has_value() != friction.stribeck_velocity.has_value())
    checker.issue(checker.path(friction.breakaway ? "stribeck_velocity" : "breakaway"),
                  "is missing; give breakaway and stribeck_velocity, or neither");
  const auto check_above_zero = [&](std::string_view key, const Field& field) {
    const std::optional<double> rate = checker.facts().value(field);
    if (rate && *rate <= 0) checker.issue(checker.path(key), "is " + text_of(*rate) + ", it must be greater than 0");
  };
  check_above_zero("smooth_velocity", friction.smooth_velocity);
  if (friction.stribeck_velocity) check_above_zero("stribeck_velocity", *friction.stribeck_velocity);
}

// Asks for the unit of an inertia whose radius of gyration is out of all proportion: kg mm^2 read as kg m^2 makes it a
// thousand times larger. The root of this factor separates the two. Nearly massless bodies may have any inertia.
void check_gyration(Checker& checker, const Body& body) {
  constexpr double kFactor = 31.6, kNearlyMassless = 1e-3;
  if (body.consistent_inertia) return;
  const double mass = checker.facts().value(body.mass).value_or(0);
  double largest = 0;
  for (const Field* entry : {&body.inertia.xx, &body.inertia.yy, &body.inertia.zz})
    largest = std::max(largest, checker.facts().value(*entry).value_or(0));
  if (!(mass > 0 && largest > 0)) return;
  const double radius = std::sqrt(largest / mass), extent = checker.facts().scale().length;
  if (extent == 0 || radius <= kFactor * extent || mass < kNearlyMassless * checker.facts().scale().mass) return;
  checker.warning(checker.path("inertia"), "is " + text_of(largest) + " kg m^2, a radius of gyration of " +
                                               std::to_string(radius) + " m, in a mechanism within " + text_of(extent) +
                                               " m: is it in kg mm^2? Write the unit, as in \"" + text_of(largest) +
                                               " [kg mm^2]\"");
}

void check_moving(Checker& checker, const std::string& body) {
  if (body == "ground") checker.issue(checker.path("body"), "is the ground, which never moves");
}

// Parameters, definitions, signals and sensors share one name space.
void check_shared_names(Checker& checker, const Scene& scene) {
  std::map<std::string, std::string> first;
  const auto check = [&](const char* list, const std::string& name) {
    const std::string where = child_path(list, name);
    checker.must_be_identifier(where, name);
    const auto [it, is_new] = first.emplace(name, where);
    if (!is_new)
      checker.issue(where, "the name '" + name + "' is taken by " + it->second +
                               "; parameters, definitions, signals and sensors share one name space");
  };
  for (const Parameter& parameter : scene.parameters) check("parameters", parameter.name);
  for (const Definition& definition : scene.definitions) check("definitions", definition.name);
  for (const Signal& signal : scene.signals) check("signals", signal.name);
  for (const Sensor& sensor : scene.sensors) check("sensors", sensor.name);
}

}  // namespace

void check_meaning(Checker& checker, const Parameter& parameter) {
  const auto [value, lower, upper] = std::tuple(parameter.value, parameter.lower, parameter.upper);
  if (!std::isfinite(value))
    return checker.issue(checker.path("value"), "is " + text_of(value) + "; it must be finite");
  if (lower && upper && *lower > *upper)
    checker.issue(checker.path("lower"), "is " + text_of(*lower) + ", above the upper bound " + text_of(*upper));
  else if (lower && value < *lower)
    checker.issue(checker.path("value"), "is " + text_of(value) + ", below the lower bound " + text_of(*lower));
  else if (upper && value > *upper)
    checker.issue(checker.path("value"), "is " + text_of(value) + ", above the upper bound " + text_of(*upper));
  if (parameter.scale != ParameterScale::linear) {
    if (value <= 0)
      checker.issue(checker.path("value"), "is " + text_of(value) + "; a logarithmic scale needs it positive");
    if (lower && *lower <= 0)
      checker.issue(checker.path("lower"), "is " + text_of(*lower) + "; a logarithmic scale needs it positive");
  }
  if (parameter.unit.empty()) return;
  const std::optional<Unit> unit = parse_unit(parameter.unit);
  if (!unit)
    checker.issue(checker.path("unit"), "'" + parameter.unit +
                                            "' is not a known unit; units are products, quotients and "
                                            "whole powers of " +
                                            known_units());
  else if (unit->to_si != 1)
    checker.issue(checker.path("unit"), "'" + parameter.unit + "' is not SI, and values are; give the unit as '" +
                                            to_string(unit->dimension) +
                                            "', or write it behind the value, as in \"1 [" + parameter.unit +
                                            "]\", without \"unit\"");
}

void check_meaning(Checker& checker, const Body& body) {
  if (body.name == "ground") checker.issue(checker.path("name"), "is 'ground', which is predefined; take another name");
  const std::optional<double> mass = checker.facts().value(body.mass);
  if (mass && *mass < 0)
    checker.issue(checker.path("mass"), "is " + text_of(*mass) + " kg, a mass must not be negative");
  check_gyration(checker, body);
}

void check_meaning(Checker& checker, const InertiaField& inertia) {
  std::array<double, 6> tensor{};
  const std::array<const Field*, 6> fields{&inertia.xx, &inertia.yy, &inertia.zz,
                                           &inertia.xy, &inertia.xz, &inertia.yz};
  for (std::size_t i = 0; i < tensor.size(); ++i) {
    const std::optional<double> entry = checker.facts().value(*fields[i]);
    if (!entry || !std::isfinite(*entry)) return;
    tensor[i] = *entry;
  }
  const std::string problem = inertia_problem(tensor);
  if (!problem.empty()) checker.issue(checker.path(), problem);
}

void check_meaning(Checker& checker, const EulerParametersField& orientation) {
  constexpr double kTolerance = 1e-6;
  double norm = 0;
  for (const Field& field : orientation.e) {
    const std::optional<double> e = checker.facts().value(field);
    if (!e) return;
    norm = std::hypot(norm, *e);  // squares might overflow
  }
  if (std::abs(norm - 1) > kTolerance)
    checker.issue(checker.path(), "Euler parameters of norm " + text_of(norm) + "; it must be 1 within 1e-6");
}

void check_meaning(Checker& checker, const AxisAngleField& orientation) {
  direction(checker, "axis", PointField(orientation.axis), "");
}

void check_meaning(Checker& checker, const Joint& joint) {
  const TypeRow* const row = find_row(kJointTypes, joint.type);
  if (!row) return;
  if (ties_joints(joint)) {
    check_joint_has(checker, "joint1", joint.joint1, "angle");
    check_joint_has(checker, "joint2", joint.joint2, joint.type == "gear" ? "angle" : "displacement");
    if (!joint.joint2.empty() && joint.joint1 == joint.joint2)
      checker.issue(checker.path("joint2"), "is '" + joint.joint2 + "' like joint1; two joints are needed");
    return;
  }
  check_two_bodies(checker, joint.body1, joint.body2, "a joint");
  if (const auto length = checker.facts().value(joint.length); joint.type == "distance" && length && *length <= 0)
    checker.issue(checker.path("length"), "is " + text_of(*length) + " m, the length of a rod must be greater than 0");
  const auto axis1 = direction(checker, "axis1", joint.axis1, joint.body1);
  const auto axis2 = direction(checker, "axis2", joint.axis2, joint.body2);
  if (need_of(*row, "normal1") != Need::unknown) check_normals(checker, joint, axis1, axis2);
}

// Checks that a law of time alone, and its first `derivatives` derivatives, are finite at the start.
void check_start(Checker& checker, const std::string& where, const Expression& law, std::size_t derivatives) {
  static constexpr const char* kOf[] = {"", "the rate of ", "the second derivative of "};
  const double start = checker.facts().scene().simulation.start_time;
  const auto values = checker.facts().law_at(law, start);
  for (std::size_t k = 0; values && k <= derivatives; ++k) {
    if (std::isfinite((*values)[k])) continue;
    return checker.issue(where, kOf[k] + ("'" + law.text()) + "' is " + text_of((*values)[k]) + " at the start, t = " +
                                    text_of(start) + " s; it must be finite from there to the end (a root, logarithm " +
                                    "or division outside its range?)");
  }
}

void check_units(Checker& checker, const SampleColumn& samples) {
  const auto check = [&](std::string_view key, const std::string& unit, const std::optional<Dimension>& expected) {
    const std::optional<Unit> found = parse_unit(unit);
    if (unit.empty()) return;
    if (!found)
      checker.issue(checker.path(key), "'" + unit +
                                           "' is not a known unit; units are products, quotients and whole "
                                           "powers of " +
                                           known_units());
    else if (expected && !compatible(found->dimension, *expected))
      checker.issue(checker.path(key), "'" + unit + "' is no unit of time");
  };
  check("unit", samples.unit, std::nullopt);
  check("time_unit", samples.time_unit, dimension::kTime);
}

namespace {

// Warns of samples of an angle that are not counted over turns.
void check_turns(Checker& checker, const SampleColumn& samples, const std::string& path) {
  if (!samples.curve) return;
  const std::optional<Unit> unit = parse_unit(samples.unit);
  const std::vector<double>& values = samples.curve->y();
  const bool in_rad = unit && unit->dimension == dimension::kAngle;
  std::size_t wrap = first_wrap(values, 2 * std::numbers::pi);
  const bool in_degrees = wrap == 0 && !in_rad && (wrap = first_wrap(values, 360)) > 0;
  if (wrap == 0) return;
  checker.warning(path, "'" + samples.column + "' jumps from " + text_of(values[wrap - 1]) + " to " +
                            text_of(values[wrap]) + " at " + text_of(samples.curve->x()[wrap]) + " s, by about a turn" +
                            (in_degrees ? " in degrees, where rad are expected" : "") +
                            ": the motion turns back there. Take whole turns out of the column, so that it goes on "
                            "counting");
}

}  // namespace

void check_quantity(Checker& checker, const SampleColumn& samples, const Dimension& quantity) {
  const std::optional<Unit> unit = parse_unit(samples.unit);
  if (!samples.unit.empty() && unit && !unit->dimension.is_none() && !compatible(unit->dimension, quantity))
    return checker.issue(checker.path("column"), "'" + samples.column + "' is in " + to_string(unit->dimension) +
                                                     "; expected is " +
                                                     (quantity.is_none() ? "a number" : to_string(quantity)));
  if (quantity == dimension::kAngle) check_turns(checker, samples, checker.path("column"));
}

void check_meaning(Checker& checker, const SampledLaw& law) { check_units(checker, law); }
void check_meaning(Checker& checker, const Signal& signal) {
  check_units(checker, signal);
  const std::optional<Unit> unit = parse_unit(signal.unit);
  if (unit && unit->dimension == dimension::kAngle) check_quantity(checker, signal, unit->dimension);
}

namespace {

// Reports kinks of a drive's law: no motion follows a rate that jumps.
void check_smooth(Checker& checker, const Expression& law) {
  const std::string needs = "; a drive needs two continuous derivatives: take ";
  for (const Signal& signal : checker.facts().scene().signals)
    if (law.depends_on(signal.name) && signal.interpolation != Interpolation::spline)
      checker.issue(checker.path("law"), "uses the signal '" + signal.name + "', which " +
                                             (signal.interpolation == Interpolation::hold ? "jumps" : "has kinks") +
                                             " at its samples" + needs + "\"interpolation\": \"spline\"");
  for (const SyntaxNode& node : law.tree().nodes) {
    if (!node.curve || node.curve->interpolation() == Interpolation::spline) continue;
    return checker.issue(checker.path("law"), "has a table, which has kinks" + needs + "spline(x, [..], [..])");
  }
}

}  // namespace

void check_meaning(Checker& checker, const Drive& drive) {
  check_smooth(checker, drive.law);
  for (const Signal& signal : checker.facts().scene().signals)
    if (drive.type == "angle" && signal.unit.empty() && drive.law.depends_on(signal.name))
      check_turns(checker, signal, checker.path("law"));
  if (!drive.samples) check_start(checker, checker.path("law"), drive.law, 2);
  if (drive.type == "angle" || drive.type == "displacement") check_joint_has(checker, "joint", drive.joint, drive.type);
  if (drive.type == "distance") check_two_bodies(checker, drive.body1, drive.body2, "a distance");
  if (drive.type == "coordinate" && drive.body == "ground")
    checker.issue(checker.path("body"), "is the ground, which never moves");
}

void check_meaning(Checker& checker, const Force& force) {
  const auto check_law = [&](const std::optional<Expression>& law) {
    if (law) check_start(checker, checker.path("law"), *law, 0);
  };
  const auto check_components = [&](const auto& components) {
    for (std::size_t i = 0; i < 3; ++i)
      check_start(checker, child_path(checker.path("components"), i), components[i], 0);
  };
  // Warns of a coefficient beside a law, which has no effect. A coefficient of 0 needs no warning.
  const auto warn_of_law = [&](bool has_law, std::initializer_list<std::pair<const char*, const Field*>> coefficients) {
    std::vector<std::string> idle;
    for (const auto& [key, field] : coefficients)
      if (has_law && !(field->is_number() && field->number() == 0)) idle.emplace_back(key);
    if (!idle.empty())
      checker.warning(checker.path("law"),
                      "replaces the coefficients of this force: " + joined(idle) + ", given beside it, will not act");
  };
  const auto warn_of_feeding = [&](bool has_law, const Field& damping) {
    if (has_law) return;
    const auto value = checker.facts().value(damping);
    if (value && *value < 0)
      checker.warning(checker.path("damping"), "is " + text_of(*value) +
                                                   ": it feeds energy into the motion, which may grow without "
                                                   "bounds; a damper has a positive one");
  };
  const auto check_torsion = [&](const auto& f) {
    check_law(f.law);
    warn_of_feeding(f.law.has_value(), f.damping);
    warn_of_law(f.law.has_value(),
                {{"stiffness", &f.stiffness}, {"damping", &f.damping}, {"free_angle", &f.free_angle}});
  };
  if (const auto* tsda = std::get_if<Tsda>(&force.kind)) {
    check_two_bodies(checker, tsda->body1, tsda->body2, "a tsda");
    check_law(tsda->law);
    warn_of_feeding(tsda->law.has_value(), tsda->damping);
    warn_of_law(tsda->law.has_value(), {{"stiffness", &tsda->stiffness},
                                        {"damping", &tsda->damping},
                                        {"free_length", &tsda->free_length},
                                        {"actuator", &tsda->actuator}});
  } else if (const auto* rsda = std::get_if<Rsda>(&force.kind)) {
    check_joint_has_angle(checker, rsda->joint);
    check_torsion(*rsda);
  } else if (const auto* bar = std::get_if<TorsionBar>(&force.kind)) {
    check_two_bodies(checker, bar->body1, bar->body2, "a torsion_bar");
    direction(checker, "axis", bar->axis, bar->body1);
    check_torsion(*bar);
  } else if (const auto* applied = std::get_if<PointForce>(&force.kind)) {
    check_moving(checker, applied->body);
    check_components(applied->components);
  } else if (const auto* torque = std::get_if<Torque>(&force.kind)) {
    check_moving(checker, torque->body);
    check_components(torque->components);
  } else if (const auto* bushing = std::get_if<BushingSpec>(&force.kind)) {
    check_two_bodies(checker, bushing->body1, bushing->body2, "a bushing");
  } else if (const auto* friction = std::get_if<FrictionSpec>(&force.kind)) {
    check_friction(checker, *friction);
  } else if (const auto* user = std::get_if<UserForceSpec>(&force.kind)) {
    for (std::size_t i = 0; i < user->bodies.size(); ++i)
      if (user->bodies[i] == "ground")
        checker.issue(child_path(checker.path("bodies"), i), "is the ground, which never moves");
  }
}

void check_meaning(Checker& checker, const Sensor& sensor) {
  const TypeRow* const row = find_row(kSensorQuantities, sensor.quantity);
  if (!row) return;
  if (sensor.quantity == "reaction") {
    if (const Joint* const joint = checker.facts().joint(sensor.joint); joint && ties_joints(*joint))
      checker.issue(checker.path("joint"), "joint '" + sensor.joint + "' is " + joint->type +
                                               ", which has no bodies of its own; name one of the joints that it ties");
  } else if (need_of(*row, "joint") != Need::unknown)
    check_joint_has(checker, "joint", sensor.joint, row->dimension == dimension::kLength ? "displacement" : "angle");
  if (need_of(*row, "body2") != Need::unknown && sensor.body1 == sensor.body2 && !sensor.body2.empty())
    checker.issue(checker.path("body2"), "is '" + sensor.body2 + "' like body1; nothing between them changes");
  if ((sensor.quantity == "orientation" || sensor.quantity == "body_angle") && sensor.body == "ground")
    checker.issue(checker.path("body"), "is the ground, whose orientation never changes");
  direction(checker, "axis", sensor.axis, sensor.body1);
  if (sensor.quantity == "force") {
    const Force* const force = checker.facts().force(sensor.force);
    if (force && type_of(*force) != Tsda::kType && type_of(*force) != Rsda::kType &&
        type_of(*force) != TorsionBar::kType)
      checker.issue(checker.path("force"), "'" + sensor.force + "' is a " + std::string(type_of(*force)) +
                                               "; only a tsda, an rsda or a torsion_bar has one number to measure");
  }
}

void check_meaning(Checker& checker, const Condition& condition) {
  if (!condition.value && !condition.rate)
    checker.issue(checker.path(), "has neither \"value\" nor \"rate\"; at least one is needed");
  const Sensor* const sensor = checker.facts().sensor(condition.sensor);
  if (!sensor || !find_row(kSensorQuantities, sensor->quantity)) return;
  const std::string named = "sensor '" + sensor->name + "'";
  const Reads reads = checker.facts().reads_of(*sensor);
  if (reads > Reads::velocities)
    return checker.issue(checker.path("sensor"),
                         named + (sensor->quantity == "expression"
                                      ? " is an expression of more than positions, which a condition cannot prescribe; "
                                        "use expressions of positions, angles, distances or Euler parameters"
                                      : " measures " + sensor->quantity +
                                            ", which a condition cannot prescribe; use positions, angles, "
                                            "distances, Euler parameters or their rates"));
  if (condition.rate && reads == Reads::velocities)
    checker.issue(checker.path("rate"), named + " measures a " + sensor->quantity + ": give its \"value\"");
  if (condition.rate && sensor->quantity == "position" && sensor->in_body_frame)
    checker.issue(checker.path("rate"), named + " is in a body's axes, where its rate is not available");
  const std::optional<Dimension> measured = checker.facts().dimension_of(*sensor);
  if (!measured) return;
  const auto check_dimension = [&](std::string_view key, const std::optional<Field>& field, const Dimension& expected) {
    if (field) checker.number(key, *field, {"", Need::optional, expected});
  };
  check_dimension("value", condition.value, *measured);
  check_dimension("rate", condition.rate, *measured / dimension::kTime);
  check_dimension("acceleration", condition.acceleration, *measured / dimension::kTime / dimension::kTime);
}

void check_meaning(Checker& checker, const Scene& scene) {
  checker.must_be_readable("name", scene.name);
  if (scene.name.empty() || scene.name[0] == '.' || scene.name.find_first_of("/\\") != std::string::npos)
    checker.issue("name", "is '" + scene.name +
                              "'; it names a folder, so it must not be empty, begin with '.' or "
                              "contain / \\ or control characters");
  if (scene.bodies.empty()) checker.issue("bodies", "is empty; a mechanism has at least one body besides the ground");
  check_shared_names(checker, scene);
  const auto in_list = [](const char* list) { return [list](std::size_t i) { return child_path(list, i) + ".name"; }; };
  check_unique_names(checker, scene.bodies, "a body", in_list("bodies"));
  check_unique_names(checker, scene.joints, "a joint", in_list("joints"));
  check_unique_names(checker, scene.drives, "a drive", in_list("drives"));
  check_unique_names(checker, scene.forces, "a force", in_list("forces"));
  if (scene.equilibrium && !scene.conditions.empty())
    checker.issue(
        "initial.conditions",
        "are given with \"equilibrium\": true, which determines the whole initial state; give one or the other");
  for (const auto& [path, what] : checker.facts().endless_definitions()) checker.issue(path, what);
}

std::vector<SceneIssue> without_repetitions(std::vector<SceneIssue> issues) {
  std::vector<SceneIssue> once;
  std::set<std::pair<std::string, std::string>> seen;
  for (SceneIssue& issue : issues)
    if (seen.emplace(issue.path, issue.message).second) once.push_back(std::move(issue));
  return once;
}

std::vector<SceneIssue> find_issues(const Scene& scene) {
  const SceneFacts facts(scene);
  std::vector<SceneIssue> issues;
  Checker(facts, issues).check(scene);
  return without_repetitions(std::move(issues));
}

}  // namespace mbsopt
