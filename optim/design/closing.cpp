#include "optim/design/closing.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/driven/driven_simulation.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/projection/projection.hpp"
#include "core/scene/scene_error.hpp"
#include "core/start/nearest_approach.hpp"
#include "optim/solver/bounded_linear_least_squares.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostSteps = 100;
constexpr int kUniform = 36;        // instants of a run whose objectives have no samples
constexpr double kShortest = 1e-3;  // weight of |p| beside the equations, which may contradict each other

struct Defects {
  VectorXd e;    // per instant and load case
  MatrixXd e_x;  // in scaled variables
  bool known = true;
};

Defects defects_at(const DesignProgram& program, const VectorXd& x, const std::vector<std::vector<double>>& times) {
  const VectorXd rho = program.rho_at(x), rho_x = program.scaling().rho_x(x);
  Index rows = 0;
  for (const auto& of_case : times) rows += static_cast<Index>(of_case.size());
  Defects out{VectorXd::Zero(rows), MatrixXd::Zero(rows, x.size())};
  Index row = 0;
  for (std::size_t c = 0; c < times.size(); ++c) {
    const Evaluator& of_case = program.evaluator().of_case(c);
    const Mechanism mechanism = of_case.mechanism(rho, true);
    if (!may_be_solved(mechanism, of_case.scene().simulation)) return {{}, {}, false};
    NearestApproach approach(mechanism, of_case.scene().simulation.start_time);
    VectorXd e_rho(rho.size());
    for (const double t : times[c]) {
      out.e(row) = approach.defect(t, e_rho);
      out.e_x.row(row++) = rho_x.cwiseProduct(e_rho(of_case.variables())).transpose();
    }
  }
  return out;
}

// p of least length that closes the open instants, and goes as far beyond.
VectorXd reflection(const Defects& at, const VectorXd& sizes, const VectorXd& lower, const VectorXd& upper) {
  std::vector<Index> open;
  for (Index k = 0; k < at.e.size(); ++k)
    if (at.e(k) > 0) open.push_back(k);
  const Index m = static_cast<Index>(open.size()), n = sizes.size();
  MatrixXd A = MatrixXd::Zero(m + n, n);
  A.topRows(m) = at.e_x(open, Eigen::all) * sizes.asDiagonal();
  A.bottomRows(n).diagonal().setConstant(kShortest);
  VectorXd b = VectorXd::Zero(m + n);
  b.head(m) = -at.e(open).array() - at.e.maxCoeff();
  return sizes.cwiseProduct(bounded_linear_least_squares(A, b, lower.cwiseQuotient(sizes), upper.cwiseQuotient(sizes)));
}

}  // namespace

std::vector<double> closing_instants(const Evaluator& evaluator) {
  const SimulationSettings& s = evaluator.scene().simulation;
  std::vector<double> times{s.start_time}, all;
  for (const Objective& o : evaluator.objectives())
    for (const auto* samples : {&o.samples(), &o.residuals()})
      for (const Objective::Sample& sample : *samples) times.push_back(sample.time);
  if (times.size() == 1)
    for (int k = 1; k <= kUniform; ++k) times.push_back(s.start_time + (s.end_time - s.start_time) * k / kUniform);
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  for (const double t : times) {
    if (!all.empty()) all.push_back((all.back() + t) / 2);
    all.push_back(t);
  }
  return all;
}

ClosedStart close_start(const DesignProgram& program, const std::function<bool()>& go_on) {
  ClosedStart start{program.x_start()};
  std::vector<std::vector<double>> times;
  for (std::size_t c = 0; c < program.evaluator().cases(); ++c)
    times.push_back(closing_instants(program.evaluator().of_case(c)));
  const VectorXd& lower = program.x_lower;
  const VectorXd& upper = program.x_upper;
  const VectorXd ranges = upper - lower;
  const VectorXd sizes = ranges.unaryExpr([](double range) { return std::isfinite(range) && range > 0 ? range : 1.0; });
  while (true) {
    try {
      const Defects at = defects_at(program, start.x, times);
      if (!at.known || !at.e.allFinite() || !at.e_x.allFinite()) return start;
      if (start.steps == 0) start.defect = at.e.maxCoeff();
      if (at.e.maxCoeff() <= 0) {
        start.closes = true;
        return start;
      }
      if (start.steps == kMostSteps || (go_on && !go_on())) return start;
      start.x += reflection(at, sizes, lower - start.x, upper - start.x);
      start.x = start.x.cwiseMax(lower).cwiseMin(upper);
      ++start.steps;
    } catch (const SceneError&) {  // a field that these values drive out of its range
      return start;
    }
  }
}

}  // namespace mbsopt::inline optim
