// One harness for every force: loads, pull-back and tangent are checked against the force's virtual work written once
// more for any scalar (complex step), and against central differences of its own loads. A new force is tested by a case
// of its own in the list of types below.
#include <catch2/catch.hpp>

#include "core/body/euler_parameters.hpp"
#include "core/force/applied.hpp"
#include "core/force/bushing.hpp"
#include "core/force/friction.hpp"
#include "core/force/joint_effort.hpp"
#include "core/force/tsda.hpp"
#include "tests/core/body/textbook_body.hpp"

#define BETWEEN_BODIES                                                                                         \
  TsdaCase<LinearLaw>, TsdaCase<ProgramLaw>, RsdaCase<LinearLaw>, RsdaCase<ProgramLaw>, RsdaCase<DryFriction>, \
      BushingCase, SlidingCase
#define ALL_FORCES                                                                                     \
  BETWEEN_BODIES, (AppliedCase<false, false>), (AppliedCase<false, true>), (AppliedCase<true, false>), \
      (AppliedCase<true, true>)

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

constexpr double kTime = 0.7;

// k (x - x0) + c xdot + f0: four fields.
struct LinearLaw {
  static constexpr int kFields = 4, kParameters = 0;
  using ForceLaw = Law;
  template <class T>
  static T value(const std::vector<T>& at, std::size_t k, const T& x, const T& xdot) {
    return at[k] * (x - at[k + 2]) + at[k + 1] * xdot + at[k + 3];
  }
  static void fill(Law& law, const VectorXd& at, int first, int slot) {
    law.k = at(first), law.c = at(first + 1), law.x0 = at(first + 2), law.f0 = at(first + 3);
    law.slot = slot;
  }
};

// A user's expression of x, xdot, t and two parameters.
struct ProgramLaw {
  static constexpr int kFields = 0, kParameters = 2;
  using ForceLaw = Law;
  template <class T>
  static T value(const std::vector<T>& at, std::size_t k, const T& x, const T& xdot) {
    return at[k] * x * x * x + at[k + 1] * xdot * x - at[k] * at[k + 1] * T(kTime);
  }
  static void fill(Law& law, const VectorXd&, int, int) {
    Symbols symbols;
    for (const char* name : {"a", "b", "x", "xdot", "t"}) symbols.add_input(name);
    law.program.emplace(Expression::parse("a*x^3 + b*xdot*x - a*b*t"), symbols);
  }
};

// Smoothed Coulomb friction and a viscous part: three fields.
struct DryFriction {
  static constexpr int kFields = 3, kParameters = 0;
  using ForceLaw = FrictionLaw;
  template <class T>
  static T value(const std::vector<T>& at, std::size_t k, const T&, const T& rate) {
    using std::sqrt;
    return at[k] * rate / sqrt(rate * rate + at[k + 1] * at[k + 1]) + at[k + 2] * rate;
  }
  static void fill(FrictionLaw& law, const VectorXd& at, int first, int slot) {
    law.coulomb = at(first), law.smooth = at(first + 1), law.viscous = at(first + 2);
    law.slot = slot;
  }
};

// Two bodies in a state x = (q1, v1, q2, v2, geometry, law's fields or parameters), and virtual displacements.
struct Bodies {
  VectorXd x;
  Vec<6> eta1, eta2;
  BodyState b1, b2;
  Frame f1, f2;

  Bodies(unsigned seed, Eigen::Index inputs) {
    Random random(seed);
    x = random.vector(inputs);
    eta1 = random.vector(6), eta2 = random.vector(6);
  }
  void place() {
    set(0, eta1, b1, f1);
    set(14, eta2, b2, f2);
  }
  template <class T>
  TextbookBody<T> textbook(const std::vector<T>& at, std::size_t first) const {
    TextbookBody<T> body{part<7>(at, first), part<7>(at, first + 7)};
    const Vec<6>& eta = first == 0 ? eta1 : eta2;
    for (std::size_t i = 0; i < 6; ++i) body.eta[i] = eta(static_cast<Eigen::Index>(i));
    return body;
  }

 private:
  void set(int first, const Vec<6>& eta, BodyState& b, Frame& f) const {
    set_position(x.segment<7>(first), b, f);
    set_velocity(x.segment<7>(first + 7), b, f);
    set_virtual(eta, f);
  }
};

struct Loads {
  Vec<6> load1 = Vec<6>::Zero(), load2 = Vec<6>::Zero();
};
struct LoadTangents {
  Lanes<6> load1 = Lanes<6>::Zero(), load2 = Lanes<6>::Zero();
};

// Where a law's inputs lie: fields in theta after the geometry, parameters in rho.
template <class L>
struct LawScratch {
  Law::Scratch scratch;
  VectorXd rho;
  LawScratch(const typename L::ForceLaw& law, const VectorXd& at, int first) : rho(at.segment(first, L::kParameters)) {
    scratch.inputs.resize(static_cast<std::size_t>(L::kParameters + 3));
    scratch.gradient.resize(scratch.inputs.size());
    if constexpr (requires { law.program; }) {
      if (law.program) scratch.program = law.program->scratch();
    }
  }
};

