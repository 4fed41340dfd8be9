// A force written in C++ as a mechanism calls it. Its exceptions carry its name. A force that a problem names has its
// own parameters, each a function of the scene's:
//
//   p = p(rho),  constant in a mechanism          Q_rho = Q_p dp/drho,  L_rho = L_p dp/drho
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

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
  void Q(double t, VecIn q, VecIn v, VecIn rho, VecOut Q) const override;
  void K(double t, VecIn q, VecIn v, VecIn rho, MatOut K) const override;
  void C(double t, VecIn q, VecIn v, VecIn rho, MatOut C) const override;
  void Q_rho(double t, VecIn q, VecIn v, VecIn rho, MatOut Q_rho) const override;

  void L(VecIn q, VecIn v, VecIn z, VecIn rho, VecOut L) const override;
  void M(VecIn q, VecIn rho, MatOut M) const override;
  void L_q(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_q) const override;
  void L_v(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_v) const override;
  void L_rho(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_rho) const override;

 private:
  VecIn own(const VecIn& rho) const { return values_ ? VecIn(values_->p) : rho; }
  template <class F>
  void add_in_rho(F&& f, const VecIn& rho, MatOut out) const;  // out += df/dp dp/drho; f(p, df_dp)

  std::shared_ptr<const UserForce> force_;
  std::vector<std::string> bodies_;
  std::optional<TermValues> values_;
  std::string name_;
};

// The bodies on which a force of a problem acts.
std::vector<std::string> bodies_of(const UserForceSpec& force);

}  // namespace mbsopt
