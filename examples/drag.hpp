// Quadratic drag on the rod's centre of mass: F = -drag |v| v, with its derivatives.
#pragma once

#include <mbsopt/user_force.hpp>

struct Drag final : mbsopt::UserForce {
  static constexpr int kDrag = 1;  // parameter of pendulum.json  [N s^2/m^2]

  std::vector<std::string> bodies() const override { return {"rod"}; }
  void Q(double, VecIn, VecIn v, VecIn rho, VecOut Q) const override {
    Q.head(3) = -rho(kDrag) * v.head(3).norm() * v.head(3);
  }
  void K(double, VecIn, VecIn, VecIn, MatOut) const override {}         // -dQ/dq
  void C(double, VecIn, VecIn v, VecIn rho, MatOut C) const override {  // -dQ/dv
    const double speed = v.head(3).norm();
    if (speed == 0) return;
    C.topLeftCorner(3, 3) = rho(kDrag) * speed * Eigen::Matrix3d::Identity();
    C.topLeftCorner(3, 3) += rho(kDrag) / speed * v.head(3) * v.head(3).transpose();
  }
  void Q_rho(double, VecIn, VecIn v, VecIn, MatOut Q_rho) const override {
    Q_rho.col(kDrag).head(3) = -v.head(3).norm() * v.head(3);
  }
};
