#include "optim/objective/problem_issues.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

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

// Reports a field of the checked object.
template <class... Values>
void report(Checker& checker, std::string_view key, fmt::format_string<Values...> words, Values&&... values) {
  checker.issue(checker.path(key), fmt::format(words, std::forward<Values>(values)...));
}

// Compares the dimension of a column's unit with that of the sensor.
void check_column_unit(Checker& checker, const std::string& unit_text, const std::string& sensor_name) {
  const Sensor* const sensor = checker.facts().sensor(sensor_name);
  const TypeRow* const row = sensor ? find_row(kSensorQuantities, sensor->quantity) : nullptr;
  const std::optional<Unit> unit = parse_column_unit(unit_text);
  if (unit_text.empty() || !row) return;
  if (!unit)
    report(checker, "unit", "'{}' is not a known unit; units are products, quotients and whole powers of {}", unit_text,
           known_units());
  else if (!unit->dimension.is_none() && !compatible(unit->dimension, row->dimension))
    report(checker, "column", "is in {}, the sensor '{}' in {}", to_string(unit->dimension), sensor_name,
           to_string(row->dimension));
}

// Rows of the file outside the run are left out.
void check_track(Checker& checker, const TrackTerm& term, const std::string& place) {
  if (const std::optional<double> weight = checker.facts().value(term.weight); weight && *weight < 0)
    checker.issue(place + ".weight",
                  fmt::format("is {}, the weight of a square must not be negative", text_of(*weight)));
  const bool prescribed = term.timing == Timing::prescribed;
  if (!prescribed) {
    const Sensor* const sensor = checker.facts().sensor(term.sensor);
    if (sensor && checker.facts().reads_of(*sensor) != Reads::positions)
      checker.issue(place + ".timing",
                    fmt::format("is not 'prescribed', but the sensor '{}' is no function of positions alone; free "
                                "timing seeks the position of the motion that is nearest to each row",
                                term.sensor));
    if (checker.facts().scene().drives.empty())
      checker.issue(place + ".timing", "is not 'prescribed', but there are no drives, whose values it frees");
  }
  if (!term.curve || !prescribed) return;
  const SimulationSettings& simulation = checker.facts().scene().simulation;
  const std::vector<double>& t = term.curve->x();
  const auto rows = static_cast<std::size_t>(
      std::ranges::count_if(t, [&](double x) { return x >= simulation.start_time && x <= simulation.end_time; }));
  const std::string of_run =
      fmt::format("the run, {} s to {} s; its times go from {} s to {} s", text_of(simulation.start_time),
                  text_of(simulation.end_time), text_of(t.front()), text_of(t.back()));
  if (rows == 0)
    checker.issue(child_path(place, "file"), "has no row within " + of_run);
  else if (rows < t.size())
    checker.warning(
        child_path(place, "file"),
        fmt::format("only {} of its {} rows lie within {}; the others are left out", rows, t.size(), of_run));
}

long count_of(const Means& means) {
  return std::ranges::count_if(means, [](const std::optional<Expression>& mean) { return mean.has_value(); });
}

// The names of all means, and others.
std::string kinds_and(std::initializer_list<std::string> others) {
  std::vector<std::string> kinds;
  for (const MeanKind& kind : kMeanKinds) kinds.emplace_back(kind.name);
  kinds.insert(kinds.end(), others);
  return joined(kinds);
}

