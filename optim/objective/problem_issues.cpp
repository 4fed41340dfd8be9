#include "optim/objective/problem_issues.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include "core/expression/did_you_mean.hpp"
#include "core/scene/checker.hpp"
#include "core/scene/signals.hpp"
#include "core/scene/type_table.hpp"
#include "optim/objective/design_issues.hpp"
#include "optim/objective/expression_cost.hpp"
#include "optim/problem/bounded_means.hpp"
#include "optim/problem/load_cases.hpp"
#include "optim/problem/logged_columns.hpp"
#include "optim/problem/problem_vocabulary.hpp"

namespace mbsopt::inline optim {

namespace {

// Compares the dimension of a column's unit with that of the sensor.
void check_column_unit(Checker& checker, const std::string& unit_text, const std::string& sensor_name) {
  const Sensor* const sensor = checker.facts().sensor(sensor_name);
  const TypeRow* const row = sensor ? find_row(kSensorQuantities, sensor->quantity) : nullptr;
  const std::optional<Unit> unit = parse_column_unit(unit_text);
  if (unit_text.empty() || !row) return;
  if (!unit)
    checker.issue(checker.path("unit"), "'" + unit_text + "' is not a known unit; units are products, quotients and " +
                                            "whole powers of " + known_units());
  else if (!unit->dimension.is_none() && !compatible(unit->dimension, row->dimension))
    checker.issue(checker.path("column"), "is in " + to_string(unit->dimension) + ", the sensor '" + sensor_name +
                                              "' in " + to_string(row->dimension));
}

// Rows of the file outside the run are left out.
void check_track(Checker& checker, const TrackTerm& term, const std::string& place) {
  if (const std::optional<double> weight = checker.facts().value(term.weight); weight && *weight < 0)
    checker.issue(place + ".weight", "is " + text_of(*weight) + ", the weight of a square must not be negative");
  const bool prescribed = term.timing == Timing::prescribed;
  if (!prescribed) {
    const Sensor* const sensor = checker.facts().sensor(term.sensor);
    if (sensor && checker.facts().reads_of(*sensor) != Reads::positions)
      checker.issue(place + ".timing", "is not 'prescribed', but the sensor '" + term.sensor +
                                           "' is no function of positions alone; free timing seeks the position of "
                                           "the motion that is nearest to each row");
    if (checker.facts().scene().drives.empty())
      checker.issue(place + ".timing", "is not 'prescribed', but there are no drives, whose values it frees");
  }
  if (!term.curve || !prescribed) return;
  const SimulationSettings& simulation = checker.facts().scene().simulation;
  const std::vector<double>& t = term.curve->x();
  const auto rows =
      std::ranges::count_if(t, [&](double x) { return x >= simulation.start_time && x <= simulation.end_time; });
  const std::string of_run = "the run, " + text_of(simulation.start_time) + " s to " + text_of(simulation.end_time) +
                             " s; its times go from " + text_of(t.front()) + " s to " + text_of(t.back()) + " s";
  if (rows == 0)
    checker.issue(child_path(place, "file"), "has no row within " + of_run);
  else if (static_cast<std::size_t>(rows) < t.size())
    checker.warning(child_path(place, "file"), "only " + std::to_string(rows) + " of its " + std::to_string(t.size()) +
                                                   " rows lie within " + of_run + "; the others are left out");
}

long count_of(const Means& means) {
  return std::ranges::count_if(means, [](const std::optional<Expression>& mean) { return mean.has_value(); });
}

// The names of all means, and others.
std::vector<std::string> kinds_and(std::initializer_list<std::string> others) {
  std::vector<std::string> kinds;
  for (const MeanKind& kind : kMeanKinds) kinds.emplace_back(kind.name);
  kinds.insert(kinds.end(), others);
  return kinds;
}

}  // namespace

void check_meaning(Checker& checker, const TrackTerm& term) { check_column_unit(checker, term.unit, term.sensor); }

void check_meaning(Checker& checker, const DriveLaw& law) {
  const std::vector<Drive>& drives = checker.facts().scene().drives;
  const auto drive = std::ranges::find(drives, law.drive, &Drive::name);
  if (drive != drives.end())
    checker.time_law("law", law.law, law.samples,
                     {"", Need::required, dimension_of_drive(drive->type, drive->coordinate)});
}

void check_meaning(Checker& checker, const SignalSamples& samples) {
  check_units(checker, samples);
  const std::vector<Signal>& signals = checker.facts().scene().signals;
  std::vector<std::string> names;
  for (const Signal& signal : signals) names.push_back(signal.name);
  if (std::ranges::find(names, samples.name) == names.end())
    checker.issue(checker.path(), "there is no signal '" + samples.name + "'" + did_you_mean(samples.name, names) +
                                      (names.empty() ? "; there are no signals" : "; signals: " + joined(names)));
}

// Checker::check finds these functions through the arguments' namespace.
void check_meaning(Checker& checker, const FrequencyResponseSpec& response) {
  const bool at_one = response.value == "amplitude" || response.value == "phase";
  if (at_one && (!response.at || response.from || response.to))
    checker.issue(checker.path("at"), "is needed, without from and to: value is \"" + response.value + "\"");
  if (!at_one && (response.at || !response.from || !response.to))
    checker.issue(checker.path("from"), "and to are needed, without at: value is \"" + response.value + "\"");
  if (response.from && response.to && *response.from >= *response.to)
    checker.issue(checker.path("from"), "is " + text_of(*response.from) + ", not below to, " + text_of(*response.to));
}

void check_meaning(Checker& checker, const ObjectiveSpec& objective) {
  checker.must_be_identifier(checker.path(), objective.name);
  const bool sums = objective.running || objective.terminal || objective.parameters_only ||
                    !objective.samples.empty() || !objective.track.empty();
  const long alone = count_of(objective.means) + objective.eigenvalue.has_value() +
                     objective.frequency_response.has_value() + objective.is_written_in_cpp();
  const std::vector<std::string> kinds = kinds_and({"eigenvalue", "frequency_response", "user"});
  if (!sums && alone == 0)
    checker.issue(checker.path(),
                  "has no part; running, terminal, samples, track and parameters_only (added), or one of " +
                      joined(kinds) + " is needed");
  if (alone > 1 || (alone == 1 && sums))
    checker.issue(checker.path(),
                  "has one of " + joined(kinds) +
                      " and another part; each of them must be the only part, so make it an objective of its own");
  if (objective.sharpness && !objective.is_extreme())
    checker.issue(checker.path("sharpness"),
                  "is given without maximum_of, minimum_of or peak_to_peak_of, which it belongs to");
  const SimulationSettings& simulation = checker.facts().scene().simulation;
  for (std::size_t i = 0; i < objective.track.size(); ++i) {
    const TrackTerm& term = objective.track[i];
    const std::string place = child_path(checker.path("track"), i);
    check_track(checker, term, place);
    const auto first = std::ranges::find(objective.track, term.file, &TrackTerm::file);
    if (first->timing != term.timing)
      checker.issue(place + ".timing",
                    "is not that of the first term of its file; the terms of a file share the instants of its rows");
  }
  for (std::size_t i = 0; i < objective.samples.size(); ++i) {
    const double time = objective.samples[i].time;
    if (time < simulation.start_time || time > simulation.end_time)
      checker.issue(child_path(checker.path("samples"), i) + ".time",
                    "is " + text_of(time) + " s, outside the simulated time, " + text_of(simulation.start_time) +
                        " s to " + text_of(simulation.end_time) + " s");
  }
}

void check_meaning(Checker& checker, const ObjectiveBound& bound) {
  const long given = !bound.objective.empty() + count_of(bound.means) + bound.sampled.has_value();
  if (bound.sampled.has_value() != bound.every.has_value())
    checker.issue(checker.path(), "has only one of \"sampled\" and \"every\"; they say what is limited, and when");
  constexpr double kMostLimits = 10'000;
  const SimulationSettings& simulation = checker.facts().scene().simulation;
  if (bound.every && *bound.every > 0 && simulation.end_time - simulation.start_time > kMostLimits * *bound.every)
    checker.issue(checker.path("every"), "is " + text_of(*bound.every) + " s, which makes more than " +
                                             text_of(kMostLimits) + " limits of the simulated time");
  if (given != 1)
    checker.issue(checker.path(), std::string(given == 0 ? "does not say what it bounds" : "bounds several things") +
                                      "; one is needed: objective, or in its place " + joined(kinds_and({"sampled"})));
  if (bound.sharpness && !is_extreme(bound.means))
    checker.issue(checker.path("sharpness"),
                  "is given without maximum_of, minimum_of or peak_to_peak_of; a named objective has its own");
  if (!bound.lower && !bound.upper)
    checker.issue(checker.path(), "has neither \"lower\" nor \"upper\"; at least one is needed");
  if (bound.lower && bound.upper && *bound.lower > *bound.upper)
    checker.issue(checker.path("lower"),
                  "is " + text_of(*bound.lower) + ", above the upper bound " + text_of(*bound.upper));
}

void check_meaning(Checker& checker, const DesignSpec& design) {
  const int forms =
      !design.minimize.empty() + !design.maximize.empty() + !design.sum.empty() + !design.largest_of.empty();
  if (forms == 0)
    checker.issue(checker.path("minimize"), "is missing; expected: the objective to minimise, or \"maximize\"");
  if (forms > 1)
    checker.issue(checker.path("minimize"),
                  "is more than one of an objective, \"sum\", \"largest_of\" and \"maximize\"; give one of them");
  for (std::size_t i = 0; i < design.sum.size(); ++i) {
    const WeightedObjective& term = design.sum[i];
    const std::string place = child_path(checker.path("minimize") + ".sum", i);
    if (term.objective.empty() == !given_kind(term.means))
      checker.issue(place, "must have an \"objective\" or a mean such as \"maximum_of\", and not both");
    if (term.weight == 0) checker.issue(place + ".weight", "is 0: this part has no effect");
  }
  for (const SceneIssue& found : optimizer_issues(design, checker.facts().scene()))
    checker.issue(found.path, found.message);
  std::map<std::string, std::size_t> first;
  for (std::size_t i = 0; i < design.subject_to.size(); ++i) {
    const ObjectiveBound& bound = design.subject_to[i];
    const bool mean = given_kind(bound.means);
    if (!mean && !bound.sampled) continue;
    const std::string name = mean ? name_of_mean(bound.means) : "sampled " + bound.sampled->text();
    const auto [it, is_new] = first.emplace(name, i);
    if (!is_new)
      checker.issue(child_path(checker.path("subject_to"), i), "bounds " + it->first + " once more; " +
                                                                   child_path(checker.path("subject_to"), it->second) +
                                                                   " may have both \"lower\" and \"upper\"");
  }
}

void check_meaning(Checker& checker, const ChannelSpec& channel) {
  const std::optional<double> sigma = checker.facts().value(channel.sigma);
  if (sigma && *sigma <= 0) checker.issue(checker.path("sigma"), "is " + text_of(*sigma) + ", it must be positive");
  if (channel.gain.is_number() && channel.gain.number() == 0)
    checker.issue(checker.path("gain"), "is 0: nothing of the sensor '" + channel.sensor + "' is compared then");
}

namespace {

void check_drives_once(Checker& checker, const std::vector<DriveLaw>& drives, const std::string& where) {
  for (std::size_t i = 0; i < drives.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (drives[k].drive == drives[i].drive)
        checker.issue(child_path(checker.path("drives"), i) + ".drive",
                      "'" + drives[i].drive + "' has a law in this " + where + " already");
}

}  // namespace

void check_meaning(Checker& checker, const CaseSpec& load_case) {
  const SceneFacts& facts = checker.facts();
  const SimulationSettings& simulation = facts.scene().simulation;
  if (load_case.end_time && *load_case.end_time <= simulation.start_time)
    checker.issue(checker.path("end_time"), "the case ends at " + text_of(*load_case.end_time) +
                                                " s, which must be after its start at " +
                                                text_of(simulation.start_time) + " s");
  const std::vector<std::string> parameters = facts.names(ElementKind::parameter);
  const std::vector<Definition>& definitions = facts.scene().definitions;
  for (const Definition& override : load_case.overrides) {
    const std::string place = child_path(checker.path("overrides"), override.name);
    if (!facts.has(ElementKind::parameter, override.name))
      checker.issue(place, "there is no parameter '" + override.name + "'" + did_you_mean(override.name, parameters) +
                               "; known: " + joined(parameters));
    for (const std::string& name : override.value.names())
      if (std::ranges::find(definitions, name, &Definition::name) != definitions.end())
        checker.issue(place, "uses the definition '" + name + "'; an override is an expression of parameters");
  }
  check_drives_once(checker, load_case.drives, "case");
}

void check_meaning(Checker& checker, const ExperimentSpec& experiment) {
  if (experiment.channels.empty()) checker.issue(checker.path("channels"), "is empty; at least one column is compared");
  if (const std::optional<Unit> unit = parse_unit(experiment.time_unit);
      !experiment.time_unit.empty() && (!unit || !compatible(unit->dimension, dimension::kTime)))
    checker.issue(checker.path("time_unit"), "'" + experiment.time_unit + "' is no unit of time");
  const SimulationSettings& simulation = checker.facts().scene().simulation;
  const double start = experiment.start_time.value_or(simulation.start_time);
  check_drives_once(checker, experiment.drives, "experiment");
  if (experiment.end_time && *experiment.end_time <= start)
    checker.issue(checker.path("end_time"), "the experiment ends at " + text_of(*experiment.end_time) +
                                                " s, which must be after its start at " + text_of(start) + " s");
}

namespace {

// Reports samples that two experiments share.
void check_shared_samples(Checker& checker, const std::vector<ExperimentSpec>& experiments, const std::string& list) {
  const double start = checker.facts().scene().simulation.start_time;
  const double never = std::numeric_limits<double>::infinity();
  const auto column_of_both = [](const ExperimentSpec& a, const ExperimentSpec& b) -> const std::string* {
    for (const ChannelSpec& x : a.channels)
      for (const ChannelSpec& y : b.channels)
        if (x.column == y.column) return &x.column;
    return nullptr;
  };
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const ExperimentSpec &a = experiments[i], &b = experiments[k];
      if (std::ranges::find_first_of(a.data, b.data) == a.data.end() || a.time != b.time || (a.validate && b.validate))
        continue;
      const double from = std::max(a.start_time.value_or(start), b.start_time.value_or(start));
      const double to = std::min(a.end_time.value_or(never), b.end_time.value_or(never));
      const std::string* const column = column_of_both(a, b);
      if (!column || from >= to) continue;
      checker.warning(child_path(list, i) + ".data",
                      "its samples of '" + *column + "' from " + text_of(from) + " s on belong to experiments[" +
                          std::to_string(k) + "] as well: " +
                          (a.validate || b.validate ? "what is fitted to them is no test of the model"
                                                    : "they count twice, and the standard errors come out too small"));
    }
  }
}

void check_loss(Checker& checker, const Loss& loss) {
  if (!loss.scale) return;
  const std::string path = checker.path("loss") + ".scale";
  constexpr double kDigits = 1e8;  // its square is the accuracy of numbers, beyond which a loss has no shape
  if (loss.type == LossType::squared)
    checker.issue(path, "is given with the loss 'squared', which has none");
  else if (*loss.scale < 1 / kDigits || *loss.scale > kDigits)
    checker.issue(path, "is " + text_of(*loss.scale) + " sigma; it must lie between 1e-8 and 1e8, usual are 1 to 5");
}

}  // namespace

