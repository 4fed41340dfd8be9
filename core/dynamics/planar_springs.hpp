// The springs (tsda.hpp) of a planar model whose points lie in one plane: loads, their derivatives in the state and
// their pull-back from planar frames. The numbers equal those from frames in space, for a fraction of the work.
#pragma once

#include <vector>

#include "core/body/planar_frame.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

struct TsdaForce;  // core/force/tsda.hpp
template <class V>
struct SpringSpan;

// The tension vector F on point 1 of a spring, with F' = K d' + C ddot' along its span d = P2 - P1.
struct PlanarTension {
  std::size_t body1, body2;
  Plane s1, s2, F;
  Mat<2, 2> K, C;
};

class PlanarSprings {
 public:
  explicit PlanarSprings(const MechanismData& data);  // data must have a planar model

  // Returns whether both points of each spring lie at the same height along n. Bodies keep their heights, but states
  // may differ.
  bool lie_in_plane(const Eigen::VectorXd& y) const;

  // loads[k - 1] belongs to body k.
  void add_loads(double t, const std::vector<PlanarFrame<double>>& frames, Law::Scratch& scratch,
                 std::vector<Vec<3>>& loads) const;
  // The number of springs, and the tension in one of them.
  std::size_t count() const { return springs_.size(); }
  PlanarTension tension(std::size_t spring, double t, const std::vector<PlanarFrame<double>>& frames,
                        Law::Scratch& scratch) const;
  // Gradient of the virtual work sum load'eta in the frames (eta held fixed), the fields and the parameters of laws.
  void add_pull_back(double t, const std::vector<PlanarFrame<double>>& frames, Law::Scratch& scratch,
                     std::vector<PlanarFrameBar>& bars, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const;

 private:
  struct Spring {
    const TsdaForce* force;
    std::size_t body1, body2;
    Plane s1, s2;
  };
  static SpringSpan<Plane> span(const Spring& spring, const std::vector<PlanarFrame<double>>& frames);

  const MechanismData& data_;
  std::vector<Spring> springs_;
  bool points_in_plane_ = true;
};

}  // namespace mbsopt
