#include "optim/fit/identification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <stdexcept>

#include "core/expression/counted.hpp"
#include "core/expression/did_you_mean.hpp"
#include "core/linear/dense.hpp"
#include "optim/fit/angle_doubts.hpp"
#include "optim/fit/distributions.hpp"
#include "optim/fit/experiment_influence.hpp"
#include "optim/fit/experiment_stack.hpp"
#include "optim/fit/profile_likelihood.hpp"
#include "optim/fit/scored_experiment.hpp"
#include "optim/fit/sigma_estimation.hpp"
#include "optim/fit/windows.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/problem/unused_parameters.hpp"
#include "optim/solver/equality_multipliers.hpp"

namespace mbsopt {
namespace {

// Effects that are the same by the physics, such as a late clock and an early start, differs by a few tolerances of the
// integration in the numbers. Measured: 1/condition of that pair is 0.3 to 8 times rtol at 1e-5 to 1e-8.
constexpr double kTolerances = 10, kLeastAccuracy = 1e-5;
// Records, from which on their sums tell a variance: Student's quantile is then 2.09, against 1.96 for any number.
constexpr std::size_t kManyRecords = 20;
constexpr double kWorse = 0.99;    // probability that a right model worsens what validates by less
constexpr double kTouches = 1e-9;  // of the bound's size: the trust region puts solutions exactly on bounds

class Identification {
 public:
  Identification(const Problem& problem, const std::vector<CsvTable>& data, const IdentificationOptions& options)
      : scene_(problem.scene), spec_(checked(problem, data)), data_(data), options_(options) {
    if (options.simulation_progress)
      go_on_ = [this](double t) {  // in any thread
        const std::scoped_lock lock(told_);
        return abandoned_ = abandoned_ || !options_.simulation_progress(t), !abandoned_;
      };
  }

  IdentificationResult run() {
    const Stopwatch stopwatch;
    fit();
    const bool usable = result_.status != SolverStatus::failed;
    for (std::size_t e = 0; e < spec_.experiments.size(); ++e)
      if (spec_.experiments[e].validate && usable && !abandoned_ && !options_.preflight) validate(e);
    order_residuals();
    result_.wall_seconds = stopwatch.seconds();
    return std::move(result_);
  }

