// One harness for every sensor: value and gradient, in the state and in the parameters, against its definition written
// once more for any scalar (complex step), and against central differences of its own values with the scene compiled
// anew. A new sensor is tested by one more row of the list.
#include <catch2/catch.hpp>
#include <functional>

#include "core/mechanism/sensor_gradient.hpp"
#include "tests/core/body/textbook_body.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

enum ParameterIndex : std::size_t { a, b, c1, c2, m1, j, g, k, l0, kt, theta0, n, kParameters };

// Two bodies, a hinge between them with its angle, a spring and a torsional spring: all that sensors look at.
Scene two_bodies() {
  Scene s;
  add_parameters(s, {{"a", 0.4},
                     {"b", -0.7},
                     {"c1", 0.2},
                     {"c2", 0.3},
                     {"m1", 1.7},
                     {"j", 0.06},
                     {"g", 9.7},
                     {"k", 12},
                     {"l0", 0.5},
                     {"kt", 3.0},
                     {"theta0", 0.2},
                     {"n", 0.35}});
  s.gravity = vec("0.1*g", "0", "-g");
  s.bodies.push_back(body("one", vec("c1", "0", "0.1"), vec("0", "0", "0"), EulerParametersField{}));
  s.bodies.push_back(body("two", vec("0", "c2", "0"), vec("1", "0", "0"), EulerParametersField{}));
  s.bodies[0].mass = f("m1");
  s.bodies[1].inertia.xy = f("j");
  Joint hinged = hinge("H", "one", vec("a", "0", "0"), "two", vec("0", "b", "0"));
  hinged.normal1 = vec("1", "n", "0"), hinged.normal2 = vec("n", "1", "0");
  s.joints.push_back(hinged);
  Tsda spring;
  spring.body1 = "one", spring.body2 = "two", spring.point1 = vec("0", "a", "0"), spring.point2 = vec("b", "0", "0.2");
  spring.stiffness = f("k"), spring.free_length = f("l0"), spring.damping = f("a");
  s.forces.push_back({"spring", spring});
  Rsda torsion;
  torsion.joint = "H", torsion.stiffness = f("kt"), torsion.free_angle = f("theta0"), torsion.damping = f("b");
  s.forces.push_back({"torsion", torsion});
  Tsda cubic = spring;
  cubic.law = f("k*l^3 - a*ldot*l + 0.5*cos(t)");
  s.forces.push_back({"cubic", cubic});
  Rsda stop = torsion;
  stop.law = f("kt*angle^2 + n*rate*angle + t");
  s.forces.push_back({"stop", stop});
  return s;
}

// The same, for any scalar.
template <class T>
struct TextbookScene {
  std::vector<T> y, rho;

  TextbookBody<T> body(std::size_t i) const { return {part<7>(y, 7 * i), part<7>(y, 14 + 7 * i)}; }
  V3<T> com(std::size_t i) const { return i == 0 ? V3<T>{rho[c1], T(0), T(0.1)} : V3<T>{T(0), rho[c2], T(0)}; }
  // A point of a body (given from its frame's origin) along the motion.
  V3<Series<T>> point(std::size_t i, const V3<T>& s) const {
    return body(i).moving().point(constant(V3<T>(s - com(i))));
  }
  V3<Series<T>> in_axes_of(std::size_t i, const V3<Series<T>>& x) const {
    return transposed_times(body(i).moving().A, x);
  }
  V3<T> tip() const { return {rho[a], rho[b], T(0.3)}; }   // of body one
  V3<T> foot() const { return {rho[b], T(0.5), rho[a]}; }  // of body two