void check_drives_once(Checker& checker, const std::vector<DriveLaw>& drives, const std::string& where) {
  for (std::size_t i = 0; i < drives.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (drives[k].drive == drives[i].drive)
        checker.issue(child_path(checker.path("drives"), i) + ".drive",
                      fmt::format("'{}' has a law in this {} already", drives[i].drive, where));
}

// Reports samples that two experiments share.
void check_shared_samples(Checker& checker, const std::vector<ExperimentSpec>& experiments, const std::string& list) {
  const double start = checker.facts().scene().simulation.start_time;
  const double never = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const ExperimentSpec &a = experiments[i], &b = experiments[k];
      if (std::ranges::find_first_of(a.data, b.data) == a.data.end() || a.time != b.time || (a.validate && b.validate))
        continue;
      const double from = std::max(a.start_time.value_or(start), b.start_time.value_or(start));
      const double to = std::min(a.end_time.value_or(never), b.end_time.value_or(never));
      const auto channel =
          std::ranges::find_first_of(a.channels, b.channels, {}, &ChannelSpec::column, &ChannelSpec::column);
      if (channel == a.channels.end() || from >= to) continue;
      checker.warning(
          child_path(list, i) + ".data",
          fmt::format("its samples of '{}' from {} s on belong to experiments[{}] as well: {}", channel->column,
                      text_of(from), k,
                      a.validate || b.validate ? "what is fitted to them is no test of the model"
                                               : "they count twice, and the standard errors come out too small"));
    }
  }
}

void check_loss(Checker& checker, const Loss& loss) {
  if (!loss.scale) return;
  constexpr double kDigits = 1e8;  // its square is the accuracy of numbers, beyond which a loss has no shape
  if (loss.type == LossType::squared)
    checker.issue(checker.path("loss") + ".scale", "is given with the loss 'squared', which has none");
  else if (*loss.scale < 1 / kDigits || *loss.scale > kDigits)
    checker.issue(checker.path("loss") + ".scale",
                  fmt::format("is {} sigma; it must lie between 1e-8 and 1e8, usual are 1 to 5", text_of(*loss.scale)));
}

}  // namespace

// Checker::check finds these functions through the arguments' namespace.
void check_meaning(Checker& checker, const TrackTerm& term) { check_column_unit(checker, term.unit, term.sensor); }

void check_meaning(Checker& checker, const DriveLaw& law) {
  if (const Drive* const drive = checker.facts().drive(law.drive))
    checker.time_law("law", law.law, law.samples,
                     {"", Need::required, dimension_of_drive(drive->type, drive->coordinate)});
}

void check_meaning(Checker& checker, const SignalSamples& samples) {
  check_units(checker, samples);
  std::vector<std::string> names;
  for (const Signal& signal : checker.facts().scene().signals) names.push_back(signal.name);
  if (std::ranges::find(names, samples.name) == names.end())
    checker.issue(checker.path(), "there is no signal '" + samples.name + "'" + did_you_mean(samples.name, names) +
                                      (names.empty() ? "; there are no signals" : "; signals: " + joined(names)));
}

void check_meaning(Checker& checker, const EigenvalueSpec& eigenvalue) {
  if (eigenvalue.mode && eigenvalue.value.starts_with("least"))
    report(checker, "mode", "is given, but {} is the least of all modes", eigenvalue.value);
}

void check_meaning(Checker& checker, const FrequencyResponseSpec& response) {
  const bool at_one = response.value == "amplitude" || response.value == "phase";
  if (at_one && (!response.at || response.from || response.to))
    report(checker, "at", "is needed, without from and to: value is \"{}\"", response.value);
  if (!at_one && (response.at || !response.from || !response.to))
    report(checker, "from", "and to are needed, without at: value is \"{}\"", response.value);
  if (response.from && response.to && *response.from >= *response.to)
    report(checker, "from", "is {}, not below to, {}", text_of(*response.from), text_of(*response.to));
}

