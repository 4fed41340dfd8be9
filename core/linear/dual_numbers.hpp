// Dual numbers (Eigen's AutoDiffScalar): a number with its derivatives. A function that is a template in its scalar
// type is its own tangent: it gives the derivatives in kLanes directions if its arguments are Dual.
//
//   // J += df/dx
//   add_jacobian([&](const Eigen::VectorX<Dual>& x, Eigen::VectorX<Dual>& f) { f(0) = sin(x(0)) * x(1); }, x, 1, J);
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <tuple>
#include <unsupported/Eigen/AutoDiff>

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

template <int Directions>
using DualNumber = Eigen::AutoDiffScalar<Vec<Directions>>;
using Dual = DualNumber<kLanes>;

inline Dual dual(double x, const Lanes<1>& directions) { return Dual(x, directions.transpose()); }
// The derivatives as a row of lanes.
inline Lanes<1> lanes(const Dual& x) { return x.derivatives().transpose(); }

// Returns constants: the same numbers with derivatives of zero.
inline Eigen::VectorX<Dual> constants(const Eigen::Ref<const Eigen::VectorXd>& x) { return x.cast<Dual>(); }

// J += scale df/dx; J has the rows of f and the columns of x. f(x, out) gets a zeroed out.
template <class Function>
void add_jacobian(Function&& f, const Eigen::Ref<const Eigen::VectorXd>& x, double scale,
                  Eigen::Ref<Eigen::MatrixXd> J) {
  Eigen::VectorX<Dual> seeded = constants(x), out(J.rows());
  for (Eigen::Index first = 0; first < x.size(); first += kLanes) {
    const Eigen::Index count = std::min<Eigen::Index>(kLanes, x.size() - first);
    for (Eigen::Index k = 0; k < count; ++k) seeded(first + k) = Dual(x(first + k), kLanes, static_cast<int>(k));
    out.setConstant(Dual(0));
    f(seeded, out);
    for (Eigen::Index i = 0; i < J.rows(); ++i) J.row(i).segment(first, count) += scale * lanes(out(i)).head(count);
    for (Eigen::Index k = 0; k < count; ++k) seeded(first + k) = Dual(x(first + k));
  }
}

// J += scale df/dx of argument number `Of`, the others held fixed. f(x0, x1, .., out) gets a zeroed out.
template <std::size_t Of, class Function, class... X>
void add_partial_jacobian(Function&& f, double scale, Eigen::Ref<Eigen::MatrixXd> J, const X&... x) {
  const std::array<Eigen::Ref<const Eigen::VectorXd>, sizeof...(X)> values{x...};
  std::array<Eigen::VectorX<Dual>, sizeof...(X)> arguments{constants(x)...};
  const auto of_one = [&](const Eigen::VectorX<Dual>& seeded, Eigen::VectorX<Dual>& out) {
    arguments[Of] = seeded;
    std::apply([&](const auto&... all) { f(all..., out); }, arguments);
  };
  add_jacobian(of_one, values[Of], scale, J);
}

}  // namespace mbsopt
