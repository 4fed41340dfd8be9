#include "optim/fit/fit_context.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {
namespace {

// Numerical effects of causes that are the same by the physics differ by a few tolerances of the integration. A late
// clock and an early start are an example. Measured: 1/condition of that pair is 0.3 to 8 times rtol at 1e-5 to 1e-8.
constexpr double kTolerances = 10, kLeastAccuracy = 1e-5;
// The sums of so many records tell a variance: Student's quantile is then 2.09, against 1.96 for any number.
constexpr std::size_t kManyRecords = 20;
constexpr double kTouches = 1e-9;  // of the bound's size: solutions at a bound are exactly on it

// The kind of covariance that is left to the program: for white noise where the residuals pass its tests, else one that
// allows for correlation in time. The experiments of the stack are scored already.
CovarianceType covariance_for(const FitContext& fit, const ExperimentStack& stack) {
  const std::size_t records = stack.records_in_time().size();
  const bool many = records >= kManyRecords;
  if (fit.spec.covariance == CovarianceType::windows && records < 2) return CovarianceType::newey_west;
  if (fit.spec.covariance != CovarianceType::automatic) return fit.spec.covariance;
  for (const ExperimentStack::Member& m : stack.members())
    for (const ChannelFit& channel : fit.result.experiments[m.experiment].channels)
      if (!channel.analysis.white()) return many ? CovarianceType::windows : CovarianceType::newey_west;
  return CovarianceType::white;
}

// value -+ half; of a parameter that is fitted by its logarithm value exp(-+ half/value). Nothing lies beyond the
// bounds, so that an interval at a bound has one side.
void set_interval(FittedParameter& f, double half, bool logarithmic) {
  for (const int side : {0, 1}) {
    const double change = side == 0 ? -half : half;
    double& end = f.ci95[side] = logarithmic ? f.value * std::exp(change / f.value) : f.value + change;
    if (f.lower && end < *f.lower) end = *f.lower;
    if (f.upper && end > *f.upper) end = *f.upper;
  }
}

}  // namespace

LeastSquaresOptions solver_options(const FitContext& fit) {
  LeastSquaresOptions solver;
  solver.tolerance = fit.spec.tolerance;
  solver.max_iterations = fit.options.preflight ? 0 : fit.spec.max_iterations;
  return solver;
}

ExperimentStack stack_of(const FitContext& fit, const std::vector<std::size_t>& experiments, const Eigen::VectorXd& rho,
                         std::vector<UnknownParameter> unknowns) {
  std::vector<ExperimentStack::Member> members;
  for (const std::size_t e : experiments) {
    const ExperimentSpec& spec = fit.spec.experiments[e];
    members.push_back({e,
                       Experiment(fit.scene, spec, place_of(fit.spec, e), fit.data[e], rho,
                                  unknowns_in(fit.scene, fit.spec, e, unknowns)),
                       spec.origin && spec.origin->continues, spec.origin && spec.origin->number > 1});
  }
  return {std::move(members), std::move(unknowns), fit.spec.loss, fit.go_on, fit.options.threads};
}

ExperimentStack fitted_stack(const FitContext& fit) {
  std::vector<std::size_t> experiments;
  for (std::size_t e = 0; e < fit.spec.experiments.size(); ++e)
    if (!fit.spec.experiments[e].validate) experiments.push_back(e);
  return stack_of(fit, experiments, parameter_values(fit.scene), unknowns_of_fit(fit.scene, fit.spec));
}

void name_experiments(FitContext& fit) {
  fit.result.experiments.resize(fit.spec.experiments.size());
  for (std::size_t e = 0; e < fit.spec.experiments.size(); ++e) {
    fit.result.experiments[e].name = fit.spec.experiments[e].name;
    fit.result.experiments[e].validate = fit.spec.experiments[e].validate;
  }
}