 private:
  static const IdentificationSpec& checked(const Problem& problem, const std::vector<CsvTable>& data) {
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

  // Of the samples and the priors at a solution, in the parameters.
  FitStatistics statistics_at(const LeastSquaresResult& solution, const ExperimentStack& stack,
                              const std::vector<UnknownParameter>& unknowns) const {
    const Eigen::VectorXd u_x = stack.scaling().rho_x(solution.x);
    const Eigen::MatrixXd J = solution.point.z_x * u_x.cwiseInverse().asDiagonal();
    FitData data;
    data.J = J.topRows(stack.samples()), data.J_prior = J.middleRows(stack.samples(), stack.plain);
    data.C = J.bottomRows(stack.equalities);
    data.z = solution.point.z.head(stack.samples());
    data.rho = stack.scaling().to_rho(solution.x);
    data.names = names_of(unknowns, spec_);
    for (const UnknownParameter& u : unknowns) data.units.push_back(u.description.unit);
    data.loss = spec_.loss, data.sigma_is_known = spec_.sigma_is_known;
    data.change = u_x.cwiseAbs();
    data.covariance = covariance_for(stack);
    for (const UnknownParameter& u : unknowns) data.of_one_record.push_back(!u.shared);
    for (Eigen::Index k = 0; k < solution.x.size(); ++k)
      data.at_bound.push_back(solution.x(k) <= stack.x_lower(k) || solution.x(k) >= stack.x_upper(k));
    data.records = stack.records_in_time(), data.motions = stack.motions_in_time();
    data.record = stack.measured().cwiseQuotient(stack.sigma()).norm();
    const IntegratorSettings& integrator = scene_.simulation.integrator;
    if (!integrator.step) data.accuracy = std::min(kTolerances * integrator.rtol, kLeastAccuracy);
    if (options_.preflight) data.loss = {}, data.sigma_is_known = true, data.covariance = CovarianceType::white;
    FitStatistics statistics = fit_statistics(data);
    const bool ended = options_.preflight || solution.status == SolverStatus::converged ||
                       solution.status == SolverStatus::no_progress;
    if (abandoned_ || !ended)
      withhold_errors(statistics, "they hold at a minimum, and the fit ended before it reached one");
    return statistics;
  }

  // By the residuals of the experiments of the stack, which are scored already.
  CovarianceType covariance_for(const ExperimentStack& stack) const {
    const std::size_t records = stack.records_in_time().size();
    const bool many = records >= kManyRecords;
    if (spec_.covariance == CovarianceType::windows && records < 2) return CovarianceType::newey_west;
    if (spec_.covariance != CovarianceType::automatic) return spec_.covariance;
    for (const ExperimentStack::Member& m : stack.members())
      for (const ChannelFit& channel : result_.experiments[m.experiment].channels)
        if (!channel.analysis.white()) return many ? CovarianceType::windows : CovarianceType::newey_west;
    return CovarianceType::white;
  }

  std::vector<FittedParameter> described(const std::vector<UnknownParameter>& unknowns, const Eigen::VectorXd& values,
                                         const FitStatistics& statistics) const {
    std::vector<FittedParameter> fitted;
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      const UnknownParameter& u = unknowns[i];
      const Parameter& p = u.description;
      const Eigen::Index k = static_cast<Eigen::Index>(i);
      FittedParameter f;
      f.name = name_of(u, spec_), f.parameter = p.name, f.unit = p.unit;
      if (!u.shared) f.experiment = spec_.experiments[u.experiment].name;
      f.initial = p.value, f.value = values(k), f.lower = p.lower, f.upper = p.upper, f.prior = p.prior;
      auto touches = [&](const std::optional<double>& bound) {
        return bound && std::abs(f.value - *bound) <= kTouches * std::max(std::abs(*bound), std::abs(p.value));
      };
      f.at_lower = touches(p.lower), f.at_upper = touches(p.upper);
      if (statistics.std_error.size() > k) {
        f.std_error = statistics.std_error(k);
        f.ci95[0] = statistics.ci95(k, 0), f.ci95[1] = statistics.ci95(k, 1);
      }
      fitted.push_back(std::move(f));
    }
    return fitted;
  }

  LeastSquaresOptions solver_options() const {
    LeastSquaresOptions solver;
    solver.tolerance = spec_.tolerance;
    solver.max_iterations = options_.preflight ? 0 : spec_.max_iterations;
    return solver;
  }

  ExperimentStack::Member member(std::size_t e, const Eigen::VectorXd& rho,
                                 const std::vector<UnknownParameter>& unknowns) const {
    const std::optional<WindowOrigin>& origin = spec_.experiments[e].origin;
    return {e,
            Experiment(scene_, spec_.experiments[e], place_of(spec_, e), data_[e], rho,
                       unknowns_in(scene_, spec_, e, unknowns), options_.user_forces),
            origin && origin->continues, origin && origin->number > 1};
  }

  // of_fit: its iterations are those of the result.
  LeastSquaresResult minimised(ExperimentStack& stack, const Eigen::VectorXd& x, bool of_fit) {
    LeastSquaresOptions solver = solver_options();
    if (!of_fit) return solve_with_equalities(stack, x, solver);
    const Eigen::VectorXd sigma = stack.sigma();
    const int before = result_.iterations;
    solver.progress = [&](const LeastSquaresProgress& p) {
      if (p.iteration == 0 && !result_.history.empty()) return true;  // where the iterations so far ended
      if (apart_.empty() || cost_changes(stack)) {
        apart_.push_back(p.z);
        apart_.back().head(stack.samples()).array() *= sigma.array();
      }
      result_.history.push_back({before + p.iteration, p.cost, p.gradient_norm, p.step_norm,
                                 stack.scaling().to_rho(p.x), result_.simulations + stack.simulations()});
      return !options_.progress || options_.progress(result_.history.back());
    };
    LeastSquaresResult solution = solve_with_equalities(stack, x, solver);
    result_.iterations += solution.iterations;
    result_.evaluations += solution.evaluations, result_.failed_evaluations += solution.failed_evaluations;
    return solution;
  }

