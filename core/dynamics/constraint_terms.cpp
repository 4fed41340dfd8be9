#include "core/dynamics/constraint_terms.hpp"

#include "core/mechanism/constraint_gradient.hpp"

namespace mbsopt {
namespace {

const Frame& of(const std::vector<Frame>& frames, int body) { return frames[static_cast<std::size_t>(body)]; }

template <class Evaluate>
void for_each(const MechanismData& data, const std::vector<Frame>& frames, Eigen::VectorXd& out, Evaluate&& evaluate) {
  out.setZero();
  for (const Constraint& c : data.constraints) {
    std::visit(
        [&](const auto& p) {
          constexpr int m = std::decay_t<decltype(p)>::kRows;
          Vec<m> value;
          evaluate(c, p, of(frames, c.body1), of(frames, c.body2), value);
          out.segment<m>(c.row) += c.factor * value;
        },
        c.primitive);
  }
}

template <int M>
Vec<M> rows(const Eigen::VectorXd* z, int row, double scale) {
  if (!z) return Vec<M>::Zero();
  return scale * z->segment<M>(row);
}

void add_tangent(const Constraint& c, const std::vector<Frame>& frames, const RowLaws& laws,
                 const Eigen::VectorXd& angles, const FrameTangent& t1, const FrameTangent& t2,
                 const ParameterBlock& block, const Eigen::VectorXd& lambda, ConstraintTangents& out,
                 std::vector<Lanes<6>>& loads) {
  std::visit(
      [&]<class P>(const P& p) {
        constexpr int m = P::kRows;
        const std::size_t i = static_cast<std::size_t>(c.body1), j = static_cast<std::size_t>(c.body2);
        Lanes<3> s1, s2, s3;
        const GeometryTangent s{block.field<3>(c.slot1, s1), block.field<3>(c.slot2, s2), block.field<3>(c.slot3, s3)};
        PrimitiveTangent<m> t;
        p.tangent(frames[i], frames[j], t1, t2, s, lambda.segment<m>(c.row), t);
        out.phi.middleRows<m>(c.row) += c.factor * t.phi;
        out.phi_dot.middleRows<m>(c.row) += c.factor * t.phi_dot;
        out.phi_ddot.middleRows<m>(c.row) += c.factor * t.phi_ddot;
        loads[i] += c.factor * t.load1;
        loads[j] += c.factor * t.load2;
        Lanes<1> storage;
        if (const Lanes<1>* factor_dir = block.field<1>(c.slot_factor, storage)) {
          const Vec<m> phi = phi_of(c, p, frames[i], frames[j], laws, angles);
          Vec<m> phi_dot, phi_ddot;
          p.phi_dot(frames[i], frames[j], phi_dot);
          p.phi_ddot(frames[i], frames[j], phi_ddot);
          out.phi.middleRows<m>(c.row) += phi * *factor_dir;
          out.phi_dot.middleRows<m>(c.row) += phi_dot * *factor_dir;
          out.phi_ddot.middleRows<m>(c.row) += phi_ddot * *factor_dir;
          Mat<m, 6> J1, J2;
          p.jacobian(frames[i], frames[j], J1, J2);
          loads[i] += J1.transpose() * lambda.segment<m>(c.row) * *factor_dir;
          loads[j] += J2.transpose() * lambda.segment<m>(c.row) * *factor_dir;
        }
      },
      c.primitive);
}

}  // namespace

void ConstraintTerms::phi(const Frames& frames, const RowLaws& laws, const Eigen::VectorXd& angles,
                          Eigen::VectorXd& out) const {
  for_each(*data_, frames, out,
           [&]<class P>(const Constraint& c, const P& p, const Frame& a, const Frame& b, Vec<P::kRows>& value) {
             value = phi_of(c, p, a, b, laws, angles);
           });
  laws.subtract(0, out);
}
void ConstraintTerms::phi_dot(const Frames& frames, const RowLaws& laws, Eigen::VectorXd& out) const {
  for_each(*data_, frames, out, [](const Constraint&, const auto& p, const Frame& a, const Frame& b, auto& value) {
    p.phi_dot(a, b, value);
  });
  laws.subtract(1, out);
}
void ConstraintTerms::phi_ddot(const Frames& frames, const RowLaws& laws, Eigen::VectorXd& out) const {
  for_each(*data_, frames, out, [](const Constraint&, const auto& p, const Frame& a, const Frame& b, auto& value) {
    p.phi_ddot(a, b, value);
  });
  laws.subtract(2, out);
}

void ConstraintTerms::add_pull_back(const Frames& frames, RowLaws& laws, const Eigen::VectorXd& angles,
                                    const ConstraintWeights& weights, double scale, std::vector<FrameBar>& bars,
                                    Eigen::Ref<Eigen::VectorXd> theta_bar, Eigen::Ref<Eigen::VectorXd> rho_bar) const {
  for (const Constraint& c : data_->constraints) {
    std::visit(
        [&]<class P>(const P& p) {
          constexpr int m = P::kRows;
          const double s = scale * c.factor;
          const Multipliers<m> z{rows<m>(weights.lambda, c.row, s), rows<m>(weights.mu0, c.row, s),
                                 rows<m>(weights.mu1, c.row, s), rows<m>(weights.mu2, c.row, s)};
          const Frame &f1 = of(frames, c.body1), &f2 = of(frames, c.body2);
          GeometryBar bar;
          p.pull_back(f1, f2, z, bars[static_cast<std::size_t>(c.body1)], bars[static_cast<std::size_t>(c.body2)], bar);
          if (c.slot1 >= 0) theta_bar.segment<3>(c.slot1) += bar.s1;
          if (c.slot2 >= 0) theta_bar.segment<3>(c.slot2) += bar.s2;
          if (c.slot3 >= 0) theta_bar.segment<3>(c.slot3) += bar.s3;
          if (c.slot_factor >= 0) {
            const Multipliers<m> unscaled{rows<m>(weights.lambda, c.row, scale), rows<m>(weights.mu0, c.row, scale),
                                          rows<m>(weights.mu1, c.row, scale), rows<m>(weights.mu2, c.row, scale)};
            const Vec<m> phi = phi_of(c, p, f1, f2, laws, angles);
            Vec<m> phi_dot, phi_ddot;
            p.phi_dot(f1, f2, phi_dot);
            p.phi_ddot(f1, f2, phi_ddot);
            theta_bar(c.slot_factor) += unscaled.lambda.dot(virtual_change(p, f1, f2)) + unscaled.mu0.dot(phi) +
                                        unscaled.mu1.dot(phi_dot) + unscaled.mu2.dot(phi_ddot);
          }
        },
        c.primitive);
  }
  laws.add_pull_back(weights.mu0, weights.mu1, weights.mu2, scale, theta_bar, rho_bar);
}

void ConstraintTerms::tangents(const Frames& frames, const std::vector<FrameTangent>* directions, RowLaws& laws,
                               const Eigen::VectorXd& angles, const ParameterBlock& block,
                               const Eigen::VectorXd& lambda, ConstraintTangents& out,
                               std::vector<Lanes<6>>& loads) const {
  for (LaneRows* x : {&out.phi, &out.phi_dot, &out.phi_ddot}) x->setZero();
  const auto direction = [&](int body) -> const FrameTangent& {
    return directions ? (*directions)[static_cast<std::size_t>(body)] : kStill;
  };
  for (const Constraint& c : data_->constraints) {
    if (directions || block.moves(c.slot1, 3) || block.moves(c.slot2, 3) || block.moves(c.slot3, 3) ||
        block.moves(c.slot_factor, 1)) {
      add_tangent(c, frames, laws, angles, direction(c.body1), direction(c.body2), block, lambda, out, loads);
    }
  }
  laws.subtract_tangents(block, {&out.phi, &out.phi_dot, &out.phi_ddot});
}

}  // namespace mbsopt
