#include "optim/objective/curvature_of_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// The Gauss-Legendre rule on [0, 1].
constexpr std::array<double, 3> kNodes{0.5 - 0.3872983346207417, 0.5, 0.5 + 0.3872983346207417},
    kWeights{5.0 / 18, 8.0 / 18, 5.0 / 18};

}  // namespace

// I, I_rho and I_rhorho of one part of an objective, summed instant by instant, and its Hessian.
class CurvatureOfRun::Gathered {
 public:
  Gathered(const Objective& objective, const ObjectivePart& part, Index variables)
      : objective_(objective), part_(part) {
    I_rho_.setZero(variables);
    I_rhorho_.setZero(variables, variables);
  }

  void add_running(double weight, const SecondOrder& x) {
    const Derivatives m = objective_.integrand(x.value - shifted(x.value), part_);
    I_ += weight * m.value;
    I_rho_ += weight * m.first * x.first;
    I_rhorho_ += weight * (m.second * x.first * x.first.transpose() + m.first * x.second);
  }
  void add_value(const SecondOrder& x) { I_rhorho_ += x.second; }

  // d^2 psi/drho^2 = psi_I I_rhorho + psi_II I_rho I_rho'
  MatrixXd hessian() const {
    if (!objective_.mean() || I_ == 0) return I_rhorho_;
    const Derivatives psi = objective_.of_integral(I_, part_);
    return part_.factor * (psi.first * I_rhorho_ + psi.second * I_rho_ * I_rho_.transpose());
  }

 private:
  // x0 of an extreme is the extreme so far; the Hessian does not depend on it. Otherwise it is 0.
  double shifted(double x) {
    if (part_.side == 0) return 0;
    if (part_.side * x > part_.side * x0_) {
      const double factor = objective_.integrand(x0_ - x, part_).value;  // 0 at first
      I_ *= factor;
      I_rho_ *= factor;
      I_rhorho_ *= factor;
      x0_ = x;
    }
    return x0_;
  }

  const Objective& objective_;
  const ObjectivePart part_;
  double I_ = 0, x0_ = -part_.side * std::numeric_limits<double>::infinity();
  VectorXd I_rho_;
  MatrixXd I_rhorho_;
};

// An instant of the run at which expressions are evaluated.
struct CurvatureOfRun::Look {
  double time = 0;
  double weight = 0;                           // of the running expressions; 0: none of them
  std::size_t objective = 0;                   // else: of this one
  const CostExpression* expression = nullptr;  // this one
};

CurvatureOfRun::CurvatureOfRun(std::span<const Objective> objectives, const std::vector<int>& variables)
    : objectives_(objectives), variables_(variables) {
  for (const Objective& objective : objectives) {
    if (objective.is_written_in_cpp())
      throw std::invalid_argument("the objective '" + objective.name() +
                                  "' is written in C++ and gives no second derivatives");
    if (objective.free_instants())
      throw std::invalid_argument("the objective '" + objective.name() +
                                  "' tracks points of free timing, which Gauss-Newton Hessians do not know");
    std::vector<Gathered>& parts = gathered_.emplace_back();
    for (const ObjectivePart& part : objective.parts())
      parts.emplace_back(objective, part, static_cast<Index>(variables.size()));
  }
}

CurvatureOfRun::~CurvatureOfRun() = default;

TangentSampling CurvatureOfRun::sampling(const Mechanism& mechanism, const StepSequence& steps,
                                         const SimulationSettings& settings) {
  constexpr int kPanels = 30;  // of a run without given steps: 90 looks, as a report has some 100 rows
  TangentSampling sampling;
  sampling.reads_positions = true;
  const auto look_at = [&](double t, double weight, std::size_t objective, const CostExpression* expression) {
    looks_.push_back({t, weight, objective, expression});
    if (expression && !expression->bind(mechanism)->reads_positions()) sampling.reads_positions = false;
  };
  const auto look_at_panel = [&](double t, double h) {
    for (std::size_t j = 0; j < kNodes.size(); ++j) look_at(t + kNodes[j] * h, kWeights[j] * h, 0, nullptr);
  };
  looks_.clear();
  bool integrates = false;
  for (const Objective& o : objectives_) {
    if (!o.running()) continue;
    integrates = true;
    if (!o.running()->bind(mechanism)->reads_positions()) sampling.reads_positions = false;
  }
  for (std::size_t i = 0; integrates && i < steps.times.size(); ++i) look_at_panel(steps.times[i], steps.sizes[i]);
  const double h = (settings.end_time - settings.start_time) / kPanels;
  for (int k = 0; integrates && steps.times.empty() && k < kPanels; ++k) look_at_panel(settings.start_time + k * h, h);
  for (std::size_t i = 0; i < objectives_.size(); ++i) {
    if (objectives_[i].terminal()) look_at(settings.end_time, 0, i, &*objectives_[i].terminal());
    for (const Objective::Sample& sample : objectives_[i].samples()) look_at(sample.time, 0, i, &sample.value);
  }
  std::ranges::stable_sort(looks_, {}, &Look::time);
  for (const Look& look : looks_) sampling.times.push_back(look.time);
  sampling.observe = [this, &mechanism](std::size_t index, const StatePoint& state, const MatrixXd& y_rho) {
    const Look& look = looks_[index];
    if (look.expression)
      return gathered_[look.objective].front().add_value(
          look.expression->second_order(mechanism, state, y_rho, variables_));
    for (std::size_t i = 0; i < objectives_.size(); ++i) {
      if (!objectives_[i].running()) continue;
      const SecondOrder x = objectives_[i].running()->second_order(mechanism, state, y_rho, variables_);
      for (Gathered& part : gathered_[i]) part.add_running(look.weight, x);
    }
  };
  return sampling;
}

MatrixXd CurvatureOfRun::matrix(std::size_t objective, const VectorXd& rho) const {
  MatrixXd H = gathered_[objective].front().hessian();
  for (std::size_t p = 1; p < gathered_[objective].size(); ++p) H += gathered_[objective][p].hessian();
  objectives_[objective].add_parameters_only_hessian(rho, variables_, H);
  return H;
}

}  // namespace mbsopt::inline optim
