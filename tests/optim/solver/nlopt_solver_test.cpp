#include "optim/solver/nlopt_solver.hpp"

#include <catch2/catch.hpp>
#include <set>
#include <sstream>

#include "optim/solver/optimality.hpp"
#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

NloptOptions with(const std::string& method, double tolerance = 1e-8) {
  NloptOptions options;
  options.method = method;
  options.tolerance = tolerance;
  options.max_evaluations = 20000;
  return options;
}

std::vector<std::string> all_methods() {
  std::istringstream words{std::string(nlopt_method_names())};
  std::vector<std::string> names;
  for (std::string word; words >> word;) names.push_back(word);
  return names;
}

}  // namespace

TEST_CASE("NLopt's methods with gradients find Rosenbrock's minimum and compute no point twice", "[nlopt]") {
  Rosenbrock problem;
  const std::string method = GENERATE("slsqp", "mma", "ccsaq", "lbfgs");
  INFO(method);
  const NlpResult result = solve_with_nlopt(problem, vector({-1.2, 1}), with(method));
  INFO(result.message);
  CHECK(result.status == SolverStatus::converged);
  CHECK((result.x - vector({1, 1})).norm() < 1e-6);
  CHECK(optimality(problem, result.x, result.point) < 1e-6);
  CHECK(problem.most_often() == 1);
  CHECK(problem.values == 0);
  CHECK(result.evaluations == problem.gradients);
  CHECK(result.iterations > 5);
}

TEST_CASE("NLopt's methods without gradients ask for none", "[nlopt]") {
  Rosenbrock problem;
  const std::string method = GENERATE("bobyqa", "cobyla", "sbplx");
  INFO(method);
  const bool linear = method == "cobyla";  // models: it crawls along the valley
  const NlpResult result = solve_with_nlopt(problem, vector({-1.2, 1}), with(method, linear ? 1e-6 : 1e-8));
  INFO(result.message << " " << result.evaluations << " " << result.x.transpose());
  CHECK(result.status == SolverStatus::converged);
  CHECK((result.x - vector({1, 1})).norm() < (linear ? 0.1 : 1e-3));
  CHECK(problem.gradients == 0);
  CHECK(problem.most_often() == 1);
  CHECK(result.evaluations == problem.values);
}

TEST_CASE("global methods leave the valley of the start, local ones end in it", "[nlopt]") {
  Camel problem;
  const auto start = vector({1.6, 0.55});  // near a local minimum, f = 2.1
  const NlpResult local = solve_with_nlopt(problem, start, with("slsqp"));
  CHECK(local.point.f > Camel::kMinimum + 0.5);
  const std::string method = GENERATE("mlsl", "direct", "crs", "isres", "esch");
  INFO(method);
  NloptOptions options = with(method, 1e-6);
  const bool evolution = method == "esch" || method == "isres";
  options.max_evaluations = evolution ? 30000 : 3000;
  options.seed = 5;
  const NlpResult result = solve_with_nlopt(problem, start, options);
  INFO(result.message << " " << result.evaluations << " " << result.x.transpose());
  CHECK((result.status == SolverStatus::searched || result.status == SolverStatus::converged));
  CHECK(result.point.f == Approx(Camel::kMinimum).margin(evolution ? 1e-2 : 1e-4));
}

TEST_CASE("NLopt solves HS071 with an inequality and an equality", "[nlopt]") {
  Hs071 problem;
  const std::string method = GENERATE("slsqp", "cobyla", "lbfgs", "bobyqa", "sbplx");
  INFO(method);
  NloptOptions options = with(method);
  options.constraint_tolerance = 1e-7;
  const NlpResult result = solve_with_nlopt(problem, vector({1, 5, 5, 1}), options);
  INFO(result.message << " " << result.evaluations << " x " << result.x.transpose() << " violation "
                      << problem.violation(result.point.c));
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.point.f == Approx(Hs071::kMinimum).epsilon(1e-5));
  CHECK(problem.violation(result.point.c) <= 1e-7);
  CHECK(problem.most_often() == 1);
  const bool augmented = method == "lbfgs" || method == "bobyqa" || method == "sbplx";
  CHECK((result.algorithm.find("Augmented Lagrangian") != std::string::npos) == augmented);
}