void check_meaning(Checker& checker, const IdentificationSpec& identification) {
  const std::vector<ExperimentSpec>& experiments = identification.experiments;
  const std::string list = checker.path("experiments");
  if (identification.multistart) {
    for (const SceneIssue& found : starts_issues(*identification.multistart, identification.variables,
                                                 checker.facts().scene(), checker.path("multistart")))
      checker.issue(found.path, found.message);
    if (identification.multistart->all_branches)
      checker.issue(checker.path("multistart") + ".branches",
                    "is \"all\", which is of design.multistart only; a fit begins at the poses in the file");
  }
  const bool any_fit =
      std::any_of(experiments.begin(), experiments.end(), [](const ExperimentSpec& e) { return !e.validate; });
  if (!any_fit) checker.issue(list, "has no experiment of role \"fit\"; at least one is needed");
  check_loss(checker, identification.loss);
  check_shared_samples(checker, experiments, list);
  for (std::size_t i = 0; identification.sigma_is_known && i < experiments.size(); ++i)
    for (std::size_t k = 0; k < experiments[i].channels.size(); ++k)
      if (experiments[i].channels[k].estimate_sigma != SigmaEstimate::none)
        checker.issue(child_path(child_path(list, i) + ".channels", k) + ".estimate_sigma",
                      "asks for an estimate, but identification.sigma_is_known is true; one of them must be false");
  for (std::size_t i = 0; i < experiments.size(); ++i)
    if (experiments[i].validate && experiments[i].windows && experiments[i].windows->continuity)
      checker.issue(child_path(list, i) + ".windows.continuity",
                    "is true in an experiment of role \"validate\", whose windows are refitted one by one");
  const auto fitted = std::count_if(experiments.begin(), experiments.end(), [](const auto& e) { return !e.validate; });
  const bool cut =
      std::any_of(experiments.begin(), experiments.end(), [](const auto& e) { return e.windows && !e.validate; });
  if (identification.covariance == CovarianceType::windows && fitted == 1 && !cut)
    checker.issue(checker.path("covariance"), "is \"windows\", which compares experiments, and one is fitted only");
  check_unique_names(checker, experiments, "an experiment",
                     [&](std::size_t i) { return child_path(list, i) + ".name"; });
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    for (std::size_t k = 0; k < experiments[i].free.size(); ++k) {
      const std::string& name = experiments[i].free[k];
      if (std::find(identification.variables.begin(), identification.variables.end(), name) !=
          identification.variables.end())
        checker.issue(
            child_path(child_path(list, i) + ".free", k),
            "'" + name + "' is one of \"variables\", which have one value in all experiments; take it out of one");
    }
  }
}

