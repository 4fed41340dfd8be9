#include "optim/fit/identification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "core/expression/counted.hpp"
#include "core/linear/dense.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "optim/differences/difference_comparison.hpp"
#include "optim/fit/distributions.hpp"
#include "optim/fit/fit_context.hpp"
#include "optim/fit/fit_search.hpp"
#include "optim/fit/fit_warnings.hpp"
#include "optim/fit/windows.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/objective/integration_error.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const IdentificationSpec& checked(const Problem& problem, const std::vector<CsvTable>& data) {
  if (!problem.identification) throw std::invalid_argument("identification: is missing");
  const IdentificationSpec& spec = *problem.identification;
  if (spec.experiments.empty()) throw std::invalid_argument("identification.experiments: is empty");
  if (data.size() != spec.experiments.size())
    throw std::invalid_argument(fmt::format("identification.experiments: {}, but {} of data",
                                            counted(spec.experiments.size(), "experiment"),
                                            counted(data.size(), "table")));
  for (std::size_t e = 0; e < spec.experiments.size(); ++e)
    for (std::size_t d = 0; d < e; ++d)
      if (spec.experiments[d].name == spec.experiments[e].name)
        throw std::invalid_argument(
            fmt::format("{}.name: '{}' is taken already", place_of(spec, e), spec.experiments[e].name));
  if (std::ranges::all_of(spec.experiments, &ExperimentSpec::validate))
    throw std::invalid_argument("identification.experiments: all of them validate, none is fitted");
  return spec;
}

// The diagonal of A C A'.
VectorXd variances_by(const MatrixXd& A, const MatrixXd& C) { return (A * C).cwiseProduct(A).rowwise().sum(); }

// Has no residuals if nothing could be simulated.
LeastSquaresResult refitted(const FitContext& fit, ExperimentStack& stack) {
  LeastSquaresResult found;
  if (stack.unknowns().empty()) {
    found.point = stack.at(found.x);
    found.message = found.point.ok ? "simulated" : "could not be simulated: " + found.point.message;
    if (!found.point.ok) found.point.z.resize(0);
  } else {
    found = refit(fit, stack);
    found.message = "refitted, " + found.message;
  }
  return found;
}

// The refit of its own parameters f takes the shared ones s as exact, and compensates their errors as far as it can:
//   f_s = -J_f^+ J_s,   cov(f) = own + f_s cov(s) f_s',   dz/ds = J_s + J_f f_s
// So errors of s add to those of f, and to the intervals of prediction.
void add_errors_of_shared(FitContext& fit, std::size_t e, const ExperimentStack& stack, const VectorXd& x,
                          FitStatistics& own, std::size_t first) {
  std::vector<UnknownParameter> all = stack.unknowns();  // with their values; then the shared ones
  const Index F = std::ssize(all);
  const VectorXd values = stack.scaling().to_rho(x);
  for (Index k = 0; k < F; ++k) all[static_cast<std::size_t>(k)].description.value = values(k);
  for (const UnknownParameter& u : unknowns_of_fit(fit.scene, fit.spec)) {
    if (!u.shared) break;  // the shared unknowns come first
    all.push_back(u);
    all.back().description.value = fit.shared(u.parameter);
  }
  const Index S = std::ssize(all) - F;
  ExperimentStack whole = stack_of(fit, {e}, fit.shared, std::move(all));
  const VectorXd x_whole = whole.start();
  const LeastSquaresPoint point = whole.at(x_whole);
  fit.result.simulations += whole.simulations();
  if (!point.ok) return;
  const FitStatistics& s = fit.result.statistics;
  const MatrixXd J = whole.z_rho(point, x_whole).topRows(stack.samples()), J_f = J.leftCols(F);
  const MatrixXd of_shared = s.covariance.topLeftCorner(S, S);
  MatrixXd z_s = J.rightCols(S);
  VectorXd variances = VectorXd::Zero(J.rows());
  if (F > 0) {
    variances = variances_by(J_f, own.covariance);
    const MatrixXd f_s = -OrthogonalDecomposition(J_f).solve(z_s);
    z_s += J_f * f_s;
    own.std_error = (own.std_error.cwiseAbs2() + variances_by(f_s, of_shared)).cwiseSqrt();
    own.quantile = std::max(own.quantile, s.quantile);
  }
  predict(fit, stack, variances + variances_by(z_s, of_shared), first);
}

