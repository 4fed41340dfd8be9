#include "core/event/switches.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/expression/program_switches.hpp"
#include "core/expression/time_parts.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/program_sensors.hpp"
#include "core/mechanism/sensor_gradient.hpp"

namespace mbsopt {
namespace {

bool is_same(const Program& a, const Program& b) {
  const auto equal = [&](const Program::Instruction& x, const Program::Instruction& y) {
    if (x.operation != y.operation || x.a != y.a || x.b != y.b) return false;
    return x.operation == Operation::curve ? a.curve_of(x) == b.curve_of(y) : x.constant == y.constant;
  };
  return std::ranges::equal(a.code(), b.code(), equal);
}

}  // namespace

Switches::Switches(const Mechanism& mechanism, std::span<const Cost> costs, const SimulationSettings& settings)
    : given_(mechanism), given_costs_(costs), held_(mechanism) {
  const MechanismData& d = mechanism.data();
  for (const LimitData& limit : d.limits) {
    const SensorPtr gap = expression_sensor(d, limit.gap);
    switches_.push_back({limit.gap, Inputs::sensors, {}, gap, 1, {}, &limit, gap->rate(d)});
  }
  of_mechanism_ = switches_.size();
  if (settings.follows_kinks) add_programs(settings);
  add_decisions();
  if (switches_.empty()) return;
  own_ = std::make_shared<MechanismData>(d);
  own_->forces = std::make_shared<Forces>(*d.forces);
  held_ = Mechanism(own_);
  const auto rebind = [&](std::shared_ptr<const PointCost>& cost) {
    if (std::shared_ptr<const PointCost> bound = cost ? cost->bound_to(held_, nullptr) : nullptr) cost = bound;
  };
  own_costs_.assign(costs.begin(), costs.end());
  for (Cost& cost : own_costs_) {
    rebind(cost.running);
    rebind(cost.terminal);
    for (SampledCost& sample : cost.samples) rebind(sample.cost);
  }
}

void Switches::add_programs(const SimulationSettings& settings) {
  const MechanismData& d = given_.data();
  const int P = static_cast<int>(d.rho.size());
  d.forces->for_each([&]<class Kind>(const Kind& f, ForcePlace place) {
    if constexpr (HasLaw<Kind>) {
      if (!f.law.program) return;
      add(*f.law.program, Inputs::law, place, P + 2, [this, place](const Program& p) {
        own_->forces->change_law(place, [&](auto& force) { force.law.program = p; });
      });
    }
  });
  for (std::size_t i = 0; i < d.applied.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      add(d.applied[i].components[c], Inputs::sensors, {}, P,
          [this, i, c](const Program& p) { own_->applied[i].components[c] = p; });
  const auto jumps = [&](const Program& law) {
    std::vector<double> x(d.rho.begin(), d.rho.end());
    x.push_back(0);
    return !jumps_of(law, P, x, pieces_of(law, P, x, settings.start_time, settings.end_time)).empty();
  };
  for (std::size_t i = 0; i < d.laws.size(); ++i) {
    const auto& programs = d.laws[i].law.programs;
    if (!programs || branchings_of((*programs)[2], P, P).empty()) continue;
    if (jumps((*programs)[0]) || jumps((*programs)[1])) continue;  // an impact ends the run (law_jumps.hpp)
    add((*programs)[2], Inputs::sensors, {}, P, [this, i](const Program& p) {
      auto changed = std::make_shared<std::array<Program, 3>>(*own_->laws[i].law.programs);
      (*changed)[2] = p;
      own_->laws[i].law.programs = std::move(changed);
    });
  }
  of_mechanism_ = switches_.size();
  for (std::size_t o = 0; o < given_costs_.size(); ++o)
    if (const SwitchedProgram* const g = given_costs_[o].running ? given_costs_[o].running->program() : nullptr)
      add(g->program, Inputs::sensors, {}, P,
          [this, o](const Program& p) { own_costs_[o].running = given_costs_[o].running->bound_to(held_, &p); });
}

void Switches::add(const Program& program, Inputs of, ForcePlace force, int time,
                   std::function<void(const Program&)> replace) {
  std::vector<Branching> branchings = branchings_of(program, static_cast<int>(given_.rho().size()), time);
  if (branchings.empty()) return;
  Site site{&program, std::move(branchings), {}, std::move(replace)};
  for (Branching& branching : site.branchings) {
    site.switches.push_back(index_of(branching, of, force));
    std::vector<std::size_t>& sites = switches_[site.switches.back()].sites;
    if (sites.empty() || sites.back() != sites_.size()) sites.push_back(sites_.size());
  }
  sites_.push_back(std::move(site));
}

// A decision may depend on others, as of max(0, x + abs(t - ts)/(t - ts)). It jumps where they change.
void Switches::add_decisions() {
  for (std::size_t k = 0; k < switches_.size(); ++k) {
    const Switch& s = switches_[k];
    if (s.limit) continue;
    const auto function = std::make_shared<const Program>(s.function);
    decisions_.push_back(function);
    const int P = static_cast<int>(given_.rho().size());
    add(*function, s.of, s.force, s.of == Inputs::law ? P + 2 : P, [this, k](const Program& p) {
      Switch& changed = switches_[k];
      changed.sensor = changed.of == Inputs::law ? law_sensor(changed.force, p) : expression_sensor(given_.data(), p);
    });
  }
}

// Equal functions are one switch, and so are those of opposite sign.
std::size_t Switches::index_of(Branching& branching, Inputs of, ForcePlace force) {
  const Program opposite = negative_of(branching.decision);
  for (std::size_t k = 0; k < switches_.size(); ++k) {
    const Switch& s = switches_[k];
    if (s.limit || s.of != of || (of == Inputs::law && !(s.force == force))) continue;
    const bool same = is_same(s.function, branching.decision);
    if (!same && !is_same(s.function, opposite)) continue;
    branching.sign = same ? 1 : -1;
    return k;
  }
  const SensorPtr sensor =
      of == Inputs::law ? law_sensor(force, branching.decision) : expression_sensor(given_.data(), branching.decision);
  switches_.push_back({branching.decision, of, force, sensor});
  return switches_.size() - 1;
}

bool Switches::reads_motion(std::size_t k) const { return switches_[k].sensor->reads == Reads::motion; }

bool Switches::is_of_time(std::size_t k) const {
  const Switch& s = switches_[k];
  const int P = static_cast<int>(given_.rho().size()), time = s.of == Inputs::law ? P + 2 : P;
  return std::ranges::all_of(s.function.used_inputs(), [&](int input) { return input < P || input == time; });
}

double Switches::value(std::size_t k, const StatePoint& at) const {
  return switches_[k].sensor->evaluate(given_.data(), at, nullptr);
}

double Switches::add_gradient(std::size_t k, const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar,
                              double& t_bar) const {
  SensorGradient to{given_.data(), scale, y_bar, rho_bar, &t_bar};
  const double value = switches_[k].sensor->evaluate(given_.data(), at, &to);
  if (reads_motion(k)) at.motion->fold_bar(at, y_bar, rho_bar);
  return value;
}

double Switches::rate(std::size_t k, const StatePoint& at) const {
  return switches_[k].rate->evaluate(given_.data(), at, nullptr);
}

double Switches::add_rate_gradient(std::size_t k, const StatePoint& at, VecOut y_bar, VecOut rho_bar) const {
  SensorGradient to{given_.data(), 1, y_bar, rho_bar};
  return switches_[k].rate->evaluate(given_.data(), at, &to);
}

// The force resists a growing sensor.
void Switches::push(std::size_t k, double mu) {
  own_->forces->change_law(limit(k).force, [&](auto& force) { force.law.f0 = -limit(k).sign * mu; });
}

std::vector<double> Switches::zeros(std::size_t k, double start, double end) const {
  const Switch& s = switches_[k];
  const std::size_t P = static_cast<std::size_t>(given_.rho().size());
  std::vector<double> x(given_.rho().begin(), given_.rho().end());
  x.resize(P + 3);
  const std::size_t time = s.of == Inputs::law ? P + 2 : P;
  Program::Scratch scratch = s.function.scratch();
  const auto value = [&](double t) {
    x[time] = t;
    return s.function.value(x, scratch);
  };
  std::vector<double> found;
  const std::vector<double> pieces = pieces_of(s.function, static_cast<int>(time), x, start, end);
  constexpr int kLooks = 4;  // a cubic between two pieces turns twice
  double from = start;
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    for (int part = 1; part <= kLooks; ++part) {
      const double to = pieces[i - 1] + (pieces[i] - pieces[i - 1]) * part / kLooks;
      double low = from, high = to;
      const bool rises = value(high) > 0;
      from = to;
      if (value(low) == 0 || rises == (value(low) > 0)) continue;
      for (double middle = std::midpoint(low, high); middle > low && middle < high; middle = std::midpoint(low, high))
        ((value(middle) > 0) == rises ? high : low) = middle;
      found.push_back(high);
    }
  }
  return found;
}

double Switches::root(std::size_t k) const {
  double least = INFINITY;
  for (const std::size_t i : switches_[k].sites)
    for (std::size_t j = 0; j < sites_[i].branchings.size(); ++j) {
      const Branching& b = sites_[i].branchings[j];
      const bool reads = sites_[i].switches[j] == k && b.root < 2 && b.rises * b.sign * switches_[k].side >= 0;
      if (reads) least = std::min(least, b.root);
    }
  return least;
}

std::vector<int> Switches::sides() const {
  std::vector<int> all;
  for (const Switch& s : switches_) all.push_back(s.side);
  return all;
}

void Switches::hold(std::size_t k, int side) {
  if (switches_[k].side == side) return;
  switches_[k].side = side;
  for (const std::size_t i : switches_[k].sites) rebuild(sites_[i]);
}

void Switches::hold_all(std::span<const int> sides) {
  for (std::size_t k = 0; k < sides.size(); ++k) hold(k, sides[k]);
}

void Switches::rebuild(const Site& site) {
  sides_.clear();
  for (std::size_t i = 0; i < site.branchings.size(); ++i)
    sides_.push_back(site.branchings[i].sign * switches_[site.switches[i]].side);
  site.replace(with_branches(*site.given, site.branchings, sides_));
}

}  // namespace mbsopt