void check_meaning(Checker& checker, const ObjectiveSpec& objective) {
  checker.must_be_identifier(checker.path(), objective.name);
  const bool sums = objective.running || objective.terminal || objective.parameters_only ||
                    !objective.samples.empty() || !objective.track.empty();
  const long alone = count_of(objective.means) + objective.eigenvalue.has_value() +
                     objective.frequency_response.has_value() + objective.is_written_in_cpp();
  const std::string kinds = kinds_and({"eigenvalue", "frequency_response", "user"});
  if (!sums && alone == 0)
    checker.issue(checker.path(),
                  "has no part; running, terminal, samples, track and parameters_only (added), or one of " + kinds +
                      " is needed");
  if (alone > 1 || (alone == 1 && sums))
    checker.issue(checker.path(),
                  "has one of " + kinds +
                      " and another part; each of them must be the only part, so make it an objective of its own");
  if (objective.sharpness && !objective.is_extreme())
    report(checker, "sharpness", "is given without maximum_of, minimum_of or peak_to_peak_of, which it belongs to");
  for (std::size_t i = 0; i < objective.track.size(); ++i) {
    const TrackTerm& term = objective.track[i];
    const std::string place = child_path(checker.path("track"), i);
    check_track(checker, term, place);
    if (std::ranges::find(objective.track, term.file, &TrackTerm::file)->timing != term.timing)
      checker.issue(place + ".timing",
                    "is not that of the first term of its file; the terms of a file share the instants of its rows");
  }
  const SimulationSettings& simulation = checker.facts().scene().simulation;
  for (std::size_t i = 0; i < objective.samples.size(); ++i) {
    const double time = objective.samples[i].time;
    if (time < simulation.start_time || time > simulation.end_time)
      checker.issue(child_path(checker.path("samples"), i) + ".time",
                    fmt::format("is {} s, outside the simulated time, {} s to {} s", text_of(time),
                                text_of(simulation.start_time), text_of(simulation.end_time)));
  }
}

void check_meaning(Checker& checker, const ObjectiveBound& bound) {
  const long given = !bound.objective.empty() + count_of(bound.means) + bound.sampled.has_value();
  if (bound.sampled.has_value() != bound.every.has_value())
    checker.issue(checker.path(), "has only one of \"sampled\" and \"every\"; they say what is limited, and when");
  constexpr double kMostLimits = 10'000;
  const SimulationSettings& simulation = checker.facts().scene().simulation;
  if (bound.every && *bound.every > 0 && simulation.end_time - simulation.start_time > kMostLimits * *bound.every)
    report(checker, "every", "is {} s, which makes more than {} limits of the simulated time", text_of(*bound.every),
           text_of(kMostLimits));
  if (given != 1)
    checker.issue(checker.path(), std::string(given == 0 ? "does not say what it bounds" : "bounds several things") +
                                      "; one is needed: objective, or in its place " + kinds_and({"sampled"}));
  if (bound.sharpness && !is_extreme(bound.means))
    report(checker, "sharpness",
           "is given without maximum_of, minimum_of or peak_to_peak_of; a named objective has its own");
  if (!bound.lower && !bound.upper)
    checker.issue(checker.path(), "has neither \"lower\" nor \"upper\"; at least one is needed");
  if (bound.lower && bound.upper && *bound.lower > *bound.upper)
    report(checker, "lower", "is {}, above the upper bound {}", text_of(*bound.lower), text_of(*bound.upper));
}

