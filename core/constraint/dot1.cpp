#include "core/constraint/dot1.hpp"

#include "core/constraint/body_vector.hpp"

namespace mbsopt {
namespace {

// (x'y)ddot in p and pdot of the body of x = A s, as VectorBlocks:  y'N(p, s) = (K(y s') p)', K as in
// euler_parameters.hpp
void product_rows(const VectorJet& y, const BodyState& b, const Vector3d& s, const Vector3d& x, Mat<1, 4>& by_p,
                  Mat<1, 4>& by_pdot) {
  const Vector3d turned = b.omegadot.cross(s) - 2 * b.pdot.squaredNorm() * s;
  const Mat<4, 4> K_x = K(y.x * s.transpose()), K_xd = 2 * K(y.xd * s.transpose());
  by_p = (K(y.x * turned.transpose() + y.xdd * s.transpose()) * b.p + K_xd * b.pdot).transpose();
  by_pdot = (2 * (K_x * b.pdot) + K_xd * b.p - (4 * y.x.dot(x)) * b.pdot).transpose();
}

}  // namespace

template <class F, class S>
EIGEN_ALWAYS_INLINE Row<VectorOf<F>> row_of(const Dot1&, const F& f1, const F& f2, const Vectors<S>& s) {
  return product_row(f1, f2, s.s1, s.s2);
}
template struct SingleRow<Dot1>;

void Dot1::pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                     GeometryBar& s) const {
  const VectorJet x = vector_of(f1, s1), y = vector_of(f2, s2);
  add_vector_bar(f1, s1, product_bar(y, weights(z)), 1, bar1, s.s1);
  add_vector_bar(f2, s2, product_bar(x, weights(z)), 1, bar2, s.s2);
}

void Dot1::turning_blocks(const Frame& f1, const Frame& f2, const Vec<1>& lambda, TurningBlocks<1>& out) const {
  const VectorJet x = vector_of(f1, s1), y = vector_of(f2, s2);
  product_rows(y, f1, s1, x.x, out.p1, out.pdot1);
  product_rows(x, f2, s2, y.x, out.p2, out.pdot2);
  const Matrix3d S1 = lambda(0) * skew(s1), S2 = lambda(0) * skew(s2);
  out.moment1_p1 = S1 * N_transposed(f1.p, y.x);
  out.moment1_p2 = S1 * (f1.A.transpose() * N(f2.p, s2));
  out.moment2_p2 = S2 * N_transposed(f2.p, x.x);
  out.moment2_p1 = S2 * (f2.A.transpose() * N(f1.p, s1));
}

}  // namespace mbsopt
