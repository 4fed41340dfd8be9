#include "core/driven/driven_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/interpolators/barycentric_rational.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "core/body/hermite.hpp"
#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/driven/singular_position.hpp"
#include "core/driven/timed_instants.hpp"
#include "core/integrate/model_choice.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/run/run_ends.hpp"
#include "core/watch/zero_length.hpp"

namespace mbsopt {
namespace {

// The least number of panels of a run. A peak of a sixtieth of the run then meets a node, and the panels resolve it.
constexpr double kFewestPanels = 4;
// A panel turns bodies by at most so many steps of the path. Its 15 nodes then need no steps between them.
constexpr double kStepsPerPanel = 8;
// A stretch of a panel that takes so many steps of the path is too long: the speed in it grows without bound.
constexpr long kMostStepsOfStretch = 32 * static_cast<long>(kStepsPerPanel);
// Two ends of a path are the same if they differ by less than this part of the rest of the run, which is far more than
// the shortest panel.
constexpr double kSameEnd = 1e-6;
// A running cost is evaluated at instants at most this part of the run apart, and at most max_step. A peak of this
// width meets one of them. The nodes of eight panels are that near.
constexpr double kApart = 1.0 / 75;
// A running cost that differs from the polynomial through the nodes by this part of its size has a peak between them.
// Smooth costs differ less: a panel turns bodies by 1.6 rad, Hermite's cubic over a tenth of it errs by 1e-4.
constexpr double kPeak = 1e-3;
// A panel of any length may be off by this part of rtol times the integral so far: it may hold a kink or a jump.
constexpr double kPartOfRun = 0.1;

// Returns whether a parameter moves a body, or a point of a joint, out of the plane.
bool moves_out_of_plane(const MechanismData& d) {
  if (d.active.empty()) return false;
  const PlanarModel& plane = *d.planar;
  const auto moves = [&](int slot, const auto& normal) {
    if (slot < 0) return false;
    constexpr double kRounding = 1e-14;  // of unit axes, in d theta/d rho
    return (normal.transpose() * d.theta_rho.middleRows(slot, normal.size())).cwiseAbs().maxCoeff() >
           kRounding * d.theta_rho.middleRows(slot, normal.size()).cwiseAbs().maxCoeff();
  };
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[at(i)];
    const PlanarBody& seen = plane.bodies[at(i)];
    Eigen::Matrix4d in_plane = seen.p_a * seen.p_a.transpose() + seen.p_b * seen.p_b.transpose();
    if (moves(body.slot_com, seen.n) || moves(body.slot_velocity, Vec<3>(Vec<3>::Unit(plane.n)))) return true;
    if (body.slot_angular_velocity >= 0) return true;
    if (body.slot_q < 0) continue;
    if (moves(body.slot_q, Vec<3>(Vec<3>::Unit(plane.n)))) return true;
    const Eigen::Matrix4d out = Eigen::Matrix4d::Identity() - in_plane;
    for (int k = 0; k < 4; ++k)
      if (moves(body.slot_q + 3, Vec<4>(out.col(k)))) return true;
  }
  return std::ranges::any_of(d.constraints, [&](const Constraint& c) {
    const Vec<3> n1 = plane.bodies[at(c.body1)].n, n2 = plane.bodies[at(c.body2)].n;
    return moves(c.slot1, n1) || moves(c.slot2, n2) || moves(c.slot3, n1) || moves(c.slot3, n2);
  });
}

// In a plane, positions out of it are those of the assembly. If a parameter moves them, the run is spatial.
Model model_for(const Mechanism& mechanism, const SimulationSettings& settings) {
  const Model model = model_of(mechanism, settings, *runge_kutta_method(settings.integrator.type));
  return model == Model::planar && moves_out_of_plane(mechanism.data()) ? Model::spatial : model;
}

}  // namespace

