// One harness for every constraint primitive: all that it offers is checked against its equation written once more, for
// any scalar (complex step and power series), and against central differences of its own values. A new primitive is
// tested by its equation in Textbook and its name in the list of types below.
#include <catch2/catch.hpp>

#include "core/constraint/constraint.hpp"
#include "tests/core/body/textbook_body.hpp"

#define ALL_PRIMITIVES Coincidence, Dot1, Dot2, Distance, Angle, Coordinate

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

template <class T>
struct Vectors {
  V3<T> s1, s2, s3;
};

template <class P>
struct Textbook;

template <>
struct Textbook<Coincidence> {
  template <class T>
  static std::array<T, 3> phi(const TextbookFrame<T>& f1, const TextbookFrame<T>& f2, const Vectors<T>& s) {
    return f2.point(s.s2) - f1.point(s.s1);
  }
};
template <>
struct Textbook<Dot1> {
  template <class T>
  static std::array<T, 1> phi(const TextbookFrame<T>& f1, const TextbookFrame<T>& f2, const Vectors<T>& s) {
    return {dot(times(f1.A, s.s1), times(f2.A, s.s2))};
  }
};
template <>
struct Textbook<Dot2> {
  template <class T>
  static std::array<T, 1> phi(const TextbookFrame<T>& f1, const TextbookFrame<T>& f2, const Vectors<T>& s) {
    return {dot(times(f1.A, s.s3), f2.point(s.s2) - f1.point(s.s1))};
  }
};
template <>
struct Textbook<Distance> {
  template <class T>
  static std::array<T, 1> phi(const TextbookFrame<T>& f1, const TextbookFrame<T>& f2, const Vectors<T>& s) {
    const V3<T> d = f2.point(s.s2) - f1.point(s.s1);
    return {sqrt(dot(d, d))};
  }
};
template <>
struct Textbook<Angle> {
  template <class T>
  static std::array<T, 1> phi(const TextbookFrame<T>& f1, const TextbookFrame<T>& f2, const Vectors<T>& s) {
    const V3<T> n2 = times(f2.A, s.s2);
    return {atan2(dot(times(f1.A, s.s3), n2), dot(times(f1.A, s.s1), n2))};
  }
};
template <>
struct Textbook<Coordinate> {
  template <class T>
  static std::array<T, 1> phi(const TextbookFrame<T>&, const TextbookFrame<T>& f2, const Vectors<T>&) {
    return {f2.p[2]};
  }
};

// Two bodies anywhere (Euler parameters not of unit length), moving, accelerated and displaced.
//   x = (q1, v1, q2, v2, s1, s2, s3): all that derivatives are taken in
template <class P>
struct Case {
  static constexpr int m = P::kRows;
  P primitive;
  VectorXd x;
  Vec<6> z1, z2, eta1, eta2;
  Multipliers<m> weights;
  Frame f1, f2;

  explicit Case(unsigned seed) {
    Random random(seed);
    x = random.vector(37);
    z1 = random.vector(6), z2 = random.vector(6), eta1 = random.vector(6), eta2 = random.vector(6);
    weights = {random.vector(m), random.vector(m), random.vector(m), random.vector(m)};
    place(x);
  }
  void place(const VectorXd& at) {
    if constexpr (requires { primitive.s1; }) primitive.s1 = at.segment<3>(28), primitive.s2 = at.segment<3>(31);
    if constexpr (requires { primitive.s3; }) primitive.s3 = at.segment<3>(34);
    if constexpr (std::is_same_v<P, Coordinate>) primitive.index = 5;
    set(at, 0, z1, eta1, f1);
    set(at, 14, z2, eta2, f2);
  }

  // Phi, Phidot, Phiddot and J eta by power series.
  template <class T>
  struct Values {
    std::array<T, static_cast<std::size_t>(m)> phi, phi_dot, phi_ddot, change;
  };
  template <class T>
  Values<T> textbook(const std::vector<T>& at) const {
    const TextbookBody<T> body1 = textbook_body(at, 0, z1, eta1), body2 = textbook_body(at, 14, z2, eta2);
    const Vectors<Series<T>> s{constant(part<3>(at, 28)), constant(part<3>(at, 31)), constant(part<3>(at, 34))};
    const auto moving = Textbook<P>::phi(body1.moving(), body2.moving(), s);
    const auto displaced = Textbook<P>::phi(body1.displaced(), body2.displaced(), s);
    Values<T> values;
    for (std::size_t i = 0; i < values.phi.size(); ++i) {
      values.phi[i] = moving[i].c[0];
      values.phi_dot[i] = moving[i].c[1];
      values.phi_ddot[i] = T(2) * moving[i].c[2];
      values.change[i] = displaced[i].c[1];
    }
    return values;
  }
  std::vector<double> numbers() const { return {x.data(), x.data() + x.size()}; }

