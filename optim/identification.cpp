#include "optim/identification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "core/expression/counted.hpp"
#include "optim/ceres_solver.hpp"
#include "optim/experiment.hpp"
#include "optim/parameter_values.hpp"
#include "optim/stopwatch.hpp"
#include "optim/variable_scaling.hpp"

namespace mbsopt {
namespace {

constexpr double kTouches = 1e-9;  // of the bound's size: the trust region puts solutions exactly on bounds

// A trial that needs so many times the steps of all before it has gone astray (negative damping, say): it counts as
// failed before it takes forever.
constexpr long kStepGrowth = 30;

std::string place_of(std::size_t experiment) { return fmt::format("identification.experiments[{}]", experiment); }

// A parameter to be fitted: shared by all experiments, or free in one of them.
struct UnknownParameter {
  int parameter = 0;
  std::size_t experiment = 0;  // where it is free
  bool shared = true;
  Parameter description;  // with the value it starts from
};

bool has_override(const ExperimentSpec& spec, const std::string& name, double* value = nullptr) {
  for (const auto& [overridden, number] : spec.overrides) {
    if (overridden != name) continue;
    if (value) *value = number;
    return true;
  }
  return false;
}

class Identification {
 public:
  Identification(const Problem& problem, const std::vector<CsvTable>& data, const IdentificationOptions& options)
      : scene_(problem.scene), spec_(checked(problem, data)), data_(data), options_(options) {
    if (options.simulation_progress)
      go_on_ = [this](double t) { return abandoned_ = abandoned_ || !options_.simulation_progress(t), !abandoned_; };
    for (const Parameter& p : scene_.parameters)
      if (p.prior)
        throw std::invalid_argument(fmt::format("parameters.{}.prior: is not available in this version", p.name));
  }

  IdentificationResult run() {
    const Stopwatch stopwatch;
    fit();
    for (std::size_t e = 0; e < spec_.experiments.size(); ++e) {
      if (spec_.experiments[e].validate && result_.status != SolverStatus::failed && !abandoned_) validate(e);
    }
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
              fmt::format("{}.name: '{}' is taken already", place_of(e), spec.experiments[e].name));
    if (std::all_of(spec.experiments.begin(), spec.experiments.end(), [](const auto& e) { return e.validate; }))
      throw std::invalid_argument("identification.experiments: all of them validate, none is fitted");
    return spec;
  }

  std::vector<UnknownParameter> free_in(std::size_t e) const {
    const ExperimentSpec& spec = spec_.experiments[e];
    std::vector<UnknownParameter> unknowns;
    if (spec.free.empty()) return unknowns;
    for (const int k : parameter_indices(scene_, spec.free)) {
      UnknownParameter u{k, e, false, scene_.parameters[static_cast<std::size_t>(k)]};
      has_override(spec, u.description.name, &u.description.value);  // starts there
      unknowns.push_back(std::move(u));
    }
    return unknowns;
  }

  std::vector<UnknownParameter> unknowns_of_fit() const {
    std::vector<UnknownParameter> unknowns;
    if (!spec_.variables.empty())
      for (const int k : parameter_indices(scene_, spec_.variables)) {
        UnknownParameter u{k, 0, true, scene_.parameters[static_cast<std::size_t>(k)]};
        const auto uses_it = [&](const ExperimentSpec& e) {
          const bool freed = std::find(e.free.begin(), e.free.end(), u.description.name) != e.free.end();
          return !e.validate && !freed && !has_override(e, u.description.name);
        };
        if (std::none_of(spec_.experiments.begin(), spec_.experiments.end(), uses_it))
          throw std::invalid_argument(fmt::format(
              "identification.variables: '{}' is free or overridden in every fitted experiment", u.description.name));
        unknowns.push_back(std::move(u));
      }
    for (std::size_t e = 0; e < spec_.experiments.size(); ++e) {
      if (spec_.experiments[e].validate) continue;
      for (UnknownParameter& u : free_in(e)) unknowns.push_back(std::move(u));
    }
    if (unknowns.empty()) throw std::invalid_argument("identification.variables: is empty; name what is to be fitted");
    return unknowns;
  }

  // Its own values of what is free there, else the shared ones; an override replaces a shared value.
  std::vector<Experiment::Unknown> unknowns_in(std::size_t e, const std::vector<UnknownParameter>& unknowns) const {
    std::vector<Experiment::Unknown> here;
    const std::vector<UnknownParameter> freed = free_in(e);
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      const UnknownParameter& u = unknowns[i];
      const bool is_free =
          std::any_of(freed.begin(), freed.end(), [&](const auto& f) { return f.parameter == u.parameter; });
      const bool overridden = has_override(spec_.experiments[e], u.description.name);
      if (u.shared ? !is_free && !overridden : u.experiment == e)
        here.push_back({u.parameter, static_cast<Eigen::Index>(i)});
    }
    return here;
  }

