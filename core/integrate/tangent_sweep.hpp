// Tangent-linear sweep over accepted steps: for every direction,
//   Y_i' = y0' + h sum_j A_ij k_j',   k_i' = f_y Y_i' + f_rho,   y^' = y0' + h sum_i b_i k_i',   y1' = projection'(y^')
// Only the accelerations a_i' of k_i' = (V_i', a_i') are kept, which gives the same sums, since qdot = v:
//   Q_i' = q0' + h c_i v0' + h^2 sum_j (A^2)_ij a_j',   V_i' = v0' + h sum_j A_ij a_j'
// with the steps held fixed; stages that need each other solve their linear equations together (linearised_stages.hpp).
// A Rosenbrock step: rosenbrock_stages.hpp.
// All directions go through the factor of a stage together, kLanes at a time.
#pragma once

#include <array>

#include "core/integrate/sweep.hpp"
#include "core/run/sample_schedule.hpp"

namespace mbsopt {

class TangentSweep : public Sweep {
 public:
  // The derivatives of the costs are added to psi_rho.
  TangentSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
               std::span<const Cost> costs, const TangentSampling& sampling, const Eigen::MatrixXd& y_initial_rho,
               bool watched, Eigen::MatrixXd& psi_rho);

  // Advances over one step. False where a factorisation failed.
  bool follow(const Step& step, std::span<const SampleEvent> events);
  // Moves the directions from before an event to after it (sweep.hpp).
  void cross(Switches& switches, const SwitchEvent& event, std::size_t first, const StatePoint& at);
  // Adds the terminal costs; call once, after the last step.
  void finish(const StatePoint& end);

  // The largest change of the state by a change of a parameter, both relative, over all steps.
  double magnification() const { return magnification_; }

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
  void cross_limit(Switches& switches, const SwitchEvent& event, const StatePoint& at);
  bool follow_explicit(const Step& step, int i);
  bool follow_implicit(const Step& step, const StageGroup& group);
  bool follow_rosenbrock(const Step& step);
  void set_inside(const Step& step, double theta);  // Block::Y = y0' + h sum_i b_i(theta) k_i'
  void add_running_costs(const Step& step, int node);
  // psi_rho of an objective += g_y' direction + g_rho
  void add_gradient(LaneRows Block::*direction, Eigen::Index objective);
  void take_samples(const Step& step, std::span<const SampleEvent> events);

  const TangentSampling& sampling_;
  Eigen::MatrixXd& psi_rho_;
  std::vector<Weights> of_stage_;  // A
  std::vector<Weights> of_s_;      // gamma_ij/gamma_ii, j < i
  Weights of_step_;                // b
  std::vector<Block> blocks_;
  Eigen::VectorXd ydot_;
  std::vector<Eigen::Index> seen_;  // entries of g_y_ that are not zero
  Eigen::MatrixXd y_rho_;
  LaneRows r_, a_, s_, zero_;
  double magnification_ = 0;
};

}  // namespace mbsopt
