// Costs of a user written once: their gradients in y and rho follow by automatic differentiation.
//
//   struct Effort final : DifferentiatedRunningCost<Effort> {
//     template <class T>
//     T integrand(double t, const VectorX<T>& y, const VectorX<T>& rho) const { return rho(0) * y(7) * y(7); }
//   };
//   struct Miss final : DifferentiatedTerminalCost<Miss> {
//     template <class T>
//     T at_end(const VectorX<T>& y, const VectorX<T>&) const { return (y(0) - 1.) * (y(0) - 1.); }
//   };
//
// core/force/differentiated_force.hpp lists the types T and how each function is called. A gradient takes one
// evaluation with dual numbers per kLanes entries of y or rho.
#pragma once

#include "core/linear/dual_numbers.hpp"
#include "core/run/cost.hpp"

namespace mbsopt {

// out += scale d f(x)/dx for a number f(x).
template <class Function>
void add_gradient(Function&& f, const Eigen::Ref<const Eigen::VectorXd>& x, double scale,
                  Eigen::Ref<Eigen::VectorXd> out) {
  Eigen::MatrixXd row = Eigen::MatrixXd::Zero(1, x.size());
  const auto as_vector = [&](const Eigen::VectorX<Dual>& at, Eigen::VectorX<Dual>& value) { value(0) = f(at); };
  add_jacobian(as_vector, x, scale, row);
  out += row.transpose();
}

template <class Cost>
struct DifferentiatedRunningCost : RunningCost {
  template <class T>
  using VectorX = Eigen::VectorX<T>;

  double g(double t, VecIn y, VecIn rho) const final {
    return own().integrand(t, VectorX<double>(y), VectorX<double>(rho));
  }
  void add_g_y(double t, VecIn y, VecIn rho, double scale, VecOut out) const final {
    const auto of_y = [&, rho = constants(rho)](const VectorX<Dual>& x) -> Dual { return own().integrand(t, x, rho); };
    add_gradient(of_y, y, scale, out);
  }
  void add_g_rho(double t, VecIn y, VecIn rho, double scale, VecOut out) const final {
    const auto of_rho = [&, y = constants(y)](const VectorX<Dual>& x) -> Dual { return own().integrand(t, y, x); };
    add_gradient(of_rho, rho, scale, out);
  }

 private:
  const Cost& own() const { return static_cast<const Cost&>(*this); }
};

template <class Cost>
struct DifferentiatedTerminalCost : TerminalCost {
  template <class T>
  using VectorX = Eigen::VectorX<T>;

  double value(VecIn y, VecIn rho) const final { return own().at_end(VectorX<double>(y), VectorX<double>(rho)); }
  void adjoint_init(VecIn y, VecIn rho, VecOut lambda, VecOut mu) const final {
    lambda.setZero(), mu.setZero();
    const auto of_y = [&, rho = constants(rho)](const VectorX<Dual>& x) -> Dual { return own().at_end(x, rho); };
    add_gradient(of_y, y, 1, lambda);
    const auto of_rho = [&, y = constants(y)](const VectorX<Dual>& x) -> Dual { return own().at_end(y, x); };
    add_gradient(of_rho, rho, 1, mu);
  }

 private:
  const Cost& own() const { return static_cast<const Cost&>(*this); }
};

}  // namespace mbsopt
