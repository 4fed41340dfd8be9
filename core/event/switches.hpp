// The switches of a run: functions of the motion, time and parameters at whose zeros laws of forces and drives,
// components of applied forces and running costs change from one branch to another (branches.hpp). Between two such
// events the run has branches that are held. It is smooth then, and its stages never take a branch from beyond.
//
//   Switches switches(mechanism, costs);
//   StepAttempt attempt(switches.mechanism(), ...);       // all parts of the run use this mechanism and these costs
//   if (switches.value(k, at) * switches.side(k) < 0) switches.hold(k, -switches.side(k));
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/expression/branches.hpp"
#include "core/force/force_inputs.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/sensor_function.hpp"
#include "core/run/cost.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

struct LimitData;

class Switches {
 public:
  // If nothing switches, mechanism() and costs() are those given, and so they are if the run does not follow kinks. The
  // costs must outlive it.
  Switches(const Mechanism& mechanism, std::span<const Cost> costs, const SimulationSettings& settings);
  Switches(const Switches&) = delete;  // its sites refer to it
  Switches& operator=(const Switches&) = delete;

  const Mechanism& given() const { return given_; }
  const Mechanism& mechanism() const { return held_; }
  std::span<const Cost> costs() const { return own_costs_.empty() ? given_costs_ : own_costs_; }

  std::size_t count() const { return switches_.size(); }
  std::size_t of_mechanism() const { return of_mechanism_; }  // those before the ones of costs
  bool reads_motion(std::size_t k) const;                     // accelerations or reactions
  bool is_of_time(std::size_t k) const;                       // and of parameters alone
  // Other switches in the function are held, too.
  double value(std::size_t k, const StatePoint& at) const;
  // The same with its gradient: y_bar += scale d/dy, rho_bar += scale d/drho, t_bar += scale d/dt.
  double add_gradient(std::size_t k, const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar,
                      double& t_bar) const;
  // The exponent, below 2, of a power or root whose value begins at the zero of the function, on the side that is held;
  // else infinite.
  double root(std::size_t k) const;
  // A limit is a switch that stays on its positive side. The gap to it, its rate as value(), and a constant force mu
  // along the gradient of the gap.
  bool is_limit(std::size_t k) const { return switches_[k].limit != nullptr; }
  const LimitData& limit(std::size_t k) const { return *switches_[k].limit; }
  double rate(std::size_t k, const StatePoint& at) const;
  double add_rate_gradient(std::size_t k, const StatePoint& at, VecOut y_bar, VecOut rho_bar) const;
  void push(std::size_t k, double mu);
  // The zeros of a switch of time between two instants.
  std::vector<double> zeros(std::size_t k, double start, double end) const;

  // The side of the function, 1 or -1, whose branches are held; 0: each evaluation takes its own.
  int side(std::size_t k) const { return switches_[k].side; }
  std::vector<int> sides() const;
  void hold(std::size_t k, int side);
  void hold_all(std::span<const int> sides);

 private:
  enum class Inputs { sensors, law };
  struct Site {  // a program in the run's own mechanism or costs
    const Program* given;
    std::vector<Branching> branchings;
    std::vector<std::size_t> switches;  // of each
    std::function<void(const Program&)> replace;
  };
  struct Switch {
    Program function;
    Inputs of;
    ForcePlace force;  // of a law
    SensorPtr sensor;
    int side = 0;
    std::vector<std::size_t> sites = {};
    const LimitData* limit = nullptr;
    SensorPtr rate = nullptr;  // of a limit
  };
  void add_programs(const SimulationSettings& settings);
  void add(const Program& program, Inputs of, ForcePlace force, int time, std::function<void(const Program&)> replace);
  void add_decisions();
  std::size_t index_of(Branching& branching, Inputs of, ForcePlace force);
  void rebuild(const Site& site);

  const Mechanism given_;
  std::span<const Cost> given_costs_;
  std::shared_ptr<MechanismData> own_;  // of held_, where there are switches
  Mechanism held_;
  std::vector<Cost> own_costs_;
  std::vector<Switch> switches_;
  std::vector<Site> sites_;
  std::vector<std::shared_ptr<const Program>> decisions_;  // whose sites these are, too
  std::vector<int> sides_;
  std::size_t of_mechanism_ = 0;
};

}  // namespace mbsopt