  V3<T> omega(std::size_t i, bool body_axes) const {
    const V4<T> p = body(i).p(), w = body(i).pdot();
    const V3<T> e{p[1], p[2], p[3]}, f{w[1], w[2], w[3]};
    const V3<T> turned = body_axes ? cross(f, e) : cross(e, f);
    return scaled(T(2), scaled(p[0], f) - scaled(w[0], e) + turned);
  }
  std::pair<Series<T>, Series<T>> angle_series() const {
    using std::sqrt;
    const T length = sqrt(T(1) + rho[n] * rho[n]);
    const V3<T> x1{T(1) / length, rho[n] / length, T(0)}, y1{-rho[n] / length, T(1) / length, T(0)};
    const V3<T> n2{rho[n] / length, T(1) / length, T(0)};
    const auto f1 = body(0).moving(), f2 = body(1).moving();
    const auto direction = times(f2.A, constant(n2));
    return {dot(direction, times(f1.A, constant(x1))), dot(direction, times(f1.A, constant(y1)))};
  }
  T rate() const {
    const auto [C, S] = angle_series();
    return (C.c[0] * S.c[1] - S.c[0] * C.c[1]) / (C.c[0] * C.c[0] + S.c[0] * S.c[0]);
  }
  static double atan2_of(double S, double C) { return std::atan2(S, C); }
  static Complex atan2_of(const Complex& S, const Complex& C) {
    const double s = S.real(), x = C.real();
    return {std::atan2(s, x), (x * S.imag() - s * C.imag()) / (x * x + s * s)};
  }
  static constexpr double kTurns = 6;  // a branch some turns on
  T angle() const {
    const auto [C, S] = angle_series();
    const T principal = atan2_of(S.c[0], C.c[0]);
    const double turn = 2 * std::acos(-1.0);
    return principal + turn * std::round((kTurns * turn - std::real(principal)) / turn);
  }
  // It measures body two about an axis of body one, or of the ground.
  T body_angle(bool relative) const {
    const V3<T> axis{rho[n], T(1), T(0.8)}, u = scaled(T(1) / norm(axis), axis);  // least along global x
    const V3<T> across = cross(u, V3<T>{T(1), T(0), T(0)}), x = scaled(T(1) / norm(across), across);
    const V3<T> turned = times(body(1).frame().A, x);
    const V3<T> seen = relative ? transposed_times(body(0).frame().A, turned) : turned;
    const T principal = atan2_of(dot(seen, cross(u, x)), dot(seen, x));
    const double turn = 2 * std::acos(-1.0);
    return principal + turn * std::round((kTurns * turn - std::real(principal)) / turn);
  }
  T mass_of(std::size_t i) const { return i == 0 ? rho[m1] : T(1); }
  V3<T> rdot(std::size_t i) const { return {body(i).v[0], body(i).v[1], body(i).v[2]}; }
  V3<T> J_omega(std::size_t i) const {  // body axes
    const T xy = i == 1 ? rho[j] : T(0.01);
    const M3<T> J{V3<T>{T(0.2), xy, T(0.02)}, V3<T>{xy, T(0.3), T(0.03)}, V3<T>{T(0.02), T(0.03), T(0.4)}};
    return times(J, omega(i, true));
  }
  T kinetic() const {
    T sum(0);
    for (std::size_t i = 0; i < 2; ++i) {
      sum += T(0.5) * (mass_of(i) * dot(rdot(i), rdot(i)) + dot(omega(i, true), J_omega(i)));
    }
    return sum;
  }
  V3<T> angular_momentum() const {
    V3<T> sum{};
    for (std::size_t i = 0; i < 2; ++i) {
      const auto f = body(i).frame();
      sum = sum + scaled(mass_of(i), cross(f.r, rdot(i))) + times(f.A, J_omega(i));
    }
    return sum;
  }
  T mass() const { return rho[m1] + T(1); }
  // m1 r1 + m2 r2, or with the velocities.
  V3<T> mass_sum(std::size_t order) const {
    const auto X = body(0).moving().r, Y = body(1).moving().r;
    return {rho[m1] * X[0].c[order] + Y[0].c[order], rho[m1] * X[1].c[order] + Y[1].c[order],
            rho[m1] * X[2].c[order] + Y[2].c[order]};
  }
  T potential() const {
    const V3<T> gravity{T(0.1) * rho[g], T(0), -rho[g]};
    T sum(0);
    for (std::size_t i = 0; i < 2; ++i) {
      const auto q = body(i).q;
      sum -= mass_of(i) * dot(gravity, V3<T>{q[0], q[1], q[2]});
    }
    const auto d = point(1, {rho[b], T(0), T(0.2)}) - point(0, {T(0), rho[a], T(0)});
    const T stretch = norm(values(d)) - rho[l0], twist = angle() - rho[theta0];
    return sum + T(0.5) * (rho[k] * stretch * stretch + rho[kt] * twist * twist);
  }
  // The spring's length and its rate.
  std::pair<T, T> span() const {
    const auto d = point(1, {rho[b], T(0), T(0.2)}) - point(0, {T(0), rho[a], T(0)});
    const V3<T> x = values(d);
    return {norm(x), dot(x, rates(d)) / norm(x)};
  }
  T spring_tension() const {
    const auto [l, ldot] = span();
    return rho[k] * (l - rho[l0]) + rho[a] * ldot;
  }
  T cubic_tension() const {
    const auto [l, ldot] = span();
    return rho[k] * l * l * l - rho[a] * ldot * l + T(0.5);
  }
  // Along an axis of body one, between the points of a slider.
  Series<T> displacement() const {
    using std::sqrt;
    const T length = sqrt(rho[n] * rho[n] + T(1.04));
    const V3<T> axis{rho[n] / length, T(0.2) / length, T(1) / length};
    return dot(times(body(0).moving().A, constant(axis)), point(1, foot()) - point(0, tip()));
  }
  // Between the links from the hinge to the two balls that compiled() adds, by the cosine law.
  T transmission_angle() const {
    using std::acos;
    const V3<T> here1{rho[a], T(0), T(0)}, here2{T(0), rho[b], T(0)};
    const V3<T> x1 = times(body(0).frame().A, V3<T>(tip() - here1)),
                x2 = times(body(1).frame().A, V3<T>(foot() - here2));
    const V3<T> side = x2 - x1;
    return acos((dot(x1, x1) + dot(x2, x2) - dot(side, side)) / (T(2) * norm(x1) * norm(x2)));
  }
  // The largest |Phi| of the hinge and the unit norms.
  T violation() const {
    std::vector<T> phi;
    const auto gap = values(point(1, {T(0), rho[b], T(0)}) - point(0, {rho[a], T(0), T(0)}));
    phi.insert(phi.end(), gap.begin(), gap.end());
    const auto f1 = body(0).frame(), f2 = body(1).frame();
    const V3<T> axis = times(f2.A, V3<T>{T(0), T(0), T(1)});
    for (const V3<T>& s : {V3<T>{T(1), T(0), T(0)}, V3<T>{T(0), T(1), T(0)}}) phi.push_back(dot(times(f1.A, s), axis));
    for (std::size_t i = 0; i < 2; ++i) {
      const V4<T> p = body(i).p();
      phi.push_back(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3] - T(1));
    }
    T worst(0);
    for (const T& x : phi) {
      if (std::abs(std::real(x)) > std::real(worst)) worst = std::real(x) < 0 ? -x : x;
    }
    return worst;
  }
  static V3<T> values(const V3<Series<T>>& x) { return {x[0].c[0], x[1].c[0], x[2].c[0]}; }
  static V3<T> rates(const V3<Series<T>>& x) { return {x[0].c[1], x[1].c[1], x[2].c[1]}; }
};

