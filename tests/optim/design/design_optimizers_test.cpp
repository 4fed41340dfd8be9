// Designs by every optimiser that a problem file can name.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <map>

#include "optim/design/design.hpp"
#include "optim/design/design_program.hpp"
#include "optim/objective/design_issues.hpp"
#include "optim/objective/hessian.hpp"
#include "optim/problem/start_points.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

// Springs' free lengths between bounds; default tolerances of the simulation.
Problem still(double rtol = 1e-8) {
  Problem problem = five_bar::problem(rtol);
  problem.design.emplace();
  problem.design->minimize = "motion";
  problem.design->variables = {"L01", "L02"};
  for (std::size_t k = 0; k < 2; ++k) problem.scene.parameters[k].lower = 1.9, problem.scene.parameters[k].upper = 2.3;
  problem.scene.parameters[1].lower = 1.7;
  return problem;
}

// The start of a Latin hypercube over [1, 3] m, seed 7, as `multistart` has it for 21 starts.
Problem from_start(std::size_t start, const std::string& hessian) {
  Problem problem = still();
  problem.scene.simulation.integrator.type = "dopri853";
  for (std::size_t k = 0; k < 2; ++k) problem.scene.parameters[k].lower = 1, problem.scene.parameters[k].upper = 3;
  MultistartSpec spec;
  spec.starts = 21;
  const Eigen::VectorXd lengths =
      start_values({problem.scene.parameters[0], problem.scene.parameters[1]}, spec, 7)[start];
  for (std::size_t k = 0; k < 2; ++k) problem.scene.parameters[k].value = lengths(static_cast<Eigen::Index>(k));
  problem.design->optimizer.type = "ipopt";
  problem.design->optimizer.hessian = hessian;
  return problem;
}

// Start 0's, by which all are judged.
DesignResult run_from_start(std::size_t start, const std::string& hessian) {
  DesignOptions options;
  options.scale = design_scale(from_start(0, hessian));
  return run_design(from_start(start, hessian), options);
}

void add_total_length(Problem& problem, std::optional<double> lower, std::optional<double> upper) {
  ObjectiveSpec total;
  total.name = "total_length";
  total.parameters_only = Expression::parse("L01 + L02");
  problem.objectives.push_back(total);
  problem.design->subject_to = {{"total_length", lower, upper}};
}

}  // namespace

TEST_CASE("a limit that no number can be measured by ends a design in words, at its start", "[design]") {
  Problem problem = still();
  add_total_length(problem, {}, 1e-320);
  problem.design->optimizer.type = GENERATE("ipopt", "slsqp");
  const DesignResult result = run_design(problem);
  CHECK(result.status == SolverStatus::failed);
  CHECK_THAT(result.message, Contains("the start point cannot be evaluated"));
  CHECK(result.objective_final == result.objective_initial);
  CHECK(result.variables[0].value == result.variables[0].initial);
}

TEST_CASE("five-bar: every local optimiser holds the mechanism still", "[design_optimizers]") {
#ifdef __SANITIZE_ADDRESS__  // twenty times slower
  const std::string type = GENERATE("slsqp", "bobyqa");
#else
  const std::string type = GENERATE("ipopt", "slsqp", "mma", "ccsaq", "lbfgs", "bobyqa", "cobyla", "sbplx");
#endif
  INFO(type);
  Problem problem = still();
  problem.design->optimizer.type = type;
  const DesignResult result = run_design(problem);
  INFO(result.message << " " << result.evaluations << " evaluations");
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.optimizer == type);
  const double margin = type == "cobyla" ? 1e-5 : 2e-6;
  CHECK(result.variables[0].value == Approx(five_bar::kL01).margin(margin));
  CHECK(result.variables[1].value == Approx(five_bar::kL02).margin(margin));
  CHECK(result.optimality < 1e-4);  // also of methods that know no derivatives
}

