#include "core/cvodes/cvodes_forward.hpp"

#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>

#include "core/body/state_layout.hpp"
#include "core/cvodes/cvodes.hpp"

namespace mbsopt::cvodes {

Sensitivities::Sensitivities(ForwardRun& run, const SimulationSettings& settings, std::span<const Cost> costs,
                             const TangentSampling& sampling)
    : run_(run),
      costs_(costs),
      sampling_(sampling),
      active_(run.flow().data().active),
      blocks_(parameter_blocks(run.flow().data())),
      s_(static_cast<int>(active_.size()), StateLayout{run.flow().data().n}.size(), run.context()),
      rate_(StateLayout{run.flow().data().n}.size(), run.context()) {
  const MechanismData& d = run.flow().data();
  const Eigen::Index states = StateLayout{d.n}.size();
  const int count = static_cast<int>(active_.size());
  direction_.setZero(states, kLanes), change_.setZero(states, kLanes);
  y_bar_.setZero(states), rho_bar_.setZero(d.rho.size());
  y_rho_.setZero(states, d.rho.size());
  psi_rho_.setZero(static_cast<Eigen::Index>(costs.size()), d.rho.size());

  const Eigen::MatrixXd y0_rho = run.assembly().tangent();
  std::vector<double> size, atol;
  for (int k = 0; k < count; ++k) {
    const int parameter = active_[static_cast<std::size_t>(k)];
    s_.at(k) = y0_rho.col(parameter);
    size.push_back(parameter_size(d.rho(parameter)));
    atol.push_back(settings.integrator.atol / size.back());
  }
  void* memory = run.memory();
  run.set_sensitivities(this);
  run.require(CVodeSensInit(memory, count, CV_STAGGERED, f, s_));
  run.require(CVodeSensSStolerances(memory, settings.integrator.rtol, atol.data()));
  run.require(CVodeSetSensErrCon(memory, SUNTRUE));
  if (!is_stiff_method(settings)) {
    fixed_point_.reset(SUNNonlinSol_FixedPointSens(count, s_[0], 0, run.context()));
    run.require(CVodeSetNonlinearSolverSensStg(memory, fixed_point_.get()));
  }
  if (run.running().empty()) return;
  const Eigen::Index quadratures = static_cast<Eigen::Index>(run.running().size());
  const VectorArray none(count, quadratures, run.context()), tolerances(count, quadratures, run.context());
  const Eigen::VectorXd atol_g = run.quadrature_atol();
  for (int k = 0; k < count; ++k) tolerances.at(k) = atol_g / size[static_cast<std::size_t>(k)];
  run.require(CVodeQuadSensInit(memory, g, none));
  run.require(CVodeQuadSensSVtolerances(memory, settings.integrator.rtol, tolerances));
  run.require(CVodeSetQuadSensErrCon(memory, SUNTRUE));
}

int Sensitivities::f(int count, realtype t, N_Vector y, N_Vector, N_Vector* s, N_Vector* sdot, void* run, N_Vector,
                     N_Vector) {
  Sensitivities& self = *static_cast<ForwardRun*>(run)->sensitivities();
  return self.run_.flow().thrown().keep([&] {
    Flow& flow = self.run_.flow();
    if (!flow.linearise(t, values(y))) return kTryASmallerStep;
    for (std::size_t c = 0; c < self.blocks_.size(); ++c) {
      const int first = kLanes * static_cast<int>(c), lanes = std::min(kLanes, count - first);
      for (int k = 0; k < lanes; ++k) self.direction_.col(k) = values(s[first + k]);
      flow.dynamics().tangent(self.blocks_[c], self.direction_, self.change_);
      for (int k = 0; k < lanes; ++k) values(sdot[first + k]) = self.change_.col(k);
      if (!self.change_.leftCols(lanes).allFinite()) return kTryASmallerStep;
    }
    return kOk;
  });
}

int Sensitivities::g(int count, realtype t, N_Vector y, N_Vector* s, N_Vector, N_Vector* gsdot, void* run, N_Vector,
                     N_Vector) {
  Sensitivities& self = *static_cast<ForwardRun*>(run)->sensitivities();
  return self.run_.flow().thrown().keep([&] {
    const StatePoint at = self.run_.flow().point(t, values(y));
    for (std::size_t q = 0; q < self.run_.running().size(); ++q) {
      const PointCost& cost = *self.costs_[static_cast<std::size_t>(self.run_.running()[q])].running;
      self.y_bar_.setZero(), self.rho_bar_.setZero();
      cost.add_gradient(at, 1, self.y_bar_, self.rho_bar_);
      for (int k = 0; k < count; ++k) {
        const double rate = self.y_bar_.dot(values(s[k])) + self.rho_bar_(self.active_[static_cast<std::size_t>(k)]);
        values(gsdot[k])(static_cast<Eigen::Index>(q)) = self.run_.bounded(rate, q);
      }
    }
    return kOk;
  });
}

void Sensitivities::add_cost(const PointCost& cost, const StatePoint& at, Eigen::Index objective) {
  y_bar_.setZero(), rho_bar_.setZero();
  cost.add_gradient(at, 1, y_bar_, rho_bar_);
  psi_rho_.row(objective) += rho_bar_.transpose() + y_bar_.transpose() * y_rho_;
}

// Passes the state and its rate, which delays of measurements need.
void observe(ForwardRun& run, const TangentSampling& sampling, const SampleEvent& event, StatePoint at, Vector& rate,
             const Eigen::MatrixXd& y_rho) {
  run.require(CVodeGetDky(run.memory(), event.time, 1, rate));
  const Eigen::VectorXd ydot = *rate;
  at.ydot = &ydot;
  sampling.observe(event.index, at, y_rho);
}

void Sensitivities::take_sample(const SampleEvent& event, const StatePoint& at) {
  run_.require(CVodeGetSensDky(run_.memory(), event.time, 0, s_));
  for (std::size_t k = 0; k < active_.size(); ++k) y_rho_.col(active_[k]) = s_.at(static_cast<int>(k));
  if (event.cost) {
    add_cost(*event.cost, at, event.objective);
  } else if (sampling_.observe) {
    observe(run_, sampling_, event, at, rate_, y_rho_);
  }
}

const Eigen::MatrixXd& Sensitivities::finish() {
  const StatePoint end = run_.end();
  double t = end.t;
  run_.require(CVodeGetSens(run_.memory(), &t, s_));
  for (std::size_t k = 0; k < active_.size(); ++k) y_rho_.col(active_[k]) = s_.at(static_cast<int>(k));
  for (std::size_t o = 0; o < costs_.size(); ++o) {
    if (costs_[o].terminal) add_cost(*costs_[o].terminal, end, static_cast<Eigen::Index>(o));
  }
  if (run_.running().empty()) return psi_rho_;
  const VectorArray integrals(static_cast<int>(active_.size()), static_cast<Eigen::Index>(run_.running().size()),
                              run_.context());
  run_.require(CVodeGetQuadSens(run_.memory(), &t, integrals));
  for (std::size_t k = 0; k < active_.size(); ++k) {
    for (std::size_t q = 0; q < run_.running().size(); ++q) {
      psi_rho_(run_.running()[q], active_[k]) += integrals.at(static_cast<int>(k))(static_cast<Eigen::Index>(q));
    }
  }
  return psi_rho_;
}

}  // namespace mbsopt::cvodes

