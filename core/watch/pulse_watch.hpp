// Pulses of functions of time that a step passes over. The nodes of the step do not see them, so its error estimate
// does not, either.
//
// A function f of time has a known integral I over a step, and a mean J = int f (t1 - t)/h dt of its integrals so far.
// The step takes sums over its nodes instead, Q = h sum_i b_i f(t + c_i h) and R = h sum_i b_i (1 - c_i) f(t + c_i h).
//   D = max(|I - Q|, |J - R|)   what the step misses: at its end, and in the mean, as of a fast step of a drive
//   E = h |sum_i e_i f_i|       what its nodes notice, by the null rule (quadrature_watch.hpp)
// If D > E, or |I - Q| > 0.02 E of a law, the step may pass over a pulse. Let f differ most from Q/h at t*, and less
// than half as much at t'. The accelerations a at both instants, in one state, give what the velocities miss:
//   D (a(t*) - a(t'))/(f(t*) - f(t'))
// So a rough record costs nothing where nodes notice it, and a pulse below the tolerances costs two evaluations. A
// running cost of time misses D itself. One that reads reactions or accelerations may see a force that moves nothing:
// it misses  D (g(t*) - g(t'))/(f(t*) - f(t')).
//
//   PulseWatch watch(mechanism, settings, costs, pulse_nodes(method));
//   if (watch.worst(t, h, true, y, angles, change).error > PulseWatch::kMissed) // try a shorter step
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/dynamics/motion_solver.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/run/simulation_result.hpp"
#include "core/run/timed_laws.hpp"
#include "core/scene/settings.hpp"
#include "core/watch/quadrature_watch.hpp"

namespace mbsopt {

// A Rosenbrock method looks at its stages, and its running costs at other nodes: b of these, and e of those.
std::vector<QuadratureNode> pulse_nodes(const Method& method);

class PulseWatch {
 public:
  // The costs outlive it.
  PulseWatch(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
             std::vector<QuadratureNode> nodes);

  // The instants at which laws and running costs jump.
  std::vector<double> jumps() const;

  // A step that misses so much [tolerances] is too long: its own estimate errs by less. Steps below a part of the run
  // do not search for pulses.
  static constexpr double kMissed = 10, kShortest = 1e-10;
  // The change of velocity [tolerances] if the accelerations at t* and t' differ for a duration [s].
  using Change = std::function<double(double at, double beside, double duration)>;
  // The pulse that the step from (t, y) misses most, with its error in tolerances; 0: none. Steps begin later than, or
  // where, those before began. noticed: what nodes notice is rejected elsewhere.
  Pulse worst(double t, double h, bool noticed, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
              const Change& change);

 private:
  struct Integrals {
    double f = 0, ft = 0;  // of f and f t
  };
  struct Function {
    Pulse pulse;
    TimedLaw law;  // or samples
    std::shared_ptr<const Curve> curve;
    double delay = 0;
    std::vector<Integrals> until;  // each instant, from the first test on
    std::size_t next = 0;          // the first instant after the step's start
    double largest = 0;            // D so far, where nothing rejects it
    double of_size = 0;            // the integral of |f|

    std::size_t size() const { return curve ? curve->x().size() : law.pieces.size(); }
    double t(std::size_t i) const { return curve ? curve->x()[i] + delay : law.pieces[i]; }
  };
  double value(const Function& f, double t);
  Integrals integrals(const Function& f, double from, double to);  // where f is smooth
  Integrals integrals_to(const Function& f, double t);
  void integrate(Function& f);
  struct Candidate {            // a pulse that a step may pass over
    double at = 0, beside = 0;  // t* and t' [s]
    double duration = 0;        // D/|f(t*) - f(t')|  [s]; 0: there is none
    double share = 0;           // D of the integral of |f| over the run: of a running cost, else 0
  };
  Candidate candidate(Function& f, double t, double h, bool noticed);
  double missed_by_costs(const Candidate& pulse, double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);

  const double rtol_, span_;
  const std::span<const Cost> costs_;
  std::optional<MotionSolver> motion_;  // where a sensor needs it
  const std::vector<QuadratureNode> nodes_;
  std::vector<Function> functions_;
  std::vector<double> inputs_;
  Program::Scratch scratch_;
};

}  // namespace mbsopt
