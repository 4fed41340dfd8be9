#include "core/scene/issues.hpp"

#include <Eigen/Core>
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

using Eigen::Vector3d;

// Returns a usable direction, and reports a zero vector.
std::optional<Vector3d> direction(Checker& checker, std::string_view key, const std::optional<PointField>& field,
                                  const std::string& body) {
  if (!field) return std::nullopt;
  const auto v = checker.facts().value(*field, body);
  if (!v || !Vector3d::Map(v->data()).allFinite()) return std::nullopt;
  if (const double norm = std::hypot((*v)[0], (*v)[1], (*v)[2]); norm > 0) return Vector3d::Map(v->data()) / norm;
  checker.refuse(key, "is a zero vector, a direction must not be");
  return std::nullopt;
}

bool angle_is_used(const Scene& scene, const std::string& joint, const std::string& joint_type) {
  for (const Force& force : scene.forces) {
    const auto* rsda = std::get_if<Rsda>(&force.kind);
    const auto* friction = std::get_if<FrictionSpec>(&force.kind);
    const auto* stop = std::get_if<StopSpec>(&force.kind);
    if (rsda && rsda->joint == joint) return true;
    if (stop && stop->joint == joint && !is_sliding(stop->motion, joint_type)) return true;
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

void check_normals(Checker& checker, const Joint& joint, const std::optional<Vector3d>& axis1,
                   const std::optional<Vector3d>& axis2) {
  const auto normal1 = direction(checker, "normal1", joint.normal1, joint.body1);
  const auto normal2 = direction(checker, "normal2", joint.normal2, joint.body2);
  constexpr double kParallel = 1e-9, kSame = 1e-12;
  const auto check_angle = [&](std::string_view key, const std::optional<Vector3d>& n,
                               const std::optional<Vector3d>& a) {
    if (n && a && 1 - std::abs(n->dot(*a)) < kParallel * kParallel)
      checker.refuse(key, "is parallel to the axis; it must have a part perpendicular to it");
  };
  check_angle("normal1", normal1, axis1);
  check_angle("normal2", normal2, axis2);
  if (joint.normal1.has_value() != joint.normal2.has_value())
    checker.refuse(joint.normal1 ? "normal2" : "normal1", "is missing; give both normals, or neither");
  if (joint.normal1 || joint.normal2 || !axis1 || !axis2) return;
  if ((*axis1 - *axis2).norm() > kSame && angle_is_used(checker.facts().scene(), joint.name, joint.type))
    checker.refuse("", "its angle is used and axis1 differs from axis2: make them equal, or give normal1 and normal2");
}

void check_joint_has(Checker& checker, std::string_view key, const std::string& name, std::string_view what) {
  const std::string_view joints = what == "angle" ? kJointsWithAngle : kJointsWithDisplacement;
  const Joint* const joint = checker.facts().joint(name);
  if (!joint || !find_row(kJointTypes, joint->type) || has_word(joints, joint->type)) return;
  checker.refuse(key, "joint '{}' is {} and has no {}; joints that have one: {}", name, joint->type, what,
                 joined(words(joints)));
}

void check_two_bodies(Checker& checker, const std::string& body1, const std::string& body2, std::string_view what) {
  if (!body2.empty() && body1 == body2) checker.refuse("body2", "is '{}' like body1; {} needs two bodies", body2, what);
}

void check_kind(Checker& checker, const FrictionSpec& friction) {
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
    checker.refuse(friction.breakaway ? "stribeck_velocity" : "breakaway",
                   "is missing; give breakaway and stribeck_velocity, or neither");
  const auto check_above_zero = [&](std::string_view key, const Field& field) {
    const std::optional<double> rate = checker.facts().value(field);
    if (rate && *rate <= 0) checker.refuse(key, "is {}, it must be greater than 0", *rate);
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
  checker.warn("inertia",
               "is {0} kg m^2, a radius of gyration of {1} m, in a mechanism within {2} m: is it in kg mm^2? Write the "
               "unit, as in \"{0} [kg mm^2]\"",
               largest, std::to_string(radius), extent);
}

void check_moving(Checker& checker, const std::string& body) {
  if (body == "ground") checker.refuse("body", "is the ground, which never moves");
}

// Returns nothing if the text is empty, and reports a unit that is not known.
std::optional<Unit> known_unit(Checker& checker, std::string_view key, const std::string& text) {
  const std::optional<Unit> unit = text.empty() ? std::nullopt : parse_unit(text);
  if (!unit && !text.empty())
    checker.refuse(key, "'{}' is not a known unit; units are products, quotients and whole powers of {}", text,
                   known_units());
  return unit;
}

// Parameters, definitions, signals and sensors share one name space.
void check_shared_names(Checker& checker, const Scene& scene) {
  std::map<std::string, std::string> first;
  const auto check = [&](const char* list, const std::string& name) {
    const std::string where = child_path(list, name);
    checker.must_be_identifier(where, name);
    const auto [it, is_new] = first.emplace(name, where);
    if (!is_new)
      checker.issue(where, filled("the name '{}' is taken by {}; parameters, definitions, signals and sensors share "
                                  "one name space",
                                  name, it->second));
  };
  for (const Parameter& parameter : scene.parameters) check("parameters", parameter.name);
  for (const Definition& definition : scene.definitions) check("definitions", definition.name);
  for (const Signal& signal : scene.signals) check("signals", signal.name);
  for (const Sensor& sensor : scene.sensors) check("sensors", sensor.name);
}

}  // namespace

void check_meaning(Checker& checker, const Parameter& parameter) {
  const auto [value, lower, upper] = std::tuple(parameter.value, parameter.lower, parameter.upper);
  if (!std::isfinite(value)) return checker.refuse("value", "is {}; it must be finite", value);
  if (lower && upper && *lower > *upper)
    checker.refuse("lower", "is {}, above the upper bound {}", *lower, *upper);
  else if (lower && value < *lower)
    checker.refuse("value", "is {}, below the lower bound {}", value, *lower);
  else if (upper && value > *upper)
    checker.refuse("value", "is {}, above the upper bound {}", value, *upper);
  if (parameter.scale != ParameterScale::linear) {
    if (value <= 0) checker.refuse("value", "is {}; a logarithmic scale needs it positive", value);
    if (lower && *lower <= 0) checker.refuse("lower", "is {}; a logarithmic scale needs it positive", *lower);
  }
  const std::optional<Unit> unit = known_unit(checker, "unit", parameter.unit);
  if (unit && unit->to_si != 1)
    checker.refuse("unit",
                   "'{0}' is not SI, and values are; give the unit as '{1}', or write it behind the value, as in \"1 "
                   "[{0}]\", without \"unit\"",
                   parameter.unit, to_string(unit->dimension));
}

void check_meaning(Checker& checker, const Body& body) {
  if (body.name == "ground") checker.refuse("name", "is 'ground', which is predefined; take another name");
  const std::optional<double> mass = checker.facts().value(body.mass);
  if (mass && *mass < 0) checker.refuse("mass", "is {} kg, a mass must not be negative", *mass);
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
    checker.refuse("", "Euler parameters of norm {}; it must be 1 within 1e-6", norm);
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
      checker.refuse("joint2", "is '{}' like joint1; two joints are needed", joint.joint2);
    return;
  }
  check_two_bodies(checker, joint.body1, joint.body2, "a joint");
  if (const auto length = checker.facts().value(joint.length); joint.type == "distance" && length && *length <= 0)
    checker.refuse("length", "is {} m, the length of a rod must be greater than 0", *length);
  const auto axis1 = direction(checker, "axis1", joint.axis1, joint.body1);
  const auto axis2 = direction(checker, "axis2", joint.axis2, joint.body2);
  if ((*row)["normal1"] != Need::unknown) check_normals(checker, joint, axis1, axis2);
}

// Checks that a law of time alone, and its first `derivatives` derivatives, are finite at the start.
void check_start(Checker& checker, const std::string& where, const Expression& law, std::size_t derivatives) {
  static constexpr std::string_view kOf[] = {"", "the rate of ", "the second derivative of "};
  const double start = checker.facts().scene().simulation.start_time;
  const auto values = checker.facts().law_at(law, start);
  for (std::size_t k = 0; values && k <= derivatives; ++k) {
    if (std::isfinite((*values)[k])) continue;
    return checker.issue(where,
                         filled("{}'{}' is {} at the start, t = {} s; it must be finite from there to the end (a "
                                "root, logarithm or division outside its range?)",
                                kOf[k], law.text(), (*values)[k], start));
  }
}

void check_units(Checker& checker, const SampleColumn& samples) {
  known_unit(checker, "unit", samples.unit);
  const std::optional<Unit> of_time = known_unit(checker, "time_unit", samples.time_unit);
  if (of_time && !compatible(of_time->dimension, dimension::kTime))
    checker.refuse("time_unit", "'{}' is no unit of time", samples.time_unit);
}

namespace {

// Warns of samples of an angle that are not counted over turns.
void check_turns(Checker& checker, const SampleColumn& samples, std::string_view key) {
  if (!samples.curve) return;
  const std::optional<Unit> unit = parse_unit(samples.unit);
  const std::vector<double>& values = samples.curve->y();
  const bool in_rad = unit && unit->dimension == dimension::kAngle;
  std::size_t wrap = first_wrap(values, 2 * std::numbers::pi);
  const bool in_degrees = wrap == 0 && !in_rad && (wrap = first_wrap(values, 360)) > 0;
  if (wrap == 0) return;
  checker.warn(key,
               "'{}' jumps from {} to {} at {} s, by about a turn{}: the motion turns back there. Take whole turns out "
               "of the column, so that it goes on counting",
               samples.column, values[wrap - 1], values[wrap], samples.curve->x()[wrap],
               in_degrees ? " in degrees, where rad are expected" : "");
}

}  // namespace

void check_quantity(Checker& checker, const SampleColumn& samples, const Dimension& quantity) {
  const std::optional<Unit> unit = parse_unit(samples.unit);
  if (!samples.unit.empty() && unit && !unit->dimension.is_none() && !compatible(unit->dimension, quantity))
    return checker.refuse("column", "'{}' is in {}; expected is {}", samples.column, to_string(unit->dimension),
                          quantity.is_none() ? "a number" : to_string(quantity));
  if (quantity == dimension::kAngle) check_turns(checker, samples, "column");
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
  constexpr std::string_view kNeeds = "; a drive needs two continuous derivatives: take ";
  for (const Signal& signal : checker.facts().scene().signals)
    if (law.depends_on(signal.name) && signal.interpolation != Interpolation::spline)
      checker.refuse("law", "uses the signal '{}', which {} at its samples{}\"interpolation\": \"spline\"", signal.name,
                     signal.interpolation == Interpolation::hold ? "jumps" : "has kinks", kNeeds);
  for (const SyntaxNode& node : law.tree().nodes) {
    if (!node.curve || node.curve->interpolation() == Interpolation::spline) continue;
    return checker.refuse("law", "has a table, which has kinks{}spline(x, [..], [..])", kNeeds);
  }
}

}  // namespace