  // The estimate under a loss, with the sigmas that it estimates.
  LeastSquaresResult estimate(ExperimentStack& stack, const Loss& loss, const Eigen::VectorXd& x, bool of_fit) {
    stack.loss = loss;
    if (!of_fit || !estimates_sigma(spec_)) return minimised(stack, x, of_fit);
    SigmaEstimation sigmas(stack, spec_);
    return loss.type == LossType::squared ? without_sigmas(stack, sigmas, x) : in_turn_with_sigmas(stack, sigmas, x);
  }

  LeastSquaresResult without_sigmas(ExperimentStack& stack, SigmaEstimation& sigmas, const Eigen::VectorXd& x) {
    stack.groups = sigmas.scale_groups();
    LeastSquaresResult solution = minimised(stack, x, true);
    stack.groups.clear();
    sigmas_are_estimated_ = solution.status == SolverStatus::converged || solution.status == SolverStatus::no_progress;
    if (sigmas_are_estimated_) take(sigmas, stack, solution);
    if (solution.point.z.size() > 0) solution.cost_final = stack.cost(solution.point.z);
    return solution;
  }

  // The sigmas by the residuals of the solution, which are by these sigmas then. Returns the largest change.
  static double take(SigmaEstimation& sigmas, const ExperimentStack& stack, LeastSquaresResult& solution) {
    const Eigen::VectorXd before = stack.sigma();
    const double change = sigmas.take(solution.point.z);
    const Eigen::ArrayXd factor = before.cwiseQuotient(stack.sigma()).array();
    solution.point.z.head(stack.samples()).array() *= factor;
    solution.point.z_x.topRows(stack.samples()).array().colwise() *= factor;
    solution.cost_final = stack.cost(solution.point.z);
    return change;
  }

  LeastSquaresResult in_turn_with_sigmas(ExperimentStack& stack, SigmaEstimation& sigmas, const Eigen::VectorXd& x) {
    LeastSquaresResult solution = minimised(stack, x, true);
    for (int round = 0; solution.status == SolverStatus::converged; ++round) {
      const double change = take(sigmas, stack, solution);
      sigmas_are_estimated_ = change < kSigmaChange || round == kSigmaRounds;
      if (round == kSigmaRounds && change >= kSigmaChange)
        solution.message += fmt::format("; estimated sigmas still change by {:.1g} of themselves", change);
      if (sigmas_are_estimated_) break;
      solution = minimised(stack, solution.x, true);
    }
    return solution;
  }

  // Sigmas, the loss or the multipliers of equations change on the way.
  bool cost_changes(const ExperimentStack& stack) const {
    return estimates_sigma(spec_) || spec_.loss.type == LossType::tukey || stack.equalities > 0;
  }

  static Eigen::VectorXd by_sigmas_of(const ExperimentStack& stack, Eigen::VectorXd apart) {
    apart.head(stack.samples()).array() /= stack.sigma().array();
    return apart;
  }

  void measure_costs_by_the_end(const ExperimentStack& stack, double cost_final) {
    result_.cost_final = cost_final;
    for (std::size_t k = 0; k < apart_.size(); ++k)
      result_.history[k].cost = stack.cost(by_sigmas_of(stack, apart_[k]));
    if (!apart_.empty()) result_.cost_initial = result_.history.front().cost;
  }

  // A loss without pull far out has a minimum wherever all samples are far out.
  void refuse_without_pull(const ExperimentStack& stack, const LeastSquaresResult& solution) {
    if (!result_.ok()) return;
    const Eigen::VectorXd& z = solution.point.z;
    const Eigen::Index pulling =
        std::count_if(z.begin(), z.begin() + stack.samples(), [&](double x) { return stack.loss.at(x * x).rho1 > 0; });
    if (pulling + stack.plain >= stack.freedom_of_variables()) return;
    result_.status = SolverStatus::failed;
    result_.message = fmt::format(
        "{} of {} lie within the scale of the loss ({:g} sigma), beyond which a sample has no pull; they "
        "cannot determine {}. Is sigma too small, or are these other data than the model's?",
        pulling, counted(stack.samples(), "sample"), stack.loss.s(), counted(stack.variables(), "parameter"));
  }

