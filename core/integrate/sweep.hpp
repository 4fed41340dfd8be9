// The tangent-linear and the adjoint sweep share the equations of a step, linearised where it was solved, and the
// gradients of running costs at its nodes.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "core/dynamics/dynamics.hpp"
#include "core/dynamics/motion_solver.hpp"
#include "core/event/impact.hpp"
#include "core/event/switches.hpp"
#include "core/run/cost.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/step/linearised_stages.hpp"
#include "core/step/rosenbrock_stages.hpp"
#include "core/step/step.hpp"
#include "core/watch/quadrature_watch.hpp"

namespace mbsopt {

class Sweep {
 public:
  // Adds the work, and integrals in the derivatives that the steps do not resolve.
  void add_to(SimulationStatistics& statistics) const;

 protected:
  // Without `watched`, nothing looks at the integrals.
  Sweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
        std::span<const Cost> costs, bool watched);
  ~Sweep() = default;

  bool linearise_stage(const Step& step, int i);  // an explicit one; y_ becomes its state
  // Sets g_ to that of a running cost at a node of the step, whose state is y_; false: there is nothing to add.
  bool set_running_gradient(const Step& step, std::size_t objective, int node);
  void end_step(const Step& step) {
    if (watch_) watch_->end_step(step);
  }
  // An event of the run at the state y. With the directions D and the cotangents lambda of y at fixed times,
  //
  //   dt = -(g_y D + g_rho) drho/rate        rate = g_y f- + g_t      g: the switch
  //   D+ = D + (f- - f+) dt                  psi += (G- - G+) dt      G: the integrands of running costs
  //
  // and transposed  kappa = ((f- - f+)'lambda + G- - G+)/rate,  lambda- = lambda - g_y'kappa,  mu -= g_rho'kappa.
  // f and G are those of both sides at the event. Where they agree (a kink) nothing changes.
  struct Event {
    Eigen::VectorXd jump, jump_of_costs;  // f- - f+, G- - G+
    Eigen::VectorXd g_y, g_rho;
    double rate = 0;
  };
  // At an impact, with f-, G- at its state y- and f+, G+ at y+ = y- + w Ln (impact.hpp):
  //
  //   E = D + f- dt,  w' = (a(mu)' - a(-mu)')/(2 mu) along E,  r' = r_y E + r_rho,  c' = c_q E + G w' + c_rho
  //   D+ = E + w'Ln + w Ln' - f+ dt        Ln' = -((1 + e) r' + e'r + c'Ln)/c
  struct Strike {
    Impact impact;
    Eigen::VectorXd f_before, f_after;
    Eigen::VectorXd r_y, r_rho, c_y, c_rho;  // c_y: in (q, w)
    double e = 0;
    int slot_e = -1;
  };
  bool set_strike(Switches& switches, const SwitchEvent& event, const StatePoint& before);  // and event_
  // Sets the rate. Returns whether the switch passes zero, not only touches it. Otherwise a jump has no derivative.
  bool passes(const StatePoint& at, const Eigen::VectorXd& f_before, double of_time, bool jumps);
  // Linearises the accelerations under a force mu along the gap; the force stays.
  bool linearise_pushed(Switches& switches, const SwitchEvent& event, const StatePoint& before, double mu);
  // Sets event_. Returns whether its instant has a derivative. The switch is held on its side after it, or before it
  // for `back`. The instant is that of the first switch that changes there, if this one is not zero but jumps with it.
  bool set_event(Switches& switches, const SwitchEvent& event, std::size_t first, const StatePoint& at, bool back);
  MotionSource* motion() { return motion_ ? &*motion_ : nullptr; }

  const Mechanism mechanism_;
  const Method& rk_;
  std::span<const Cost> costs_;
  Dynamics dynamics_;
  std::unique_ptr<Projector> projector_;
  std::optional<LinearisedStages> implicit_;
  std::optional<RosenbrockStages> rosenbrock_;
  Eigen::VectorXd y_;
  CostGradient g_;
  Event event_;
  Strike strike_;

 private:
  std::optional<MotionSolver> motion_;  // where some sensor needs it
  std::optional<QuadratureWatch> watch_;
  Eigen::VectorXd ydot_;
  std::optional<double> grazing_;  // the first instant of an event without a derivative
};

}  // namespace mbsopt
