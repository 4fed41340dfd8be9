// A force written in C++ by the user: its generalised force Q on the coordinates of some bodies, and all its
// derivatives. The user writes every derivative: none has a default or comes from differences.
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

// The mass that a user adds to one body. It gives 6 numbers, the load L = -(M(q, rho) z + h(q, v, rho)) on the body's
// accelerations z = (rddot, omegadot in body axes).   [N, N m]
struct InertialLoad {
  using VecIn = Eigen::Ref<const Eigen::VectorXd>;
  using VecOut = Eigen::Ref<Eigen::VectorXd>;
  using MatOut = Eigen::Ref<Eigen::MatrixXd>;

  virtual ~InertialLoad() = default;
  // q and v have 7 numbers each. All outputs arrive zeroed.
  virtual void L(VecIn q, VecIn v, VecIn z, VecIn rho, VecOut L) const = 0;
  virtual void M(VecIn q, VecIn rho, MatOut M) const = 0;                            // -dL/dz, symmetric, not negative
  virtual void L_q(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_q) const = 0;      // dL/dq, z fixed, 6 x 7
  virtual void L_v(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_v) const = 0;      // dL/dv, 6 x 7
  virtual void L_rho(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_rho) const = 0;  // dL/drho, z fixed, 6 x P
};

struct UserForce {
  using VecIn = Eigen::Ref<const Eigen::VectorXd>;
  using VecOut = Eigen::Ref<Eigen::VectorXd>;
  using MatOut = Eigen::Ref<Eigen::MatrixXd>;

  // The mass terms beside Q of a force on one body, or null.
  virtual const InertialLoad* inertia() const { return nullptr; }

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