template <class T>
T norm_rate(const V3<Series<T>>& x) {
  const V3<T> X = TextbookScene<T>::values(x);
  return dot(X, TextbookScene<T>::rates(x)) / norm(X);
}

// A row of the list: a sensor as a scene says it, its definition, and whether its own time derivative is meant.
struct Row {
  std::string name;
  Sensor sensor;
  std::function<double(const TextbookScene<double>&)> value;
  std::function<Complex(const TextbookScene<Complex>&)> complex_value;
  bool time_derivative = false;
};
template <class F>
Row row(const std::string& name, Sensor sensor, F definition, bool time_derivative = false) {
  sensor.name = "s";
  return {name, std::move(sensor), definition, definition, time_derivative};
}

Sensor on_point(const std::string& quantity, const std::string& component, bool relative = false,
                bool in_axes = false) {
  Sensor s = point_sensor("s", quantity, "one", vec("a", "b", "0.3"), component);
  if (relative) s.relative_to = PointOnBody{"two", vec("b", "0.5", "a")};
  s.in_body_frame = in_axes;
  return s;
}
Sensor plain(const std::string& quantity, const std::string& component = "") {
  Sensor s;
  s.quantity = quantity, s.component = component, s.joint = "H", s.body = "two";
  s.body1 = "one", s.body2 = "two", s.point1 = vec("a", "b", "0.3"), s.point2 = vec("b", "0.5", "a");
  return s;
}
Sensor force_of(const std::string& force) {
  Sensor s = plain("force");
  s.force = force;
  return s;
}
Sensor about_axis(const std::string& quantity) {
  Sensor s = plain(quantity);
  if (quantity == "body_angle") s.body1.clear(), s.body2.clear();
  s.axis = vec("n", "1", "0.8");
  return s;
}
Sensor spin(const std::string& component, bool in_axes) {
  Sensor s = plain("angular_velocity", component);
  s.in_body_frame = in_axes;
  return s;
}