TEST_CASE("five-bar: nothing is simulated twice", "[design_optimizers]") {
  const std::string type = GENERATE("ipopt", "slsqp", "mma", "lbfgs");
  INFO(type);
  Problem problem = still();
  problem.design->optimizer.type = type;
  const DesignResult result = run_design(problem);
  // One adjoint per point; one more near the start, for the scale.
  CHECK(result.simulations == result.evaluations + 1);
  problem.design->optimizer.type = "bobyqa";
  const DesignResult by_values = run_design(problem);
  CHECK(by_values.simulations <= by_values.evaluations + 2);  // and the gradient at the solution
}

TEST_CASE("five-bar: a bound on another objective is held by every optimiser that takes one", "[design_optimizers]") {
  Problem problem = still();
  add_total_length(problem, 4.1, {});  // the free optimum has 4.065
  std::map<std::string, double> psi;
#ifdef __SANITIZE_ADDRESS__  // twenty times slower
  const std::vector<std::string> types{"ipopt", "slsqp"};
#else
  const std::vector<std::string> types{"ipopt", "slsqp", "mma", "ccsaq", "cobyla", "lbfgs", "bobyqa", "sbplx"};
#endif
  for (const std::string& type : types) {
    INFO(type);
    problem.design->optimizer.type = type;
    const DesignResult result = run_design(problem);
    INFO(result.message);
    CHECK(result.ok());
    CHECK(result.violation <= kConstraintTolerance);
    CHECK(result.constraints[0].value == Approx(4.1).margin(1e-4));
    psi[type] = result.objective_final;
  }
  for (const auto& [type, value] : psi) {
    INFO(type);
    CHECK(value == Approx(psi.at("ipopt")).epsilon(1e-3));
  }
}

TEST_CASE("five-bar: an equality is met by those that take one, and refused with the alternatives by others",
          "[design_optimizers]") {
  Problem problem = still();
  add_total_length(problem, 4.1, 4.1);
#ifdef __SANITIZE_ADDRESS__
  const std::vector<std::string> types{"ipopt", "slsqp"};
#else
  const std::vector<std::string> types{"ipopt", "slsqp", "cobyla", "lbfgs"};
#endif
  for (const std::string& type : types) {
    INFO(type);
    problem.design->optimizer.type = type;
    const DesignResult result = run_design(problem);
    INFO(result.message);
    CHECK(result.constraints[0].value == Approx(4.1).margin(1e-6));
  }
  for (const std::string type : {"mma", "ccsaq"}) {
    problem.design->optimizer.type = type;
    CHECK_THROWS_WITH(run_design(problem), Contains("design.optimizer.type: '" + type) && Contains("slsqp"));
  }
}

TEST_CASE("five-bar: a global method finds the valley without a hint", "[design_optimizers]") {
  Problem problem = still(1e-6);
#ifdef __SANITIZE_ADDRESS__
  problem.design->optimizer.type = "mlsl";
#else
  problem.design->optimizer.type = GENERATE("direct", "crs", "mlsl");
#endif
  problem.design->optimizer.max_evaluations = 400;
  if (problem.design->optimizer.type != "direct") problem.design->optimizer.seed = 4;
  const DesignResult result = run_design(problem);
  INFO(result.optimizer << ": " << result.message);
  CHECK(result.ok());
  CHECK(result.objective_final < 1e-5);
  CHECK(result.seed.has_value() == (result.optimizer != "direct"));
}

TEST_CASE("five-bar: interrupted within a simulation, a design counts and lists what was done, not what was refused",
          "[design_optimizers]") {
  Problem problem = still(1e-6);
  problem.design->optimizer.type = GENERATE("ipopt", "slsqp");
  INFO(problem.design->optimizer.type);
  long calls = 0, allowed = std::numeric_limits<long>::max();
  DesignOptions options;
  options.compare_differences = false;  // the search itself is stopped, not what precedes it
  options.simulation_progress = [&](double) { return ++calls <= allowed; };
  const DesignResult whole = run_design(problem, options);
  REQUIRE(whole.status == SolverStatus::converged);
  allowed = 6 * calls / 10, calls = 0;
  const DesignResult part = run_design(problem, options);
  CHECK(part.status == SolverStatus::stopped);
  CHECK(part.evaluations < whole.evaluations);
  CHECK(part.failed_evaluations == 0);
  REQUIRE(!part.history.empty());
  REQUIRE(part.history.size() < whole.history.size());
  for (std::size_t i = 0; i < part.history.size(); ++i)
    CHECK(part.history[i].parameters == whole.history[i].parameters);
}

