// A run of a mechanism whose drives leave no freedom. It solves positions and velocities at the instants that costs and
// observers request (core/start/driven_path.hpp). It integrates only the running costs.
//
//   integral of g dt    sum over panels of Gauss-Kronrod's 15 nodes (kronrod.hpp), panels halved until
//                       error <= rtol integral of |g| + atol h       over the panel, or a part of it over the run
//
// Two nodes of a panel may enclose a narrow peak that neither formula sees. So g is also evaluated between nodes that
// are more than max_step or a 75th of the run apart, on Hermite's cubic, and compared with the polynomial through
// the nodes. Panels resolve what changes with time alone in any case (timed_instants.hpp). A panel that is refused ends
// next at the first kink between its nodes, so that few panels resolve it, and derivatives have one branch in each.
//
// The panels are the steps of the result: given again (RunOptions::frozen), they make psi a smooth function of rho.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/driven/cost_switches.hpp"
#include "core/driven/kronrod.hpp"
#include "core/dynamics/motion_solver.hpp"
#include "core/run/cost.hpp"
#include "core/run/sample_schedule.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/start/assembly.hpp"
#include "core/start/driven_path.hpp"
#include "core/start/law_jumps.hpp"
#include "core/step/event_times.hpp"
#include "core/watch/jump_watch.hpp"

namespace mbsopt {

// A term of a run at one instant: a cost times its weight, or an observation, whose cost is null.
struct DrivenTerm {
  const PointCost* cost = nullptr;
  Eigen::Index objective = 0;
  double weight = 1;
  std::size_t observation = 0;
  bool counts = false;  // its value is a part of psi; those of a panel are in its integrals
};

class DrivenRun {
 public:
  // The run calls this at the instants in ascending order. It returns false if the derivatives failed there.
  using Take = std::function<bool(const StatePoint&, std::span<const DrivenTerm>)>;

  // `motion` gives the accelerations; null: the equations of motion, if a sensor needs them.
  DrivenRun(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
            std::span<const double> observed, const RunOptions& options, const Assembly& start, bool differentiated,
            MotionSource* motion = nullptr);

  // Computes psi of the result, and calls take at every instant. In runs with derivatives, take counts the values.
  // look_inside of Sampling sees each panel.
  void go(const Take& take, const std::function<void(const StepInside&)>& look_inside = {});
  SimulationResult& result() { return result_; }
  // Adds the value of a term that counts; it is NaN if it has no limit at a singular position.
  void count(const DrivenTerm& term, double value, double t);
  SimulationResult finish();
  StatePoint point() { return point_of(path_.state()); }
  Projector& projector() { return path_.projector(); }
  const SingularWindow* window_at(double t) const { return path_.window_at(t); }
  const std::vector<SingularWindow>& windows() const { return path_.windows(); }
  ContinuedMotion* continued() { return continued_ ? &*continued_ : nullptr; }  // null if no sensor needs it
  // The entry of the statistics for the window that contains t.
  SingularPosition& singular_at(double t);

 private:
  enum class Panel { accepted, refused, stuck };
  struct Integral {  // of a running cost
    const Cost* of;
    Eigen::Index objective;
    std::array<double, kNodes> g{};                          // at the nodes of the panel
    PanelIntegral panel{};                                   // over it
    double absolute = 0, error = 0, worst = 0, worst_t = 0;  // of |g| so far; of its panels, the largest, and when
  };
  void go_through_panels(const Take& take, const std::function<void(const StepInside&)>& look_inside);
  void show_panel(const std::function<void(const StepInside&)>& look_inside);
  bool is_too_fast();
  double next_end();
  void try_shorter(Panel outcome, double t1);
  double first_kink();
  Panel try_panel(double t1);
  double allowed_error(const Integral& integral, double h) const;
  bool hides_a_peak(double h);
  double largest_panel() const;
  bool take_panel(double t1, const Take& take);
  void add_quadrature_errors();
  bool take_events_until(double t, std::span<const SampleEvent>& events, const Take& take);
  bool take_here(std::span<const DrivenTerm> terms, const Take& take);  // at the state of the path
  bool take_terminal_costs(const Take& take);
  void end_panel(double t0, double t1);
  void stop_at_singular_matrix();
  bool go_to(double t);
  void stop_where_it_ends();  // with the reason why the path cannot continue
  StatePoint point_of(const DrivenState& s) { return {s.t, s.y, s.angles, continued()}; }
  double noted(Eigen::Index objective, double value, double t);  // the value, after a note if it is left out
  void note_uncertain();
  bool is_left_out(double g, double t) const { return std::isnan(g) && window_at(t); }

  const Mechanism mechanism_;
  const SimulationSettings& settings_;
  std::span<const Cost> costs_;
  const RunOptions& options_;
  const StepSequence* const frozen_;  // the panels to take, or null
  DrivenPath path_;
  std::optional<MotionSolver> motion_;  // set if a sensor needs it
  std::optional<ContinuedMotion> continued_;
  SampleSchedule schedule_;
  LawJumps law_jumps_;
  const bool differentiated_;
  EventTimes events_;               // those of the file, and jumps of functions of time
  std::optional<JumpWatch> jumps_;  // of runs with derivatives
  const double shortest_;           // step or panel [s]
  double h_;                        // of the next panel [s]
  double ended_at_ = -INFINITY;     // the time at which a panel was stuck last
  CostSwitches switches_;
  double kink_ = -INFINITY;  // of a running cost: no panel passes it
  std::vector<Integral> running_;
  std::vector<DrivenTerm> at_instant_;
  std::vector<DrivenState> nodes_;  // of the panel; none without running costs
  Eigen::VectorXd y_;               // between two nodes
  std::vector<double> instants_;    // at which functions of time change
  DrivenState from_;                // the start of the panel
  SimulationResult result_;
};

}  // namespace mbsopt
