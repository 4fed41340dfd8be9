#include "core/driven/timed_instants.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/run/timed_laws.hpp"

namespace mbsopt {
namespace {

constexpr double kPieces = 8;    // cubics, which the 15 nodes of a panel resolve
constexpr double kChord = 1e-2;  // of the range of samples: they differ less from a chord between two of them

// Adds the ends of chords through samples that no sample leaves by more than kChord. Douglas, Peucker, "Algorithms for
// the reduction of the number of points", Cartographica 10 (1973).
void add_chords(const KinkedSignal& signal, std::vector<double>& instants) {
  const std::vector<double>&x = signal.curve->x(), &y = signal.curve->y();
  if (x.size() < 3) return;
  const auto [low, high] = std::minmax_element(y.begin(), y.end());
  std::vector<std::pair<std::size_t, std::size_t>> chords{{0, x.size() - 1}};
  while (!chords.empty()) {
    const auto [i, j] = chords.back();
    chords.pop_back();
    std::size_t farthest = i;
    double distance = kChord * (*high - *low);
    for (std::size_t k = i + 1; k < j; ++k) {
      const double d = std::abs(y[k] - y[i] - (y[j] - y[i]) * (x[k] - x[i]) / (x[j] - x[i]));
      if (d > distance) {
        farthest = k;
        distance = d;
      }
    }
    if (farthest == i) continue;
    instants.push_back(x[farthest] + signal.delay);
    chords.push_back({i, farthest});
    chords.push_back({farthest, j});
  }
}

}  // namespace

std::vector<double> timed_instants(const Mechanism& mechanism, std::span<const Cost> costs, double start, double end,
                                   double apart, std::vector<double>& jumps) {
  std::vector<double> instants{start, end};
  for (const TimedLaw& law : timed_laws(mechanism, costs, start, end)) {
    instants.insert(instants.end(), law.pieces.begin(), law.pieces.end());
    jumps.insert(jumps.end(), law.jumps.begin(), law.jumps.end());
  }
  for (const KinkedSignal& signal : kinks_of(mechanism, costs)) add_chords(signal, instants);
  std::erase_if(instants, [&](double t) { return t < start || t > end; });
  std::sort(instants.begin(), instants.end());
  instants.erase(std::unique(instants.begin(), instants.end(), [&](double a, double b) { return b - a <= apart; }),
                 instants.end());
  return instants;
}

double resolved_until(const std::vector<double>& instants, double t, double t1) {
  double until = t, shortest = INFINITY;
  for (auto next = std::upper_bound(instants.begin(), instants.end(), t); next != instants.end(); ++next) {
    if (next != instants.begin()) shortest = std::min(shortest, *next - *(next - 1));
    if (until > t && *next - t > kPieces * shortest) return until;
    until = *next;
    if (until >= t1) break;
  }
  return t1;
}

}  // namespace mbsopt
