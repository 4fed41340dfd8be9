#include "core/dynamics/user_loads.hpp"

#include <algorithm>

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"

namespace mbsopt {
namespace {

// The position and number of the coordinates of a force's bodies, one after another.
Eigen::Index block_of(std::size_t k) { return 7 * static_cast<Eigen::Index>(k); }
Eigen::Index size_of(const UserForceData& f) { return block_of(f.bodies.size()); }

}  // namespace

UserLoads::UserLoads(const MechanismData& data) : data_(data) {
  Eigen::Index largest = 0;
  for (const UserForceData& f : data_.user_forces) largest = std::max(largest, size_of(f));
  for (Eigen::VectorXd* x : {&q_, &v_, &Q_, &e_}) x->setZero(largest);
  K_.setZero(largest, largest);
  C_.setZero(largest, largest);
  Q_rho_.setZero(largest, data_.rho.size());
  for (const UserForceData& f : data_.user_forces) {
    if (f.force->inertia()) masses_.push_back({f.bodies.front(), Mat<6, 6>::Zero()});
  }
  if (masses_.empty()) return;
  z_.setZero(6);
  L_.setZero(6);
  M_.setZero(6, 6);
  L_y_.setZero(6, 14);
  L_rho_.setZero(6, data_.rho.size());
}

void UserLoads::set_masses(const Eigen::VectorXd& y) {
  std::size_t k = 0;
  for (const UserForceData& f : data_.user_forces) {
    if (!f.force->inertia()) continue;
    set_state(f, y);
    M_.setZero();
    f.force->inertia()->M(q_.head(7), data_.rho, M_);
    masses_[k++].M = M_;
  }
}

void UserLoads::set_state(const UserForceData& f, const Eigen::VectorXd& y) {
  const StateLayout layout{data_.n};
  for (std::size_t k = 0; k < f.bodies.size(); ++k) {
    q_.segment<7>(block_of(k)) = y.segment<7>(layout.q(f.bodies[k]));
    v_.segment<7>(block_of(k)) = y.segment<7>(layout.v(f.bodies[k]));
  }
}

// Q, K and C of a force, and L_y = (L_q, L_v) of its mass term.
void UserLoads::evaluate(const UserForceData& f, const ForceTerms::At& at, const Accelerations& z) {
  const Eigen::Index size = size_of(f);
  const auto q = q_.head(size), v = v_.head(size);
  set_state(f, at.y);
  Q_.setZero();
  K_.setZero();
  C_.setZero();
  f.force->Q(at.t, q, v, data_.rho, Q_.head(size));
  f.force->K(at.t, q, v, data_.rho, K_.topLeftCorner(size, size));
  f.force->C(at.t, q, v, data_.rho, C_.topLeftCorner(size, size));
  if (!f.force->inertia()) return;
  z_ = z[static_cast<std::size_t>(f.bodies.front()) - 1];
  L_y_.setZero();
  f.force->inertia()->L_q(q, v, z_, data_.rho, L_y_.leftCols(7));
  f.force->inertia()->L_v(q, v, z_, data_.rho, L_y_.rightCols(7));
}

// L_rho of its mass term at the state.
void UserLoads::set_L_rho(const UserForceData& f, const Accelerations& z) {
  if (!f.force->inertia()) return;
  z_ = z[static_cast<std::size_t>(f.bodies.front()) - 1];
  L_rho_.setZero();
  f.force->inertia()->L_rho(q_.head(7), v_.head(7), z_, data_.rho, L_rho_);
}

void UserLoads::add_loads(const ForceTerms::At& at, std::vector<Vec<6>>& loads) {
  for (const UserForceData& f : data_.user_forces) {
    const Eigen::Index size = size_of(f);
    set_state(f, at.y);
    if (const InertialLoad* inertia = f.force->inertia()) {
      L_.setZero();
      z_.setZero();
      inertia->L(q_.head(7), v_.head(7), z_, data_.rho, L_);
      loads[static_cast<std::size_t>(f.bodies.front())] += L_;
    }
    Q_.setZero();
    f.force->Q(at.t, q_.head(size), v_.head(size), data_.rho, Q_.head(size));
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const std::size_t body = static_cast<std::size_t>(f.bodies[k]);
      loads[body] += to_virtual(at.frames[body], Q_.segment<7>(block_of(k)));
    }
  }
}

