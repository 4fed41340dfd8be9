#include "core/constraint/dot2.hpp"

#include "core/constraint/body_vector.hpp"

namespace mbsopt {

template <class F, class S>
EIGEN_ALWAYS_INLINE Row<VectorOf<F>> row_of(const Dot2&, const F& f1, const F& f2, const Vectors<S>& s) {
  const Jet<VectorOf<F>> w = turned(f1, s.s3), d = separation(f1, f2, s.s1, s.s2);
  return {product(w, d), w.x, moment(f1, s.s3, d.x) - moment(f1, s.s1, w.x), moment(f2, s.s2, w.x)};
}
template struct SingleRow<Dot2>;

void Dot2::pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                     GeometryBar& s) const {
  const VectorJet w = vector_of(f1, s3), d = separation_of(f1, f2, s1, s2), d_bar = product_bar(w, weights(z));
  add_vector_bar(f1, s3, product_bar(d, weights(z)), 1, bar1, s.s3);
  add_point_bar(f2, s2, d_bar, 1, bar2, s.s2);
  add_point_bar(f1, s1, d_bar, -1, bar1, s.s1);
}

}  // namespace mbsopt