DrivenRun::DrivenRun(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                     std::span<const double> observed, const RunOptions& options, const Assembly& start,
                     bool differentiated, MotionSource* motion)
    : mechanism_(mechanism),
      settings_(settings),
      costs_(costs),
      options_(options),
      frozen_(options.frozen),
      path_(mechanism, model_for(mechanism, settings)),
      schedule_(costs, observed, settings.end_time),
      law_jumps_(mechanism.data()),
      differentiated_(differentiated),
      events_({}, settings.start_time, settings.end_time),
      shortest_(1e-9 * std::max(1e-3, settings.end_time - settings.start_time)),
      h_(settings.end_time - settings.start_time),
      switches_(mechanism, costs),
      result_(result_at_start(start, settings.start_time, costs.size())) {
  if (!motion && mechanism.data().needs_motion) motion = &motion_.emplace(mechanism, settings.formulation);
  if (motion) continued_.emplace(*motion, [this](double t) { return window_at(t); });
  result_.statistics.solved = true;
  for (std::size_t o = 0; o < costs.size(); ++o)
    if (costs[o].running) running_.push_back({&costs[o], static_cast<Eigen::Index>(o)});
  std::vector<double> events = settings.events;
  if (!running_.empty()) nodes_.resize(kNodes);
  if (!running_.empty() && !frozen_)
    instants_ = timed_instants(mechanism, costs, settings.start_time, settings.end_time, shortest_, events);
  events_ = EventTimes(events, settings.start_time, settings.end_time);
  path_.start(settings.start_time, settings.end_time, start.result().y, start.result().angles);
  path_.set_watch([&d = mechanism_.data(), differentiated](const DrivenState& from, const DrivenState& to) {
    std::string words = past_half_turn(d, from.y, to.t, to.y);
    return words.empty() && differentiated ? through_zero_length(d, from.t, from.y, to.t, to.y) : words;
  });
}

bool DrivenRun::go_to(double t) { return path_.go_to(t, shortest_, kMostStepsOfStretch); }

void DrivenRun::stop_where_it_ends() {
  if (!path_.objection().empty()) return result_.stop(SimulationStatus::not_credible, path_.objection());
  result_.stop(SimulationStatus::step_too_small, why_stuck(mechanism_, settings_, path_.state().t, path_.state().y));
}

SimulationResult DrivenRun::finish() {
  result_.statistics.factorisations += path_.factorisations();
  return std::move(result_);
}

void DrivenRun::go(const Take& take, const std::function<void(const StepInside&)>& look_inside) {
  const Energy e = energy(mechanism_.data(), path_.state().y, path_.state().angles);
  result_.statistics.energy_initial = result_.statistics.energy_final = e.kinetic + e.potential;
  go_through_panels(take, look_inside);
  result_.y_end = path_.state().y;
  if (!result_.ok()) return;
  if (!take_terminal_costs(take)) return stop_at_singular_matrix();
  if (result_.psi.allFinite()) return;
  const std::string singular = in_words(result_.statistics.singular, {});
  result_.stop(SimulationStatus::not_finite,
               not_finite_costs(costs_, result_.psi) + (singular.empty() ? "" : "; " + singular));
}

void DrivenRun::go_through_panels(const Take& take, const std::function<void(const StepInside&)>& look_inside) {
  const double end = settings_.end_time;
  if (is_too_fast()) return;
  if (differentiated_ && !frozen_) {
    jumps_.emplace(mechanism_, settings_, costs_, continued(), result_.statistics.jumps);
    jumps_->begin(point());
  }
  std::span<const SampleEvent> at_start = schedule_.take(path_.state().t);
  if (!take_events_until(INFINITY, at_start, take)) return stop_at_singular_matrix();
  std::vector<double>& begun = result_.steps.times;  // one for each panel
  while (path_.state().t < end && !(frozen_ && begun.size() >= frozen_->times.size())) {
    from_ = path_.state();
    const double t = from_.t, t1 = next_end();
    const Panel outcome = try_panel(t1);
    if (outcome == Panel::refused || (outcome == Panel::stuck && !frozen_ && path_.state().t - t > shortest_)) {
      try_shorter(outcome, t1);
      continue;
    }
    if (outcome == Panel::stuck) return stop_where_it_ends();
    if (path_.steps() > settings_.integrator.max_steps) {
      return result_.stop(
          SimulationStatus::too_many_steps,
          fmt::format("more than {} positions were needed until t = {:.6g} s (integrator.max_steps). Look for a "
                      "pole of the law of a drive; is it in rad and s?",
                      settings_.integrator.max_steps, t));
    }
    double resume = events_.reached(t1) ? events_.resume_time() : t1;
    if (std::string jump = frozen_ ? std::string() : law_jumps_.between(t, resume); !jump.empty())
      return result_.stop(SimulationStatus::not_credible, std::move(jump));
    if (!take_panel(t1, take)) return stop_at_singular_matrix();
    if (look_inside) show_panel(look_inside);
    end_panel(t, t1);
    if (jumps_) jumps_->look_at({point_of(from_), point()});
    report_step(point(), options_, result_);
    if (!result_.ok()) return;
    h_ *= 2;
    if (frozen_) resume = begun.size() < frozen_->times.size() ? frozen_->times[begun.size()] : t1;
    if (!go_to(resume)) return stop_where_it_ends();
  }
  add_quadrature_errors();
}

