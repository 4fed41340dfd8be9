#include "core/expression/curve.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
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

Curve::Curve(Interpolation how, std::vector<double> x, std::vector<double> y)
    : how_(how), x_(std::move(x)), y_(std::move(y)) {
  const bool is_spline = how == Interpolation::spline;
  if (x_.size() < 2 || y_.size() != x_.size())
    throw std::invalid_argument(is_spline ? "a spline needs two or more samples" : "a curve needs two or more samples");
  for (std::size_t i = 1; i < x_.size(); ++i)
    if (!(x_[i] > x_[i - 1]))
      throw std::invalid_argument(is_spline ? "a spline's times must increase" : "a curve's abscissae must increase");
  if (!is_spline) return;
  const Eigen::VectorXd m = slopes_through(x_, y_);
  slopes_.assign(m.begin(), m.end());
  for (const double t : x_) {
    if (std::isfinite(at(t)) && std::isfinite(at(t, 1)) && std::isfinite(at(t, 2))) continue;
    throw std::invalid_argument(
        "the spline through the samples has slopes or curvatures beyond all numbers: are times and values in their "
        "units?");
  }
}

Curve::Curve(std::function<double(double, int)> f) : how_(Interpolation::spline), routine_(std::move(f)) {
  if (!routine_) throw std::invalid_argument("a curve's routine is empty");
}

int Curve::degree() const {
  if (routine_) return std::numeric_limits<int>::max();
  return how_ == Interpolation::hold ? 0 : how_ == Interpolation::linear ? 1 : 3;
}

double Curve::at(double x, int order) const {
  if (routine_) return routine_(x, order);
  if (order > degree()) return 0;
  const bool hold = how_ == Interpolation::hold;
  const auto after = std::upper_bound(x_.begin() + 1, hold ? x_.end() : x_.end() - 1, x);
  const std::size_t i = static_cast<std::size_t>(after - x_.begin()) - 1;
  if (hold) return y_[i];
  if (how_ == Interpolation::linear) return order == 1 ? slope(i) : y_[i] + slope(i) * (x - x_[i]);
  const double h = x_[i + 1] - x_[i], u = (x - x_[i]) / h, d = y_[i + 1] - y_[i];
  const double m0 = h * slopes_[i], m1 = h * slopes_[i + 1], c2 = 3 * d - 2 * m0 - m1, c3 = m0 + m1 - 2 * d;
  if (order == 0) return y_[i] + u * (m0 + u * (c2 + u * c3));
  if (order == 1) return (m0 + u * (2 * c2 + 3 * u * c3)) / h;
  return order == 2 ? (2 * c2 + 6 * u * c3) / h / h : 6 * c3 / h / h / h;
}

double Curve::change_at(std::size_t i) const {
  if (how_ == Interpolation::spline) return i == 0 || i + 1 >= x().size() ? 0 : at(x()[i], 3) - at(x()[i - 1], 3);
  if (how_ == Interpolation::hold) return i == 0 ? 0 : y_[i] - y_[i - 1];
  return i == 0 || i + 1 >= x_.size() ? 0 : slope(i) - slope(i - 1);
}

}  // namespace mbsopt
