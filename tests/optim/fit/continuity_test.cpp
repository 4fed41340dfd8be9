// Windows that continue each other: multiple shooting.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/simulate/simulation.hpp"
#include "optim/fit/experiment_stack.hpp"
#include "optim/fit/identification.hpp"
#include "optim/fit/windows.hpp"
#include "optim/objective/expression_cost.hpp"
#include "tests/optim/fit/windowed_pendulum.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Both arms turn over. Errors of the start grow by three orders of magnitude in 8 s.
Problem tumbling() {
  Problem p = windowed(0.5);
  p.identification->experiments[0].windows->continuity = true;
  parameter(p, "q1").value = 2.2, parameter(p, "q2").value = 1.1, parameter(p, "d").value = 0.02;
  parameter(p, "o1").value = 2;
  p.identification->covariance = CovarianceType::white;
  return p;
}

constexpr double kDuration = 8;

Problem started_wrongly(Problem p) {
  parameter(p, "c2").value = 0.75, parameter(p, "d").value = 0.15;
  return p;
}

Problem in_one(Problem p) {
  p.identification->experiments[0].windows.reset();
  return p;
}

struct Tied {
  explicit Tied(const Problem& problem, const CsvTable& data)
      : cut(cut_into_windows(problem, {data})),
        unknowns(unknowns_of_fit(cut.problem.scene, spec())),
        stack(members(), unknowns, {}) {}
  const IdentificationSpec& spec() const { return *cut.problem.identification; }
  Experiment window(std::size_t e) const {
    const Scene& scene = cut.problem.scene;
    return Experiment(scene, spec().experiments[e], "here", cut.data[e], parameter_values(scene),
                      unknowns_in(scene, spec(), e, unknowns));
  }
  std::vector<ExperimentStack::Member> members() const {
    std::vector<ExperimentStack::Member> all;
    for (std::size_t e = 0; e < spec().experiments.size(); ++e)
      all.push_back({e, window(e), spec().experiments[e].origin->continues});
    return all;
  }
  LeastSquaresPoint at(const VectorXd& x) {
    LeastSquaresPoint point = stack.at(x);
    REQUIRE(point.ok);
    return point;
  }

  CutProblem cut;
  std::vector<UnknownParameter> unknowns;
  ExperimentStack stack;
};

}  // namespace

TEST_CASE("continuity: the equations and their derivatives, against differences", "[identification][continuity]") {
  Problem p = tumbling();
  p.scene.simulation.integrator.step = 0.005;
  Tied tied(p, motion(in_one(p), 0, 1.5));
  CHECK(tied.stack.equalities == 2 * 4);  // three windows
  VectorXd x = tied.stack.start();
  CHECK(tied.at(x).z.tail(8).norm() < 0.2);  // starts are guessed from the motion
  x(0) *= 1.1, x(3) += 0.1;
  const MatrixXd C = tied.at(x).z_x.bottomRows(8);
  for (Index k = 0; k < x.size(); ++k) {
    const double h = 1e-5;
    VectorXd more = x, less = x;
    more(k) += h, less(k) -= h;
    const VectorXd difference = (tied.at(more).z - tied.at(less).z).tail(8) / (2 * h);
    CHECK((C.col(k) - difference).norm() < 1e-7 * (1 + difference.norm()));
  }
}

TEST_CASE("continuity: the end of a window changes as the adjoint says", "[identification][continuity]") {
  const Problem p = tumbling();
  const Tied tied(p, motion(in_one(p), 0, 1));
  const Scene& truth = tied.cut.problem.scene;
  const VectorXd rho = parameter_values(truth);
  // The first window from the true start, and the second one from where it ends: there the coordinates of its chart are
  // the angles and their rates.
  std::vector<ExperimentSpec> windows = tied.spec().experiments;
  windows[0].overrides.clear();
  Experiment first(truth, windows[0], "here", tied.cut.data[0], rho, unknowns_in(truth, tied.spec(), 0, tied.unknowns));
  const Scene scene = first.simulated();
  REQUIRE(scene.simulation.end_time == 0.5);
  const Mechanism mechanism(scene, rho);
  std::vector<Cost> costs(2);
  for (std::size_t c = 0; c < 2; ++c)
    costs[c].terminal = CostExpression(Expression::parse(c == 0 ? "theta1" : "theta2"), scene).bind(mechanism);
  std::vector<Eigen::Vector2d> angles;
  SimulationSettings longer = scene.simulation;
  const double h = 1e-4;
  longer.end_time += h;
  const Sampling around{{0.5 - h, 0.5, 0.5 + h}, [&](std::size_t, const StatePoint& at) {
                          angles.push_back({costs[0].terminal->value(at), costs[1].terminal->value(at)});
                        }};
  REQUIRE(simulate(mechanism, longer, {}, around).ok());
  const Eigen::Vector2d end = angles[1], rate = (angles[2] - angles[0]) / (2 * h);
  windows[1].overrides = {{"q1", end(0) + M_PI / 2}, {"q2", end(1)}, {"o1", rate(0)}, {"o2", rate(1)}};
  const std::vector<Experiment::Unknown> unknowns = unknowns_in(truth, tied.spec(), 1, tied.unknowns);
  Experiment second(truth, windows[1], "here", tied.cut.data[1], rho, unknowns);
  const StateChart chart = second.chart_of_start({unknowns.end() - 4, unknowns.end()});
  first.read_end(chart), second.read_start(chart);

  VectorXd u = start_of(tied.unknowns);
  for (const Experiment::Unknown& unknown : first.unknowns()) u(unknown.at) = rho(unknown.parameter);
  for (const Experiment::Unknown& unknown : unknowns)
    for (const auto& [name, value] : windows[1].overrides)
      if (truth.parameters[static_cast<std::size_t>(unknown.parameter)].name == name) u(unknown.at) = value;
  const Experiment::Residuals r = first.residuals(u);
  REQUIRE(r.ok);
  const Experiment::Residuals later = second.residuals(u);
  REQUIRE(later.ok);
  CHECK((r.end - later.start).norm() < 1e-5);  // the differences of the rates
  const SimulationResult adjoint = simulate_adjoint(mechanism, scene.simulation, costs);
  REQUIRE(adjoint.ok());
  for (const Experiment::Unknown& unknown : first.unknowns())
    for (Index angle = 0; angle < 2; ++angle)
      CHECK(r.end_u(angle, unknown.at) - later.start_u(angle, unknown.at) ==
            Approx(adjoint.psi_rho(angle, unknown.parameter)).margin(1e-5));
}