// Ends a run in which the drives turn a body so fast at the start that its steps would not suffice.
bool DrivenRun::is_too_fast() {
  const long most = settings_.integrator.max_steps;
  const double t = path_.state().t;
  if (!(settings_.end_time - t > static_cast<double>(most) * path_.step_limit())) return false;
  result_.stop(
      SimulationStatus::too_many_steps,
      fmt::format("at t = {:.6g} s the drives turn a body so fast that the motion until {:.6g} s takes more steps "
                  "than simulation.integrator.max_steps, {}. Is the law in rad and s?",
                  t, settings_.end_time, most));
  return true;
}

double DrivenRun::next_end() {
  const double t = from_.t, end = settings_.end_time;
  if (frozen_) {
    const std::size_t panel = result_.steps.times.size();
    const bool last = panel + 1 == frozen_->times.size() && frozen_->to_the_end;
    return last ? end : frozen_->times[panel] + frozen_->sizes[panel];
  }
  const double stop_at = kink_ > t ? std::min(kink_, events_.stop_after(t)) : events_.stop_after(t);
  h_ = std::min(h_, largest_panel());
  const double t1 = resolved_until(instants_, t, h_ >= (stop_at - t) * (1 - 1e-12) ? stop_at : t + h_);
  // Without integrals a panel ends at the next event, so that no part of the path is solved twice.
  const double event = schedule_.next_time();
  return running_.empty() && event > t ? std::min(t1, event) : t1;
}

// The instant after which a switch of a running cost has another sign, in the panel whose nodes are known. The search
// follows the path. Returns -INFINITY if there is none.
double DrivenRun::first_kink() {
  for (std::size_t k = 1; k < nodes_.size(); ++k) {
    double first = INFINITY;
    for (std::size_t s = 0; s < switches_.count(); ++s) {
      const auto at = [&](const DrivenState& state) { return switches_.value(s, point_of(state)); };
      const double before = at(nodes_[k - 1]), after = at(nodes_[k]);
      if (!(before * after < 0)) continue;
      bool found = true;
      const auto value = [&](double t) {
        if (path_.state().t > t) path_.start(nodes_[k - 1]);
        found = found && go_to(t);
        return at(path_.state());
      };
      const auto near = [&](double a, double b) { return b - a <= shortest_ || !found; };
      path_.start(nodes_[k - 1]);
      std::uintmax_t most = 60;  // bisection needs 30
      const auto ends =
          boost::math::tools::toms748_solve(value, nodes_[k - 1].t, nodes_[k].t, before, after, near, most);
      if (found) first = std::min(first, ends.second);
    }
    if (first < INFINITY) return first;
  }
  return -INFINITY;
}

// Other steps may pass where the path ended. If it ends there again, so does the panel.
void DrivenRun::try_shorter(Panel outcome, double t1) {
  const double t = from_.t, reached = path_.state().t;
  ++result_.statistics.rejected;
  ++result_.statistics.rejections.error_test;
  const bool is_stuck = outcome == Panel::stuck;
  const double kink = is_stuck ? -INFINITY : first_kink();
  path_.start(from_);
  const bool ends = is_stuck && std::abs(reached - ended_at_) <= kSameEnd * (settings_.end_time - t);
  if (is_stuck) ended_at_ = reached;
  if (kink > t + shortest_)
    kink_ = kink;
  else
    h_ = ends ? reached - t : (t1 - t) / 2;
}

void DrivenRun::stop_at_singular_matrix() {
  if (!result_.ok()) return;  // the path ended before
  result_.stop(SimulationStatus::not_finite,
               fmt::format("the derivatives met a matrix that cannot be factored at t = {:.6g} s: a singular position?",
                           path_.state().t));
}

// The shortest panels were accepted without a test: they may hold an integrable singularity.
void DrivenRun::add_quadrature_errors() {
  SimulationStatistics& s = result_.statistics;
  for (const Integral& r : running_) {
    if (r.of->rtol > 0) continue;
    QuadratureError& worst = r.of->is_extreme ? s.extreme_quadrature : s.quadrature;
    if (r.error > worst.error * r.absolute) worst = {r.error / r.absolute, r.of->name, r.worst_t};
  }
}