  void warn_of(const ExperimentStack& stack, const LeastSquaresResult& solution) {
    for (const std::string& name : spec_.variables)
      for (const Parameter& p : scene_.parameters)
        if (p.name == name && is_held(p))
          result_.warnings.push_back(fmt::format(
              "parameters.{}.lower: is {}, as is the upper bound: it stays there and is not fitted", name, *p.lower));
    if (solution.point.z.size() == 0) return;
    if (result_.status == SolverStatus::no_progress)
      result_.warnings.push_back(
          fmt::format("the fit ended without reaching a minimum ({}): standard errors and intervals hold at a minimum, "
                      "and may be wrong here",
                      result_.message));
    if (estimates_sigma(spec_) && !sigmas_are_estimated_ && !options_.preflight)
      result_.warnings.push_back("the fit ended before the sigmas were estimated");
    const Eigen::VectorXd z = solution.point.z.head(stack.samples());
    const Eigen::Index beyond = (z.array().abs() > stack.loss.s()).count();
    if (2 * beyond > stack.samples())
      result_.warnings.push_back(fmt::format(
          "identification.loss: {} of {} lie beyond its scale, {:g} sigma: these are no outliers. Sigma is too small, "
          "the model is wrong, or the fit ended in another minimum",
          beyond, counted(stack.samples(), "sample"), stack.loss.s()));
    for (std::string& doubt : angle_doubts(scene_, spec_, data_, stack, by_sigmas_of(stack, apart_.front()), z))
      result_.warnings.push_back(std::move(doubt));
  }

  // Tukey's loss has no pull far out, so that a start there would find nothing: Huber's estimate comes first.
  LeastSquaresResult solved(ExperimentStack& stack, const Eigen::VectorXd& start, bool of_fit = true) {
    if (spec_.loss.type != LossType::tukey) return estimate(stack, spec_.loss, start, of_fit);
    LeastSquaresResult first = estimate(stack, {LossType::huber}, start, of_fit);
    if (first.status == SolverStatus::failed || first.status == SolverStatus::stopped) return first;
    return estimate(stack, spec_.loss, first.x, of_fit);
  }

  void fit() {
    const std::vector<UnknownParameter> unknowns = unknowns_of_fit(scene_, spec_);
    const VariableScaling scaling = scaling_of(unknowns);
    std::vector<ExperimentStack::Member> members;
    for (std::size_t e = 0; e < spec_.experiments.size(); ++e)
      if (!spec_.experiments[e].validate) members.push_back(member(e, parameter_values(scene_), unknowns));
    ExperimentStack stack(std::move(members), unknowns, scaling, spec_.loss);
    stack.go_on = go_on_, stack.records = options_.records, stack.threads = options_.threads;
    if (stack.size < stack.variables())
      throw std::invalid_argument(fmt::format("identification: {} cannot determine {}",
                                              counted(stack.samples(), "sample"),
                                              counted(stack.variables(), "parameter")));
    const std::vector<Eigen::Index> profiled = profiled_unknowns(unknowns);
    const LeastSquaresResult solution = solved(stack, scaling.to_x(start_of(unknowns)));
    result_.status = abandoned_ ? SolverStatus::stopped : solution.status;
    result_.message = abandoned_ ? "stopped on request" : solution.message;
    measure_costs_by_the_end(stack, solution.cost_final);
    result_.samples = static_cast<std::size_t>(stack.samples());
    result_.experiments.resize(spec_.experiments.size());
    const Eigen::VectorXd values = scaling.to_rho(solution.x);
    const bool usable = solution.point.z.size() > 0;
    if (usable) refuse_without_pull(stack, solution);
    if (usable) {
      score_all(stack, solution.point.z, sigmas_are_estimated_);
      result_.statistics = statistics_at(solution, stack, unknowns);
      predict(stack, z_in_parameters(stack, solution.point, values), result_.statistics.covariance, 0);
      find_influences(stack, solution, unknowns);
      compare_by_likelihood(stack, solution.point.z,
                            sigmas_are_estimated_ ? SigmaEstimation(stack, spec_).scale_groups().size() : 0);
    }
    warn_of(stack, solution);
    result_.parameters = described(unknowns, values, result_.statistics);
    shared_ = parameter_values(scene_);
    for (std::size_t i = 0; i < unknowns.size(); ++i)
      if (unknowns[i].shared) shared_(unknowns[i].parameter) = values(static_cast<Eigen::Index>(i));
    if (result_.status == SolverStatus::converged)
      for (const Eigen::Index k : profiled)
        if (!abandoned_) result_.profiles.push_back(profile_of(stack, k, solution.x));
    if (abandoned_) result_.status = SolverStatus::stopped, result_.message = "stopped on request";
    result_.simulations += stack.simulations();
  }

