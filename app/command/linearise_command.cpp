// Linearises the motion at one state: modes for the terminal, with shapes and responses in the report.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "app/report/run_page.hpp"
#include "app/results/objective_units.hpp"
#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/expression/counted.hpp"
#include "core/expression/did_you_mean.hpp"
#include "core/start/linearisation.hpp"

namespace mbsopt::inline app {
namespace {

constexpr double kWrongDigits = 1e-6;  // of an eigenvalue: larger errors are reported

// The indices of names in a list, or all indices if there are no names.
template <class Named>
std::vector<int> places(const char* option, const char* kind, const std::vector<std::string>& names,
                        const std::vector<Named>& list) {
  const std::vector<std::string> known = names_of(list);
  std::vector<int> out;
  for (const std::string& name : names) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end())
      throw std::invalid_argument(fmt::format("{}: there is no {} '{}'{}; known: {}", option, kind, name,
                                              did_you_mean(name, known), joined(known)));
    out.push_back(static_cast<int>(found - known.begin()));
  }
  return out;
}

struct State {
  double t;
  Eigen::VectorXd y, angles;
};

// The state of the simulation at the time. If the simulation fails, so does the run, and there is no state.
std::optional<State> state_at(Run& run, const Mechanism& mechanism, double time) {
  SimulationSettings settings = run.problem.scene.simulation;
  if (!(time > settings.start_time))
    throw std::invalid_argument(fmt::format("--at {}: must be after start_time, {} s", time, settings.start_time));
  settings.end_time = time;
  State state{};
  RunOptions options;
  options.progress = run.watched("simulating");
  const SimulationResult simulation = simulate(mechanism, settings, {},
                                               {{time},
                                                [&](std::size_t, const StatePoint& at) {
                                                  state = {at.t, at.y, at.angles};
                                                }},
                                               options);
  run.progress.finish();
  if (simulation.ok()) return state;
  run.broke_off("nothing was linearised", simulation.message, simulation.last_good_time);
  return {};
}

std::vector<std::string> names_of(const std::vector<int>& places, const auto& list) {
  std::vector<std::string> names;
  for (const int k : places) names.push_back(list[static_cast<std::size_t>(k)].name);
  return names;
}

// The body that moves most in a mode, and how: "block along z", "block about x" (global axes).
std::string moves_most(const Scene& scene, const Linearisation& x, const State& state, Eigen::Index mode) {
  const StateLayout layout{static_cast<int>(scene.bodies.size())};
  std::string words;
  double largest = 0;
  const auto offer = [&](const Eigen::Vector3cd& moves, const std::string& body, const char* how) {
    Eigen::Index axis = 0;
    moves.cwiseAbs().maxCoeff(&axis);
    if (moves.norm() > largest) {
      largest = moves.norm();
      words = body + how + "xyz"[axis];
    }
  };
  int k = 0;
  for (const Body& body : scene.bodies) {
    ++k;
    const Eigen::Vector4d p = state.y.segment<4>(layout.p(k));
    offer(x.modes.col(mode).segment<3>(layout.q(k)), body.name, " along ");
    offer(2 * x.length * (A(p) * (G(p) * x.modes.col(mode).segment<4>(layout.p(k)))), body.name, " about ");
  }
  return words;
}

Json modes_of(const Scene& scene, const Linearisation& x, const State& state) {
  Json modes = Json::array();
  for (Eigen::Index k = 0; k < x.eigenvalues.size(); ++k) {
    const std::complex<double> e = x.eigenvalues(k);
    if (e.imag() < 0) continue;
    modes.push_back({{"eigenvalue", {e.real(), e.imag()}},
                     {"frequency", frequency(e)},
                     {"damping_ratio", damping_ratio(e)},
                     {"error", x.errors(k)},
                     {"moves_most", moves_most(scene, x, state, k)}});
  }
  return modes;
}

Json to_json(const Scene& scene, const Linearisation& x, const State& state, const std::vector<int>& inputs,
             const std::vector<int>& outputs) {
  Json eigenvalues = Json::array(), frequencies = Json::array(), damping_ratios = Json::array();
  for (const std::complex<double>& e : x.eigenvalues) {
    eigenvalues.push_back({e.real(), e.imag()});
    frequencies.push_back(frequency(e));
    damping_ratios.push_back(damping_ratio(e));
  }
  return {{"time", state.t},
          {"degrees_of_freedom", x.A.rows() / 2},
          {"eigenvalues", eigenvalues},
          {"frequencies", frequencies},
          {"damping_ratios", damping_ratios},
          {"modes", modes_of(scene, x, state)},
          {"inputs", names_of(inputs, scene.parameters)},
          {"outputs", names_of(outputs, scene.sensors)},
          {"A", rows_of(x.A)},
          {"B", rows_of(x.B)},
          {"C", rows_of(x.C)},
          {"D", rows_of(x.D)},
          {"basis", rows_of(x.basis)}};
}

