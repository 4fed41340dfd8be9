#include "optim/tradeoff/accuracy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "core/scene/vocabulary.hpp"
#include "core/watch/stiffness.hpp"
#include "optim/tradeoff/tradeoff_reference.hpp"

namespace mbsopt::inline optim {
namespace {

double largest_of(const std::vector<ErrorEstimate>& estimates) {
  double largest = 0;
  for (const ErrorEstimate& e : estimates)
    if (!(e.error <= largest)) largest = e.error;
  return largest;
}

double rounded(double rtol) { return std::stod(fmt::format("{:.0e}", rtol)); }

class Chooser {
 public:
  Chooser(const Scene& scene, const std::vector<Objective>& objectives, const AccuracyOptions& options)
      : runs_(scene, objectives), options_(options), base_(scene.simulation) {
    result_.wanted = base_.accuracy.value();
    base_.accuracy.reset();
  }

  AccuracyChoice run() {
    result_.settings = base_;
    const bool high_order = result_.wanted < 1e-7;
    method_ = high_order ? "dopri853" : "dopri5";
    verifier_ = "dopri853";
    result_.why = high_order ? "a high order for an accuracy this high" : "accuracy and not stability limits its steps";
    std::optional<Point> found = settled(kPilotSteps);
    if (!stiff_why_.empty() && !interrupted()) {
      method_ = verifier_ = "radau5";
      result_.why = "stiff: " + stiff_why_;
      implicit_ = true;
      found = settled(base_.integrator.max_steps);
    }
    result_.ok = found.has_value();
    if (found) {
      result_.settings = found->settings;
      result_.settings.integrator.max_steps = base_.integrator.max_steps;
      result_.estimates = found->estimates;
      result_.reached = found->largest() <= result_.wanted;
    } else if (result_.message.empty()) {
      result_.message = "no run came to its end";
    }
    return std::move(result_);
  }

 private:
  // Limit of the pilot run. If it does not suffice, the scene is either stiff, or long and may take as many steps.
  static constexpr long kPilotSteps = 2'000;
  static constexpr double kTightest = 1e-11, kLoosest = 1e-3;  // of rtol
  static constexpr double kTighter = 100;  // the verifying run's tolerance; rounding starves step-size control beyond
  static constexpr int kMostRuns = 8;

  struct Point {
    SimulationSettings settings;
    Answer answer;
    std::vector<ErrorEstimate> estimates;
    double rtol() const { return settings.integrator.rtol; }
    double largest() const { return largest_of(estimates); }
  };

  bool interrupted() const { return options_.limit.interrupted && options_.limit.interrupted(); }

  Answer answer(const SimulationSettings& settings) {
    ++result_.simulations;
    if (options_.progress) options_.progress(static_cast<int>(result_.simulations));
    return runs_.motion(settings, options_.limit);
  }

  SimulationSettings settings_at(const char* method, double rtol, long max_steps) const {
    SimulationSettings settings = with_tolerance(base_, method, rounded(std::clamp(rtol, kTightest, kLoosest)));
    settings.integrator.max_steps = std::min(max_steps, settings.integrator.max_steps);
    return settings;
  }

  // Returns whether the run shows that an explicit method is wrong. Keeps its results.
  bool is_wrong_method(const Point& point) {
    const SimulationStatistics& s = point.answer.statistics;
    if (implicit_ || s.watched_steps == 0) return false;
    result_.limited_steps = static_cast<double>(s.stability_limited_steps) / static_cast<double>(s.watched_steps);
    result_.stiffest_rate = s.stiffest_rate;
    if (is_stability_limited(s))
      stiff_why_ = fmt::format("stability limits {:.0f} % of the steps of {}, at rates up to {:.1e} 1/s",
                               100 * result_.limited_steps, method_, s.stiffest_rate);
    return is_stability_limited(s);
  }

  // Returns whether an implicit method needs less than half of the right-hand sides that an unfinished explicit run
  // would need. Their number does not depend on chance, but the time does. The implicit run ends when it needs more.
  bool implicit_is_cheaper(const Point& unfinished) {
    constexpr double kPerStep = 6;  // right-hand sides at least: two Newton iterations of three stages
    if (unfinished.answer.steps.times.empty()) return false;
    const double done = unfinished.answer.steps.times.back() - base_.start_time;
    const double needed =
        static_cast<double>(unfinished.answer.statistics.rhs_evaluations) * (base_.end_time - base_.start_time) / done;
    const double most_steps = std::min(needed / (2 * kPerStep), static_cast<double>(base_.integrator.max_steps));
    const Answer implicit = answer(settings_at("radau5", unfinished.rtol(), static_cast<long>(most_steps)));
    if (!implicit.ok) return false;
    const double ratio = needed / static_cast<double>(implicit.statistics.rhs_evaluations);
    if (!(ratio > 2)) return false;
    stiff_why_ = fmt::format("{} would need {:.1f} times as many right-hand sides", method_, ratio);
    return true;
  }

  // Returns whether the method of the verifying run needs less than half of the right-hand sides that dopri5 would need
  // until its error falls to `aim`. An error falls as h^p, so that their number grows as (error/aim)^(1/p).
  bool high_order_is_cheaper(const Point& point, const Answer& verified, double error, double aim) const {
    if (implicit_ || std::string_view(method_) == verifier_ || error <= result_.wanted) return false;
    const auto needed = [&](const Answer& answer, double from, double order) {
      return static_cast<double>(answer.statistics.rhs_evaluations) * std::pow(std::max(1.0, from / aim), 1 / order);
    };
    return 2 * needed(verified, error / kTighter, 8) < needed(point.answer, error, 5);
  }

