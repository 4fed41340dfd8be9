// The projection in one of the two spaces (Body is BodyInSpace or BodyInPlane). projection.hpp is its interface.
#pragma once

#include <vector>

#include "core/linear/dense.hpp"
#include "core/projection/projection.hpp"
#include "core/projection/projection_iterations.hpp"

namespace mbsopt {

// The numbering of bodies excludes the ground, that of frames includes it.
//   mass_orthogonal_projection.hpp   project, response, violations
//   square_projection.hpp            settle, assemble, approach: by a dense J if drives leave no freedom
//   projection_derivatives.hpp       linearise, tangent, add_adjoint
template <class Body>
class ProjectorOf final : public Projector {
  using Space = typename Body::Space;
  using Direction = typename Body::Direction;
  using Gradient = typename Body::Gradient;
  static constexpr int N = Space::kUnknowns;

 public:
  ProjectorOf(const Mechanism& mechanism, Projection what, Free free);

  bool project(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y,
               ProjectionSolution& s) override;
  bool settle(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y) override;
  bool assemble(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y) override;
  double approach(double t, const Eigen::VectorXd& angles, Eigen::VectorXd& y, Eigen::VectorXd& theta_bar,
                  Eigen::VectorXd& rho_bar) override;
  bool linearise(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, const Eigen::VectorXd& y,
                 const ProjectionSolution& s) override;
  void tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir, bool velocities) override;
  void add_adjoint(const Eigen::VectorXd& y_bar, Eigen::VectorXd& y_hat_bar, Eigen::VectorXd& theta_bar,
                   Eigen::VectorXd& rho_bar) override;
  void response(Eigen::VectorXd& out) override;
  double position_violation(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y,
                            double* relative) override;
  double velocity_violation(double t, const Eigen::VectorXd& y) override;
  long factorisations() const override { return solver_.factorisations() + square_factorisations_; }

 private:
  using X = Vec<N>;
  using Y = Eigen::VectorXd;
  using Frames = std::vector<typename Space::Frame>;

  bool constrained() const { return rows_.count() > 0; }
  void read_hat(double t, const Y& y_hat);
  bool factor(double t, const Y& y_hat);                // of S(q~)
  bool factor_square();                                 // J at the frames
  void solve_square(const Y& rows, std::vector<X>& x);  // J x = rows
  void response_of_square(Y& out);                      // after settle()
  void displace(const Y& x);                            // all bodies from the state of read_hat()
  static void limit_turns(Y& step);
  // Calls f(body, its number without the ground, its frame).
  template <class F>
  void for_bodies(F&& f) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) f(bodies_[i], i, frames_[i + 1]);
  }
  X test_load_of(int body) const;
  // Sets the directions of Phi or Phidot (dirs_) and of J'lambda (load_dirs_), along frame_dirs_ and those of the
  // fields.
  void set_tangents(ProjectionLevel level, const Frames& frames, const ParameterBlock& block, const Y& lambda);
  void set_field_tangents(const ParameterBlock& block);  // Phi' at q along the fields into dirs_, bodies at rest
  // b_lanes_ = -(M' x + (J'lambda)')
  void set_loads(const ParameterBlock& block, const std::vector<X>& x);
  void refine_tangent(ProjectionLevel level, const LargestEntries<Direction>& size);
  void refine_adjoint(ProjectionLevel level);
  void add_pull_back(Frames& frames, const ConstraintWeights& weights, Y& theta_bar, Y& rho_bar) {
    constraints_.add_pull_back(frames, laws_, angles_, weights, -1, bars_, theta_bar, rho_bar);
  }
  void subtract_mass_bar(const std::vector<X>& x, Y& theta_bar) const {
    for (std::size_t i = 0; i < x.size(); ++i) Space::subtract_mass_bar(data_, i + 1, x_[i], x[i], theta_bar);
  }

  const bool square_;  // J, which is factored as it is
  long square_factorisations_ = 0;
  SquareFactor J_factor_;
  Eigen::MatrixXd J_;
  ProjectionSolution settled_;

  BlockSaddleSolver<typename Space::Rows> solver_;  // factor of S(q~)
  typename Space::Rows rows_;                       // J at the projected q
  typename Space::Constraints constraints_;
  RowLaws laws_;
  Y angles_;

  std::vector<Body> bodies_;
  Frames frames_, frames_tilde_;
  std::vector<X> delta_, u_, b_, x_;
  Y nu_, kappa_, phi_, g_, mu_;
  const Y row_size_;
  Corrections<X, Y> corrections_;
  std::vector<typename Space::FrameBar> bars_;
  std::vector<Gradient> q_bars_, v_bars_;
  // Lanes of tangent directions.
  std::vector<typename Space::FrameTangent> frame_dirs_;
  std::vector<Direction> q_dirs_, v_dirs_;
  std::vector<Lanes<N>> load_dirs_, b_lanes_, x_lanes_;
  ConstraintTangents dirs_;
  LaneRows g_lanes_, nu_lanes_;
  Corrections<Lanes<N>, LaneRows> corrections_of_lanes_;
};

}  // namespace mbsopt
