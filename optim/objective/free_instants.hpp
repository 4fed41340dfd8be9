// The instants at which the motion meets tracked points without times. Each point k, a row of a file, is compared where
// the motion is nearest to it:
//
//   tau_k = argmin over the run of D_k(t, rho),    D_k = sum over coordinates i of w_i (s_i(t, rho) - c_ik)^2
//   psi = sum of D_k(tau_k, rho),    psi_rho = sum of dD_k/drho at fixed tau_k
//
// since dD_k/dt = 0 at tau_k, or tau_k is an end of the run (envelope theorem). Each tau_k depends on its point alone.
//
// The search is global. It takes s_i and ds_i/dt at the instants of output, with cubic Hermite polynomials between
// them. From their best minimum the secant method solves on the motion itself, within the bracket. It finds a minimum
// between two instants of output if D falls at the first and rises at the second. The motion is solved, so it has no
// steps of an integrator.
//
// Ordered points are met one after another, tau_1 <= tau_2 <= ...; on a closed path the circle of points may begin with
// any of them. Dynamic programming finds the best instants of output in that order. If the order constrains a point, it
// shares one instant with its neighbour. Such points are a block, and D is their sum: the pool of adjacent violators
// (R. E. Barlow et al., "Statistical Inference under Order Restrictions" (1972)). The gradient is still that at fixed
// instants.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/scene/settings.hpp"
#include "optim/objective/expression_cost.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// The motion has no instants, because it could not be solved.
struct NoMotion : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class FreeInstants {
 public:
  explicit FreeInstants(const SimulationSettings& settings);

  // Adds rows of a file that a sensor should meet, and returns the numbers of their points. Terms of one file share
  // them. The sensor reads positions only, and weight depends on parameters only.
  std::vector<std::size_t> add(const std::string& file, bool ordered, const Curve& targets,
                               const CostExpression& sensor, const CostExpression& weight);

  struct Instant {
    double tau = 0;         // [s]
    std::size_t block = 0;  // points of one block have one instant
  };
  // Returns the instant of each point. progress has the meaning of RunOptions. Throws NoMotion, and
  // std::invalid_argument if drives leave some freedom.
  std::vector<Instant> nearest(const Mechanism& mechanism, const std::function<bool(double t)>& progress = {}) const;
  // Returns whether an instant lies within the run, so that dD/dt = 0 there.
  bool is_inside(double tau) const { return tau > settings_.start_time && tau < settings_.end_time; }

 private:
  struct Coordinate {
    std::size_t channel;
    double target;
  };
  struct Channel {
    CostExpression sensor, weight;
  };
  struct Point {
    std::string file;
    bool ordered;
    std::size_t row;
    std::vector<Coordinate> coordinates;
  };
  struct Motion;
  struct Block;
  struct Scan;
  Motion motion_at(const Mechanism& mechanism, const std::vector<double>& times,
                   const std::function<bool(double t)>& progress) const;

  SimulationSettings settings_;  // of the solved motion
  std::vector<Channel> channels_;
  std::vector<Point> points_;
};

}  // namespace mbsopt::inline optim