TEST_CASE("what an optimiser cannot do is said where it is asked for", "[design_optimizers]") {
  Problem problem = still();
  const auto issue = [&] {
    const std::vector<SceneIssue> issues = optimizer_issues(*problem.design, problem.scene);
    return issues.empty() ? std::string() : issues[0].path + ": " + issues[0].message;
  };
  CHECK(issue().empty());
  problem.design->optimizer.type = "direct";
  problem.scene.parameters[1].upper.reset();
  CHECK_THAT(issue(), Contains("parameters.L02: has no upper bound"));
  problem.design->optimizer.type = "slsqp";
  CHECK(issue().empty());
  problem.design->optimizer.seed = 1;
  CHECK_THAT(issue(), Contains("design.optimizer.seed: ") && Contains("draws no random numbers"));
  problem.design->optimizer.seed.reset();
  problem.design->optimizer.hessian = "exact";
  CHECK_THAT(issue(), Contains("design.optimizer.hessian: is for ipopt only"));
  problem.design->optimizer.hessian = "lbfgs", problem.design->optimizer.lbfgs_history = 5;
  CHECK_THAT(issue(), Contains("design.optimizer.lbfgs_history: is given, but 'slsqp' keeps no pairs"));
  problem.design->optimizer.lbfgs_history.reset(), problem.design->optimizer.warm_start = true;
  CHECK_THAT(issue(), Contains("design.optimizer.warm_start: is for ipopt only") && Contains("slsqp"));
  problem.design->optimizer = {};
  problem.design->multistart.emplace();
  CHECK_THAT(issue(), Contains("parameters.L02: has no upper bound") && Contains("design.multistart"));
  problem.design->multistart.reset();
  problem.design->optimizer.type = "bobyqa";
  problem.design->variables = {"L01"};
  CHECK_THAT(issue(), Contains("design.optimizer.type: 'bobyqa' needs two variables"));
  add_total_length(problem, 4.1, {});
  problem.design->optimizer.type = "esch";
  CHECK_THAT(issue(), Contains("'esch' takes no constraints") && Contains("isres"));
}

TEST_CASE("Hessians of a design are those of its scaled program", "[design_optimizers]") {
  Problem problem = still(1e-10);
  problem.scene.parameters[0].scale = ParameterScale::log;
  ObjectiveSpec product;
  product.name = "product";
  product.parameters_only = Expression::parse("L01^2*L02");
  problem.objectives.push_back(product);
  problem.design->subject_to = {{"product", {}, 10.0}};
  problem.design->optimizer.type = "ipopt";
  DesignProgram program(problem);
  const Eigen::VectorXd x = program.x_start();
  std::vector<Eigen::MatrixXd> H;
  REQUIRE(program.hessians(x, H));
  REQUIRE(H.size() == 2);
  CHECK(program.hessian_gradients() > 0);
  // Against central differences of the program's own gradient, on free steps.
  const auto derivatives = [&](const Eigen::VectorXd& at) {
    NlpPoint p;
    p.f_x.setZero(2), p.c.setZero(1), p.c_x.setZero(1, 2);
    program.evaluate(at, p);
    return p;
  };
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Eigen::VectorXd h = 1e-3 * Eigen::VectorXd::Unit(2, k);
    const NlpPoint plus = derivatives(x + h), minus = derivatives(x - h);
    CHECK((H[0].col(k) - (plus.f_x - minus.f_x) / 2e-3).norm() < 1e-4 * H[0].norm());
    CHECK((H[1].col(k) - (plus.c_x - minus.c_x).transpose() / 2e-3).norm() < 1e-4 * H[1].norm());
  }
}

