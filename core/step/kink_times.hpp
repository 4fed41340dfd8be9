// Times at which signals jump (hold) or have kinks (linear), or their third derivative jumps (spline), and how steps
// meet them.
//
// A step across a kink loses the order of its method. So a step ends at the kink, and the next begins a few roundings
// later (event_times.hpp). Many kinks are smaller than the tolerance, and a step for each would cost more than it
// gains. So two sizes are controlled: h of steps without kinks inside, and `across` of steps with kinks inside. The
// error of the latter behaves as h^2, of splines as h^4. A step crosses kinks if `across` reaches over at least two
// intervals. It ends at a kink, too, so that as few as possible lie inside. Each step that ends at the next kink lets
// `across` grow again. Knots of splines alone are met only where `across` is shorter than h, and not by fixed steps:
// they are much smoother. Beside jumps and kinks they are left out.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

class KinkControl {
 public:
  KinkControl(const std::vector<KinkedSignal>& signals, double start, double end)
      : smooth_(std::ranges::none_of(signals, is_sharp)),
        root_(root_of(signals)),
        end_(end),
        gap_(16 * std::numeric_limits<double>::epsilon() * std::max(std::abs(start), std::abs(end))) {
    for (const KinkedSignal& signal : signals)
      if (smooth_ || is_sharp(signal)) sources_.push_back({signal, 0, significant_change(*signal.curve)});
  }

  // The size of the step at t, of which h is proposed; fixed: steps that no error controls.
  double choose(double t, double h, bool fixed) {
    state_ = State::clear;
    if (sources_.empty()) return h;
    const double next = first_after(t);
    if (t + h < next - 1.5 * gap_ || (smooth_ && fixed)) return h;
    if (smooth_ && !limits(h)) {
      state_ = State::crosses;
      kink_ = kNone;
      return h;
    }
    const double reach = fixed ? h : std::min(h, across_);
    const double last = reach >= 2 * (next - t) ? last_until(t + reach) : next;
    state_ = last > next ? State::crosses : State::meets;
    kink_ = std::max(last, next);
    return kink_ - gap_ - t;
  }
  // How near to the end a step may stop where a kink lies there.
  double gap() const { return sources_.empty() ? 0 : 1.5 * gap_; }
  double past() const { return 2 * gap_; }  // how much later than an instant a step begins
  bool crosses() const { return state_ == State::crosses; }
  bool meets() const { return state_ == State::meets; }
  // Returns whether kinks allow less than h.
  bool limits(double h) const { return across_ < h; }
  // Returns whether a step that ends at t1 has come to the kink that choose() gave.
  bool reached(double t1) const { return state_ != State::clear && t1 >= kink_ - 1.5 * gap_; }
  double resume_time() const { return kink_ + gap_; }

  // Reports a step of size h that crosses kinks; its error is in tolerances.
  void accepted_across(double h, double error) { across_ = h * factor(error, kMost); }
  void rejected_across(double h, double error) { across_ = h * factor(error, kShrunk); }
  void met() { across_ *= kRecovery; }

 private:
  enum class State { clear, meets, crosses };
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  static constexpr double kLeast = 0.01;       // sizes without kinks may have grown far beyond what crosses them
  static constexpr double kMost = 6;           // times the last step: the most that other steps grow (step_control.hpp)
  static constexpr double kSmallError = 1e-6;  // allows more than kMost
  static constexpr double kShrunk = 0.9;       // after a rejection at most
  static constexpr double kRecovery = 1.1;     // of two intervals down to half of one: 15 steps until the next try
  double factor(double error, double most) const {
    return std::isfinite(error) ? std::clamp(0.9 / std::pow(std::max(error, kSmallError), root_), kLeast, most)
                                : kLeast;
  }

  struct Source {
    KinkedSignal signal;
    std::size_t next;
    double significant;
    double time(std::size_t i) const { return signal.curve->x()[i] + signal.delay; }
    bool matters(std::size_t i) const { return std::abs(signal.curve->change_at(i)) > significant; }
  };

  // Changes below the rounding of samples are none: held values that repeat, samples on one line.
  static double significant_change(const Curve& curve) {
    if (curve.interpolation() == Interpolation::spline) return 0;  // `across` finds what matters
    constexpr double kDigits = 1e-9;                               // more digits than loggers write
    const auto [low, high] = std::minmax_element(curve.y().begin(), curve.y().end());
    const double size = std::max(std::abs(*low), std::abs(*high));
    const double span = curve.x().back() - curve.x().front();
    return kDigits * (curve.interpolation() == Interpolation::hold ? size : size / span);
  }

  // The first kink after t, and the last one that is not after t1, for times that only grow; infinity where there is
  // none in the run.
  double first_after(double t) {
    double first = kNone;
    for (Source& source : sources_) {
      const std::size_t size = source.signal.curve->x().size();
      while (source.next < size && (!source.matters(source.next) || source.time(source.next) <= t + 2 * gap_))
        ++source.next;
      if (source.next < size) first = std::min(first, source.time(source.next));
    }
    return first <= end_ + gap_ ? first : kNone;
  }
  double last_until(double t1) const {
    double last = -kNone;
    for (const Source& source : sources_) {
      const std::vector<double>& x = source.signal.curve->x();
      const auto after = std::upper_bound(x.begin(), x.end(), t1 - source.signal.delay);
      for (std::size_t i = static_cast<std::size_t>(after - x.begin()); i-- > source.next;) {
        if (!source.matters(i)) continue;
        last = std::max(last, source.time(i));
        break;
      }
    }
    return last;
  }

  static bool is_sharp(const KinkedSignal& signal) { return signal.curve->interpolation() != Interpolation::spline; }
  static double root_of(const std::vector<KinkedSignal>& signals) {
    int order = 3;
    for (const KinkedSignal& signal : signals) order = std::min(order, std::max(1, signal.order));
    return 1.0 / (order + 1);
  }

  bool smooth_;
  double root_;
  std::vector<Source> sources_;
  double end_, gap_;
  State state_ = State::clear;
  double kink_ = 0;
  double across_ = kNone;  // nothing is known against it
};

}  // namespace mbsopt
