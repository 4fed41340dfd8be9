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
class Program;           // core/expression/program.hpp
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
  // The backward sweep starts with these (AdjInit): lambda = d value/dy, mu = d value/drho at the end time.
  virtual void adjoint_init(VecIn y_end, VecIn rho, VecOut lambda, VecOut mu) const = 0;
};

// A scalar of one instant. One call gives its value and its gradient in y and rho. Several threads may call it at once.
struct PointCost {
  virtual ~PointCost() = default;
  virtual double value(const StatePoint& at) const = 0;
  // y_bar += scale d/dy, rho_bar += scale d/drho; returns the value.
  virtual double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const = 0;
  // Whether it reads nothing of the state but positions.
  virtual bool reads_positions() const { return false; }
  // The parameters that the cost is bound to, or null.
  virtual const Eigen::VectorXd* rho() const { return nullptr; }
  // The expression that shows where the value jumps, in all parameters, t and all sensors; null if there is none.
  virtual const SwitchedProgram* program() const { return nullptr; }
  // The same cost of another mechanism of its scene, and with another program of the same inputs, if it is not null.
  // A cost that has neither returns null.
  virtual std::shared_ptr<const PointCost> bound_to(const Mechanism&, const Program*) const { return nullptr; }
};

// The gradient of a cost at one point, times a weight.
struct CostGradient {
  Eigen::VectorXd y, rho;

  // Returns the value of the cost.
  double set(const PointCost& cost, const StatePoint& at, double weight) {
    y.setZero();
    rho.setZero();
    return cost.add_gradient(at, weight, y, rho);
  }
};

struct SampledCost {
  double time;
  std::shared_ptr<const PointCost> cost;
};

// One objective. A null part is absent. The caller adds the terms that depend on parameters alone.
struct Cost {
  std::shared_ptr<const PointCost> running;
  std::shared_ptr<const PointCost> terminal;
  std::vector<SampledCost> samples;
  std::string name = {};    // of the objective, for messages
  bool is_extreme = false;  // running is the exponential of a smooth maximum, which may leave the range of numbers
  double rtol = 0;  // of a solved run's integral, if that is larger than the integrator's: it only shows the peaks
};

// Names the costs that have no finite value.
std::string not_finite_costs(std::span<const Cost> costs, const Eigen::VectorXd& psi);

// Adapters for the costs of a user, at the parameters of the simulated mechanism. `name` appears in messages, such as
// those for exceptions of the cost. Throws std::invalid_argument if the cost is null.
std::shared_ptr<const PointCost> point_cost(std::shared_ptr<const RunningCost> running, const Mechanism& mechanism,
                                            std::string name = "a running cost");
std::shared_ptr<const PointCost> point_cost(std::shared_ptr<const TerminalCost> terminal, const Mechanism& mechanism,
                                            std::string name = "a terminal cost");

}  // namespace mbsopt
