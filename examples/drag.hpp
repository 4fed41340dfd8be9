// Quadratic drag on the rod's centre of mass: F = -drag |v| v. Its derivatives follow by automatic differentiation.
#pragma once

#include <mbsopt/differentiated_force.hpp>

struct Drag final : mbsopt::DifferentiatedForce<Drag> {
  static constexpr int kDrag = 1;            // parameter of pendulum.json  [N s^2/m^2]
  static constexpr double kAtRest = 1e-200;  // sqrt has no derivative at 0  [m^2/s^2]

  std::vector<std::string> bodies() const override { return {"rod"}; }
  template <class T>
  void load(double, const VectorX<T>&, const VectorX<T>& v, const VectorX<T>& rho, VectorX<T>& Q) const {
    const T speed = sqrt(v.template head<3>().squaredNorm() + kAtRest);
    Q.template head<3>() = -rho(kDrag) * speed * v.template head<3>();
  }
};
