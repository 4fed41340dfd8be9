#include "core/dynamics/constraint_terms.hpp"

namespace mbsopt {
namespace {

const Frame& of(const std::vector<Frame>& frames, int body) { return frames[static_cast<std::size_t>(body)]; }

template <class Evaluate>
void for_each(const MechanismData& data, const std::vector<Frame>& frames, Eigen::VectorXd& out, Evaluate&& evaluate) {
  for (const Constraint& c : data.constraints) {
    std::visit(
        [&](const auto& p) {
          constexpr int m = std::decay_t<decltype(p)>::kRows;
          Vec<m> value;
          evaluate(p, of(frames, c.body1), of(frames, c.body2), value);
          out.segment<m>(c.row) = value;
        },
        c.primitive);
  }
}

template <int M>
Vec<M> rows(const Eigen::VectorXd* z, int row, double scale) {
  if (!z) return Vec<M>::Zero();
  return scale * z->segment<M>(row);
}

}  // namespace

void evaluate_phi(const MechanismData& data, const std::vector<Frame>& frames, Eigen::VectorXd& phi) {
  for_each(data, frames, phi, [](const auto& p, const Frame& a, const Frame& b, auto& out) { p.phi(a, b, out); });
}
void evaluate_phi_dot(const MechanismData& data, const std::vector<Frame>& frames, Eigen::VectorXd& phi_dot) {
  for_each(data, frames, phi_dot,
           [](const auto& p, const Frame& a, const Frame& b, auto& out) { p.phi_dot(a, b, out); });
}
void evaluate_phi_ddot(const MechanismData& data, const std::vector<Frame>& frames, Eigen::VectorXd& phi_ddot) {
  for_each(data, frames, phi_ddot,
           [](const auto& p, const Frame& a, const Frame& b, auto& out) { p.phi_ddot(a, b, out); });
}

void add_pull_back(const MechanismData& data, const std::vector<Frame>& frames, const ConstraintWeights& weights,
                   double scale, std::vector<FrameBar>& bars, Eigen::VectorXd& theta_bar) {
  for (const Constraint& c : data.constraints) {
    std::visit(
        [&](const auto& p) {
          constexpr int m = std::decay_t<decltype(p)>::kRows;
          const Multipliers<m> z{rows<m>(weights.lambda, c.row, scale), rows<m>(weights.mu0, c.row, scale),
                                 rows<m>(weights.mu1, c.row, scale), rows<m>(weights.mu2, c.row, scale)};
          Vector3d s1_bar = Vector3d::Zero(), s2_bar = Vector3d::Zero();
          p.pull_back(of(frames, c.body1), of(frames, c.body2), z, bars[static_cast<std::size_t>(c.body1)],
                      bars[static_cast<std::size_t>(c.body2)], s1_bar, s2_bar);
          if (c.slot1 >= 0) theta_bar.segment<3>(c.slot1) += s1_bar;
          if (c.slot2 >= 0) theta_bar.segment<3>(c.slot2) += s2_bar;
        },
        c.primitive);
  }
}

void evaluate_tangents(const MechanismData& data, const std::vector<Frame>& frames,
                       const std::vector<FrameTangent>& directions, const ParameterBlock& block,
                       const Eigen::VectorXd& lambda, ConstraintTangents& out, std::vector<Lanes<6>>& loads) {
  for (const Constraint& c : data.constraints) {
    std::visit(
        [&](const auto& p) {
          constexpr int m = std::decay_t<decltype(p)>::kRows;
          const std::size_t i = static_cast<std::size_t>(c.body1), j = static_cast<std::size_t>(c.body2);
          Lanes<3> s1, s2;
          const GeometryTangent s{block.field<3>(c.slot1, s1), block.field<3>(c.slot2, s2)};
          PrimitiveTangent<m> t;
          p.tangent(frames[i], frames[j], directions[i], directions[j], s, lambda.segment<m>(c.row), t);
          out.phi.middleRows<m>(c.row) = t.phi;
          out.phi_dot.middleRows<m>(c.row) = t.phi_dot;
          out.phi_ddot.middleRows<m>(c.row) = t.phi_ddot;
          loads[i] += t.load1;
          loads[j] += t.load2;
        },
        c.primitive);
  }
}

}  // namespace mbsopt