// Scores an experiment that validates: the shared parameters stay as fitted, the free ones are refitted.
void validate(FitContext& fit, std::size_t e) {
  ExperimentStack stack = stack_of(fit, {e}, fit.shared, free_in(fit.scene, fit.spec, e));
  const LeastSquaresResult found = refitted(fit, stack);
  ExperimentFit& scored = fit.result.experiments[e];
  scored.message = found.message;
  FitStatistics own;
  if (found.point.z.size() > 0) {
    const std::size_t first = fit.result.residuals.size();
    score_all(fit, stack, found.point.z);
    if (!stack.unknowns().empty()) own = statistics_at(fit, found, stack);
    if (!fit.result.statistics.none.empty()) withhold_errors(own, "those of the shared parameters are not known");
    if (own.none.empty()) add_errors_of_shared(fit, e, stack, found.x, own, first);
  }
  scored.refitted = described(fit, stack, found.x, own);
  fit.result.simulations += stack.simulations();
}

struct Fit {
  IdentificationResult result = {};
  std::vector<ChannelRecord> records = {};
  std::vector<DegreesCandidate> angles = {};
};

class Identification {
 public:
  Identification(const Problem& problem, const std::vector<CsvTable>& data, const IdentificationOptions& options)
      : fit_{problem.scene, checked(problem, data), data, options} {
    if (options.simulation_progress)
      fit_.go_on = [this](double t) {
        const std::scoped_lock lock(progress_lock_);
        return fit_.abandoned = fit_.abandoned || !fit_.options.simulation_progress(t), !fit_.abandoned;
      };
  }

  Fit run() {
    const Stopwatch stopwatch;
    search();
    const bool usable = fit_.result.status != SolverStatus::failed;
    for (std::size_t e = 0; e < fit_.spec.experiments.size(); ++e)
      if (fit_.spec.experiments[e].validate && usable && !fit_.abandoned && !fit_.options.preflight) validate(fit_, e);
    std::ranges::stable_sort(fit_.result.residuals, {}, &ResidualRow::experiment);
    fit_.result.wall_seconds = stopwatch.seconds();
    return {std::move(fit_.result), std::move(records_), std::move(angles_)};
  }

 private:
  void search() {
    ExperimentStack stack = fitted_stack(fit_);
    stack.remembers = fit_.options.remembers;
    const std::vector<UnknownParameter>& unknowns = stack.unknowns();
    if (stack.size < stack.variables())
      throw std::invalid_argument(fmt::format("identification: {} cannot determine {}",
                                              counted(stack.samples(), "sample"),
                                              counted(stack.variables(), "parameter")));
    FitSearch search(fit_, stack);
    const LeastSquaresResult solution = search.solved();
    fit_.result.status = fit_.abandoned ? SolverStatus::stopped : solution.status;
    fit_.result.message = fit_.abandoned ? "stopped on request" : solution.message;
    search.measure_costs_by_the_end(solution.cost_final);
    fit_.result.samples = static_cast<std::size_t>(stack.samples());
    name_experiments(fit_);
    const bool usable = solution.point.z.size() > 0;
    if (usable) {
      refuse_without_pull(stack, solution);
      assess(search, stack, solution);
    }
    warn_of(stack, solution, usable ? search.residuals_at_start() : VectorXd());
    fit_.result.parameters = described(fit_, stack, solution.x, fit_.result.statistics);
    fit_.shared = parameter_values(fit_.scene);
    for (std::size_t i = 0; i < unknowns.size(); ++i)
      if (unknowns[i].shared) fit_.shared(unknowns[i].parameter) = fit_.result.parameters[i].value;
    fit_.result.simulations += stack.simulations();
  }

