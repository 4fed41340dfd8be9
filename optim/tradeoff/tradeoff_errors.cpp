#include "optim/tradeoff/tradeoff_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "optim/problem/parameter_values.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;

}  // namespace

TradeoffErrors::TradeoffErrors(const TradeoffRuns& runs, Answer exact, const Answer& second, double clearly)
    : distance_(runs.mechanism()), exact_(std::move(exact)), clearly_(clearly) {
  const Scene& scene = runs.scene();
  parameter_size_.resize(static_cast<Index>(scene.parameters.size()));
  for (Index k = 0; k < parameter_size_.size(); ++k) {
    const Parameter& p = scene.parameters[static_cast<std::size_t>(k)];
    parameter_size_(k) = typical_size(p, p.value);
  }
  const Eigen::MatrixXd& sensors = exact_.motion.sensors;
  sensor_scale_.setZero(sensors.rows());
  for (Index s = 0; s < sensors.rows(); ++s) {
    const double size = sensors.row(s).cwiseAbs().maxCoeff();
    if (is_known(size, (sensors.row(s) - second.motion.sensors.row(s)).cwiseAbs().maxCoeff())) sensor_scale_(s) = size;
  }
  const auto add = [&](QuantityKind kind, std::string name, Index objective, double size) {
    Quantity q{kind, std::move(name), {}, objective, true, 1, 0};
    if (kind == QuantityKind::objective || kind == QuantityKind::gradient)
      q.objective_name = runs.objectives()[static_cast<std::size_t>(objective)].name();
    const double apart = error(q, second);  // absolute, since the scale is 1
    q.relative = kind == QuantityKind::sensors || is_known(size, apart);
    if (q.relative) q.scale = size;
    q.certificate = error(q, second);
    quantities_.push_back(std::move(q));
  };
  add(QuantityKind::motion, "motion", 0, distance_.extent(exact_.motion, exact_.y_initial));
  if ((sensor_scale_.array() > 0).any()) add(QuantityKind::sensors, "sensors", 0, 1);
  const std::vector<Objective>& objectives = runs.objectives();
  for (const QuantityKind kind : {QuantityKind::objective, QuantityKind::gradient}) {
    const bool gradient = kind == QuantityKind::gradient;
    if (gradient && (exact_.psi_rho.size() == 0 || second.psi_rho.size() == 0)) continue;
    for (std::size_t i = 0; i < objectives.size(); ++i) {
      if (!objectives[i].needs_simulation()) continue;
      const Index row = static_cast<Index>(i);
      const std::string& name = objectives[i].name();
      const bool taken = name == "motion" || name == "sensors";
      add(kind,
          (gradient ? "gradient of "
           : taken  ? "objective "
                    : "") +
              name,
          row, gradient ? gradient_size(exact_.psi_rho.row(row)) : std::abs(exact_.psi(row)));
    }
  }
}

double TradeoffErrors::gradient_size(const Eigen::Ref<const Eigen::RowVectorXd>& gradient) const {
  return gradient.transpose().cwiseProduct(parameter_size_).norm();
}

double TradeoffErrors::sensor_error(const Answer& answer) const {
  double largest = 0;
  for (Index s = 0; s < sensor_scale_.size(); ++s) {
    if (!(sensor_scale_(s) > 0)) continue;
    const double apart = (answer.motion.sensors.row(s) - exact_.motion.sensors.row(s)).cwiseAbs().maxCoeff();
    if (!std::isfinite(apart)) return apart;
    largest = std::max(largest, apart / sensor_scale_(s));
  }
  return largest;
}

double TradeoffErrors::error(const Quantity& quantity, const Answer& answer) const {
  const Index row = quantity.objective;
  switch (quantity.kind) {
    case QuantityKind::motion:
      return answer.motion.states.cols() != exact_.motion.states.cols()
                 ? kNaN
                 : distance_.between(answer.motion, exact_.motion) / quantity.scale;
    case QuantityKind::sensors:
      return answer.motion.sensors.cols() != exact_.motion.sensors.cols() ? kNaN : sensor_error(answer);
    case QuantityKind::objective:
      return answer.psi.size() <= row ? kNaN : std::abs(answer.psi(row) - exact_.psi(row)) / quantity.scale;
    case QuantityKind::gradient:
      return answer.psi_rho.rows() <= row
                 ? kNaN
                 : gradient_size(answer.psi_rho.row(row) - exact_.psi_rho.row(row)) / quantity.scale;
  }
  return kNaN;
}

double TradeoffErrors::deviation(const Quantity& quantity, const Answer& answer) const {
  const Index row = quantity.objective;
  if (quantity.kind == QuantityKind::objective && answer.psi.size() > row)
    return (answer.psi(row) - exact_.psi(row)) / quantity.scale;
  if (quantity.kind == QuantityKind::gradient && answer.psi_rho.rows() > row) {
    const auto in_sizes = [&](const Answer& a) -> Eigen::VectorXd {
      return a.psi_rho.row(row).transpose().cwiseProduct(parameter_size_);
    };
    const Eigen::VectorXd exact = in_sizes(exact_);
    return (in_sizes(answer) - exact).dot(exact.normalized()) / quantity.scale;
  }
  return kNaN;
}

Eigen::VectorXd TradeoffErrors::deviations(const Answer& answer) const {
  Eigen::VectorXd deviations(static_cast<Index>(quantities_.size()));
  for (std::size_t i = 0; i < quantities_.size(); ++i)
    deviations(static_cast<Index>(i)) = answer.ok ? deviation(quantities_[i], answer) : kNaN;
  return deviations;
}

Eigen::VectorXd TradeoffErrors::of(const Answer& answer) const {
  Eigen::VectorXd errors(static_cast<Index>(quantities_.size()));
  for (std::size_t i = 0; i < quantities_.size(); ++i)
    errors(static_cast<Index>(i)) = answer.ok ? error(quantities_[i], answer) : kNaN;
  return errors;
}

}  // namespace mbsopt