  // dz/drho of the samples.
  static Eigen::MatrixXd z_in_parameters(const ExperimentStack& stack, const LeastSquaresPoint& point,
                                         const Eigen::VectorXd& rho) {
    const Eigen::VectorXd u_x = stack.scaling().rho_x(stack.scaling().to_x(rho));
    return point.z_x.topRows(stack.samples()) * u_x.cwiseInverse().asDiagonal();
  }

  // Half-widths of the 95 % intervals for one more measurement (Seber and Wild, "Nonlinear Regression" (1989), section
  // 5.1.1), of the samples whose rows of residuals begin at `first`:
  //   t sigma sqrt(v + j covariance j'),   j = dz/drho
  void predict(const ExperimentStack& stack, const Eigen::MatrixXd& J, const Eigen::MatrixXd& covariance,
               std::size_t first) {
    const FitStatistics& s = result_.statistics;
    if (!s.none.empty() || options_.preflight) return;
    const Eigen::VectorXd variances = (J * covariance).cwiseProduct(J).rowwise().sum(), sigma = stack.sigma();
    for (Eigen::Index i = 0; i < sigma.size(); ++i) {
      ResidualRow& row = result_.residuals[first + static_cast<std::size_t>(i)];
      row.prediction = s.quantile * sigma(i) * std::sqrt(s.variance + variances(i));
      ChannelFit& channel = result_.experiments[row.experiment].channels[row.channel];
      if (std::isnan(channel.within_prediction)) channel.within_prediction = 0;
      if (std::abs(row.measured - row.model) <= row.prediction)
        channel.within_prediction += 1 / static_cast<double>(channel.samples);
    }
  }

  void find_influences(const ExperimentStack& stack, const LeastSquaresResult& solution,
                       const std::vector<UnknownParameter>& unknowns) {
    const FitStatistics& s = result_.statistics;
    const bool determined = s.none.empty() && s.unidentifiable.empty();
    if (stack.members().size() < 2 || stack.equalities > 0 || !determined || options_.preflight) return;
    const Eigen::VectorXd errors = result_.statistics.std_error.cwiseQuotient(stack.scaling().rho_x(solution.x));
    const std::vector<Eigen::VectorXd> changes = changes_without(stack, solution, unknowns);
    for (std::size_t m = 0; m < changes.size(); ++m) {
      std::optional<Influence>& most = result_.experiments[stack.members()[m].experiment].influence;
      for (Eigen::Index k = 0; k < errors.size(); ++k) {
        const UnknownParameter& unknown = unknowns[static_cast<std::size_t>(k)];
        const double change = changes[m](k) / errors(k);
        if (unknown.shared && std::isfinite(errors(k)) && (!most || std::abs(change) > std::abs(most->change)))
          most = {unknown.description.name, change};
      }
    }
  }

