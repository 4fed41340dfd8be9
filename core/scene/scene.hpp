// A scene: the mechanism of a problem file as plain data, without numbering or checks. find_issues (issues.hpp) checks
// it, and Mechanism (core/mechanism) compiles it. SI units, radians, right-handed frames.
#pragma once

#include <array>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/expression/curve.hpp"
#include "core/expression/expression.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

struct UserForce;  // core/force/user_force.hpp

using Field = Expression;  // a number, or an expression over parameters and definitions
using VectorField = std::array<Field, 3>;
using PointField =
    std::variant<std::string, VectorField>;  // a named point of the body ("O": its origin), or coordinates

enum class ParameterScale { linear, log, log10 };

// A normal distribution states the knowledge of a parameter before identification.
struct Prior {
  double mean = 0, sigma = 1;
};

struct Parameter {
  std::string name;
  double value = 0;
  std::optional<double> lower = {}, upper = {};
  ParameterScale scale = ParameterScale::linear;
  std::string unit = {};  // for display and for the dimension check
  bool allow_unused = false;
  std::optional<Prior> prior = {};  // a residual of its own in identification
};

struct Definition {
  std::string name;
  Field value;
};

// A parameter of a term written in C++: an expression of those of the scene.
struct TermParameter {
  std::string name;
  Field value;
};

// Entries of the tensor about the centre of mass in body axes.  [kg m^2]
struct InertiaField {
  Field xx, yy, zz, xy, xz, yz;
};

// A tensor that is physically consistent for any six lengths. With the second moments of the mass about its centre S =
// m U U', U upper triangular, the tensor is J = tr(S) I - S.  [m]
//   U = [ x xy xz ]    x, y, z: the mass's root-mean-square extent along an axis without the part of the shears
//       [ 0  y yz ]    xy, xz, yz; if these are zero,  J = m diag(y^2 + z^2, x^2 + z^2, x^2 + y^2)
//       [ 0  0  z ]
// With the mass and the centre of mass it is the log-Cholesky parametrisation of the pseudo-inertia: Rucker and
// Wensing, "Smooth Parameterization of Rigid-Body Inertia", IEEE RA-L 7 (2022).
struct ConsistentInertiaField {
  Field x, y, z, xy, xz, yz;
};

struct EulerParametersField {
  std::array<Field, 4> e{1.0, 0.0, 0.0, 0.0};
};
struct AxisAngleField {
  VectorField axis;
  Field angle;
};
struct RollPitchYawField {  // fixed axes x, y, z, as in URDF
  VectorField rpy;
};
using OrientationField = std::variant<EulerParametersField, AxisAngleField, RollPitchYawField>;

// A shape is for drawing only.
struct Shape {
  std::string type;  // rod, box, sphere, cylinder
  PointField from = "O", to = "O";
  double radius = 0.01;
};

struct Body {
  std::string name;
  Field mass;                      // [kg]
  VectorField com{0.0, 0.0, 0.0};  // centre of mass in the body frame [m]
  InertiaField inertia;
  std::optional<ConsistentInertiaField> consistent_inertia = {};  // instead
  VectorField position{0.0, 0.0, 0.0};                            // of the body-frame origin, global [m]
  OrientationField orientation;
  VectorField velocity{0.0, 0.0, 0.0};          // of the body-frame origin, global [m/s]
  VectorField angular_velocity{0.0, 0.0, 0.0};  // global components [rad/s]
  std::map<std::string, VectorField> points;    // named points and vectors in the body frame
  std::vector<Shape> shapes;
};

// The types are those of the problem format; core/constraint/joints.hpp lists the primitives of each.
struct Joint {
  std::string name, type;
  std::string body1 = "ground", body2;
  PointField point1 = "O", point2 = "O";
  std::optional<PointField> axis1, axis2, normal1, normal2;
  Field length;                // of distance [m]
  std::string joint1, joint2;  // of gear and rack_pinion, which tie two joints
  // Angles go from normal1 to normal2, or from the start if a file omits these. Displacements go from the start.
  Field ratio = 1.0;  // of gear: angle(joint2) = ratio angle(joint1)
  Field radius;       // of rack_pinion: displacement(joint2) = radius angle(joint1) [m]
  Field pitch;        // of screw: displacement = pitch angle/(2 pi) [m per turn]
};

