#include "optim/tradeoff/penalty_study.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string_view>

#include "core/dynamics/spatial_dynamics.hpp"
#include "optim/machine/median.hpp"

namespace mbsopt {
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
    const bool solved =
        dynamics.evaluate(motion.times[static_cast<std::size_t>(i)], motion.states.col(i), motion.angles.col(i), ydot);
    if (solved) {
      a.col(i) = ydot.tail(n / 2);
    } else {
      a.col(i).setConstant(kNaN);
    }
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

class Study {
 public:
  Study(const Scene& scene, const std::vector<Objective>& objectives, const PenaltyStudyOptions& options)
      : runs_(scene, objectives), options_(options), stopwatch_(options.clock) {}

  PenaltyStudy run() {
    find_reference();
    if (result_.ok() && !interrupted()) {
      choose_settings();
      add(constrained_settings(), result_.constrained);
      const Eigen::MatrixXd exact =
          accelerations(runs_.mechanism(), exact_formulation(), result_.reference.errors->exact().motion);
      for (const double alpha : options_.alphas) {
        if (interrupted()) break;
        add_row(alpha, exact);
        say("alpha", static_cast<double>(result_.rows.size()) / static_cast<double>(options_.alphas.size()));
      }
    }
    result_.interrupted = interrupted() || result_.reference.interrupted;
    result_.wall_seconds = stopwatch_.seconds();
    return std::move(result_);
  }

 private:
  bool interrupted() const { return options_.interrupted && options_.interrupted(); }
  void say(const std::string& doing, double done) const {
    if (options_.progress) options_.progress(doing, done);
  }
  // Each alpha has three runs and their repetitions.
  double seconds_per_run() const {
    return std::max(1.0, options_.budget_seconds / (5 * static_cast<double>(options_.alphas.size() + 1)));
  }
  RunLimit limit() const { return {seconds_per_run(), options_.interrupted, options_.clock}; }

  void find_reference() {
    say("reference", 0);
    ReferenceOptions options;
    options.seconds_per_run = std::max(10.0, options_.budget_seconds / 6);
    options.interrupted = options_.interrupted, options.clock = options_.clock;
    options.progress = [this](const std::string& doing, double done) { say("reference, " + doing, done); };
    options.gradients = false;
    result_.reference = converged_reference(runs_, options);
    result_.message = result_.reference.message;
  }

  void choose_settings() {
    const FormulationSettings& given = runs_.scene().simulation.formulation;
    result_.formulation = given.type == FormulationType::penalty ? given : FormulationSettings::penalty();
    // Takes the explicit method, unless stiffness excluded it from the reference.
    const bool is_explicit =
        result_.reference.first.integrator == "dopri853" || result_.reference.second.integrator == "dopri853";
    result_.integrator = is_explicit ? "dopri853" : "radau5";
    const SimulationSettings settings = with_tolerance(runs_.scene().simulation, result_.integrator, options_.rtol);
    result_.rtol = settings.integrator.rtol, result_.atol = settings.integrator.atol;
  }

  SimulationSettings settings(const FormulationSettings& formulation) const {
    SimulationSettings settings = with_tolerance(runs_.scene().simulation, result_.integrator, options_.rtol);
    settings.formulation = formulation;
    return settings;
  }
  SimulationSettings constrained_settings() const {
    return settings(constrained(runs_.scene().simulation.formulation));
  }
  // Solves to rounding. Its alpha is none of the study's, so that no column compares a setting with itself.
  static FormulationSettings exact_formulation() {
    FormulationSettings f;
    f.alpha = 3e7, f.tolerance = 1e-15;
    return f;
  }
  FormulationSettings penalty(double alpha, LinearSolver solver) const {
    FormulationSettings f = result_.formulation;
    f.alpha = alpha, f.linear_solver = solver;
    return f;
  }

  // Adds the errors and the time of a run, and returns its answer.
  Answer add(const SimulationSettings& settings, PenaltyRun& run) const {
    std::vector<double> seconds;
    Answer timed = runs_.values(settings, limit());
    run.statistics = timed.statistics, run.wall_seconds = timed.wall_seconds, run.message = timed.message;
    run.errors.setConstant(static_cast<Index>(result_.reference.errors->quantities().size()), kNaN);
    if (!timed.ok) return timed;
    seconds.push_back(timed.wall_seconds);
    constexpr int kRepetitions = 3;
    for (int i = 1; i < kRepetitions && i * timed.wall_seconds < seconds_per_run() && !interrupted(); ++i)
      seconds.push_back(runs_.values(settings, limit()).wall_seconds);
    run.wall_seconds = median(std::move(seconds));
    RunLimit longer = limit();
    longer.seconds *= 3;
    Answer answer = runs_.motion(settings, longer);
    run.ok = answer.ok, run.message = answer.message;
    run.errors = result_.reference.errors->of(answer);
    return answer;
  }

  void add_row(double alpha, const Eigen::MatrixXd& exact) {
    PenaltyStudyRow row;
    row.alpha = alpha;
    const FormulationSettings quasidefinite = penalty(alpha, LinearSolver::quasidefinite),
                              cholesky = penalty(alpha, LinearSolver::cholesky);
    FormulationSettings augmented;
    augmented.alpha = alpha, augmented.iterations = 3;
    const SampledMotion& motion = result_.reference.errors->exact().motion;
    const Eigen::MatrixXd a = accelerations(runs_.mechanism(), quasidefinite, motion);
    row.model_error = largest_relative_error(a, exact);
    row.rounding_error = largest_relative_error(accelerations(runs_.mechanism(), cholesky, motion), a);
    row.augmented_error = largest_relative_error(accelerations(runs_.mechanism(), augmented, motion), exact);

    const Answer quasi = add(settings(quasidefinite), row.quasidefinite);
    if (!interrupted()) add(settings(cholesky), row.cholesky);
    row.rounding.setConstant(row.quasidefinite.errors.size(), kNaN);
    if (quasi.ok && !interrupted()) {
      RunLimit longer = limit();
      longer.seconds *= 3;
      const Answer frozen = runs_.motion(settings(cholesky), longer, &quasi.steps);
      if (frozen.ok) row.rounding = TradeoffErrors(*result_.reference.errors, quasi).of(frozen);
    }
    result_.rows.push_back(std::move(row));
  }

  TradeoffRuns runs_;
  const PenaltyStudyOptions& options_;
  Stopwatch stopwatch_;
  PenaltyStudy result_;
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
                           const PenaltyStudyOptions& options) {
  return Study(scene, objectives, options).run();
}

std::vector<double> alphas_of(const std::string& text) {
  std::vector<double> alphas;
  if (const std::size_t colon = text.find(':'); colon != std::string::npos) {
    const double low = alpha_of(std::string_view(text).substr(0, colon), text),
                 high = alpha_of(std::string_view(text).substr(colon + 1), text);
    if (low > high) throw std::invalid_argument(fmt::format("--alpha {}: the first must not be larger", text));
    if (high / low > 1e40) throw std::invalid_argument(fmt::format("--alpha {}: more than 40 powers of ten", text));
    for (int k = 0;; ++k) {
      const double alpha = low * std::pow(10, k);
      if (alpha > high * (1 + 1e-9)) break;
      alphas.push_back(alpha);
    }
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

}  // namespace mbsopt
