// A user's force written once: its derivatives K, C and Q_rho follow from its Q by automatic differentiation.
//
//   struct Drag final : DifferentiatedForce<Drag> {
//     std::vector<std::string> bodies() const override { return {"crank"}; }
//     template <class T>
//     void load(double, const VectorX<T>&, const VectorX<T>& v, const VectorX<T>& rho, VectorX<T>& Q) const {
//       Q.template head<3>() = -rho(1) * v.template head<3>().squaredNorm() * v.template head<3>();
//     }
//   };
//
// load() has the arguments of UserForce::Q. T is double or a dual number, and Q arrives zeroed. Call functions of
// numbers without std:: (sqrt(x), sin(x)). Branches on values are allowed where the function stays smooth. sqrt and
// norm have no derivative at 0: add a small number inside. A derivative costs about one load() per kLanes
// coordinates of its bodies (K, C) or parameters (Q_rho), each with kLanes + 1 numbers in place of one.
#pragma once

#include <stdexcept>

#include "core/force/user_force.hpp"
#include "core/linear/dual_numbers.hpp"

namespace mbsopt {

template <class Force>
struct DifferentiatedForce : UserForce {
  template <class T>
  using VectorX = Eigen::VectorX<T>;

  void Q(double t, VecIn q, VecIn v, VecIn rho, VecOut Q) const final {
    VectorX<double> out = Q;
    own().load(t, VectorX<double>(q), VectorX<double>(v), VectorX<double>(rho), out);
    if (out.size() != Q.size()) throw std::length_error("load() has changed the size of its result");
    Q = out;
  }
  void K(double t, VecIn q, VecIn v, VecIn rho, MatOut K) const final {
    add_partial_jacobian<0>(load_at(t), -1, K, q, v, rho);
  }
  void C(double t, VecIn q, VecIn v, VecIn rho, MatOut C) const final {
    add_partial_jacobian<1>(load_at(t), -1, C, q, v, rho);
  }
  void Q_rho(double t, VecIn q, VecIn v, VecIn rho, MatOut Q_rho) const final {
    add_partial_jacobian<2>(load_at(t), 1, Q_rho, q, v, rho);
  }

 private:
  const Force& own() const { return static_cast<const Force&>(*this); }
  auto load_at(double t) const {
    return [this, t](const auto& q, const auto& v, const auto& rho, auto& out) { own().load(t, q, v, rho, out); };
  }
};

// The mass that a user adds to one body, written once: M, L_q, L_v and L_rho follow from its L.
//
//   struct AddedMass final : DifferentiatedInertia<AddedMass> {  // of a sphere: rho_0 on the centre of mass
//     std::vector<std::string> bodies() const override { return {"ball"}; }
//     template <class T>
//     void load(const VectorX<T>&, const VectorX<T>&, const VectorX<T>& z, const VectorX<T>& rho, VectorX<T>& L) const
//     {
//       L.template head<3>() = -rho(0) * z.template head<3>();
//     }
//   };
//
// load() has the arguments of InertialLoad::L, and must be affine in z.
template <class Load>
struct DifferentiatedInertia : UserForce, InertialLoad {
  template <class T>
  using VectorX = Eigen::VectorX<T>;
  using VecIn = UserForce::VecIn;
  using VecOut = UserForce::VecOut;
  using MatOut = UserForce::MatOut;

  const InertialLoad* inertia() const final { return this; }
  void Q(double, VecIn, VecIn, VecIn, VecOut) const final {}
  void K(double, VecIn, VecIn, VecIn, MatOut) const final {}
  void C(double, VecIn, VecIn, VecIn, MatOut) const final {}
  void Q_rho(double, VecIn, VecIn, VecIn, MatOut) const final {}

  void L(VecIn q, VecIn v, VecIn z, VecIn rho, VecOut L) const final {
    VectorX<double> out = L;
    own().load(VectorX<double>(q), VectorX<double>(v), VectorX<double>(z), VectorX<double>(rho), out);
    if (out.size() != L.size()) throw std::length_error("load() has changed the size of its result");
    L = out;
  }
  void M(VecIn q, VecIn rho, MatOut M) const final {
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(7);  // M is the same at any v and z
    add_partial_jacobian<2>(load_of_all(), -1, M, q, none, none.head(6), rho);
  }
  void L_q(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_q) const final {
    add_partial_jacobian<0>(load_of_all(), 1, L_q, q, v, z, rho);
  }
  void L_v(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_v) const final {
    add_partial_jacobian<1>(load_of_all(), 1, L_v, q, v, z, rho);
  }
  void L_rho(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_rho) const final {
    add_partial_jacobian<3>(load_of_all(), 1, L_rho, q, v, z, rho);
  }

 private:
  const Load& own() const { return static_cast<const Load&>(*this); }
  auto load_of_all() const {
    return [this](const auto& q, const auto& v, const auto& z, const auto& rho, auto& out) {
      own().load(q, v, z, rho, out);
    };
  }
};

}  // namespace mbsopt
