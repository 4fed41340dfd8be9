// A function of one number through samples (x_i, y_i), with its derivatives:
//   hold      y_i from x_i to x_{i+1}               jumps at samples
//   linear    straight lines between samples        kinks at samples
//   spline    C2 cubic                              de Boor, "A Practical Guide to Splines" (2001), chapter IV
// A spline is not-a-knot at both ends: its third derivative is continuous at the second and the last but one sample.
// Two samples give a line, three a parabola.
// A smooth routine with its derivatives is a curve, too. It counts as a spline without samples. The first and the last
// piece continue outside the samples. At a sample, the curve takes the piece to its right.
//
//   const Curve torque(Interpolation::linear, {0, 0.1, 0.2}, {1, 3, 2});
//   torque.at(0.05);      // 2
//   torque.at(0.05, 1);   // 20, the slope
#pragma once

#include <functional>
#include <vector>

namespace mbsopt {

enum class Interpolation { hold, linear, spline };

class Curve {
 public:
  // Needs at least two samples and strictly increasing x. Otherwise it throws std::invalid_argument.
  Curve(Interpolation how, std::vector<double> x, std::vector<double> y);
  // f(x, order) returns the value (order 0) or a derivative at x. Several threads may call it. The law of a drive needs
  // orders 0 to 2, one more if its argument depends on varied parameters, and two more for Hessians.
  explicit Curve(std::function<double(double x, int order)> f);

  double at(double x, int order = 0) const;  // value, or derivative of that order
  int degree() const;                        // derivatives of a higher order are 0; of a routine: none is

  bool is_routine() const { return static_cast<bool>(routine_); }
  Interpolation interpolation() const { return how_; }
  const std::vector<double>& x() const { return x_; }
  const std::vector<double>& y() const { return y_; }
  // The value (hold), the slope (linear) or the third derivative (spline) changes by this at sample i.
  double change_at(std::size_t i) const;

 private:
  double slope(std::size_t piece) const { return (y_[piece + 1] - y_[piece]) / (x_[piece + 1] - x_[piece]); }

  Interpolation how_;
  std::function<double(double, int)> routine_;
  std::vector<double> x_, y_;
  std::vector<double> slopes_;  // of spline, at the samples
};

}  // namespace mbsopt
