// Jumps of the laws that drives prescribe, or of their rates: no motion of finite force follows them.
//
// Over an interval of length h a smooth f keeps  f1 - f0 - h (f0' + f1')/2  within h^3 f'''/12, and so does f' with its
// own derivative. A jump keeps its size in any short interval. So the search halves an interval, towards the larger
// difference, until the difference or the interval vanishes.
#pragma once

#include <string>
#include <vector>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

class LawJumps {
 public:
  explicit LawJumps(const MechanismData& data);

  // Names the law that jumps between t0 and t1, the time and the size, in words; empty if none does.
  std::string between(double t0, double t1);

 private:
  struct Jump {
    double t = 0, size = 0;
  };
  TimeLaw::Jet at(const TimeLaw& law, double t);
  Jump find(const TimeLaw& law, std::size_t order, double t0, double t1);  // of f or of f_t

  const MechanismData& data_;
  std::vector<const RowLaw*> laws_;  // expressions only: constants and splines are smooth
  std::vector<double> inputs_;       // all parameters, then t
  Program::Scratch scratch_;
};

}  // namespace mbsopt