  void assess(const FitSearch& search, const ExperimentStack& stack, const LeastSquaresResult& solution) {
    score_all(fit_, stack, solution.point.z);
    fit_.result.statistics = statistics_at(fit_, solution, stack);
    const MatrixXd J = stack.z_rho(solution.point, solution.x).topRows(stack.samples());
    predict(fit_, stack, variances_by(J, fit_.result.statistics.covariance), 0);
    compare_by_likelihood(fit_, stack, solution.point.z, fit_.sigmas_are_estimated ? search.sigmas().size() : 0);
  }

  // A loss without pull far out has a minimum wherever all samples are far out.
  void refuse_without_pull(const ExperimentStack& stack, const LeastSquaresResult& solution) {
    if (!fit_.result.ok()) return;
    const VectorXd& z = solution.point.z;
    const Index pulling =
        std::count_if(z.begin(), z.begin() + stack.samples(), [&](double x) { return stack.loss.at(x * x).rho1 > 0; });
    if (pulling + stack.plain >= stack.freedom_of_variables()) return;
    fit_.result.status = SolverStatus::failed;
    fit_.result.message = fmt::format(
        "{} of {} lie within the scale of the loss ({:g} sigma), beyond which a sample has no pull; they "
        "cannot determine {}. Is sigma too small, or are these other data than the model's?",
        pulling, counted(stack.samples(), "sample"), stack.loss.s(), counted(stack.variables(), "parameter"));
  }

  template <class... T>
  void warn(fmt::format_string<T...> words, T&&... values) {
    fit_.result.warnings.push_back(fmt::format(words, std::forward<T>(values)...));
  }

  void warn_of(const ExperimentStack& stack, const LeastSquaresResult& solution, const VectorXd& at_start) {
    for (const std::string& name : fit_.spec.variables)
      for (const Parameter& p : fit_.scene.parameters)
        if (p.name == name && is_held(p))
          warn("parameters.{}.lower: is {}, as is the upper bound: it stays there and is not fitted", name, *p.lower);
    if (solution.point.z.size() == 0) return;
    if (fit_.result.status == SolverStatus::no_progress)
      warn(
          "the fit ended without reaching a minimum ({}): standard errors and intervals hold at a minimum, and may be "
          "wrong here",
          fit_.result.message);
    if (estimates_sigma(fit_.spec) && !fit_.sigmas_are_estimated && !fit_.options.preflight)
      warn("the fit ended before the sigmas were estimated");
    const VectorXd z = solution.point.z.head(stack.samples());
    const Index beyond = (z.array().abs() > stack.loss.s()).count();
    if (2 * beyond > stack.samples())
      warn(
          "identification.loss: {} of {} lie beyond its scale, {:g} sigma: these are no outliers. Sigma is too small, "
          "the model is wrong, or the fit ended in another minimum",
          beyond, counted(stack.samples(), "sample"), stack.loss.s());
    check_known_sigma();
    records_ = channel_records(fit_, stack);
    if (!fit_.options.preflight)
      std::ranges::move(warnings_of_fit(fit_, records_, stack, solution), std::back_inserter(fit_.result.warnings));
    if (fit_.options.tests_angles) angles_ = degrees_candidates(fit_, records_, stack, at_start);
  }

  // Intervals that rest on the given sigmas. Beyond a factor of 2 an interval of 95 % holds the truth in 67 % at most.
  void check_known_sigma() {
    constexpr double kFactor = 2, kChance = 1e-3;  // of so large or small a sum of squares
    const FitStatistics& s = fit_.result.statistics;
    const bool by_sigmas = fit_.spec.sigma_is_known && s.variance == 1 && s.covariance_type == CovarianceType::white;
    if (!by_sigmas || fit_.options.preflight || !(s.degrees_of_freedom > 0)) return;
    const double freedom = static_cast<double>(s.degrees_of_freedom), size = std::sqrt(s.residual_variance);
    if (size <= kFactor && size >= 1 / kFactor) return;
    const double above = chi_squared_tail(freedom, freedom * s.residual_variance);
    if (std::min(above, 1 - above) > kChance) return;
    warn(
        "identification.sigma_is_known: residuals are {:.2g} sigma (rms), but standard errors and intervals rest on "
        "sigma. {}; without sigma_is_known they rest on the residuals",
        size, size > 1 ? "Sigma is too small, or the model is wrong" : "Sigma is too large");
  }

