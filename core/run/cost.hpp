// The costs that a simulation is judged by. A value never travels without its derivatives.
//
//   psi(rho) = integral of g(t, y, rho) dt + terminal(y(t_end), rho) + sum of samples(t_k, y(t_k), rho)
//
// Users write RunningCost and TerminalCost (plain state in, plain derivatives out). The integrators see PointCost,
// which also gets the branch of each joint angle, so that an angle is continuous over many turns.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/mechanism/state_point.hpp"

namespace mbsopt {

class Mechanism;         // core/mechanism/mechanism.hpp
struct SwitchedProgram;  // core/expression/program_switches.hpp

// y = (q, v): q has 7 numbers per body (r_g, p), v = qdot the same; y.head(7n) = q, y.tail(7n) = v.
struct RunningCost {
  virtual ~RunningCost() = default;
  virtual double g(double t, VecIn y, VecIn rho) const = 0;
  virtual void add_g_y(double t, VecIn y, VecIn rho, double scale, VecOut out) const = 0;    // out += scale dg/dy
  virtual void add_g_rho(double t, VecIn y, VecIn rho, double scale, VecOut out) const = 0;  // out += scale dg/drho
};

struct TerminalCost {
  virtual ~TerminalCost() = default;
  virtual double value(VecIn y_end, VecIn rho) const = 0;
  // Where the backward sweep starts (AdjInit): lambda = d value/dy, mu = d value/drho at the end time.
  virtual void adjoint_init(VecIn y_end, VecIn rho, VecOut lambda, VecOut mu) const = 0;
};

// A scalar of one instant: value, and its gradient in y and rho in one call. Must be safe to call from several threads.
struct PointCost {
  virtual ~PointCost() = default;
  virtual double value(const StatePoint& at) const = 0;
  // y_bar += scale d/dy, rho_bar += scale d/drho; returns the value.
  virtual double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const = 0;
  // The parameters that it is bound to; null where it is bound to none.
  virtual const Eigen::VectorXd* rho() const { return nullptr; }
  // The expression that its value jumps with, of all parameters, t and all sensors; null where there is none.
  virtual const SwitchedProgram* program() const { return nullptr; }
};

struct SampledCost {
  double time;
  std::shared_ptr<const PointCost> cost;
};

// One objective. An absent part is absent. (What depends on parameters alone is added by the caller.)
struct Cost {
  std::shared_ptr<const PointCost> running;
  std::shared_ptr<const PointCost> terminal;
  std::vector<SampledCost> samples;
  std::string name = {};    // of the objective, for messages
  bool is_extreme = false;  // running is the exponential of a smooth maximum, which may leave the range of numbers
};

// Which of the costs have no finite value, in words.
std::string not_finite_costs(std::span<const Cost> costs, const Eigen::VectorXd& psi);

// Adapters from what a user writes, at the parameters of the mechanism that is simulated. name: for messages, such as
// that of what the cost throws. Throw std::invalid_argument where there is no cost (null).
std::shared_ptr<const PointCost> point_cost(std::shared_ptr<const RunningCost> running, const Mechanism& mechanism,
                                            std::string name = "a running cost");
std::shared_ptr<const PointCost> point_cost(std::shared_ptr<const TerminalCost> terminal, const Mechanism& mechanism,
                                            std::string name = "a terminal cost");

}  // namespace mbsopt
