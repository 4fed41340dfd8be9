// A double pendulum in two windows of its motion, with a bound that is active at the optimum.
#include <catch2/catch.hpp>
#include <random>

#include "optim/fit/experiment.hpp"
#include "optim/fit/identification.hpp"
#include "optim/problem/parameter_values.hpp"
#include "tests/optim/fit/windowed_pendulum.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

struct Start {
  double q1, q2, w1, w2;
};
constexpr Start kStarts[] = {{0.3, 0.8, 0.5, -1.0}, {-0.6, -0.4, 2.0, 0.5}};
constexpr double kAngleNoise = 0.005;

// Unknown: centre of mass c2 of the lower bar and damping d of both joints, shared; a start per window.
Problem two_windows() {
  Problem p;
  p.scene = damped_double_pendulum();
  p.scene.simulation.integrator.rtol = 1e-7;
  p.identification.emplace();
  p.identification->variables = {"c2", "d"};
  for (std::size_t w = 0; w < 2; ++w) {
    ExperimentSpec e;
    e.name = "window" + std::to_string(w), e.free = {"q1", "q2", "o1", "o2"};
    for (const char* angle : {"theta1", "theta2"}) {
      ChannelSpec channel;
      channel.column = channel.sensor = angle, channel.sigma = kAngleNoise;
      e.channels.push_back(channel);
    }
    const Start& s = kStarts[w];
    e.overrides = {{"q1", s.q1}, {"q2", s.q2}, {"o1", s.w1}, {"o2", s.w2}};
    p.identification->experiments.push_back(e);
  }
  return p;
}

// The motion from the starts of the problem, with noise.
std::vector<CsvTable> motions(const Problem& p) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0, kAngleNoise);
  std::vector<CsvTable> data;
  for (const ExperimentSpec& e : p.identification->experiments) {
    CsvTable table;
    table.name = e.name, table.header = {"t", "theta1", "theta2"}, table.columns.resize(3);
    for (std::size_t i = 0; i <= 100; ++i) {
      table.columns[0].push_back(0.01 * static_cast<double>(i)), table.lines.push_back(i + 2);
      table.columns[1].push_back(0), table.columns[2].push_back(0);
    }
    const Experiment run(p.scene, e, "here", table, parameter_values(p.scene), {});
    const Experiment::Residuals r = run.residuals(Eigen::VectorXd());
    REQUIRE(r.ok);
    for (std::size_t i = 0; i < run.samples().size(); ++i) {
      const Experiment::Sample& sample = run.samples()[i];
      table.columns[1 + sample.channel][sample.time] =
          -kAngleNoise * r.z(static_cast<Eigen::Index>(i)) + normal(generator);
    }
    data.push_back(std::move(table));
  }
  return data;
}

}  // namespace

TEST_CASE("two windows of a double pendulum: twenty starts find the optimum on an active bound",
          "[identification][bounds]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Problem truth = two_windows();
  const std::vector<CsvTable> data = motions(truth);
  const IdentificationResult free = run_identification(truth, data);
  REQUIRE(free.ok());
  CHECK(std::abs(free.parameters[1].value - 0.05) < 4 * free.parameters[1].std_error);

  Problem held = truth;  // the optimum on the bound, without a bound
  parameter(held, "d").value = 0.08;
  held.identification->variables = {"c2"};
  const IdentificationResult best = run_identification(held, data);
  REQUIRE(best.ok());

  std::mt19937 generator(11);
  std::uniform_real_distribution<double> uniform;
  int found = 0;
  long most = 0, most_free = 0;
  for (int start = 0; start < 20; ++start) {
    Problem p = truth;
    Parameter &c2 = parameter(p, "c2"), &d = parameter(p, "d");
    c2.lower = 0.3, c2.upper = 0.9, d.lower = 0.08, d.upper = 1.0;
    c2.value = 0.3 + 0.6 * uniform(generator), d.value = 0.08 + 0.92 * uniform(generator);
    for (ExperimentSpec& e : p.identification->experiments)
      for (auto& [name, value] : e.overrides) value += (name[0] == 'q' ? 0.02 : 0.4) * (2 * uniform(generator) - 1);
    const IdentificationResult result = run_identification(p, data);
    INFO("start " << start << ": " << result.message << ", cost " << result.cost_final << " against " << best.cost_final
                  << ", " << result.evaluations << " evaluations");
    CHECK(result.status == SolverStatus::converged);
    CHECK(result.parameters[1].at_lower);
    const bool same = result.cost_final < best.cost_final * (1 + 1e-6);
    CHECK(same);
    found += same, most = std::max(most, result.evaluations);
    parameter(p, "d").lower.reset();
    most_free = std::max(most_free, run_identification(p, data).evaluations);
  }
  WARN(found << " of 20 starts, at most " << most << " evaluations; without the bound " << most_free);
  CHECK(found == 20);
  CHECK(most <= 2 * most_free + 1);
}
