// Tangent-linear sweep over accepted steps: for every direction,
//   Y_i' = y0' + h sum_j A_ij k_j',   k_i' = f_y Y_i' + f_rho,   y^' = y0' + h sum_i b_i k_i',   y1' = projection'(y^')
// Only the accelerations a_i' of k_i' = (V_i', a_i') are kept, which gives the same sums, since qdot = v:
//   Q_i' = q0' + h c_i v0' + h^2 sum_j (A^2)_ij a_j',   V_i' = v0' + h sum_j A_ij a_j'
// with the steps held fixed; stages that need each other solve their linear equations together (linearised_stages.hpp).
// A Rosenbrock step: rosenbrock_stages.hpp.
// All directions go through the factor of a stage together, kLanes at a time.
#pragma once

#include <array>
#include <optional>

#include "core/dynamics/dynamics.hpp"
#include "core/dynamics/motion_solver.hpp"
#include "core/integrate/gradient_quadrature.hpp"
#include "core/run/cost.hpp"
#include "core/run/sample_schedule.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/step/linearised_stages.hpp"
#include "core/step/rosenbrock_stages.hpp"
#include "core/step/step.hpp"

namespace mbsopt {

class Mechanism;

class TangentSweep {
 public:
  // watch: gets the gradients of running costs; may be null.
  TangentSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
               const Eigen::MatrixXd& y_initial_rho, GradientQuadrature* watch);

  // Advances over one step; adds the costs' derivatives to psi_rho. False where a factorisation failed.
  bool follow(const Step& step, std::span<const Cost> costs, std::span<const SampleEvent> events,
              const TangentSampling& sampling, Eigen::MatrixXd& psi_rho);
  // Adds the terminal costs' derivatives; call once, after the last step.
  void finish(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles, std::span<const Cost> costs,
              Eigen::MatrixXd& psi_rho);

  // The largest change of the state by a change of a parameter, both relative, over all steps.
  double magnification() const { return magnification_; }
  long linearised_states() const {
    return dynamics_.linearised_states() + (equations_ ? equations_->places() : 0) +
           (rosenbrock_ ? rosenbrock_->linearised_states() : 0);
  }
  long factorisations() {
    return dynamics_.factorisations() + projector_->factorisations() + (implicit_ ? implicit_->factorisations() : 0) +
           (rosenbrock_ ? rosenbrock_->factorisations() : 0);
  }

 private:
  struct Block {
    ParameterBlock parameters;
    LaneRows y0, y_hat, y1, Y;
    std::vector<LaneRows> a;        // of each stage
    std::vector<LaneRows> Y_stage;  // of coupled stages
    Eigen::MatrixXd x;              // their accelerations and multipliers; of a Rosenbrock stage h x_i
    LaneRows common;                // D(h, h k_0), by a Rosenbrock method
  };
  // Weights of stages in a sum: of v0, of the accelerations in q, and in v.
  struct Weights {
    double c = 0;
    std::array<double, Method::kMaxStages> q{}, v{};
  };
  Weights integrated(const double* of_k) const;  // from those of all stages' derivatives k_j
  // to = from + the sum over stages first..last; c: the share of v0, w.c where it is not in `from`.
  static void add_stages(const Block& b, double h, double c, const Weights& w, int first, int last,
                         const LaneRows& from, LaneRows& to);
  bool follow_explicit(const Step& step, int i);
  bool follow_implicit(const Step& step, const StageGroup& group);
  bool follow_rosenbrock(const Step& step);
  void set_inside(const Step& step, double theta);  // Block::Y = y0' + h sum_i b_i(theta) k_i'
  // At a node, where the directions are in Block::Y.
  void add_running_costs(const Step& step, int node, std::span<const Cost> costs, Eigen::MatrixXd& psi_rho);
  void add_cost(const PointCost& cost, const StatePoint& at, double weight, LaneRows Block::*direction,
                Eigen::Index objective, Eigen::MatrixXd& psi_rho);
  void set_dense(const Step& step, double theta);  // into Block::Y
  void take_samples(const Step& step, std::span<const SampleEvent> events, const TangentSampling& sampling,
                    Eigen::MatrixXd& psi_rho);

  const Mechanism mechanism_;
  const Method& rk_;
  MotionSource* motion() { return motion_ ? &*motion_ : nullptr; }
  std::optional<MotionSolver> motion_;  // where some sensor needs it
  Dynamics dynamics_;
  std::unique_ptr<Projector> projector_;
  std::optional<StageEquations> equations_;  // of implicit stages
  std::optional<LinearisedStages> implicit_;
  std::optional<RosenbrockStages> rosenbrock_;
  std::vector<Weights> of_stage_;  // A
  std::vector<Weights> of_s_;      // gamma_ij/gamma_ii, j < i
  Weights of_step_;                // b
  std::vector<Block> blocks_;
  Eigen::VectorXd y_, ydot_, y_bar_, rho_bar_;
  std::vector<Eigen::Index> seen_;  // entries of y_bar_ that are not zero
  Eigen::MatrixXd y_rho_;
  GradientQuadrature* watch_;
  LaneRows r_, a_, s_, zero_;
  double magnification_ = 0;
};

}  // namespace mbsopt
