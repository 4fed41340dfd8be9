#include "optim/objective/gauss_newton.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The Gauss-Legendre rule on [0, 1].
constexpr std::array<double, 3> kNodes{0.5 - 0.3872983346207417, 0.5, 0.5 + 0.3872983346207417},
    kWeights{5.0 / 18, 8.0 / 18, 5.0 / 18};

// I, I_rho and I_rhorho of one part of an objective, summed instant by instant, and its Hessian.
class Gathered {
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

// The instants to evaluate during the run, in the order of time.
struct Look {
  double time = 0;
  double weight = 0;                           // of the running expressions; 0: none of them
  std::size_t objective = 0;                   // else: of this one
  const CostExpression* expression = nullptr;  // this one
};

std::vector<Look> looks_of(const std::vector<Objective>& objectives, const StepSequence& steps, double end) {
  std::vector<Look> looks;
  for (std::size_t i = 0; i < steps.times.size(); ++i)
    for (std::size_t j = 0; j < kNodes.size(); ++j)
      looks.push_back({steps.times[i] + kNodes[j] * steps.sizes[i], kWeights[j] * steps.sizes[i]});
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    if (objectives[i].terminal()) looks.push_back({end, 0, i, &*objectives[i].terminal()});
    for (const Objective::Sample& sample : objectives[i].samples()) looks.push_back({sample.time, 0, i, &sample.value});
  }
  std::stable_sort(looks.begin(), looks.end(), [](const Look& a, const Look& b) { return a.time < b.time; });
  return looks;
}

}  // namespace

Hessians gauss_newton(const Evaluator& evaluator, const Evaluation& at, std::size_t count) {
  Hessians result;
  result.gradients = 1;
  if (!at.ok) {
    result.message = at.message;
    return result;
  }
  const std::vector<Objective>& all = evaluator.objectives();
  const std::vector<Objective> objectives(all.begin(), count > 0 ? all.begin() + static_cast<Index>(count) : all.end());
  const std::vector<int>& variables = evaluator.variables();
  require_second_order(evaluator.scene(), GradientMethod::automatic);
  bool simulated = false;
  std::vector<std::vector<Gathered>> gathered;  // the parts of each objective
  for (const Objective& objective : objectives) {
    if (objective.is_written_in_cpp())
      throw std::invalid_argument("the objective '" + objective.name() +
                                  "' is written in C++ and gives no second derivatives");
    if (objective.free_instants())
      throw std::invalid_argument("the objective '" + objective.name() +
                                  "' tracks points of free timing, which Gauss-Newton Hessians do not know");
    simulated = simulated || objective.needs_simulation();
    std::vector<Gathered>& parts = gathered.emplace_back();
    for (const ObjectivePart& part : objective.parts())
      parts.emplace_back(objective, part, static_cast<Index>(variables.size()));
  }
  if (simulated) {
    const SimulationSettings& settings = evaluator.scene().simulation;
    const Mechanism mechanism = evaluator.mechanism(at.rho, true);
    const std::vector<Look> looks = looks_of(objectives, at.steps, settings.end_time);
    TangentSampling sampling;
    for (const Look& look : looks) sampling.times.push_back(look.time);
    sampling.observe = [&](std::size_t index, const StatePoint& state, const MatrixXd& y_rho) {
      const Look& look = looks[index];
      if (look.expression)
        return gathered[look.objective].front().add_value(
            look.expression->second_order(mechanism, state, y_rho, variables));
      for (std::size_t i = 0; i < objectives.size(); ++i) {
        if (!objectives[i].running()) continue;
        const SecondOrder x = objectives[i].running()->second_order(mechanism, state, y_rho, variables);
        for (Gathered& part : gathered[i]) part.add_running(look.weight, x);
      }
    };
    const SimulationResult run =
        simulate_tlm(mechanism, settings, {}, sampling, {&at.steps, evaluator.options().progress});
    if (!run.ok()) {
      result.message = run.message;
      return result;
    }
  }
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    MatrixXd& H = result.of.emplace_back().value;
    H = gathered[i].front().hessian();
    for (std::size_t p = 1; p < gathered[i].size(); ++p) H += gathered[i][p].hessian();
    objectives[i].add_parameters_only_hessian(at.rho, variables, H);
  }
  result.ok = true;
  return result;
}

}  // namespace mbsopt::inline optim