TEST_CASE("mma and ccsaq take inequalities, and none that is an equality", "[nlopt]") {
  const std::string method = GENERATE("mma", "ccsaq");
  INFO(method);
  Hs071 problem(false);
  problem.c_upper(1) = 40, problem.c_lower(1) = -std::numeric_limits<double>::infinity();
  const NlpResult result = solve_with_nlopt(problem, vector({1, 4, 4, 1.7}), with(method, 1e-6));
  INFO(result.message << " " << result.evaluations << " x " << result.x.transpose());
  CHECK(result.status == SolverStatus::converged);
  CHECK(problem.violation(result.point.c) <= 1e-8);
  Hs071 with_equality;
  CHECK_THROWS_WITH(solve_with_nlopt(with_equality, vector({1, 5, 5, 1}), with(method)),
                    Contains("takes no equality constraints") && Contains("slsqp"));
}

TEST_CASE("isres searches within constraints; the other global methods refuse them", "[nlopt]") {
  Hs071 problem(false);
  NloptOptions options = with("isres");
  options.max_evaluations = 20000, options.seed = 3;
  const NlpResult result = solve_with_nlopt(problem, vector({2, 4, 4, 2}), options);
  CHECK(result.status == SolverStatus::searched);
  CHECK(problem.violation(result.point.c) <= 1e-8);
  CHECK(result.point.f == Approx(Hs071::kMinimum).epsilon(2e-2));
  const std::string method = GENERATE("mlsl", "direct", "crs", "esch");
  CHECK_THROWS_WITH(solve_with_nlopt(problem, vector({2, 4, 4, 2}), with(method)),
                    Contains("'" + method + "' takes no constraints") && Contains("isres"));
}

TEST_CASE("every method goes its own way, under the name its library gives it", "[nlopt]") {
  const std::map<std::string, std::string> names{{"slsqp", "SQP"},    {"mma", "(MMA)"},     {"ccsaq", "CCSA"},
                                                 {"lbfgs", "L-BFGS"}, {"bobyqa", "BOBYQA"}, {"cobyla", "COBYLA"},
                                                 {"sbplx", "Sbplx"},  {"mlsl", "MLSL"},     {"direct", "DIRECT"},
                                                 {"crs", "CRS2"},     {"isres", "ISRES"},   {"esch", "ESCH"}};
  std::set<std::vector<double>> ways;
  for (const std::string& method : all_methods()) {
    INFO(method);
    Rosenbrock problem;
    NloptOptions options = with(method);
    options.max_evaluations = 12, options.seed = 1;
    const NlpResult result = solve_with_nlopt(problem, vector({-1.2, 1}), options);
    CHECK_THAT(result.algorithm, Contains(names.at(method)));
    std::vector<double> way;
    for (const Eigen::VectorXd& x : problem.asked) way.insert(way.end(), x.begin(), x.end());
    CHECK(problem.asked.size() == 12);
    CHECK(ways.insert(way).second);
  }
  CHECK(ways.size() == 12);
}

TEST_CASE("local methods recover from evaluations that fail and report the first one", "[nlopt]") {
  const std::string method = GENERATE("slsqp", "mma", "ccsaq", "lbfgs", "bobyqa", "cobyla", "sbplx");
  Fragile problem;
  problem.throws = GENERATE(true, false);
  INFO(method << (problem.throws ? " throws" : " nan"));
  const NlpResult result = solve_with_nlopt(problem, vector({4, 3}), with(method, 1e-7));
  INFO(result.message << " " << result.evaluations << " " << result.failed_evaluations << " " << result.x.transpose());
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(0) == Approx(1).margin(1e-3));
  CHECK(result.x(1) == Approx(1).margin(1e-2));
  if (result.failed_evaluations > 0)
    CHECK_THAT(result.first_error, Contains(problem.throws ? "the crank locks" : "not finite"));
}

TEST_CASE("NLopt: steps that fail are shortened", "[nlopt]") {
  for (const std::string method : {"slsqp", "lbfgs"}) {
    Fragile problem;
    const NlpResult result = solve_with_nlopt(problem, vector({4, 3}), with(method, 1e-7));
    INFO(method << ": " << result.evaluations);
    CHECK(result.failed_evaluations > 0);
    CHECK(result.evaluations < 60);
  }
}

