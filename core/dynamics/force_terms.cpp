#include "core/dynamics/force_terms.hpp"

#include <algorithm>
#include <type_traits>

#include "core/body/state_layout.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/coupling.hpp"
#include "core/mechanism/sensor_gradient.hpp"

namespace mbsopt {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

ForceTerms::ForceTerms(const MechanismData& data) : data_(data) {
  const std::size_t P = static_cast<std::size_t>(data.rho.size());
  law_.inputs.resize(P + 3);
  law_.gradient.resize(P + 3);
  data.forces->for_each([&]<class Kind>(const Kind& f) {
    if constexpr (HasLaw<Kind>)
      if (f.law.program) f.law.program->grow(law_.program);
  });
  if (data.applied.empty()) return;
  inputs_.resize(P + 1 + data.sensors.size());
  for (std::vector<double>& gradient : gradients_) gradient.resize(inputs_.size());
  for (const AppliedForce& f : data.applied) {
    for (const Program& component : f.components) component.grow(program_);
  }
  y_bar_.setZero(StateLayout{data.n}.size());
  rho_bar_.setZero(data.rho.size());
}

template <class Visitor>
void ForceTerms::for_each(bool but_springs, Visitor&& visitor) const {
  data_.forces->for_each([&]<class Kind>(const Kind& f) {
    if (std::is_same_v<Kind, TsdaForce> && but_springs) return;
    const std::array<int, 2> bodies = f.bodies();
    visitor(f, index(bodies[0]), index(bodies[1]));
  });
}

void ForceTerms::set_inputs(const AppliedForce& f, const At& at) {
  const int t = static_cast<int>(data_.rho.size());
  for (const int k : f.parameters) inputs_[index(k)] = data_.rho(k);
  inputs_[index(t)] = at.t;
  for (const int s : f.sensors) {
    inputs_[index(t + 1 + s)] = evaluate(data_, data_.sensors[index(s)], at.t, at.y, at.angles);
  }
}

Vector3d ForceTerms::components(const AppliedForce& f, const At& at) {
  set_inputs(f, at);
  Vector3d c;
  for (int i = 0; i < 3; ++i) c(i) = f.components[index(i)].value(inputs_, program_);
  return c;
}

Vector3d ForceTerms::components_with_gradients(const AppliedForce& f, const At& at) {
  set_inputs(f, at);
  Vector3d c;
  for (int i = 0; i < 3; ++i) {
    std::vector<double>& gradient = gradients_[index(i)];
    std::fill(gradient.begin(), gradient.end(), 0.0);
    c(i) = f.components[index(i)].add_gradient(inputs_, 1.0, gradient, program_);
  }
  return c;
}

void ForceTerms::set_gradient(int sensor, const At& at) {
  y_bar_.setZero();
  rho_bar_.setZero();
  add_gradient(data_, data_.sensors[index(sensor)], at.t, at.y, at.angles, 1, y_bar_, rho_bar_);
}

void ForceTerms::add_loads(const At& at, std::vector<Vec<6>>& loads, bool but_springs) {
  const ForceInputs in = inputs(at);
  for_each(but_springs, [&](const auto& f, std::size_t i, std::size_t j) {
    f.add_load(in, at.frames[i], at.frames[j], loads[i], loads[j]);
  });
  for (const AppliedForce& f : data_.applied) {
    f.add_load(components(f, at), at.frames[index(f.body)], loads[index(f.body)]);
  }
}

void ForceTerms::mark_units(std::vector<bool>& bodies) const {
  for_each(false, [&](const auto&, std::size_t i, std::size_t j) { bodies[i] = bodies[j] = true; });
  for (const AppliedForce& f : data_.applied) bodies[index(f.body)] = true;
}

template <class Tangent>
void ForceTerms::add_pair(std::size_t body1, std::size_t body2, const std::vector<UnitTangents>& units,
                          MotionBlocks& out, Tangent&& tangent) {
  for (const bool first : {true, false}) {
    const std::size_t read = first ? body1 : body2;
    if (read == 0) continue;
    auto add = [&](MotionBlocks::Part part, const FrameTangent& t) {
      Lanes<6> load1 = Lanes<6>::Zero(), load2 = Lanes<6>::Zero();
      tangent(first ? t : kStill, first ? kStill : t, load1, load2);
      const auto block = [&](std::size_t body) -> MotionBlocks::Block<6>& {
        return out.b[index(out.pair(static_cast<int>(body), static_cast<int>(read)))];
      };
      if (body1 > 0) block(body1).add(part, load1);
      if (body2 > 0) block(body2).add(part, load2);
    };
    const UnitTangents& unit = units[read];
    add(MotionBlocks::r, unit.r);
    add(MotionBlocks::p, unit.p);
    add(MotionBlocks::rdot, unit.rdot);
    add(MotionBlocks::pdot, unit.pdot);
  }
}

void ForceTerms::add_blocks(const At& at, const std::vector<UnitTangents>& units, MotionBlocks& out, bool but_springs,
                            bool but_torques) {
  const ForceInputs in = inputs(at);
  for_each(but_springs, [&]<class Kind>(const Kind& f, std::size_t i, std::size_t j) {
    constexpr bool is_torque = std::is_same_v<Kind, RsdaForce> || std::is_same_v<Kind, TurningFriction>;
    if (is_torque && but_torques) return;
    const Frame &f1 = at.frames[i], &f2 = at.frames[j];
    const auto x = f.at(in, f1, f2);
    add_pair(i, j, units, out, [&](const FrameTangent& t1, const FrameTangent& t2, Lanes<6>& load1, Lanes<6>& load2) {
      f.tangent(x, f1, f2, t1, t2, {}, load1, load2);
    });
  });
  const StateLayout layout{data_.n};
  const int t = static_cast<int>(data_.rho.size());
  for (const AppliedForce& f : data_.applied) {
    if (!depends_on_state(f) || (but_torques && is_free_torque(f))) continue;
    const Vector3d c = components_with_gradients(f, at);
    const Frame& frame = at.frames[index(f.body)];
    Lanes<6> load = Lanes<6>::Zero();
    f.tangent(c, Lanes<3>::Zero(), frame, units[index(f.body)].p, nullptr, load);
    out.b[index(out.pair(f.body, f.body))].add(MotionBlocks::p, load);
    for (const int s : f.sensors) {
      set_gradient(s, at);
      Lanes<3> dc = Lanes<3>::Zero();
      for (int i = 0; i < 3; ++i) dc(i, 0) = gradients_[index(i)][index(t + 1 + s)];
      load.setZero();
      f.tangent(c, dc, frame, kStill, nullptr, load);
      for (int read = 1; read <= data_.n; ++read) {
        const Vec<7> q = y_bar_.segment<7>(layout.q(read)), v = y_bar_.segment<7>(layout.v(read));
        if (q.isZero(0) && v.isZero(0)) continue;
        MotionBlocks::Block<6>& block = out.b[index(out.pair(f.body, read))];
        block.q += load.col(0) * q.transpose();
        block.v += load.col(0) * v.transpose();
        block.parts |= MotionBlocks::r | MotionBlocks::p | MotionBlocks::rdot | MotionBlocks::pdot;
      }
    }
  }
}

void ForceTerms::add_field_tangent(const At& at, const ParameterBlock& block, std::vector<Lanes<6>>& load_dirs) {
  const ForceInputs in = inputs(at);
  for_each(false, [&](const auto& f, std::size_t i, std::size_t j) {
    f.add_field_tangent(in, block, at.frames[i], at.frames[j], load_dirs[i], load_dirs[j]);
  });
  const int t = static_cast<int>(data_.rho.size());
  for (const AppliedForce& f : data_.applied) {
    if (f.parameters.empty() && f.sensors.empty() && !block.moves(f.slot, 3)) continue;
    const Vector3d c = components_with_gradients(f, at);
    Lanes<3> dc = Lanes<3>::Zero();
    for (const int k : f.parameters) add_input(k, block.direction(k), dc);
    for (const int s : f.sensors) {
      set_gradient(s, at);
      Lanes<1> direction = Lanes<1>::Zero();
      for (int lane = 0; lane < kLanes; ++lane) {
        if (block.parameter[lane] >= 0) direction(lane) = rho_bar_(block.parameter[lane]);
      }
      add_input(t + 1 + s, direction, dc);
    }
    Lanes<3> ds;
    f.tangent(c, dc, at.frames[index(f.body)], kStill, block.field<3>(f.slot, ds), load_dirs[index(f.body)]);
  }
}

void ForceTerms::add_pull_back(const At& at, std::vector<FrameBar>& bars, Eigen::Ref<Eigen::VectorXd> y_bar,
                               Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar, bool but_springs) {
  const ForceInputs in = inputs(at);
  for_each(but_springs, [&](const auto& f, std::size_t i, std::size_t j) {
    f.pull_back(in, at.frames[i], at.frames[j], bars[i], bars[j], theta_bar, rho_bar);
  });
  const int t = static_cast<int>(data_.rho.size());
  for (const AppliedForce& f : data_.applied) {
    const Vector3d c = components_with_gradients(f, at);
    const Vector3d c_bar = f.pull_back(c, at.frames[index(f.body)], bars[index(f.body)], theta_bar);
    auto weight = [&](int input) {
      double sum = 0;
      for (int i = 0; i < 3; ++i) sum += c_bar(i) * gradients_[index(i)][index(input)];
      return sum;
    };
    for (const int k : f.parameters) rho_bar(k) += weight(k);
    for (const int s : f.sensors) {
      const double scale = weight(t + 1 + s);
      if (scale != 0) add_gradient(data_, data_.sensors[index(s)], at.t, at.y, at.angles, scale, y_bar, rho_bar);
    }
  }
}

}  // namespace mbsopt