template <class L>
struct TsdaCase : Bodies {
  static constexpr int kGeometry = 6, kLaw = 28 + kGeometry, kFields = L::kFields, kParameters = L::kParameters,
                       kInputs = kLaw + kFields + kParameters;
  TsdaForce force;

  explicit TsdaCase(unsigned seed) : Bodies(seed, kInputs) { place(); }
  void place() {
    Bodies::place();
    force.s1 = x.segment<3>(28), force.s2 = x.segment<3>(31);
    force.slot1 = 0, force.slot2 = 3;
    L::fill(force.law, x, kLaw, kGeometry);
  }

  template <class T>
  T work(const std::vector<T>& at) const {
    const TextbookBody<T> body1 = textbook(at, 0), body2 = textbook(at, 14);
    const auto s1 = constant(part<3>(at, 28)), s2 = constant(part<3>(at, 31));
    const auto d = body2.moving().point(s2) - body1.moving().point(s1);
    const auto change = body2.displaced().point(s2) - body1.displaced().point(s1);
    V3<T> d0, d1, d_eta;
    for (std::size_t i = 0; i < 3; ++i) d0[i] = d[i].c[0], d1[i] = d[i].c[1], d_eta[i] = change[i].c[1];
    const T l = norm(d0);
    return -L::value(at, kLaw, l, dot(d0, d1) / l) * dot(d0, d_eta) / l;
  }
  Loads loads() const {
    LawScratch<L> s(force.law, x, kLaw);
    Loads out;
    force.add_load(kTime, s.rho, f1, f2, s.scratch, out.load1, out.load2);
    return out;
  }
  void pull_back(FrameBar& bar1, FrameBar& bar2, VectorXd& theta_bar, VectorXd& rho_bar) const {
    LawScratch<L> s(force.law, x, kLaw);
    force.pull_back(kTime, s.rho, f1, f2, s.scratch, bar1, bar2, theta_bar, rho_bar);
  }
  LoadTangents tangent(const FrameTangent& t1, const FrameTangent& t2, const Eigen::MatrixXd& directions) const {
    LawScratch<L> s(force.law, x, kLaw);
    const TsdaForce::Span span = force.span(f1, f2);
    const Law::Value f = force.law.derivatives(kTime, s.rho, span.l, span.ldot, s.scratch);
    Lanes<4> fields = Lanes<4>::Zero();
    if (L::kFields > 0) fields = directions.middleRows(kLaw, 4);
    const Lanes<1> df = force.law.field_tangent(
        span.l, span.ldot, &fields, [&](int k) { return Lanes<1>(directions.row(kLaw + k)); }, s.scratch);
    const Lanes<3> ds1 = directions.middleRows<3>(28), ds2 = directions.middleRows<3>(31);
    LoadTangents out;
    force.tangent(span, f, df, f1, f2, t1, t2, &ds1, &ds2, out.load1, out.load2);
    return out;
  }
};

template <class L>
struct RsdaCase : Bodies {
  static constexpr int kGeometry = 9, kLaw = 28 + kGeometry, kFields = L::kFields, kParameters = L::kParameters,
                       kInputs = kLaw + kFields + kParameters;
  static constexpr double kReference = 13;  // two turns on: the branch that counts
  JointEffort<Angle, typename L::ForceLaw> force;

  explicit RsdaCase(unsigned seed) : Bodies(seed, kInputs) { place(); }
  void place() {
    Bodies::place();
    JointAngle& joint = force.joint;  // in x: n1, axis x n1, n2
    joint.measure.s1 = x.segment<3>(28), joint.measure.s3 = x.segment<3>(31), joint.measure.s2 = x.segment<3>(34);
    joint.slot1 = 0, joint.slot3 = 3, joint.slot2 = 6;
    L::fill(force.law, x, kLaw, kGeometry);
  }

  // atan2 near its real value: the imaginary part to first order, which is all a complex step needs.
  static double atan2_of(double S, double C) { return std::atan2(S, C); }
  static Complex atan2_of(const Complex& S, const Complex& C) {
    const double s = S.real(), c = C.real();
    return {std::atan2(s, c), (c * S.imag() - s * C.imag()) / (c * c + s * s)};
  }

