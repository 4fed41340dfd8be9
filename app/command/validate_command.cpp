// The reader of a problem checks all of it. This command then describes the mechanism and its oddities.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "app/results/channel_data.hpp"
#include "app/run/run.hpp"
#include "app/starts/identify_starts.hpp"
#include "app/terminal/interrupt.hpp"
#include "app/terminal/text_table.hpp"
#include "core/start/free_motion.hpp"
#include "optim/fit/windows.hpp"
#include "optim/problem/unused_parameters.hpp"

namespace mbsopt::inline app {
namespace {

void add_parameters(Run& run) {
  const std::vector<ParameterUse> uses = parameter_uses(run.problem);
  if (uses.empty()) return;
  TextTable table({"parameter", "value", "enters"});
  for (std::size_t k = 0; k < uses.size(); ++k) {
    const double value = run.problem.scene.parameters[k].value;
    run.result["parameters"][uses[k].parameter] = {{"value", value}, {"fields", uses[k].fields}};
    constexpr std::size_t kShown = 4;
    std::vector<std::string> shown = uses[k].fields;
    const std::size_t more = shown.size() > kShown ? shown.size() - kShown : 0;
    if (more > 0) shown.resize(kShown);
    table.add({uses[k].parameter, significant(value, 6),
               fmt::format("{}{}", fmt::join(shown, ", "), more > 0 ? fmt::format(" and {} more", more) : "")});
  }
  run.context.out << '\n' << table.text();
}

void add_motions(Run& run, const Mechanism& mechanism, const Assembly& assembly) {
  const int freedoms = run.result.at("model").at("degrees_of_freedom").get<int>();
  const std::vector<std::string> motions =
      free_motions(mechanism, assembly, run.problem.scene.simulation.start_time, freedoms);
  run.result["model"]["free"] = motions;
  for (const std::string& motion : motions) run.context.out << fmt::format("free: {}\n", motion);
}

}  // namespace

int validate_command(const CommandContext& context) {
  Run run(context);
  Scene scene = run.problem.scene;
  for (Condition& condition : scene.conditions) condition.acceleration.reset();  // `kinematics` alone takes them
  const Mechanism mechanism(scene, parameter_values(scene));
  const Assembly assembly(mechanism, run.problem.scene.simulation.start_time);
  run.start();
  const bool closed = assembled(run, mechanism, assembly);
  if (closed && run.problem.scene.simulation.accuracy)
    context.out
        << "simulation.accuracy chooses the integrator when it is run; with an implicit one the model is spatial\n";
  if (closed) add_motions(run, mechanism, assembly);
  if (closed) add_parameters(run);
  if (run.problem.identification) {
    Problem problem = run.problem;
    problem.scene.simulation.accuracy.reset();  // the default integrator guesses the starts
    const CutProblem cut = cut_into_windows(problem, data_of(problem), [](double) { return !interrupted(); });
    run.warn(cut.warnings);
    add_windows(run, cut.problem);
    const std::vector<ChannelData> channels = channel_data(cut.problem, cut.data);
    context.out << '\n' << channel_table(channels);
    run.result["preflight"]["channels"] = to_json(channels);
    if (interrupted()) run.stopped("the starts of some windows were not guessed");
  }
  return run.finish();
}

}  // namespace mbsopt::inline app
