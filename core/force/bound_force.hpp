// A force written in C++ as a mechanism calls it. Its exceptions carry its name. A force that a problem names has its
// own parameters, each a function of the scene's:
//
//   p = p(rho),  constant in a mechanism          Q_rho = Q_p dp/drho,  L_rho = L_p dp/drho
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/force/named_throw.hpp"
#include "core/force/user_force.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt {

struct TermValues {
  Eigen::VectorXd p;      // of the term's own parameters
  Eigen::MatrixXd p_rho;  // in all parameters of the scene
};

class BoundForce final : public UserForce, public InertialLoad {
 public:
  using VecIn = UserForce::VecIn;
  using VecOut = UserForce::VecOut;
  using MatOut = UserForce::MatOut;

  // values is absent if the force takes the rho of the scene. name appears in messages.
  BoundForce(std::shared_ptr<const UserForce> force, std::vector<std::string> bodies, std::optional<TermValues> values,
             std::string name)
      : force_(std::move(force)), bodies_(std::move(bodies)), values_(std::move(values)), name_(std::move(name)) {}

  const std::string& name() const { return name_; }
  const InertialLoad* inertia() const override { return force_->inertia() ? this : nullptr; }
  std::vector<std::string> bodies() const override { return bodies_; }
  void Q(double t, VecIn q, VecIn v, VecIn rho, VecOut Q) const override {
    named_throw(name_, [&] { force_->Q(t, q, v, own(rho), Q); });
  }
  void K(double t, VecIn q, VecIn v, VecIn rho, MatOut K) const override {
    named_throw(name_, [&] { force_->K(t, q, v, own(rho), K); });
  }
  void C(double t, VecIn q, VecIn v, VecIn rho, MatOut C) const override {
    named_throw(name_, [&] { force_->C(t, q, v, own(rho), C); });
  }
  void Q_rho(double t, VecIn q, VecIn v, VecIn rho, MatOut Q_rho) const override {
    add_in_rho([&](const VecIn& p, MatOut out) { force_->Q_rho(t, q, v, p, out); }, rho, Q_rho);
  }

  void L(VecIn q, VecIn v, VecIn z, VecIn rho, VecOut L) const override {
    named_throw(name_, [&] { force_->inertia()->L(q, v, z, own(rho), L); });
  }
  void M(VecIn q, VecIn rho, MatOut M) const override {
    named_throw(name_, [&] { force_->inertia()->M(q, own(rho), M); });
  }
  void L_q(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_q) const override {
    named_throw(name_, [&] { force_->inertia()->L_q(q, v, z, own(rho), L_q); });
  }
  void L_v(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_v) const override {
    named_throw(name_, [&] { force_->inertia()->L_v(q, v, z, own(rho), L_v); });
  }
  void L_rho(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_rho) const override {
    add_in_rho([&](const VecIn& p, MatOut out) { force_->inertia()->L_rho(q, v, z, p, out); }, rho, L_rho);
  }

 private:
  VecIn own(const VecIn& rho) const { return values_ ? VecIn(values_->p) : rho; }
  // out += df/dp dp/drho; f(p, df_dp)
  void add_in_rho(auto&& f, const VecIn& rho, MatOut out) const {
    named_throw(name_, [&] {
      if (!values_) return f(rho, out);
      Eigen::MatrixXd of_p = Eigen::MatrixXd::Zero(out.rows(), values_->p.size());
      f(VecIn(values_->p), MatOut(of_p));
      out += of_p * values_->p_rho;
    });
  }

  std::shared_ptr<const UserForce> force_;
  std::vector<std::string> bodies_;
  std::optional<TermValues> values_;
  std::string name_;
};

// The bodies on which a force of a problem acts.
inline std::vector<std::string> bodies_of(const UserForceSpec& force) {
  return force.bodies.empty() && force.term ? force.term->bodies() : force.bodies;
}

}  // namespace mbsopt
