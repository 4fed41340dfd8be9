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
  if (d.x.isZero(0)) return;
  const VectorJet d_bar = length_bar(d, weights(z));
  add_point_bar(f2, s2, d_bar, 1, bar2, s.s2);
  add_point_bar(f1, s1, d_bar, -1, bar1, s.s1);
}

}  // namespace mbsopt
