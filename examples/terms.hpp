// A force, a cost and a law for scenes in files, each called by its name. Their derivatives follow by automatic
// differentiation; rho of a term is its own parameters.
#pragma once

#include <cmath>
#include <mbsopt/differentiated_cost.hpp>
#include <mbsopt/differentiated_force.hpp>
#include <mbsopt/named_terms.hpp>

struct Drag final : mbsopt::DifferentiatedForce<Drag> {  // F = -c |v| v at the centre of mass
  static constexpr double kAtRest = 1e-200;              // sqrt has no derivative at 0  [m^2/s^2]

  std::vector<std::string> bodies() const override { return {"rod"}; }
  template <class T>
  void load(double, const VectorX<T>&, const VectorX<T>& v, const VectorX<T>& rho, VectorX<T>& Q) const {
    const T speed = sqrt(v.template head<3>().squaredNorm() + kAtRest);
    Q.template head<3>() = -rho(0) * speed * v.template head<3>();
  }
};

struct Spread final : mbsopt::DifferentiatedRunningCost<Spread> {  // (x - x0)^2 of the first body
  template <class T>
  T integrand(double, const VectorX<T>& y, const VectorX<T>& rho) const {
    return (y(0) - rho(0)) * (y(0) - rho(0));
  }
};

// A smooth step from 0 to 1 around x = 0, and its derivatives: (1 + tanh x)/2.
inline double rise(double x, int order) {
  const double u = std::tanh(x), d = 1 - u * u;
  const double derivatives[] = {(1 + u) / 2, d / 2, -u * d, d * (3 * u * u - 1)};
  return derivatives[order];
}

inline void add_terms(mbsopt::NamedTerms& terms) {
  terms.add_force("drag", {"c"}, std::make_shared<Drag>());
  terms.add_cost("spread", {"x0"}, std::make_shared<Spread>());
  terms.add_law("rise", rise);
}
