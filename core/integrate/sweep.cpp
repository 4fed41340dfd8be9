#include "core/integrate/sweep.hpp"

#include <algorithm>

#include "core/integrate/model_choice.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {
namespace {

constexpr double kGrazing = 1e-6;  // of the terms of a switch's rate: the derivative of its instant is the reciprocal
constexpr double kZero = 1e-8;     // of the terms of a switch, at its own event
constexpr double kKink = 1e-9;     // of f and G: more is no rounding, so that a grazing event has no derivative

}  // namespace

Sweep::Sweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
             std::span<const Cost> costs, bool watched)
    : mechanism_(mechanism),
      rk_(method),
      costs_(costs),
      dynamics_(mechanism, settings.formulation, model_of(mechanism, settings, method)),
      projector_(make_projector(mechanism, settings.formulation.projection, model_of(mechanism, settings, method))) {
  const MechanismData& d = mechanism.data();
  if (d.needs_motion) motion_.emplace(mechanism, settings.formulation);
  if (watched) watch_.emplace(mechanism, method, costs, QuadratureWatch::Of::gradients, nullptr);
  if (largest_implicit_group(rk_) > 0) implicit_.emplace(d, rk_, dynamics_.in_space());
  if (rk_.gamma) rosenbrock_.emplace(mechanism, rk_, dynamics_);
  for (Eigen::VectorXd* x : {&y_, &ydot_, &g_.y}) x->setZero(mechanism.states());
  g_.rho.setZero(d.rho.size());
}

bool Sweep::linearise_stage(const Step& step, int i) {
  y_ = step.Y.col(i);
  const double t = step.t + rk_.c[i] * step.h;
  return dynamics_.linearise(t, y_, step.angles0, step.K.col(i).tail(y_.size() / 2), step.lambda.col(i));
}

bool Sweep::set_running_gradient(const Step& step, std::size_t objective, int node) {
  const PointCost* const running = costs_[objective].running.get();
  if (!running || node >= rk_.nodes || rk_.node_b[node] == 0) return false;
  const double weight = step.h * rk_.node_b[node];
  g_.set(*running, {step.t + rk_.node_c[node] * step.h, y_, step.angles0, motion()}, weight);
  if (!watch_) return true;
  node_rate(rk_, step, node, ydot_);
  watch_->take_gradient(objective, node, weight, g_.y, ydot_, g_.rho);
  return true;
}

bool Sweep::set_event(Switches& switches, const SwitchEvent& event, std::size_t first, const StatePoint& at,
                      bool back) {
  const auto objectives = static_cast<Eigen::Index>(costs_.size());
  const StatePoint here{at.t, at.y, at.angles, motion()};
  event_.jump.setZero(at.y.size());
  event_.jump_of_costs.setZero(objectives);
  double size = 0;
  Eigen::VectorXd size_of_costs = Eigen::VectorXd::Zero(objectives);
  const auto add_side = [&](int side, double sign) {
    switches.hold(event.of, side);
    if (motion_) motion_->forget();
    if (!dynamics_.evaluate(at.t, at.y, at.angles, ydot_)) return false;
    event_.jump += sign * ydot_;
    size = std::max(size, ydot_.cwiseAbs().maxCoeff());
    for (Eigen::Index o = 0; o < objectives; ++o) {
      const PointCost* const running = costs_[static_cast<std::size_t>(o)].running.get();
      const double G = running ? running->value(here) : 0;
      event_.jump_of_costs(o) += sign * G;
      size_of_costs(o) = std::max(size_of_costs(o), std::abs(G));
    }
    return true;
  };
  const bool evaluated = add_side(event.after, -1) && add_side(event.before, 1);
  double of_time = 0;
  const auto set_gradient = [&](std::size_t of) {
    event_.g_y.setZero(at.y.size());
    event_.g_rho.setZero(g_.rho.size());
    of_time = 0;
    const double g = switches.add_gradient(of, here, 1, event_.g_y, event_.g_rho, of_time);
    return std::abs(g) <= kZero * (event_.g_y.cwiseAbs().dot(at.y.cwiseAbs()) + std::abs(of_time * at.t) +
                                   event_.g_rho.cwiseAbs().dot(mechanism_.rho().cwiseAbs()));
  };
  if (!set_gradient(event.of)) set_gradient(first);
  if (!back) switches.hold(event.of, event.after);
  if (motion_) motion_->forget();
  const bool jumps = event_.jump.cwiseAbs().maxCoeff() > kKink * size ||
                     (event_.jump_of_costs.cwiseAbs().array() > kKink * size_of_costs.array()).any();
  return evaluated && event.before * event.after != 0 && passes(at, ydot_, of_time, jumps);
}