// The parameters in a signal's delay.
std::vector<std::string> delayed_by(const Signal& signal, const Scene& scene) {
  const Program delay(signal.delay, parameter_symbols(scene));
  std::vector<std::string> names;
  for (const int input : delay.used_inputs()) names.push_back(scene.parameters[static_cast<std::size_t>(input)].name);
  return names;
}

// The override that shifts a signal of the problem; empty if there is none.
std::string override_of_delay(const CaseSpec& load_case, const std::string& signal, const Scene& scene) {
  const auto in_problem = std::ranges::find(scene.signals, signal, &Signal::name);
  for (const std::string& name : delayed_by(*in_problem, scene))
    if (std::ranges::find(load_case.overrides, name, &Definition::name) != load_case.overrides.end()) return name;
  return "";
}

// A signal that covers the run may not cover that of a case. A case may have its own samples and delays.
void check_coverage(Checker& checker, const CaseSpec& load_case, const Problem& of_case, const Problem& problem,
                    const std::string& place) {
  const SceneFacts facts(of_case.scene);
  const SimulationSettings& run = of_case.scene.simulation;
  for (const Signal& signal : of_case.scene.signals) {
    const bool own = std::ranges::find(load_case.signals, signal.name, &SignalSamples::name) != load_case.signals.end();
    const std::string moved = override_of_delay(load_case, signal.name, problem.scene);
    const std::optional<double> delay = facts.value(signal.delay);
    if (!signal.curve || !delay || (!own && !load_case.end_time && moved.empty())) continue;
    if (const auto why = uncovered(covered_by(*signal.curve, *delay), run.start_time, run.end_time))
      checker.issue(own                  ? child_path(place + ".signals", signal.name)
                    : load_case.end_time ? place + ".end_time"
                                         : child_path(place + ".overrides", moved),
                    "signal '" + signal.name + "': " + *why);
  }
}