  FitContext fit_;
  std::vector<ChannelRecord> records_;
  std::vector<DegreesCandidate> angles_;
  std::mutex progress_lock_;
};

// Moves the forces of the options into the scene.
void take_user_forces(Problem& problem, IdentificationOptions& options) {
  for (const std::shared_ptr<const UserForce>& term : std::exchange(options.user_forces, {})) {
    UserForceSpec force;
    force.force = "C++";
    force.term = term;
    for (const Parameter& p : problem.scene.parameters) force.parameters.push_back({p.name, Expression::parse(p.name)});
    problem.scene.forces.push_back({fmt::format("user force {}", problem.scene.forces.size()), std::move(force)});
  }
}

Fit fit_of(const Problem& problem, const std::vector<CsvTable>& data, const IdentificationOptions& options) {
  const CutProblem cut = cut_into_windows(what_measurements_need(problem), data, options.simulation_progress);
  Fit fit = Identification(cut.problem, cut.data, options).run();
  fit.result.warnings.insert(fit.result.warnings.begin(), cut.warnings.begin(), cut.warnings.end());
  return fit;
}

// Fits again with the likely columns in degrees, then with all candidates, which one logger wrote. Returns the
// candidates about columns that are then explained better.
std::vector<std::string> confirmed(const std::vector<DegreesCandidate>& candidates, const Problem& problem,
                                   const std::vector<CsvTable>& data, const IdentificationOptions& options) {
  constexpr double kGain = 0.5;  // of what is unexplained; chance and a smaller signal change it far less
  const std::vector<ExperimentSpec>& experiments = problem.identification->experiments;
  IdentificationOptions again = options;
  again.progress = {};
  again.remembers = again.tests_angles = false;
  std::vector<std::string> words;
  for (const bool all : {false, true}) {
    if (!words.empty() || (all && std::ranges::all_of(candidates, &DegreesCandidate::is_likely))) break;
    std::vector<CsvTable> converted = data;
    for (const DegreesCandidate& c : candidates)
      for (std::size_t e = 0; e < data.size(); ++e)
        if ((all || c.is_likely) && record_name(experiments[e]) == c.record && data[e].has_column(c.column))
          for (double& x : converted[e].columns[data[e].find_column(c.column)]) x *= std::numbers::pi / 180;
    const std::vector<ChannelRecord> degrees = fit_of(problem, converted, again).records;
    for (const DegreesCandidate& c : candidates) {
      const auto record = std::ranges::find_if(
          degrees, [&](const ChannelRecord& r) { return r.record == c.record && r.column == c.column; });
      const double before = c.unexplained, after = record == degrees.end() ? 1 : record->unexplained();
      if ((all || c.is_likely) && after <= kGain * before)
        words.push_back(fmt::format(
            "{}: {}; in degrees, a fit leaves {:.2g} of the deviation of its values, not {:.2g}: is the column in "
            "degrees? \"unit\": \"{}\" converts it, while numbers of sigma and bias stay in {}",
            c.path, c.words, after, before, c.unit == "rad" ? "deg" : "deg/s", c.unit));
    }
  }
  return words;
}

// Moves one unknown by h. z: the residuals at u, which become those of the experiments that it acts in.
bool moved(const ExperimentStack& stack, Eigen::VectorXd u, Index k, double h, Experiment::Limits limits,
           Eigen::VectorXd& z) {
  limits.derivatives = false;
  u(k) += h;
  Index row = 0;
  for (const ExperimentStack::Member& m : stack.members()) {
    const Index n = static_cast<Index>(m.model.samples().size());
    if (std::ranges::find(m.model.unknowns(), k, &Experiment::Unknown::at) != m.model.unknowns().end()) {
      const Experiment::Residuals r = m.model.residuals(u, limits);
      if (!r.ok) return false;
      z.segment(row, n) = r.z;
    }
    row += n;
  }
  return true;
}

}  // namespace