  template <class T>
  T work(const std::vector<T>& at) const {
    const TextbookBody<T> body1 = textbook(at, 0), body2 = textbook(at, 14);
    const auto x1 = constant(part<3>(at, 28)), y1 = constant(part<3>(at, 31)), n2 = constant(part<3>(at, 34));
    auto series = [&](const auto& g1, const auto& g2) {
      const auto n = times(g2.A, n2);
      return std::pair(dot(n, times(g1.A, x1)), dot(n, times(g1.A, y1)));
    };
    const auto [C, S] = series(body1.moving(), body2.moving());
    const auto [C_eta, S_eta] = series(body1.displaced(), body2.displaced());
    const T D = C.c[0] * C.c[0] + S.c[0] * S.c[0];
    T angle = atan2_of(S.c[0], C.c[0]);
    const double turn = 2 * std::acos(-1.0);
    angle += turn * std::round((kReference - std::real(angle)) / turn);
    const T rate = (C.c[0] * S.c[1] - S.c[0] * C.c[1]) / D, change = (C.c[0] * S_eta.c[1] - S.c[0] * C_eta.c[1]) / D;
    return -L::value(at, kLaw, angle, rate) * change;
  }
  Loads loads() const {
    LawScratch<L> s(force.law, x, kLaw);
    Loads out;
    force.add_load(kTime, s.rho, kReference, f1, f2, s.scratch, out.load1, out.load2);
    return out;
  }
  void pull_back(FrameBar& bar1, FrameBar& bar2, VectorXd& theta_bar, VectorXd& rho_bar) const {
    LawScratch<L> s(force.law, x, kLaw);
    force.pull_back(kTime, s.rho, kReference, f1, f2, s.scratch, bar1, bar2, theta_bar, rho_bar);
  }
  LoadTangents tangent(const FrameTangent& t1, const FrameTangent& t2, const Eigen::MatrixXd& directions) const {
    LawScratch<L> s(force.law, x, kLaw);
    const double angle = force.joint.value_near(kReference, f1, f2), rate = force.joint.rate(f1, f2);
    const Law::Value f = force.law.derivatives(kTime, s.rho, angle, rate, s.scratch);
    Lanes<L::ForceLaw::kFields> fields = Lanes<L::ForceLaw::kFields>::Zero();
    if (L::kFields > 0) fields = directions.middleRows(kLaw, L::ForceLaw::kFields);
    const Lanes<1> df = force.law.field_tangent(
        angle, rate, &fields, [&](int k) { return Lanes<1>(directions.row(kLaw + k)); }, s.scratch);
    const Lanes<3> dx = directions.middleRows<3>(28), dy = directions.middleRows<3>(31),
                   dn = directions.middleRows<3>(34);
    LoadTangents out;
    force.tangent(f, df, f1, f2, t1, t2, {&dx, &dn, &dy}, out.load1, out.load2);
    return out;
  }
};

// acos near its real value, as atan2 above.
double acos_of(double c) { return std::acos(c); }
Complex acos_of(const Complex& c) { return {std::acos(c.real()), -c.imag() / std::sqrt(1 - c.real() * c.real())}; }

// Geometry: the points and R0, row by row; fields: K, C, Kt, Ct.
struct BushingCase : Bodies {
  static constexpr int kGeometry = 15, kLaw = 28 + kGeometry, kFields = 12, kParameters = 0, kInputs = kLaw + kFields;
  Bushing force;

  // Some tens of degrees from rest, the Euler parameters and R0 a little off their manifolds.
  explicit BushingCase(unsigned seed) : Bodies(seed, kInputs) {
    Random random(seed + 50);
    for (const int first : {3, 17}) x.segment<4>(first) *= (1 + 0.01 * random()) / x.segment<4>(first).norm();
    const Eigen::AngleAxisd turn(0.4 + 0.2 * seed, Vector3d(random.vector(3)).normalized());
    const Matrix3d R0 = turn.matrix() * A(x.segment<4>(3)).transpose() * A(x.segment<4>(17));
    for (int i = 0; i < 3; ++i) x.segment<3>(34 + 3 * i) = R0.row(i).transpose() + 0.01 * random.vector(3);
    place();
  }
  void place() {
    Bodies::place();
    force.s1 = x.segment<3>(28), force.s2 = x.segment<3>(31);
    for (int i = 0; i < 3; ++i) force.R0.row(i) = x.segment<3>(34 + 3 * i).transpose();
    force.K = x.segment<3>(kLaw), force.C = x.segment<3>(kLaw + 3);
    force.Kt = x.segment<3>(kLaw + 6), force.Ct = x.segment<3>(kLaw + 9);
    force.slot1 = 0, force.slot2 = 3, force.slot_R0 = 6, force.slot_law = 15;
  }