  // lambda'(J1 eta1 + J2 eta2) + mu0'Phi + mu1'Phidot + mu2'Phiddot
  template <class T>
  T weighted(const std::vector<T>& at) const {
    const Values<T> values = textbook(at);
    T sum(0);
    for (std::size_t i = 0; i < values.phi.size(); ++i) {
      const Eigen::Index row = static_cast<Eigen::Index>(i);
      sum += weights.lambda(row) * values.change[i] + weights.mu0(row) * values.phi[i] +
             weights.mu1(row) * values.phi_dot[i] + weights.mu2(row) * values.phi_ddot[i];
    }
    return sum;
  }
  // The same from the primitive's own functions.
  double own_weighted(const VectorXd& at) const {
    Case moved = *this;
    moved.place(at);
    Vec<m> phi, phi_dot, phi_ddot;
    Mat<m, 6> J1, J2;
    moved.primitive.phi(moved.f1, moved.f2, phi);
    moved.primitive.phi_dot(moved.f1, moved.f2, phi_dot);
    moved.primitive.phi_ddot(moved.f1, moved.f2, phi_ddot);
    moved.primitive.jacobian(moved.f1, moved.f2, J1, J2);
    return weights.lambda.dot(J1 * eta1 + J2 * eta2) + weights.mu0.dot(phi) + weights.mu1.dot(phi_dot) +
           weights.mu2.dot(phi_ddot);
  }
  // Its gradient in x by pull_back.
  VectorXd pulled_back(const Multipliers<m>& w) const {
    FrameBar bar1, bar2;
    bar1.set_zero(), bar2.set_zero();
    GeometryBar s;
    primitive.pull_back(f1, f2, w, bar1, bar2, s);
    VectorXd g = VectorXd::Zero(37);
    add_pull_back(f1, bar1, Vector4d::Zero(), eta1.template tail<3>(), g.segment<7>(0), g.segment<7>(7));
    add_pull_back(f2, bar2, Vector4d::Zero(), eta2.template tail<3>(), g.segment<7>(14), g.segment<7>(21));
    g.segment<3>(28) = s.s1, g.segment<3>(31) = s.s2, g.segment<3>(34) = s.s3;
    return g;
  }

 private:
  static void set(const VectorXd& at, int first, const Vec<6>& z, const Vec<6>& eta, Frame& f) {
    set_position(at.segment<7>(first), f);
    set_velocity(at.segment<7>(first + 7), f);
    set_acceleration(z, f);
    set_virtual(eta, f);
  }
  template <class T>
  static TextbookBody<T> textbook_body(const std::vector<T>& at, std::size_t first, const Vec<6>& z,
                                       const Vec<6>& eta) {
    TextbookBody<T> body{part<7>(at, first), part<7>(at, first + 7)};
    for (std::size_t i = 0; i < 6; ++i) {
      body.z[i] = z(static_cast<Eigen::Index>(i)), body.eta[i] = eta(static_cast<Eigen::Index>(i));
    }
    return body;
  }
};

constexpr double kExact = 1e-11;      // complex step against hand-derived: rounding of sums of terms up to 1e3
constexpr double kDifference = 1e-8;  // central differences of polynomials, extrapolated: rounding over the step

}  // namespace

