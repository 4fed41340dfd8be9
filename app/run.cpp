#include "app/run.hpp"

#include <fmt/format.h>

#include "app/atomic_file.hpp"
#include "app/exit_code.hpp"
#include "app/json/read_problem.hpp"
#include "app/provenance.hpp"

namespace mbsopt {
namespace {

std::vector<std::string> data_files(const Problem& problem) {
  std::vector<std::string> files;
  if (!problem.identification) return files;
  for (const ExperimentSpec& experiment : problem.identification->experiments) files.push_back(experiment.data);
  return files;
}

const char* plural(long count) { return count == 1 ? "" : "s"; }

}  // namespace

Run::Run(const CommandContext& given)
    : context(given),
      problem(read_problem(given.options.problem_file, given.options.sets, &reader_warnings_)),
      folder(given.options.out, problem.scene.name, given.options.problem_file),
      progress(given.err, given.err_is_terminal, given.options.quiet) {
  result["program"] = "mbsopt";
  result["version"] = program_version();
  result["command"] = context.command;
  result["problem"] = problem.scene.name;
  result["provenance"] =
      provenance(context.arguments, folder.owner(), context.options.problem_file, data_files(problem));
  result["warnings"] = Json::array();
  for (const std::string& warning : reader_warnings_) warn(warning);
}

Run::~Run() {
  if (!running_) return;
  try {
    finish("failed", kNumericalFailure);
  } catch (const OutputError&) {
    return;  // "running" stays; the exception under way says more than this one
  }
}

void Run::start() {
  running_ = true;
  result["status"] = "running";
  folder.write("result.json", result_json_text(result));
}

void Run::write(const std::string& file, std::string_view content) {
  folder.write(file, content);
  written_.push_back(file);
}

void Run::warn(const std::string& warning) {
  progress.finish();
  context.err << "warning: " << warning << '\n';
  result["warnings"].push_back(warning);
}

int Run::done() { return finish("ok", kDone); }

int Run::failed(const std::string& message, double last_good_time) {
  result["message"] = message;
  result["last_good_time"] = last_good_time;
  progress.finish();
  context.err << fmt::format("{} failed: {}\n", context.command, message);
  return finish("failed", kNumericalFailure);
}

int Run::disagreed() { return finish("disagrees", kCheckFailed); }

int Run::stopped() {
  progress.finish();
  context.err << "interrupted; what was found so far is kept\n";
  return finish("interrupted", kInterrupted);
}

int Run::finish(const char* status, int exit_code) {
  running_ = false;
  progress.finish();
  result["status"] = status;
  write("result.json", result_json_text(result));
  context.out << fmt::format("\n{}: {}\n", (folder.path() / "").string(), fmt::join(written_, " "));
  return exit_code;
}

Eigen::VectorXd parameter_values(const Scene& scene) {
  Eigen::VectorXd rho(static_cast<Eigen::Index>(scene.parameters.size()));
  for (Eigen::Index k = 0; k < rho.size(); ++k) rho(k) = scene.parameters[static_cast<std::size_t>(k)].value;
  return rho;
}

void print_model(std::ostream& out, const std::string& name, const ModelSummary& summary) {
  out << fmt::format("{}: {} bod{}, {} equation{} of rank {}, {} degree{} of freedom\n", name, summary.bodies,
                     summary.bodies == 1 ? "y" : "ies", summary.equations, plural(summary.equations), summary.rank,
                     summary.degrees_of_freedom, plural(summary.degrees_of_freedom));
  if (!summary.redundant.empty()) out << fmt::format("redundant: {}\n", fmt::join(summary.redundant, ", "));
}

void print_simulation(std::ostream& out, const SimulationSettings& settings, const SimulationStatistics& statistics) {
  out << fmt::format("{:g} s to {:g} s with {}: {} step{}, {} rejected, {} right-hand sides, {:.3g} s\n",
                     settings.start_time, settings.end_time, settings.integrator.type, statistics.steps,
                     plural(statistics.steps), statistics.rejected, statistics.rhs_evaluations,
                     statistics.wall_seconds);
  out << fmt::format(
      "largest violation of the constraints {:.1e} (positions), {:.1e} (velocities); largest change of energy {:.1e} "
      "J\n",
      statistics.max_position_violation, statistics.max_velocity_violation, statistics.energy_drift);
  if (statistics.max_acceleration_residual > 1e-6) {
    out << fmt::format(
        "the constraints' accelerations were met to {:.1e} only: a singular position, or masses that differ too much "
        "for "
        "simulation.formulation (try a larger alpha or more iterations)\n",
        statistics.max_acceleration_residual);
  }
}

}  // namespace mbsopt
