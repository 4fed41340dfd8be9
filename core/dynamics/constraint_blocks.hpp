// The constraints' share of MotionBlocks: -(J'lambda)_y in b and -(Phiddot + 2 xi omega Phidot + omega^2 Phi)_y in c.
#pragma once

#include <array>
#include <vector>

#include "core/dynamics/motion_blocks.hpp"

namespace mbsopt {

class ConstraintBlocks {
 public:
  ConstraintBlocks(const MechanismData& data, const MotionBlocks& blocks, double two_xi_omega, double omega2);

  // Marks the bodies whose unit tangents add() reads. Some primitives have short cuts and read none.
  void mark_units(std::vector<bool>& bodies) const;
  // frames and units begin with the ground.
  void add(const std::vector<Frame>& frames, const std::vector<UnitTangents>& units, const Eigen::VectorXd& lambda,
           MotionBlocks& out) const;

 private:
  // Indices of a constraint's blocks: those of body i's equations by body j, and those of each row by each body. -1
  // stands for the ground.
  struct Places {
    int pair[2][2] = {{-1, -1}, {-1, -1}};
    std::array<int, 3> row[2] = {{-1, -1, -1}, {-1, -1, -1}};
  };
  template <class P>
  void add_by_units(const Constraint& c, const P& p, const Places& place, const std::vector<Frame>& frames,
                    const std::vector<UnitTangents>& units, const Eigen::VectorXd& lambda, MotionBlocks& out) const;
  bool short_cut(const Constraint& c) const;

  const MechanismData* data_;
  double two_xi_omega_, omega2_;
  bool stabilised_;
  std::vector<Places> places_;  // per constraint
};

}  // namespace mbsopt
