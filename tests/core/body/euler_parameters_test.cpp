#include "core/body/euler_parameters.hpp"

#include <catch2/catch.hpp>

#include "tests/core/body/textbook_body.hpp"

using namespace mbsopt;
using mbsopt::testing::distance;
using mbsopt::testing::Random;

namespace {

constexpr double kTolerance = 1e-13;  // a few dozen roundings of numbers of size ten

}  // namespace

TEST_CASE("A(p) is the Euler-Rodrigues matrix, a rotation times |p|^2", "[body]") {
  Random random(GENERATE(range(0u, 8u)));
  const Vector4d p = random.vector(4);
  const auto expected = mbsopt::testing::rotation<double>({p(0), p(1), p(2), p(3)});
  Matrix3d R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) R(i, j) = expected[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  CHECK(distance(A(p), R) < kTolerance);
  const double square = p.squaredNorm();
  CHECK(distance(A(p) * A(p).transpose(), square * square * Matrix3d::Identity()) < 20 * kTolerance);
  CHECK(A(p).determinant() == Approx(square * square * square));
}

TEST_CASE("A quarter turn about z takes x to y", "[body]") {
  const Vector4d p(std::sqrt(0.5), 0, 0, std::sqrt(0.5));
  CHECK(distance(A(p) * Vector3d::UnitX(), Vector3d::UnitY()) < 1e-15);
}

TEST_CASE("B, N and K are the derivatives of A(p), anywhere", "[body]") {
  Random random(GENERATE(range(0u, 8u)));
  const Vector4d p = random.vector(4), w = random.vector(4);
  const Vector3d s = random.vector(3), x = random.vector(3);
  // A is quadratic, so a central difference of any size is exact.
  const Matrix3d difference = 0.5 * (A(p + w) - A(p - w));
  CHECK(distance(B(p, w), difference) < kTolerance);
  CHECK(distance(B(p, w), B(w, p)) < kTolerance);
  CHECK(distance(B(p, p), 2 * A(p)) < kTolerance);
  CHECK(distance(N(p, s) * w, B(p, w) * s) < kTolerance);
  CHECK(distance(N(p, s) * w, N(w, s) * p) < kTolerance);
  const Matrix3d X = x * s.transpose() + skew(random.vector(3));
  CHECK(distance(K(X), K(X).transpose()) == 0);
  CHECK(0.5 * p.dot(K(X) * p) == Approx(X.cwiseProduct(A(p)).sum()).margin(kTolerance));
  CHECK(w.dot(K(X) * p) == Approx(X.cwiseProduct(B(p, w)).sum()).margin(kTolerance));
}

TEST_CASE("G carries rates of Euler parameters to angular velocity and back", "[body]") {
  Random random(GENERATE(range(0u, 8u)));
  const Vector4d p = random.vector(4), y = random.vector(4);
  const Vector3d w = random.vector(3);
  CHECK(y.dot(G_transposed_times(p, w)) == Approx(w.dot(G_times(p, y))).margin(kTolerance));
  CHECK(y.dot(G_transposed_times(p, w)) == Approx(p.dot(G_transposed_times_adjoint(w, y))).margin(kTolerance));
  CHECK(G_times(p, p).norm() < kTolerance);
  const Vector4d pdot = 0.5 * G_transposed_times(p, w);
  CHECK(distance(A(p) * skew(w), B(p, pdot)) < kTolerance);
  CHECK(std::abs(p.dot(pdot)) < kTolerance);
  const Vector4d unit = p.normalized();
  CHECK(distance(omega_B(unit, 0.5 * G_transposed_times(unit, w)), w) < kTolerance);
}