  // Akaike's and Bayes' criteria (Burnham and Anderson, "Model Selection and Multimodel Inference" (2002), chapter 2):
  //   AIC = 2 k - 2 log L,  BIC = k log N - 2 log L,  -2 log L = sum [z^2/v + log(2 pi v sigma^2)]
  // v is 1 where sigma is known or estimated, else it is the mean square of z and one more parameter.
  void compare_by_likelihood(const ExperimentStack& stack, const Eigen::VectorXd& z, std::size_t sigmas) {
    const double N = static_cast<double>(stack.samples()), squares = z.head(stack.samples()).squaredNorm();
    const bool scaled = sigmas == 0 && !spec_.sigma_is_known;
    const double v = scaled ? squares / N : 1;
    if (spec_.loss.type != LossType::squared || !(v > 0)) return;
    const double k = static_cast<double>(stack.freedom_of_variables()) + (scaled ? 1 : static_cast<double>(sigmas));
    const double twice = squares / v + N * std::log(2 * std::numbers::pi * v) + 2 * stack.sigma().array().log().sum();
    result_.aic = 2 * k + twice, result_.bic = k * std::log(N) + twice;
  }

  std::vector<Eigen::Index> profiled_unknowns(const std::vector<UnknownParameter>& unknowns) const {
    const std::vector<std::string> names = names_of(unknowns, spec_);
    std::vector<Eigen::Index> indices;
    for (const std::string& name : options_.profiles) {
      const auto found = std::find(names.begin(), names.end(), name);
      if (found == names.end())
        throw std::invalid_argument(fmt::format("--profile: '{}' is not fitted{}; fitted are {}", name,
                                                did_you_mean(name, names), joined(names)));
      indices.push_back(found - names.begin());
    }
    return indices;
  }

  ParameterProfile profile_of(ExperimentStack& stack, Eigen::Index k, const Eigen::VectorXd& x) {
    const FitStatistics& s = result_.statistics;
    ProfileOptions options;
    options.variable = k;
    // Where the linear model has no opinion, a hundredth of the variable.
    const double std_error = s.std_error(k) / std::abs(stack.scaling().rho_x(x)(k));
    const bool sensible = std::isfinite(std_error) && std_error > 0;
    options.first_step = sensible ? 0.5 * std_error : 0.01 * std::max(1.0, std::abs(x(k)));
    // Correlated residuals: Chandler and Bate, Biometrika 94 (2007) 167, equation 6.
    options.likelihood_scale = s.likelihood_scale * s.inflation(k), options.quantile = s.quantile;
    options.solver = solver_options();
    ParameterProfile profile{result_.parameters[static_cast<std::size_t>(k)].name, {}, {}, {}, "", ""};
    if (!(s.likelihood_scale > 0) || !std::isfinite(s.likelihood_scale) || !std::isfinite(s.quantile)) {
      profile.below = profile.above = "the residuals have no variance to measure it by";
      return profile;
    }
    const auto value_at = [&](double x_k) {
      Eigen::VectorXd at = x;
      at(k) = x_k;
      return stack.scaling().to_rho(at)(k);
    };
    options.progress = [&](const ProfilePoint& p) {
      if (abandoned_) return false;
      const bool go_on = !options_.profile_progress || options_.profile_progress(profile.name, value_at(p.x), p.tau);
      abandoned_ = !go_on;
      return go_on;
    };
    const Profile found = profile_likelihood(stack, x, options);
    for (const ProfilePoint& p : found.points)
      profile.points.push_back({value_at(p.x), p.cost, p.tau, stack.scaling().to_rho(p.variables)});
    if (found.lower) profile.lower = value_at(*found.lower);
    if (found.upper) profile.upper = value_at(*found.upper);
    profile.below = found.below, profile.above = found.above;
    return profile;
  }

