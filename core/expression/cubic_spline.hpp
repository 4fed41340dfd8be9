// C2 interpolating cubic spline through samples, not-a-knot at both ends: the third derivative is continuous at the
// second and the last but one sample. Two samples give a line, three a parabola.
// de Boor, "A Practical Guide to Splines" (2001), chapter IV.
#pragma once

#include <vector>

namespace mbsopt {

class CubicSpline {
 public:
  struct Jet {
    double f, f_t, f_tt, f_ttt;
  };

  // Needs at least two samples and strictly increasing times. Otherwise it throws std::invalid_argument.
  CubicSpline(std::vector<double> times, std::vector<double> values);

  // Outside the samples the end polynomials continue.
  Jet operator()(double t) const;
  const std::vector<double>& times() const { return times_; }
  const std::vector<double>& values() const { return values_; }

 private:
  std::vector<double> times_, values_, slopes_;
};

}  // namespace mbsopt