void show_modes(RunPage& page, const Json& modes) {
  page.heading("Modes");
  if (modes.empty()) return;
  double slowest = INFINITY, fastest = 0, growth = -INFINITY, damping = INFINITY;
  TextTable table({"mode", "eigenvalue [1/s]", "frequency [Hz]", "damping ratio", "moves most"});
  for (const Json& m : modes) {
    const double re = m["eigenvalue"][0], im = m["eigenvalue"][1], f = m["frequency"];
    const std::string value =
        im == 0 ? significant(re, 6) : fmt::format("{} +- {} i", significant(re, 6), significant(im, 6));
    table.add({std::to_string(table.rows().size() + 1), value, number_cell(f, 6), number_cell(m["damping_ratio"], 4),
               cell(m["moves_most"])});
    slowest = std::min(slowest, f);
    fastest = std::max(fastest, f);
    growth = std::max(growth, re);
    damping = std::min(damping, m["damping_ratio"].get<double>());
  }
  page.verdict(
      fmt::format("{} from {:.4g} Hz to {:.4g} Hz; the least damping ratio is {:.3g} and the largest real part "
                  "of an eigenvalue {:.3g} 1/s.",
                  counted(modes.size(), "mode"), slowest, fastest, damping, growth));
  page.both(table);
}

void warn_of(Run& run, const Linearisation& x, const State& state) {
  if (!is_equilibrium(x))
    run.warn(
        fmt::format("the state at t = {:.6g} s is no equilibrium, bodies {} there: the eigenvalues are those of the "
                    "motion frozen at this instant. initial.equilibrium starts from an equilibrium",
                    state.t, x.largest_rate > 0 ? "move" : "accelerate"));
  for (Eigen::Index k = 0; k < x.eigenvalues.size(); ++k) {
    const double size = std::abs(x.eigenvalues(k));
    if (x.eigenvalues(k).imag() < 0 || x.errors(k) <= kWrongDigits * size || size <= x.errors(k)) continue;
    run.warn(fmt::format("the eigenvalue of size {:.6g} 1/s may be off by {:.2g} 1/s: stiffer modes round it", size,
                         x.errors(k)));
  }
}

// The state displaced along a mode. The largest displacement is a sixth of the mechanism's size.
std::vector<double> displaced_row(const Mechanism& mechanism, const State& state, const Linearisation& x,
                                  Eigen::Index mode) {
  const StateLayout layout{mechanism.bodies()};
  Eigen::VectorXcd q = x.modes.col(mode).head(layout.positions());
  Eigen::Index at = 0;
  q.cwiseAbs().maxCoeff(&at);
  q *= std::conj(q(at)) / std::abs(q(at));  // real where it is largest
  double largest = 0;
  for (int k = 1; k <= layout.n; ++k) {
    largest = std::max({largest, q.segment<3>(layout.q(k)).norm(), 2 * x.length * q.segment<4>(layout.p(k)).norm()});
  }
  Eigen::VectorXd y = state.y;
  y.head(layout.positions()) += (x.length / 6 / largest) * q.real();
  for (int k = 1; k <= layout.n; ++k) y.segment<4>(layout.p(k)).normalize();
  return body_columns(mechanism, {state.t, y, state.angles});
}

void add_shapes(RunPage& page, const Mechanism& mechanism, const State& state, const Linearisation& x) {
  constexpr std::size_t kDrawn = 12;  // modes that a reader still tells apart
  const Scene& scene = page.run.problem.scene;
  const std::vector<double> rest = body_columns(mechanism, {state.t, state.y, state.angles});
  std::size_t modes = 0;
  for (Eigen::Index k = 0; k < x.eigenvalues.size(); ++k) {
    if (x.eigenvalues(k).imag() < 0 || ++modes > kDrawn) continue;
    const std::vector<double> shape = displaced_row(mechanism, state, x, k);
    const std::string title = fmt::format("Mode {}, {} Hz", modes, significant(frequency(x.eigenvalues(k)), 4));
    const std::array<int, 2> plane = plane_of_motion(scene, {{}, {rest, shape}}).axes;
    page.drawing(mechanism_drawing(title, plane, {{"state", scene, rest}, {"displaced", scene, shape}}));
  }
  if (modes > kDrawn) page.paragraph(fmt::format("The first {} of {} modes are drawn.", kDrawn, modes));
}

// "rad/N", "m/(N/m)"
std::string per(const std::string& output, const std::string& input) {
  if (input.empty()) return output;
  const bool one = input.find_first_of(" /*") == std::string::npos;
  return output + (one ? "/" + input : "/(" + input + ")");
}