Sensor expression(const std::string& text) {
  Sensor s;
  s.quantity = "expression", s.value = f(text);
  return s;
}
// The sensors that the rows of expressions measure by; the last is an expression, too.
std::vector<Sensor> below_expressions() {
  std::vector<Sensor> all{plain("angle"), plain("rate"), plain("distance"), on_point("position", "x"),
                          expression("(gap + px)/2")};
  const char* const names[] = {"turn", "turn_rate", "gap", "px", "mean"};
  for (std::size_t i = 0; i < all.size(); ++i) all[i].name = names[i];
  return all;
}
// Those of positions with their time derivatives.
template <class T>
struct Below {
  T turn, turn_rate, gap, gap_rate, px, px_rate;
  explicit Below(const TextbookScene<T>& s) : turn(s.angle()), turn_rate(s.rate()) {
    const auto d = s.point(1, s.foot()) - s.point(0, s.tip()), p = s.point(0, s.tip());
    gap = norm(s.values(d)), gap_rate = norm_rate(d);
    px = p[0].c[0], px_rate = p[0].c[1];
  }
};

// The rate about the y axis of a mount at roll, pitch and yaw (n, 0.3, a) on body two.
struct MountRate {
  template <class T>
  T operator()(const TextbookScene<T>& s) const {
    using std::cos, std::sin;
    const T x = sin(T(0.3)) * sin(s.rho[n]), y = cos(s.rho[n]), z = cos(T(0.3)) * sin(s.rho[n]);
    const T C = cos(s.rho[a]), S = sin(s.rho[a]);
    return dot(V3<T>{C * x - S * y, S * x + C * y, z}, s.omega(1, true));
  }
};
Sensor mounted(const std::string& component) {
  Sensor s = plain("imu", component);
  s.axes = RollPitchYawField{vec("n", "0.3", "a")};
  return s;
}