void score_experiment(FitContext& fit, const ExperimentStack::Member& member, const Eigen::VectorXd& z) {
  const ExperimentSpec& spec = fit.spec.experiments[member.experiment];
  const Experiment& model = member.model;
  ExperimentFit& scored = fit.result.experiments[member.experiment];
  scored.window = spec.origin;
  scored.start_time = model.start_time();
  scored.end_time = model.end_time();
  scored.samples = model.samples().size();
  std::vector<std::vector<double>> by_channel(spec.channels.size());
  for (std::size_t i = 0; i < scored.samples; ++i) {
    const Experiment::Sample& sample = model.samples()[i];
    const double z_i = z(static_cast<Eigen::Index>(i)), residual = z_i * model.sigma(sample.channel);
    by_channel[sample.channel].push_back(z_i);
    fit.result.residuals.push_back({member.experiment, sample.channel, model.times()[sample.time], sample.measured,
                                    sample.measured - residual, z_i, sample.row});
  }
  scored.channels.clear();
  double squares = 0;
  for (std::size_t c = 0; c < spec.channels.size(); ++c) {
    const Eigen::Map<const Eigen::VectorXd> z_c(by_channel[c].data(), static_cast<Eigen::Index>(by_channel[c].size()));
    ChannelFit& channel = scored.channels.emplace_back();
    channel.column = spec.channels[c].column;
    channel.sensor = spec.channels[c].sensor;
    channel.samples = by_channel[c].size();
    channel.missing = model.missing(c);
    channel.sigma = model.sigma(c);
    channel.sigma_is_estimated = fit.sigmas_are_estimated && !spec.validate &&  // which is scored with the given sigma
                                 spec.channels[c].estimate_sigma != SigmaEstimate::none;
    channel.rms_scaled = z_c.norm() / std::sqrt(std::max(1.0, static_cast<double>(z_c.size())));
    channel.rms = channel.sigma * channel.rms_scaled;
    channel.beyond_scale = static_cast<std::size_t>((z_c.array().abs() > fit.spec.loss.s()).count());
    channel.analysis = analyse_residuals(z_c);
    squares += static_cast<double>(z_c.size()) * channel.rms * channel.rms;
  }
  scored.rms = std::sqrt(squares / static_cast<double>(scored.samples));
}

void score_all(FitContext& fit, const ExperimentStack& stack, const Eigen::VectorXd& z) {
  Eigen::Index row = 0;
  for (const ExperimentStack::Member& m : stack.members()) {
    const Eigen::Index n = static_cast<Eigen::Index>(m.model.samples().size());
    score_experiment(fit, m, z.segment(row, n));
    row += n;
  }
}

FitStatistics statistics_at(const FitContext& fit, const LeastSquaresResult& solution, const ExperimentStack& stack) {
  const Eigen::MatrixXd J = stack.z_rho(solution.point, solution.x);
  FitData data;
  data.J = J.topRows(stack.samples());
  data.J_prior = J.middleRows(stack.samples(), stack.plain);
  data.C = J.bottomRows(stack.equalities);
  data.z = solution.point.z.head(stack.samples());
  data.rho = stack.scaling().to_rho(solution.x);
  data.loss = fit.spec.loss;
  data.sigma_is_known = fit.spec.sigma_is_known;
  data.change = stack.scaling().rho_x(solution.x).cwiseAbs();
  data.covariance = covariance_for(fit, stack);
  for (const UnknownParameter& u : stack.unknowns()) {
    data.at_bound.push_back(stack.is_at_bound(solution.x, std::ssize(data.at_bound)));
    data.names.push_back(name_of(u, fit.spec));
    data.units.push_back(u.description.unit);
    data.of_one_record.push_back(!u.shared);
  }
  data.records = stack.records_in_time();
  data.motions = stack.motions_in_time();
  data.record = stack.measured().cwiseQuotient(stack.sigma()).norm();
  const IntegratorSettings& integrator = fit.scene.simulation.integrator;
  if (!integrator.step) data.accuracy = std::min(kTolerances * integrator.rtol, kLeastAccuracy);
  if (fit.options.preflight) {
    data.loss = {};
    data.sigma_is_known = true;
    data.covariance = CovarianceType::white;
  }
  FitStatistics statistics = fit_statistics(data);
  const bool ended = fit.options.preflight || solution.status == SolverStatus::converged ||
                     solution.status == SolverStatus::no_progress;
  if (fit.abandoned || !ended)
    withhold_errors(statistics, "they hold at a minimum, and the fit ended before it reached one");
  return statistics;
}