  // Deflection and rotation vector along a motion or a virtual displacement, with their first derivatives.
  template <class T>
  struct Deflection {
    V3<T> d, d_dot, theta, theta_dot;
  };
  template <class T, class F>
  static Deflection<T> deflection(const std::vector<T>& at, const F& f1, const F& f2) {
    const auto D = f2.point(constant(part<3>(at, 31))) - f1.point(constant(part<3>(at, 28)));
    const auto d = transposed_times(f1.A, D);
    M3<Series<T>> R;  // A1'A2 R0'
    for (std::size_t i = 0; i < 3; ++i) {
      const auto turned = times(f2.A, constant(part<3>(at, 34 + 3 * i)));
      const auto column = transposed_times(f1.A, turned);
      for (std::size_t k = 0; k < 3; ++k) R[k][i] = column[k];
    }
    const Series<T> half(T(0.5));
    const Series<T> c = half * (R[0][0] + R[1][1] + R[2][2] - Series<T>(T(1)));
    const V3<Series<T>> a{half * (R[2][1] - R[1][2]), half * (R[0][2] - R[2][0]), half * (R[1][0] - R[0][1])};
    using std::sqrt;
    const T sine2 = T(1) - c.c[0] * c.c[0], g = acos_of(c.c[0]) / sqrt(sine2), g_c = (c.c[0] * g - T(1)) / sine2;
    const Series<T> factor(g, g_c * c.c[1]);
    Deflection<T> out;
    for (std::size_t i = 0; i < 3; ++i) {
      const Series<T> theta = factor * a[i];
      out.d[i] = d[i].c[0], out.d_dot[i] = d[i].c[1], out.theta[i] = theta.c[0], out.theta_dot[i] = theta.c[1];
    }
    return out;
  }
  template <class T>
  T work(const std::vector<T>& at) const {
    const TextbookBody<T> body1 = textbook(at, 0), body2 = textbook(at, 14);
    const Deflection<T> now = deflection(at, body1.moving(), body2.moving());
    const Deflection<T> change = deflection(at, body1.displaced(), body2.displaced());
    T sum(0);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t k = static_cast<std::size_t>(kLaw) + i;
      sum -= (at[k] * now.d[i] + at[k + 3] * now.d_dot[i]) * change.d_dot[i];
      sum -= (at[k + 6] * now.theta[i] + at[k + 9] * now.theta_dot[i]) * change.theta_dot[i];
    }
    return sum;
  }
  template <class T>
  T potential(const std::vector<T>& at) const {
    const Deflection<T> now = deflection(at, textbook(at, 0).moving(), textbook(at, 14).moving());
    T sum(0);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t k = static_cast<std::size_t>(kLaw) + i;
      sum += T(0.5) * (at[k] * now.d[i] * now.d[i] + at[k + 6] * now.theta[i] * now.theta[i]);
    }
    return sum;
  }
  Loads loads() const {
    Loads out;
    force.add_load(f1, f2, out.load1, out.load2);
    return out;
  }
  void pull_back(FrameBar& bar1, FrameBar& bar2, VectorXd& theta_bar, VectorXd&) const {
    force.pull_back(f1, f2, bar1, bar2, theta_bar);
  }
  LoadTangents tangent(const FrameTangent& t1, const FrameTangent& t2, const Eigen::MatrixXd& directions) const {
    const Lanes<3> s1 = directions.middleRows<3>(28), s2 = directions.middleRows<3>(31);
    const Lanes<9> R0 = directions.middleRows<9>(34);
    const Lanes<12> law = directions.middleRows<12>(kLaw);
    LoadTangents out;
    force.tangent(f1, f2, t1, t2, {&s1, &s2, &R0, &law}, out.load1, out.load2);
    return out;
  }
};

// Friction along an axis of body 1; geometry: the two points and the axis.
struct SlidingCase : Bodies {
  static constexpr int kGeometry = 9, kLaw = 28 + kGeometry, kFields = 3, kParameters = 0, kInputs = kLaw + kFields;
  SlidingFriction force;

  explicit SlidingCase(unsigned seed) : Bodies(seed, kInputs) { place(); }
  void place() {
    Bodies::place();
    JointDisplacement& joint = force.joint;
    joint.measure.s1 = x.segment<3>(28), joint.measure.s2 = x.segment<3>(31), joint.measure.s3 = x.segment<3>(34);
    joint.slot1 = 0, joint.slot2 = 3, joint.slot3 = 6;
    DryFriction::fill(force.law, x, kLaw, kGeometry);
  }
  template <class T>
  T work(const std::vector<T>& at) const {
    const TextbookBody<T> body1 = textbook(at, 0), body2 = textbook(at, 14);
    auto displacement = [&](const auto& g1, const auto& g2) {
      const auto d = g2.point(constant(part<3>(at, 31))) - g1.point(constant(part<3>(at, 28)));
      return dot(times(g1.A, constant(part<3>(at, 34))), d);
    };
    const T rate = displacement(body1.moving(), body2.moving()).c[1];
    return -DryFriction::value(at, kLaw, rate, rate) * displacement(body1.displaced(), body2.displaced()).c[1];
  }
  Loads loads() const {
    LawScratch<DryFriction> s(force.law, x, kLaw);
    Loads out;
    force.add_load(kTime, s.rho, 0, f1, f2, s.scratch, out.load1, out.load2);
    return out;
  }
  void pull_back(FrameBar& bar1, FrameBar& bar2, VectorXd& theta_bar, VectorXd& rho_bar) const {
    LawScratch<DryFriction> s(force.law, x, kLaw);
    force.pull_back(kTime, s.rho, 0, f1, f2, s.scratch, bar1, bar2, theta_bar, rho_bar);
  }
  LoadTangents tangent(const FrameTangent& t1, const FrameTangent& t2, const Eigen::MatrixXd& directions) const {
    LawScratch<DryFriction> s(force.law, x, kLaw);
    const double displacement = force.joint.value(f1, f2), rate = force.joint.rate(f1, f2);
    const Law::Value f = force.law.derivatives(kTime, s.rho, displacement, rate, s.scratch);
    const Lanes<3> s1 = directions.middleRows<3>(28), s2 = directions.middleRows<3>(31),
                   s3 = directions.middleRows<3>(34), law = directions.middleRows<3>(kLaw);
    const Lanes<1> df =
        force.law.field_tangent(displacement, rate, &law, [](int) { return Lanes<1>(Lanes<1>::Zero()); }, s.scratch);
    LoadTangents out;
    force.tangent(f, df, f1, f2, t1, t2, {&s1, &s2, &s3}, out.load1, out.load2);
    return out;
  }
};