const std::vector<Row>& all_sensors() {
  static const std::vector<Row> rows{
      row("position", on_point("position", "y"), [](const auto& s) { return s.point(0, s.tip())[1].c[0]; }),
      row("position, norm", on_point("position", "norm"),
          [](const auto& s) { return norm(s.values(s.point(0, s.tip()))); }),
      row("position, relative", on_point("position", "z", true),
          [](const auto& s) { return (s.point(0, s.tip()) - s.point(1, s.foot()))[2].c[0]; }),
      row("position, relative, body axes", on_point("position", "x", true, true),
          [](const auto& s) { return s.in_axes_of(0, s.point(0, s.tip()) - s.point(1, s.foot()))[0].c[0]; }),
      row("position, relative, norm in body axes", on_point("position", "norm", true, true),
          [](const auto& s) { return norm(s.values(s.in_axes_of(0, s.point(0, s.tip()) - s.point(1, s.foot())))); }),
      row(
          "rate of position", on_point("position", "y"), [](const auto& s) { return s.point(0, s.tip())[1].c[1]; },
          true),
      row(
          "rate of position, body axes", on_point("position", "x", true, true),
          [](const auto& s) { return s.in_axes_of(0, s.point(0, s.tip()) - s.point(1, s.foot()))[0].c[1]; }, true),
      row(
          "rate of position, norm in body axes", on_point("position", "norm", true, true),
          [](const auto& s) { return norm_rate(s.in_axes_of(0, s.point(0, s.tip()) - s.point(1, s.foot()))); }, true),
      row("velocity", on_point("velocity", "x"), [](const auto& s) { return s.point(0, s.tip())[0].c[1]; }),
      row("velocity, relative, norm", on_point("velocity", "norm", true),
          [](const auto& s) { return norm(s.rates(s.point(0, s.tip()) - s.point(1, s.foot()))); }),
      row("velocity, body axes", on_point("velocity", "z", true, true),
          [](const auto& s) {
            const auto v = s.rates(s.point(0, s.tip()) - s.point(1, s.foot()));
            return transposed_times(s.body(0).frame().A, v)[2];
          }),
      row("displacement", plain("displacement"), [](const auto& s) { return s.displacement().c[0]; }),
      row(
          "rate of displacement", plain("displacement"), [](const auto& s) { return s.displacement().c[1]; }, true),
      row("distance", plain("distance"),
          [](const auto& s) { return norm(s.values(s.point(1, s.foot()) - s.point(0, s.tip()))); }),
      row("distance_rate", plain("distance_rate"),
          [](const auto& s) { return norm_rate(s.point(1, s.foot()) - s.point(0, s.tip())); }),
      row("angle", plain("angle"), [](const auto& s) { return s.angle(); }),
      row("rate", plain("rate"), [](const auto& s) { return s.rate(); }),
      row("body_angle", about_axis("body_angle"), [](const auto& s) { return s.body_angle(false); }),
      row("relative_angle", about_axis("relative_angle"), [](const auto& s) { return s.body_angle(true); }),
      row("angular_velocity, global", spin("y", false), [](const auto& s) { return s.omega(1, false)[1]; }),
      row("angular_velocity, body axes", spin("z", true), [](const auto& s) { return s.omega(1, true)[2]; }),
      row("angular_velocity, norm", spin("norm", false), [](const auto& s) { return norm(s.omega(1, false)); }),
      row("orientation", plain("orientation", "e2"), [](const auto& s) { return s.body(1).q[5]; }),
      row("energy, kinetic", plain("energy", "kinetic"), [](const auto& s) { return s.kinetic(); }),
      row("energy, potential", plain("energy", "potential"), [](const auto& s) { return s.potential(); }),
      row("energy, total", plain("energy", "total"), [](const auto& s) { return s.kinetic() + s.potential(); }),
      row("force of a spring", force_of("spring"), [](const auto& s) { return s.spring_tension(); }),
      row("force of a law", force_of("cubic"), [](const auto& s) { return s.cubic_tension(); }),
      row("torque of a torsional spring", force_of("torsion"),
          [](const auto& s) { return s.rho[kt] * (s.angle() - s.rho[theta0]) + s.rho[b] * s.rate(); }),
      row("torque of a law", force_of("stop"),
          [](const auto& s) { return s.rho[kt] * s.angle() * s.angle() + s.rho[n] * s.rate() * s.angle(); }),
      row("centre_of_mass", plain("centre_of_mass", "x"), [](const auto& s) { return s.mass_sum(0)[0] / s.mass(); }),
      row("centre_of_mass, norm", plain("centre_of_mass", "norm"),
          [](const auto& s) { return norm(s.mass_sum(0)) / s.mass(); }),
      row(
          "rate of centre_of_mass", plain("centre_of_mass", "z"),
          [](const auto& s) { return s.mass_sum(1)[2] / s.mass(); }, true),
      row("momentum", plain("momentum", "y"), [](const auto& s) { return s.mass_sum(1)[1]; }),
      row("momentum, norm", plain("momentum", "norm"), [](const auto& s) { return norm(s.mass_sum(1)); }),
      row("angular_momentum", plain("angular_momentum", "y"), [](const auto& s) { return s.angular_momentum()[1]; }),
      row("angular_momentum, norm", plain("angular_momentum", "norm"),
          [](const auto& s) { return norm(s.angular_momentum()); }),
      row("constraint_violation", plain("constraint_violation"), [](const auto& s) { return s.violation(); }),
      row("transmission_angle", plain("transmission_angle"), [](const auto& s) { return s.transmission_angle(); }),
      row("imu, rate", mounted("wy"), MountRate()),
      row("expression", expression("turn*gap + sin(mean)*turn_rate^2 + a*l0"),
          [](const auto& s) {
            using std::sin;
            const Below x(s);
            return x.turn * x.gap + sin((x.gap + x.px) / 2.0) * x.turn_rate * x.turn_rate + s.rho[a] * s.rho[l0];
          }),
      row(
          "rate of an expression", expression("turn*gap + sin(mean)*k + a*l0"),
          [](const auto& s) {
            using std::cos;
            const Below x(s);
            return x.turn_rate * x.gap + x.turn * x.gap_rate +
                   cos((x.gap + x.px) / 2.0) * (x.gap_rate + x.px_rate) / 2.0 * s.rho[k];
          },
          true),
  };
  return rows;
}

