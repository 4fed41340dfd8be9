// A short time about an instant t* at which J = Phi_q of a driven mechanism loses rank, while its motion is smooth.
//
// At a distance d from t*, rounding e leaves errors of about e/d in positions, e/d^2 in velocities, e/d^3 in
// accelerations and e/d^4 in multipliers. Within the window all of them are continued from nodes outside it:
//
//   x(t) = sum_k w_k(t) x(t_k),   t_k = t* + half times -4 .. -1, 1 .. 4;  at the ends of a run 8 nodes on any sides
//
// The derivative in rho is the same sum. A multiplier may have a pole at t*, and then no limit. A divided difference of
// order 7 shows it: it takes out every polynomial of degree 6, but not a pole.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "core/mechanism/state_point.hpp"

namespace mbsopt {

class Mechanism;

struct DrivenState {
  double t = 0;
  Eigen::VectorXd y, angles;  // (q, v); branch of each tracked joint angle
  Eigen::VectorXd a;          // vdot, estimated from the last step
  double regularity = 0;      // 1 over the multipliers of a fixed load: proportional to |t - t*| next to t*
};

// A singular position, and what the run found to have no limit there.
struct SingularPosition {
  double t = 0;
  int rank_lost = 0;
  std::vector<std::string> owners;     // of dependent equations: "joint 'A'", "drive 'motor'"
  double half = 0;                     // of the window; 0 if the motion does not pass smoothly [s]
  std::vector<std::string> lacking{};  // sensors and objectives without a limit there
  std::vector<int> parameters{};       // those in which the motion has no derivative there

  void note(const std::string& name);  // adds it to `lacking`
};
// "singular position at t = 0.25 s: ...", with all that these positions lack; empty if they lack nothing.
std::string in_words(const std::vector<SingularPosition>& positions, const std::vector<std::string>& parameter_names);

struct SingularWindow {
  static constexpr int kNodes = 8;
  using Weights = Eigen::Matrix<double, kNodes, 1>;

  double t = 0, half = 0;          // t*, and half of the width [s]
  std::vector<DrivenState> nodes;  // ascending; none if the motion cannot be continued smoothly

  bool contains(double time) const { return !nodes.empty() && std::abs(time - t) < half; }
  Weights weights(double time) const;  // Lagrange's
  DrivenState state_at(double time) const;
  // Calls f(weight, node) at the nodes until it returns false, and returns whether it never does.
  bool for_nodes(double time, const std::function<bool(double weight, const DrivenState& node)>& f) const;
  // Per row of x, which has a column for each node: differences of order 7 of x and (t - t*) x, relative to x. Rows
  // below a millionth of the largest count as zero. It is about 1e-7 for smooth values, and 0.1 to 1 for poles.
  Eigen::ArrayXd roughness(const Eigen::MatrixXd& x) const;
};

// Accelerations and multipliers of a source, continued within windows. A multiplier without a limit is NaN there.
class ContinuedMotion final : public MotionSource {
 public:
  // `window` returns the window of a time or null.
  ContinuedMotion(MotionSource& solved, std::function<const SingularWindow*(double)> window)
      : solved_(solved), window_(std::move(window)) {}

  const Motion& motion(const StatePoint& at, MotionPart part) override;
  Motion& bar(MotionPart part) override { return solved_.bar(part); }
  // Within a window a gradient in the motion becomes one in the states of the nodes. It adds to y_bars or, if tangents
  // are known, to rho_bar.
  void fold_bar(const StatePoint& at, VecOut y_bar, VecOut rho_bar) override;

  std::vector<Eigen::MatrixXd> tangents;  // y_rho at each node of the window of the last point; none in adjoint runs
  std::vector<Eigen::VectorXd> y_bars;    // per node

 private:
  MotionSource& solved_;
  std::function<const SingularWindow*(double)> window_;
  Motion motion_;
};

// The sensors without a value at this point, as "sensor 'pull'".
std::vector<std::string> lacking_sensors(const Mechanism& mechanism, const StatePoint& at);

}  // namespace mbsopt
