// The parts of a state that a force reads beside the frames of its bodies, and the gradient in the force's fields.
#pragma once

#include <cstddef>
#include <vector>

#include "core/force/law.hpp"

namespace mbsopt {

// The value that selects the turn of a joint's angle; 0 if no angle is followed.
inline double branch(const Eigen::VectorXd& angles, int angle) {
  return angle >= 0 && angle < angles.size() ? angles(angle) : 0.0;
}

// A force: its kind in the list `Forces` (forces.hpp), its index among those of this kind.
struct ForcePlace {
  std::size_t kind = 0, index = 0;
  bool operator==(const ForcePlace&) const = default;
};

struct ForceInputs {
  double t;
  const Eigen::VectorXd& rho;     // all parameters
  const Eigen::VectorXd& angles;  // branch of each followed joint angle
  Law::Scratch& scratch;
};

// The gradient in all fields, to which rows of a field are added.
struct ThetaGradient {
  Eigen::VectorXd& theta_bar;

  template <int N>
  void add(int slot, const Vec<N>& bar) {
    if (slot >= 0) theta_bar.segment<N>(slot) += bar;
  }
};

// The same in the parameters, through the fields.
struct FieldGradient {
  const Eigen::MatrixXd& theta_rho;  // of all fields in the active parameters
  const std::vector<int>& active;
  double scale;
  Eigen::Ref<Eigen::VectorXd> rho_bar;  // all parameters

  // rho_bar += scale (d field/d rho)' bar
  template <int N>
  void add(int slot, const Vec<N>& bar) {
    if (slot < 0) return;
    for (std::size_t k = 0; k < active.size(); ++k) {
      rho_bar(active[k]) += scale * theta_rho.col(static_cast<Eigen::Index>(k)).template segment<N>(slot).dot(bar);
    }
  }
};

}  // namespace mbsopt