bool Sweep::passes(const StatePoint& at, const Eigen::VectorXd& f_before, double of_time, bool jumps) {
  event_.rate = event_.g_y.dot(f_before) + of_time;
  const double size = event_.g_y.cwiseAbs().dot(f_before.cwiseAbs()) + std::abs(of_time);
  if (std::abs(event_.rate) > kGrazing * size) return true;
  if (jumps && !grazing_) grazing_ = at.t;
  return false;
}

bool Sweep::set_strike(Switches& switches, const SwitchEvent& event, const StatePoint& before) {
  Strike& s = strike_;
  const StatePoint here{before.t, before.y, before.angles, motion()};
  if (!dynamics_.evaluate(here.t, here.y, here.angles, ydot_)) return false;
  s.f_before = ydot_;
  if (!set_impact(switches, event.of, dynamics_, here, s.impact)) return false;
  const StatePoint after{here.t, s.impact.after, here.angles, motion()};
  if (!dynamics_.evaluate(after.t, after.y, after.angles, ydot_)) return false;
  s.f_after = ydot_;
  event_.jump_of_costs.setZero(static_cast<Eigen::Index>(costs_.size()));
  for (std::size_t o = 0; o < costs_.size(); ++o)
    if (const PointCost* const running = costs_[o].running.get())
      event_.jump_of_costs(static_cast<Eigen::Index>(o)) = running->value(here) - running->value(after);
  for (Eigen::VectorXd* x : {&event_.g_y, &s.r_y, &s.c_y}) x->setZero(here.y.size());
  for (Eigen::VectorXd* x : {&event_.g_rho, &s.r_rho, &s.c_rho}) x->setZero(g_.rho.size());
  double of_time = 0;
  switches.add_gradient(event.of, here, 1, event_.g_y, event_.g_rho, of_time);
  if (!passes(here, s.f_before, of_time, true)) return false;
  switches.add_rate_gradient(event.of, here, s.r_y, s.r_rho);
  Eigen::VectorXd moved = here.y;
  moved.tail(s.impact.w.size()) = s.impact.w;
  switches.add_rate_gradient(event.of, {here.t, moved, here.angles}, s.c_y, s.c_rho);
  s.e = switches.limit(event.of).e;
  s.slot_e = switches.limit(event.of).slot_e;
  return true;
}

bool Sweep::linearise_pushed(Switches& switches, const SwitchEvent& event, const StatePoint& before, double mu) {
  switches.push(event.of, mu);
  return dynamics_.evaluate(before.t, before.y, before.angles, ydot_) &&
         dynamics_.linearise(before.t, before.y, before.angles, ydot_.tail(ydot_.size() / 2),
                             Eigen::VectorXd(dynamics_.lambda()));
}

void Sweep::add_to(SimulationStatistics& s) const {
  if (watch_) watch_->add_to(s);
  if (grazing_) s.grazing = grazing_;
  s.linearised_states += dynamics_.linearised_states() + (implicit_ ? implicit_->places() : 0) +
                         (rosenbrock_ ? rosenbrock_->linearised_states() : 0);
  s.factorisations += dynamics_.factorisations() + projector_->factorisations() +
                      (implicit_ ? implicit_->factorisations() : 0) + (rosenbrock_ ? rosenbrock_->factorisations() : 0);
}

}  // namespace mbsopt
