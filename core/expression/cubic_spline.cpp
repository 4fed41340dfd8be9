#include "core/expression/cubic_spline.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mbsopt {

namespace {

// Unknown slopes m_i, with d the divided differences.
//   C2 inside:              m_{i-1}/h_{i-1} + 2 m_i (1/h_{i-1} + 1/h_i) + m_{i+1}/h_i = 3 (d_{i-1}/h_{i-1} + d_i/h_i)
//   not-a-knot at the start, reduced by the second row:
//                           h_1 m_0 + (h_0 + h_1) m_1 = (h_1 (3 h_0 + 2 h_1) d_0 + h_0^2 d_1)/(h_0 + h_1)
//   at the end the same, read backwards. Elimination needs no exchange of rows: all pivots are positive.
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
  std::vector<double> above(n);  // entries right of the diagonal, divided by the pivot
  const auto eliminate = [&](std::size_t i, double below, double diagonal, double right, double b) {
    const double pivot = i == 0 ? diagonal : diagonal - below * above[i - 1];
    above[i] = right / pivot;
    m(static_cast<Index>(i)) = (i == 0 ? b : b - below * m(static_cast<Index>(i) - 1)) / pivot;
  };
  const auto end = [](double h0, double h1, double d0, double d1) {
    return (h1 * (3 * h0 + 2 * h1) * d0 + h0 * h0 * d1) / (h0 + h1);
  };
  eliminate(0, 0, h(1), h(0) + h(1), end(h(0), h(1), d(0), d(1)));
  for (std::size_t i = 1; i + 1 < n; ++i)
    eliminate(i, h(i), 2 * (h(i - 1) + h(i)), h(i - 1), 3 * (h(i) * d(i - 1) + h(i - 1) * d(i)));
  const double h0 = h(n - 2), h1 = h(n - 3);
  eliminate(n - 1, h0 + h1, h1, 0, end(h0, h1, d(n - 2), d(n - 3)));
  for (Index i = static_cast<Index>(n) - 2; i >= 0; --i) m(i) -= above[static_cast<std::size_t>(i)] * m(i + 1);
  return m / mean;
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
          (2 * c2 + 6 * u * c3) / h / h, 6 * c3 / h / h / h};
}

}  // namespace mbsopt
