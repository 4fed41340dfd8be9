#include "app/json/read_problem.hpp"

#include <algorithm>
#include <cmath>

#include "app/json/field_reader.hpp"
#include "app/json/findings.hpp"
#include "app/json/problem_source.hpp"
#include "app/json/source_text.hpp"
#include "core/scene/default_integrator.hpp"
#include "optim/objective/problem_issues.hpp"
#include "optim/problem/bounded_means.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/data_issues.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt {

namespace {

// simulation.accuracy chooses all of it, later.
void complete_integrator(SimulationSettings& settings, const Node& root) {
  if (settings.accuracy) return;
  const Node* const simulation = root.find("simulation");
  const Node* const integrator = simulation ? simulation->find("integrator") : nullptr;
  const auto has = [&](const char* key) { return integrator && integrator->find(key); };
  choose_what_is_left_out(settings, {.type = has("type"),
                                     .rtol = has("rtol"),
                                     .atol = has("atol"),
                                     .step = has("step"),
                                     .max_step = has("max_step")});
}

void resolve_data_files(Problem& problem, const std::filesystem::path& folder, const Node& root, Findings& findings) {
  if (!problem.identification) return;
  std::vector<ExperimentSpec>& experiments = problem.identification->experiments;
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    std::string& data = experiments[i].data;
    const std::string path = child_path("identification.experiments", i) + ".data";
    if (findings.concerns(path)) continue;
    const std::filesystem::path file = (folder / data).lexically_normal();
    std::error_code error;
    const bool found = std::filesystem::exists(file, error) && !std::filesystem::is_directory(file, error);
    if (!found)
      findings.add(nearest(root, path), path, "there is no file '" + file.string() + "'; a CSV file is expected");
    data = file.string();
  }
}

void read_samples(SampledLaw& law, const std::string& path, const std::filesystem::path& folder, const Node& root,
                  Findings& findings) {
  if (findings.concerns(path)) return;
  try {
    law.csv = (folder / law.csv).lexically_normal().string();
    const CsvTable table = read_csv(law.csv);
    law.times = ascending_times(table, law.time);
    law.values = table.column(law.column);
    const auto bad = std::find_if(law.values.begin(), law.values.end(), [](double x) { return !std::isfinite(x); });
    if (bad != law.values.end())
      throw CsvError(table.name + ":" +
                     std::to_string(table.lines[static_cast<std::size_t>(bad - law.values.begin())]) + ": column '" +
                     law.column + "' has no number here; a law needs all of them");
    if (law.times.size() < 2) throw CsvError(table.name + ": a law needs two rows or more");
  } catch (const CsvError& error) {
    findings.add(nearest(root, path + ".csv"), path + ".csv", error.what());
  }
}

// Laws from CSV files: the samples are read here, so that nothing below knows of files.
void read_sampled_laws(Problem& problem, const std::filesystem::path& folder, const Node& root, Findings& findings) {
  std::vector<Drive>& drives = problem.scene.drives;
  for (std::size_t i = 0; i < drives.size(); ++i)
    if (drives[i].samples) read_samples(*drives[i].samples, child_path("drives", i) + ".law", folder, root, findings);
  const auto read_all = [&](std::vector<DriveLaw>& laws, const std::string& owner) {
    for (std::size_t i = 0; i < laws.size(); ++i)
      if (laws[i].samples)
        read_samples(*laws[i].samples, child_path(owner + ".drives", i) + ".law", folder, root, findings);
  };
  for (std::size_t c = 0; c < problem.cases.size(); ++c) read_all(problem.cases[c].drives, child_path("cases", c));
  if (!problem.identification) return;
  std::vector<ExperimentSpec>& experiments = problem.identification->experiments;
  for (std::size_t e = 0; e < experiments.size(); ++e)
    read_all(experiments[e].drives, child_path("identification.experiments", e));
}

// Data that an experiment cannot use are found now, before anything runs, whatever the command.
void check_data(const Problem& problem, const Node& root, Findings& findings, std::vector<std::string>* warnings) {
  if (!problem.identification) return;
  const std::vector<ExperimentSpec>& experiments = problem.identification->experiments;
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    const std::string place = child_path("identification.experiments", i);
    if (findings.concerns(place)) continue;
    try {
      const CsvTable table = read_csv(experiments[i].data);
      for (const SceneIssue& issue : find_data_issues(experiments[i], place, table, problem.scene)) {
        const Node& node = nearest(root, issue.path);
        if (!issue.is_warning)
          findings.add(node, issue.path, issue.message);
        else if (warnings)
          warnings->push_back(to_string(findings.finding(node, issue.path, issue.message)));
      }
    } catch (const CsvError& error) {
      findings.add(nearest(root, place + ".data"), place + ".data", error.what());
    }
  }
}

void add_issue(const SceneIssue& issue, const Node& root, Findings& findings) {
  const Node& node = nearest(root, issue.path);
  if (issue.offset && node.kind == Node::Kind::string)
    findings.add_inside(node, *issue.offset, issue.path, issue.message);
  else
    findings.add(node, issue.path, issue.message);
}

// Errors of meaning, at the place in the file that says it. An error that follows from one in the reading
// is left out. Names the means that are bounded, once they are known to be right.
void add_issues(Problem& problem, const Node& root, Findings& findings, std::vector<std::string>* warnings) {
  std::vector<SceneIssue> errors;
  for (SceneIssue& issue : find_issues(problem)) {
    if (issue.is_warning) {
      if (warnings)
        warnings->push_back(to_string(findings.finding(nearest(root, issue.path), issue.path, issue.message)));
    } else if (!findings.concerns(issue.path)) {
      errors.push_back(std::move(issue));
    }
  }
  for (const SceneIssue& issue : errors) add_issue(issue, root, findings);
  check_data(problem, root, findings, warnings);
  if (findings.any()) return;
  name_bounded_means(problem);
  for (const SceneIssue& issue : find_unused_parameters(problem)) add_issue(issue, root, findings);
  for (const SceneIssue& issue : find_idle_variables(problem))
    if (!findings.concerns(issue.path)) add_issue(issue, root, findings);
}

}  // namespace

Problem read_problem(ProblemSource& source, std::vector<std::string>* warnings) {
  Findings& findings = source.findings;
  const Node& root = source.root;
  const std::filesystem::path folder = source.file.parent_path();
  Problem problem;
  FieldReader::read(root, "", findings, problem);
  complete_integrator(problem.scene.simulation, root);
  resolve_data_files(problem, folder, root, findings);
  read_sampled_laws(problem, folder, root, findings);
  add_issues(problem, root, findings, warnings);
  findings.throw_if_any();
  allow_what_only_measurements_use(problem);
  return problem;
}

Problem read_problem_text(const std::string& text, const std::filesystem::path& name,
                          const std::vector<std::string>& set_overrides, std::vector<std::string>* warnings) {
  ProblemSource source = problem_source_of(text, name, set_overrides);
  return read_problem(source, warnings);
}

Problem read_problem(const std::filesystem::path& file, const std::vector<std::string>& set_overrides,
                     std::vector<std::string>* warnings) {
  return read_problem_text(read_text_file(file), file, set_overrides, warnings);
}

}  // namespace mbsopt
