#include "core/driven/singular_position.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/constraint/constraint.hpp"
#include "core/linear/dense.hpp"
#include "core/start/law_jumps.hpp"
#include "core/start/poses.hpp"

namespace mbsopt {

// Equations depend on each other if they have a share in a null vector of J'.
SingularPosition singular_position(const Mechanism& mechanism, double t, const Eigen::VectorXd& y, double threshold) {
  constexpr double kShare = 1e-3;
  const MechanismData& d = mechanism.data();
  const JointSolver J(d, frames_at(y), threshold);
  SingularPosition s;
  s.t = t;
  s.rank_lost = static_cast<int>(6 * d.n - J.rank());
  if (s.rank_lost == 0 || d.m == 0) return s;
  const LeftSingular svd = left_singular(J.unit_rows_of_J());
  for (Eigen::Index k = 0; k < d.m; ++k) {
    if (k < svd.values.size() && svd.values(k) > threshold) continue;
    for (const Constraint& c : d.constraints) {
      if (svd.U.col(k).segment(c.row, c.rows()).cwiseAbs().maxCoeff() < kShare) continue;
      const std::string owner =
          c.drive >= 0 ? "drive '" + d.drive_names[at(c.drive)] + "'" : "joint '" + d.joint_names[at(c.joint)] + "'";
      if (std::ranges::find(s.owners, owner) == s.owners.end()) s.owners.push_back(owner);
    }
  }
  return s;
}

std::string why_stuck(const Mechanism& mechanism, const SimulationSettings& settings, double t,
                      const Eigen::VectorXd& y) {
  // The interval over which a jump is measured; it is long against the rounding of times.
  const double beside = 1e-3 * (settings.end_time - settings.start_time);
  const std::string jump =
      LawJumps(mechanism.data())
          .between(std::max(t - beside, settings.start_time), std::min(t + beside, settings.end_time));
  if (!jump.empty()) return jump;
  const SingularPosition here = singular_position(mechanism, t, y, kDrivenRankThreshold);
  const std::string why = here.owners.empty()
                              ? std::string()
                              : fmt::format(": a singular position, where the equations of {} depend on each other",
                                            fmt::join(here.owners, ", "));
  return fmt::format(
      "the positions cannot be continued beyond t = {:.6g} s{}. Perhaps a drive asks for more than the mechanism "
      "reaches, or cannot pass a dead point. Look for poles and jumps of its law, change the lengths, or drive another "
      "joint there",
      t, why);
}

}  // namespace mbsopt
