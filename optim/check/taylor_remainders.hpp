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

struct TaylorLine {
  std::function<std::optional<Eigen::VectorXd>(double h)> psi;                // at rho + h d; none where it fails
  std::function<Eigen::VectorXd(double h, const Eigen::VectorXd&)> rounding;  // of R, with psi there
  Eigen::VectorXd slope;                                                      // psi_rho d
};

// One check per objective, whose values at rho are psi. least_slope is that of log R over log h.
std::vector<TaylorCheck> check_taylor_remainders(const std::vector<std::string>& objectives, const Eigen::VectorXd& psi,
                                                 const TaylorLine& line, double least_slope);

}  // namespace mbsopt::inline optim
