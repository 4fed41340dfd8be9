#include "optim/tradeoff/tradeoff_errors.hpp"

#include <algorithm>
#include <cmath>

#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;

TradeoffErrors::TradeoffErrors(const TradeoffRuns& runs, Answer exact, const Answer& second, double clearly)
    : distance_(runs.mechanism()), exact_(std::move(exact)), clearly_(clearly) {
  const std::vector<Parameter>& parameters = runs.scene().parameters;
  parameter_size_.resize(std::ssize(parameters));
  std::ranges::transform(parameters, parameter_size_.begin(),
                         [](const Parameter& p) { return typical_size(p, p.value); });
  const Eigen::MatrixXd& sensors = exact_.motion.sensors;
  sensor_scale_.setZero(sensors.rows());
  for (Index s = 0; s < sensors.rows(); ++s) {
    const double size = sensors.row(s).cwiseAbs().maxCoeff();
    if (is_known(size, (sensors.row(s) - second.motion.sensors.row(s)).cwiseAbs().maxCoeff())) sensor_scale_(s) = size;
  }
  const auto add = [&](Quantity q, double size) {
    const double apart = error(q, second);  // absolute, since the scale is 1
    q.relative = q.kind == QuantityKind::sensors || is_known(size, apart);
    if (q.relative) q.scale = size;
    q.certificate = error(q, second);
    quantities_.push_back(std::move(q));
  };
  add({QuantityKind::motion, "motion"}, extent());
  if ((sensor_scale_.array() > 0).any()) add({QuantityKind::sensors, "sensors"}, 1);
  const bool gradients = exact_.psi_rho.size() > 0 && second.psi_rho.size() > 0;
  for (const bool gradient : {false, true}) {
    for (Index i = 0; i < std::ssize(runs.objectives()); ++i) {
      const Objective& o = runs.objectives()[static_cast<std::size_t>(i)];
      const std::string& name = o.name();
      if (!o.needs_simulation() || (gradient && !gradients)) continue;
      if (gradient)
        add({QuantityKind::gradient, "gradient of " + name, name, i}, gradient_size(exact_.psi_rho.row(i)));
      else
        add({QuantityKind::objective, name == "motion" || name == "sensors" ? "objective " + name : name, name, i},
            std::abs(exact_.psi(i)));
    }
  }
}

double TradeoffErrors::gradient_size(const Eigen::Ref<const Eigen::RowVectorXd>& gradient) const {
  return gradient.transpose().cwiseProduct(parameter_size_).norm();
}

bool TradeoffErrors::has(const Quantity& q, const Answer& answer) const {
  if (q.kind == QuantityKind::objective) return answer.psi.size() > q.objective;
  if (q.kind == QuantityKind::gradient) return answer.psi_rho.rows() > q.objective;
  return answer.motion.states.cols() == exact_.motion.states.cols();
}

double TradeoffErrors::error(const Quantity& q, const Answer& answer) const {
  if (!has(q, answer)) return kNaN;
  if (q.kind == QuantityKind::motion) return distance_.between(answer.motion, exact_.motion) / q.scale;
  if (q.kind == QuantityKind::objective) return std::abs(answer.psi(q.objective) - exact_.psi(q.objective)) / q.scale;
  if (q.kind == QuantityKind::gradient)
    return gradient_size(answer.psi_rho.row(q.objective) - exact_.psi_rho.row(q.objective)) / q.scale;
  double largest = 0;  // of the sensors
  for (Index s = 0; s < sensor_scale_.size(); ++s) {
    if (!(sensor_scale_(s) > 0)) continue;
    const double apart = (answer.motion.sensors.row(s) - exact_.motion.sensors.row(s)).cwiseAbs().maxCoeff();
    if (!std::isfinite(apart)) return apart;
    largest = std::max(largest, apart / sensor_scale_(s));
  }
  return largest;
}

double TradeoffErrors::deviation(const Quantity& q, const Answer& answer) const {
  if (!has(q, answer)) return kNaN;
  if (q.kind == QuantityKind::objective) return (answer.psi(q.objective) - exact_.psi(q.objective)) / q.scale;
  if (q.kind != QuantityKind::gradient) return kNaN;
  const Eigen::VectorXd right = exact_.psi_rho.row(q.objective).transpose().cwiseProduct(parameter_size_);
  const Eigen::VectorXd change = (answer.psi_rho.row(q.objective) - exact_.psi_rho.row(q.objective)).transpose();
  return change.cwiseProduct(parameter_size_).dot(right.normalized()) / q.scale;
}

Eigen::VectorXd TradeoffErrors::each(Measure measure, const Answer& answer) const {
  Eigen::VectorXd values = Eigen::VectorXd::Constant(std::ssize(quantities_), kNaN);
  for (Index q = 0; q < values.size() && answer.ok; ++q)
    values(q) = (this->*measure)(quantities_[static_cast<std::size_t>(q)], answer);
  return values;
}

}  // namespace mbsopt::inline optim