// On body 1: geometry: the point; parameters: the components.
template <bool kTorque, bool kBodyAxes>
struct AppliedCase : Bodies {
  static constexpr int kGeometry = 3, kLaw = 28 + kGeometry, kFields = 0, kParameters = 3, kInputs = kLaw + 3;
  AppliedForce force;

  explicit AppliedCase(unsigned seed) : Bodies(seed, kInputs) { place(); }
  void place() {
    Bodies::place();
    force.is_torque = kTorque, force.in_body_axes = kBodyAxes;
    force.s = x.segment<3>(28), force.slot = 0;
  }
  Vector3d c() const { return x.segment<3>(kLaw); }

  template <class T>
  T work(const std::vector<T>& at) const {
    const TextbookBody<T> body = textbook(at, 0);
    const M3<T> rotation = body.frame().A;
    V3<T> load = part<3>(at, kLaw);
    if (kTorque) {
      if (!kBodyAxes) load = transposed_times(rotation, load);
      return dot(load, V3<T>{T(eta1(3)), T(eta1(4)), T(eta1(5))});
    }
    if (kBodyAxes) load = times(rotation, load);
    const auto change = body.displaced().point(constant(part<3>(at, 28)));
    return dot(load, V3<T>{change[0].c[1], change[1].c[1], change[2].c[1]});
  }
  Loads loads() const {
    Loads out;
    force.add_load(c(), f1, out.load1);
    return out;
  }
  void pull_back(FrameBar& bar1, FrameBar&, VectorXd& theta_bar, VectorXd& rho_bar) const {
    rho_bar += force.pull_back(c(), f1, bar1, theta_bar);
  }
  LoadTangents tangent(const FrameTangent& t1, const FrameTangent&, const Eigen::MatrixXd& directions) const {
    const Lanes<3> ds = directions.middleRows<3>(28), dc = directions.middleRows<3>(kLaw);
    LoadTangents out;
    force.tangent(c(), dc, f1, t1, &ds, out.load1);
    return out;
  }
};

template <class C>
C moved(const C& c, const VectorXd& to) {
  C other = c;
  other.x = to;
  other.place();
  return other;
}

template <class X, class Y>
double distance(const X& x, const Y& y) {
  return (x - y).cwiseAbs().template maxCoeff<Eigen::PropagateNaN>();
}

// (rdot, omega_B) as a virtual displacement: what multiplies loads to power. Needs p'pdot = 0.
Vec<6> rigid_velocity(const BodyState& b, const Frame& f) {
  Vec<6> eta;
  eta << f.rdot, b.omega() / b.p.squaredNorm();
  return eta;
}

}  // namespace

TEMPLATE_TEST_CASE("a force's loads do its virtual work", "[force]", ALL_FORCES) {
  TestType c(GENERATE(range(0u, 8u)));
  const Loads found = c.loads();
  const std::vector<double> at(c.x.data(), c.x.data() + c.x.size());
  CHECK(found.load1.dot(c.eta1) + found.load2.dot(c.eta2) == Approx(c.work(at)).margin(1e-11));
}

TEMPLATE_TEST_CASE("a force's pull-back is the gradient of its virtual work", "[force]", ALL_FORCES) {
  const TestType c(GENERATE(range(0u, 8u)));
  FrameBar bar1, bar2;
  bar1.set_zero(), bar2.set_zero();
  constexpr int fields = TestType::kGeometry + TestType::kFields;
  VectorXd theta_bar = VectorXd::Zero(fields), rho_bar = VectorXd::Zero(TestType::kParameters);
  c.pull_back(bar1, bar2, theta_bar, rho_bar);
  VectorXd found = VectorXd::Zero(TestType::kInputs);
  add_pull_back(c.b1, bar1, Vector4d::Zero(), c.eta1.template tail<3>(), found.segment<7>(0), found.segment<7>(7));
  add_pull_back(c.b2, bar2, Vector4d::Zero(), c.eta2.template tail<3>(), found.segment<7>(14), found.segment<7>(21));
  found.segment(28, fields) = theta_bar;
  found.tail(rho_bar.size()) = rho_bar;
  const VectorXd complex_step = complex_gradient([&](const std::vector<Complex>& at) { return c.work(at); }, c.x);
  const VectorXd differences = difference_gradient(
      [&](const VectorXd& at) {
        const Loads l = moved(c, at).loads();
        return l.load1.dot(c.eta1) + l.load2.dot(c.eta2);
      },
      c.x, 1e-4);
  const double size = 1 + found.template lpNorm<Eigen::Infinity>();
  CHECK(distance(found, complex_step) < 1e-11 * size);
  CHECK(distance(found, differences) < 1e-7 * size);
}

