#include "core/run/cost.hpp"

#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "core/force/named_throw.hpp"
#include "core/mechanism/mechanism.hpp"

namespace mbsopt {
namespace {

// A cost of a user at fixed parameters, whose exceptions are named.
template <class User>
class UserCost : public PointCost {
 public:
  UserCost(std::shared_ptr<const User> cost, Eigen::VectorXd rho, std::string name)
      : cost_(std::move(cost)), rho_(std::move(rho)), name_(std::move(name)) {}
  double value(const StatePoint& at) const override {
    return named_throw(name_, [&] {
      if constexpr (std::is_same_v<User, RunningCost>)
        return cost_->g(at.t, at.y, rho_);
      else
        return cost_->value(at.y, rho_);
    });
  }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const override {
    named_throw(name_, [&] {
      if constexpr (std::is_same_v<User, RunningCost>) {
        cost_->add_g_y(at.t, at.y, rho_, scale, y_bar);
        cost_->add_g_rho(at.t, at.y, rho_, scale, rho_bar);
      } else {
        Eigen::VectorXd lambda = Eigen::VectorXd::Zero(at.y.size()), mu = Eigen::VectorXd::Zero(rho_.size());
        cost_->adjoint_init(at.y, rho_, lambda, mu);
        y_bar += scale * lambda;
        rho_bar += scale * mu;
      }
    });
    return value(at);
  }
  const Eigen::VectorXd* rho() const override { return &rho_; }

 private:
  std::shared_ptr<const User> cost_;
  Eigen::VectorXd rho_;
  std::string name_;
};

}  // namespace

std::string not_finite_costs(std::span<const Cost> costs, const Eigen::VectorXd& psi) {
  std::string names;
  for (std::size_t o = 0; o < costs.size(); ++o) {
    if (std::isfinite(psi(static_cast<Eigen::Index>(o))) || costs[o].name.empty()) continue;
    names += (names.empty() ? "objective '" : ", '") + costs[o].name + "'";
  }
  return (names.empty() ? "an objective" : names) + " is not finite (a logarithm, root or division outside its range?)";
}

std::shared_ptr<const PointCost> point_cost(std::shared_ptr<const RunningCost> running, const Mechanism& mechanism,
                                            std::string name) {
  if (!running) throw std::invalid_argument("point_cost: there is no running cost (null)");
  return std::make_shared<UserCost<RunningCost>>(std::move(running), mechanism.rho(), std::move(name));
}
std::shared_ptr<const PointCost> point_cost(std::shared_ptr<const TerminalCost> terminal, const Mechanism& mechanism,
                                            std::string name) {
  if (!terminal) throw std::invalid_argument("point_cost: there is no terminal cost (null)");
  return std::make_shared<UserCost<TerminalCost>>(std::move(terminal), mechanism.rho(), std::move(name));
}

}  // namespace mbsopt
