// The constraints' share of MotionBlocks: -(J'lambda)_y in b and -(Phiddot + 2 xi omega Phidot + omega^2 Phi)_y in c.
#pragma once

#include <array>
#include <vector>

#include "core/dynamics/motion_blocks.hpp"

namespace mbsopt {

class ConstraintBlocks {
 public:
  // phi_dot, phi: 2 xi omega and omega^2.
  ConstraintBlocks(const MechanismData& data, const MotionBlocks& blocks, double phi_dot, double phi);

  // Whether add() reads the tangents of unit directions; some primitives know short cuts.
  bool needs_units() const { return needs_units_; }
  // bodies, frames, units: the ground first.
  void add(const std::vector<BodyState>& bodies, const std::vector<Frame>& frames,
           const std::vector<UnitTangents>& units, const Eigen::VectorXd& lambda, MotionBlocks& out) const;

 private:
  // Indices of a constraint's blocks: of body i's equations by body j, of each row by each body; -1: the ground.
  struct Places {
    int pair[2][2] = {{-1, -1}, {-1, -1}};
    std::array<int, 3> row[2] = {{-1, -1, -1}, {-1, -1, -1}};
  };
  template <class P>
  void add_by_units(const Constraint& c, const P& p, const Places& at, const std::vector<Frame>& frames,
                    const std::vector<UnitTangents>& units, const Eigen::VectorXd& lambda, MotionBlocks& out) const;
  bool short_cut(const Constraint& c) const;

  const MechanismData* data_;
  double phi_dot_, phi_;
  std::vector<Places> places_;  // per constraint
  bool needs_units_ = false;
};

}  // namespace mbsopt
