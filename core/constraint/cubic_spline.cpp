#include "core/constraint/cubic_spline.hpp"

#include <Eigen/Core>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mbsopt {

namespace {

// Unknown slopes m_i:  C2 inside,  m_{i-1}/h_i + 2 m_i (1/h_i + 1/h_{i+1}) + m_{i+1}/h_{i+1} = 3 (d_i/h_i +
// d_{i+1}/h_{i+1}) with d the divided differences; at the ends the third derivatives of neighbours agree.
Eigen::VectorXd slopes_through(const std::vector<double>& times, const std::vector<double>& values) {
  using Index = Eigen::Index;
  const std::size_t n = times.size();
  // Intervals relative to their mean, so that their squares neither underflow nor overflow.
  const double mean = (times[n - 1] - times[0]) / static_cast<double>(n - 1);
  auto h = [&](std::size_t i) { return (times[i + 1] - times[i]) / mean; };
  auto d = [&](std::size_t i) { return (values[i + 1] - values[i]) / h(i); };
  Eigen::VectorXd m(static_cast<Index>(n));
  if (n == 2) {
    m << d(0), d(0);
    return m / mean;
  }
  if (n == 3) {
    const double curvature = (d(1) - d(0)) / (h(0) + h(1));
    m << d(0) - curvature * h(0), d(0) + curvature * h(0), d(0) + curvature * (h(0) + 2 * h(1));
    return m / mean;
  }
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
  if (solver.info() != Eigen::Success) {
    throw std::invalid_argument("no spline goes through the samples: their intervals differ too much in length");
  }
  return solver.solve(b) / mean;
}

}  // namespace

CubicSpline::CubicSpline(std::vector<double> times, std::vector<double> values)
    : times_(std::move(times)), values_(std::move(values)), slopes_(times_.size()) {
  const std::size_t n = times_.size();
  if (n < 2 || values_.size() != n) throw std::invalid_argument("a spline needs two or more samples");
  for (std::size_t i = 1; i < n; ++i) {
    if (!(times_[i] > times_[i - 1])) throw std::invalid_argument("a spline's times must increase");
  }
  const Eigen::VectorXd m = slopes_through(times_, values_);
  std::copy(m.begin(), m.end(), slopes_.begin());
  for (const double t : times_) {
    const Jet jet = (*this)(t);
    if (std::isfinite(jet.f) && std::isfinite(jet.f_t) && std::isfinite(jet.f_tt)) continue;
    throw std::invalid_argument(
        "the spline through the samples has slopes or curvatures beyond all numbers: are times and values in their "
        "units?");
  }
}

CubicSpline::Jet CubicSpline::operator()(double t) const {
  const auto after = std::upper_bound(times_.begin() + 1, times_.end() - 1, t);
  const std::size_t i = static_cast<std::size_t>(after - times_.begin()) - 1;
  const double h = times_[i + 1] - times_[i], u = (t - times_[i]) / h, d = values_[i + 1] - values_[i];
  const double m0 = h * slopes_[i], m1 = h * slopes_[i + 1], c2 = 3 * d - 2 * m0 - m1, c3 = m0 + m1 - 2 * d;
  return {values_[i] + u * (m0 + u * (c2 + u * c3)), (m0 + u * (2 * c2 + 3 * u * c3)) / h,
          (2 * c2 + 6 * u * c3) / h / h};
}

}  // namespace mbsopt
