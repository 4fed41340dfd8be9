#include "optim/check/gradient_differences.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "optim/differences/verdict.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kJumpRungs = 3;  // the smallest: further off, frozen steps have errors of their own

// Returns whether all runs of the difference took the steps of the base run.
bool on_base_steps(const VectorXd& largest, Index i, double other_steps) { return largest(i) < 0.75 * other_steps; }

}  // namespace

GradientDifferences::GradientDifferences(CheckedRun& run, const Settings& settings)
    : run_(run), settings_(settings), size_of_steps_(run.size) {
  const Index m = run_.psi.size(), P = run_.rho.size();
  for (Table* table : {&frozen_, &free_}) {
    for (MatrixXd* x : {&table->derivative, &table->error, &table->step}) x->setZero(m, P);
  }
  for (Index k = 0; k < P; ++k) {
    if (run_.discrete && !run_.on_frozen_steps(k)) frozen_.derivative.col(k).setConstant(kNaN);
  }
  jump_.setZero(m, P);
  on_base_steps_.setConstant(m, P, false);
}

std::string GradientDifferences::take(Index k, bool frozen) {
  const Ladder found = ladder(k, frozen, settings_.relative_step * run_.size(k));
  for (Index i = 0; i < run_.psi.size(); ++i) keep(found, i, k, frozen);
  return found.d.derivative.hasNaN() ? found.failure : "";
}

// Steps that are coarse for psi may show a plateau that is no derivative (for example a coordinate of kilometres where
// metres matter). A ladder that begins below the first one replaces it if they differ by more than its own error.
// Smaller steps magnify rounding and jumps, which must not excuse a wrong gradient.
bool GradientDifferences::take_finer(Index k, bool frozen, const std::vector<Index>& objectives,
                                     const VectorXd& psi_rounding) {
  if (objectives.empty()) return false;
  const Ladder finer = ladder(k, frozen, settings_.relative_step * run_.size(k) * std::pow(0.5, settings_.rungs));
  bool found = false;
  for (const Index i : objectives) {
    const double change = std::abs(finer.d.derivative(i) - of(frozen).derivative(i, k));
    if (!(change > kEstimateTrust * own_error(finer, i, k, frozen, psi_rounding(i)))) continue;
    keep(finer, i, k, frozen);
    if (!frozen) add_integration_error(i, k);
    size_of_steps_(k) = std::min(size_of_steps_(k), finer.d.largest(i) / settings_.relative_step);
    found = true;
  }
  return found;
}

// Takes steps of `largest` and below. Both ladders take the same steps h, halved exactly.
GradientDifferences::Ladder GradientDifferences::ladder(Index k, bool frozen, double largest) {
  Ladder ladder;
  const auto f = [&](double h) -> std::optional<VectorXd> {
    VectorXd rho = run_.rho;
    rho(k) += h;
    Evaluation e = run_.values(rho, frozen);
    if (!e.ok) ladder.failure = e.message;
    if (!e.ok) return std::nullopt;
    if (e.steps.sizes != run_.steps.sizes) ladder.other_steps = std::min(ladder.other_steps, std::abs(h));
    rungs_[{k, std::abs(h)}][frozen ? 0 : 1][h > 0 ? 0 : 1] = e.psi;
    const double near = largest * std::pow(0.5, settings_.rungs - kJumpRungs);
    if (!frozen && h < 0 && std::abs(h) < 1.5 * near) {
      const auto& [on_base, on_free] = rungs_.at({k, std::abs(h)});
      if (on_base[0].size() > 0 && on_base[1].size() > 0 && on_free[0].size() > 0) {
        const VectorXd jump = (0.5 * (on_free[0] - on_base[0] + on_free[1] - on_base[1])).cwiseAbs();
        if (jump.allFinite()) jump_.col(k) = jump_.col(k).cwiseMax(jump);
      }
    }
    return std::move(e.psi);
  };
  ladder.d = difference_ladder(f, run_.psi.size(), {largest, settings_.rungs, kPsiRounding});
  for (Index i = 0; i < run_.psi.size(); ++i)
    if (!ladder.d.has_estimate(i)) ladder.d.derivative(i) = kNaN, ladder.d.error(i) = kInfinity;
  return ladder;
}

