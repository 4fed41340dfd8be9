// Finds the instants at which a run passes from one branch to another (switches.hpp), and ends steps there.
//
// A step keeps the branches of its start. If a held switch changes its sign within the step, by the Hermite cubic
// between its ends, the first zero of the cubic is the size to try next. The state at the end of that step is exact for
// its size, so the size converges as by Newton's method, until the switch is zero at the end.
//
// A force that begins as a root of the way (Hertz: d^1.5) has an infinite second derivative at its start. There, errors
// of the state fall as h^(n+2), but those of its derivatives as h^(n+1). So the error of a step counts T/tau times,
// with tau the time since the beginning, or until the end of contact, and T the time in which errors would be as large
// as the state.
//
// A zero at a step's start, as after a given instant, changes the branch there. If a switch that has just changed does
// so again, both branches lead back to the event. Then nothing is held for this switch any more.
#pragma once

#include <optional>
#include <vector>

#include "core/event/switches.hpp"
#include "core/scene/settings.hpp"
#include "core/step/step.hpp"

namespace mbsopt {

class CrossingSearch {
 public:
  CrossingSearch(Switches& switches, const SimulationSettings& settings, MotionSource* motion);

  // Chooses the sides of all switches. Returns a limit that is passed there.
  std::optional<std::size_t> begin(const StatePoint& start);

  struct Verdict {
    std::optional<double> size;         // at which to try the step again
    std::vector<SwitchEvent> at_start;  // changes where the step begins, after which to try it again
    std::optional<std::size_t> rests;   // a limit that is struck again where the step begins
  };
  // The error of a step of size h from t, in tolerances, with that of its derivatives.
  double with_derivatives(double t, double h, double error);
  // Looks at a step that the error allows.
  const Verdict& look_at(const Step& step, double error);
  void forget() { target_ = {}; }  // a step was rejected: its instants are sought anew
  // The step that was looked at last stays, and the next one begins at `next`. Returns the changes between them.
  const std::vector<SwitchEvent>& advance(const Step& step, double next);
  // After changes at a state: a switch that jumps with them to its other side, if there is one.
  std::optional<SwitchEvent> driven(const StatePoint& at);
  void restart(const StatePoint& at);  // the next step begins there, after all changes
  bool ends_at_time() const;           // of a switch of time, at which functions of time need have no value
  void changed(const SwitchEvent& event, double t);  // the switch is held on its new side from t on

 private:
  static constexpr int kPoints = 7;  // in a step, its ends included
  struct Watched {
    double of_positions = 0, of_velocities = 0, of_others = 0;  // see set_sizes()
    double noise = 0;                                           // of the values
    double start = 0;                                           // the value at the step's start
    double changed = -INFINITY;                                 // when it did so last [s]
    double values[kPoints] = {};                                // times the side
  };

  void set_sizes(std::size_t k, const StatePoint& at);
  static void set_noise(Watched& w, const Eigen::VectorXd& y);
  void evaluate(const Step& step);
  double value_at(const Step& step, std::size_t k, double part);
  double zero_between(const Step& step, std::size_t k, double from, double f_from, double to, double f_to);
  std::optional<double> first_zero(const Step& step, std::size_t k);
  std::optional<double> lowest_below(const Step& step, std::size_t k, int point);
  double shortest(const Step& step) const;
  double left(const Step& step, std::size_t k);
  void set_changes(const Step& step, std::size_t of, double near);
  double time_of_state(double h, double error) const;
  bool is_too_long_before_end(const Step& step, std::size_t of, double error);

  Switches& switches_;
  MotionSource* motion_;
  double least_part_;  // of a step, to which an instant is found
  double rtol_;        // 0 with fixed steps
  struct {
    std::size_t of = 0;                             // the switch
    double since = -INFINITY, n = 1, T = 0;         // the beginning of contact, the root's exponent [s]
    double until = -INFINITY, last = 0, error = 0;  // its end, as found by a step that was too long, and its error
  } root_;
  std::vector<Watched> watched_;
  struct {
    double t = -INFINITY;                  // the start of the step that is tried again
    std::size_t k = 0;                     // for a zero of this switch
    double beyond = INFINITY;              // the least size that passes it
    double last_size = 0, last_value = 0;  // of the try before
    int tries = 0;
  } target_;
  Verdict verdict_;
  std::vector<SwitchEvent> changes_;
  Eigen::VectorXd y_, y_bar_, rho_bar_;
};

}  // namespace mbsopt
