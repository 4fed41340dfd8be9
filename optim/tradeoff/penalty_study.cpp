#include "optim/tradeoff/penalty_study.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include "core/dynamics/spatial_dynamics.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;

// Accelerations at the states of a motion, one column each; a column of NaN if they cannot be computed.
Eigen::MatrixXd accelerations(const Mechanism& mechanism, const FormulationSettings& formulation,
                              const SampledMotion& motion) {
  SpatialDynamics dynamics(mechanism, formulation);
  const Index n = mechanism.states();
  Eigen::MatrixXd a(n / 2, motion.states.cols());
  Eigen::VectorXd ydot(n);
  for (Index i = 0; i < a.cols(); ++i) {
    if (!dynamics.evaluate(motion.times[static_cast<std::size_t>(i)], motion.states.col(i), motion.angles.col(i), ydot))
      ydot.setConstant(kNaN);
    a.col(i) = ydot.tail(n / 2);
  }
  return a;
}

double largest_relative_error(const Eigen::MatrixXd& of, const Eigen::MatrixXd& against) {
  double largest = 0;
  for (Index i = 0; i < of.cols(); ++i) {
    const double size = against.col(i).cwiseAbs().maxCoeff();
    const double error = (of.col(i) - against.col(i)).cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
    if (!std::isfinite(error)) return kNaN;
    if (size > 0) largest = std::max(largest, error / size);
  }
  return largest;
}

class Study : TradeoffMeasurement {
 public:
  Study(const Scene& scene, const std::vector<Objective>& objectives, const std::vector<double>& alphas,
        const TradeoffOptions& options)
      : TradeoffMeasurement(scene, objectives, options),
        alphas_(alphas),
        // Each alpha has three runs and their repetitions.
        seconds_per_run_(std::max(1.0, options.budget_seconds / (5 * static_cast<double>(alphas.size() + 1)))) {}

  PenaltyStudy run() {
    constexpr int kRounds = 3;
    if (find_reference(false) && !interrupted()) {
      choose_settings();
      measure(setting(constrained(own().formulation)), seconds_per_run_);
      const Eigen::MatrixXd exact = accelerations(runs_.mechanism(), exact_formulation(), motion());
      for (const double alpha : alphas_) {
        if (interrupted()) break;
        add_row(alpha, exact);
        report("alpha", static_cast<double>(study_.rows.size()) / static_cast<double>(alphas_.size()));
      }
      time_again(kRounds);
    }
    study_.table = finish();
    return std::move(study_);
  }

 private:
  const SimulationSettings& own() const { return runs_.scene().simulation; }
  const SampledMotion& motion() const { return result_.reference.errors->exact().motion; }

  void choose_settings() {
    constexpr double kRtol = 1e-9;
    const bool is_penalty = own().formulation.type == FormulationType::penalty;
    study_.formulation = is_penalty ? own().formulation : FormulationSettings::penalty();
    // Takes the explicit method, unless stiffness excluded it from the reference.
    const TradeoffReference& r = result_.reference;
    const bool is_explicit = r.first.integrator == "dopri853" || r.second.integrator == "dopri853";
    base_ = with_tolerance(own(), is_explicit ? "dopri853" : "radau5", kRtol);
    study_.integrator = base_.integrator;
  }

  TradeoffSetting setting(const FormulationSettings& formulation) const {
    TradeoffSetting setting{
        formulation.type == FormulationType::penalty ? "penalty" : "augmented Lagrangian", base_, {}};
    setting.simulation.formulation = formulation;
    return setting;
  }
  // Solves to rounding. Its alpha is none of the study's, so that no column compares a setting with itself.
  static FormulationSettings exact_formulation() {
    FormulationSettings f;
    f.alpha = 3e7, f.tolerance = 1e-15;
    return f;
  }

  void add_row(double alpha, const Eigen::MatrixXd& exact) {
    PenaltyStudyRow row;
    row.alpha = alpha;
    FormulationSettings quasidefinite = study_.formulation, augmented;
    quasidefinite.alpha = augmented.alpha = alpha;
    augmented.iterations = 3;
    FormulationSettings cholesky = quasidefinite;
    quasidefinite.linear_solver = LinearSolver::quasidefinite, cholesky.linear_solver = LinearSolver::cholesky;
    const Eigen::MatrixXd a = accelerations(runs_.mechanism(), quasidefinite, motion());
    row.model_error = largest_relative_error(a, exact);
    row.rounding_error = largest_relative_error(accelerations(runs_.mechanism(), cholesky, motion()), a);
    row.augmented_error = largest_relative_error(accelerations(runs_.mechanism(), augmented, motion()), exact);

    row.quasidefinite = result_.rows.size(), row.cholesky = row.quasidefinite + 1;
    const Answer quasi = measure(setting(quasidefinite), seconds_per_run_);
    measure(setting(cholesky), seconds_per_run_);
    Answer frozen;
    if (quasi.ok) frozen = runs_.motion(setting(cholesky).simulation, within(3 * seconds_per_run_), &quasi.steps);
    row.rounding = result_.reference.errors->of(frozen, quasi);
    study_.rows.push_back(std::move(row));
  }

  const std::vector<double>& alphas_;
  const double seconds_per_run_;
  SimulationSettings base_;
  PenaltyStudy study_;
};

double alpha_of(std::string_view text, const std::string& all) {
  double alpha = 0;
  const auto [end, error] = fast_float::from_chars(text.data(), text.data() + text.size(), alpha);
  if (error != std::errc() || end != text.data() + text.size() || !(alpha > 0) || !std::isfinite(alpha))
    throw std::invalid_argument(fmt::format(
        "--alpha {}: '{}' is not a positive number; allowed: 1e2:1e16 (powers of ten), or a list as 1e5,1e7", all,
        text));
  return alpha;
}

}  // namespace

PenaltyStudy study_penalty(const Scene& scene, const std::vector<Objective>& objectives,
                           const std::vector<double>& alphas, const TradeoffOptions& options) {
  return Study(scene, objectives, alphas, options).run();
}

std::vector<double> alphas_of(const std::string& text) {
  std::vector<double> alphas;
  if (const std::size_t colon = text.find(':'); colon != std::string::npos) {
    const double low = alpha_of(std::string_view(text).substr(0, colon), text),
                 high = alpha_of(std::string_view(text).substr(colon + 1), text);
    if (low > high) throw std::invalid_argument(fmt::format("--alpha {}: the first must not be larger", text));
    if (high / low > 1e40) throw std::invalid_argument(fmt::format("--alpha {}: more than 40 powers of ten", text));
    for (int k = 0; low * std::pow(10, k) <= high * (1 + 1e-9); ++k) alphas.push_back(low * std::pow(10, k));
    return alphas;
  }
  std::string_view rest = text;
  for (bool more = true; more;) {
    const std::size_t comma = rest.find(',');
    alphas.push_back(alpha_of(rest.substr(0, comma), text));
    more = comma != std::string_view::npos;
    if (more) rest.remove_prefix(comma + 1);
  }
  return alphas;
}

}  // namespace mbsopt::inline optim