// Signals that jump at times which depend on one of the names; these are varied.
struct MovedJumps {
  std::string signal, by;
  std::string words(const std::string& where = "") const {
    return "depends on '" + by + "', which is varied" + where + ", and hold jumps at times that move with it: its " +
           "derivative has no value; take \"interpolation\": \"linear\" or \"spline\"";
  }
  std::string place() const { return child_path("signals", signal) + ".delay"; }
};
std::vector<MovedJumps> moved_jumps(const Scene& scene, const std::vector<std::string>& names) {
  std::vector<MovedJumps> found;
  for (const Signal& signal : scene.signals) {
    if (signal.interpolation != Interpolation::hold) continue;
    for (const std::string& name : delayed_by(signal, scene))
      if (std::ranges::find(names, name) != names.end()) found.push_back({signal.name, name});
  }
  return found;
}

void check_moved_jumps(Checker& checker, const CaseSpec& load_case, const Problem& of_case, const Problem& problem,
                       const std::string& place) {
  for (MovedJumps& jumps : moved_jumps(of_case.scene, of_case.design->variables)) {
    const std::string moved = override_of_delay(load_case, jumps.signal, problem.scene);
    jumps.by = in_names_of_problem(jumps.by, load_case, problem.scene);
    checker.issue(moved.empty() ? jumps.place() : child_path(place + ".overrides", moved),
                  moved.empty() ? jumps.words()
                                : "the delay of the signal '" + jumps.signal + "' " +
                                      jumps.words(" in the case '" + load_case.name + "'"));
  }
}