double DrivenRun::largest_panel() const {
  return std::min((settings_.end_time - settings_.start_time) / kFewestPanels,
                  (running_.empty() ? 1 : kStepsPerPanel) * path_.step_limit());
}

// Computes the states and running costs at the nodes, and decides whether the integrals are exact enough.
DrivenRun::Panel DrivenRun::try_panel(double t1) {
  const double t = from_.t, h = t1 - t;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    if (!go_to(t + kronrod_rule().nodes[k] * h)) return Panel::stuck;
    nodes_[k] = path_.state();
    for (Integral& r : running_) r.g[k] = noted(r.objective, r.of->running->value(point_of(nodes_[k])), nodes_[k].t);
  }
  if (!go_to(t1)) return Panel::stuck;
  for (Integral& r : running_) {
    std::array<double, kNodes> g = r.g;
    double shortest = shortest_;
    for (std::size_t k = 0; k < kNodes; ++k) {
      if (!is_left_out(g[k], nodes_[k].t)) continue;
      g[k] = 0;
      shortest = window_at(nodes_[k].t)->half;
    }
    r.panel = integrate_panel(g, h);
    if (frozen_ || h <= shortest) continue;
    if (r.panel.error > allowed_error(r, h)) return Panel::refused;  // the end of the run reports NaN
  }
  return !frozen_ && hides_a_peak(h) ? Panel::refused : Panel::accepted;
}

double DrivenRun::allowed_error(const Integral& r, double h) const {
  const IntegratorSettings& s = settings_.integrator;
  // Exponentials of smooth extremes have any size, so atol does not apply to them.
  const double rtol = std::max(s.rtol, r.of->rtol);
  const double of_panel = rtol * r.panel.absolute + (r.of->is_extreme ? 0 : s.atol * h);
  return std::max(of_panel, kPartOfRun * rtol * (r.absolute + r.panel.absolute));
}

// A peak as wide as the distance of the instants, which differs by D from the polynomial there, adds D times the
// distance to the integral.
bool DrivenRun::hides_a_peak(double h) {
  const double apart =
      std::min(kApart * (settings_.end_time - settings_.start_time), settings_.integrator.max_step.value_or(INFINITY));
  const auto& c = kronrod_rule().nodes;
  std::vector<boost::math::barycentric_rational<double>> P;  // of the highest order: polynomials through all nodes
  std::vector<double> sizes;                                 // of the running costs
  for (const Integral& r : running_) {
    std::vector<double> x(c.begin(), c.end()), g(r.g.begin(), r.g.end());
    sizes.push_back(std::abs(*std::ranges::max_element(g, {}, [](double v) { return std::abs(v); })));
    P.emplace_back(std::move(x), std::move(g), kNodes - 1);
  }
  for (std::size_t k = 1; k < nodes_.size(); ++k) {
    const DrivenState &a = nodes_[k - 1], &b = nodes_[k];
    const double gap = b.t - a.t, parts = std::ceil(gap / apart);
    for (double j = 1; j < parts; ++j) {
      const double t = a.t + j / parts * gap;
      hermite(a.y, b.y, gap, j / parts, y_);
      const StatePoint between{t, y_, a.angles, continued()};
      for (std::size_t r = 0; r < running_.size(); ++r) {
        const double g = running_[r].of->running->value(between), D = std::abs(g - P[r]((t - from_.t) / h));
        if (D > kPeak * std::max(sizes[r], std::abs(g)) && D * gap / parts > allowed_error(running_[r], h)) return true;
      }
    }
  }
  return false;
}

double DrivenRun::noted(Eigen::Index objective, double value, double t) {
  if (is_left_out(value, t))
    singular_at(t).note("objective '" + costs_[static_cast<std::size_t>(objective)].name + "'");
  return value;
}

void DrivenRun::count(const DrivenTerm& term, double value, double t) {
  if (term.counts) result_.psi(term.objective) += noted(term.objective, value, t);
}

SingularPosition& DrivenRun::singular_at(double t) {
  std::vector<SingularPosition>& known = result_.statistics.singular;
  const SingularWindow& w = *window_at(t);
  const auto same = std::ranges::find(known, w.t, &SingularPosition::t);
  if (same != known.end()) return *same;
  known.push_back(singular_position(mechanism_, w.t, w.state_at(w.t).y));
  known.back().half = w.half;
  return known.back();
}

