// An observer looks at a run while it goes on. All have one signature, by whatever method the run is integrated. A run
// asks its observers in the order of their list. An objection, in words, ends the run.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/mechanism/state_point.hpp"
#include "core/run/simulation_result.hpp"
#include "core/step/step.hpp"

namespace mbsopt {

struct SeenStep {
  StatePoint from, to;           // its ends
  double worst_residual = 0;     // of the constraints' accelerations so far, relative
  const Step* stages = nullptr;  // of a Runge-Kutta method; null for CVODES
};

class StepObserver {
 public:
  virtual ~StepObserver() = default;
  // Returns an objection to the start, or nothing.
  virtual std::string begin(const StatePoint&) { return {}; }
  // Whether it reads states within a step that ends at t1, which need the stages of dense output.
  virtual bool reads_inside(double /*t1*/) const { return false; }
  // Returns an objection to this step, or nothing.
  virtual std::string look_at(const SeenStep& step) = 0;
  // After the step that ends at an event. The switch is still held on its side before it.
  virtual void cross(const SwitchEvent&, const StatePoint&) {}
};

// The first objection of the observers to the start of a run, or to a step.
inline std::string objection_to_start(const std::vector<StepObserver*>& observers, const StatePoint& start) {
  for (StepObserver* const observer : observers)
    if (std::string words = observer->begin(start); !words.empty()) return words;
  return {};
}
inline std::string objection_to(const SeenStep& step, const std::vector<StepObserver*>& observers) {
  for (StepObserver* const observer : observers)
    if (std::string words = observer->look_at(step); !words.empty()) return words;
  return {};
}

// A function as an observer of accepted steps, and one of events, which may be empty.
template <class Function>
class ObserverOf final : public StepObserver {
 public:
  using Cross = std::function<void(const SwitchEvent&, const StatePoint&)>;
  explicit ObserverOf(Function f, Cross cross = {}) : f_(std::move(f)), cross_(std::move(cross)) {}
  std::string look_at(const SeenStep& step) override { return f_(step); }
  void cross(const SwitchEvent& event, const StatePoint& at) override {
    if (cross_) cross_(event, at);
  }

 private:
  Function f_;
  Cross cross_;
};

}  // namespace mbsopt