TEMPLATE_TEST_CASE("a force's tangent is the derivative of its loads along any direction", "[force]", ALL_FORCES) {
  const unsigned seed = GENERATE(range(0u, 8u));
  const TestType c(seed);
  Random random(seed + 100);
  const Eigen::MatrixXd directions = random.vector(TestType::kInputs * kLanes).reshaped(TestType::kInputs, kLanes);
  FrameTangent t1, t2;
  set_tangent(c.b1, directions.middleRows<7>(0), directions.middleRows<7>(7), t1);
  set_tangent(c.b2, directions.middleRows<7>(14), directions.middleRows<7>(21), t2);
  const LoadTangents found = c.tangent(t1, t2, directions);
  for (int lane = 0; lane < kLanes; ++lane) {
    for (int i = 0; i < 12; ++i) {
      TestType unit = c;
      unit.eta1 = Vec<12>::Unit(i).head<6>(), unit.eta2 = Vec<12>::Unit(i).tail<6>();
      const double expected = complex_derivative([&](const std::vector<Complex>& at) { return unit.work(at); }, c.x,
                                                 VectorXd(directions.col(lane)));
      const double entry = i < 6 ? found.load1(i, lane) : found.load2(i - 6, lane);
      CHECK(entry == Approx(expected).margin(1e-11).epsilon(1e-10));
    }
  }
}

TEMPLATE_TEST_CASE("forces between two bodies balance: no resultant, no moment", "[force]", BETWEEN_BODIES) {
  TestType c(GENERATE(range(0u, 4u)));
  c.x.template segment<4>(3).normalize();
  c.x.template segment<4>(17).normalize();
  if constexpr (requires { c.kReference; }) {  // a joint angle: a common axis
    const Vector3d axis = Vector3d(c.x.template segment<3>(28)).normalized();
    const Vector3d x1 = axis.unitOrthogonal(), y1 = axis.cross(x1);
    c.x.template segment<3>(28) = x1, c.x.template segment<3>(31) = y1;
    const Matrix3d A1 = A(c.x.template segment<4>(3)), A2 = A(c.x.template segment<4>(17));
    c.x.template segment<3>(34) = A2.transpose() * A1 * (std::cos(0.3) * x1 + std::sin(0.3) * y1);
  }
  c.place();
  const Loads l = c.loads();
  const Vector3d F = l.load1.template head<3>() + l.load2.template head<3>();
  const Vector3d M = c.f1.r.cross(Vector3d(l.load1.template head<3>())) +
                     c.f2.r.cross(Vector3d(l.load2.template head<3>())) + c.f1.A * l.load1.template tail<3>() +
                     c.f2.A * l.load2.template tail<3>();
  CHECK(F.norm() < 1e-12);
  CHECK(M.norm() < 1e-11);
  CHECK(l.load1.norm() > 1e-6);
}

TEST_CASE("a spring without damping is the gradient of its potential", "[force]") {
  const unsigned seed = GENERATE(range(0u, 4u));
  auto check = [](auto c, auto stretch_squared) {
    c.x(c.kLaw + 1) = 0, c.x(c.kLaw + 3) = 0;
    c.place();
    const Loads l = c.loads();
    // Along q' = (eta_r, 1/2 G'eta_theta) the potential 1/2 k stretch^2 falls by the work of the loads.
    VectorXd direction = VectorXd::Zero(c.x.size());
    direction.segment(0, 3) = c.eta1.template head<3>();
    direction.segment(3, 4) = 0.5 * G_transposed_times(c.b1.p, c.eta1.template tail<3>());
    direction.segment(14, 3) = c.eta2.template head<3>();
    direction.segment(17, 4) = 0.5 * G_transposed_times(c.b2.p, c.eta2.template tail<3>());
    auto potential = [&](const VectorXd& at) { return 0.5 * at(c.kLaw) * stretch_squared(moved(c, at)); };
    auto slope = [&](double h) { return (potential(c.x + h * direction) - potential(c.x - h * direction)) / (2 * h); };
    const double change = (4 * slope(5e-4) - slope(1e-3)) / 3;
    CHECK(l.load1.dot(c.eta1) + l.load2.dot(c.eta2) == Approx(-change).epsilon(1e-8).margin(1e-8));
  };
  check(TsdaCase<LinearLaw>(seed), [](const TsdaCase<LinearLaw>& c) {
    const double s = c.force.span(c.f1, c.f2).l - c.force.law.x0;
    return s * s;
  });
  check(RsdaCase<LinearLaw>(seed), [](const RsdaCase<LinearLaw>& c) {
    const double s = c.force.joint.value_near(c.kReference, c.f1, c.f2) - c.force.law.x0;
    return s * s;
  });
}

