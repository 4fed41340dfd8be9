#include "core/dynamics/force_terms.hpp"

#include <algorithm>

#include "core/mechanism/derivative_blocks.hpp"

namespace mbsopt {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

// The value on whose turn a joint's angle is.
double reference(int angle, const Eigen::VectorXd& angles) { return angle < 0 ? 0.0 : angles(angle); }

}  // namespace

ForceTerms::ForceTerms(const MechanismData& data) : data_(data) {
  const std::size_t P = static_cast<std::size_t>(data.rho.size());
  law_.inputs.resize(P + 3);
  law_.gradient.resize(P + 3);
  auto grow = [&](const Law& law) {
    if (law.program) law.program->grow(law_.program);
  };
  for (const TsdaForce& f : data.tsda) grow(f.law);
  for (const RsdaForce& f : data.rsda) grow(f.law);
  if (data.applied.empty()) return;
  inputs_.resize(P + 1 + data.sensors.size());
  for (std::vector<double>& gradient : gradients_) gradient.resize(inputs_.size());
  for (const AppliedForce& f : data.applied) {
    for (const Program& component : f.components) component.grow(program_);
  }
  y_bar_.setZero(14 * data.n);
  rho_bar_.setZero(data.rho.size());
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

void ForceTerms::add_loads(const At& at, std::vector<Vec<6>>& loads) {
  for (const TsdaForce& f : data_.tsda) {
    const std::size_t i = index(f.body1), j = index(f.body2);
    f.add_load(at.t, data_.rho, at.frames[i], at.frames[j], law_, loads[i], loads[j]);
  }
  add_loads_but_springs(at, loads);
}

void ForceTerms::add_loads_but_springs(const At& at, std::vector<Vec<6>>& loads) {
  for_each_joint_effort([&](const auto& f) {
    const std::size_t i = index(f.joint.body1), j = index(f.joint.body2);
    f.add_load(at.t, data_.rho, reference(f.angle, at.angles), at.frames[i], at.frames[j], law_, loads[i], loads[j]);
  });
  for (const Bushing& f : data_.bushings) {
    const std::size_t i = index(f.body1), j = index(f.body2);
    f.add_load(at.frames[i], at.frames[j], loads[i], loads[j]);
  }
  for (const AppliedForce& f : data_.applied) {
    f.add_load(components(f, at), at.frames[index(f.body)], loads[index(f.body)]);
  }
}

void ForceTerms::mark_units(std::vector<bool>& bodies) const {
  const auto mark = [&](int body1, int body2) { bodies[index(body1)] = bodies[index(body2)] = true; };
  for (const TsdaForce& f : data_.tsda) mark(f.body1, f.body2);
  for_each_joint_effort([&](const auto& f) { mark(f.joint.body1, f.joint.body2); });
  for (const Bushing& f : data_.bushings) mark(f.body1, f.body2);
  for (const AppliedForce& f : data_.applied) mark(f.body, f.body);
}

template <class Tangent>
void ForceTerms::add_pair(int body1, int body2, const std::vector<UnitTangents>& units, MotionBlocks& out,
                          Tangent&& tangent) {
  for (const bool first : {true, false}) {
    const int read = first ? body1 : body2;
    if (read == 0) continue;
    auto add = [&](MotionBlocks::Part part, const FrameTangent& t) {
      Lanes<6> load1 = Lanes<6>::Zero(), load2 = Lanes<6>::Zero();
      tangent(first ? t : kStill, first ? kStill : t, load1, load2);
      if (body1 > 0) out.b[index(out.pair(body1 - 1, read - 1))].add(part, load1);
      if (body2 > 0) out.b[index(out.pair(body2 - 1, read - 1))].add(part, load2);
    };
    const UnitTangents& unit = units[index(read)];
    add(MotionBlocks::r, unit.r);
    add(MotionBlocks::p, unit.p);
    add(MotionBlocks::rdot, unit.rdot);
    add(MotionBlocks::pdot, unit.pdot);
  }
}

void ForceTerms::add_blocks(const At& at, const std::vector<UnitTangents>& units, MotionBlocks& out) {
  const Lanes<1> none = Lanes<1>::Zero();
  for (const TsdaForce& f : data_.tsda) {
    const Frame &f1 = at.frames[index(f.body1)], &f2 = at.frames[index(f.body2)];
    const TsdaForce::Span x = f.span(f1, f2);
    const Law::Value value = f.law.derivatives(at.t, data_.rho, x.l, x.ldot, law_);
    add_pair(f.body1, f.body2, units, out,
             [&](const FrameTangent& t1, const FrameTangent& t2, Lanes<6>& load1, Lanes<6>& load2) {
               f.tangent(x, value, none, f1, f2, t1, t2, nullptr, nullptr, load1, load2);
             });
  }
  for_each_joint_effort([&](const auto& f) {
    const Frame &f1 = at.frames[index(f.joint.body1)], &f2 = at.frames[index(f.joint.body2)];
    const double x = f.joint.value_near(reference(f.angle, at.angles), f1, f2), xdot = f.joint.rate(f1, f2);
    const Law::Value value = f.law.derivatives(at.t, data_.rho, x, xdot, law_);
    add_pair(f.joint.body1, f.joint.body2, units, out,
             [&](const FrameTangent& t1, const FrameTangent& t2, Lanes<6>& load1, Lanes<6>& load2) {
               f.tangent(value, none, f1, f2, t1, t2, {}, load1, load2);
             });
  });
  for (const Bushing& f : data_.bushings) {
    const Frame &f1 = at.frames[index(f.body1)], &f2 = at.frames[index(f.body2)];
    add_pair(f.body1, f.body2, units, out,
             [&](const FrameTangent& t1, const FrameTangent& t2, Lanes<6>& load1, Lanes<6>& load2) {
               f.tangent(f1, f2, t1, t2, {}, load1, load2);
             });
  }
  const int t = static_cast<int>(data_.rho.size());
  for (const AppliedForce& f : data_.applied) {
    if (!depends_on_state(f)) continue;
    const Vector3d c = components_with_gradients(f, at);
    const Frame& frame = at.frames[index(f.body)];
    const int row = f.body - 1;
    Lanes<6> load = Lanes<6>::Zero();
    f.tangent(c, Lanes<3>::Zero(), frame, units[index(f.body)].p, nullptr, load);
    out.b[index(out.pair(row, row))].add(MotionBlocks::p, load);
    for (const int s : f.sensors) {
      y_bar_.setZero(), rho_bar_.setZero();
      add_gradient(data_, data_.sensors[index(s)], at.t, at.y, at.angles, 1, y_bar_, rho_bar_);
      Lanes<3> dc = Lanes<3>::Zero();
      for (int i = 0; i < 3; ++i) dc(i, 0) = gradients_[index(i)][index(t + 1 + s)];
      load.setZero();
      f.tangent(c, dc, frame, kStill, nullptr, load);
      for (int j = 0; j < data_.n; ++j) {
        const Vec<7> q = y_bar_.segment<7>(7 * j), v = y_bar_.segment<7>(7 * (data_.n + j));
        if (q.isZero(0) && v.isZero(0)) continue;
        MotionBlocks::Block<6>& block = out.b[index(out.pair(row, j))];
        block.q += load.col(0) * q.transpose();
        block.v += load.col(0) * v.transpose();
        block.parts |= MotionBlocks::r | MotionBlocks::p | MotionBlocks::rdot | MotionBlocks::pdot;
      }
    }
  }
}

template <class L>
bool ForceTerms::moves(const ParameterBlock& block, const L& law, std::initializer_list<int> slots) {
  if constexpr (requires { law.program; }) {
    if (law.program) return true;
  }
  return block.moves(law.slot, L::kFields) ||
         std::any_of(slots.begin(), slots.end(), [&](int slot) { return block.moves(slot, 3); });
}

void ForceTerms::add_field_tangent(const At& at, const ParameterBlock& block, std::vector<Lanes<6>>& load_dirs) {
  for (const TsdaForce& f : data_.tsda) {
    if (!moves(block, f.law, {f.slot1, f.slot2})) continue;
    const std::size_t i = index(f.body1), j = index(f.body2);
    const TsdaForce::Span x = f.span(at.frames[i], at.frames[j]);
    const Law::Value value = f.law.derivatives(at.t, data_.rho, x.l, x.ldot, law_);
    Lanes<4> fields;
    Lanes<3> s1, s2;
    const Lanes<1> df = f.law.field_tangent(
        x.l, x.ldot, block.field<4>(f.law.slot, fields), [&](int p) { return block.direction(p); }, law_);
    f.tangent(x, value, df, at.frames[i], at.frames[j], kStill, kStill, block.field<3>(f.slot1, s1),
              block.field<3>(f.slot2, s2), load_dirs[i], load_dirs[j]);
  }
  for_each_joint_effort([&](const auto& f) {
    if (!moves(block, f.law, {f.joint.slot1, f.joint.slot2, f.joint.slot3})) return;
    constexpr int kFields = decltype(f.law)::kFields;
    const std::size_t i = index(f.joint.body1), j = index(f.joint.body2);
    const Frame &f1 = at.frames[i], &f2 = at.frames[j];
    const double x = f.joint.value_near(reference(f.angle, at.angles), f1, f2), xdot = f.joint.rate(f1, f2);
    const Law::Value value = f.law.derivatives(at.t, data_.rho, x, xdot, law_);
    Lanes<kFields> fields;
    Lanes<3> s1, s2, s3;
    const Lanes<1> df = f.law.field_tangent(
        x, xdot, block.field<kFields>(f.law.slot, fields), [&](int p) { return block.direction(p); }, law_);
    const GeometryTangent ds{block.field<3>(f.joint.slot1, s1), block.field<3>(f.joint.slot2, s2),
                             block.field<3>(f.joint.slot3, s3)};
    f.tangent(value, df, f1, f2, kStill, kStill, ds, load_dirs[i], load_dirs[j]);
  });
  for (const Bushing& f : data_.bushings) {
    if (!(block.moves(f.slot1, 3) || block.moves(f.slot2, 3) || block.moves(f.slot_R0, 9) ||
          block.moves(f.slot_law, 12))) {
      continue;
    }
    const std::size_t i = index(f.body1), j = index(f.body2);
    Lanes<3> s1, s2;
    Lanes<9> R0;
    Lanes<12> law;
    const Bushing::FieldLanes fields{block.field<3>(f.slot1, s1), block.field<3>(f.slot2, s2),
                                     block.field<9>(f.slot_R0, R0), block.field<12>(f.slot_law, law)};
    f.tangent(at.frames[i], at.frames[j], kStill, kStill, fields, load_dirs[i], load_dirs[j]);
  }
  const int t = static_cast<int>(data_.rho.size());
  for (const AppliedForce& f : data_.applied) {
    if (f.parameters.empty() && f.sensors.empty() && !block.moves(f.slot, 3)) continue;
    const Vector3d c = components_with_gradients(f, at);
    Lanes<3> dc = Lanes<3>::Zero();
    auto add_input = [&](int input, const Lanes<1>& direction) {
      for (int i = 0; i < 3; ++i) dc.row(i) += gradients_[index(i)][index(input)] * direction;
    };
    for (const int k : f.parameters) add_input(k, block.direction(k));
    for (const int s : f.sensors) {
      y_bar_.setZero(), rho_bar_.setZero();
      add_gradient(data_, data_.sensors[index(s)], at.t, at.y, at.angles, 1, y_bar_, rho_bar_);
      Lanes<1> direction = Lanes<1>::Zero();
      for (int lane = 0; lane < kLanes; ++lane) {
        if (block.parameter[lane] >= 0) direction(lane) = rho_bar_(block.parameter[lane]);
      }
      add_input(t + 1 + s, direction);
    }
    Lanes<3> ds;
    f.tangent(c, dc, at.frames[index(f.body)], kStill, block.field<3>(f.slot, ds), load_dirs[index(f.body)]);
  }
}

void ForceTerms::add_pull_back(const At& at, std::vector<FrameBar>& bars, Eigen::Ref<Eigen::VectorXd> y_bar,
                               Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) {
  for (const TsdaForce& f : data_.tsda) {
    const std::size_t i = index(f.body1), j = index(f.body2);
    f.pull_back(at.t, data_.rho, at.frames[i], at.frames[j], law_, bars[i], bars[j], theta_bar, rho_bar);
  }
  add_pull_back_but_springs(at, bars, y_bar, theta_bar, rho_bar);
}

void ForceTerms::add_pull_back_but_springs(const At& at, std::vector<FrameBar>& bars, Eigen::Ref<Eigen::VectorXd> y_bar,
                                           Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) {
  for_each_joint_effort([&](const auto& f) {
    const std::size_t i = index(f.joint.body1), j = index(f.joint.body2);
    f.pull_back(at.t, data_.rho, reference(f.angle, at.angles), at.frames[i], at.frames[j], law_, bars[i], bars[j],
                theta_bar, rho_bar);
  });
  for (const Bushing& f : data_.bushings) {
    const std::size_t i = index(f.body1), j = index(f.body2);
    f.pull_back(at.frames[i], at.frames[j], bars[i], bars[j], theta_bar);
  }
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
