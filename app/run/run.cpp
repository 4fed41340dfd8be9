#include "app/run/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "app/json/problem_source.hpp"
#include "app/run/provenance.hpp"
#include "app/terminal/exit_code.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/expression/counted.hpp"
#include "core/integrate/model_choice.hpp"
#include "core/mechanism/coupling.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/scene_path.hpp"
#include "core/start/model_warnings.hpp"
#include "core/step/step_failure.hpp"

namespace mbsopt::inline app {
namespace {

int exit_code_of(const Json& status) {
  return status == "failed"        ? kNumericalFailure
         : status == "disagrees"   ? kCheckFailed
         : status == "interrupted" ? kInterrupted
                                   : kDone;
}

Problem problem_of(const CommandContext& context, std::vector<std::string>& warnings) {
  const std::shared_ptr<ProblemSource> source = read_problem_source(context.options.problem_file, context.options.sets);
  context.source = source;
  return read_problem(*source, &warnings, read_options(context));
}

}  // namespace

ReadOptions read_options(const CommandContext& context) { return {context.terms, context.options.allow_plugins}; }

std::vector<NamedFiles> named_files(const Problem& problem) {
  std::vector<NamedFiles> all;
  const auto add_law = [&](const std::string& drive, const std::optional<SampledLaw>& law) {
    if (law) all.push_back({drive + ".law.csv", {law->file}});
  };
  const auto add_laws = [&](const std::string& owner, const std::vector<DriveLaw>& laws) {
    for (std::size_t k = 0; k < laws.size(); ++k) add_law(child_path(owner + ".drives", k), laws[k].samples);
  };
  const auto add_signals = [&](const std::string& path, const auto& signals) {
    for (const auto& signal : signals) all.push_back({child_path(path, signal.name) + ".file", {signal.file}});
  };
  if (!problem.plugins.empty()) all.push_back({"plugins", problem.plugins, true});
  add_signals("signals", problem.scene.signals);
  for (std::size_t i = 0; i < problem.scene.drives.size(); ++i)
    add_law(child_path("drives", i), problem.scene.drives[i].samples);
  for (const ObjectiveSpec& objective : problem.objectives)
    for (std::size_t k = 0; k < objective.track.size(); ++k)
      all.push_back(
          {child_path(child_path("objectives", objective.name) + ".track", k) + ".file", {objective.track[k].file}});
  for (std::size_t c = 0; c < problem.cases.size(); ++c) {
    add_laws(child_path("cases", c), problem.cases[c].drives);
    add_signals(child_path("cases", c) + ".signals", problem.cases[c].signals);
  }
  for (std::size_t i = 0; problem.identification && i < problem.identification->experiments.size(); ++i) {
    const ExperimentSpec& experiment = problem.identification->experiments[i];
    const std::string place = child_path("identification.experiments", i);
    all.push_back({place + ".data", experiment.data, experiment.data.size() != 1});
    add_signals(place + ".signals", experiment.signals);
    add_laws(place, experiment.drives);
  }
  return all;
}

std::vector<std::string> data_files(const Problem& problem, const NamedTerms& terms) {
  std::vector<std::string> files;
  if (!terms.empty()) files.push_back(std::filesystem::canonical("/proc/self/exe").string());
  for (const NamedFiles& named : named_files(problem))
    files.insert(files.end(), named.files.begin(), named.files.end());
  return files;
}

Run::Run(const CommandContext& given)
    : problem_(problem_of(given, reader_warnings_)),
      context(given),
      folder(given.options.out, problem.scene.name, given.options.problem_file,
             given.options.preflight ? "preflight" : given.command),  // it replaces no fit
      progress(given.err, given.err_is_terminal, given.options.quiet) {
  result["program"] = "mbsopt";
  result["version"] = program_version();
  result["command"] = context.command;
  result["problem"] = problem.scene.name;
  std::vector<std::string> files = data_files(problem, context.terms);
  if (!context.options.sweep.points.empty()) files.push_back(context.options.sweep.points);
  result["provenance"] = provenance(context.arguments, folder.owner(), context.options.problem_file, files);
  result["warnings"] = Json::array();
  warn(reader_warnings_);
  if (problem.columns_read.empty()) return;
  result["columns"] = Json::array();
  for (const std::string& words : problem.columns_read) {
    if (std::ranges::find(result["columns"], Json(words)) != result["columns"].end()) continue;  // read once again
    result["columns"].push_back(words);
    if (!context.options.quiet) context.err << words << '\n';
  }
}

Run::~Run() {
  if (!running_) return;
  try {
    progress.finish();
    result["status"] = "failed";
    const std::string text = result_json_text(result);
    if (context.json) *context.json << text;
    write("result.json", text);
  } catch (...) {
    folder.mark_failed();  // the exception under way says more than this one
  }
}

void Run::start() {
  lock_ = folder.claim();
  result["status"] = "running";
  folder.write("result.json", result_json_text(result));
  running_ = true;
}

void Run::write(const std::string& file, std::string_view content) {
  if (lock_ && !std::filesystem::exists(folder.path())) {
    warn(fmt::format("the folder {} was deleted during the run; it is made anew", folder.path().string()));
    lock_ = folder.claim();
  }
  folder.write(file, content);
  written_.push_back(file);
}

std::function<bool(double t)> Run::watched(std::string doing, double* last) {
  const double start = problem_.scene.simulation.start_time, end = problem_.scene.simulation.end_time;
  return [this, doing = std::move(doing), start, end, last](double t) {
    if (last) *last = t;
    progress.fraction(doing, (t - start) / (end - start));
    return !interrupted();
  };
}

void Run::warn(const std::string& words) {
  const std::string warning = context.source->placed(words).value_or(words);
  progress.finish();
  context.err << "warning: " << warning << '\n';
  result["warnings"].push_back(warning);
}

void Run::warn(const std::vector<std::string>& all) {
  for (const std::string& words : all) warn(words);
}

void Run::failed(const std::string& message, std::optional<double> last_good_time) {
  result["status"] = "failed";
  result["message"] = message;
  if (last_good_time) result["last_good_time"] = *last_good_time;
}

void Run::disagrees() { result["status"] = "disagrees"; }

void Run::stopped(const std::string& kept) {
  result["status"] = "interrupted";
  result["message"] = "interrupted; " + kept;
}

void Run::broke_off(const std::string& kept, const std::string& message, std::optional<double> last_good_time) {
  interrupted() ? stopped(kept) : failed(message, last_good_time);
}

int Run::finish() {
  progress.finish();
  Json& status = result["status"];
  if (status == "running") status = "ok";
  const std::string message = result.value("message", "");
  if (status == "interrupted") context.err << message << '\n';
  if (status == "failed" && !message.empty()) context.err << fmt::format("{} failed: {}\n", context.command, message);
  const std::string text = result_json_text(result);
  write("result.json", text);
  if (context.json) *context.json << text;
  running_ = false;
  context.out << fmt::format("\n{}: {}\n", (folder.path() / "").string(), fmt::join(written_, " "));
  return exit_code_of(result["status"]);
}

bool assembled(Run& run, const Mechanism& mechanism, const Assembly& assembly, bool integrated) {
  const Scene& scene = run.problem.scene;
  bool ok = assembly.result().ok;
  if (ok) {
    ModelSummary model = assembly.summary();
    if (integrated) add_model(mechanism, scene.simulation, model);
    run.result["model"] = to_json(model);
    print_model(run.context.out, scene.name, model);
  } else {
    run.failed(assembly.result().message, scene.simulation.start_time);
  }
  run.warn(model_warnings(mechanism, assembly));
  if (integrated && !massless_bodies(mechanism, assembly).empty()) {
    const double start = scene.simulation.start_time;
    run.failed(start_failure(mechanism.data(), start), start);
    ok = false;
  }
  return ok;
}

void print_model(std::ostream& out, const std::string& name, const ModelSummary& summary) {
  out << fmt::format("{}: {}{}, {} of rank {}, {}\n", name, counted(summary.bodies, "body", "bodies"),
                     summary.unknowns_per_body == 3 ? " in a plane" : "", counted(summary.equations, "equation"),
                     summary.rank, counted(summary.degrees_of_freedom, "degree of freedom", "degrees of freedom"));
  if (!summary.redundant.empty()) out << fmt::format("redundant: {}\n", fmt::join(summary.redundant, ", "));
}

void print_simulation(std::ostream& out, const Scene& scene, const SimulationStatistics& statistics) {
  const SimulationSettings& settings = scene.simulation;
  if (statistics.solved) {
    out << fmt::format(
        "{:g} s to {:g} s, the drives leave nothing free: solved, not integrated: {}, {} halved, {:.3g} s\n",
        settings.start_time, settings.end_time, counted(statistics.steps, "interval"), statistics.rejected,
        statistics.wall_seconds);
    out << fmt::format("largest violation of the constraints {:.1e} (positions), {:.1e} (velocities)\n",
                       statistics.max_position_violation, statistics.max_velocity_violation);
    return;
  }
  out << fmt::format(
      "{:g} s to {:g} s with {}: {}, {} rejected, {}{}, {:.3g} s\n", settings.start_time, settings.end_time,
      settings.integrator.type, counted(statistics.steps, "step"), statistics.rejected,
      counted(statistics.rhs_evaluations, "right-hand side"),
      statistics.newton_iterations > 0 ? ", " + counted(statistics.newton_iterations, "Newton iteration") : "",
      statistics.wall_seconds);
  out << fmt::format(
      "largest violation of the constraints {:.1e} (positions), {:.1e} (velocities); largest change of energy {:.1e} "
      "J{}\n",
      statistics.max_position_violation, statistics.max_velocity_violation, statistics.energy_drift,
      conserves_energy(scene) ? "" : fmt::format(" ({})", kWorkIsDone));
  if (statistics.recomputed_steps > 0) {
    out << fmt::format("the adjoint kept {:.3g} MiB of the motion and computed {} again\n",
                       static_cast<double>(statistics.adjoint_memory_bytes) / (1024 * 1024),
                       counted(statistics.recomputed_steps, "step"));
  }
}

bool conserves_energy(const Scene& scene) {
  const std::vector<bool> none(scene.parameters.size(), false);
  return conserves_energy(Mechanism(scene, parameter_values(scene), none).data());
}

void say_left_out(Run& run, const std::vector<std::string>& bodies, const char* judged_by) {
  if (bodies.empty()) return;
  run.result["model"]["left_out"] = bodies;
  run.context.out << fmt::format("not simulated, since no {} depends on them: {}\n", judged_by,
                                 fmt::join(bodies, ", "));
}

void add_derivative_counts(Run& run, const Scene& simulated, const SimulationStatistics& statistics) {
  const Mechanism mechanism(simulated, parameter_values(simulated));
  Json& json = run.result["simulation"];
  json["derivative_blocks"] = statistics.linearised_states * derivative_blocks(mechanism.data());
  json["differentiated_numbers"] = mechanism.data().slots();
}

}  // namespace mbsopt::inline app