// Checks signals with the changes by cases and experiments, and with the varied parameters.
void check_signals(Checker& checker, const Problem& problem) {
  for (std::size_t c = 0; c < problem.cases.size(); ++c) {
    const Problem of_case = problem_of(problem, problem.cases[c]);
    check_coverage(checker, problem.cases[c], of_case, problem, child_path("cases", c));
    if (problem.design) check_moved_jumps(checker, problem.cases[c], of_case, problem, child_path("cases", c));
  }
  const auto check = [&](const std::vector<std::string>& names, const std::string& where) {
    for (const MovedJumps& jumps : moved_jumps(problem.scene, names)) checker.issue(jumps.place(), jumps.words(where));
  };
  if (problem.design && problem.cases.empty()) check(problem.design->variables, "");
  if (!problem.identification) return;
  check(problem.identification->variables, "");
  for (const ExperimentSpec& experiment : problem.identification->experiments)
    check(experiment.free, " in the experiment '" + experiment.name + "'");
}

void check_meaning(Checker& checker, const Problem& problem) {
  const auto place = [](std::size_t c) { return child_path("cases", c); };
  check_unique_names(checker, problem.cases, "a case", [&](std::size_t c) { return place(c) + ".name"; });
  for (std::size_t c = 0; c < problem.cases.size(); ++c) {
    if (!problem.cases[c].end_time) continue;
    const double end = *problem.cases[c].end_time, end_of_file = problem.scene.simulation.end_time;
    if (problem.design && end < end_of_file &&
        std::ranges::any_of(problem.design->subject_to, [](const ObjectiveBound& b) { return b.sampled.has_value(); }))
      checker.issue(place(c) + ".end_time", "is " + text_of(end) + " s, but a limit is sampled until " +
                                                text_of(end_of_file) + " s, simulation.end_time");
    for (const ObjectiveSpec& objective : problem.objectives)
      for (const ObjectiveSample& sample : objective.samples)
        if (sample.time > end)
          checker.issue(place(c) + ".end_time", "is " + text_of(end) + " s, but the objective '" + objective.name +
                                                    "' has a sample at " + text_of(sample.time) + " s");
  }
  if (problem.cases.size() < 2 && problem.design && problem.design->over == "max")
    checker.issue("design.minimize.over", "is \"max\", of which there is none without several \"cases\"");
}

std::vector<SceneIssue> find_issues(const Problem& problem) {
  SceneFacts facts(problem.scene);
  std::vector<std::string> objectives;
  for (const ObjectiveSpec& objective : problem.objectives) objectives.push_back(objective.name);
  facts.add_objectives(std::move(objectives));
  std::vector<SceneIssue> issues;
  Checker checker(facts, issues);
  checker.check(problem);
  check_meaning(checker, problem.scene);
  if (issues.empty()) {
    if (const std::optional<SceneIssue> found = curvature_issue(problem)) checker.issue(found->path, found->message);
    check_signals(checker, problem);
  }
  return without_repetitions(std::move(issues));
}

}  // namespace mbsopt::inline optim
