#include "core/driven/driven_simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <vector>

#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/cvodes/cvodes.hpp"
#include "core/driven/driven_run.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/start/free_motion.hpp"

namespace mbsopt {
namespace {

// The reason why a run is integrated although drives may leave no freedom; empty if no setting demands it.
std::string why_integrated(const MechanismData& d, const SimulationSettings& s) {
  if (d.equilibrium) return "it starts from static equilibrium";
  if (is_cvodes(s.integrator.type)) return "CVODES integrates";
  if (s.integrator.step) return "simulation.integrator.step asks for steps";
  if (s.formulation.type == FormulationType::penalty) return "the joints of the penalty form give way to loads";
  if (s.formulation.projection != Projection::position_velocity)
    return "simulation.formulation.projection lets the state leave the constraints";
  return "";
}

// Derivatives of the state in rho at one instant. The constraints determine all of the state that depends on rho.
class DrivenDerivatives {
 public:
  DrivenDerivatives(const Mechanism& mechanism, DrivenRun& run)
      : data_(mechanism.data()),
        run_(run),
        projector_(run.projector()),
        unmoved_(projector_.solution()),
        blocks_(parameter_blocks(data_)),
        bar_{Eigen::VectorXd::Zero(mechanism.states()), Eigen::VectorXd::Zero(data_.rho.size())},
        y0_bar_(bar_.y),
        y_rho_(Eigen::MatrixXd::Zero(mechanism.states(), data_.rho.size())) {
    y0_dir_.setZero(mechanism.states(), kLanes);
    direction_ = y0_dir_;
  }

  // Sets y_rho at a point. Within a singular window it is the sum over its nodes that the state is. Returns false if J
  // is singular.
  bool set_y_rho(const StatePoint& at, bool velocities) {
    const SingularWindow* const w = run_.window_at(at.t);
    if (!w) return find_y_rho(at, velocities);
    tangents_.clear();
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(y_rho_.rows(), y_rho_.cols());
    const bool regular = w->for_nodes(at.t, [&](double weight, const DrivenState& node) {
      if (!find_y_rho({node.t, node.y, node.angles}, velocities)) return false;
      tangents_.push_back(y_rho_);
      sum += weight * y_rho_;
      return true;
    });
    y_rho_ = sum;
    if (run_.continued()) run_.continued()->tangents = tangents_;
    return regular;
  }
  bool linearise(const StatePoint& at) { return projector_.linearise(at.t, at.angles, at.y, at.y, unmoved_); }
  // Names the parameters in which the positions at the nodes of a window have a pole, in the statistics.
  void note_parameters() {
    constexpr double kPole = 1e-2;      // of the roughness, far above that of smooth motions
    constexpr double kRounding = 1e-9;  // of the positions: a derivative that moves them less consists of rounding
    for (const SingularWindow& w : run_.windows()) {
      if (w.nodes.empty() || data_.active.empty() || !set_y_rho({w.t, bar_.y, bar_.y}, false)) continue;
      Eigen::MatrixXd q_rho(y_rho_.rows() / 2, SingularWindow::kNodes);
      for (const int p : data_.active) {
        for (Eigen::Index k = 0; k < q_rho.cols(); ++k)
          q_rho.col(k) = tangents_[static_cast<std::size_t>(k)].col(p).head(q_rho.rows());
        const double size = data_.rho(p) == 0 ? 1 : std::abs(data_.rho(p));
        const bool moves = q_rho.cwiseAbs().maxCoeff() * size > kRounding * w.nodes.front().y.cwiseAbs().maxCoeff();
        if (moves && w.roughness(q_rho).maxCoeff() > kPole) run_.singular_at(w.t).parameters.push_back(p);
      }
    }
  }
  const Eigen::MatrixXd& y_rho() const { return y_rho_; }
  // psi_rho += weight d(cost)/d(rho) with y_rho known
  void add_forward(const DrivenTerm& term, const StatePoint& at, Eigen::MatrixXd& psi_rho) {
    run_.count(term, bar_.set(*term.cost, at, term.weight), at.t);
    psi_rho.row(term.objective) += bar_.rho.transpose() + bar_.y.transpose() * y_rho_;
  }
  // Adds the same for all terms of one objective, to the gradients in the fields and parameters.
  void add_backward(std::span<const DrivenTerm> terms, const StatePoint& at, Eigen::VectorXd& theta_bar,
                    Eigen::VectorXd& rho_bar) {
    const SingularWindow* const w = run_.window_at(at.t);
    ContinuedMotion* const motion = run_.continued();
    if (w && motion) motion->y_bars.assign(SingularWindow::kNodes, Eigen::VectorXd::Zero(bar_.y.size()));
    bar_.y.setZero();
    for (const DrivenTerm& term : terms)
      run_.count(term, term.cost->add_gradient(at, term.weight, bar_.y, rho_bar), at.t);
    if (!w) return projector_.add_adjoint(bar_.y, y0_bar_, theta_bar, rho_bar);
    std::size_t k = 0;
    w->for_nodes(at.t, [&](double weight, const DrivenState& node) {
      Eigen::VectorXd y_bar = weight * bar_.y;
      if (motion) y_bar += motion->y_bars[k++];
      linearise({node.t, node.y, node.angles});
      projector_.add_adjoint(y_bar, y0_bar_, theta_bar, rho_bar);
      return true;
    });
  }

