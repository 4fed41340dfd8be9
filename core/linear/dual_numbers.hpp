// Forward differentiation of functions that are templates in their scalar type. Dual numbers carry the derivatives in
// seven directions at a time, as many as a body has coordinates (Eigen's AutoDiffScalar).
//
//   // J += df/dx
//   add_jacobian([&](const Eigen::VectorX<Dual>& x, Eigen::VectorX<Dual>& f) { f(0) = sin(x(0)) * x(1); }, x, 1, J);
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <unsupported/Eigen/AutoDiff>

namespace mbsopt {

inline constexpr int kDualDirections = 7;
using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, kDualDirections, 1>>;

// Returns constants: the same numbers with derivatives of zero.
inline Eigen::VectorX<Dual> constants(const Eigen::Ref<const Eigen::VectorXd>& x) { return x.cast<Dual>(); }

// J += scale df/dx; J has the rows of f and the columns of x. f(x, out) gets a zeroed out.
template <class Function>
void add_jacobian(Function&& f, const Eigen::Ref<const Eigen::VectorXd>& x, double scale,
                  Eigen::Ref<Eigen::MatrixXd> J) {
  Eigen::VectorX<Dual> seeded = constants(x), out(J.rows());
  for (Eigen::Index first = 0; first < x.size(); first += kDualDirections) {
    const Eigen::Index count = std::min<Eigen::Index>(kDualDirections, x.size() - first);
    for (Eigen::Index k = 0; k < count; ++k)
      seeded(first + k) = Dual(x(first + k), kDualDirections, static_cast<int>(k));
    out.setConstant(Dual(0));
    f(seeded, out);
    for (Eigen::Index i = 0; i < J.rows(); ++i)
      J.row(i).segment(first, count) += scale * out(i).derivatives().head(count).transpose();
    for (Eigen::Index k = 0; k < count; ++k) seeded(first + k) = Dual(x(first + k));
  }
}

}  // namespace mbsopt
