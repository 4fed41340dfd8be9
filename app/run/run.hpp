// One run of a command on one problem: the common part of all commands. It reads the problem, claims the output folder,
// gathers result.json, and ends with an exit code.
//
//   Run run(context);                               // throws on bad input
//   run.start();                                    // from here on there is a result.json
//   run.result["simulation"] = to_json(statistics);
//   if (!simulation.ok()) run.failed(simulation.message, simulation.last_good_time);   // the report shows it, too
//   run.write("report.html", report(run.result));
//   return run.finish();                            // prints how it ended, and where the results are
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/files/result_json.hpp"
#include "app/json/read_problem.hpp"
#include "app/run/command.hpp"
#include "app/run/output_folder.hpp"
#include "app/terminal/progress.hpp"
#include "core/start/assembly.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline app {

class Run {
 public:
  explicit Run(const CommandContext& context);
  ~Run();  // a run that an exception ends has failed, and its result.json says so

 private:
  std::vector<std::string> reader_warnings_;  // filled while the problem is read, hence before it
  Problem problem_;

 public:
  const CommandContext& context;
  const Problem& problem = problem_;
  const OutputFolder folder;
  Json result;  // the parts of result.json; "status" is how the run ends
  Progress progress;

  void start();  // claims the folder: locks it, and writes result.json with "status": "running"
  void write(const std::string& file, std::string_view content);  // into the folder; named in the closing line
  // Simulations call this after each step. It shows their progress, and returns false once the run is interrupted. It
  // keeps its last argument in *last.
  std::function<bool(double t)> watched(std::string doing, double* last = nullptr);
  void warn(const std::string& words);  // "simulation.accuracy: ...": with the path's place in the file before them
  void warn(const std::vector<std::string>& all);
  // Replaces the settings of the file (accuracy_results.hpp).
  void simulate_with(const SimulationSettings& settings) { problem_.scene.simulation = settings; }

  void start_from(const std::vector<Parameter>& parameters) { problem_.scene.parameters = parameters; }
  void take_poses(const std::vector<Body>& bodies) { problem_.scene.bodies = bodies; }

  // These set the end of the run, unless it succeeded. failed gives exit code 1. last_good_time is that of the motion
  // if the simulation failed.
  void failed(const std::string& message, std::optional<double> last_good_time = {});
  void disagrees();                       // exit 3
  void stopped(const std::string& kept);  // exit 130; kept: a sentence, what the folder holds
  // Stopped if the user interrupted the run, else failed.
  void broke_off(const std::string& kept, const std::string& message, std::optional<double> last_good_time = {});

  int finish();  // the exit code

 private:
  std::unique_ptr<FolderLock> lock_;
  std::vector<std::string> written_;
  bool running_ = false;  // result.json says so
};

ReadOptions read_options(const CommandContext& context);

// The files at one place of a problem file: data, plug-ins.
struct NamedFiles {
  std::string path;  // "identification.experiments[0].data"
  std::vector<std::string> files;
  bool is_list = false;  // at this place stands an array
};
std::vector<NamedFiles> named_files(const Problem& problem);
// The same files, and the program itself if it provides terms.
std::vector<std::string> data_files(const Problem& problem, const NamedTerms& terms);

// Adds the model at its assembled start to the result and to standard output, with warnings of oddities. Returns false
// if the assembly failed, which then is the outcome of the run. integrated: a model of motion is integrated, so that
// bodies also need mass where no joint holds them.
bool assembled(Run& run, const Mechanism& mechanism, const Assembly& assembly, bool integrated = true);

// Prints the counts of bodies, equations, degrees of freedom; redundant equations by joint.
void print_model(std::ostream& out, const std::string& name, const ModelSummary& summary);
void print_simulation(std::ostream& out, const Scene& scene, const SimulationStatistics& statistics);

// Returns whether only gravity and springs with constant coefficients act, so that the total energy is constant.
bool conserves_energy(const Scene& scene);
// These words follow a change of energy that is not conserved.
inline constexpr const char* kWorkIsDone = "with the work of dampers, actuators and laws, no measure of the error";

// Says which bodies do not affect the answer and are not simulated. judged_by: "objective", "measurement"
void say_left_out(Run& run, const std::vector<std::string>& bodies, const char* judged_by);
// Adds counts of runs with derivatives to result.simulation, which must exist: blocks evaluated
// (core/mechanism/coupling.hpp), and numbers of the model that parameters change.
void add_derivative_counts(Run& run, const Scene& simulated, const SimulationStatistics& statistics);

}  // namespace mbsopt::inline app
