#include "optim/tradeoff/tradeoff_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;

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
  const auto add = [&](QuantityKind kind, const std::string& name, Index objective, double size) {
    Quantity q{kind, name, {}, objective};
    if (kind == QuantityKind::objective || kind == QuantityKind::gradient) q.objective_name = name;
    if (kind == QuantityKind::objective && (name == "motion" || name == "sensors")) q.name = "objective " + name;
    if (kind == QuantityKind::gradient) q.name = "gradient of " + name;
    const double apart = error(q, second, exact_);  // absolute, since the scale is 1
    q.relative = kind == QuantityKind::sensors || is_known(size, apart);
    if (q.relative) q.scale = size;
    q.certificate = error(q, second, exact_);
    quantities_.push_back(std::move(q));
  };
  add(QuantityKind::motion, "motion", 0, distance_.extent(exact_.motion, exact_.y_initial));
  if ((sensor_scale_.array() > 0).any()) add(QuantityKind::sensors, "sensors", 0, 1);
  const std::vector<Objective>& objectives = runs.objectives();
  const bool gradients = exact_.psi_rho.size() > 0 && second.psi_rho.size() > 0;
  for (const QuantityKind kind : {QuantityKind::objective, QuantityKind::gradient}) {
    for (Index i = 0; i < std::ssize(objectives) && (gradients || kind == QuantityKind::objective); ++i) {
      const Objective& o = objectives[static_cast<std::size_t>(i)];
      if (o.needs_simulation())
        add(kind, o.name(), i,
            kind == QuantityKind::gradient ? gradient_size(exact_.psi_rho.row(i)) : std::abs(exact_.psi(i)));
    }
  }
}

double TradeoffErrors::gradient_size(const Eigen::Ref<const Eigen::RowVectorXd>& gradient) const {
  return gradient.transpose().cwiseProduct(parameter_size_).norm();
}

double TradeoffErrors::sensor_error(const Answer& answer, const Answer& exact) const {
  double largest = 0;
  for (Index s = 0; s < sensor_scale_.size(); ++s) {
    if (!(sensor_scale_(s) > 0)) continue;
    const double apart = (answer.motion.sensors.row(s) - exact.motion.sensors.row(s)).cwiseAbs().maxCoeff();
    if (!std::isfinite(apart)) return apart;
    largest = std::max(largest, apart / sensor_scale_(s));
  }
  return largest;
}

double TradeoffErrors::error(const Quantity& quantity, const Answer& answer, const Answer& exact) const {
  const Index row = quantity.objective;
  const bool sampled = answer.motion.states.cols() == exact.motion.states.cols();
  switch (quantity.kind) {
    case QuantityKind::motion:
      return sampled ? distance_.between(answer.motion, exact.motion) / quantity.scale : kNaN;
    case QuantityKind::sensors:
      return sampled ? sensor_error(answer, exact) : kNaN;
    case QuantityKind::objective:
      return answer.psi.size() <= row ? kNaN : std::abs(answer.psi(row) - exact.psi(row)) / quantity.scale;
    case QuantityKind::gradient:
      return answer.psi_rho.rows() <= row
                 ? kNaN
                 : gradient_size(answer.psi_rho.row(row) - exact.psi_rho.row(row)) / quantity.scale;
  }
  return kNaN;
}

double TradeoffErrors::deviation(const Quantity& quantity, const Answer& answer, const Answer& exact) const {
  const Index row = quantity.objective;
  if (quantity.kind == QuantityKind::objective && answer.psi.size() > row)
    return (answer.psi(row) - exact.psi(row)) / quantity.scale;
  if (quantity.kind != QuantityKind::gradient || answer.psi_rho.rows() <= row) return kNaN;
  const Eigen::VectorXd right = exact.psi_rho.row(row).transpose().cwiseProduct(parameter_size_);
  const Eigen::VectorXd change = (answer.psi_rho.row(row) - exact.psi_rho.row(row)).transpose();
  return change.cwiseProduct(parameter_size_).dot(right.normalized()) / quantity.scale;
}

Eigen::VectorXd TradeoffErrors::each(Measure measure, const Answer& answer, const Answer& exact) const {
  Eigen::VectorXd values = Eigen::VectorXd::Constant(static_cast<Index>(quantities_.size()), kNaN);
  for (std::size_t q = 0; q < quantities_.size() && answer.ok; ++q)
    values(static_cast<Index>(q)) = (this->*measure)(quantities_[q], answer, exact);
  return values;
}

}  // namespace mbsopt::inline optim
