// User forces inside the equations of motion: from the 7 coordinates of a body, Q, to its 6 loads T'Q, and derivatives.
//   virtual work e'Q with e = T(p) eta = (eta_r, 1/2 G(p)' eta_theta)
#include "core/dynamics/dynamics.hpp"

#include "core/body/euler_parameters.hpp"

namespace mbsopt {

void Dynamics::add_user_loads() {
  for (const UserForceData& f : data_.user_forces) {
    const Eigen::Index size = 7 * static_cast<Eigen::Index>(f.bodies.size());
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const Eigen::Index at = 7 * static_cast<Eigen::Index>(k), q = 7 * (f.bodies[k] - 1);
      user_q_.segment<7>(at) = y_.segment<7>(q);
      user_v_.segment<7>(at) = y_.segment<7>(7 * data_.n + q);
    }
    user_Q_.setZero();
    f.force->Q(t_, user_q_.head(size), user_v_.head(size), data_.rho, user_Q_.head(size));
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const std::size_t body = static_cast<std::size_t>(f.bodies[k]);
      body_loads_[body] += to_virtual(bodies_[body], user_Q_.segment<7>(7 * static_cast<Eigen::Index>(k)));
    }
  }
}

void Dynamics::add_user_tangent(const ParameterBlock& block, const LaneRows& y_dir) {
  for (const UserForceData& f : data_.user_forces) {
    const Eigen::Index size = 7 * static_cast<Eigen::Index>(f.bodies.size());
    const auto q = user_q_.head(size), v = user_v_.head(size);
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const Eigen::Index at = 7 * static_cast<Eigen::Index>(k), i = 7 * (f.bodies[k] - 1);
      user_q_.segment<7>(at) = y_.segment<7>(i);
      user_v_.segment<7>(at) = y_.segment<7>(7 * data_.n + i);
    }
    user_Q_.setZero(), user_K_.setZero(), user_C_.setZero(), user_Q_rho_.setZero();
    f.force->Q(t_, q, v, data_.rho, user_Q_.head(size));
    f.force->K(t_, q, v, data_.rho, user_K_.topLeftCorner(size, size));
    f.force->C(t_, q, v, data_.rho, user_C_.topLeftCorner(size, size));
    f.force->Q_rho(t_, q, v, data_.rho, user_Q_rho_.topRows(size));
    for (int lane = 0; lane < kLanes; ++lane) {
      user_e_.setZero();
      if (block.parameter[lane] >= 0) user_e_.head(size) = user_Q_rho_.col(block.parameter[lane]).head(size);
      for (std::size_t k = 0; k < f.bodies.size(); ++k) {
        const Eigen::Index at = 7 * static_cast<Eigen::Index>(k), i = 7 * (f.bodies[k] - 1);
        user_e_.head(size).noalias() -= user_K_.block(0, at, size, 7).lazyProduct(y_dir.col(lane).segment<7>(i));
        user_e_.head(size).noalias() -=
            user_C_.block(0, at, size, 7).lazyProduct(y_dir.col(lane).segment<7>(7 * data_.n + i));
      }
      // (T'Q)' = T'Q' + (0, 1/2 G(p') Q_p)
      for (std::size_t k = 0; k < f.bodies.size(); ++k) {
        const Eigen::Index at = 7 * static_cast<Eigen::Index>(k);
        const std::size_t body = static_cast<std::size_t>(f.bodies[k]);
        const Vector4d p_dir = y_dir.col(lane).segment<4>(7 * (f.bodies[k] - 1) + 3);
        Vec<6> load = to_virtual(bodies_[body], user_e_.segment<7>(at));
        load.tail<3>() += 0.5 * G_times(p_dir, user_Q_.segment<4>(at + 3));
        load_dirs_[body].col(lane) += load;
      }
    }
  }
}

void Dynamics::add_user_adjoint(Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& rho_bar) {
  for (const UserForceData& f : data_.user_forces) {
    const Eigen::Index size = 7 * static_cast<Eigen::Index>(f.bodies.size());
    const auto q = user_q_.head(size), v = user_v_.head(size);
    for (std::size_t k = 0; k < f.bodies.size(); ++k) {
      const Eigen::Index at = 7 * static_cast<Eigen::Index>(k), i = 7 * (f.bodies[k] - 1);
      const std::size_t body = static_cast<std::size_t>(f.bodies[k]);
      user_q_.segment<7>(at) = y_.segment<7>(i);
      user_v_.segment<7>(at) = y_.segment<7>(7 * data_.n + i);
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