void check_meaning(Checker& checker, const Drive& drive) {
  check_smooth(checker, drive.law);
  for (const Signal& signal : checker.facts().scene().signals)
    if (drive.type == "angle" && signal.unit.empty() && drive.law.depends_on(signal.name))
      check_turns(checker, signal, "law");
  if (!drive.samples) check_start(checker, checker.path("law"), drive.law, 2);
  if (drive.type == "angle" || drive.type == "displacement") check_joint_has(checker, "joint", drive.joint, drive.type);
  if (drive.type == "distance") check_two_bodies(checker, drive.body1, drive.body2, "a distance");
  if (drive.type == "coordinate") check_moving(checker, drive.body);
}

namespace {

// Checks a law, and warns of coefficients beside it, which have no effect. Coefficients of 0 need no warning. Without
// a law, it warns of a damping that feeds the motion.
void check_law(Checker& checker, const auto& f,
               std::initializer_list<std::pair<const char*, const Field*>> coefficients) {
  if (!f.law) {
    if (const auto value = checker.facts().value(f.damping); value && *value < 0)
      checker.warn("damping",
                   "is {}: it feeds energy into the motion, which may grow without bounds; a damper has a positive one",
                   *value);
    return;
  }
  check_start(checker, checker.path("law"), *f.law, 0);
  std::vector<std::string> idle;
  for (const auto& [key, field] : coefficients)
    if (!(field->is_number() && field->number() == 0)) idle.emplace_back(key);
  if (!idle.empty())
    checker.warn("law", "replaces the coefficients of this force: {}, given beside it, will not act", joined(idle));
}

void check_torsion(Checker& checker, const auto& f) {
  check_law(checker, f, {{"stiffness", &f.stiffness}, {"damping", &f.damping}, {"free_angle", &f.free_angle}});
}

void check_kind(Checker& checker, const Tsda& f) {
  check_two_bodies(checker, f.body1, f.body2, "a tsda");
  check_law(checker, f,
            {{"stiffness", &f.stiffness},
             {"damping", &f.damping},
             {"free_length", &f.free_length},
             {"actuator", &f.actuator}});
}

void check_kind(Checker& checker, const Rsda& f) {
  check_joint_has(checker, "joint", f.joint, "angle");
  check_torsion(checker, f);
}

void check_kind(Checker& checker, const TorsionBar& f) {
  check_two_bodies(checker, f.body1, f.body2, "a torsion_bar");
  direction(checker, "axis", f.axis, f.body1);
  check_torsion(checker, f);
}

template <class Applied>  // PointForce or Torque
requires std::same_as<decltype(Applied::components), LawVector>
void check_kind(Checker& checker, const Applied& f) {
  check_moving(checker, f.body);
  for (std::size_t i = 0; i < f.components.size(); ++i)
    check_start(checker, child_path(checker.path("components"), i), f.components[i], 0);
}

void check_one_sided(Checker& checker, const OneSided& f) {
  const auto check = [&](std::string_view key, const Field& field, double least) {
    const std::optional<double> value = checker.facts().value(field);
    if (value && !(*value >= least)) checker.refuse(key, "is {}, it must be at least {}", *value, least);
  };
  check("stiffness", f.stiffness, 0);
  check("exponent", f.exponent, 1);
  check("damping", f.damping, 0);
}

void check_kind(Checker& checker, const StopSpec& f) {
  using namespace dimension;
  const Joint* const joint = checker.facts().joint(f.joint);
  const bool slides = joint && is_sliding(f.motion, joint->type);
  check_joint_has(checker, "joint", f.joint, slides ? "displacement" : "angle");
  if (joint)
    for (const auto& [key, bound] : {std::pair{"lower", &f.lower}, {"upper", &f.upper}})
      if (*bound) checker.number(key, **bound, {"", Need::optional, slides ? kLength : kAngle});
  if (!f.lower && !f.upper) checker.refuse("", "has neither \"lower\" nor \"upper\"; at least one is needed");
  check_one_sided(checker, f);
}

void check_kind(Checker& checker, const ContactSpec& f) {
  check_two_bodies(checker, f.body1, f.body2, "a contact");
  direction(checker, "normal1", f.normal1, f.body1);
  if (f.normal1 && (f.radius1 || f.inside))
    checker.refuse(f.radius1 ? "radius1" : "inside", "is of a ball or ring, but normal1 makes it a plane");
  if (!f.normal1 && !f.radius1)
    checker.refuse("", "has neither \"normal1\" nor \"radius1\"; a plane, ball or ring is needed");
  const auto radius1 = f.radius1 ? checker.facts().value(*f.radius1) : std::nullopt,
             radius2 = checker.facts().value(f.radius2);
  for (const auto& [key, radius] : {std::pair{"radius1", radius1}, {"radius2", radius2}})
    if (radius && *radius < 0) checker.refuse(key, "is {}, it must not be negative", *radius);
  if (f.inside && radius1 && radius2 && *radius2 >= *radius1)
    checker.refuse("radius2", "is {}: a ball inside of the ring must be smaller than its radius1, {}", *radius2,
                   *radius1);
  check_one_sided(checker, f);
}

void check_kind(Checker& checker, const BushingSpec& f) { check_two_bodies(checker, f.body1, f.body2, "a bushing"); }

void check_kind(Checker& checker, const UserForceSpec& f) {
  for (std::size_t i = 0; i < f.bodies.size(); ++i)
    if (f.bodies[i] == "ground")
      checker.issue(child_path(checker.path("bodies"), i), "is the ground, which never moves");
}

}  // namespace

