#include "core/mechanism/coupling.hpp"

#include <algorithm>
#include <numeric>

#include "core/constraint/constraint.hpp"
#include "core/force/forces.hpp"

namespace mbsopt {
namespace {

using Bodies = std::vector<int>;

// The bodies that a sensor of the state reads. Forces cannot read accelerations and reactions, so these are left out.
Bodies read_by(const MechanismData& data, const SensorPtr& sensor) {
  Bodies read = sensor->bodies(data);
  if (!read.empty()) return read;
  read.resize(at(data.n));
  std::iota(read.begin(), read.end(), 1);
  return read;
}

void add(const Bodies& from, Bodies& to) {
  std::ranges::copy_if(from, std::back_inserter(to), [](int body) { return body > 0; });
}

void sort_unique(Bodies& bodies) {
  std::sort(bodies.begin(), bodies.end());
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
}

}  // namespace

Coupling coupling(const MechanismData& data) {
  Coupling c;
  c.bodies.resize(at(data.n));
  c.rows.resize(at(data.m));
  auto couple = [&](const Bodies& loaded, const Bodies& read) {
    for (const int body : loaded) {
      if (body > 0) add(read, c.bodies[at(body - 1)]);
    }
  };
  for (int i = 1; i <= data.n; ++i) couple({i}, {i});
  for (const Constraint& k : data.constraints) {
    for (int r = 0; r < k.rows(); ++r) add({k.body1, k.body2}, c.rows[at(k.row + r)]);
    couple({k.body1, k.body2}, {k.body1, k.body2});  // J'lambda
  }
  data.forces->for_each([&](const auto& f) {
    const auto [i, j] = f.bodies();
    couple({i, j}, {i, j});
  });
  for (const AppliedForce& f : data.applied) {
    couple({f.body}, {f.body});
    for (const int s : f.sensors) couple({f.body}, read_by(data, data.sensors[at(s)]));
  }
  for (const UserForceData& f : data.user_forces) couple(f.bodies, f.bodies);
  for (Bodies& b : c.bodies) sort_unique(b);
  for (Bodies& b : c.rows) sort_unique(b);
  return c;
}

bool depends_on_state(const AppliedForce& force) {
  if (!force.sensors.empty()) return true;
  return force.is_torque ? !force.in_body_axes : force.in_body_axes || !force.s.isZero(0);
}

long derivative_blocks(const MechanismData& d) {
  return d.n + static_cast<long>(d.groups.size() + d.forces->size() + d.user_forces.size()) +
         static_cast<long>(std::count_if(d.applied.begin(), d.applied.end(), depends_on_state));
}

}  // namespace mbsopt
