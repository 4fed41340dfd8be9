// Records of real hardware; they are not part of the project, and without them nothing is tested.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "optim/fit/identification.hpp"
#include "source_folder.hpp"
#include "tests/optim/repetitions.hpp"

using namespace mbsopt;

namespace {

const std::string kMeasured = MBSOPT_SOURCE_DIR "/../shared/data/measured/";

bool is_here(const std::string& file) {
  if (std::filesystem::exists(kMeasured + file)) return true;
  WARN("the record is not here, nothing was tested: " << kMeasured + file);
  return false;
}

// A run of the gate: two header lines, then time and voltage with a tab between; from its largest excursion on.
CsvTable gate_run(const std::string& name) {
  std::ifstream file(kMeasured + "swinging_gate_oscillator/" + name + ".txt");
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const std::size_t rows = text.find('\n', text.find('\n') + 1) + 1;
  CsvTable table = parse_csv("t\tx\n" + text.substr(rows), name);
  const std::vector<double>& x = table.columns[1];
  const auto largest =
      std::max_element(x.begin(), x.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  const auto skipped = largest - x.begin();
  for (std::vector<double>& column : table.columns) column.erase(column.begin(), column.begin() + skipped);
  table.lines.erase(table.lines.begin(), table.lines.begin() + skipped);
  const double start = table.columns[0].front();
  for (double& t : table.columns[0]) t -= start;
  return table;
}

// x'' + gamma x' + w2 x = 0 with a free start and offset per run: the slider of 2 kg with k = 2 w2, c = 2 gamma.
Problem gate_problem(const std::vector<std::string>& runs, const std::vector<CsvTable>& data) {
  Problem p = repetitions::slider(1, 0.3);
  testing::add_parameters(p.scene, {{"w2", 0.45}, {"gamma", 0.15}});
  Tsda& spring = std::get<Tsda>(p.scene.forces[0].kind);
  spring.stiffness = Expression::parse("2*w2"), spring.damping = Expression::parse("2*gamma");
  p.identification.emplace();
  p.identification->variables = {"w2"};
  for (std::size_t i = 0; i < runs.size(); ++i) {
    ExperimentSpec e = repetitions::slider_run(runs[i], {"gamma", "x0", "v0", "offset"});
    e.channels[0].bias = Expression::parse("offset");
    e.channels[0].estimate_sigma = SigmaEstimate::own;
    e.overrides = {{"x0", data[i].columns[1][0]}};
    p.identification->experiments.push_back(e);
  }
  return p;
}

struct GateRow {  // of the record's README
  std::string name;
  double period, gamma, rms;
};
const std::vector<GateRow> kGate{
    {"Q1", 9.000, 0.09415, 0.016}, {"Q2_20", 8.895, 0.16577, 0.0105}, {"Q3_10", 8.967, 0.19191, 0.0113}};

double period(double w2) { return 2 * M_PI / std::sqrt(w2); }

}  // namespace

TEST_CASE("the swinging gate, each run by itself: the figures of the record", "[identification][measured]") {
  if (!is_here("swinging_gate_oscillator/Q1.txt")) return;
  for (const GateRow& row : kGate) {
    const std::vector<CsvTable> data{gate_run(row.name)};
    const IdentificationResult result = run_identification(gate_problem({row.name}, data), data);
    INFO(row.name << ": " << result.message);
    REQUIRE(result.ok());
    CHECK(period(result.parameters[0].value) == Approx(row.period).margin(6e-4));
    CHECK(result.parameters[1].value == Approx(row.gamma).margin(6e-6));
    CHECK(result.experiments[0].rms == Approx(row.rms).margin(2e-4));
  }
}

TEST_CASE("the swinging gate: one stiffness for three runs, a damping for each", "[identification][measured]") {
  if (!is_here("swinging_gate_oscillator/Q1.txt")) return;
  std::vector<std::string> names;
  std::vector<CsvTable> data;
  for (const GateRow& row : kGate) names.push_back(row.name), data.push_back(gate_run(row.name));
  const IdentificationResult result = run_identification(gate_problem(names, data), data);
  INFO(result.message);
  REQUIRE(result.ok());
  const FittedParameter& w2 = result.parameters[0];
  const double common = period(w2.value), error = 0.5 * common * w2.std_error / w2.value;
  for (std::size_t i = 0; i < kGate.size(); ++i) {
    const FittedParameter& gamma = result.parameters[1 + 4 * i];
    CHECK(gamma.name == kGate[i].name + ".gamma");
    CHECK(std::abs(gamma.value - kGate[i].gamma) < 2 * gamma.std_error);
    // The period of the run by itself has a standard error, too.
    const IdentificationResult alone = run_identification(gate_problem({names[i]}, {data[i]}), {data[i]});
    const double alone_error = 0.5 * common * alone.parameters[0].std_error / alone.parameters[0].value;
    CHECK(std::abs(common - kGate[i].period) < 2 * alone_error);
    WARN(kGate[i].name << ": gamma " << gamma.value << " +- " << gamma.std_error << " (" << kGate[i].gamma
                       << "), period alone " << kGate[i].period << " +- " << alone_error << ", sigma "
                       << result.experiments[i].channels[0].sigma << " V, residuals "
                       << result.experiments[i].channels[0].analysis.in_words());
  }
  // The residuals are correlated; independent ones would make it half of this.
  CHECK(result.statistics.covariance_type == CovarianceType::newey_west);
  CHECK(error < 0.05);
  CHECK(result.statistics.unidentifiable.empty());
  WARN("common period " << common << " +- " << error << " s, " << result.evaluations << " evaluations");
}

TEST_CASE("the measured pendulum with drag and dry friction: better where it was not fitted",
          "[identification][measured]") {
  const std::string file = "multiarm_single_pendulum/single_pendulum_1kHz.csv";
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  if (!is_here(file)) return;
  const CsvTable data = read_csv(kMeasured + file);
  // Every tenth sample: the residuals are correlated over far longer than 10 ms.
  CsvTable thin = data;
  for (auto& column : thin.columns) column.clear();
  thin.lines.clear();
  for (std::size_t i = 0; i < data.rows(); i += 10) {
    for (std::size_t c = 0; c < data.columns.size(); ++c) thin.columns[c].push_back(data.columns[c][i]);
    thin.lines.push_back(data.lines[i]);
  }
  // theta'' = w2 sin(theta) - c w - d w |w| - f w/sqrt(w^2 + 0.1^2): viscous; or drag of the air and dry friction.
  const auto fitted = [&](bool viscous) {
    Problem p = pendulum::problem(64.05, viscous ? 0.05 : 0, 1.52, 1.85);
    testing::add_parameters(p.scene, {{"d", viscous ? 0 : 0.003}, {"f", viscous ? 0 : 0.1}});
    p.scene.simulation.integrator.rtol = 1e-7, p.scene.simulation.integrator.atol = 1e-9;
    std::get<Rsda>(p.scene.forces[0].kind).law =
        Expression::parse("J*(c*rate + d*rate*smooth_abs(rate, 0.001) + f*rate/sqrt(rate^2 + 0.1^2))");
    p.identification.emplace();
    p.identification->variables = {"w2"};
    for (const char* name : viscous ? std::vector<const char*>{"c"} : std::vector<const char*>{"d", "f"})
      p.identification->variables.push_back(name);
    ExperimentSpec fit = pendulum::experiment("fit", {"theta0", "omega0"});
    fit.time = "t_s", fit.channels[0].column = "theta_rad", fit.end_time = 36.667;
    ExperimentSpec check = fit;
    check.name = "validation", check.validate = true, check.start_time = 36.668, check.end_time.reset();
    check.overrides = {{"theta0", 3.5}, {"omega0", -2.5}};
    p.identification->experiments = {fit, check};
    return run_identification(p, {thin, thin});
  };
  const IdentificationResult viscous = fitted(true), dry = fitted(false);
  INFO(viscous.message << "; " << dry.message);
  REQUIRE(viscous.ok());
  REQUIRE(dry.ok());
  CHECK(viscous.experiments[0].rms == Approx(0.0095).margin(1e-4));
  CHECK(viscous.experiments[1].rms == Approx(0.0266).margin(1e-4));
  CHECK(dry.experiments[0].rms < 0.4 * viscous.experiments[0].rms);
  CHECK(dry.experiments[1].rms < 0.5 * viscous.experiments[1].rms);
  CHECK(dry.parameters[1].value > 20 * dry.parameters[1].std_error);
  CHECK(dry.parameters[2].value > 20 * dry.parameters[2].std_error);
  WARN("viscous: rms " << viscous.experiments[0].rms << ", validation " << viscous.experiments[1].rms
                       << "; drag and dry friction: " << dry.experiments[0].rms << ", validation "
                       << dry.experiments[1].rms << "; w2 " << dry.parameters[0].value << ", d "
                       << dry.parameters[1].value << " 1/rad, f " << dry.parameters[2].value << " rad/s^2");
}