TEST_CASE("five-bar: exact Hessians halve the iterations, from near and far", "[design_optimizers]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  int by_bfgs = 0, exact = 0;
  for (const std::size_t start : {0u, 4u, 7u, 10u, 11u, 13u, 14u, 16u}) {  // at 4 and 11 the Hessian is indefinite
    INFO("start " << start);
    const DesignResult a = run_from_start(start, "lbfgs"), b = run_from_start(start, "exact");
    for (const DesignResult& result : {a, b}) {
      CHECK(result.status == SolverStatus::converged);
      CHECK(result.variables[0].value == Approx(five_bar::kL01).margin(1e-6));
      CHECK(result.variables[1].value == Approx(five_bar::kL02).margin(1e-6));
    }
    by_bfgs += a.iterations, exact += b.iterations;
  }
  INFO(by_bfgs << " iterations by L-BFGS, " << exact << " with exact Hessians");
  CHECK(2 * exact <= by_bfgs);
}

TEST_CASE("five-bar: from far away every Hessian ends at stationary points of wild motions, not at a limit",
          "[design_optimizers]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const auto [hessian, start] = GENERATE(
      table<std::string, std::size_t>({{"exact", 3}, {"exact", 19}, {"gauss_newton", 2}, {"gauss_newton", 5}}));
  const DesignResult result = run_from_start(start, hessian);
  INFO(hessian << " from start " << start << ": " << result.message);
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.optimality < 1e-4);
  CHECK(result.iterations < 40);
}

TEST_CASE("Hessians of a design are right where the motion is wild", "[design_optimizers]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  Problem problem = from_start(0, "exact");
  problem.scene.parameters[0].value = 1.383367, problem.scene.parameters[1].value = 2.137718;
  DesignProgram program(problem);
  Evaluator& evaluator = program.evaluator();
  std::vector<Eigen::MatrixXd> H;
  REQUIRE(program.hessians(program.x_start(), H));
  // Shorter and shorter differences until they agree; over 1e-2 of a length they have the wrong sign.
  HessianOptions long_ladder;
  long_ladder.relative_step = 1e-4, long_ladder.rungs = 16;
  const Hessians found = hessians(evaluator, evaluator.start(), long_ladder);
  REQUIRE(found.ok);
  REQUIRE(found.of[0].relative() < 1e-5);
  const Eigen::VectorXd s = program.scaling().rho_x(program.x_start());
  const Eigen::MatrixXd reference = s.asDiagonal() * found.of[0].value * s.asDiagonal();
  CHECK((H[0] - reference).norm() < 1e-3 * reference.norm());
}

TEST_CASE("five-bar: any length of the history of L-BFGS finds the optimum, by its own steps", "[design_optimizers]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  Problem problem = still(1e-7);
  problem.design->optimizer.type = GENERATE("ipopt", "lbfgs");
  const DesignResult by_default = run_design(problem);
  problem.design->optimizer.lbfgs_history = 1;
  const DesignResult short_history = run_design(problem);
  INFO(problem.design->optimizer.type << ": " << by_default.evaluations << ", " << short_history.evaluations);
  CHECK(short_history.variables[0].value == Approx(five_bar::kL01).margin(1e-4));
  CHECK(short_history.evaluations != by_default.evaluations);
  problem.design->optimizer.lbfgs_history = 20;  // Ipopt's default here
  if (problem.design->optimizer.type == "ipopt") CHECK(run_design(problem).evaluations == by_default.evaluations);
}

TEST_CASE("five-bar: exact Hessians come to a tight tolerance", "[design_optimizers]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  Problem problem = still(1e-9);
  problem.design->optimizer.type = "ipopt";
  problem.design->optimizer.tolerance = 1e-8;
  const DesignResult by_bfgs = run_design(problem);
  problem.design->optimizer.hessian = "exact";
  const DesignResult exact = run_design(problem);
  INFO(by_bfgs.iterations << " iterations by L-BFGS, " << exact.iterations << " with exact Hessians");
  CHECK(exact.status == SolverStatus::converged);
  CHECK_THAT(exact.algorithm, Contains("exact Hessian"));
  CHECK_THAT(by_bfgs.algorithm, Contains("limited-memory"));
  CHECK(exact.iterations < by_bfgs.iterations);
  CHECK(exact.variables[0].value == Approx(five_bar::kL01).margin(1e-7));
  CHECK(exact.simulations > exact.evaluations + 1);
}