namespace mbsopt {

SimulationResult cvodes_forward(const Mechanism& mechanism, const SimulationSettings& settings,
                                std::span<const Cost> costs, const TangentSampling& sampling,
                                const RunOptions& options) {
  cvodes::ForwardRun run(mechanism, settings, costs, options);
  const Eigen::Index objectives = static_cast<Eigen::Index>(costs.size());
  run.result().psi_rho.setZero(objectives, mechanism.parameters());
  if (!run.result().ok()) return run.finish();
  if (mechanism.data().active.empty()) {  // nothing to follow
    const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(mechanism.states(), mechanism.parameters());
    cvodes::ForwardRun::Hooks hooks;
    cvodes::Vector rate(mechanism.states(), run.context());
    hooks.sampled = [&](const SampleEvent& event, const StatePoint& at) {
      if (!event.cost && sampling.observe) cvodes::observe(run, sampling, event, at, rate, none);
    };
    run.go(sampling.times, hooks);
    return run.finish();
  }
  cvodes::Sensitivities sensitivities(run, settings, costs, sampling);
  cvodes::ForwardRun::Hooks hooks;
  hooks.sampled = [&](const SampleEvent& event, const StatePoint& at) { sensitivities.take_sample(event, at); };
  run.go(sampling.times, hooks);
  if (run.result().ok()) run.result().psi_rho = sensitivities.finish();
  return run.finish();
}

}  // namespace mbsopt
