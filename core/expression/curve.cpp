#include "core/expression/curve.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace mbsopt {

Curve::Curve(Interpolation how, std::vector<double> x, std::vector<double> y) : how_(how) {
  if (how == Interpolation::spline) {
    spline_.emplace(std::move(x), std::move(y));
    return;
  }
  x_ = std::move(x);
  y_ = std::move(y);
  if (x_.size() < 2 || y_.size() != x_.size()) throw std::invalid_argument("a curve needs two or more samples");
  for (std::size_t i = 1; i < x_.size(); ++i)
    if (!(x_[i] > x_[i - 1])) throw std::invalid_argument("a curve's abscissae must increase");
}

Curve::Curve(std::function<double(double, int)> f) : how_(Interpolation::spline), routine_(std::move(f)) {
  if (!routine_) throw std::invalid_argument("a curve's routine is empty");
}

int Curve::degree() const {
  if (routine_) return std::numeric_limits<int>::max();
  switch (how_) {
    case Interpolation::hold:
      return 0;
    case Interpolation::linear:
      return 1;
    case Interpolation::spline:
      break;
  }
  return 3;
}

double Curve::at(double x, int order) const {
  if (routine_) return routine_(x, order);
  if (order > degree()) return 0;
  if (spline_) {
    const CubicSpline::Jet jet = (*spline_)(x);
    const double derivatives[] = {jet.f, jet.f_t, jet.f_tt, jet.f_ttt};
    return derivatives[order];
  }
  if (how_ == Interpolation::hold) {
    const auto after = std::upper_bound(x_.begin() + 1, x_.end(), x);
    return y_[static_cast<std::size_t>(after - x_.begin()) - 1];
  }
  const auto after = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
  const std::size_t piece = static_cast<std::size_t>(after - x_.begin()) - 1;
  return order == 1 ? slope(piece) : y_[piece] + slope(piece) * (x - x_[piece]);
}

double Curve::change_at(std::size_t i) const {
  if (spline_) return i == 0 || i + 1 >= x().size() ? 0 : at(x()[i], 3) - at(x()[i - 1], 3);
  if (how_ == Interpolation::hold) return i == 0 ? 0 : y_[i] - y_[i - 1];
  return i == 0 || i + 1 >= x_.size() ? 0 : slope(i) - slope(i - 1);
}

}  // namespace mbsopt