// The amplitude of each output for an input of amplitude 1, from a tenth of the slowest to ten times the fastest mode.
void add_responses(RunPage& page, const Linearisation& x, const std::vector<int>& inputs,
                   const std::vector<int>& outputs) {
  constexpr int kFrequencies = 400;
  constexpr std::size_t kDrawn = 12;
  const Scene& scene = page.run.problem.scene;
  if (inputs.empty() || outputs.empty()) return;
  double slowest = INFINITY, fastest = 0;
  for (const std::complex<double>& e : x.eigenvalues)
    if (const double f = frequency(e); f > 0) slowest = std::min(slowest, f), fastest = std::max(fastest, f);
  page.heading("From inputs to outputs");
  page.paragraph(
      "Static: the change of the output by a constant input of 1. Below: the amplitude of the output when the input "
      "swings with amplitude 1.");
  const Eigen::MatrixXcd still = transfer(x, 0);
  std::vector<double> frequencies;
  std::vector<Eigen::MatrixXcd> swinging;
  for (int k = 0; k <= kFrequencies && fastest > 0; ++k) {
    frequencies.push_back(0.1 * slowest * std::pow(100 * fastest / slowest, static_cast<double>(k) / kFrequencies));
    swinging.push_back(transfer(x, {0, 2 * std::numbers::pi * frequencies.back()}));
  }
  std::vector<TableRow> rows;
  std::vector<LinePlot> plots;
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    const Parameter& input = scene.parameters[static_cast<std::size_t>(inputs[j])];
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      const Sensor& output = scene.sensors[static_cast<std::size_t>(outputs[i])];
      const std::string unit = per(unit_in(scene, output), input.unit);
      const double gain = still(row, column).real();
      rows.push_back({input.name, output.name, std::isfinite(gain) ? number_cell(gain, 6) : TableCell("-"), unit});
      std::vector<double> amplitudes;
      for (const Eigen::MatrixXcd& G : swinging) amplitudes.push_back(std::abs(G(row, column)));
      if (rows.size() <= kDrawn && std::ranges::any_of(amplitudes, [](double y) { return y > 0; }))
        plots.push_back({.title = fmt::format("{} by {}", output.name, input.name),
                         .x_label = "frequency [Hz]",
                         .y_label = fmt::format("amplitude [{}]", unit),
                         .series = {{output.name, frequencies, amplitudes}},
                         .logarithmic_y = true,
                         .logarithmic_x = true});
    }
  }
  page.table({"input", "output", "static", "unit"}, rows);
  for (const LinePlot& plot : plots) page.plot(plot);
  if (rows.size() > kDrawn) page.note(fmt::format("The first {} of {} responses are drawn.", kDrawn, rows.size()));
}

}  // namespace

int linearise_command(const CommandContext& context) {
  Run run(context);
  const Scene& scene = run.problem.scene;
  const std::vector<int> inputs = places("--inputs", "parameter", context.options.inputs, scene.parameters);
  std::vector<int> outputs = places("--outputs", "sensor", context.options.outputs, scene.sensors);
  if (context.options.outputs.empty()) {
    for (std::size_t k = 0; k < scene.sensors.size(); ++k) outputs.push_back(static_cast<int>(k));
  }
  run.start();
  std::vector<bool> active(scene.parameters.size(), false);
  for (const int k : inputs) active[static_cast<std::size_t>(k)] = true;
  const Mechanism mechanism(scene, parameter_values(scene), active);
  const Assembly assembly(mechanism, scene.simulation.start_time);
  if (!assembled(run, mechanism, assembly)) return run.finish();
  if (assembly.summary().degrees_of_freedom == 0) {
    run.failed("joints and drives leave nothing free: there is no motion to linearise. `kinematics` solves this one");
    return run.finish();
  }
  std::optional<State> state = State{scene.simulation.start_time, assembly.result().y, assembly.result().angles};
  if (context.options.at && *context.options.at != state->t) state = state_at(run, mechanism, *context.options.at);
  if (!state) return run.finish();

  const Linearisation x =
      linearise(mechanism, scene.simulation.formulation, {state->t, state->y, state->angles}, inputs, outputs);
  run.result["linearisation"] = to_json(scene, x, *state, inputs, outputs);
  context.out << fmt::format("linearised at t = {:.6g} s on {} free coordinate{}\n", state->t, x.A.rows() / 2,
                             x.A.rows() == 2 ? "" : "s");
  RunPage page(run);
  show_modes(page, run.result["linearisation"]["modes"]);
  warn_of(run, x, *state);
  add_shapes(page, mechanism, *state, x);
  add_responses(page, x, inputs, outputs);
  page.write();
  return run.finish();
}

}  // namespace mbsopt::inline app