TEMPLATE_TEST_CASE("a primitive's values are those of its equation along the motion", "[constraint]", ALL_PRIMITIVES) {
  const Case<TestType> c(GENERATE(range(0u, 8u)));
  constexpr int m = TestType::kRows;
  const auto expected = c.textbook(c.numbers());
  Vec<m> phi, phi_dot, phi_ddot;
  Mat<m, 6> J1 = Mat<m, 6>::Constant(NAN), J2 = J1;
  c.primitive.phi(c.f1, c.f2, phi);
  c.primitive.phi_dot(c.f1, c.f2, phi_dot);
  c.primitive.phi_ddot(c.f1, c.f2, phi_ddot);
  c.primitive.jacobian(c.f1, c.f2, J1, J2);
  const Vec<m> change = J1 * c.eta1 + J2 * c.eta2;
  for (int i = 0; i < m; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    CHECK(phi(i) == Approx(expected.phi[k]).margin(kExact));
    CHECK(phi_dot(i) == Approx(expected.phi_dot[k]).margin(kExact));
    CHECK(phi_ddot(i) == Approx(expected.phi_ddot[k]).margin(kExact));
    CHECK(change(i) == Approx(expected.change[k]).margin(kExact));
  }
}

TEMPLATE_TEST_CASE("a primitive's pull-back is the gradient of its weighted values", "[constraint]", ALL_PRIMITIVES) {
  const Case<TestType> c(GENERATE(range(0u, 8u)));
  const VectorXd found = c.pulled_back(c.weights);
  const VectorXd complex_step = complex_gradient([&](const std::vector<Complex>& at) { return c.weighted(at); }, c.x);
  const VectorXd differences = difference_gradient([&](const VectorXd& at) { return c.own_weighted(at); }, c.x);
  CHECK(distance(found, complex_step) < kExact * (1 + found.norm()));
  CHECK(distance(found, differences) < kDifference * (1 + found.norm()));
}

TEMPLATE_TEST_CASE("a primitive's pull-back of Phidot at unit velocities is the Hessian of Phi", "[constraint]",
                   ALL_PRIMITIVES) {
  const unsigned seed = GENERATE(range(0u, 4u));
  const Case<TestType> c(seed);
  constexpr int m = TestType::kRows;
  auto gradient_of_phi = [&](const VectorXd& at) {
    Case<TestType> moved = c;
    moved.place(at);
    return moved.pulled_back({Vec<m>::Zero(), c.weights.mu1, Vec<m>::Zero(), Vec<m>::Zero()});
  };
  for (const int j : {0, 3, 4, 6, 14, 17, 18, 20}) {  // coordinates of x that are positions
    INFO("coordinate " << j);
    Case<TestType> unit = c;
    VectorXd at = c.x;
    at.segment<7>(7).setZero(), at.segment<7>(21).setZero();
    at(j + 7) = 1;
    unit.place(at);
    VectorXd column = unit.pulled_back({Vec<m>::Zero(), Vec<m>::Zero(), c.weights.mu1, Vec<m>::Zero()});
    column.segment<7>(7).setZero(), column.segment<7>(21).setZero();
    auto slope = [&](double h) {
      VectorXd up = c.x, down = c.x;
      up(j) += h, down(j) -= h;
      return VectorXd((gradient_of_phi(up) - gradient_of_phi(down)) / (2 * h));
    };
    // Of the polynomials the gradient is at most quadratic in one coordinate: the central difference is exact.
    const VectorXd expected = (4 * slope(5e-4) - slope(1e-3)) / 3;
    const bool polynomial = !std::is_same_v<TestType, Distance> && !std::is_same_v<TestType, Angle>;
    CHECK(distance(column, expected) < (polynomial ? 1e-10 : kDifference) * (1 + column.norm()));
  }
}

