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
  read.resize(static_cast<std::size_t>(data.n));
  std::iota(read.begin(), read.end(), 1);
  return read;
}

void add(const Bodies& from, Bodies& to) {
  for (const int body : from) {
    if (body > 0) to.push_back(body);
  }
}

void sort_unique(Bodies& bodies) {
  std::sort(bodies.begin(), bodies.end());
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
}

}  // namespace

Coupling coupling(const MechanismData& data) {
  Coupling c;
  c.bodies.resize(static_cast<std::size_t>(data.n));
  c.rows.resize(static_cast<std::size_t>(data.m));
  auto couple = [&](const Bodies& loaded, const Bodies& read) {
    for (const int body : loaded) {
      if (body > 0) add(read, c.bodies[static_cast<std::size_t>(body) - 1]);
    }
  };
  for (int i = 1; i <= data.n; ++i) couple({i}, {i});
  for (const Constraint& k : data.constraints) {
    for (int r = 0; r < k.rows(); ++r) add({k.body1, k.body2}, c.rows[static_cast<std::size_t>(k.row + r)]);
    couple({k.body1, k.body2}, {k.body1, k.body2});  // J'lambda
  }
  data.forces->for_each([&](const auto& f) {
    const auto [i, j] = f.bodies();
    couple({i, j}, {i, j});
  });
  for (const AppliedForce& f : data.applied) {
    couple({f.body}, {f.body});
    for (const int s : f.sensors) couple({f.body}, read_by(data, data.sensors[static_cast<std::size_t>(s)]));
  }
  for (const UserForceData& f : data.user_forces) couple(f.bodies, f.bodies);
  for (Bodies& b : c.bodies) sort_unique(b);
  for (Bodies& b : c.rows) sort_unique(b);
  return c;
}

}  // namespace mbsopt
