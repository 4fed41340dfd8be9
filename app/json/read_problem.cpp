#include "app/json/read_problem.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "app/json/field_reader.hpp"
#include "app/json/findings.hpp"
#include "app/json/problem_source.hpp"
#include "app/json/source_text.hpp"
#include "app/json/term_resolver.hpp"
#include "core/scene/default_integrator.hpp"
#include "optim/objective/problem_issues.hpp"
#include "optim/problem/bounded_means.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/data_issues.hpp"
#include "optim/problem/logged_columns.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline app {

namespace {

// Gives the integrator the defaults that the file leaves out. A type in the file keeps its own tolerances
// (settings.hpp) and has no limit of the step. With simulation.accuracy all settings are chosen later.
void complete_integrator(SimulationSettings& settings, const Node& root) {
  if (settings.accuracy) return;
  const Node* const simulation = root.find("simulation");
  const Node* const integrator = simulation ? simulation->find("integrator") : nullptr;
  const auto has = [&](const char* key) { return integrator && integrator->find(key); };
  const IntegratorSettings chosen = default_integrator(settings.start_time, settings.end_time);
  IntegratorSettings& s = settings.integrator;
  if (!has("type")) s.type = chosen.type;
  if (s.type != chosen.type) return;
  if (!has("rtol")) s.rtol = chosen.rtol;
  if (!has("atol")) s.atol = chosen.atol;
  if (!has("type") && !has("step") && !has("max_step")) s.max_step = chosen.max_step;
}

void resolve_data_files(Problem& problem, ProblemSource& source) {
  if (!problem.identification) return;
  std::vector<ExperimentSpec>& experiments = problem.identification->experiments;
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    const std::string path = child_path("identification.experiments", i) + ".data";
    if (source.findings.concerns(path)) continue;
    for (std::string& data : experiments[i].data) {
      const std::filesystem::path file = source.beside(data);
      std::error_code error;
      const bool found = std::filesystem::exists(file, error) && !std::filesystem::is_directory(file, error);
      if (!found) source.add(path, "there is no file '" + file.string() + "'; a CSV file is expected");
      data = file.string();
    }
  }
}

// Reads each file once for all of its columns.
class SampleReader {
 public:
  SampleReader(ProblemSource& source, std::vector<std::string>& columns) : source_(source), columns_(columns) {}

  // key is that of the file. missing allows empty cells. by_row takes the number of the row in place of the time.
  void read(SampleColumn& samples, Interpolation how, const std::string& path, const char* key, bool missing = false,
            bool by_row = false) {
    if (source_.findings.concerns(path)) return;
    try {
      samples.file = source_.beside(samples.file).string();
      auto table = tables_.find(samples.file);
      if (table == tables_.end()) table = tables_.emplace(samples.file, read_csv(samples.file)).first;
      read_curve(samples, how, missing, by_row, table->second, columns_);
    } catch (const CsvError& error) {
      source_.add(path + key, error.what());
    }
  }

 private:
  ProblemSource& source_;
  std::vector<std::string>& columns_;  // those that were read
  std::map<std::string, CsvTable> tables_;
};

// Reads all samples, so that nothing below depends on files.
void read_samples(Problem& problem, ProblemSource& source) {
  SampleReader reader(source, problem.columns_read);
  Scene& scene = problem.scene;
  for (Signal& signal : scene.signals)
    reader.read(signal, signal.interpolation, child_path("signals", signal.name), ".file");
  const auto read_laws = [&](auto& drives, const std::string& list) {
    for (std::size_t i = 0; i < drives.size(); ++i)
      if (drives[i].samples)
        reader.read(*drives[i].samples, Interpolation::spline, child_path(list, i) + ".law", ".csv");
  };
  const auto read_variant = [&](auto& variant, const std::string& path) {
    read_laws(variant.drives, path + ".drives");
    for (SignalSamples& samples : variant.signals) {
      const auto signal = std::ranges::find(scene.signals, samples.name, &Signal::name);
      if (signal != scene.signals.end())
        reader.read(samples, signal->interpolation, child_path(path + ".signals", samples.name), ".file");
    }
  };
  read_laws(scene.drives, "drives");
  for (std::size_t c = 0; c < problem.cases.size(); ++c) read_variant(problem.cases[c], child_path("cases", c));
  for (ObjectiveSpec& objective : problem.objectives)
    for (std::size_t k = 0; k < objective.track.size(); ++k) {
      const std::string list = child_path("objectives", objective.name) + ".track";
      TrackTerm& term = objective.track[k];
      reader.read(term, Interpolation::linear, child_path(list, k), ".file", true, term.timing != Timing::prescribed);
    }
  if (!problem.identification) return;
  std::vector<ExperimentSpec>& experiments = problem.identification->experiments;
  for (std::size_t e = 0; e < experiments.size(); ++e)
    read_variant(experiments[e], child_path("identification.experiments", e));
}

