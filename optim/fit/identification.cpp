#include "optim/fit/identification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "core/expression/counted.hpp"
#include "optim/fit/distributions.hpp"
#include "optim/fit/fit_assessment.hpp"
#include "optim/fit/fit_context.hpp"
#include "optim/fit/fit_search.hpp"
#include "optim/fit/fit_warnings.hpp"
#include "optim/fit/validation.hpp"
#include "optim/fit/windows.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline optim {
namespace {

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
  if (std::all_of(spec.experiments.begin(), spec.experiments.end(), [](const auto& e) { return e.validate; }))
    throw std::invalid_argument("identification.experiments: all of them validate, none is fitted");
  return spec;
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
    order_residuals();
    fit_.result.wall_seconds = stopwatch.seconds();
    return {std::move(fit_.result), std::move(records_), std::move(angles_)};
  }

 private:
  void search() {
    ExperimentStack stack = fitted_stack(fit_);
    stack.records = fit_.options.records;
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
      assess(stack, solution);
    }
    warn_of(stack, solution, usable ? search.residuals_at_start() : Eigen::VectorXd());
    fit_.result.parameters = described(fit_, stack, solution.x, fit_.result.statistics);
    fit_.shared = parameter_values(fit_.scene);
    for (std::size_t i = 0; i < unknowns.size(); ++i)
      if (unknowns[i].shared) fit_.shared(unknowns[i].parameter) = fit_.result.parameters[i].value;
    fit_.result.simulations += stack.simulations();
  }

  void assess(ExperimentStack& stack, const LeastSquaresResult& solution) {
    score_all(fit_, stack, solution.point.z, fit_.sigmas_are_estimated);
    fit_.result.statistics = statistics_at(fit_, solution, stack);
    const Eigen::MatrixXd J = stack.z_rho(solution.point, solution.x).topRows(stack.samples());
    predict(fit_, stack, (J * fit_.result.statistics.covariance).cwiseProduct(J).rowwise().sum(), 0);
    const std::size_t sigmas = fit_.sigmas_are_estimated ? SigmaEstimation(stack, fit_.spec).scale_groups().size() : 0;
    compare_by_likelihood(fit_, stack, solution.point.z, sigmas);
  }

  // A loss without pull far out has a minimum wherever all samples are far out.
  void refuse_without_pull(const ExperimentStack& stack, const LeastSquaresResult& solution) {
    if (!fit_.result.ok()) return;
    const Eigen::VectorXd& z = solution.point.z;
    const Eigen::Index pulling =
        std::count_if(z.begin(), z.begin() + stack.samples(), [&](double x) { return stack.loss.at(x * x).rho1 > 0; });
    if (pulling + stack.plain >= stack.freedom_of_variables()) return;
    fit_.result.status = SolverStatus::failed;
    fit_.result.message = fmt::format(
        "{} of {} lie within the scale of the loss ({:g} sigma), beyond which a sample has no pull; they "
        "cannot determine {}. Is sigma too small, or are these other data than the model's?",
        pulling, counted(stack.samples(), "sample"), stack.loss.s(), counted(stack.variables(), "parameter"));
  }

  void warn_of(const ExperimentStack& stack, const LeastSquaresResult& solution, const Eigen::VectorXd& at_start) {
    for (const std::string& name : fit_.spec.variables)
      for (const Parameter& p : fit_.scene.parameters)
        if (p.name == name && is_held(p))
          fit_.result.warnings.push_back(fmt::format(
              "parameters.{}.lower: is {}, as is the upper bound: it stays there and is not fitted", name, *p.lower));
    if (solution.point.z.size() == 0) return;
    if (fit_.result.status == SolverStatus::no_progress)
      fit_.result.warnings.push_back(
          fmt::format("the fit ended without reaching a minimum ({}): standard errors and intervals hold at a minimum, "
                      "and may be wrong here",
                      fit_.result.message));
    if (estimates_sigma(fit_.spec) && !fit_.sigmas_are_estimated && !fit_.options.preflight)
      fit_.result.warnings.push_back("the fit ended before the sigmas were estimated");
    const Eigen::VectorXd z = solution.point.z.head(stack.samples());
    const Eigen::Index beyond = (z.array().abs() > stack.loss.s()).count();
    if (2 * beyond > stack.samples())
      fit_.result.warnings.push_back(fmt::format(
          "identification.loss: {} of {} lie beyond its scale, {:g} sigma: these are no outliers. Sigma is too small, "
          "the model is wrong, or the fit ended in another minimum",
          beyond, counted(stack.samples(), "sample"), stack.loss.s()));
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
    fit_.result.warnings.push_back(fmt::format(
        "identification.sigma_is_known: residuals are {:.2g} sigma (rms), but standard errors and intervals rest on "
        "sigma. {}; without sigma_is_known they rest on the residuals",
        size, size > 1 ? "Sigma is too small, or the model is wrong" : "Sigma is too large"));
  }

  void order_residuals() {
    std::stable_sort(fit_.result.residuals.begin(), fit_.result.residuals.end(),
                     [](const ResidualRow& a, const ResidualRow& b) { return a.experiment < b.experiment; });
  }

  FitContext fit_;
  std::vector<ChannelRecord> records_;
  std::vector<DegreesCandidate> angles_;
  std::mutex progress_lock_;
};

Fit fit_of(const Problem& problem, const std::vector<CsvTable>& data, const IdentificationOptions& options) {
  const CutProblem cut =
      cut_into_windows(what_measurements_need(problem), data, options.user_forces, options.simulation_progress);
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
  IdentificationOptions again;
  again.user_forces = options.user_forces;
  again.simulation_progress = options.simulation_progress;
  again.preflight = options.preflight;
  again.threads = options.threads;
  again.tests_angles = false;
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

}  // namespace

IdentificationResult run_identification(const Problem& problem, const std::vector<CsvTable>& data,
                                        const IdentificationOptions& options) {
  Fit fit = fit_of(problem, data, options);
  if (!fit.angles.empty())
    std::ranges::move(confirmed(fit.angles, problem, data, options), std::back_inserter(fit.result.warnings));
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

}  // namespace mbsopt::inline optim