// Notes that a state which is asked for cannot be continued smoothly past a singular position.
void DrivenRun::note_uncertain() {
  std::vector<SingularPosition>& known = result_.statistics.singular;
  if (!path_.is_uncertain() || std::ranges::count(known, 0.0, &SingularPosition::half) > 0) return;
  known.push_back(singular_position(mechanism_, path_.state().t, path_.state().y));
}

bool DrivenRun::take_panel(double t1, const Take& take) {
  std::span<const SampleEvent> events = schedule_.take(t1);
  if (events.empty() && nodes_.empty()) return true;
  const DrivenState end = path_.state();
  if (!nodes_.empty() || events.front().time < t1) path_.start(from_);
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    if (!take_events_until(nodes_[k].t, events, take)) return false;
    path_.start(nodes_[k]);
    note_uncertain();
    at_instant_.clear();
    const double weight = (t1 - from_.t) * kronrod_rule().kronrod[k];
    for (const Integral& r : running_)
      if (!is_left_out(r.g[k], nodes_[k].t)) at_instant_.push_back({r.of->running.get(), r.objective, weight});
    if (!take(point(), at_instant_)) return false;
  }
  for (Integral& r : running_) {
    result_.psi(r.objective) += r.panel.value;
    r.absolute += r.panel.absolute;
    r.error += r.panel.error;
    if (r.panel.error > r.worst) {
      r.worst = r.panel.error;
      r.worst_t = from_.t;
    }
  }
  if (!take_events_until(INFINITY, events, take)) return false;
  path_.start(end);
  return true;
}

// States inside are solved from the last one before, or from the node before them.
void DrivenRun::show_panel(const std::function<void(const StepInside&)>& look_inside) {
  const DrivenState end = path_.state();
  std::vector<double> known{from_.t};
  for (const DrivenState& node : nodes_) known.push_back(node.t);
  known.push_back(end.t);
  path_.start(from_);
  look_inside({from_.t, end.t, known, [&](double t) {
                 const auto after = std::ranges::upper_bound(nodes_, t, {}, &DrivenState::t);
                 const DrivenState& before = t >= end.t ? end : after == nodes_.begin() ? from_ : *std::prev(after);
                 if (!(path_.state().t <= t && path_.state().t >= before.t)) path_.start(before);
                 if (!go_to(t)) y_.setConstant(mechanism_.states(), NAN);
                 return path_.state().t == t ? point() : StatePoint{t, y_, from_.angles, continued()};
               }});
  path_.start(end);
}

bool DrivenRun::take_events_until(double t, std::span<const SampleEvent>& events, const Take& take) {
  while (!events.empty() && events.front().time <= t) {
    const double time = events.front().time;
    if (!go_to(time)) {
      stop_where_it_ends();
      return false;
    }
    at_instant_.clear();
    for (; !events.empty() && events.front().time == time; events = events.subspan(1)) {
      const SampleEvent& e = events.front();
      at_instant_.push_back({e.cost, e.objective, 1, e.index, true});
    }
    if (!take_here(at_instant_, take)) return false;
  }
  return true;
}

bool DrivenRun::take_here(std::span<const DrivenTerm> terms, const Take& take) {
  note_uncertain();
  for (const DrivenTerm& term : terms) {
    if (term.cost) {
      if (!differentiated_) count(term, term.cost->value(point()), point().t);
    } else if (window_at(point().t) && continued_) {
      for (const std::string& name : lacking_sensors(mechanism_, point())) singular_at(point().t).note(name);
    }
  }
  return take(point(), terms);
}

bool DrivenRun::take_terminal_costs(const Take& take) {
  for (std::size_t o = 0; o < costs_.size(); ++o) {
    const DrivenTerm term{costs_[o].terminal.get(), static_cast<Eigen::Index>(o), 1, 0, true};
    if (term.cost && !take_here(std::span(&term, 1), take)) return false;
  }
  return true;
}

void DrivenRun::end_panel(double t0, double t1) {
  ++result_.statistics.steps;
  result_.steps.add(t0, t1 - t0);
  result_.last_good_time = t1;
  double relative = 0;
  const double position = path_.position_violation(&relative);
  const Energy e = energy(mechanism_.data(), path_.state().y, path_.state().angles);
  note_state(position, relative, path_.velocity_violation(), e, result_.statistics);
}

}  // namespace mbsopt
