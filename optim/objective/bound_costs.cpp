#include "optim/objective/bound_costs.hpp"

#include <algorithm>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/body/state_layout.hpp"
#include "core/expression/program.hpp"
#include "core/scene/scene_path.hpp"
#include "optim/objective/expression_cost.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Both costs of a term, as functions of the scene's state and parameters.
class BoundCost final : public RunningCost, public TerminalCost {
 public:
  BoundCost(const Scene& scene, const UserCostSpec& spec, const std::string& place)
      : running_(spec.running), terminal_(spec.terminal) {
    const Symbols symbols = parameter_symbols(scene);
    for (const TermParameter& parameter : spec.parameters) {
      try {
        parameters_.emplace_back(parameter.value, symbols);
      } catch (const UnknownName& error) {
        throw std::invalid_argument(child_path(place + ".parameters", parameter.name) + ": " + error.what());
      }
    }
    for (const std::string& name : spec.bodies) {
      const auto body = std::ranges::find(scene.bodies, name, &Body::name);
      if (body == scene.bodies.end()) throw std::invalid_argument(place + ".bodies: there is no body '" + name + "'");
      bodies_.push_back(static_cast<int>(body - scene.bodies.begin()) + 1);
    }
    if (!spec.bodies.empty()) return;
    bodies_.resize(scene.bodies.size() + 1);
    std::iota(bodies_.begin(), bodies_.end(), 0);
  }

  double g(double t, VecIn y, VecIn rho) const override { return running_->g(t, state(y), parameters(rho)); }
  void add_g_y(double t, VecIn y, VecIn rho, double scale, VecOut out) const override {
    const VectorXd part = state(y);
    VectorXd bar = VectorXd::Zero(part.size());
    running_->add_g_y(t, part, parameters(rho), scale, bar);
    add_state(bar, out);
  }
  void add_g_rho(double t, VecIn y, VecIn rho, double scale, VecOut out) const override {
    VectorXd bar = VectorXd::Zero(static_cast<Index>(parameters_.size()));
    running_->add_g_rho(t, state(y), parameters(rho), scale, bar);
    add_rho(rho, bar, out);
  }
  double value(VecIn y, VecIn rho) const override { return terminal_->value(state(y), parameters(rho)); }
  void adjoint_init(VecIn y, VecIn rho, VecOut lambda, VecOut mu) const override {
    const VectorXd part = state(y);
    VectorXd of_state = VectorXd::Zero(part.size()), of_p = VectorXd::Zero(static_cast<Index>(parameters_.size()));
    terminal_->adjoint_init(part, parameters(rho), of_state, of_p);
    lambda.setZero();
    mu.setZero();
    add_state(of_state, lambda);
    add_rho(rho, of_p, mu);
  }

 private:
  VectorXd state(VecIn y) const {
    const StateLayout own{static_cast<int>(bodies_.size()) - 1}, all = StateLayout::of(y);
    VectorXd part(own.size());
    for (std::size_t k = 1; k < bodies_.size(); ++k) {
      part.segment<7>(own.q(k)) = y.segment<7>(all.q(bodies_[k]));
      part.segment<7>(own.v(k)) = y.segment<7>(all.v(bodies_[k]));
    }
    return part;
  }
  void add_state(const VectorXd& part, VecOut out) const {
    const StateLayout own = StateLayout::of(part), all = StateLayout::of(out);
    for (std::size_t k = 1; k < bodies_.size(); ++k) {
      out.segment<7>(all.q(bodies_[k])) += part.segment<7>(own.q(k));
      out.segment<7>(all.v(bodies_[k])) += part.segment<7>(own.v(k));
    }
  }

  VectorXd parameters(VecIn rho) const {
    VectorXd p(static_cast<Index>(parameters_.size()));
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      Program::Scratch scratch = parameters_[i].scratch();
      p(static_cast<Index>(i)) = parameters_[i].value(numbers_of(rho), scratch);
    }
    return p;
  }
  void add_rho(VecIn rho, const VectorXd& p_bar, VecOut out) const {
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      Program::Scratch scratch = parameters_[i].scratch();
      parameters_[i].add_gradient(numbers_of(rho), p_bar(static_cast<Index>(i)), numbers_of(out), scratch);
    }
  }

  std::shared_ptr<const RunningCost> running_;
  std::shared_ptr<const TerminalCost> terminal_;
  std::vector<Program> parameters_;  // of the term, computed from those of the scene
  std::vector<int> bodies_{0};       // of the term, by their numbers in the scene; the ground first
};

}  // namespace

BoundCosts bound_costs(const Scene& scene, const UserCostSpec& spec, const std::string& place) {
  if (!spec.running && !spec.terminal)
    throw std::invalid_argument(place + ".cost: '" + spec.cost +
                                "' is a cost written in C++, which nothing has provided");
  const auto bound = std::make_shared<const BoundCost>(scene, spec, place);
  BoundCosts costs;
  if (spec.running) costs.running = bound;
  if (spec.terminal) costs.terminal = bound;
  return costs;
}

}  // namespace mbsopt::inline optim
