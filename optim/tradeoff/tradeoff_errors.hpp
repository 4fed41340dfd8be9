// The errors of an answer against the right one, quantity by quantity. Each error is one number:
//
//   motion     largest distance (sampled_motion.hpp) over 100 times, relative to the largest distance from its start
//   sensors    largest over sensors and times of |s - s*|, relative to that sensor's largest |s*|
//   objective  |psi - psi*| / |psi*|
//   gradient   of an objective: |D (g - g*)| / |D g*|, D: sizes of the parameters, on the diagonal
//
// The right answer may be zero, or so small that two methods do not agree on its first three digits (`clearly` sets
// another limit). Then the error of the motion, an objective or a gradient is absolute, and a sensor is left out.
//
// A deviation is an error with its sign: (psi - psi*) / |psi*|, and for a gradient its part along the right one, (D (g
// - g*))' D g* / |D g*|^2. If it changes sign from a setting to the next, an error passes through zero.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "optim/tradeoff/tradeoff_runs.hpp"

namespace mbsopt::inline optim {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();  // an error that is not there

enum class QuantityKind { motion, sensors, objective, gradient };

struct Quantity {
  QuantityKind kind = QuantityKind::motion;
  std::string name;                 // "motion", "sensors", "travel" ("objective motion"), "gradient of travel"
  std::string objective_name = {};  // of objective, gradient
  Eigen::Index objective = 0;       // of objective, gradient
  bool relative = true;
  double scale = 1;        // divisor of the error
  double certificate = 0;  // difference of two methods in the same measure

  bool is_uncertain() const { return certificate >= 1e-6; }  // 1e-9 and less are usual
};

class TradeoffErrors {
 public:
  // Takes two answers that should be the same, by different methods; the first is the more exact one. Each has the
  // motion and any gradients. Errors are relative to quantities that are `clearly` times as large as the difference of
  // the two.
  TradeoffErrors(const TradeoffRuns& runs, Answer exact, const Answer& second, double clearly = 1e3);

  const Answer& exact() const { return exact_; }
  const std::vector<Quantity>& quantities() const { return quantities_; }
  // The largest distance of the motion from its start [m], and whether that is more than rounding.
  double extent() const { return distance_.extent(exact_.motion, exact_.y_initial); }
  bool moves() const { return quantities_.front().relative || quantities_.front().is_uncertain(); }
  // One error per quantity; NaN if the answer does not contain it.
  Eigen::VectorXd of(const Answer& answer) const { return each(&TradeoffErrors::error, answer); }
  // Likewise the deviations; NaN for the motion and the sensors, which have no single sign.
  Eigen::VectorXd deviations(const Answer& answer) const { return each(&TradeoffErrors::deviation, answer); }

 private:
  using Measure = double (TradeoffErrors::*)(const Quantity& quantity, const Answer& answer) const;
  double error(const Quantity& quantity, const Answer& answer) const;
  double deviation(const Quantity& quantity, const Answer& answer) const;
  Eigen::VectorXd each(Measure measure, const Answer& answer) const;
  bool is_known(double size, double apart) const { return size > clearly_ * apart; }
  bool has(const Quantity& quantity, const Answer& answer) const;
  double gradient_size(const Eigen::Ref<const Eigen::RowVectorXd>& gradient) const;

  MotionDistance distance_;
  Answer exact_;
  double clearly_;
  Eigen::VectorXd sensor_scale_;  // 0: left out
  Eigen::VectorXd parameter_size_;
  std::vector<Quantity> quantities_;
};

}  // namespace mbsopt::inline optim
