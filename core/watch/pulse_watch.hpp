// Pulses of functions of time that a step passes over. The nodes of the step do not see them, so its error estimate
// does not, either.
//
// A function f of time has a known integral I over a step. The step takes Q = h sum_i b_i f(t + c_i h) instead.
//   D = |I - Q|             what the step misses
//   E = h |sum_i e_i f_i|   what its nodes notice, by the null rule (quadrature_watch.hpp)
// If D > E, or 0.02 E of a law, the step is in doubt. Let f differ most from Q/h at t*, and less than half as much at
// t'. The accelerations a at both instants, in one state, say how much the velocities miss:  D (a(t*) - a(t'))/(f(t*) -
// f(t')). So a rough record costs nothing where nodes notice it, and a pulse below the tolerances costs two
// evaluations.
//
//   PulseWatch watch(mechanism, start, end, pulse_nodes(method));
//   for (const PulseWatch::Doubt& doubt : watch.doubts(t, h)) ...
#pragma once

#include <memory>
#include <vector>

#include "core/expression/program.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/run/simulation_result.hpp"
#include "core/watch/quadrature_watch.hpp"

namespace mbsopt {

// A Rosenbrock method looks at its stages, and its running costs at other nodes: b of these, and e of those.
std::vector<QuadratureNode> pulse_nodes(const Method& method);

class PulseWatch {
 public:
  PulseWatch(const Mechanism& mechanism, double start, double end, std::vector<QuadratureNode> nodes);

  struct Doubt {
    Pulse pulse;        // without its error
    double at, beside;  // t* and t' [s]
    double duration;    // D/|f(t*) - f(t')|  [s]
  };
  // The functions in doubt over a step. Steps begin later than, or where, those before began. noticed: what nodes
  // notice is rejected elsewhere. The result holds until the next call.
  const std::vector<Doubt>& doubts(double t, double h, bool noticed = true);

 private:
  struct Function {
    Pulse pulse;
    Program part;  // of a law of time, whose input `time` is t; or samples
    int time = 0;
    std::shared_ptr<const Curve> curve;
    double delay = 0;
    std::vector<double> pieces;    // of a law: f is smooth between these instants
    std::vector<double> integral;  // up to each instant, from the first doubt on
    std::size_t next = 0;          // the first instant after the step's start
    double largest = 0;            // D of a doubt, where nothing rejects it

    std::size_t size() const { return curve ? curve->x().size() : pieces.size(); }
    double t(std::size_t i) const { return curve ? curve->x()[i] + delay : pieces[i]; }
  };
  void add_parts(const Program& program, int time, int force, double start, double end);
  double value(const Function& f, double t);
  double integral(const Function& f, double from, double to);  // where f is smooth
  double integral_to(const Function& f, double t);
  void integrate(Function& f);
  void look_at(Function& f, double t, double h, bool noticed);

  const std::vector<QuadratureNode> nodes_;
  std::vector<Function> functions_;
  std::vector<double> inputs_;  // all parameters, the motion as 0, t
  int parameters_;
  Program::Scratch scratch_;
  std::vector<Doubt> doubts_;
};

}  // namespace mbsopt