// A column of a CSV file over the column of its times. The reader of the file fills in the curve, in SI units.
struct SampleColumn {
  std::string file, column, time = "t";
  std::string unit = {}, time_unit = {};  // instead of the units that the headers name; empty: these, else SI
  std::optional<double> time_zero = {};   // the file's time at t = 0 [s]
  std::shared_ptr<const Curve> curve = {};
  static constexpr double kFirstRow = std::numeric_limits<double>::lowest();  // a time_zero: that of the first row
};

// The law of a drive through samples (always a spline), or f(argument) with a function f written in C++. The reader of
// the file turns f(argument) into an expression.
struct SampledLaw : SampleColumn {
  std::string function = {};                // its name; empty: samples
  std::optional<Expression> argument = {};  // of t and parameters; when absent t
};

// A function of time that laws, costs and channels use by name: gain f(t - delay) + offset, f through the samples.
struct Signal : SampleColumn {
  std::string name;
  Interpolation interpolation = Interpolation::linear;
  Field delay = 0.0, gain = 1.0, offset = 0.0;  // of parameters; delay in s
};

// A rheonomic constraint: a coordinate, distance, angle or displacement that follows a law of time.
struct Drive {
  std::string name, type;
  std::string body, coordinate;  // of coordinate: x y z (centre of mass), e0 e1 e2 e3
  std::string joint;             // of angle, displacement
  std::string body1 = "ground", body2;
  PointField point1 = "O", point2 = "O";  // of distance
  Expression law;                         // of t and parameters
  std::optional<SampledLaw> samples;      // instead of the law
};

// Each kind of force has the name that a problem file uses.
struct Tsda {
  static constexpr std::string_view kType = "tsda";
  std::string body1 = "ground", body2;
  PointField point1 = "O", point2 = "O";
  Field stiffness, damping, free_length, actuator;
  std::optional<Expression> law;  // of l, ldot, t and parameters; replaces the coefficients
};
struct Rsda {
  static constexpr std::string_view kType = "rsda";
  std::string joint;
  Field stiffness, damping, free_angle;
  std::optional<Expression> law;  // of angle, rate, t and parameters
};
struct TorsionBar {  // an rsda between two bodies without a joint
  static constexpr std::string_view kType = "torsion_bar";
  std::string body1 = "ground", body2;
  std::optional<PointField> axis;  // in body1
  Field stiffness, damping, free_angle;
  std::optional<Expression> law;
};
// Components are expressions of t, parameters and sensors of the state (t, q, v).
using LawVector = std::array<Expression, 3>;
struct PointForce {
  static constexpr std::string_view kType = "force";
  std::string body;
  PointField point = "O";
  LawVector components;
  bool in_body_frame = false;  // "frame": "body"
};
struct Torque {
  static constexpr std::string_view kType = "torque";
  std::string body;
  LawVector components;
  bool in_body_frame = false;
};
struct BushingSpec {  // along and about the axes of body1
  static constexpr std::string_view kType = "bushing";
  std::string body1 = "ground", body2;
  PointField point1 = "O", point2 = "O";
  VectorField stiffness{0.0, 0.0, 0.0}, damping{0.0, 0.0, 0.0};                      // [N/m], [N s/m]
  VectorField torsional_stiffness{0.0, 0.0, 0.0}, torsional_damping{0.0, 0.0, 0.0};  // [N m/rad], [N m s/rad]
};
struct FrictionSpec {
  static constexpr std::string_view kType = "friction";
  std::string joint;
  std::string motion;                       // rotation or translation; empty: whichever the joint has, rotation first
  Field coulomb, smooth_velocity, viscous;  // [N m], [rad/s], [N m s/rad], or [N], [m/s], [N s/m]
  std::optional<Field> breakaway = {};      // [N m], [N]; empty: coulomb
  std::optional<Field> stribeck_velocity = {};  // [rad/s], [m/s]; with breakaway
};
// One-sided springs k d^n (1 + a ddot), never negative, of the depth d.
struct OneSided {
  Field stiffness, exponent = 1.0, damping;  // k [N/m^n], n [-], a [s/m]; of an angle [N m/rad^n], [s/rad]
};
struct StopSpec : OneSided {  // d: the angle or displacement beyond a bound
  static constexpr std::string_view kType = "stop";
  std::string joint;
  std::string motion;  // as of friction
  std::optional<Field> lower = {}, upper = {};
};
struct ContactSpec : OneSided {
  static constexpr std::string_view kType = "contact";
  std::string body1 = "ground", body2;
  PointField point1 = "O", point2 = "O";
  std::optional<PointField> normal1 = {};  // out of a plane of body1 through point1; without it, point1 is a centre
  std::optional<Field> radius1 = {};       // [m]
  Field radius2;                           // [m]
  bool inside = false;                     // body2 is inside of the ring of radius1
};
// A force written in C++, by its name. Its rho holds its own parameters, in the order of this list.
struct UserForceSpec {
  static constexpr std::string_view kType = "user";
  std::string force;
  std::vector<std::string> bodies;             // loaded bodies; if empty, it names them itself
  std::vector<TermParameter> parameters;       // the reader of the file puts them into the order of the term
  std::shared_ptr<const UserForce> term = {};  // the term of that name
};
struct Force {
  std::string name;
  std::variant<Tsda, Rsda, TorsionBar, PointForce, Torque, BushingSpec, FrictionSpec, StopSpec, ContactSpec,
               UserForceSpec>
      kind;
};