void check_meaning(Checker& checker, const DesignSpec& design) {
  const int forms =
      !design.minimize.empty() + !design.maximize.empty() + !design.sum.empty() + !design.largest_of.empty();
  if (forms == 0) report(checker, "minimize", "is missing; expected: the objective to minimise, or \"maximize\"");
  if (forms > 1)
    report(checker, "minimize",
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
  std::map<std::string, std::string> first;  // places
  for (std::size_t i = 0; i < design.subject_to.size(); ++i) {
    const ObjectiveBound& bound = design.subject_to[i];
    const bool mean = given_kind(bound.means);
    if (!mean && !bound.sampled) continue;
    const std::string name = mean ? name_of_mean(bound.means) : "sampled " + bound.sampled->text();
    const std::string place = child_path(checker.path("subject_to"), i);
    if (const auto [it, is_new] = first.emplace(name, place); !is_new)
      checker.issue(place,
                    fmt::format("bounds {} once more; {} may have both \"lower\" and \"upper\"", name, it->second));
  }
}

void check_meaning(Checker& checker, const ChannelSpec& channel) {
  const std::optional<double> sigma = checker.facts().value(channel.sigma);
  if (sigma && *sigma <= 0) report(checker, "sigma", "is {}, it must be positive", text_of(*sigma));
  if (channel.gain.is_number() && channel.gain.number() == 0)
    report(checker, "gain", "is 0: nothing of the sensor '{}' is compared then", channel.sensor);
}

void check_meaning(Checker& checker, const CaseSpec& load_case) {
  const SceneFacts& facts = checker.facts();
  const double start = facts.scene().simulation.start_time;
  if (load_case.end_time && *load_case.end_time <= start)
    report(checker, "end_time", "the case ends at {} s, which must be after its start at {} s",
           text_of(*load_case.end_time), text_of(start));
  const std::vector<std::string>& parameters = facts.names(ElementKind::parameter);
  const std::vector<Definition>& definitions = facts.scene().definitions;
  for (const Definition& override : load_case.overrides) {
    const std::string place = child_path(checker.path("overrides"), override.name);
    if (!facts.has(ElementKind::parameter, override.name))
      checker.issue(place, fmt::format("there is no parameter '{}'{}; known: {}", override.name,
                                       did_you_mean(override.name, parameters), joined(parameters)));
    for (const std::string& name : override.value.names())
      if (std::ranges::find(definitions, name, &Definition::name) != definitions.end())
        checker.issue(place, "uses the definition '" + name + "'; an override is an expression of parameters");
  }
  check_drives_once(checker, load_case.drives, "case");
}

void check_meaning(Checker& checker, const ExperimentSpec& experiment) {
  if (experiment.channels.empty()) report(checker, "channels", "is empty; at least one column is compared");
  if (const std::optional<Unit> unit = parse_unit(experiment.time_unit);
      !experiment.time_unit.empty() && (!unit || !compatible(unit->dimension, dimension::kTime)))
    report(checker, "time_unit", "'{}' is no unit of time", experiment.time_unit);
  const double start = experiment.start_time.value_or(checker.facts().scene().simulation.start_time);
  check_drives_once(checker, experiment.drives, "experiment");
  if (experiment.end_time && *experiment.end_time <= start)
    report(checker, "end_time", "the experiment ends at {} s, which must be after its start at {} s",
           text_of(*experiment.end_time), text_of(start));
}

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
  const auto fitted = std::ranges::count(experiments, false, &ExperimentSpec::validate);
  if (fitted == 0) checker.issue(list, "has no experiment of role \"fit\"; at least one is needed");
  check_loss(checker, identification.loss);
  check_shared_samples(checker, experiments, list);
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    const ExperimentSpec& e = experiments[i];
    const std::string place = child_path(list, i);
    for (std::size_t k = 0; identification.sigma_is_known && k < e.channels.size(); ++k)
      if (e.channels[k].estimate_sigma != SigmaEstimate::none)
        checker.issue(child_path(place + ".channels", k) + ".estimate_sigma",
                      "asks for an estimate, but identification.sigma_is_known is true; one of them must be false");
    if (e.validate && e.windows && e.windows->continuity)
      checker.issue(place + ".windows.continuity",
                    "is true in an experiment of role \"validate\", whose windows are refitted one by one");
    for (std::size_t k = 0; k < e.free.size(); ++k)
      if (std::ranges::find(identification.variables, e.free[k]) != identification.variables.end())
        checker.issue(child_path(place + ".free", k),
                      fmt::format("'{}' is one of \"variables\", which have one value in all experiments; take it out "
                                  "of one",
                                  e.free[k]));
  }
  const bool cut = std::ranges::any_of(experiments, [](const auto& e) { return e.windows && !e.validate; });
  if (identification.covariance == CovarianceType::windows && fitted == 1 && !cut)
    report(checker, "covariance", "is \"windows\", which compares experiments, and one is fitted only");
  check_unique_names(checker, experiments, "an experiment",
                     [&](std::size_t i) { return child_path(list, i) + ".name"; });
}

