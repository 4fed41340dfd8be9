#include "core/constraint/angle.hpp"

#include <cmath>
#include <numbers>

#include "core/constraint/body_vector.hpp"

namespace mbsopt {

double Angle::on_branch(double angle, double reference) {
  constexpr double turn = 2 * std::numbers::pi;
  return angle + turn * std::round((reference - angle) / turn);
}

// Phi itself is only there in dual numbers: atan2 is slow.
template <class F, class B>
EIGEN_ALWAYS_INLINE Row<VectorOf<F>> row_of(const Angle&, const F& f1, const F& f2, const Vectors<B>& b) {
  using T = ScalarOf<F>;
  const Row<VectorOf<F>> cosine = product_row(f1, f2, b.s1, b.s2), sine = product_row(f1, f2, b.s3, b.s2);
  const Jet<T>&C = cosine.phi, &S = sine.phi;
  const T D = C.x * C.x + S.x * S.x, rate = (C.x * S.xd - S.x * C.xd) / D, c = C.x / D, s = S.x / D;
  T phi(0);
  if constexpr (!std::is_same_v<T, double>) phi = angle_of(S.x, C.x);
  return {{phi, rate, T(c * S.xdd - s * C.xdd - 2 * (c * C.xd + s * S.xd) * rate)},
          {},
          c * sine.moment1 - s * cosine.moment1,
          c * sine.moment2 - s * cosine.moment2};
}
template struct SingleRow<Angle>;

void Angle::phi(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  const Vector3d y = f2.A * s2;
  out(0) = std::atan2(y.dot(f1.A * s3), y.dot(f1.A * s1));
}

void Angle::pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                      GeometryBar& s) const {
  const Row<Vector3d> of_C = product_row(f1, f2, s1, s2), of_S = product_row(f1, f2, s3, s2);
  const Jet<double>&C = of_C.phi, &S = of_S.phi;
  const double Ce = virtual_change(of_C, f1, f2), Se = virtual_change(of_S, f1, f2);
  const double D = C.x * C.x + S.x * S.x, D2 = D * D, N = C.x * S.xd - S.x * C.xd, E = C.x * C.xd + S.x * S.xd;
  const double lambda = z.lambda(0), mu0 = z.mu0(0), mu1 = z.mu1(0), mu2 = z.mu2(0);
  Multipliers<1> zC, zS;
  zC.lambda(0) = -lambda * S.x / D;
  zS.lambda(0) = lambda * C.x / D;
  zC.mu2(0) = -mu2 * S.x / D;
  zS.mu2(0) = mu2 * C.x / D;
  zC.mu1(0) = -mu1 * S.x / D - 2 * mu2 * (C.x * N - S.x * E) / D2;
  zS.mu1(0) = mu1 * C.x / D - 2 * mu2 * (S.x * N + C.x * E) / D2;
  // Derivatives of (C S_x - S C_x)/D for x = eta, dot, ddot, of atan2, and of the last term of Phiddot, in C and in S.
  auto by_C = [&](double C_x, double S_x) { return S_x / D - 2 * C.x * (C.x * S_x - S.x * C_x) / D2; };
  auto by_S = [&](double C_x, double S_x) { return -C_x / D - 2 * S.x * (C.x * S_x - S.x * C_x) / D2; };
  const double EN = 8 * E * N / (D2 * D);
  zC.mu0(0) = -mu0 * S.x / D + lambda * by_C(Ce, Se) + mu1 * by_C(C.xd, S.xd) +
              mu2 * (by_C(C.xdd, S.xdd) - 2 * (C.xd * N + E * S.xd) / D2 + C.x * EN);
  zS.mu0(0) = mu0 * C.x / D + lambda * by_S(Ce, Se) + mu1 * by_S(C.xd, S.xd) +
              mu2 * (by_S(C.xdd, S.xdd) - 2 * (S.xd * N - E * C.xd) / D2 + S.x * EN);
  Dot1{{}, s1, s2}.pull_back(f1, f2, zC, bar1, bar2, s);
  GeometryBar of_sine;
  Dot1{{}, s3, s2}.pull_back(f1, f2, zS, bar1, bar2, of_sine);
  s.s3 += of_sine.s1;
  s.s2 += of_sine.s2;
}

}  // namespace mbsopt