struct Compiled {
  Mechanism mechanism;
  SensorPtr sensor;
  VectorXd angles;
};
Compiled compiled(const Row& row, const VectorXd& rho) {
  Scene scene = two_bodies();
  scene.sensors.push_back(row.sensor);
  if (row.sensor.quantity == "displacement") {  // a joint that has one, and that the other rows do not see
    Joint slider = hinge("S", "one", vec("a", "b", "0.3"), "two", vec("b", "0.5", "a"));
    slider.type = "cylindrical", slider.axis1 = vec("n", "0.2", "1");
    scene.joints.push_back(slider);
    scene.sensors.back().joint = "S";
  }
  if (row.sensor.quantity == "transmission_angle") {
    scene.joints.push_back(ball("to_one", "ground", vec("0", "0", "0"), "one", vec("a", "b", "0.3")));
    scene.joints.push_back(ball("to_two", "two", vec("b", "0.5", "a"), "ground", vec("1", "0", "0")));
  }
  for (Sensor& below : below_expressions()) scene.sensors.push_back(std::move(below));
  const Mechanism mechanism(scene, rho);
  const VectorXd angles = VectorXd::Constant(static_cast<Eigen::Index>(mechanism.data().angles.size()),
                                             TextbookScene<double>::kTurns * 2 * std::acos(-1.0));
  const SensorPtr& sensor = mechanism.data().sensors.at(0);
  return {mechanism, row.time_derivative ? sensor->rate(mechanism.data()) : sensor, angles};
}

// x = (y, rho)
template <class T>
TextbookScene<T> textbook(const std::vector<T>& x) {
  return {std::vector<T>(x.begin(), x.begin() + 28), std::vector<T>(x.begin() + 28, x.end())};
}

}  // namespace

TEST_CASE("every sensor has the value of its definition and that value's gradient", "[sensor]") {
  const std::size_t which = GENERATE(range(std::size_t{0}, all_sensors().size()));
  const unsigned seed = GENERATE(range(0u, 3u));
  const Row& row = all_sensors()[which];
  INFO(row.name);
  Random random(seed);
  VectorXd x(28 + static_cast<Eigen::Index>(kParameters));
  x << random.vector(28), nominal(two_bodies());  // Euler parameters are not of unit length: gradients hold there too
  const VectorXd y = x.head(28), rho = x.tail(static_cast<Eigen::Index>(kParameters));

  const Compiled c = compiled(row, rho);
  const double value = evaluate(c.mechanism.data(), c.sensor, 0, y, c.angles);
  CHECK(value == Approx(row.value(textbook(std::vector<double>(x.data(), x.data() + x.size())))).epsilon(1e-13));

  VectorXd y_bar = VectorXd::Ones(28), rho_bar = VectorXd::Ones(rho.size());
  const double again = add_gradient(c.mechanism.data(), c.sensor, 0, y, c.angles, 0.6, y_bar, rho_bar);
  CHECK(again == Approx(value).epsilon(1e-15));
  VectorXd found(x.size());
  found << y_bar, rho_bar;
  found = (found.array() - 1) / 0.6;  // it adds, scaled

  const VectorXd complex_step =
      complex_gradient([&](const std::vector<Complex>& at) { return row.complex_value(textbook(at)); }, x);
  const VectorXd differences = difference_gradient(
      [&](const VectorXd& at) {
        const Compiled moved = compiled(row, at.tail(rho.size()));
        return evaluate(moved.mechanism.data(), moved.sensor, 0, at.head(28), moved.angles);
      },
      x, 1e-4);
  const double size = 1 + found.lpNorm<Eigen::Infinity>();
  CHECK((found - complex_step).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < 1e-12 * size);
  CHECK((found - differences).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < 1e-8 * size);
}

