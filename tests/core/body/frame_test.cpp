#include "core/body/frame.hpp"

#include <catch2/catch.hpp>

#include "tests/core/body/textbook_body.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

struct Moving {
  Frame frame;
  Vec<7> q, v;
  Vec<6> z, eta;
};

Moving moving(Random& random) {
  Moving b;
  b.q = random.vector(7), b.v = random.vector(7), b.z = random.vector(6), b.eta = random.vector(6);
  set_position(b.q, b.frame);
  set_velocity(b.v, b.frame);
  set_acceleration(b.z, b.frame);
  set_virtual(b.eta, b.frame);
  return b;
}

FrameBar random_bar(Random& random) {
  FrameBar bar;
  bar.r = random.vector(3), bar.rdot = random.vector(3);
  for (Matrix3d* M : {&bar.A, &bar.Adot, &bar.Addot, &bar.A_eta}) *M = random.vector(9).reshaped(3, 3);
  for (Vector4d* x : {&bar.p, &bar.pdot, &bar.pddot, &bar.p_eta}) *x = random.vector(4);
  return bar;
}

template <class T>
T inner(const Matrix3d& X, const M3<Series<T>>& A, std::size_t order) {
  T sum(0);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      sum += X(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) * A[i][j].c[order];
    }
  }
  return sum;
}

// <bar, frame> + w_p'pddot as a function of (q, v), z and eta held fixed.
template <class T>
T weighted_frame(const std::vector<T>& x, const Moving& b, const FrameBar& bar, const Vector4d& w_p) {
  TextbookBody<T> body{part<7>(x, 0), part<7>(x, 7)};
  for (std::size_t i = 0; i < 6; ++i) {
    body.z[i] = b.z(static_cast<Eigen::Index>(i));
    body.eta[i] = b.eta(static_cast<Eigen::Index>(i));
  }
  const TextbookFrame<Series<T>> f = body.moving(), displaced = body.displaced();
  T sum = inner(bar.A, f.A, 0) + inner(bar.Adot, f.A, 1) + T(2) * inner(bar.Addot, f.A, 2);
  sum += inner(bar.A_eta, displaced.A, 1);
  for (std::size_t i = 0; i < 3; ++i) {
    sum += bar.r(static_cast<Eigen::Index>(i)) * f.r[i].c[0] + bar.rdot(static_cast<Eigen::Index>(i)) * f.r[i].c[1];
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    sum += bar.p(k) * f.p[i].c[0] + bar.pdot(k) * f.p[i].c[1] + T(2) * bar.pddot(k) * f.p[i].c[2] +
           bar.p_eta(k) * displaced.p[i].c[1];
  }
  const V4<T> p = body.p(), w = body.pdot();
  const V3<T> e{p[1], p[2], p[3]}, o{T(b.z(3)), T(b.z(4)), T(b.z(5))}, cross_part = cross(e, o);
  const T spin = w[0] * w[0] + w[1] * w[1] + w[2] * w[2] + w[3] * w[3];
  sum += w_p(0) * (T(-0.5) * dot(e, o) - spin * p[0]);
  for (std::size_t i = 0; i < 3; ++i) {
    sum += w_p(static_cast<Eigen::Index>(i + 1)) * (T(0.5) * (p[0] * o[i] + cross_part[i]) - spin * p[i + 1]);
  }
  return sum;
}

VectorXd packed(const Moving& b) {
  VectorXd x(14);
  x << b.q, b.v;
  return x;
}

}  // namespace

TEST_CASE("a frame follows the motion of (r, p), off the unit sphere as well", "[body]") {
  Random random(GENERATE(range(0u, 8u)));
  const Moving b = moving(random);
  TextbookBody<double> body;
  for (std::size_t i = 0; i < 7; ++i) {
    body.q[i] = b.q(static_cast<Eigen::Index>(i)), body.v[i] = b.v(static_cast<Eigen::Index>(i));
    if (i < 6) body.z[i] = b.z(static_cast<Eigen::Index>(i)), body.eta[i] = b.eta(static_cast<Eigen::Index>(i));
  }
  const auto f = body.moving(), d = body.displaced();
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Index row = static_cast<Eigen::Index>(i);
    CHECK(b.frame.rddot(row) == Approx(2 * f.r[i].c[2]).margin(1e-13));
    for (std::size_t j = 0; j < 3; ++j) {
      const Eigen::Index col = static_cast<Eigen::Index>(j);
      CHECK(b.frame.A(row, col) == Approx(f.A[i][j].c[0]).margin(1e-13));
      CHECK(b.frame.Adot(row, col) == Approx(f.A[i][j].c[1]).margin(1e-13));
      CHECK(b.frame.Addot(row, col) == Approx(2 * f.A[i][j].c[2]).margin(1e-12));
      CHECK(b.frame.A_eta(row, col) == Approx(d.A[i][j].c[1]).margin(1e-13));
    }
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Index row = static_cast<Eigen::Index>(i);
    CHECK(b.frame.p(row) == f.p[i].c[0]);
    CHECK(b.frame.pdot(row) == f.p[i].c[1]);
    CHECK(b.frame.pddot(row) == Approx(2 * f.p[i].c[2]).margin(1e-13));
    CHECK(b.frame.p_eta(row) == Approx(d.p[i].c[1]).margin(1e-13));
  }
}