  // A point within the wanted accuracy, or the most exact one found. There is none if nothing ran, or if the method
  // must change.
  std::optional<Point> settled(long pilot_steps) {
    std::optional<Point> best, last;
    std::optional<Answer> right;  // of the verifying run, and its tolerance
    double right_rtol = std::numeric_limits<double>::infinity(), rtol = 0.1 * result_.wanted;
    long max_steps = pilot_steps;
    for (int runs = 0; runs < kMostRuns; ++runs) {
      Point point;
      point.settings = settings_at(method_, rtol, max_steps);
      point.answer = answer(point.settings);
      if (interrupted()) return {};
      if (is_wrong_method(point)) {
        if (!best || best->largest() > result_.wanted) return {};
        stiff_why_.clear();  // it was right at a tighter tolerance, and stays
        break;
      }
      const bool ran_out = max_steps < base_.integrator.max_steps && point.answer.statistics.steps >= max_steps / 2;
      if (!point.answer.ok && ran_out) {
        if (implicit_is_cheaper(point)) return {};
        max_steps = base_.integrator.max_steps;  // long, not stiff
        continue;
      }
      if (!point.answer.ok) {
        if (best || rtol <= 1e-6) return failed(point.answer, std::move(best));
        rtol *= 1e-2;  // too loose to get through
        continue;
      }
      max_steps = base_.integrator.max_steps;
      if (const auto failure = renew(right, right_rtol, point.rtol())) return failed(*failure, std::move(best));
      judge(point, *right);
      const double error = std::max(point.largest(), AccuracyChoice::kRounding), aim = result_.wanted / 3;
      if (high_order_is_cheaper(point, *right, error, aim)) {
        method_ = verifier_;
        result_.why = "a high order takes fewer right-hand sides to this accuracy";
        rtol = point.rtol() * std::max(aim / error, 1e-4);
        best.reset();
        last.reset();
        continue;
      }
      if (!best || is_better(point, *best)) best = point;
      const bool within = error <= result_.wanted, looser_before = last && last->rtol() > point.rtol();
      if (within && (looser_before || error > 0.03 * result_.wanted || point.rtol() >= kLoosest)) break;
      if (!within && (best->largest() <= result_.wanted || point.rtol() <= kTightest))
        break;  // loosened too far, or tight
      const double change = std::pow(aim / error, 1 / order_between(last, point, error));
      rtol = point.rtol() * (within ? std::min(change, 100.0) : std::clamp(change, 1e-4, 0.3));
      last = std::move(point);
      if (within && rounded(std::clamp(rtol, kTightest, kLoosest)) <= last->rtol()) break;
    }
    return best;
  }

  // Renews the right answer if it is not much more exact than runs at rtol. Returns the failed run if there is none.
  std::optional<Answer> renew(std::optional<Answer>& right, double& right_rtol, double rtol) {
    if (right && right_rtol <= 1.01 * rtol / kTighter) return {};
    Answer verified;
    for (const double tighter : {kTighter, 0.1 * kTighter}) {
      const SimulationSettings tight = with_tolerance(base_, verifier_, rounded(rtol / tighter));
      if (tight.integrator.rtol >= right_rtol) break;
      verified = answer(tight);
      if (verified.ok) {
        result_.verified_by = tight.integrator;
        right_rtol = tight.integrator.rtol;
        right = std::move(verified);
        break;
      }
      if (interrupted()) break;
    }
    return right ? std::nullopt : std::optional(std::move(verified));
  }

  // Within the wanted accuracy, the looser tolerance; else the smaller error.
  bool is_better(const Point& point, const Point& best) const {
    if (point.largest() > result_.wanted) return point.largest() < best.largest();
    return best.largest() > result_.wanted || point.rtol() > best.rtol();
  }

  // The order in which the error falls with the tolerance, between the last two points.
  static double order_between(const std::optional<Point>& last, const Point& point, double error) {
    if (!last || last->rtol() == point.rtol() || !(last->largest() > 0) || error <= AccuracyChoice::kRounding) return 1;
    const double order = std::log(error / last->largest()) / std::log(point.rtol() / last->rtol());
    return std::isfinite(order) ? std::clamp(order, 0.5, 1.5) : 1;
  }

  std::optional<Point> failed(const Answer& answer, std::optional<Point> best) {
    if (!best) result_.message = answer.message;
    return best;
  }

  // The errors of a point against the right answer: of the simulated objectives, or of the motion.
  void judge(Point& point, const Answer& right) const {
    constexpr double kKnown = 10;
    const TradeoffErrors errors(runs_, right, point.answer, kKnown);
    for (const QuantityKind kind : {QuantityKind::objective, options_.without_objectives, QuantityKind::motion}) {
      for (const Quantity& q : errors.quantities())
        if (q.kind == kind)
          point.estimates.push_back({kind == QuantityKind::objective ? q.objective_name : q.name, q.relative,
                                     std::max(q.certificate, AccuracyChoice::kRounding)});
      if (!point.estimates.empty()) return;
    }
  }

  const TradeoffRuns runs_;
  const AccuracyOptions& options_;
  SimulationSettings base_;
  const char *method_ = "", *verifier_ = "";
  bool implicit_ = false;
  std::string stiff_why_;  // why an explicit method will not do; empty: it does
  AccuracyChoice result_;
};

}  // namespace

double AccuracyChoice::largest_error() const { return largest_of(estimates); }

AccuracyChoice choose_accuracy(const Scene& scene, const std::vector<Objective>& objectives,
                               const AccuracyOptions& options) {
  return Chooser(scene, objectives, options).run();
}

std::string accuracy_in_words(double accuracy) {
  for (const Choice<double>& level : kAccuracies)
    if (level.value == accuracy) return fmt::format("{} ({:.0e})", level.word, accuracy);
  return fmt::format("{:.0e}", accuracy);
}

}  // namespace mbsopt::inline optim