  struct Fitted {
    std::size_t experiment;
    Experiment model;
    long most_steps = 0;  // of a simulation that went well
  };

  // Experiments stacked, in scaled variables.
  struct Stack : LeastSquaresProblem {
    Stack(std::vector<Fitted>& all, const VariableScaling& s, const std::function<bool(double t)>& p, long& count)
        : LeastSquaresProblem(s.size(), total(all)), experiments(all), scaling(s), go_on(p), simulations(count) {
      x_lower = s.x_lower(), x_upper = s.x_upper();
    }
    static Eigen::Index total(const std::vector<Fitted>& all) {
      Eigen::Index n = 0;
      for (const Fitted& f : all) n += static_cast<Eigen::Index>(f.model.samples().size());
      return n;
    }
    void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& point) override {
      const Eigen::VectorXd u = scaling.to_rho(x), u_x = scaling.rho_x(x);
      Eigen::Index row = 0;
      for (Fitted& f : experiments) {
        ++simulations;
        Experiment::Limits limits{go_on, {}};
        if (f.most_steps > 0) limits.max_steps = kStepGrowth * f.most_steps;
        const Experiment::Residuals r = f.model.residuals(u, limits);
        if (!r.ok) {
          point.ok = false, point.message = r.message;
          return;
        }
        f.most_steps = std::max(f.most_steps, r.steps);
        const Eigen::Index n = r.z.size();
        point.z.segment(row, n) = r.z;
        point.z_x.middleRows(row, n) = r.z_u * u_x.asDiagonal();
        row += n;
      }
    }
    std::vector<Fitted>& experiments;
    const VariableScaling& scaling;
    const std::function<bool(double t)>& go_on;
    long& simulations;
  };

  static VariableScaling scaling_of(const std::vector<UnknownParameter>& unknowns) {
    std::vector<Parameter> parameters;
    for (const UnknownParameter& u : unknowns) parameters.push_back(u.description);
    return VariableScaling(parameters);
  }

  static Eigen::VectorXd start_of(const std::vector<UnknownParameter>& unknowns) {
    Eigen::VectorXd u(static_cast<Eigen::Index>(unknowns.size()));
    for (Eigen::Index k = 0; k < u.size(); ++k) u(k) = unknowns[static_cast<std::size_t>(k)].description.value;
    return u;
  }

  std::string name_of(const UnknownParameter& u) const {
    return u.shared ? u.description.name : spec_.experiments[u.experiment].name + "." + u.description.name;
  }

  FitStatistics statistics_at(const LeastSquaresResult& solution, const VariableScaling& scaling,
                              const std::vector<UnknownParameter>& unknowns) const {
    const Eigen::VectorXd u_x = scaling.rho_x(solution.x);
    const Eigen::MatrixXd J = solution.point.z_x * u_x.cwiseInverse().asDiagonal();
    std::vector<std::string> names;
    for (const UnknownParameter& u : unknowns) names.push_back(name_of(u));
    return fit_statistics(J, solution.point.z, scaling.to_rho(solution.x), names, spec_.sigma_is_known);
  }

  std::vector<FittedParameter> described(const std::vector<UnknownParameter>& unknowns, const Eigen::VectorXd& values,
                                         const FitStatistics& statistics) const {
    std::vector<FittedParameter> fitted;
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      const UnknownParameter& u = unknowns[i];
      const Parameter& p = u.description;
      const Eigen::Index k = static_cast<Eigen::Index>(i);
      FittedParameter f;
      f.name = name_of(u), f.parameter = p.name, f.unit = p.unit;
      if (!u.shared) f.experiment = spec_.experiments[u.experiment].name;
      f.initial = p.value, f.value = values(k), f.lower = p.lower, f.upper = p.upper;
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

  CeresOptions solver_options() const {
    CeresOptions solver;
    solver.tolerance = spec_.tolerance;
    solver.max_iterations = spec_.max_iterations;
    return solver;
  }

  void fit() {
    const std::vector<UnknownParameter> unknowns = unknowns_of_fit();
    const VariableScaling scaling = scaling_of(unknowns);
    std::vector<Fitted> experiments;
    for (std::size_t e = 0; e < spec_.experiments.size(); ++e) {
      if (spec_.experiments[e].validate) continue;
      experiments.push_back({e, Experiment(scene_, spec_.experiments[e], place_of(e), data_[e],
                                           parameter_values(scene_), unknowns_in(e, unknowns), options_.user_forces)});
    }
    Stack problem(experiments, scaling, go_on_, result_.simulations);
    if (problem.size < problem.variables())
      throw std::invalid_argument(fmt::format("identification: {} cannot determine {}", counted(problem.size, "sample"),
                                              counted(problem.variables(), "parameter")));
    CeresOptions solver = solver_options();
    solver.progress = [&](const LeastSquaresProgress& p) {
      result_.history.push_back({p.iteration, p.cost, p.gradient_norm, p.step_norm, scaling.to_rho(p.x)});
      return !options_.progress || options_.progress(result_.history.back());
    };
    const LeastSquaresResult solution = solve_with_ceres(problem, scaling.to_x(start_of(unknowns)), solver);
    result_.status = abandoned_ ? SolverStatus::stopped : solution.status;
    result_.message = abandoned_ ? "stopped on request" : solution.message;
    result_.cost_initial = solution.cost_initial, result_.cost_final = solution.cost_final;
    result_.samples = static_cast<std::size_t>(problem.size);
    result_.iterations = solution.iterations;
    result_.evaluations = solution.evaluations, result_.failed_evaluations = solution.failed_evaluations;
    result_.experiments.resize(spec_.experiments.size());
    const Eigen::VectorXd values = scaling.to_rho(solution.x);
    if (solution.point.z.size() > 0) result_.statistics = statistics_at(solution, scaling, unknowns);
    result_.parameters = described(unknowns, values, result_.statistics);
    shared_ = parameter_values(scene_);
    for (std::size_t i = 0; i < unknowns.size(); ++i)
      if (unknowns[i].shared) shared_(unknowns[i].parameter) = values(static_cast<Eigen::Index>(i));
    Eigen::Index row = 0;
    for (const Fitted& f : experiments) {
      const Eigen::Index n = static_cast<Eigen::Index>(f.model.samples().size());
      if (solution.point.z.size() > 0) score(f.experiment, f.model, solution.point.z.segment(row, n));
      row += n;
    }
  }

  // Its free parameters refitted, the shared ones fixed.
  void validate(std::size_t e) {
    const std::vector<UnknownParameter> unknowns = free_in(e);
    const VariableScaling scaling = scaling_of(unknowns);
    std::vector<Fitted> one;
    one.push_back({e, Experiment(scene_, spec_.experiments[e], place_of(e), data_[e], shared_, unknowns_in(e, unknowns),
                                 options_.user_forces)});
    Stack problem(one, scaling, go_on_, result_.simulations);
    ExperimentFit& scored = result_.experiments[e];
    Eigen::VectorXd z;
    if (unknowns.empty()) {
      LeastSquaresPoint point;
      point.z.setZero(problem.size), point.z_x.setZero(problem.size, 0);
      problem.evaluate(Eigen::VectorXd(), point);
      scored.message = point.ok ? "simulated" : "could not be simulated: " + point.message;
      if (point.ok) z = point.z;
    } else {
      const LeastSquaresResult solution = solve_with_ceres(problem, scaling.to_x(start_of(unknowns)), solver_options());
      scored.message = "refitted, " + solution.message;
      scored.refitted =
          described(unknowns, scaling.to_rho(solution.x),
                    solution.point.z.size() > 0 ? statistics_at(solution, scaling, unknowns) : FitStatistics());
      z = solution.point.z;
    }
    if (z.size() > 0) score(e, one.front().model, z);
  }

  // Residuals of an experiment and their root mean squares.
  void score(std::size_t e, const Experiment& model, const Eigen::VectorXd& z) {
    const ExperimentSpec& spec = spec_.experiments[e];
    ExperimentFit& fit = result_.experiments[e];
    fit.name = spec.name, fit.validate = spec.validate;
    fit.start_time = model.start_time(), fit.end_time = model.end_time();
    fit.samples = model.samples().size();
    fit.channels.resize(spec.channels.size());
    for (std::size_t c = 0; c < fit.channels.size(); ++c) {
      fit.channels[c].column = spec.channels[c].column, fit.channels[c].sensor = spec.channels[c].sensor;
      fit.channels[c].missing = model.missing(c);
    }
    double sum = 0;
    for (std::size_t i = 0; i < fit.samples; ++i) {
      const Experiment::Sample& sample = model.samples()[i];
      const double scaled = z(static_cast<Eigen::Index>(i)), residual = scaled * model.sigma(sample.channel);
      ChannelFit& channel = fit.channels[sample.channel];
      ++channel.samples;
      channel.rms += residual * residual, channel.rms_scaled += scaled * scaled;
      sum += residual * residual;
      result_.residuals.push_back(
          {e, sample.channel, model.times()[sample.time], sample.measured, sample.measured - residual, scaled});
    }
    fit.rms = std::sqrt(sum / static_cast<double>(fit.samples));
    for (ChannelFit& channel : fit.channels) {
      const double n = static_cast<double>(std::max<std::size_t>(channel.samples, 1));
      channel.rms = std::sqrt(channel.rms / n), channel.rms_scaled = std::sqrt(channel.rms_scaled / n);
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
  bool abandoned_ = false;
  Eigen::VectorXd shared_;  // all parameters, the shared ones as fitted
};

}  // namespace

IdentificationResult run_identification(const Problem& problem, const std::vector<CsvTable>& data,
                                        const IdentificationOptions& options) {
  return Identification(problem, data, options).run();
}

}  // namespace mbsopt
