// A function of one number through samples (x_i, y_i), with its derivatives:
//   hold      y_i from x_i to x_{i+1}               jumps at samples
//   linear    straight lines between samples        kinks at samples
//   spline    C2 cubic, not-a-knot at both ends     (cubic_spline.hpp)
// or a routine, smooth, with its derivatives. It counts as a spline without samples.
// The first and the last piece go on outside the samples. At a sample the piece to its right counts.
//
//   const Curve torque(Interpolation::linear, {0, 0.1, 0.2}, {1, 3, 2});
//   torque.at(0.05);      // 2
//   torque.at(0.05, 1);   // 20, the slope
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/expression/cubic_spline.hpp"

namespace mbsopt {

enum class Interpolation { hold, linear, spline };

class Curve {
 public:
  // At least two samples, x strictly increasing (std::invalid_argument otherwise).
  Curve(Interpolation how, std::vector<double> x, std::vector<double> y);
  // f(x, order): the value (order 0) and derivatives at x, from several threads. The law of a drive takes orders 0 to
  // 2, one more where varied parameters enter its argument, and two more for Hessians.
  explicit Curve(std::function<double(double x, int order)> f);

  double at(double x, int order = 0) const;  // value, or derivative of that order
  int degree() const;                        // derivatives of a higher order are 0; of a routine: none is

  bool is_routine() const { return static_cast<bool>(routine_); }
  Interpolation interpolation() const { return how_; }
  const std::vector<double>& x() const { return spline_ ? spline_->times() : x_; }
  const std::vector<double>& y() const { return spline_ ? spline_->values() : y_; }
  // The value (hold), the slope (linear) or the third derivative (spline) changes by this at sample i.
  double change_at(std::size_t i) const;

 private:
  double slope(std::size_t piece) const { return (y_[piece + 1] - y_[piece]) / (x_[piece + 1] - x_[piece]); }

  Interpolation how_;
  std::function<double(double, int)> routine_;
  std::vector<double> x_, y_;          // of hold and linear
  std::optional<CubicSpline> spline_;  // of spline
};

}  // namespace mbsopt