struct PointOnBody {
  std::string body;
  PointField point = "O";
};

// A measurement of a state. Fields that a quantity does not use stay at their defaults.
struct Sensor {
  std::string name;
  std::string quantity;  // position velocity angle rate energy constraint_violation distance ...
  std::string body;      // kQuantities (type_table.cpp) lists the fields of each quantity
  PointField point = "O";
  std::optional<PointOnBody> relative_to;
  std::string component;       // x y z norm | kinetic potential total | e0..e3
  bool in_body_frame = false;  // "frame": "body"
  std::string joint;
  std::string body1, body2;
  PointField point1 = "O", point2 = "O";
  std::string force;               // of force
  std::string kind;                // of reaction: force or torque
  std::string drive;               // of drive_force
  std::optional<PointField> axis;  // in the ground, or in body1
  Expression value;                // of expression: of t, parameters, definitions and other sensors
  OrientationField axes;           // of imu: of its axes in those of the body
};

// A bound that a sensor of positions never passes: bodies strike it and rebound, by Newton's law of restitution.
struct Limit {
  std::string name, sensor;
  std::optional<Field> lower = {}, upper = {};
  Field restitution;  // e: the rate after the impact is -e times that before
};

struct Condition {
  std::string sensor;
  std::optional<Field> value = {}, rate = {};
  std::optional<Field> acceleration = {};  // of kinematics only (kinematic_scene.hpp)
};

// scene.cpp compiles its constructors once: inline they are a quarter of each source that copies a scene.
struct Scene {
  Scene();
  Scene(const Scene&);
  Scene(Scene&&) noexcept;
  Scene& operator=(const Scene&);
  Scene& operator=(Scene&&) noexcept;
  ~Scene();

  std::string name = "unnamed";
  VectorField gravity{0.0, 0.0, -9.81};
  std::vector<Parameter> parameters;
  std::vector<Definition> definitions;
  std::vector<Signal> signals;
  std::vector<Body> bodies;
  std::vector<Joint> joints;
  std::vector<Drive> drives;
  std::vector<Force> forces;
  std::vector<Condition> conditions;  // initial.conditions
  int assembly_iterations = 400;      // initial.iterations: of positions, and of velocities, at most
  bool equilibrium = false;           // initial.equilibrium: start at rest from the static equilibrium near the guess
  std::vector<Sensor> sensors;
  std::vector<Limit> limits;
  SimulationSettings simulation;
};

}  // namespace mbsopt
