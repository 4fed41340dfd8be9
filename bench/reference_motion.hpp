// Motions of 10 s whose truth is known, and the runs of mbsopt that come near enough to it.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "bench/linkage.hpp"
#include "core/scene/scene.hpp"
#include "core/simulate/simulation.hpp"

namespace mbsopt::bench {

// Centres of mass of all rods, 3 x rods, at each of 201 times.
struct ReferenceMotion {
  std::vector<double> times;
  std::vector<Eigen::Matrix3Xd> centres;
  double apart = 0;  // what a second reference differs by; 0: known exactly [m]

  // The largest of all rods and times; infinite where the motion is not whole.
  double distance(const std::vector<Eigen::Matrix3Xd>& motion) const;
};
ReferenceMotion motion_of_four_bars(int windows);  // exact
ReferenceMotion motion_of_bricard();               // of two methods, 8th and 6th order

struct MeasuredRun {
  std::string method;
  double rtol = 0, error = INFINITY, seconds = INFINITY;  // processor time of simulate(), assembly included
  SimulationStatistics statistics;
};

class MeasuredRuns {
 public:
  MeasuredRuns(const Linkage& linkage, const std::string& model, const ReferenceMotion& reference);

  // Among methods and tolerances (rtol; atol is a hundredth of it) the fastest run that meets the error and whose
  // method meets it at a third of the tolerance as well. Infinitely slow where there is none.
  MeasuredRun fastest(double error);
  MeasuredRun run(const std::string& method, double rtol);  // timed
  double start_seconds() const;                             // of these, the initial assembly

 private:
  double error(const std::string& method, double rtol);

  Scene scene_;
  const ReferenceMotion& reference_;
};

}  // namespace mbsopt::bench