  // Its free parameters refitted, the shared ones fixed.
  void validate(std::size_t e) {
    const std::vector<UnknownParameter> unknowns = free_in(scene_, spec_, e);
    const VariableScaling scaling = scaling_of(unknowns);
    ExperimentStack stack(alone(e, shared_, unknowns), unknowns, scaling, spec_.loss);
    stack.go_on = go_on_;
    const LeastSquaresResult refit = refitted(stack, unknowns);
    ExperimentFit& scored = result_.experiments[e];
    scored.message = refit.message;
    if (refit.point.z.size() > 0) {
      const std::size_t first = result_.residuals.size();
      score_all(stack, refit.point.z, false);
      FitStatistics own;
      if (!unknowns.empty()) own = statistics_at(refit, stack, unknowns);
      scored.refitted = described(unknowns, scaling.to_rho(refit.x), own);
      predict_validation(e, stack, refit, own, first);
      compare_with_start(e, unknowns, scaling, refit.point.z.head(stack.samples()).squaredNorm());
    } else if (!unknowns.empty()) {
      scored.refitted = described(unknowns, scaling.to_rho(refit.x), FitStatistics());
    }
    result_.simulations += stack.simulations();
  }

  std::vector<ExperimentStack::Member> alone(std::size_t e, const Eigen::VectorXd& shared,
                                             const std::vector<UnknownParameter>& unknowns) const {
    std::vector<ExperimentStack::Member> members;
    members.push_back(member(e, shared, unknowns));
    return members;
  }

  static LeastSquaresPoint simulated(ExperimentStack& stack, const Eigen::VectorXd& x) {
    LeastSquaresPoint point;
    point.z.setZero(stack.size), point.z_x.setZero(stack.size, stack.variables());
    stack.evaluate(x, point);
    return point;
  }

  // Without residuals where nothing could be simulated.
  LeastSquaresResult refitted(ExperimentStack& stack, const std::vector<UnknownParameter>& unknowns) {
    LeastSquaresResult refit;
    if (unknowns.empty()) {
      refit.point = simulated(stack, refit.x);
      refit.message = refit.point.ok ? "simulated" : "could not be simulated: " + refit.point.message;
      if (!refit.point.ok) refit.point.z.resize(0);
    } else {
      refit = solved(stack, stack.scaling().to_x(start_of(unknowns)), false);
      refit.message = "refitted, " + refit.message;
    }
    return refit;
  }

  // The refit takes off what the shared parameters s are in error by, as far as its own parameters f can:
  //   j = j_s - J_f (J_f^+ J_s),   variance = j cov(s) j' + j_f cov(f) j_f'
  void predict_validation(std::size_t e, const ExperimentStack& stack, const LeastSquaresResult& refit,
                          const FitStatistics& own, std::size_t first) {
    const std::vector<UnknownParameter> fitted = unknowns_of_fit(scene_, spec_);
    std::vector<UnknownParameter> all = free_in(scene_, spec_, e);
    const Eigen::Index F = static_cast<Eigen::Index>(all.size()), N = stack.samples();
    std::vector<Eigen::Index> shared;
    for (std::size_t i = 0; i < fitted.size(); ++i)
      if (fitted[i].shared) all.push_back(fitted[i]), shared.push_back(static_cast<Eigen::Index>(i));
    const VariableScaling scaling = scaling_of(all);
    ExperimentStack whole(alone(e, shared_, all), all, scaling, spec_.loss);
    whole.go_on = go_on_;
    Eigen::VectorXd rho(static_cast<Eigen::Index>(all.size()));
    if (F > 0) rho.head(F) = stack.scaling().to_rho(refit.x);
    for (std::size_t i = 0; i < shared.size(); ++i)
      rho(F + static_cast<Eigen::Index>(i)) = shared_(all[static_cast<std::size_t>(F) + i].parameter);
    const LeastSquaresPoint point = simulated(whole, scaling.to_x(rho));
    result_.simulations += whole.simulations();
    if (!point.ok || !result_.statistics.none.empty() || !own.none.empty()) return;
    Eigen::MatrixXd J = z_in_parameters(whole, point, rho);
    if (F > 0) {
      const Eigen::MatrixXd J_f = J.leftCols(F), J_s = J.rightCols(J.cols() - F);
      J.rightCols(J.cols() - F) -= J_f * OrthogonalDecomposition(J_f).solve(J_s);
    }
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(J.cols(), J.cols());
    if (F > 0) covariance.topLeftCorner(F, F) = own.covariance;
    covariance.bottomRightCorner(J.cols() - F, J.cols() - F) = result_.statistics.covariance(shared, shared);
    predict(stack, J.topRows(N), covariance, first);
  }

