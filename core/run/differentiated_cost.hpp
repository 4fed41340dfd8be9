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

// out += scale df/dx of argument number `Of` of a number f(y, rho).
template <std::size_t Of, class Function>
void add_gradient(Function&& f, double scale, VecOut out, const VecIn& y, const VecIn& rho) {
  Eigen::MatrixXd row = Eigen::MatrixXd::Zero(1, out.size());
  const auto as_vector = [&](const auto& at_y, const auto& at_rho, auto& value) { value(0) = f(at_y, at_rho); };
  add_partial_jacobian<Of>(as_vector, scale, row, y, rho);
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
    add_gradient<0>(integrand_at(t), scale, out, y, rho);
  }
  void add_g_rho(double t, VecIn y, VecIn rho, double scale, VecOut out) const final {
    add_gradient<1>(integrand_at(t), scale, out, y, rho);
  }

 private:
  const Cost& own() const { return static_cast<const Cost&>(*this); }
  auto integrand_at(double t) const {
    return [this, t](const auto& y, const auto& rho) -> Dual { return own().integrand(t, y, rho); };
  }
};

template <class Cost>
struct DifferentiatedTerminalCost : TerminalCost {
  template <class T>
  using VectorX = Eigen::VectorX<T>;

  double value(VecIn y, VecIn rho) const final { return own().at_end(VectorX<double>(y), VectorX<double>(rho)); }
  void adjoint_init(VecIn y, VecIn rho, VecOut lambda, VecOut mu) const final {
    const auto end = [this](const auto& at_y, const auto& at_rho) -> Dual { return own().at_end(at_y, at_rho); };
    lambda.setZero();
    add_gradient<0>(end, 1, lambda, y, rho);
    mu.setZero();
    add_gradient<1>(end, 1, mu, y, rho);
  }

 private:
  const Cost& own() const { return static_cast<const Cost&>(*this); }
};

}  // namespace mbsopt