TEMPLATE_TEST_CASE("a primitive's tangent is its derivative along any direction", "[constraint]", ALL_PRIMITIVES) {
  const unsigned seed = GENERATE(range(0u, 8u));
  const Case<TestType> c(seed);
  constexpr int m = TestType::kRows;
  Random random(seed + 100);
  const Eigen::MatrixXd directions = random.vector(37 * kLanes).reshaped(37, kLanes);
  FrameTangent t1, t2;
  set_tangent(c.f1, directions.middleRows<7>(0), directions.middleRows<7>(7), t1);
  set_tangent(c.f2, directions.middleRows<7>(14), directions.middleRows<7>(21), t2);
  const Lanes<3> s1 = directions.middleRows<3>(28), s2 = directions.middleRows<3>(31),
                 s3 = directions.middleRows<3>(34);
  const bool with_geometry = GENERATE(true, false);
  PrimitiveTangent<m> found;
  found.phi.setConstant(NAN), found.phi_dot.setConstant(NAN), found.phi_ddot.setConstant(NAN);
  found.load1.setConstant(NAN), found.load2.setConstant(NAN);
  c.primitive.tangent(c.f1, c.f2, t1, t2, with_geometry ? GeometryTangent{&s1, &s2, &s3} : GeometryTangent{},
                      c.weights.lambda, found);
  for (int lane = 0; lane < kLanes; ++lane) {
    VectorXd direction = directions.col(lane);
    if (!with_geometry) direction.tail(9).setZero();
    // Each entry is the derivative of the weighted sum for unit weights, or, for the loads, unit displacements.
    auto entry = [&](const Multipliers<m>& weights, const Vec<6>& eta1, const Vec<6>& eta2) {
      Case<TestType> unit = c;
      unit.weights = weights, unit.eta1 = eta1, unit.eta2 = eta2;
      return complex_derivative([&](const std::vector<Complex>& at) { return unit.weighted(at); }, c.x, direction);
    };
    const Vec<m> zero = Vec<m>::Zero();
    const Vec<6> none = Vec<6>::Zero();
    for (int i = 0; i < m; ++i) {
      const Vec<m> e = Vec<m>::Unit(i);
      CHECK(found.phi(i, lane) == Approx(entry({zero, e, zero, zero}, none, none)).margin(kExact));
      CHECK(found.phi_dot(i, lane) == Approx(entry({zero, zero, e, zero}, none, none)).margin(kExact));
      CHECK(found.phi_ddot(i, lane) == Approx(entry({zero, zero, zero, e}, none, none)).margin(10 * kExact));
    }
    for (int i = 0; i < 6; ++i) {
      const Multipliers<m> load{c.weights.lambda, zero, zero, zero};
      CHECK(found.load1(i, lane) == Approx(entry(load, Vec<6>::Unit(i), none)).margin(kExact));
      CHECK(found.load2(i, lane) == Approx(entry(load, none, Vec<6>::Unit(i))).margin(kExact));
    }
  }
}

TEMPLATE_TEST_CASE("the blocks of a primitive that sees only turning are its tangents in p and pdot", "[constraint]",
                   Coincidence, Dot1) {
  const unsigned seed = GENERATE(range(0u, 4u));
  const Case<TestType> c(seed);
  constexpr int m = TestType::kRows;
  TurningBlocks<m> found;
  c.primitive.turning_blocks(c.f1, c.f2, c.weights.lambda, found);
  UnitTangents u1, u2;
  set_unit_tangents(c.f1, u1), set_unit_tangents(c.f2, u2);
  const FrameTangent still = FrameTangent::zero();
  auto tangent = [&](const FrameTangent& t1, const FrameTangent& t2) {
    PrimitiveTangent<m> x;
    c.primitive.tangent(c.f1, c.f2, t1, t2, {}, c.weights.lambda, x);
    return x;
  };
  const PrimitiveTangent<m> p1 = tangent(u1.p, still), p2 = tangent(still, u2.p);
  CHECK(found.p1.isApprox(p1.phi_ddot, 1e-12));
  CHECK(found.p2.isApprox(p2.phi_ddot, 1e-12));
  CHECK(found.pdot1.isApprox(tangent(u1.pdot, still).phi_ddot, 1e-12));
  CHECK(found.pdot2.isApprox(tangent(still, u2.pdot).phi_ddot, 1e-12));
  CHECK((found.moment1_p1 - p1.load1.bottomRows(3)).norm() < 1e-12 * (1 + p1.load1.norm()));
  CHECK((found.moment1_p2 - p2.load1.bottomRows(3)).norm() < 1e-12 * (1 + p2.load1.norm()));
  CHECK((found.moment2_p1 - p1.load2.bottomRows(3)).norm() < 1e-12 * (1 + p1.load2.norm()));
  CHECK((found.moment2_p2 - p2.load2.bottomRows(3)).norm() < 1e-12 * (1 + p2.load2.norm()));
  // Nothing else moves them: r, rdot, and the forces.
  for (const FrameTangent* t : {&u1.r, &u1.rdot}) {
    const PrimitiveTangent<m> x = tangent(*t, still);
    CHECK(x.phi_ddot.norm() + x.load1.norm() + x.load2.norm() == 0);
  }
  CHECK(p1.load1.topRows(3).norm() + p1.load2.topRows(3).norm() + p2.load1.topRows(3).norm() == 0);
}
