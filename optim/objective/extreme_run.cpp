#include "optim/objective/extreme_run.hpp"

#include <algorithm>
#include <iterator>
#include <numbers>
#include <utility>

#include "core/cvodes/cvodes.hpp"
#include "core/driven/driven_simulation.hpp"
#include "optim/objective/objective_run.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// max a + max b is the largest of all a + b: the highest of these pairs.
std::vector<ExtremePiece> pairs_of(const std::vector<ExtremePiece>& some, const std::vector<ExtremePiece>& others) {
  const double apart = std::numbers::sqrt2;  // no two pairs of instants have the same sum then
  std::vector<ExtremePiece> pairs;
  for (const ExtremePiece& a : some)
    for (const ExtremePiece& b : others)
      pairs.push_back({a.row, a.side, a.value + b.value, a.gradient + b.gradient, a.t + apart * b.t});
  std::ranges::stable_sort(pairs, std::greater(), &ExtremePiece::value);
  pairs.resize(std::min(pairs.size(), 2 * kMostPeaks));
  return pairs;
}

}  // namespace

ExtremeRun::ExtremeRun(const std::vector<Objective>& objectives, const SimulationSettings& settings,
                       const RunOptions& options)
    : objectives_(objectives), settings_(settings), options_(options) {
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    const Index row = static_cast<Index>(i);
    if (!objectives[i].is_extreme()) {
      others_.push_back(objectives[i]);
      rows_.push_back(row);
    } else if (objectives[i].running()) {
      for (const ObjectivePart& part : objectives[i].parts()) sides_.push_back({row, part, {}});
    }
  }
}

bool ExtremeRun::find(const Mechanism& mechanism) {
  std::vector<Watched> watched;
  std::vector<Cost> shapes;  // of the extremes, which panels of a solved run resolve
  for (const Side& side : sides_) {
    const Objective& objective = objectives_[static_cast<std::size_t>(side.row)];
    watched.push_back({side.part.side, objective.expression(mechanism)});
    Cost& shape = shapes.emplace_back();
    shape.name = objective.name();
    shape.running = watched.back().x;
  }
  if (!may_be_solved(mechanism, settings_)) shapes.clear();
  const auto simulated = [&](std::span<const Cost> costs) {
    ++simulations_;
    std::vector<Cost> all(costs.begin(), costs.end());
    all.insert(all.end(), shapes.begin(), shapes.end());
    SimulationResult r = simulate(mechanism, settings_, all, {}, options_);
    if (r.ok()) r.psi.conservativeResize(static_cast<Index>(costs.size()));
    return r;
  };
  const SimulationResult run = run_objectives(others_, mechanism, settings_, simulated, options_.progress);
  result_ = run;
  if (!run.ok()) return false;
  result_.psi.setZero(static_cast<Index>(objectives_.size()));
  set_others(run, {});
  std::vector<std::vector<Peak>> found = peaks(watched, mechanism, settings_, result_.steps, options_.progress);
  if (found.size() < sides_.size()) {
    result_.message = "the run that looks for extremes failed";
    return false;
  }
  for (std::size_t k = 0; k < sides_.size(); ++k) {
    sides_[k].peaks = std::move(found[k]);
    result_.psi(sides_[k].row) += sides_[k].part.factor * sides_[k].peaks.front().value;
  }
  return true;
}

bool ExtremeRun::differentiate(const Mechanism& mechanism, bool backward, const std::vector<int>& variables) {
  RunOptions on_steps = options_;
  if (!is_cvodes(settings_.integrator.type)) on_steps.frozen = &result_.steps;
  VectorXd values;  // of each peak at its instant and at its top, one after the other
  MatrixXd values_rho;
  const auto swept = [&](std::span<const Cost> costs) {
    ++simulations_;
    std::vector<Cost> all(costs.begin(), costs.end());
    for (const Side& side : sides_) {
      const Objective& objective = objectives_[static_cast<std::size_t>(side.row)];
      const std::shared_ptr<const PointCost> x = objective.expression(mechanism);
      for (const Peak& peak : side.peaks)
        for (const double t : {peak.t, peak.top}) {
          Cost& cost = all.emplace_back();
          cost.name = objective.name();
          cost.samples.push_back({t, x});
        }
    }
    SimulationResult r = backward ? simulate_adjoint(mechanism, settings_, all, on_steps)
                                  : simulate_tlm(mechanism, settings_, all, {}, on_steps);
    if (!r.ok()) return r;
    const Index n = static_cast<Index>(costs.size()), m = static_cast<Index>(all.size()) - n;
    values = r.psi.tail(m);
    values_rho = r.psi_rho.bottomRows(m)(Eigen::all, variables);
    r.psi = VectorXd(r.psi.head(n));
    r.psi_rho = MatrixXd(r.psi_rho.topRows(n));
    return r;
  };
  const SimulationResult run = run_objectives(others_, mechanism, settings_, swept, options_.progress);
  result_.message = run.message;
  if (!run.ok()) return false;
  result_.statistics.jumps = run.statistics.jumps;
  result_.statistics.gradient_quadrature = run.statistics.gradient_quadrature;
  result_.psi_rho.setZero(result_.psi.size(), static_cast<Index>(variables.size()));
  set_others(run, variables);
  set_extremes(values, values_rho);
  return true;
}

void ExtremeRun::set_others(const SimulationResult& of, const std::vector<int>& variables) {
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Index row = static_cast<Index>(k);
    result_.psi(rows_[k]) = of.psi(row);
    if (of.psi_rho.rows() > 0) result_.psi_rho.row(rows_[k]) = of.psi_rho.row(row)(variables);
  }
}

// The top is higher but for kinks.
std::vector<ExtremePiece> ExtremeRun::Side::pieces(const VectorXd& values, const MatrixXd& values_rho,
                                                   Index first) const {
  std::vector<ExtremePiece> found;
  for (const Peak& peak : peaks) {
    const Index best = part.side * values(first) >= part.side * values(first + 1) ? first : first + 1;
    found.push_back({row, static_cast<int>(part.side * part.factor), part.factor * values(best),
                     part.factor * values_rho.row(best).transpose(), peak.t});
    first += 2;
  }
  return found;
}

void ExtremeRun::set_extremes(const VectorXd& values, const MatrixXd& values_rho) {
  Index first = 0;
  for (std::size_t k = 0; k < sides_.size(); ++k) {
    const Index row = sides_[k].row;
    std::vector<ExtremePiece> pieces = sides_[k].pieces(values, values_rho, first);
    first += 2 * static_cast<Index>(sides_[k].peaks.size());
    if (k + 1 < sides_.size() && sides_[k + 1].row == row) {  // peak to peak
      ++k;
      pieces = pairs_of(pieces, sides_[k].pieces(values, values_rho, first));
      first += 2 * static_cast<Index>(sides_[k].peaks.size());
    }
    std::ranges::stable_sort(pieces, std::greater(), [](const ExtremePiece& p) { return p.side * p.value; });
    result_.psi(row) = pieces.front().value;
    result_.psi_rho.row(row) = pieces.front().gradient.transpose();
    std::ranges::move(pieces, std::back_inserter(pieces_));
  }
}

}  // namespace mbsopt::inline optim