TEST_CASE("continuity finds the truth of a tumbling motion, where one long simulation does not",
          "[identification][continuity]") {
  const Problem truth = tumbling(), start = started_wrongly(truth);
  const std::vector<CsvTable> data{motion(in_one(truth), kWindowNoise, kDuration)};
  const IdentificationResult tied = run_identification(start, data);
  INFO(tied.message << ", " << tied.evaluations << " evaluations");
  REQUIRE(tied.status == SolverStatus::converged);
  CHECK(tied.evaluations <= 25);
  CHECK(std::abs(tied.parameters[0].value - 0.6) < 4 * tied.parameters[0].std_error);
  CHECK(std::abs(tied.parameters[1].value - 0.02) < 4 * tied.parameters[1].std_error);
  // All windows are one motion: that of the first start, with as many free numbers.
  CHECK(tied.statistics.degrees_of_freedom == 2 * 801 - 6);
  for (const ExperimentFit& e : tied.experiments) CHECK(e.rms == Approx(kWindowNoise).epsilon(0.25));

  const IdentificationResult alone = run_identification(in_one(start), data);
  CHECK(alone.cost_final > 100 * tied.cost_final);
  // From the truth it finds the same minimum.
  const IdentificationResult same = run_identification(in_one(truth), data);
  REQUIRE(same.ok());
  CHECK(tied.cost_final == Approx(same.cost_final).epsilon(1e-6));
  for (std::size_t k = 0; k < 6; ++k) {
    INFO(tied.parameters[k].name);
    CHECK(std::abs(tied.parameters[k].value - same.parameters[k].value) < 1e-2 * same.parameters[k].std_error);
    CHECK(tied.parameters[k].std_error == Approx(same.parameters[k].std_error).epsilon(1e-3));
  }
  // What the ties add to the data.
  Problem untied = start;
  untied.identification->experiments[0].windows->continuity = false;
  const IdentificationResult free = run_identification(untied, data);
  CHECK(tied.parameters[0].std_error < 0.5 * free.parameters[0].std_error);
}

TEST_CASE("continuity with estimated sigmas", "[identification][continuity]") {
  const Problem truth = tumbling();
  Problem start = started_wrongly(truth);
  const std::vector<CsvTable> data{motion(in_one(truth), kWindowNoise, 4)};
  for (ChannelSpec& channel : start.identification->experiments[0].channels)
    channel.sigma = 0.1, channel.estimate_sigma = SigmaEstimate::shared;
  const IdentificationResult result = run_identification(start, data);
  INFO(result.message << ", " << result.evaluations << " evaluations");
  REQUIRE(result.status == SolverStatus::converged);
  CHECK(result.evaluations <= 30);
  CHECK(std::abs(result.parameters[0].value - 0.6) < 4 * result.parameters[0].std_error);
  CHECK(result.experiments[0].channels[0].sigma == Approx(kWindowNoise).epsilon(0.15));
}

TEST_CASE("continuity needs starts that are free in all coordinates and rates", "[identification][continuity]") {
  Problem p = tumbling();
  const CsvTable data = motion(in_one(p), 0, 1);
  p.identification->experiments[0].free = {"q1", "q2", "o1"};
  CHECK_THROWS_WITH(cut_into_windows(p, {data}),
                    Contains("identification.experiments[0].windows.continuity") && Contains("4 numbers"));
}
