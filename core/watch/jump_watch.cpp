#include "core/watch/jump_watch.hpp"

#include <algorithm>
#include <cmath>

#include "core/body/hermite.hpp"
#include "core/expression/program_switches.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {
namespace {

constexpr double kMiddle = 0.471;                             // not half: jumps are at round times
constexpr double kFar = 1e-2, kNear = 1e-4, kNearest = 1e-6;  // from the zero, of the interval
constexpr double kRetained = 0.5;    // of the far difference by the near one: |x|^0.15 keeps it, a kink 0.01
constexpr double kLeastJump = 1e-6;  // of the value: cancellation next to sin(x)/x is less
constexpr int kBisections = 60;      // to the rounding of theta
constexpr double kLeastBend = 1e-6;  // change of slope over a step, of the value
constexpr double kRoot = 0.05;       // as kRetained: x^1.5 from a contact on keeps 0.1 of its bend, x^2 0.01
constexpr double kTurn = 0.1;        // away from its chord, of the change over a step
constexpr int kMostTries = 100;      // of switches at which nothing jumps

double sign_of(double x) { return x > 0 ? 1 : (x < 0 ? -1 : 0); }

}  // namespace

JumpWatch::JumpWatch(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                     MotionSource* motion, std::vector<Jump>& found)
    : mechanism_(mechanism),
      motion_(motion),
      apart_(kApart * (settings.end_time - settings.start_time)),
      found_(found) {
  const MechanismData& d = mechanism_.data();
  if (d.active.empty()) return;
  // A mechanism and its laws are compiled at each rho; so are the switches of the laws.
  const auto add_law = [&](Jump::Owner owner, int index, const Program& p, Inputs of, ForcePlace place = {}) {
    add({.of = owner, .index = index}, p, switches_of(p), of, place);
  };
  d.forces->for_each([&]<class Kind>(const Kind& f, ForcePlace place) {
    if constexpr (HasLaw<Kind>)
      if (f.law.program) add_law(Jump::Owner::force, f.force, *f.law.program, Inputs::law, place);
  });
  for (const AppliedForce& f : d.applied)
    for (const Program& component : f.components) add_law(Jump::Owner::force, f.force, component, Inputs::sensors);
  for (const RowLaw& law : d.laws)
    if (law.drive >= 0 && law.law.programs)
      add_law(Jump::Owner::drive, law.drive, (*law.law.programs)[2], Inputs::time);
  for (const Cost& cost : costs)
    if (const SwitchedProgram* p = cost.running ? cost.running->program() : nullptr)
      add({.of = Jump::Owner::objective, .objective = cost.name}, p->program, p->switches, Inputs::sensors);
}

bool JumpWatch::Function::is_new(const Switch& s) const {
  const auto is_known = [&](int k) { return std::find(parameters.begin(), parameters.end(), k) != parameters.end(); };
  if (s.searches > kMostTries) return false;
  return (s.motion && !motion) || !std::all_of(s.parameters.begin(), s.parameters.end(), is_known);
}

void JumpWatch::add(const Jump& jump, const Program& program, std::span<const Program> switches, Inputs of,
                    ForcePlace place) {
  const MechanismData& d = mechanism_.data();
  const int P = static_cast<int>(d.rho.size());
  const int time = of == Inputs::law ? P + 2 : P;
  Function f{jump, &program, of, place, {}, {}, false, false};
  for (const Program& p : switches) {
    Switch s{{}, {}, false, 0, 0, 0};
    bool varies = false;
    for (const int input : p.used_inputs()) {
      varies = varies || input >= P;
      s.motion = s.motion || (input >= P && input != time);
      if (input < P && std::find(d.active.begin(), d.active.end(), input) != d.active.end())
        s.parameters.push_back(input);
    }
    if (!varies || (s.parameters.empty() && !s.motion)) continue;
    p.grow(scratch_);
    s.program = p;
    f.switches.push_back(std::move(s));
  }
  if (f.switches.empty()) return;
  program.grow(scratch_);
  const std::size_t inputs = static_cast<std::size_t>(of == Inputs::sensors ? P + 1 + mechanism_.sensors() : time + 1);
  inputs_.resize(std::max(inputs_.size(), inputs));
  functions_.push_back(std::move(f));
}

void JumpWatch::set_inputs(const Function& f, const StatePoint& at) {
  const MechanismData& d = mechanism_.data();
  const std::size_t P = static_cast<std::size_t>(d.rho.size());
  std::copy(d.rho.begin(), d.rho.end(), inputs_.begin());
  inputs_[P] = at.t;
  if (f.of == Inputs::law) {
    d.forces->visit_law(f.place, [&](const auto& force) {
      const auto [i, j] = force.bodies();
      const auto [x, xdot] = force.measured(at.angles, body_at(at.y, i), body_at(at.y, j));
      inputs_[P] = x;
      inputs_[P + 1] = xdot;
      inputs_[P + 2] = at.t;
    });
  } else if (f.of == Inputs::sensors) {
    for (const int input : f.program->used_inputs())
      if (const int sensor = input - static_cast<int>(P) - 1; sensor >= 0)
        inputs_[static_cast<std::size_t>(input)] = mechanism_.sensor_value(sensor, at);
  }
}