TEST_CASE("a norm at zero has the value zero and no gradient, not NaN", "[sensor]") {
  for (const char* quantity : {"position", "velocity"}) {
    Scene scene = two_bodies();
    Sensor s = on_point(quantity, "norm", true);
    s.relative_to = PointOnBody{"one", vec("a", "b", "0.3")};
    scene.sensors.push_back(s);
    const Mechanism mechanism(scene, nominal(scene));
    const VectorXd y = Random(1).vector(28);
    VectorXd y_bar = VectorXd::Zero(28), rho_bar = VectorXd::Zero(kParameters);
    CHECK(add_gradient(mechanism.data(), mechanism.data().sensors[0], 0, y, VectorXd(), 1, y_bar, rho_bar) == 0);
    CHECK(y_bar.norm() == 0);
    CHECK(rho_bar.norm() == 0);
  }
}

TEST_CASE("a sensor on the ground is constant in the state", "[sensor]") {
  Scene scene = two_bodies();
  scene.sensors.push_back(point_sensor("s", "position", "ground", vec("a", "2", "0"), "x"));
  const Mechanism mechanism(scene, nominal(scene));
  VectorXd y_bar = VectorXd::Zero(28), rho_bar = VectorXd::Zero(kParameters);
  CHECK(add_gradient(mechanism.data(), mechanism.data().sensors[0], 0, Random(1).vector(28), VectorXd(), 1, y_bar,
                     rho_bar) == 0.4);
  CHECK(y_bar.norm() == 0);
  CHECK(rho_bar(a) == 1);
}

TEST_CASE("smallest_singular_value of a hinged bar has a closed form, and is zero where a drive cannot pass",
          "[sensor]") {
  // At angle 0 with L = c, lever -x: the rows (y, -theta_z) and (z, theta_y) have length sqrt(2), and theta_y is also
  // that of a dot-1 row: the squares of these two singular values are 1 -+ 1/sqrt(2).
  Scene scene = pendulum();
  scene.sensors[0].quantity = "smallest_singular_value";
  VectorXd y = VectorXd::Zero(14);
  y(0) = 0.7, y(3) = 1;
  const auto value = [&] {
    const Mechanism mechanism(scene, nominal(scene));
    return mechanism.sensor_value(0, {0, y, VectorXd()});
  };
  CHECK(value() == Approx(std::sqrt(1 - std::sqrt(0.5))).epsilon(1e-14));
  Drive push;
  push.name = "push", push.type = "coordinate", push.body = "bar", push.coordinate = "x", push.law = f("0.7");
  scene.drives.push_back(push);
  CHECK(std::abs(value()) < 1e-14);  // x is stationary: the bar lies along it
  y << 0.7 * std::cos(1.0), 0.7 * std::sin(1.0), 0, std::cos(0.5), 0, 0, std::sin(0.5), VectorXd::Zero(7);
  CHECK(value() > 0.1);
}

TEST_CASE("the gradient of smallest_singular_value equals differences", "[sensor]") {
  const Row row{"", plain("smallest_singular_value"), {}, {}, false};
  const VectorXd rho = nominal(two_bodies());
  VectorXd x(28 + rho.size());
  x << Random(GENERATE(range(0u, 3u))).vector(28), rho;
  const Compiled c = compiled(row, rho);
  VectorXd y_bar = VectorXd::Zero(28), rho_bar = VectorXd::Zero(rho.size()), found(x.size());
  const double value = add_gradient(c.mechanism.data(), c.sensor, 0, x.head(28), c.angles, 1, y_bar, rho_bar);
  CHECK(value > 1e-3);
  found << y_bar, rho_bar;
  CHECK(rho_bar.norm() > 1e-3);
  const VectorXd differences = difference_gradient(
      [&](const VectorXd& at) {
        const Compiled moved = compiled(row, at.tail(rho.size()));
        return evaluate(moved.mechanism.data(), moved.sensor, 0, at.head(28), moved.angles);
      },
      x, 1e-4);
  CHECK((found - differences).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < 1e-8 * (1 + found.norm()));
}

TEST_CASE("a transmission angle names the link whose other pin it cannot tell", "[sensor]") {
  Scene scene = two_bodies();
  Sensor s = plain("transmission_angle");
  s.name = "mu";
  scene.sensors.push_back(s);
  CHECK_THROWS_WITH(Mechanism(scene, nominal(scene)), Catch::Contains("body 'one' has 0 other pins"));
}
