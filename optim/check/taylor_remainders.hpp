// The Taylor test of a gradient, along one direction d on frozen steps:
//
//   R(h) = |psi(rho + h d) - psi(rho) - h psi_rho d|
//
// If R is well above rounding, it falls by 4 when h is halved. Errors of derivatives fall as h; kinks do not fall.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "optim/check/checked_run.hpp"

namespace mbsopt::inline optim {

// A remainder is clear of rounding if it exceeds it so many times.
inline constexpr double kTaylorClear = 100;

struct TaylorRow {
  double h = 0, remainder = 0;
};
struct TaylorCheck {
  std::string objective;
  std::vector<TaylorRow> rows;  // h falling; empty where no step could be evaluated
  std::optional<double> slope;  // of the part above rounding; none where all of it is rounding: linear along d
  bool passed = false;
};

// One check per objective. slope: psi_rho d. rounding: of R, with psi there. least_slope: of log R over log h.
std::vector<TaylorCheck> check_taylor_remainders(
    CheckedRun& run, const Eigen::VectorXd& d, const Eigen::VectorXd& slope,
    const std::function<Eigen::VectorXd(double h, const Eigen::VectorXd& psi)>& rounding, double least_slope);

}  // namespace mbsopt::inline optim
