// Watches the constraints' accelerations over all right-hand sides of a run: the largest residual of J z + gamma,
// relative to z or to the accelerations that are usual there (augmented Lagrangian).
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "core/mechanism/mechanism.hpp"

namespace mbsopt {

class ResidualWatch {
 public:
  ResidualWatch(const MechanismData& data, Model model);

  // A solve left a residual of this size, `ratio` of z, at y. usual_acceleration(): of all bodies, asked rarely.
  template <class Usual>
  void note(double ratio, double size, const Eigen::VectorXd& y, Usual&& usual_acceleration) {
    if (!(ratio > worst_) || expected(size, y)) return;
    add(std::min(ratio, size / usual_acceleration()), y);
  }
  double worst() const { return worst_; }

 private:
  bool expected(double size, const Eigen::VectorXd& y) const;
  void add(double residual, const Eigen::VectorXd& y);
  double turning(const Eigen::VectorXd& y, int body) const;

  int n_;
  double free_fall_ = 0;  // what gravity alone gives some body, where there are no forces
  int fastest_ = 1;       // the body that turned fastest when last looked for
  unsigned long added_ = 0;
  double worst_ = 0;
};

}  // namespace mbsopt
