// Five bars on two springs (FB-1, problems/five_bar/design.json) from the given lengths and 20 Latin-hypercube starts
// (seed 7, or MBSOPT_STARTS_SEED) by every method with gradients: where each run ends, and what that point is. Counts
// do not depend on the machine, except that simulations of wild motions differ by rounding.
//   exact_optimum   runs that end within 1e-6 m of the known free lengths
//   local_minimum   others at points that are stationary (optimality at most 1e-4, in words "converged"), the Hessian
//                   there positive definite in the lengths that no bound holds
//   stationary      other stationary ones;  not_stationary: the rest
//   iterations, lbfgs_iterations, ratio   of runs that end at the exact optimum by this method and by Ipopt's L-BFGS
// MBSOPT_STARTS_TABLE=1 writes each run as a row of a Markdown table on standard error:
//   MBSOPT_STARTS_TABLE=1 ./dev bench --benchmark_filter=starts                    all methods
//   ./dev bench --benchmark_filter=starts/five_bar/ipopt_exact                     one of them
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/json/read_problem.hpp"
#include "optim/design/design.hpp"
#include "optim/objective/hessian.hpp"
#include "optim/objective/objective.hpp"
#include "optim/problem/start_points.hpp"

using namespace mbsopt;

namespace {

constexpr double kOptimum[] = {2.1469536808839935, 1.9183006617287768};  // the springs hold the mechanism still
constexpr std::pair<const char*, const char*> kMethods[] = {
    {"ipopt", "lbfgs"}, {"ipopt", "exact"}, {"ipopt", "gauss_newton"}, {"slsqp", "lbfgs"},
    {"mma", "lbfgs"},   {"ccsaq", "lbfgs"}, {"lbfgs", "lbfgs"}};

Problem five_bar() { return read_problem(MBSOPT_SOURCE_DIR "/problems/five_bar/design.json"); }

long seed() {
  const char* const given = std::getenv("MBSOPT_STARTS_SEED");
  return given ? std::atol(given) : 7;
}

std::vector<DesignResult> runs(const std::string& type, const std::string& hessian) {
  Problem problem = five_bar();
  problem.design->optimizer.type = type, problem.design->optimizer.hessian = hessian;
  MultistartSpec spec;
  spec.starts = 21;
  const std::vector<Parameter> lengths{problem.scene.parameters[0], problem.scene.parameters[1]};
  DesignOptions options;
  options.scale = design_scale(problem);
  std::vector<DesignResult> results;
  for (const Eigen::VectorXd& start : start_values(lengths, spec, seed())) {
    for (std::size_t k = 0; k < 2; ++k) problem.scene.parameters[k].value = start(static_cast<Eigen::Index>(k));
    results.push_back(run_design(problem, options));
  }
  return results;
}

const std::vector<DesignResult>& by_lbfgs() {
  static const std::vector<DesignResult> results = runs("ipopt", "lbfgs");
  return results;
}

bool at_exact_optimum(const DesignResult& r) {
  return std::abs(r.variables[0].value - kOptimum[0]) < 1e-6 && std::abs(r.variables[1].value - kOptimum[1]) < 1e-6;
}

// The least and the largest curvature [1/m^2] in the lengths that no bound holds.
std::optional<std::pair<double, double>> curvatures(const Problem& problem, const DesignResult& r) {
  Evaluator evaluator(problem.scene, objectives_of(problem), {"L01", "L02"}, {GradientMethod::adjoint, {}, {}, {}});
  HessianOptions options;
  options.relative_step = 1e-5, options.rungs = 12;
  const Hessians found = hessians(evaluator, r.rho, options);
  std::vector<Eigen::Index> free;
  for (std::size_t k = 0; k < 2; ++k)
    if (!r.variables[k].at_lower && !r.variables[k].at_upper) free.push_back(static_cast<Eigen::Index>(k));
  if (!found.ok || found.of[0].relative() > 1e-2 || free.empty()) return std::nullopt;
  const Eigen::MatrixXd H = found.of[0].value(free, free);
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(H).eigenvalues();
  return std::pair{values(0), values(values.size() - 1)};
}

struct EndPoint {
  const char* kind;
  std::string curvature;
};

EndPoint end_point(const Problem& problem, const DesignResult& r) {
  const auto c = curvatures(problem, r);
  const std::string text = c ? fmt::format("{:.2g}, {:.2g}", c->first, c->second) : "-";
  if (at_exact_optimum(r)) return {"exact_optimum", text};
  if (r.status != SolverStatus::converged || !(r.optimality <= 1e-4)) return {"not_stationary", text};
  return {c && c->first > 0 ? "local_minimum" : "stationary", text};
}

std::string length(const DesignVariable& v) {
  return fmt::format("{:.6f}{}", v.value, v.at_lower || v.at_upper ? " (bound)" : "");
}

std::string name_of(const char* type, const char* hessian, const char* between) {
  return type == std::string("ipopt") ? fmt::format("{}{}{}", type, between, hessian) : type;
}

void starts(benchmark::State& state, const char* type, const char* hessian) {
  const std::string name = name_of(type, hessian, " ");
  state.SetLabel(name);
  const Problem problem = five_bar();
  for (auto _ : state) {
    const std::vector<DesignResult> results = runs(type, hessian);
    std::map<std::string, double> count{
        {"exact_optimum", 0}, {"local_minimum", 0}, {"stationary", 0}, {"not_stationary", 0}};
    int iterations = 0, lbfgs_iterations = 0;
    for (std::size_t start = 0; start < results.size(); ++start) {
      const DesignResult& r = results[start];
      const EndPoint end = end_point(problem, r);
      ++count[end.kind];
      if (at_exact_optimum(r) && at_exact_optimum(by_lbfgs()[start]))
        iterations += r.iterations, lbfgs_iterations += by_lbfgs()[start].iterations;
      if (std::getenv("MBSOPT_STARTS_TABLE"))
        fmt::print(
            stderr, "| {} | {} | {:.4f}, {:.4f} | {} | {} | {}, {} | {:.6g} | {:.1e} | {} | {} |\n", name, start,
            r.variables[0].initial, r.variables[1].initial, r.iterations, r.evaluations, length(r.variables[0]),
            length(r.variables[1]), r.objective_final, r.optimality, end.curvature,
            r.status == SolverStatus::converged ? end.kind : fmt::format("{}: {}", end.kind, to_string(r.status)));
    }
    for (const auto& [kind, number] : count) state.counters[kind] = number;
    state.counters["iterations"] = iterations, state.counters["lbfgs_iterations"] = lbfgs_iterations;
    state.counters["ratio"] = iterations / std::max(1.0, static_cast<double>(lbfgs_iterations));
  }
}
const bool registered = [] {
  for (const auto& [type, hessian] : kMethods)
    benchmark::RegisterBenchmark(("starts/five_bar/" + name_of(type, hessian, "_")).c_str(), starts, type, hessian)
        ->Iterations(1)
        ->Unit(benchmark::kSecond);
  return true;
}();

}  // namespace