std::vector<FittedParameter> described(const FitContext& fit, const ExperimentStack& stack, const Eigen::VectorXd& x,
                                       const FitStatistics& statistics) {
  const Eigen::VectorXd values = stack.scaling().to_rho(x);
  std::vector<FittedParameter> fitted;
  for (const UnknownParameter& u : stack.unknowns()) {
    const Parameter& p = u.description;
    const Eigen::Index k = std::ssize(fitted);
    const auto touches = [&](const std::optional<double>& bound) {
      return bound && std::abs(values(k) - *bound) <= kTouches * std::max(std::abs(*bound), std::abs(p.value));
    };
    FittedParameter& f = fitted.emplace_back(
        FittedParameter{name_of(u, fit.spec), p.name, u.shared ? "" : fit.spec.experiments[u.experiment].name, p.unit,
                        p.value, values(k), p.lower, p.upper, p.prior, touches(p.lower), touches(p.upper)});
    if (statistics.std_error.size() <= k) continue;
    f.std_error = statistics.std_error(k);
    const double half = f.std_error == 0 ? 0 : statistics.quantile * f.std_error;
    set_interval(f, half, p.scale == ParameterScale::log);
  }
  return fitted;
}

void predict(FitContext& fit, const ExperimentStack& stack, const Eigen::VectorXd& variances, std::size_t first) {
  const FitStatistics& s = fit.result.statistics;
  if (!s.none.empty() || fit.options.preflight) return;
  const Eigen::VectorXd sigma = stack.sigma();
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    ResidualRow& row = fit.result.residuals[first + static_cast<std::size_t>(i)];
    row.prediction = s.quantile * sigma(i) * std::sqrt(s.variance + variances(i));
    ChannelFit& channel = fit.result.experiments[row.experiment].channels[row.channel];
    if (std::isnan(channel.within_prediction)) channel.within_prediction = 0;
    if (std::abs(row.measured - row.model) <= row.prediction)
      channel.within_prediction += 1 / static_cast<double>(channel.samples);
  }
}

// Akaike's and Bayes' criteria (Burnham and Anderson, "Model Selection and Multimodel Inference" (2002), chapter 2):
//   AIC = 2 k - 2 log L,  BIC = k log N - 2 log L,  -2 log L = sum [z^2/v + log(2 pi v sigma^2)]
// v is 1 where sigma is known or estimated, else it is the mean square of z and one more parameter.
void compare_by_likelihood(FitContext& fit, const ExperimentStack& stack, const Eigen::VectorXd& z,
                           std::size_t sigmas) {
  const double N = static_cast<double>(stack.samples()), squares = z.head(stack.samples()).squaredNorm();
  const bool scaled = sigmas == 0 && !fit.spec.sigma_is_known;
  const double v = scaled ? squares / N : 1;
  if (fit.spec.loss.type != LossType::squared || !(v > 0)) return;
  const double k = static_cast<double>(stack.freedom_of_variables()) + (scaled ? 1 : static_cast<double>(sigmas));
  const double twice = squares / v + N * std::log(2 * std::numbers::pi * v) + 2 * stack.sigma().array().log().sum();
  fit.result.aic = 2 * k + twice;
  fit.result.bic = k * std::log(N) + twice;
}

}  // namespace mbsopt::inline optim
