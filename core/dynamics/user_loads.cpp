// User forces inside the equations of motion: from the 7 coordinates of a body, Q, to its 6 loads T'Q, and derivatives.
//   virtual work e'Q with e = T(p) eta = (eta_r, 1/2 G(p)' eta_theta)
#include "core/dynamics/dynamics.hpp"

#include "core/body/euler_parameters.hpp"

namespace mbsopt {

void Dynamics::set_user_state(const UserForceData& f) {
  for (std::size_t k = 0; k < f.bodies.size(); ++k) {
    const Eigen::Index at = 7 * static_cast<Eigen::Index>(k), q = 7 * (f.bodies[k] - 1);
    user_q_.segment<7>(at) = y_.segment<7>(q);
    user_v_.segment<7>(at) = y_.segment<7>(7 * data_.n + q);
  }
}

void Dynamics::add_user_loads() {
  for (const UserForceData& f : data_.user_forces) {
    const Eigen::Index size = 7 * static_cast<Eigen::Index>(f.bodies.size());
    set_user_state(f);
    user_Q_.setZero();
    f.force->Q(t_, user_q_.head(size), user_v_.head(size), data_.rho, user_Q_.head(size));
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const std::size_t body = static_cast<std::size_t>(f.bodies[k]);
      body_loads_[body] += to_virtual(bodies_[body], user_Q_.segment<7>(7 * static_cast<Eigen::Index>(k)));
    }
  }
}

// (T'Q)_y' = T'(-K q' - C v') + (0, 1/2 G(p') Q_p)
void Dynamics::add_user_blocks(MotionBlocks& out) {
  constexpr int all = MotionBlocks::r | MotionBlocks::p | MotionBlocks::rdot | MotionBlocks::pdot;
  for (const UserForceData& f : data_.user_forces) {
    const Eigen::Index size = 7 * static_cast<Eigen::Index>(f.bodies.size());
    const auto q = user_q_.head(size), v = user_v_.head(size);
    set_user_state(f);
    user_Q_.setZero(), user_K_.setZero(), user_C_.setZero();
    f.force->Q(t_, q, v, data_.rho, user_Q_.head(size));
    f.force->K(t_, q, v, data_.rho, user_K_.topLeftCorner(size, size));
    f.force->C(t_, q, v, data_.rho, user_C_.topLeftCorner(size, size));
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const Eigen::Index row = 7 * static_cast<Eigen::Index>(k);
      const BodyState& body = bodies_[static_cast<std::size_t>(f.bodies[k])];
      for (std::size_t l = 0; l < f.bodies.size(); ++l) {
        const Eigen::Index column = 7 * static_cast<Eigen::Index>(l);
        MotionBlocks::Block<6>& block = out.b[static_cast<std::size_t>(out.pair(f.bodies[k] - 1, f.bodies[l] - 1))];
        for (int c = 0; c < 7; ++c) {
          block.q.col(c) -= to_virtual(body, user_K_.block<7, 1>(row, column + c));
          block.v.col(c) -= to_virtual(body, user_C_.block<7, 1>(row, column + c));
        }
        block.parts |= all;
        if (k != l) continue;
        for (int c = 0; c < 4; ++c) {
          block.q.col(3 + c).tail<3>() += 0.5 * G_times(Vector4d::Unit(c), user_Q_.segment<4>(row + 3));
        }
      }
    }
  }
}

void Dynamics::add_user_field_tangent(const ParameterBlock& block) {
  for (const UserForceData& f : data_.user_forces) {
    const Eigen::Index size = 7 * static_cast<Eigen::Index>(f.bodies.size());
    set_user_state(f);
    user_Q_rho_.setZero();
    f.force->Q_rho(t_, user_q_.head(size), user_v_.head(size), data_.rho, user_Q_rho_.topRows(size));
    for (int lane = 0; lane < kLanes; ++lane) {
      if (block.parameter[lane] < 0) continue;
      for (std::size_t k = 0; k < f.bodies.size(); ++k) {
        const std::size_t body = static_cast<std::size_t>(f.bodies[k]);
        load_dirs_[body].col(lane) += to_virtual(
            bodies_[body], user_Q_rho_.col(block.parameter[lane]).segment<7>(7 * static_cast<Eigen::Index>(k)));
      }
    }
  }
}

void Dynamics::add_user_adjoint(Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& rho_bar) {
  for (const UserForceData& f : data_.user_forces) {
    const Eigen::Index size = 7 * static_cast<Eigen::Index>(f.bodies.size());
    const auto q = user_q_.head(size), v = user_v_.head(size);
    set_user_state(f);
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const Eigen::Index at = 7 * static_cast<Eigen::Index>(k);
      const std::size_t body = static_cast<std::size_t>(f.bodies[k]);
      user_e_.segment<3>(at) = eta_[body - 1].head<3>();
      user_e_.segment<4>(at + 3) = 0.5 * G_transposed_times(bodies_[body].p, eta_[body - 1].tail<3>());
    }
    user_Q_.setZero(), user_K_.setZero(), user_C_.setZero(), user_Q_rho_.setZero();
    f.force->Q(t_, q, v, data_.rho, user_Q_.head(size));
    f.force->K(t_, q, v, data_.rho, user_K_.topLeftCorner(size, size));
    f.force->C(t_, q, v, data_.rho, user_C_.topLeftCorner(size, size));
    f.force->Q_rho(t_, q, v, data_.rho, user_Q_rho_.topRows(size));
    const auto e = user_e_.head(size);
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const Eigen::Index at = 7 * static_cast<Eigen::Index>(k), i = 7 * (f.bodies[k] - 1);
      const Vector3d eta_w = eta_[static_cast<std::size_t>(f.bodies[k]) - 1].tail<3>();
      y_bar.segment<7>(i).noalias() -= user_K_.block(0, at, size, 7).transpose().lazyProduct(e);
      y_bar.segment<7>(7 * data_.n + i).noalias() -= user_C_.block(0, at, size, 7).transpose().lazyProduct(e);
      y_bar.segment<4>(i + 3) += 0.5 * G_transposed_times_adjoint(eta_w, user_Q_.segment<4>(at + 3));
    }
    rho_bar.noalias() += user_Q_rho_.topRows(size).transpose().lazyProduct(e);
  }
}

}  // namespace mbsopt