// Adds an error to the findings, at its part of an expression if it names one. Adds a warning to the list, if any.
void report(const SceneIssue& issue, ProblemSource& source, std::vector<std::string>* warnings = nullptr) {
  const Node& node = nearest(source.root, issue.path);
  if (issue.is_warning) {
    if (warnings) warnings->push_back(to_string(source.finding(issue.path, issue.message)));
  } else if (issue.offset && node.kind == Node::Kind::string) {
    source.findings.add_inside(node, *issue.offset, issue.path, issue.message);
  } else {
    source.findings.add(node, issue.path, issue.message);
  }
}

// Reports data that an experiment cannot use, for every command, before anything runs.
void check_data(Problem& problem, ProblemSource& source, std::vector<std::string>* warnings) {
  if (!problem.identification) return;
  const std::vector<ExperimentSpec>& experiments = problem.identification->experiments;
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    const std::string place = child_path("identification.experiments", i);
    if (source.findings.concerns(place)) continue;
    try {
      const CsvTable table = read_record(experiments[i], &problem.columns_read);
      for (const SceneIssue& issue : find_data_issues(experiments[i], place, table, problem.scene))
        report(issue, source, warnings);
    } catch (const CsvError& error) {
      source.add(place + ".data", error.what());
    }
  }
}

// Reports errors of meaning at their place in the file. It omits an error that follows from one in the reading. It
// names the bounded means once they are known to be right.
void report_issues(Problem& problem, ProblemSource& source, std::vector<std::string>* warnings) {
  const Findings& findings = source.findings;
  std::vector<SceneIssue> issues = find_issues(problem);
  std::erase_if(issues, [&](const SceneIssue& issue) { return !issue.is_warning && findings.concerns(issue.path); });
  for (const SceneIssue& issue : issues) report(issue, source, warnings);
  check_data(problem, source, warnings);
  if (findings.any()) return;
  name_bounded_means(problem);
  for (const SceneIssue& issue : find_unused_parameters(problem)) report(issue, source);
  for (const SceneIssue& issue : find_idle_variables(problem))
    if (!findings.concerns(issue.path)) report(issue, source);
}

}  // namespace

Problem read_problem(ProblemSource& source, std::vector<std::string>* warnings, const ReadOptions& options) {
  Problem problem;
  read_fields({source.root, source.findings}, problem);
  complete_integrator(problem.scene.simulation, source.root);
  resolve_terms(problem, options, source);
  resolve_data_files(problem, source);
  read_samples(problem, source);
  report_issues(problem, source, warnings);
  source.findings.throw_if_any();
  allow_what_only_measurements_use(problem);
  return problem;
}

Problem read_problem_text(const std::string& text, const std::filesystem::path& name,
                          const std::vector<std::string>& set_overrides, std::vector<std::string>* warnings,
                          const ReadOptions& options) {
  ProblemSource source = problem_source_of(text, name, set_overrides);
  return read_problem(source, warnings, options);
}

Problem read_problem(const std::filesystem::path& file, const std::vector<std::string>& set_overrides,
                     std::vector<std::string>* warnings, const ReadOptions& options) {
  return read_problem_text(read_text_file(file), file, set_overrides, warnings, options);
}

}  // namespace mbsopt::inline app