void check_meaning(Checker& checker, const Force& force) {
  std::visit([&](const auto& kind) { check_kind(checker, kind); }, force.kind);
}

void check_meaning(Checker& checker, const Sensor& sensor) {
  const TypeRow* const row = find_row(kSensorQuantities, sensor.quantity);
  if (!row) return;
  if (sensor.quantity == "reaction") {
    if (const Joint* const joint = checker.facts().joint(sensor.joint); joint && ties_joints(*joint))
      checker.refuse("joint", "joint '{}' is {}, which has no bodies of its own; name one of the joints that it ties",
                     sensor.joint, joint->type);
  } else if ((*row)["joint"] != Need::unknown) {
    check_joint_has(checker, "joint", sensor.joint, row->dimension == dimension::kLength ? "displacement" : "angle");
  }
  if ((*row)["body2"] != Need::unknown && sensor.body1 == sensor.body2 && !sensor.body2.empty())
    checker.refuse("body2", "is '{}' like body1; nothing between them changes", sensor.body2);
  if ((sensor.quantity == "orientation" || sensor.quantity == "body_angle") && sensor.body == "ground")
    checker.refuse("body", "is the ground, whose orientation never changes");
  direction(checker, "axis", sensor.axis, sensor.body1);
  if (sensor.quantity != "force") return;
  const Force* const force = checker.facts().force(sensor.force);
  if (force && !has_word("tsda rsda torsion_bar stop contact", type_of(*force)))
    checker.refuse("force", "'{}' is a {}; only a tsda, rsda, torsion_bar, stop or contact has one number to measure",
                   sensor.force, type_of(*force));
}

