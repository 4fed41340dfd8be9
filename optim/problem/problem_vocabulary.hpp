// Describes every field of a problem beyond its scene to a visitor; see core/scene/vocabulary.hpp.
#pragma once

#include <string>

#include "core/scene/vocabulary.hpp"
#include "optim/problem/problem.hpp"
#include "optim/solver/nlopt_methods.hpp"

namespace mbsopt::inline optim {

inline std::string_view optimizer_names() {
  static const std::string names = "auto sqp ipopt least_squares " + std::string(nlopt_method_names());
  return names;
}
inline constexpr Choice<StartSampling> kSamplings[] = {{"latin_hypercube", StartSampling::latin_hypercube},
                                                       {"sobol", StartSampling::sobol}};
inline constexpr Choice<Timing> kTimings[] = {
    {"prescribed", Timing::prescribed}, {"free", Timing::free}, {"ordered", Timing::ordered}};
inline constexpr Choice<bool> kBranches[] = {{"guess", false}, {"all", true}};
inline constexpr Choice<bool> kUntil[] = {{"all_starts", false}, {"all_found", true}};
inline constexpr Choice<bool> kRoles[] = {{"fit", false}, {"validate", true}};

inline constexpr Choice<SigmaEstimate> kSigmaEstimates[] = {
    {"false", SigmaEstimate::none}, {"true", SigmaEstimate::own}, {"shared", SigmaEstimate::shared}};
inline constexpr Choice<CovarianceType> kCovariances[] = {{"auto", CovarianceType::automatic},
                                                          {"white", CovarianceType::white},
                                                          {"newey_west", CovarianceType::newey_west},
                                                          {"windows", CovarianceType::windows}};
inline constexpr Choice<LossType> kLosses[] = {{"squared", LossType::squared},
                                               {"huber", LossType::huber},
                                               {"cauchy", LossType::cauchy},
                                               {"tukey", LossType::tukey}};

void describe(auto& v, Like<ObjectiveSample> auto& s) {
  v.plain("time", s.time, kAny, {"[s]", Need::required, dimension::kTime});
  v.expression("value", s.value, Scope::objective, {"added to the objective", Need::required});
}

void describe(auto& v, Like<TrackTerm> auto& t) {
  v.reference("sensor", t.sensor, ElementKind::sensor, {"sensor that should follow the data", Need::required});
  describe_samples(v, t, "file");
  v.number("weight", t.weight, {"of each square"});
  v.choice(
      "timing", t.timing, kTimings,
      {"prescribed: at the times of the rows; free: each row where the driven motion is nearest to it; ordered: free, "
       "but one row after another"});
}

void describe(auto& v, Like<EigenvalueSpec> auto& e) {
  v.plain("mode", e.mode, kPositive,
          {"number of the mode, from slow to fast at the values of the file, as in `mbsopt linearise`; 1"});
  v.word("value", e.value, Words{"frequency damping least_frequency least_damping"},
         {"natural frequency [Hz], or damping ratio, of the mode, or the least of all modes"});
}

void describe(auto& v, Like<FrequencyResponseSpec> auto& r) {
  v.reference(
      "input", r.input, ElementKind::parameter,
      {"that swings, and acts through forces: a force, the length of a spring on a moving road", Need::required});
  v.reference("output", r.output, ElementKind::sensor, {"that answers", Need::required});
  v.word("value", r.value, Words{"max rms amplitude phase"},
         {"the largest amplitude between `from` and `to`, the root of its mean square there under a spectrum of the "
          "input, or the amplitude or phase [rad] at a frequency"});
  v.plain("from", r.from, kNotNegative, {"[Hz], of max and rms"});
  v.plain("to", r.to, kPositive, {"[Hz]"});
  v.plain("at", r.at, kNotNegative, {"[Hz], of amplitude and phase"});
  v.plain("spectrum", r.spectrum, kPositive, {"of rms: power density of the input [its unit^2/Hz]"});
}

void describe(auto& v, Like<UserCostSpec> auto& c) {
  v.text("cost", c.cost, {"its name", Need::required});
  v.references("bodies", c.bodies, ElementKind::body, {"whose states it reads, in its order; all when absent"});
  v.named("parameters", c.parameters, {"parameters of the cost, each an expression of parameters of the problem"});
}

void describe_means(auto& v, auto& means) {
  for (std::size_t k = 0; k < std::size(kMeanKinds); ++k)
    v.expression(kMeanKinds[k].name, means[k], Scope::objective, {kMeanKinds[k].description});
}

void describe(auto& v, Like<ObjectiveSpec> auto& o) {
  v.expression("running", o.running, Scope::objective, {"integrated over time; of sensors, t and parameters"});
  v.expression("terminal", o.terminal, Scope::objective, {"added, at the end time; of sensors, t and parameters"});
  v.list("samples", o.samples, {"added, each at its time"});
  v.list("track", o.track, {"added: weighted squares of sensor minus data at the rows of a CSV file"});
  v.expression("parameters_only", o.parameters_only, Scope::none, {"added; of parameters only"});
  describe_means(v, o.means);
  v.object("eigenvalue", o.eigenvalue, {"alone: frequency or damping ratio of a mode near the initial equilibrium"});
  v.object("frequency_response", o.frequency_response,
           {"alone: how a sensor answers to a parameter that swings, near the initial equilibrium"});
  v.object("user", o.user, {"alone: a cost written in C++, of a plug-in or of the program"});
  v.plain("sharpness", o.sharpness, kPositive,
          {"of maximum_of, minimum_of, peak_to_peak_of: k in log(mean exp(k x))/k [1/unit of the expression]; 100 when "
           "absent"});
}

void describe(auto& v, Like<ObjectiveBound> auto& b) {
  v.reference(
      "objective", b.objective, ElementKind::objective,
      {"objective to bound; or, in its place, one of maximum_of, minimum_of, peak_to_peak_of, rms_of and sampled"});
  describe_means(v, b.means);
  v.expression("sampled", b.sampled, Scope::objective, {"its value at each of the instants start_time + k every"});
  v.plain("every", b.every, kPositive, {"of sampled [s]"});
  v.plain("sharpness", b.sharpness, kPositive,
          {"of an extreme in place of an objective; when absent 100 over the larger absolute value of the bounds"});
  v.plain("lower", b.lower, kAny, {"it must not be less"});
  v.plain("upper", b.upper, kAny, {"it must not be more"});
}

void describe(auto& v, Like<WeightedObjective> auto& w) {
  v.reference("objective", w.objective, ElementKind::objective,
              {"a part of the sum; or, in its place, one of maximum_of, minimum_of, peak_to_peak_of and rms_of"});
  describe_means(v, w.means);
  v.plain("weight", w.weight, kAny, {"its factor"});
}

void describe(auto& v, Like<OptimizerSpec> auto& o) {
  static const std::string methods =
      "chosen from the problem (auto, the default); sequential quadratic programming (sqp); interior points (ipopt); "
      "Levenberg-Marquardt on tracked squares (least_squares); NLopt's " +
      std::string(nlopt_methods_by_kind());
  v.word("type", o.type, Words{optimizer_names()}, {methods});
  v.plain("tolerance", o.tolerance, kPositive, {"of the optimality conditions; of the last steps without gradients"});
  v.plain("max_iterations", o.max_iterations, kNotNegative,
          {"at most; sqp: 500 when absent, ipopt and least_squares: 100"});
  v.plain("max_evaluations", o.max_evaluations, kPositive,
          {"at most; NLopt: 500, without gradients 500 (n + 1), global 1000 (n + 1) when absent, of n variables"});
  v.word("hessian", o.hessian, Words{"lbfgs exact gauss_newton"},
         {"of ipopt: limited-memory BFGS, second derivatives, or these without those of the motion"});
  v.plain(
      "lbfgs_history", o.lbfgs_history, kPositive,
      {"of ipopt, lbfgs and mlsl: pairs of steps and gradients kept by limited-memory BFGS, at most 1000; when absent "
       "ipopt 20, else chosen by NLopt"});
  v.plain("seed", o.seed, kNotNegative, {"of methods that are random; drawn when absent"});
  v.plain("warm_start", o.warm_start, kAny,
          {"of ipopt: true where the given values are near the solution, as in an earlier run's optimized.json"});
}

void describe(auto& v, Like<MultistartSpec> auto& m) {
  v.plain("starts", m.starts, kPositive, {"how many; the first is from the given values"});
  v.plain("seed", m.seed, kNotNegative, {"of the starts; drawn when absent"});
  v.choice("sampling", m.sampling, kSamplings, {"how the starts fill the bounds"});
  v.choice("branches", m.all_branches, kBranches,
           {"of design: assembly modes in which each start is designed, that of the poses in the file or all"});
  v.choice(
      "until", m.until_all_found, kUntil,
      {"all_starts: run all; all_found: stop when less than half an optimum is expected in addition to those found"});
}

void describe(auto& v, Like<DriveLaw> auto& d) {
  v.reference("drive", d.drive, ElementKind::drive, {"the drive", Need::required});
  v.time_law("law", d.law, d.samples,
             {"its law in this experiment or case: of t and parameters, or a CSV file", Need::required});
}

void describe(auto& v, Like<SignalSamples> auto& s) { describe_samples(v, s, "file"); }

void describe(auto& v, Like<CaseSpec> auto& c) {
  v.name("name", c.name, {"name of the load case", Need::required});
  v.plain("weight", c.weight, kPositive, {"factor of the minimised objective in this case"});
  v.named("overrides", c.overrides, {"parameters in this case, as expressions of those of the problem"});
  v.list("drives", c.drives, {"laws of drives in this case"});
  v.named("signals", c.signals, {"samples of signals in this case, instead of the signals' own"});
  v.group("initial", {"the state at the start time in this case"}, [&](auto& inside) {
    inside.list("conditions", c.conditions, {"instead of those of the problem on the same sensors, or beside them"});
  });
  v.plain("end_time", c.end_time, kAny, {"[s]; the simulation's when absent", Need::optional, dimension::kTime});
}

void describe(auto& v, Like<DesignSpec> auto& d) {
  v.reference_or("minimize", d.minimize, ElementKind::objective,
                 {"the objective to minimise, a weighted sum, or the largest of several"}, [&](auto& inside) {
                   inside.list("sum", d.sum, {"in place of objective: the weighted sum of these"});
                   inside.references("largest_of", d.largest_of, ElementKind::objective,
                                     {"in place of objective: the largest of these"});
                   inside.word("over", d.over, Words{"sum max"},
                               {"sum or maximum of its weighted values in the load cases"});
                   inside.plain("sharpness", d.sharpness, kPositive,
                                {"of max: k in log(sum exp(k x))/k [1/unit of the objective]; when absent the true "
                                 "maximum by sqp, else 100 over the largest at the start"});
                 });
  v.reference("maximize", d.maximize, ElementKind::objective, {"in place of minimize: the objective to maximise"});
  v.list("subject_to", d.subject_to, {"bounds on objectives; those of extremes hold for the true ones"});
  v.references("variables", d.variables, ElementKind::parameter, {"parameters that may change", Need::required});
  v.object("optimizer", d.optimizer, {"how it is minimised"});
  v.object("multistart", d.multistart, {"from several starts, in parallel"});
}

void describe(auto& v, Like<ChannelSpec> auto& c) {
  v.text("column", c.column, {"header of the column, with its unit (\"theta [deg]\") or without it", Need::required});
  v.reference("sensor", c.sensor, ElementKind::sensor, {"sensor whose values the column holds", Need::required});
  v.text("unit", c.unit, {"of the column, instead of the unit in the header; without either it is SI"});
  v.plain("unwrap", c.unwrap, kAny, {"true: the column jumps by whole turns, which are taken out"});
  v.number("sigma", c.sigma, {"standard deviation of the noise; a number is in SI, also where the column is not"});
  v.number("gain", c.gain, {"measured = gain * sensor + bias + noise"});
  v.expression("bias", c.bias, Scope::time_law,
               {"a number is in SI, also where the column is not; also of t and signals"});
  v.expression("delay", c.delay, Scope::time_law,
               {"measured(t) = gain * sensor(t - delay) + bias + noise [s]", Need::optional, dimension::kTime});
  v.choice("estimate_sigma", c.estimate_sigma, kSigmaEstimates,
           {"true: sigma is estimated from the residuals of this channel, starting at the given one; shared: from all "
            "fitted channels of this column with \"shared\""});
}

void describe(auto& v, Like<WindowsSpec> auto& w) {
  v.plain("length", w.length, kPositive,
          {"[s]; the last window takes what is left, from half a length to one and a half", Need::required,
           dimension::kTime});
  v.plain("start_time", w.start_time, kAny, {"[s]; the experiment's when absent", Need::optional, dimension::kTime});
  v.plain("end_time", w.end_time, kAny, {"[s]; the experiment's when absent", Need::optional, dimension::kTime});
  v.plain("continuity", w.continuity, kAny,
          {"true: each window ends where the next one starts; false: each start is free"});
}

void describe(auto& v, Like<ExperimentSpec> auto& e) {
  v.name("name", e.name, {"name of the experiment", Need::required});
  v.texts("data", e.data, {"CSV file or list of them, relative to this file's folder", Need::required});
  v.text("time", e.time, {"header of the column of times"});
  v.text("time_unit", e.time_unit, {"of the times, instead of the unit in the header; without either they are in s"});
  v.level("time_zero", e.time_zero, kTimeZeros, kAny,
          {"time of the files at t = 0 [s], or first: that of the first row of the first file; 0 when absent",
           Need::optional, dimension::kTime});
  v.plain("start_time", e.start_time, kAny, {"[s]; the simulation's when absent", Need::optional, dimension::kTime});
  v.plain("end_time", e.end_time, kAny,
          {"[s]; later rows are left out; all are used when absent", Need::optional, dimension::kTime});
  v.list("channels", e.channels, {"columns that are compared", Need::required});
  v.values_of("overrides", e.overrides, ElementKind::parameter, kAny, {"parameter values of this experiment"});
  v.named("signals", e.signals, {"samples of signals in this experiment, instead of the signals' own"});
  v.list("drives", e.drives, {"laws of drives in this experiment"});
  v.references("free", e.free, ElementKind::parameter, {"parameters with a value of their own in this experiment"});
  v.object("windows", e.windows,
           {"cuts the experiment into windows, each with its own values of the free parameters; these must act on the "
            "start"});
  v.choice("role", e.validate, kRoles, {"validate: scored, not fitted"});
}

void describe(auto& v, Like<IdentificationSpec> auto& i) {
  v.list("experiments", i.experiments, {"measured motions", Need::required});
  v.references("variables", i.variables, ElementKind::parameter, {"parameters to fit", Need::required});
  v.plain("sigma_is_known", i.sigma_is_known, kAny,
          {"true: the covariance is not scaled by the variance of the residuals"});
  v.choice("covariance", i.covariance, kCovariances,
           {"noise that the standard errors assume: white, correlated in time (newey_west), or independent between "
            "experiments only (windows); auto: chosen by tests of the residuals"});
  v.group("loss", {"what is summed over the residuals"}, [&](auto& inside) {
    inside.choice("type", i.loss.type, kLosses, {"loss function"});
    inside.plain("scale", i.loss.scale, kPositive,
                 {"residual, in units of sigma, beyond which it counts less than its square; 1.345 (huber), 2.385 "
                  "(cauchy), 4.685 (tukey) when absent"});
  });
  v.group("optimizer", {"how the sum is minimised"}, [&](auto& inside) {
    std::string type = "trust_region";
    inside.word("type", type, Words{"trust_region"}, {"Levenberg-Marquardt with bounds"});
    inside.plain("tolerance", i.tolerance, kPositive, {"relative change of the sum"});
    inside.plain("max_iterations", i.max_iterations, kNotNegative, {"at most"});
  });
  v.object("multistart", i.multistart, {"from several starts, in parallel"});
}

void describe(auto& v, Like<Problem> auto& p) {
  std::string schema;
  v.text("$schema", schema, {"for editors: where problem.schema.json is"});
  v.version("format", 1, {"version of the problem format"});
  v.texts("plugins", p.plugins,
          {"shared libraries with forces, costs and laws in C++, relative to the problem file; loaded with "
           "--allow-plugins only"});
  describe(v, p.scene);
  v.named("objectives", p.objectives, {"scalars of a motion, to minimise, to bound or to differentiate"});
  v.list("cases", p.cases, {"loads that one design must bear"});
  v.object("design", p.design, {"optimal design"});
  v.object("identification", p.identification, {"fit of parameters to measurements"});
}

}  // namespace mbsopt::inline optim
