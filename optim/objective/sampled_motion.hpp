// A motion at given times (states and sensors), and the distance of two motions of one mechanism.
//
//   distance(t)^2 = 1/(total mass) sum over bodies of the integral of |x_1 - x_2|^2 dm
//                 = 1/(total mass) sum (m |r_1 - r_2|^2 + tr(D P D')),   D = A(p_1) - A(p_2),   P = tr(J)/2 I - J
//
// It is the root mean square, over all material points x, of the distance between both motions [m]. It is exact for
// rotations of any size and for any frames. If nothing has mass, each body counts as a point of 1 kg.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"

namespace mbsopt::inline optim {

struct SampledMotion {
  std::vector<double> times;
  Eigen::MatrixXd states;   // y, one column per time
  Eigen::MatrixXd angles;   // branches of tracked joint angles, one column per time
  Eigen::MatrixXd sensors;  // one row per sensor of the scene
};

// The ends of `count` equal parts of the simulated span. The start is given and not among them.
std::vector<double> sample_times(const SimulationSettings& settings, int count);

// Fills `motion`, whose times are set; both arguments must outlive it.
Sampling record_motion(const Mechanism& mechanism, SampledMotion& motion);

class MotionDistance {
 public:
  explicit MotionDistance(const Mechanism& mechanism);
  double between(const Eigen::Ref<const Eigen::VectorXd>& y1, const Eigen::Ref<const Eigen::VectorXd>& y2) const;
  // The largest distance over the times.
  double between(const SampledMotion& one, const SampledMotion& other) const;
  // The largest distance of a motion from its start, y0.
  double extent(const SampledMotion& motion, const Eigen::VectorXd& y0) const;

 private:
  struct Body {
    double mass;
    Eigen::Matrix3d P;
  };
  std::vector<Body> bodies_;
  double total_ = 0;
};

}  // namespace mbsopt::inline optim