  // A right model with the true values at its start worsens what validates by about chi^2 of its P parameters, for as
  // many samples as are fitted. What is beyond, by residuals that may be correlated, the fit has learnt wrongly.
  void compare_with_start(std::size_t e, const std::vector<UnknownParameter>& unknowns, const VariableScaling& scaling,
                          double squares) {
    const FitStatistics& s = result_.statistics;
    ExperimentStack before(alone(e, parameter_values(scene_), unknowns), unknowns, scaling, spec_.loss);
    before.go_on = go_on_;
    const LeastSquaresResult start = refitted(before, unknowns);
    result_.simulations += before.simulations();
    if (start.point.z.size() == 0 || abandoned_) return;
    const double n = static_cast<double>(before.samples());
    const double squares_at_start = start.point.z.head(before.samples()).squaredNorm();
    result_.experiments[e].rms_scaled_at_start = std::sqrt(squares_at_start / n);
    const long P = std::ranges::count_if(result_.parameters, [](const auto& p) { return p.experiment.empty(); });
    if (!s.none.empty() || P == 0 || !(result_.cost_final < result_.cost_initial)) return;
    const double chi2 = chi_squared_quantile(static_cast<double>(P), kWorse);
    const double expected = chi2 * s.likelihood_scale * std::max(1.0, s.inflation.maxCoeff()) *
                            std::max(1.0, n / static_cast<double>(result_.samples));
    if (squares - squares_at_start > expected)
      result_.warnings.push_back(fmt::format(
          "experiment '{}': the fit has lowered its own residuals, but raised those that validate from {:.3g} to "
          "{:.3g} sigma: the values that it found do not hold for other motions. The model leaves something out, or "
          "has parameters that these data do not determine",
          spec_.experiments[e].name, std::sqrt(squares_at_start / n), std::sqrt(squares / n)));
  }

  void score_all(ExperimentStack& stack, const Eigen::VectorXd& z, bool estimated) {
    Eigen::Index row = 0;
    for (const ExperimentStack::Member& m : stack.members()) {
      const Eigen::Index n = static_cast<Eigen::Index>(m.model.samples().size());
      score_experiment(spec_.experiments[m.experiment], m.model, spec_.loss, z.segment(row, n), estimated, m.experiment,
                       result_.experiments[m.experiment], result_.residuals);
      row += n;
    }
  }

  void order_residuals() {
    std::stable_sort(result_.residuals.begin(), result_.residuals.end(),
                     [](const ResidualRow& a, const ResidualRow& b) { return a.experiment < b.experiment; });
    for (std::size_t e = 0; e < result_.experiments.size(); ++e) {  // also those that could not be scored
      result_.experiments[e].name = spec_.experiments[e].name;
      result_.experiments[e].validate = spec_.experiments[e].validate;
    }
  }

  const Scene& scene_;
  const IdentificationSpec& spec_;
  const std::vector<CsvTable>& data_;
  const IdentificationOptions& options_;
  IdentificationResult result_;
  std::function<bool(double t)> go_on_;
  std::mutex told_;
  bool abandoned_ = false, sigmas_are_estimated_ = false;
  // measured - model, then the residuals of the priors: of each row of the history, or of the first if the cost is one
  // function on the whole way
  std::vector<Eigen::VectorXd> apart_;
  Eigen::VectorXd shared_;  // all parameters, the shared ones as fitted
};

}  // namespace

IdentificationResult run_identification(const Problem& problem, const std::vector<CsvTable>& data,
                                        const IdentificationOptions& options) {
  const CutProblem cut =
      cut_into_windows(what_measurements_need(problem), data, options.user_forces, options.simulation_progress);
  IdentificationResult result = Identification(cut.problem, cut.data, options).run();
  result.warnings.insert(result.warnings.begin(), cut.warnings.begin(), cut.warnings.end());
  return result;
}

}  // namespace mbsopt