namespace {

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

// Signals that jump at times which depend on one of the names, with that name.
std::vector<std::pair<std::string, std::string>> moved_jumps(const Scene& scene,
                                                             const std::vector<std::string>& names) {
  std::vector<std::pair<std::string, std::string>> found;
  for (const Signal& signal : scene.signals) {
    if (signal.interpolation != Interpolation::hold) continue;
    for (const std::string& name : delayed_by(signal, scene))
      if (std::ranges::find(names, name) != names.end()) found.emplace_back(signal.name, name);
  }
  return found;
}

std::string is_moved_by(const std::string& name, const std::string& where) {
  return "depends on '" + name + "', which is varied" + where + ", and hold jumps at times that move with it: its " +
         "derivative has no value; take \"interpolation\": \"linear\" or \"spline\"";
}

// Checks signals with the changes by cases and experiments, and with the varied parameters.
void check_signals(Checker& checker, const Problem& problem) {
  const auto check = [&](const std::vector<std::string>& names, const std::string& where) {
    for (const auto& [signal, by] : moved_jumps(problem.scene, names))
      checker.issue(child_path("signals", signal) + ".delay", is_moved_by(by, where));
  };
  for (std::size_t c = 0; c < problem.cases.size(); ++c) {
    const CaseSpec& load_case = problem.cases[c];
    const Problem of_case = problem_of(problem, load_case);
    check_coverage(checker, load_case, of_case, problem, child_path("cases", c));
    if (!problem.design) continue;
    for (const auto& [signal, by] : moved_jumps(of_case.scene, of_case.design->variables)) {
      const std::string moved = override_of_delay(load_case, signal, problem.scene);
      const std::string name = in_names_of_problem(by, load_case, problem.scene);
      if (moved.empty())
        checker.issue(child_path("signals", signal) + ".delay", is_moved_by(name, ""));
      else
        checker.issue(
            child_path(child_path("cases", c) + ".overrides", moved),
            "the delay of the signal '" + signal + "' " + is_moved_by(name, " in the case '" + load_case.name + "'"));
    }
  }
  if (problem.design && problem.cases.empty()) check(problem.design->variables, "");
  if (!problem.identification) return;
  check(problem.identification->variables, "");
  for (const ExperimentSpec& experiment : problem.identification->experiments)
    check(experiment.free, " in the experiment '" + experiment.name + "'");
}

}  // namespace

void check_meaning(Checker& checker, const Problem& problem) {
  const auto place = [](std::size_t c) { return child_path("cases", c); };
  check_unique_names(checker, problem.cases, "a case", [&](std::size_t c) { return place(c) + ".name"; });
  for (std::size_t c = 0; c < problem.cases.size(); ++c) {
    if (!problem.cases[c].end_time) continue;
    const double end = *problem.cases[c].end_time, end_of_file = problem.scene.simulation.end_time;
    if (problem.design && end < end_of_file &&
        std::ranges::any_of(problem.design->subject_to, [](const ObjectiveBound& b) { return b.sampled.has_value(); }))
      checker.issue(place(c) + ".end_time",
                    fmt::format("is {} s, but a limit is sampled until {} s, simulation.end_time", text_of(end),
                                text_of(end_of_file)));
    for (const ObjectiveSpec& objective : problem.objectives)
      for (const ObjectiveSample& sample : objective.samples)
        if (sample.time > end)
          checker.issue(place(c) + ".end_time", fmt::format("is {} s, but the objective '{}' has a sample at {} s",
                                                            text_of(end), objective.name, text_of(sample.time)));
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
