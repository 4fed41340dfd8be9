#include "core/event/impact.hpp"

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

bool set_impact(Switches& switches, std::size_t limit, Dynamics& dynamics, const StatePoint& before, Impact& impact) {
  constexpr double kAbove = 1e3;       // three digits less of the accelerations' rounding
  constexpr double kNoMotion = 1e-12;  // of the gap, of its gradient times the change of all velocities
  const Eigen::Index n = before.y.size() / 2;
  Eigen::VectorXd ydot(2 * n), none(n);
  const auto accelerations = [&](double mu, Eigen::VectorXd& a) {
    switches.push(limit, mu);
    const bool found = dynamics.evaluate(before.t, before.y, before.angles, ydot);
    switches.push(limit, 0);
    a = ydot.tail(n);
    return found;
  };
  if (!accelerations(0, none) || !accelerations(1, impact.w)) return false;
  const double size = none.lpNorm<Eigen::Infinity>(), change = (impact.w - none).lpNorm<Eigen::Infinity>();
  impact.mu = size > 0 && change > 0 ? kAbove * size / change : 1;
  if (!accelerations(impact.mu, impact.w) || !accelerations(-impact.mu, none)) return false;
  impact.w = (impact.w - none) / (2 * impact.mu);
  impact.after = before.y;
  impact.after.tail(n) = impact.w;
  Eigen::VectorXd G = Eigen::VectorXd::Zero(2 * n), rho_bar = Eigen::VectorXd::Zero(switches.mechanism().parameters());
  impact.c = switches.add_rate_gradient(limit, {before.t, impact.after, before.angles}, G, rho_bar);
  impact.r = switches.rate(limit, before);
  if (!(impact.c > kNoMotion * G.tail(n).cwiseAbs().dot(impact.w.cwiseAbs()))) return false;
  impact.Ln = -(1 + switches.limit(limit).e) * impact.r / impact.c;
  impact.after.tail(n) = before.y.tail(n) + impact.Ln * impact.w;
  return true;
}

}  // namespace mbsopt