TEST_CASE("NLopt: a method that only fails is stopped", "[nlopt]") {
  struct Island : Fragile {
    double f(const Eigen::VectorXd& x) const override {
      if (x != vector({4, 3})) throw std::runtime_error("no assembly");
      return Fragile::f(x);
    }
  } problem;
  const std::string method = GENERATE("slsqp", "bobyqa", "cobyla", "sbplx");
  INFO(method);
  const NlpResult result = solve_with_nlopt(problem, vector({4, 3}), with(method));
  INFO(result.message);
  CHECK(result.evaluations < 200);
  CHECK(result.status != SolverStatus::stopped);
  CHECK_THAT(result.message, Contains("no assembly"));
  CHECK(result.x == vector({4, 3}));
}

TEST_CASE("NLopt: a start point that cannot be evaluated is said in words", "[nlopt]") {
  Fragile problem;
  const NlpResult result = solve_with_nlopt(problem, vector({0.1, 0}), with("slsqp"));
  CHECK(result.status == SolverStatus::failed);
  CHECK(result.message == "the start point cannot be evaluated: the crank locks");
}

TEST_CASE("NLopt stops on request, keeps the best point and lets exceptions through whole", "[nlopt]") {
  const std::string method = GENERATE("slsqp", "mma", "lbfgs", "bobyqa", "cobyla", "sbplx", "direct", "crs", "esch");
  INFO(method);
  Rosenbrock problem;
  NloptOptions options = with(method);
  std::vector<double> seen;
  options.progress = [&](const NlpProgress& p) {
    seen.push_back(p.f);
    return p.iteration < 3;
  };
  const NlpResult result = solve_with_nlopt(problem, vector({-1.2, 1}), options);
  CHECK(result.status == SolverStatus::stopped);
  REQUIRE(seen.size() == 4);
  CHECK(std::is_sorted(seen.rbegin(), seen.rend()));
  CHECK(result.point.f == seen.back());
  options.progress = [](const NlpProgress& p) -> bool {
    if (p.iteration == 2) throw std::runtime_error("the disk is full");
    return true;
  };
  CHECK_THROWS_WITH(solve_with_nlopt(problem, vector({-1.2, 1}), options), "the disk is full");
}

TEST_CASE("NLopt says at which limit it stopped", "[nlopt]") {
  Rosenbrock problem;
  NloptOptions options = with("slsqp");
  options.max_evaluations = 7;
  NlpResult result = solve_with_nlopt(problem, vector({-1.2, 1}), options);
  CHECK(result.status == SolverStatus::iteration_limit);
  CHECK(result.message == "stopped at the limit of 7 evaluations");
  CHECK(problem.asked.size() == 7);
  options = with("lbfgs");
  options.max_iterations = 2;
  result = solve_with_nlopt(problem, vector({-1.2, 1}), options);
  CHECK(result.message == "stopped at the limit of 2 iterations");
}

TEST_CASE("random methods repeat themselves with the seed, and only with it", "[nlopt]") {
  const std::string method = GENERATE("mlsl", "crs", "isres", "esch");
  INFO(method);
  const auto way = [&](std::uint32_t seed) {
    Rosenbrock problem;
    NloptOptions options = with(method);
    options.max_evaluations = 60, options.seed = seed;
    solve_with_nlopt(problem, vector({-1.2, 1}), options);
    return problem.asked;
  };
  CHECK(way(1) == way(1));
  CHECK(way(1) != way(2));
}

TEST_CASE("NLopt leaves a start that is optimal as it is", "[nlopt]") {
  Rosenbrock problem;
  const NlpResult result = solve_with_nlopt(problem, vector({1, 1}), with(GENERATE("slsqp", "lbfgs", "mma", "ccsaq")));
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.message == "converged: the optimality conditions hold where the search began");
  CHECK(result.evaluations == 1);
}

TEST_CASE("NLopt says that constraints contradict each other", "[nlopt]") {
  Hs071 problem;
  problem.c_lower(0) = 2000;  // the product of four numbers up to 5 is at most 625
  const NlpResult result = solve_with_nlopt(problem, vector({1, 5, 5, 1}), with(GENERATE("slsqp", "cobyla")));
  INFO(result.message);
  CHECK(result.status == SolverStatus::infeasible);
}

TEST_CASE("NLopt refuses what it cannot do", "[nlopt]") {
  Rosenbrock problem;
  CHECK_THROWS_WITH(solve_with_nlopt(problem, vector({0, 0}), with("newton")), Contains("no NLopt method 'newton'"));
  problem.x_upper(1) = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(solve_with_nlopt(problem, vector({0, 0}), with("direct")), Contains("searches between bounds"));
}