TEST_CASE("pull-backs of a frame equal complex-step gradients", "[body]") {
  Random random(GENERATE(range(0u, 8u)));
  const Moving b = moving(random);
  const FrameBar bar = random_bar(random);
  const Vector4d w_p = random.vector(4);
  SECTION("all of it, for the adjoint sweep") {
    Vec<7> q_bar = Vec<7>::Zero(), v_bar = Vec<7>::Zero();
    add_pull_back(b.frame, bar, w_p, b.eta.tail<3>(), q_bar, v_bar);
    VectorXd found(14);
    found << q_bar, v_bar;
    const VectorXd expected =
        complex_gradient([&](const std::vector<Complex>& x) { return weighted_frame(x, b, bar, w_p); }, packed(b));
    CHECK((found - expected).lpNorm<Eigen::Infinity>() < 1e-12);
  }
  SECTION("positions and velocities") {
    FrameBar some = bar;
    some.Addot.setZero(), some.A_eta.setZero(), some.pddot.setZero(), some.p_eta.setZero();
    Vec<7> q_bar = Vec<7>::Zero(), v_bar = Vec<7>::Zero();
    add_pull_back_velocity(b.frame, some, 0.7, q_bar, v_bar);
    VectorXd found(14);
    found << q_bar, v_bar;
    const VectorXd expected = complex_gradient(
        [&](const std::vector<Complex>& x) { return weighted_frame(x, b, some, Vector4d::Zero()); }, packed(b));
    CHECK((found - 0.7 * expected).lpNorm<Eigen::Infinity>() < 1e-13);
    some.rdot.setZero(), some.Adot.setZero(), some.pdot.setZero();
    const VectorXd position = complex_gradient(
        [&](const std::vector<Complex>& x) { return weighted_frame(x, b, some, Vector4d::Zero()); }, packed(b));
    CHECK((pull_back_position(b.frame, some) - position.head<7>()).lpNorm<Eigen::Infinity>() < 1e-13);
  }
}

TEST_CASE("the tangent of a frame is the transpose of its pull-back", "[body]") {
  Random random(GENERATE(range(0u, 8u)));
  const Moving b = moving(random);
  FrameBar bar = random_bar(random);
  bar.A_eta.setZero(), bar.p_eta.setZero();
  const Vector4d w_p = random.vector(4);
  Vec<7> q_bar = Vec<7>::Zero(), v_bar = Vec<7>::Zero();
  add_pull_back(b.frame, bar, w_p, b.eta.tail<3>(), q_bar, v_bar);
  const Lanes<7> q_dir = random.vector(7 * kLanes).reshaped(7, kLanes);
  const Lanes<7> v_dir = random.vector(7 * kLanes).reshaped(7, kLanes);
  FrameTangent t;
  set_tangent(b.frame, q_dir, v_dir, t);
  for (int lane = 0; lane < kLanes; ++lane) {
    double forward = bar.r.dot(t.r.col(lane)) + bar.rdot.dot(t.rdot.col(lane)) + w_p.dot(t.pddot.col(lane)) +
                     bar.p.dot(t.p.col(lane)) + bar.pdot.dot(t.pdot.col(lane)) + bar.pddot.dot(t.pddot.col(lane));
    for (int i = 0; i < 9; ++i) {
      forward += bar.A(i / 3, i % 3) * t.A(i, lane) + bar.Adot(i / 3, i % 3) * t.Adot(i, lane) +
                 bar.Addot(i / 3, i % 3) * t.Addot(i, lane);
    }
    CHECK(forward == Approx(q_bar.dot(q_dir.col(lane)) + v_bar.dot(v_dir.col(lane))).margin(1e-12));
  }
}

TEST_CASE("to_virtual is the transpose of the map from (rddot, omegadot) to (rddot, pddot)", "[body]") {
  Random random(GENERATE(range(0u, 4u)));
  const Moving b = moving(random);
  const Vec<7> w = random.vector(7);
  Vec<7> at_rest;
  at_rest << b.frame.rddot, b.frame.pddot;
  at_rest.tail<4>() += b.frame.pdot.squaredNorm() * b.frame.p;  // the part linear in z
  CHECK(w.dot(at_rest) == Approx(to_virtual(b.frame, w).dot(b.z)).margin(1e-13));
}