void GradientDifferences::keep(const Ladder& ladder, Index i, Index k, bool frozen) {
  Table& table = frozen ? frozen_ : free_;
  table.derivative(i, k) = ladder.d.derivative(i);
  table.error(i, k) = ladder.d.error(i);
  table.step(i, k) = ladder.d.step(i);
  if (!frozen && run_.discrete) on_base_steps_(i, k) = on_base_steps(ladder.d.largest, i, ladder.other_steps);
}

// Sums the errors of the ladder, of psi's rounding and, on free steps, of the integration.
double GradientDifferences::own_error(const Ladder& ladder, Index i, Index k, bool frozen, double psi_rounding) const {
  const double step = ladder.d.step(i);
  if (!(step > 0)) return kInfinity;
  const bool same_steps = frozen || on_base_steps(ladder.d.largest, i, ladder.other_steps);
  return ladder.d.error(i) + psi_rounding / step + (same_steps ? 0 : integration_error_of(i, k, step));
}

// Free differences differ from the derivatives on frozen steps by the derivative of the integration error. They also
// contain its jumps from step sequence to step sequence, divided by the step. The smallest steps show the size of the
// jumps if both differences exist: the mean of what separates them at h and -h, since the part that is linear in h is a
// difference of slopes, and excuses nothing. If all runs of an entry took the steps of the base run, the entry is as
// good as one on frozen steps. Rounded steps often coincide so (step_control.hpp).
void GradientDifferences::add(IntegrationError integration) {
  integration_ = std::move(integration);
  if (!settings_.free_steps) return;
  for (Index k = 0; k < run_.rho.size(); ++k)
    for (Index i = 0; i < run_.psi.size(); ++i) add_integration_error(i, k);
}
void GradientDifferences::add_integration_error(Index i, Index k) {
  if (!on_base_steps_(i, k) && std::isfinite(free_.error(i, k)))
    free_.error(i, k) += integration_error_of(i, k, free_.step(i, k));
}
double GradientDifferences::integration_error_of(Index i, Index k, double step) const {
  return integration_.psi_rho(i, k) + std::max(integration_.psi(i), jump_(i, k)) / step;
}

std::vector<LadderRung> GradientDifferences::rungs(Index i, Index k) const {
  std::vector<LadderRung> rungs;
  for (const auto& [at, values] : rungs_) {
    if (at.first != k) continue;
    const auto slope = [&, h = at.second](const std::array<VectorXd, 2>& psi) {
      return psi[0].size() == 0 || psi[1].size() == 0 ? kNaN : (psi[0](i) - psi[1](i)) / (2 * h);
    };
    rungs.push_back({at.second, slope(values[0]), slope(values[1])});
  }
  std::reverse(rungs.begin(), rungs.end());
  return rungs;
}

// b(h) = (psi(h) + psi(-h) - 2 psi)/(2h), at the smallest steps h and 2h at which psi's rounding does not count.
double GradientDifferences::kink(Index i, Index k, bool frozen, double psi_rounding) const {
  double b = kNaN, wider = kNaN;
  for (auto rung = rungs_.rbegin(); rung != rungs_.rend(); ++rung) {
    const auto& [plus, minus] = rung->second[frozen ? 0 : 1];
    if (rung->first.first != k || plus.size() == 0 || minus.size() == 0) continue;
    const double bend = plus(i) + minus(i) - 2 * run_.psi(i);
    if (!(std::abs(bend) > kEstimateTrust * psi_rounding)) break;
    wider = b;
    b = bend / (2 * rung->first.second);
  }
  return b / wider > kKinkFalls ? b : kNaN;
}

}  // namespace mbsopt::inline optim