 private:
  bool find_y_rho(const StatePoint& at, bool velocities) {
    if (!linearise(at)) return false;
    const Eigen::Index rows = velocities ? y_rho_.rows() : y_rho_.rows() / 2;
    for (const ParameterBlock& b : blocks_) {
      projector_.tangent(b, y0_dir_, direction_, velocities);
      for (int k = 0; k < kLanes; ++k)
        if (b.parameter[k] >= 0) y_rho_.col(b.parameter[k]).head(rows) = direction_.col(k).head(rows);
    }
    return true;
  }

  const MechanismData& data_;
  DrivenRun& run_;
  Projector& projector_;                   // of the run, which counts its factorisations
  std::vector<Eigen::MatrixXd> tangents_;  // at the nodes of a window
  const ProjectionSolution unmoved_;
  std::vector<ParameterBlock> blocks_;
  CostGradient bar_;
  Eigen::VectorXd y0_bar_;  // of the state that is projected, which only rounding reaches
  Eigen::MatrixXd y_rho_;
  LaneRows y0_dir_, direction_;  // y0_dir_ is zero: the projected state does not depend on rho
};

bool reads_positions(std::span<const Cost> costs) {
  const auto reads = [](const std::shared_ptr<const PointCost>& cost) { return !cost || cost->reads_positions(); };
  return std::ranges::all_of(costs, [&](const Cost& cost) {
    return reads(cost.running) && reads(cost.terminal) && std::ranges::all_of(cost.samples, reads, &SampledCost::cost);
  });
}

// ydot at a point, within a singular window continued as the state there.
bool set_rates(SpatialDynamics& dynamics, const SingularWindow* w, const StatePoint& at, Eigen::VectorXd& ydot) {
  if (!w) return dynamics.evaluate(at.t, at.y, at.angles, ydot);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(ydot.size());
  const bool evaluated = w->for_nodes(at.t, [&](double weight, const DrivenState& node) {
    const bool ok = dynamics.evaluate(node.t, node.y, node.angles, ydot);
    sum += weight * ydot;
    return ok;
  });
  ydot = sum;
  return evaluated;
}

}  // namespace

bool is_solved(const Mechanism& mechanism, const SimulationSettings& settings, const Assembly& start) {
  const MechanismData& d = mechanism.data();
  if (settings.solve == Solve::dynamics) return false;
  const std::string reason = d.drive_names.empty() ? "there are no drives" : why_integrated(d, settings);
  const int free = reason.empty() && start.result().ok ? start.degrees_of_freedom() : 0;
  if (settings.solve == Solve::kinematics && (!reason.empty() || free > 0)) {
    throw std::invalid_argument(fmt::format(
        "simulation.solve: cannot be \"kinematics\": {}",
        !reason.empty() ? reason : "the drives leave " + freedoms_in_words(mechanism, start, settings.start_time)));
  }
  return reason.empty() && start.result().ok && free == 0;
}

bool may_be_solved(const Mechanism& mechanism, const SimulationSettings& settings) {
  const MechanismData& d = mechanism.data();
  const bool enough = d.planar ? d.planar->rows.size() >= 3 * at(d.n) : d.m >= 6 * d.n;
  return settings.solve != Solve::dynamics && !d.drive_names.empty() && enough && why_integrated(d, settings).empty();
}

SimulationResult driven_simulate(const Mechanism& mechanism, const SimulationSettings& settings,
                                 std::span<const Cost> costs, const Sampling& sampling, const RunOptions& options,
                                 const Assembly& start) {
  DrivenRun run(mechanism, settings, costs, sampling.times, options, start, false);
  run.go(
      [&](const StatePoint& at, std::span<const DrivenTerm> terms) {
        for (const DrivenTerm& term : terms)
          if (!term.cost && sampling.observe) sampling.observe(term.observation, at);
        return true;
      },
      sampling.look_inside);
  return run.finish();
}

SimulationResult driven_tlm(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                            const TangentSampling& sampling, const RunOptions& options, const Assembly& start,
                            Rates rates) {
  if ((sampling.times.empty() || sampling.reads_positions) && reads_positions(costs)) rates = Rates::without_tangents;
  DrivenRun run(mechanism, settings, costs, sampling.times, options, start, true);
  SimulationResult& result = run.result();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  DrivenDerivatives derivatives(mechanism, run);
  std::optional<SpatialDynamics> dynamics;  // of the rates that observers get
  if (rates == Rates::known) dynamics.emplace(mechanism, settings.formulation);
  Eigen::VectorXd ydot(mechanism.states());
  run.go([&](const StatePoint& at, std::span<const DrivenTerm> terms) {
    if (!derivatives.set_y_rho(at, rates != Rates::without_tangents)) return false;
    ++result.statistics.linearised_states;
    const Eigen::MatrixXd& y_rho = derivatives.y_rho();
    const bool observed = std::ranges::any_of(terms, [](const DrivenTerm& term) { return !term.cost; });
    if (observed && dynamics && !set_rates(*dynamics, run.window_at(at.t), at, ydot)) return false;
    for (const DrivenTerm& term : terms) {
      if (term.cost) {
        derivatives.add_forward(term, at, result.psi_rho);
        continue;
      }
      StatePoint with_rate = at;
      if (dynamics) with_rate.ydot = &ydot;
      sampling.observe(term.observation, with_rate, y_rho);
    }
    return y_rho.allFinite();
  });
  derivatives.note_parameters();
  return run.finish();
}

SimulationResult driven_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                std::span<const Cost> costs, const RunOptions& options, const Assembly& start) {
  DrivenRun run(mechanism, settings, costs, {}, options, start, true);
  SimulationResult& result = run.result();
  const MechanismData& d = mechanism.data();
  DrivenDerivatives derivatives(mechanism, run);
  std::vector<Eigen::VectorXd> theta_bar(costs.size(), Eigen::VectorXd::Zero(d.slots()));
  std::vector<Eigen::VectorXd> rho_bar(costs.size(), Eigen::VectorXd::Zero(d.rho.size()));
  run.go([&](const StatePoint& at, std::span<const DrivenTerm> terms) {
    if (!run.window_at(at.t) && !derivatives.linearise(at)) return false;
    ++result.statistics.linearised_states;
    while (!terms.empty()) {  // terms of one objective are adjacent
      const auto other = std::ranges::find_if(
          terms, [&](const DrivenTerm& term) { return term.objective != terms.front().objective; });
      const std::size_t o = static_cast<std::size_t>(terms.front().objective),
                        count = static_cast<std::size_t>(other - terms.begin());
      derivatives.add_backward(terms.first(count), at, theta_bar[o], rho_bar[o]);
      terms = terms.subspan(count);
    }
    return true;
  });
  derivatives.note_parameters();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  for (std::size_t o = 0; o < costs.size(); ++o) {
    d.add_to_rho(theta_bar[o], rho_bar[o]);
    result.psi_rho.row(static_cast<Eigen::Index>(o)) = rho_bar[o].transpose();
  }
  return run.finish();
}

}  // namespace mbsopt
