// A force written in C++ by the user: its generalised force Q on the coordinates of some bodies and all its
// derivatives. No derivative is ever defaulted or differenced.
//
//   struct Drag : UserForce {
//     std::vector<std::string> bodies() const override { return {"crank"}; }
//     void Q(double t, VecIn q, VecIn v, VecIn rho, VecOut Q) const override { Q.head(3) -= rho(0) * v.head(3); }
//     ...
//   };
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace mbsopt {

struct UserForce {
  using VecIn = Eigen::Ref<const Eigen::VectorXd>;
  using VecOut = Eigen::Ref<Eigen::VectorXd>;
  using MatOut = Eigen::Ref<Eigen::MatrixXd>;

  virtual ~UserForce() = default;
  virtual std::vector<std::string> bodies()
      const = 0;  // names in the scene; q, v, Q hold 7 numbers for each, in this order
  // All outputs arrive zeroed. Q is dual to (r_g, p): for a force F at point s, Q = (F, N(p, s)'F).   [N, N m]
  virtual void Q(double t, VecIn q, VecIn v, VecIn rho, VecOut Q) const = 0;
  virtual void K(double t, VecIn q, VecIn v, VecIn rho, MatOut K) const = 0;          // -dQ/dq
  virtual void C(double t, VecIn q, VecIn v, VecIn rho, MatOut C) const = 0;          // -dQ/dv
  virtual void Q_rho(double t, VecIn q, VecIn v, VecIn rho, MatOut Q_rho) const = 0;  // dQ/drho, 7k x P
};

}  // namespace mbsopt