TEST_CASE("power of a spring-damper is minus its force times its rate", "[force]") {
  const unsigned seed = GENERATE(range(0u, 4u));
  auto check = [](auto c, auto power) {
    for (const int first : {0, 14}) {  // p'pdot = 0
      const Vector4d p = c.x.template segment<4>(first + 3);
      const Vector4d pdot = c.x.template segment<4>(first + 10);
      c.x.template segment<4>(first + 10) = pdot - p * p.dot(pdot) / p.squaredNorm();
    }
    c.place();
    const Loads l = c.loads();
    CHECK(l.load1.dot(rigid_velocity(c.b1, c.f1)) + l.load2.dot(rigid_velocity(c.b2, c.f2)) ==
          Approx(power(c)).margin(1e-11));
  };
  check(TsdaCase<LinearLaw>(seed), [](const TsdaCase<LinearLaw>& c) {
    const auto s = c.force.span(c.f1, c.f2);
    const Law& law = c.force.law;
    return -(law.k * (s.l - law.x0) + law.c * s.ldot + law.f0) * s.ldot;
  });
  check(RsdaCase<LinearLaw>(seed), [](const RsdaCase<LinearLaw>& c) {
    const Law& law = c.force.law;
    const double angle = c.force.joint.value_near(c.kReference, c.f1, c.f2), rate = c.force.joint.rate(c.f1, c.f2);
    return -(law.k * (angle - law.x0) + law.c * rate + law.f0) * rate;
  });
}

TEST_CASE("a bushing without damping is the gradient of its potential, and that has its own gradient", "[force]") {
  BushingCase c(GENERATE(range(0u, 6u)));
  c.x.segment<3>(c.kLaw + 3).setZero(), c.x.segment<3>(c.kLaw + 9).setZero();
  c.place();
  const std::vector<double> at(c.x.data(), c.x.data() + c.x.size());
  CHECK(c.force.potential(c.f1, c.f2) == Approx(c.potential(at)).epsilon(1e-12));

  FrameBar bar1, bar2;
  bar1.set_zero(), bar2.set_zero();
  Bushing::SlotBars slots;
  c.force.pull_back_potential(c.f1, c.f2, bar1, bar2, slots);
  VectorXd found = VectorXd::Zero(c.kInputs);
  found.segment<7>(0) = pull_back_position(c.b1, bar1), found.segment<7>(14) = pull_back_position(c.b2, bar2);
  found.segment<3>(28) = slots.s1, found.segment<3>(31) = slots.s2;
  found.segment<9>(34) = slots.R0, found.segment<12>(c.kLaw) = slots.law;
  const VectorXd expected = complex_gradient([&](const std::vector<Complex>& x) { return c.potential(x); }, c.x);
  CHECK(distance(found, expected) < 1e-12 * (1 + expected.lpNorm<Eigen::Infinity>()));

  const Loads l = c.loads();  // along q' = (eta_r, 1/2 G'eta_theta)
  VectorXd direction = VectorXd::Zero(c.kInputs);
  direction.segment<3>(0) = c.eta1.head<3>(), direction.segment<3>(14) = c.eta2.head<3>();
  direction.segment<4>(3) = 0.5 * G_transposed_times(c.b1.p, c.eta1.tail<3>());
  direction.segment<4>(17) = 0.5 * G_transposed_times(c.b2.p, c.eta2.tail<3>());
  CHECK(l.load1.dot(c.eta1) + l.load2.dot(c.eta2) == Approx(-expected.dot(direction)).epsilon(1e-12));
}