IdentificationResult run_identification(const Problem& problem, const std::vector<CsvTable>& data,
                                        const IdentificationOptions& given) {
  IdentificationOptions options = given;
  Problem whole = problem;
  take_user_forces(whole, options);
  Fit fit = fit_of(whole, data, options);
  if (!fit.angles.empty())
    std::ranges::move(confirmed(fit.angles, whole, data, options), std::back_inserter(fit.result.warnings));
  return std::move(fit.result);
}

Problem with_fitted_values(Problem problem, const IdentificationResult& fit) {
  for (const FittedParameter& p : fit.parameters) {
    for (Parameter& shared : problem.scene.parameters)
      if (p.experiment.empty() && shared.name == p.parameter) shared.value = p.value;
    for (ExperimentSpec& e : problem.identification->experiments)
      if (e.name == p.experiment) set_override(e, p.parameter, p.value);
  }
  return problem;
}

FitStart start_of_fit(const Problem& cut, const std::vector<CsvTable>& data, const IdentificationOptions& given) {
  IdentificationOptions options = given;
  Problem problem = cut;
  take_user_forces(problem, options);
  const IdentificationSpec& spec = *problem.identification;
  std::atomic<bool> abandoned = false;
  Experiment::Limits limits;
  if (options.simulation_progress)
    limits.progress = [&](double t) {
      if (!options.simulation_progress(t)) abandoned = true;
      return !abandoned;
    };
  FitContext fit{problem.scene, spec, data, options, limits.progress};
  ExperimentStack stack = fitted_stack(fit);
  const VectorXd x = stack.start(), u = stack.scaling().to_rho(x);
  const std::vector<Experiment::Residuals> found = stack.residuals(u);

  SimulationStatistics statistics;
  name_experiments(fit);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].ok) score_experiment(fit, stack.members()[i], found[i].z);
    statistics.jumps.insert(statistics.jumps.end(), found[i].jumps.begin(), found[i].jumps.end());
  }
  FitStart start{std::move(fit.result), {}};
  if (!std::ranges::all_of(found, &Experiment::Residuals::ok)) return start;
  Scene scene = problem.scene;
  scene.simulation = {};  // whose other warnings are said elsewhere
  std::vector<std::string> said = simulation_warnings(scene, scene.simulation, statistics);

  DifferenceComparison comparison;
  const LeastSquaresPoint at = stack.collected(found, x);
  comparison.f = at.z.head(stack.samples());
  comparison.f_rho = stack.z_rho(at, x).topRows(stack.samples());
  for (const UnknownParameter& unknown : stack.unknowns())
    comparison.variables.push_back(compared_variable(name_of(unknown, spec), unknown.description));
  comparison.groups = {{"the residuals", 0, comparison.f.size()}};
  comparison.go_on = [&] { return !abandoned; };
  comparison.threads = options.threads;
  comparison.at = [&](std::size_t k, double h) -> std::optional<VectorXd> {
    VectorXd z = comparison.f;
    if (!moved(stack, u, static_cast<Index>(k), h, limits, z)) return std::nullopt;
    return z;
  };
  comparison.tighter = [&]() -> std::optional<VectorXd> {
    const std::optional<Scene> tight = with_other_tolerances(problem.scene);
    if (!tight) return std::nullopt;
    const LeastSquaresPoint there = fitted_stack({*tight, spec, data, options, limits.progress}).at(x);
    if (!there.ok) return std::nullopt;
    return there.z.head(stack.samples());
  };
  const std::vector<std::string> differences = comparison.warnings();
  said.insert(said.end(), differences.begin(), differences.end());
  if (!abandoned) start.warnings = std::move(said);
  return start;
}

}  // namespace mbsopt::inline optim