std::string JumpWatch::begin(const StatePoint& at) {
  t0_ = at.t;
  y0_ = at.y;
  angles_ = at.angles;
  for (Function& f : functions_) {
    set_inputs(f, {at.t, at.y, at.angles, motion_});
    for (Switch& s : f.switches) s.last = sign_of(s.program.value(inputs_, scratch_));
  }
  return {};
}

void JumpWatch::set_inputs_at(double theta, const Function& f) {
  hermite(y0_, y1_, t1_ - t0_, theta, y_);
  set_inputs(f, {t0_ + theta * (t1_ - t0_), y_, angles_, motion_});
}

double JumpWatch::value(const Function& f, const Program& p, double theta) {
  set_inputs_at(theta, f);
  return p.value(inputs_, scratch_);
}

// The sign is s.now at `to`, and the other one at `from`.
bool JumpWatch::search(Function& f, Switch& s, double from, double to) {
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (from + to);
    (sign_of(value(f, s.program, middle)) == s.now ? to : from) = middle;
  }
  ++s.searches;
  struct Change {
    double jump, bend;
  };
  double size = 0;
  const auto change = [&](double distance) -> Change {
    const double before = value(f, *f.program, to - distance), after = value(f, *f.program, to + distance);
    size = std::max({size, std::abs(before), std::abs(after)});
    return {std::abs(after - before), std::abs(before - 2 * value(f, *f.program, to) + after) / distance};
  };
  const Change far = change(kFar), near = change(kNear), nearest = change(kNearest);  // a narrow peak hides from far
  const bool jumps =
      near.jump > kLeastJump * size && near.jump >= kRetained * far.jump && nearest.jump >= kRetained * near.jump;
  const bool kink = near.bend > kLeastBend * size && near.bend >= kRoot * far.bend;
  // A smooth function may turn within the interval, too, so that stages do not resolve its slope.
  const double f0 = value(f, *f.program, 0), f1 = value(f, *f.program, 1);
  double turn = 0;
  for (const double theta : {0.25, 0.75})
    turn = std::max(turn, std::abs(value(f, *f.program, theta) - (1 - theta) * f0 - theta * f1));
  const bool bends = kink || turn > kTurn * std::abs(f1 - f0);
  if (!std::isfinite(size) || !(jumps || (bends && !f.bends))) return false;
  f.jump.size = jumps ? near.jump : 0;
  f.jump.t = t0_ + to * (t1_ - t0_);
  f.jump.parameters = s.parameters;
  f.jump.motion = s.motion;
  found_.push_back(f.jump);
  if (!jumps) return f.bends = true;
  f.parameters.insert(f.parameters.end(), s.parameters.begin(), s.parameters.end());
  f.motion = f.motion || s.motion;
  return true;
}

std::string JumpWatch::look_at(const SeenStep& step) {
  const StatePoint& at = step.to;
  if (at.t < t0_ + apart_) return {};
  t1_ = at.t;
  y1_ = at.y;
  look_at_directions();
  for (Function& f : functions_) {
    if (f.switches.empty()) continue;
    bool found = false;
    double from = 0;
    for (const double theta : {kMiddle, 1.0}) {
      set_inputs_at(theta, f);  // once for all switches: a sensor may need the equations of motion
      for (Switch& s : f.switches) s.now = sign_of(s.program.value(inputs_, scratch_));
      for (Switch& s : f.switches) {
        if (s.now * s.last < 0 && f.is_new(s)) found = search(f, s, from, theta) || found;
        if (s.now != 0) s.last = s.now;
      }
      from = theta;
    }
    if (found) std::erase_if(f.switches, [&](const Switch& s) { return !f.is_new(s); });
  }
  t0_ = t1_;
  y0_ = y1_;
  angles_ = at.angles;
  return {};
}

void JumpWatch::look_at_directions() {
  constexpr double kTurned = 0.5;  // the cosine
  for (const TsdaForce& f : mechanism_.data().forces->of<TsdaForce>()) {
    const auto direction = [&](const Eigen::VectorXd& y) { return f.span(body_at(y, f.body1), body_at(y, f.body2)).u; };
    const auto is_known = [&](const Jump& j) {
      return j.size == 0 && j.of == Jump::Owner::force && j.index == f.force;
    };
    if (f.is_k_times_d() || direction(y0_).dot(direction(y1_)) > kTurned || std::ranges::any_of(found_, is_known))
      continue;
    found_.push_back({.of = Jump::Owner::force, .index = f.force, .t = t1_, .motion = true});
  }
}

}  // namespace mbsopt