TEST_CASE("a bushing measures the rotation vector at any angle below half a turn, smoothly at rest", "[force]") {
  const double angle = GENERATE(0.0, 1e-12, 1e-8, 1e-4, 0.1, 0.7, 0.7227, 0.7228, 1.5, 2.8, 3.1);
  const Vector3d axis = Vector3d(1, -2, 0.5).normalized();
  Bushing bushing;
  bushing.Kt = Vector3d(3, 5, 7);
  Frame f1, f2;
  f1.A = Eigen::AngleAxisd(1.1, Vector3d(0.3, 1, -1).normalized()).matrix();
  f2.A = f1.A * Eigen::AngleAxisd(angle, axis).matrix();
  const Vector3d theta = angle * axis;
  CHECK(bushing.potential(f1, f2) ==
        Approx(0.5 * theta.dot(bushing.Kt.cwiseProduct(theta))).epsilon(1e-9).margin(1e-26));
  Vec<6> load1 = Vec<6>::Zero(), load2 = Vec<6>::Zero();
  bushing.add_load(f1, f2, load1, load2);
  // Of equal stiffnesses the torque is that of the axis; of these it is so to first order in the angle.
  Bushing uniform;
  uniform.Kt.setConstant(4);
  Vec<6> one = Vec<6>::Zero(), two = Vec<6>::Zero();
  uniform.add_load(f1, f2, one, two);
  CHECK((two.tail<3>() + 4 * theta).norm() <= 1e-11 * (1 + angle / (3.1416 - angle)));
  CHECK((one.tail<3>() - 4 * theta).norm() <= 1e-11 * (1 + angle / (3.1416 - angle)));
  if (angle < 1e-3) CHECK((load2.tail<3>() + bushing.Kt.cwiseProduct(theta)).norm() <= 10 * angle * angle + 1e-15);
}

TEST_CASE("friction resists the motion at its level, smoothly through rest", "[force]") {
  FrictionLaw law;
  law.coulomb = 2, law.smooth = 0.01, law.viscous = 0.5;
  Law::Scratch scratch;
  auto torque = [&](double rate) { return law.value(0, VectorXd(), 0, rate, scratch); };
  CHECK(torque(0) == 0);
  CHECK(torque(0.01) == Approx(2 / std::sqrt(2.0) + 0.005));
  CHECK(torque(5) == Approx(2 + 2.5).epsilon(1e-5));
  CHECK(torque(-5) == -torque(5));
  CHECK(law.derivatives(0, VectorXd(), 0, 0, scratch).f_xdot == Approx(2 / 0.01 + 0.5));
}

TEST_CASE("a force at a point gives its moment about the centre of mass", "[force]") {
  AppliedForce force;
  force.s = Vector3d(0.5, 0, 0);
  Frame frame;
  frame.A = Eigen::AngleAxisd(std::acos(-1.0) / 2, Vector3d::UnitZ()).matrix();  // the point is at (0, 0.5, 0)
  Vec<6> global = Vec<6>::Zero(), in_body = Vec<6>::Zero(), expected;
  force.add_load({3, 0, 0}, frame, global);
  expected << 3, 0, 0, 0, 0, -1.5;
  CHECK((global - expected).norm() < 1e-15);
  force.in_body_axes = true;
  force.add_load({0, 2, 0}, frame, in_body);
  expected << -2, 0, 0, 0, 0, 1;
  CHECK((in_body - expected).norm() < 1e-15);
}

TEST_CASE("tension is positive when it pulls the points together", "[force]") {
  TsdaForce spring;
  spring.s1.setZero(), spring.s2.setZero();
  spring.law.k = 10, spring.law.x0 = 0.5;
  Frame ground, other;
  other.r = Vector3d(2, 0, 0);
  Law::Scratch scratch;
  Vec<6> load1 = Vec<6>::Zero(), load2 = Vec<6>::Zero();
  spring.add_load(0, VectorXd(), ground, other, scratch, load1, load2);
  CHECK(load1(0) == Approx(15));
  CHECK(load2(0) == Approx(-15));
}

TEST_CASE("a positive torsional torque resists a positive angle", "[force]") {
  RsdaForce spring;
  Angle& angle = spring.joint.measure;
  angle.s1 = Vector3d::UnitX(), angle.s3 = Vector3d::UnitY(), angle.s2 = Vector3d::UnitX();
  spring.law.k = 4, spring.law.x0 = 0.1;
  Frame ground, other;
  other.A = A(Vector4d(std::cos(0.3), 0, 0, std::sin(0.3)));  // 0.6 rad about z
  Law::Scratch scratch;
  Vec<6> load1 = Vec<6>::Zero(), load2 = Vec<6>::Zero();
  spring.add_load(0, VectorXd(), 0, ground, other, scratch, load1, load2);
  CHECK(load2(5) == Approx(-2));
  CHECK(load1(5) == Approx(2));
}

TEST_CASE("a spring of zero length has no direction, no force, and finite derivatives", "[force]") {
  TsdaCase<LinearLaw> c(3);
  TsdaForce& force = c.force;
  // Both points at the origin of a body: the difference is zero exactly.
  c.f1.r.setZero(), c.f2.r.setZero();
  force.s1.setZero(), force.s2.setZero();
  REQUIRE(force.span(c.f1, c.f2).l == 0);
  const Loads l = c.loads();
  CHECK(l.load1.norm() == 0);
  CHECK(l.load2.norm() == 0);
  FrameBar bar1, bar2;
  bar1.set_zero(), bar2.set_zero();
  VectorXd theta_bar = VectorXd::Zero(10), rho_bar;
  c.pull_back(bar1, bar2, theta_bar, rho_bar);
  CHECK(bar1.r.allFinite());
  CHECK(theta_bar.allFinite());
}
