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
// load() has the arguments of UserForce::Q; T is double or a dual number, and Q arrives zeroed. Functions of numbers
// are called without std:: (sqrt(x), sin(x)). Branches on values are allowed, where the function stays smooth. sqrt and
// norm have no derivative at 0: add a small number inside. Cost: a derivative takes about one load() per 7 coordinates
// of its bodies (K, C) or 7 parameters (Q_rho), each with 8 numbers in place of one.
#pragma once

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
    Q = out;
  }
  void K(double t, VecIn q, VecIn v, VecIn rho, MatOut K) const final {
    const auto of_q = [&, v = constants(v), rho = constants(rho)](const VectorX<Dual>& x, VectorX<Dual>& out) {
      own().load(t, x, v, rho, out);
    };
    add_jacobian(of_q, q, -1, K);
  }
  void C(double t, VecIn q, VecIn v, VecIn rho, MatOut C) const final {
    const auto of_v = [&, q = constants(q), rho = constants(rho)](const VectorX<Dual>& x, VectorX<Dual>& out) {
      own().load(t, q, x, rho, out);
    };
    add_jacobian(of_v, v, -1, C);
  }
  void Q_rho(double t, VecIn q, VecIn v, VecIn rho, MatOut Q_rho) const final {
    const auto of_rho = [&, q = constants(q), v = constants(v)](const VectorX<Dual>& x, VectorX<Dual>& out) {
      own().load(t, q, v, x, out);
    };
    add_jacobian(of_rho, rho, 1, Q_rho);
  }

 private:
  const Force& own() const { return static_cast<const Force&>(*this); }
};

}  // namespace mbsopt
