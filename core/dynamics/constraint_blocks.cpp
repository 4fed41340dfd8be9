#include "core/dynamics/constraint_blocks.hpp"

#include "core/constraint/constraint.hpp"

namespace mbsopt {
namespace {

void add_moment(int pair, double factor, const Mat<3, 4>& moment_p, MotionBlocks& out) {
  if (pair < 0) return;
  MotionBlocks::Block<6>& block = out.b[at(pair)];
  block.q.block<3, 4>(3, 3) -= factor * moment_p;
  block.parts |= MotionBlocks::p;
}
void add_row(int row, double factor, const Mat<1, 4>& by_p, const Mat<1, 4>& by_pdot, MotionBlocks& out) {
  if (row < 0) return;
  out.c[at(row)].add(MotionBlocks::p, factor * by_p);
  out.c[at(row)].add(MotionBlocks::pdot, factor * by_pdot);
}

}  // namespace

ConstraintBlocks::ConstraintBlocks(const MechanismData& data, const MotionBlocks& blocks, double two_xi_omega,
                                   double omega2)
    : data_(&data), two_xi_omega_(two_xi_omega), omega2_(omega2), stabilised_(two_xi_omega != 0 || omega2 != 0) {
  for (const Constraint& c : data.constraints) {
    Places p;
    const int body[2] = {c.body1, c.body2};
    for (int i = 0; i < 2; ++i) {
      if (body[i] == 0) continue;
      for (int j = 0; j < 2; ++j) {
        if (body[j] > 0) p.pair[i][j] = blocks.pair(body[i], body[j]);
      }
      for (int r = 0; r < c.rows(); ++r) p.row[i][at(r)] = blocks.row(c.row + r, body[i]);
    }
    places_.push_back(p);
  }
}

bool ConstraintBlocks::short_cut(const Constraint& c) const {
  return !stabilised_ &&
         std::visit([](const auto& p) { return HasTurningBlocks<std::decay_t<decltype(p)>>; }, c.primitive);
}

void ConstraintBlocks::mark_units(std::vector<bool>& bodies) const {
  for (const Constraint& c : data_->constraints) {
    if (!short_cut(c)) bodies[at(c.body1)] = bodies[at(c.body2)] = true;
  }
}

template <class P>
void ConstraintBlocks::add_by_units(const Constraint& c, const P& p, const Places& place,
                                    const std::vector<Frame>& frames, const std::vector<UnitTangents>& units,
                                    const Eigen::VectorXd& lambda, MotionBlocks& out) const {
  constexpr int m = P::kRows;
  const int body[2] = {c.body1, c.body2};
  const Vec<m> nu = lambda.segment<m>(c.row);
  for (int j = 0; j < 2; ++j) {
    if (body[j] == 0) continue;
    const UnitTangents& unit = units[at(body[j])];
    auto add = [&](MotionBlocks::Part part, const FrameTangent& t) {
      PrimitiveTangent<m> x;
      p.tangent(frames[at(c.body1)], frames[at(c.body2)], j == 0 ? t : kStill, j == 1 ? t : kStill, {}, nu, x);
      if (place.pair[0][j] >= 0) out.b[at(place.pair[0][j])].add(part, -c.factor * x.load1);
      if (place.pair[1][j] >= 0) out.b[at(place.pair[1][j])].add(part, -c.factor * x.load2);
      for (int r = 0; r < m; ++r) {
        const Lanes<1> change = x.phi_ddot.row(r) + two_xi_omega_ * x.phi_dot.row(r) + omega2_ * x.phi.row(r);
        out.c[at(place.row[j][at(r)])].add(part, -c.factor * change);
      }
    };
    add(MotionBlocks::p, unit.p);
    add(MotionBlocks::pdot, unit.pdot);
    add(MotionBlocks::r, unit.r);
    add(MotionBlocks::rdot, unit.rdot);
  }
}

void ConstraintBlocks::add(const std::vector<Frame>& frames, const std::vector<UnitTangents>& units,
                           const Eigen::VectorXd& lambda, MotionBlocks& out) const {
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const Constraint& c = data_->constraints[k];
    const Places& place = places_[k];
    std::visit(
        [&]<class P>(const P& p) {
          constexpr int m = P::kRows;
          if constexpr (HasTurningBlocks<P>) {
            if (!stabilised_) {
              const std::size_t i = at(c.body1), j = at(c.body2);
              TurningBlocks<m> x;
              p.turning_blocks(frames[i], frames[j], lambda.segment<m>(c.row), x);
              add_moment(place.pair[0][0], c.factor, x.moment1_p1, out);
              add_moment(place.pair[0][1], c.factor, x.moment1_p2, out);
              add_moment(place.pair[1][0], c.factor, x.moment2_p1, out);
              add_moment(place.pair[1][1], c.factor, x.moment2_p2, out);
              for (int r = 0; r < m; ++r) {
                add_row(place.row[0][at(r)], -c.factor, x.p1.row(r), x.pdot1.row(r), out);
                add_row(place.row[1][at(r)], -c.factor, x.p2.row(r), x.pdot2.row(r), out);
              }
              return;
            }
          }
          add_by_units(c, p, place, frames, units, lambda, out);
        },
        c.primitive);
  }
}

}  // namespace mbsopt