// (T'Q)_y' = T'(-K q' - C v') + (0, 1/2 G(p') Q_p)
void UserLoads::add_blocks(const ForceTerms::At& at, const Accelerations& z, MotionBlocks& out) {
  constexpr int all = MotionBlocks::r | MotionBlocks::p | MotionBlocks::rdot | MotionBlocks::pdot;
  for (const UserForceData& f : data_.user_forces) {
    evaluate(f, at, z);
    if (f.force->inertia()) {
      MotionBlocks::Block<6>& block = out.b[static_cast<std::size_t>(out.pair(f.bodies.front(), f.bodies.front()))];
      block.q += L_y_.leftCols(7);
      block.v += L_y_.rightCols(7);
    }
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const Eigen::Index row = block_of(k);
      const BodyState& body = at.frames[static_cast<std::size_t>(f.bodies[k])];
      for (std::size_t l = 0; l < f.bodies.size(); ++l) {
        const Eigen::Index column = block_of(l);
        MotionBlocks::Block<6>& block = out.b[static_cast<std::size_t>(out.pair(f.bodies[k], f.bodies[l]))];
        for (int c = 0; c < 7; ++c) {
          block.q.col(c) -= to_virtual(body, K_.block<7, 1>(row, column + c));
          block.v.col(c) -= to_virtual(body, C_.block<7, 1>(row, column + c));
        }
        block.parts |= all;
        if (k != l) continue;
        block.q.block<3, 4>(3, 3) -= 0.5 * G(Q_.segment<4>(row + 3));  // G(p') Q_p = -G(Q_p) p'
      }
    }
  }
}

void UserLoads::add_field_tangent(const ForceTerms::At& at, const Accelerations& z, const ParameterBlock& block,
                                  std::vector<Lanes<6>>& load_dirs) {
  if (std::all_of(std::begin(block.parameter), std::end(block.parameter), [](int k) { return k < 0; })) return;
  for (const UserForceData& f : data_.user_forces) {
    const Eigen::Index size = size_of(f);
    set_state(f, at.y);
    Q_rho_.setZero();
    f.force->Q_rho(at.t, q_.head(size), v_.head(size), data_.rho, Q_rho_.topRows(size));
    set_L_rho(f, z);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (block.parameter[lane] < 0) continue;
      if (f.force->inertia())
        load_dirs[static_cast<std::size_t>(f.bodies.front())].col(lane) += L_rho_.col(block.parameter[lane]);
      for (std::size_t k = 0; k < f.bodies.size(); ++k) {
        const std::size_t body = static_cast<std::size_t>(f.bodies[k]);
        load_dirs[body].col(lane) +=
            to_virtual(at.frames[body], Q_rho_.col(block.parameter[lane]).segment<7>(block_of(k)));
      }
    }
  }
}

void UserLoads::add_pull_back(const ForceTerms::At& at, const Accelerations& z, const std::vector<Vec<6>>& eta,
                              Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& rho_bar) {
  const StateLayout layout{data_.n};
  for (const UserForceData& f : data_.user_forces) {
    const Eigen::Index size = size_of(f);
    evaluate(f, at, z);
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const Eigen::Index own = block_of(k);
      const std::size_t body = static_cast<std::size_t>(f.bodies[k]);
      e_.segment<3>(own) = eta[body - 1].head<3>();
      e_.segment<4>(own + 3) = 0.5 * G_transposed_times(at.frames[body].p, eta[body - 1].tail<3>());
    }
    Q_rho_.setZero();
    f.force->Q_rho(at.t, q_.head(size), v_.head(size), data_.rho, Q_rho_.topRows(size));
    const auto e = e_.head(size);
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const Eigen::Index own = block_of(k);
      const Vector3d eta_w = eta[static_cast<std::size_t>(f.bodies[k]) - 1].tail<3>();
      y_bar.segment<7>(layout.q(f.bodies[k])).noalias() -= K_.block(0, own, size, 7).transpose().lazyProduct(e);
      y_bar.segment<7>(layout.v(f.bodies[k])).noalias() -= C_.block(0, own, size, 7).transpose().lazyProduct(e);
      y_bar.segment<4>(layout.p(f.bodies[k])) += 0.5 * G_transposed_times_adjoint(eta_w, Q_.segment<4>(own + 3));
    }
    rho_bar.noalias() += Q_rho_.topRows(size).transpose().lazyProduct(e);
    if (!f.force->inertia()) continue;
    const int own = f.bodies.front();
    const Vec<6>& of_body = eta[static_cast<std::size_t>(own) - 1];
    set_L_rho(f, z);
    y_bar.segment<7>(layout.q(own)).noalias() += L_y_.leftCols(7).transpose().lazyProduct(of_body);
    y_bar.segment<7>(layout.v(own)).noalias() += L_y_.rightCols(7).transpose().lazyProduct(of_body);
    rho_bar.noalias() += L_rho_.transpose().lazyProduct(of_body);
  }
}

}  // namespace mbsopt