void check_meaning(Checker& checker, const Limit& limit) {
  if (!limit.lower && !limit.upper) checker.refuse("", "has neither \"lower\" nor \"upper\"; at least one is needed");
  const std::optional<double> e = checker.facts().value(limit.restitution);
  if (e && !(*e >= 0 && *e <= 1)) checker.refuse("restitution", "is {}, it must be from 0 to 1", *e);
  const Sensor* const sensor = checker.facts().sensor(limit.sensor);
  if (!sensor) return;
  if (!can_limit(*sensor))
    return checker.refuse(
        "sensor",
        "sensor '{}' is of {}; a limit needs a position (x, y or z, in global axes and not relative), "
        "a displacement, a distance or an angle",
        sensor->name, sensor->quantity);
  for (const auto& [key, bound] : {std::pair{"lower", &limit.lower}, {"upper", &limit.upper}})
    if (*bound) checker.number(key, **bound, {"", Need::optional, dimension_of_quantity(*sensor)});
}

void check_meaning(Checker& checker, const Condition& condition) {
  if (!condition.value && !condition.rate)
    checker.refuse("", "has neither \"value\" nor \"rate\"; at least one is needed");
  const Sensor* const sensor = checker.facts().sensor(condition.sensor);
  if (!sensor || !find_row(kSensorQuantities, sensor->quantity)) return;
  const Reads reads = checker.facts().reads_of(*sensor);
  if (reads > Reads::velocities)
    return checker.refuse(
        "sensor", "sensor '{}' {}", sensor->name,
        sensor->quantity == "expression"
            ? "is an expression of more than positions, which a condition cannot prescribe; use expressions of "
              "positions, angles, distances or Euler parameters"
            : filled("measures {}, which a condition cannot prescribe; use positions, angles, distances, Euler "
                     "parameters or their rates",
                     sensor->quantity));
  if (condition.rate && reads == Reads::velocities)
    checker.refuse("rate", "sensor '{}' measures a {}: give its \"value\"", sensor->name, sensor->quantity);
  if (condition.rate && sensor->quantity == "position" && sensor->in_body_frame)
    checker.refuse("rate", "sensor '{}' is in a body's axes, where its rate is not available", sensor->name);
  const std::optional<Dimension> measured = checker.facts().dimension_of(*sensor);
  if (!measured) return;
  const Dimension rate = *measured / dimension::kTime;
  checker.number("value", condition.value, {"", Need::optional, *measured});
  checker.number("rate", condition.rate, {"", Need::optional, rate});
  checker.number("acceleration", condition.acceleration, {"", Need::optional, rate / dimension::kTime});
}

void check_meaning(Checker& checker, const Scene& scene) {
  checker.must_be_readable("name", scene.name);
  if (scene.name.empty() || scene.name[0] == '.' || scene.name.find_first_of("/\\") != std::string::npos)
    checker.issue("name", filled("is '{}'; it names a folder, so it must not be empty, begin with '.' or contain / \\ "
                                 "or control characters",
                                 scene.name));
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
