// The largest or least values of expressions over a run, with the local ones beside them.
//
// A watch looks into each step: at eight instants of an integrated one, at the nodes of a solved one, and at further
// times on request. Where three neighbours enclose a top, Brent's method finds it ("Algorithms for
// Minimization without Derivatives", 1973, chapter 5), unless it cannot be one of the most extreme.
//
//   PeakWatch watch({{1, force}}, settings);
//   simulate(mechanism, settings, costs, watch.sampling());
//   watch.peaks()[0].front().value        // the largest force
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt::inline optim {

struct Watched {
  int side = 1;  // -1: its least values
  std::shared_ptr<const PointCost> x;
};

struct Peak {
  double t = 0, value = 0;
  // Of a peak at a kink: the distance of instants that are on one side of it [s], 0 elsewhere. Where x rises by a per
  // second before it and falls by b behind it, these branches meet at a value with the derivative
  //   (b x_rho(t - apart) + a x_rho(t + apart))/(a + b),    behind = a/(a + b)
  double apart = 0, behind = 0;
};

// At most this many of one expression: those of the most extreme values.
inline constexpr std::size_t kMostPeaks = 8;

class PeakWatch {
 public:
  // further: ascending times at which it also looks
  PeakWatch(std::vector<Watched> watched, const SimulationSettings& settings, std::vector<double> further = {});

  // Returns what the run to watch is given. The watch begins anew, and must outlive the run.
  Sampling sampling();
  // After the run: per expression at least one peak, the most extreme one first.
  std::vector<std::vector<Peak>> peaks() const;

 private:
  struct Curve {
    Watched of;
    std::vector<Peak> points = {};  // finite values of side * x in the present step
    std::vector<Peak> best = {};    // of side * x, the highest first
    Peak last{0, -INFINITY};        // point so far; none was finite
    bool rose = true;               // to it: it is a top if the value falls from there
    double slope = 0;               // with which it rose, where that is no smooth top
    double value(const StatePoint& at) const { return of.side * of.x->value(at); }
    void add(const Peak& peak);
  };
  void look(const StepInside& step);
  void set_times(const StepInside& step);
  static void find_tops(Curve& curve, const StepInside& step);
  static void refine(Curve& curve, const Peak& left, const Peak& top, const Peak& right, const StepInside& step);
  static Peak at_kink(const Curve& curve, Peak top, double d, const StepInside& step);
  static double fall(const Curve& curve, const Peak& top, const Peak& beside, const StepInside& step);

  std::vector<Curve> curves_;
  const std::vector<double> further_;
  const double max_step_;
  std::size_t next_ = 0;       // of the further times
  std::vector<double> times_;  // in the present step
};

// The same of a run on given steps, also at the times of the rows of its trajectory, so that no row exceeds an extreme.
// Nothing if it fails, or if progress, called after steps as in RunOptions, stops it.
std::vector<std::vector<Peak>> peaks(const std::vector<Watched>& watched, const Mechanism& mechanism,
                                     const SimulationSettings& settings, const StepSequence& steps,
                                     const std::function<bool(double t)>& progress = {});

}  // namespace mbsopt::inline optim
