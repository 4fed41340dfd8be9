#include "core/dynamics/spatial_dynamics.hpp"

#include "core/body/euler_parameters.hpp"
#include "core/body/lanes.hpp"
#include "core/body/state_layout.hpp"

namespace mbsopt {

SpatialDynamics::SpatialDynamics(const Mechanism& mechanism, const FormulationSettings& settings)
    : mechanism_(mechanism),
      data_(mechanism_.data()),
      settings_(saddle_settings(data_, settings)),
      terms_(data_, settings),
      solver_(data_, settings_.alpha, settings_.compliance, terms_.user_masses()) {
  const std::size_t n = static_cast<std::size_t>(data_.n);
  loads_bar_.resize(n);
  eta_.resize(n);
  z_dir_.resize(n);
  pddot_bar_.resize(n + 1);
  for (Eigen::VectorXd* x : {&gamma_, &mu_, &g_}) x->setZero(data_.m);
  lambda_dir_.setZero(data_.m, kLanes);
}

bool SpatialDynamics::evaluate(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                               Eigen::Ref<Eigen::VectorXd> ydot) {
  const StateLayout layout{data_.n};
  terms_.set_state(t, y, angles);
  if (!solver_.factor(terms_.frames, &gamma_)) return false;
  terms_.complete_gamma(gamma_);
  g_ = -gamma_;
  solver_.solve(terms_.f, g_, settings_.values, terms_.z, terms_.lambda);

  ydot.head(layout.positions()) = y.tail(layout.positions());
  bool finite = true;
  for (std::size_t k = 1; k < terms_.frames.size(); ++k) {
    const Vec<6>& z = terms_.z[k - 1];
    terms_.frames[k].omegadot = z.tail<3>();
    ydot.segment<3>(layout.v(k)) = z.head<3>();
    ydot.segment<4>(layout.pdot(k)) = pddot_of(terms_.frames[k]);
    finite = finite && z.allFinite();
  }
  return finite;
}

bool SpatialDynamics::linearise(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                                const Eigen::Ref<const Eigen::VectorXd>& a,
                                const Eigen::Ref<const Eigen::VectorXd>& lambda) {
  terms_.set_motion(t, y, angles, a, lambda);
  return solver_.factor(terms_.frames);
}

void SpatialDynamics::tangent(const ParameterBlock& block, const LaneRows& y_dir, LaneRows& ydot_dir) {
  const Eigen::Index half = StateLayout{data_.n}.positions();
  ydot_dir.topRows(half) = y_dir.bottomRows(half);
  acceleration_tangent(block, y_dir, ydot_dir.bottomRows(half));
}

void SpatialDynamics::acceleration_tangent(const ParameterBlock& block, const LaneRows& y_dir,
                                           Eigen::Ref<LaneRows> a_dir) {
  const StateLayout layout{data_.n};
  terms_.set_tangents(block, y_dir);
  solver_.solve(terms_.b_dir, terms_.c_dir, settings_.derivatives, z_dir_, lambda_dir_);
  for (std::size_t k = 1; k < terms_.frames.size(); ++k) {
    const Lanes<3> w = z_dir_[k - 1].bottomRows<3>();
    a_dir.middleRows<3>(layout.q(k)) = z_dir_[k - 1].topRows<3>();
    // pddot' = (pddot' with omegadot fixed) + 1/2 G(p)' omegadot'
    auto out = a_dir.middleRows<4>(layout.p(k));
    out = pddot_tangent(terms_.frames[k], y_dir.middleRows<4>(layout.p(k)), y_dir.middleRows<4>(layout.pdot(k)));
    out += 0.5 * G_transposed_times_lanes(terms_.frames[k].p, w);
  }
}

void SpatialDynamics::add_adjoint(const Eigen::VectorXd& w, Eigen::Ref<Eigen::VectorXd> y_bar,
                                  Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar, const Motion* motion) {
  const StateLayout layout{data_.n};
  for (std::size_t k = 1; k < terms_.frames.size(); ++k) {
    loads_bar_[k - 1] = to_virtual(terms_.frames[k], w.segment<7>(layout.v(k)));
    if (motion) loads_bar_[k - 1] += motion->z[k - 1];
    pddot_bar_[k] = w.segment<4>(layout.pdot(k));
  }
  g_.setZero();
  if (motion) g_ = motion->lambda;
  solver_.solve(loads_bar_, g_, settings_.derivatives, eta_, mu_);
  y_bar.tail(layout.positions()) += w.head(layout.positions());
  terms_.add_pull_back(eta_, mu_, pddot_bar_, y_bar, theta_bar, rho_bar);
}

}  // namespace mbsopt
