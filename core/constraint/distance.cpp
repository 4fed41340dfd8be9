#include "core/constraint/distance.hpp"

#include "core/constraint/body_vector.hpp"

namespace mbsopt {

template <class F, class S>
EIGEN_ALWAYS_INLINE Row<VectorOf<F>> row_of(const Distance&, const F& f1, const F& f2, const Vectors<S>& s) {
  const Jet<VectorOf<F>> d = separation(f1, f2, s.s1, s.s2);
  const Jet<ScalarOf<F>> l = length(d);
  const VectorOf<F> u = direction(d.x, l.x);
  return {l, u, -moment(f1, s.s1, u), moment(f2, s.s2, u)};
}
template struct SingleRow<Distance>;

void Distance::pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                         GeometryBar& s) const {
  const VectorJet d = separation_of(f1, f2, s1, s2);
  const double l = d.x.norm();
  if (l == 0) return;
  const double lambda = z.lambda(0), mu0 = z.mu0(0), mu1 = z.mu1(0), mu2 = z.mu2(0);
  const Vector3d u = d.x / l;
  auto across = [&](const Vector3d& x) { return Vector3d((x - u * u.dot(x)) / l); };  // u_d x
  const double ldot = u.dot(d.xd), c = (d.xd.squaredNorm() - ldot * ldot) / l;
  // l_d = u,  (ldot)_d = across(ddot),  (lddot)_d = across(dddot) - 2 ldot across(ddot)/l - c u/l
  // (lddot)_ddot = 2 (ddot - ldot u)/l
  const VectorJet d_bar{{Vector3d(lambda * across(d.x_eta) + mu0 * u + mu1 * across(d.xd) +
                                  mu2 * (across(d.xdd) - (2 * ldot / l) * across(d.xd) - (c / l) * u)),
                         Vector3d(mu1 * u + 2 * mu2 * across(d.xd)), Vector3d(mu2 * u)},
                        Vector3d(lambda * u)};
  add_point_bar(f2, s2, d_bar, 1, bar2, s.s2);
  add_point_bar(f1, s1, d_bar, -1, bar1, s.s1);
}

}  // namespace mbsopt
