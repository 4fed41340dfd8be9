// An objective, ready to be evaluated at any rho:
//
//   psi(rho) = integral of running dt + terminal at the end time + sum of samples + parameters_only
//
//   const Objective track(scene, spec);
//   const Mechanism mechanism(scene, rho);
//   const SimulationResult run = simulate(mechanism, scene.simulation, std::vector{track.cost(mechanism)});
//   const double psi = run.psi(0) + track.parameters_only(rho);
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/integrate/cost.hpp"
#include "core/mechanism/mechanism.hpp"
#include "optim/expression_cost.hpp"
#include "optim/problem.hpp"

namespace mbsopt {

class Objective {
 public:
  // Throws std::invalid_argument: "objectives.track.running: unknown name ...".
  Objective(const Scene& scene, const ObjectiveSpec& spec);
  // Written in C++; either part may be absent (null).
  Objective(std::string name, std::shared_ptr<const RunningCost> running, std::shared_ptr<const TerminalCost> terminal);

  const std::string& name() const { return name_; }
  bool needs_simulation() const;
  Cost cost(const Mechanism& mechanism) const;  // all but parameters_only; an absent part stays absent
  double parameters_only(const Eigen::VectorXd& rho) const;
  double add_parameters_only_gradient(const Eigen::VectorXd& rho,
                                      Eigen::Ref<Eigen::VectorXd> rho_bar) const;  // += d/drho

 private:
  struct Sample {
    double time;
    CostExpression value;
  };
  std::string name_;
  std::optional<CostExpression> running_, terminal_;
  std::vector<Sample> samples_;
  std::optional<Program> parameters_only_;
  std::shared_ptr<const RunningCost> user_running_;
  std::shared_ptr<const TerminalCost> user_terminal_;
};

// Those of a problem that are named; all of them where names is empty. Throws std::invalid_argument for unknown names.
std::vector<Objective> objectives_of(const Problem& problem, const std::vector<std::string>& names = {});

}  // namespace mbsopt
