// Forces, costs and laws written in C++ that problem files call by name. They come from a plug-in (plugin.hpp), or from
// a user's program (program.hpp).
//
//   NamedTerms terms;
//   terms.add_force("drag", {"c"}, std::make_shared<Drag>());
//   terms.add_cost("effort", {}, std::make_shared<Effort>());
//   terms.add_law("cam", [](double x, int order) { ... });
//
// In the file: "forces": [{"name": "d", "type": "user", "force": "drag", "bodies": ["rod"], "parameters": {"c":
// "c0"}}], "objectives": {"e": {"user": {"cost": "effort"}}}, and "law": {"user": "cam"} of a drive.
//
// rho of a term holds its own parameters, in the order of the names given here. One object may serve several forces and
// objectives, from several threads. This header needs no library: a plug-in is compiled with headers alone.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/force/user_force.hpp"
#include "core/run/cost.hpp"

namespace mbsopt::inline optim {

struct NamedForce {
  std::string name;
  std::vector<std::string> parameters;
  std::shared_ptr<const UserForce> force;
};
struct NamedCost {
  std::string name;
  std::vector<std::string> parameters;
  std::shared_ptr<const RunningCost> running;    // may be absent (null)
  std::shared_ptr<const TerminalCost> terminal;  // may be absent (null)
};
// The value (order 0) and derivatives at x of a smooth function. curve.hpp lists the required orders.
struct NamedLaw {
  std::string name;
  std::function<double(double x, int order)> f;
};

class NamedTerms {
 public:
  // Throw std::invalid_argument for a null term, and for an empty or taken name.
  void add_force(std::string name, std::vector<std::string> parameters, std::shared_ptr<const UserForce> force) {
    require(forces_, "force", name, force != nullptr);
    forces_.push_back({std::move(name), std::move(parameters), std::move(force)});
  }
  void add_cost(std::string name, std::vector<std::string> parameters, std::shared_ptr<const RunningCost> running,
                std::shared_ptr<const TerminalCost> terminal = nullptr) {
    require(costs_, "cost", name, running || terminal);
    costs_.push_back({std::move(name), std::move(parameters), std::move(running), std::move(terminal)});
  }
  void add_cost(std::string name, std::vector<std::string> parameters, std::shared_ptr<const TerminalCost> terminal) {
    add_cost(std::move(name), std::move(parameters), nullptr, std::move(terminal));
  }
  void add_law(std::string name, std::function<double(double x, int order)> f) {
    require(laws_, "law", name, f != nullptr);
    laws_.push_back({std::move(name), std::move(f)});
  }

  const std::vector<NamedForce>& forces() const { return forces_; }
  const std::vector<NamedCost>& costs() const { return costs_; }
  const std::vector<NamedLaw>& laws() const { return laws_; }
  bool empty() const { return forces_.empty() && costs_.empty() && laws_.empty(); }

 private:
  static void require(const auto& terms, const char* what, const std::string& name, bool is_there) {
    const std::string term = std::string(what) + " '" + name + "'";
    if (name.empty()) throw std::invalid_argument(std::string("a ") + what + " has no name");
    if (!is_there) throw std::invalid_argument(term + ": there is none (null)");
    for (const auto& other : terms)
      if (other.name == name) throw std::invalid_argument(term + ": the name is taken");
  }

  std::vector<NamedForce> forces_;
  std::vector<NamedCost> costs_;
  std::vector<NamedLaw> laws_;
};

}  // namespace mbsopt::inline optim
