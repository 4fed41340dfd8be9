#include "core/constraint/cubic_spline.hpp"

#include <Eigen/SparseLU>
#include <algorithm>
#include <stdexcept>

namespace mbsopt {

// Unknown slopes m_i:  C2 inside,  m_{i-1}/h_i + 2 m_i (1/h_i + 1/h_{i+1}) + m_{i+1}/h_{i+1} = 3 (d_i/h_i +
// d_{i+1}/h_{i+1}) with d the divided differences; at the ends the third derivatives of neighbours agree.
CubicSpline::CubicSpline(std::vector<double> times, std::vector<double> values)
    : times_(std::move(times)), values_(std::move(values)), slopes_(times_.size()) {
  const std::size_t n = times_.size();
  if (n < 2 || values_.size() != n) throw std::invalid_argument("a spline needs two or more samples");
  for (std::size_t i = 1; i < n; ++i) {
    if (!(times_[i] > times_[i - 1])) throw std::invalid_argument("a spline's times must increase");
  }
  auto h = [&](std::size_t i) { return times_[i + 1] - times_[i]; };
  auto d = [&](std::size_t i) { return (values_[i + 1] - values_[i]) / h(i); };
  if (n == 2) {
    slopes_[0] = slopes_[1] = d(0);
    return;
  }
  if (n == 3) {
    const double curvature = (d(1) - d(0)) / (times_[2] - times_[0]);
    for (std::size_t i = 0; i < 3; ++i) slopes_[i] = d(0) + curvature * (2 * times_[i] - times_[0] - times_[1]);
    return;
  }
  using Index = Eigen::Index;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd b(static_cast<Index>(n));
  auto put = [&](std::size_t i, std::size_t j, double x) {
    entries.emplace_back(static_cast<int>(i), static_cast<int>(j), x);
  };
  for (std::size_t i = 1; i + 1 < n; ++i) {
    put(i, i - 1, h(i));
    put(i, i, 2 * (h(i - 1) + h(i)));
    put(i, i + 1, h(i - 1));
    b(static_cast<Index>(i)) = 3 * (h(i) * d(i - 1) + h(i - 1) * d(i));
  }
  // third derivative of piece i is 6 (m_i + m_{i+1} - 2 d_i)/h_i^2
  auto end = [&](std::size_t row, std::size_t i, std::size_t j) {
    const double wi = h(j) * h(j), wj = h(i) * h(i);
    put(row, i, wi);
    put(row, i + 1, wi - (j == i + 1 ? wj : 0));
    if (j != i + 1) put(row, j, -wj);
    put(row, j + 1, -wj);
    b(static_cast<Index>(row)) = 2 * (wi * d(i) - wj * d(j));
  };
  end(0, 0, 1);
  end(n - 1, n - 3, n - 2);
  Eigen::SparseMatrix<double> A(static_cast<Index>(n), static_cast<Index>(n));
  A.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseLU<Eigen::SparseMatrix<double>> solver(A);
  const Eigen::VectorXd m = solver.solve(b);
  std::copy(m.begin(), m.end(), slopes_.begin());
}

CubicSpline::Jet CubicSpline::operator()(double t) const {
  const auto after = std::upper_bound(times_.begin() + 1, times_.end() - 1, t);
  const std::size_t i = static_cast<std::size_t>(after - times_.begin()) - 1;
  const double h = times_[i + 1] - times_[i], s = t - times_[i], d = (values_[i + 1] - values_[i]) / h;
  const double c2 = (3 * d - 2 * slopes_[i] - slopes_[i + 1]) / h, c3 = (slopes_[i] + slopes_[i + 1] - 2 * d) / (h * h);
  return {values_[i] + s * (slopes_[i] + s * (c2 + s * c3)), slopes_[i] + s * (2 * c2 + 3 * s * c3),
          2 * c2 + 6 * s * c3};
}

}  // namespace mbsopt
