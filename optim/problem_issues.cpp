#include "optim/problem_issues.hpp"

#include <algorithm>

#include "core/scene/checker.hpp"
#include "optim/design_issues.hpp"
#include "optim/problem_vocabulary.hpp"

namespace mbsopt {

namespace {

std::string text_of(double value) { return Expression(value).text(); }

}  // namespace

// Found by Checker::check through the arguments' namespace.
void check_meaning(Checker& checker, const ObjectiveSpec& objective) {
  checker.must_be_identifier(checker.path(), objective.name);
  const bool sums = objective.running || objective.terminal || objective.parameters_only || !objective.samples.empty();
  const int alone = objective.maximum_of.has_value() + objective.minimum_of.has_value() + objective.rms_of.has_value();
  if (!sums && alone == 0)
    checker.issue(checker.path(),
                  "has no part; running, terminal, samples and parameters_only (added), or one of maximum_of, "
                  "minimum_of and rms_of is needed");
  if (alone > 1 || (alone == 1 && sums))
    checker.issue(checker.path(),
                  "has maximum_of, minimum_of or rms_of beside another part; each of them stands alone, so make it an "
                  "objective of its own");
  if (objective.sharpness && !objective.maximum_of && !objective.minimum_of)
    checker.issue(checker.path("sharpness"), "is given without maximum_of or minimum_of, which it belongs to");
  const SimulationSettings& simulation = checker.facts().scene().simulation;
  for (std::size_t i = 0; i < objective.samples.size(); ++i) {
    const double time = objective.samples[i].time;
    if (time < simulation.start_time || time > simulation.end_time)
      checker.issue(child_path(checker.path("samples"), i) + ".time",
                    "is " + text_of(time) + " s, outside the simulated time, " + text_of(simulation.start_time) +
                        " s to " + text_of(simulation.end_time) + " s");
  }
}

void check_meaning(Checker& checker, const ObjectiveBound& bound) {
  if (!bound.lower && !bound.upper)
    checker.issue(checker.path(), "has neither \"lower\" nor \"upper\"; at least one is needed");
  if (bound.lower && bound.upper && *bound.lower > *bound.upper)
    checker.issue(checker.path("lower"),
                  "is " + text_of(*bound.lower) + ", above the upper bound " + text_of(*bound.upper));
}

void check_meaning(Checker& checker, const DesignSpec& design) {
  for (const DesignIssue& found : optimizer_issues(design, checker.facts().scene()))
    checker.issue(found.path, found.message);
}

void check_meaning(Checker& checker, const ChannelSpec& channel) {
  const std::optional<double> sigma = checker.facts().value(channel.sigma);
  if (sigma && *sigma <= 0) checker.issue(checker.path("sigma"), "is " + text_of(*sigma) + ", it must be positive");
}

void check_meaning(Checker& checker, const ExperimentSpec& experiment) {
  if (experiment.channels.empty()) checker.issue(checker.path("channels"), "is empty; at least one column is compared");
  const SimulationSettings& simulation = checker.facts().scene().simulation;
  const double start = experiment.start_time.value_or(simulation.start_time);
  for (std::size_t i = 0; i < experiment.drives.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (experiment.drives[k].drive == experiment.drives[i].drive)
        checker.issue(child_path(checker.path("drives"), i) + ".drive",
                      "'" + experiment.drives[i].drive + "' has a law in this experiment already");
  if (experiment.end_time && *experiment.end_time <= start)
    checker.issue(checker.path("end_time"), "the experiment ends at " + text_of(*experiment.end_time) +
                                                " s, which must be after its start at " + text_of(start) + " s");
}

void check_meaning(Checker& checker, const IdentificationSpec& identification) {
  const std::vector<ExperimentSpec>& experiments = identification.experiments;
  const std::string list = checker.path("experiments");
  if (identification.multistart) {
    for (const DesignIssue& found : missing_bounds(identification.variables, checker.facts().scene(),
                                                   "identification.multistart draws starts between them"))
      checker.issue(found.path, found.message);
  }
  const bool any_fit =
      std::any_of(experiments.begin(), experiments.end(), [](const ExperimentSpec& e) { return !e.validate; });
  if (!any_fit) checker.issue(list, "has no experiment of role \"fit\"; at least one is needed");
  if (identification.loss.type == LossType::squared && identification.loss.scale)
    checker.issue(checker.path("loss") + ".scale", "is given with the loss 'squared', which has none");
  for (std::size_t i = 0; identification.sigma_is_known && i < experiments.size(); ++i)
    for (std::size_t k = 0; k < experiments[i].channels.size(); ++k)
      if (experiments[i].channels[k].estimate_sigma)
        checker.issue(child_path(child_path(list, i) + ".channels", k) + ".estimate_sigma",
                      "is true, and so is identification.sigma_is_known; one of them must be false");
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

std::vector<SceneIssue> find_issues(const Problem& problem) {
  SceneFacts facts(problem.scene);
  std::vector<std::string> objectives;
  for (const ObjectiveSpec& objective : problem.objectives) objectives.push_back(objective.name);
  facts.add_objectives(std::move(objectives));
  std::vector<SceneIssue> issues;
  Checker checker(facts, issues);
  checker.check(problem);
  check_meaning(checker, problem.scene);
  if (issues.empty())
    if (const std::optional<DesignIssue> found = curvature_issue(problem)) checker.issue(found->path, found->message);
  return without_repetitions(std::move(issues));
}

}  // namespace mbsopt
