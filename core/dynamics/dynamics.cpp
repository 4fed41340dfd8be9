#include "core/dynamics/dynamics.hpp"

#include <algorithm>

#include "core/dynamics/planar_dynamics.hpp"

namespace mbsopt {

Dynamics::Dynamics(const Mechanism& mechanism, const FormulationSettings& settings, Model model)
    : mechanism_(mechanism), constrained_(settings.type == FormulationType::augmented_lagrangian) {
  if (model == Model::planar) {
    planar_ = std::make_unique<PlanarDynamics>(mechanism_.data(), settings);
  } else {
    spatial_ = std::make_unique<SpatialDynamics>(mechanism, settings);
  }
}

Dynamics::~Dynamics() = default;

bool Dynamics::evaluate(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                        Eigen::Ref<Eigen::VectorXd> ydot) {
  const auto evaluated = [&](auto& model) {
    const bool finite = model.evaluate(t, y, angles, ydot);
    const double ratio = constrained_ ? model.solver().residual_ratio() : 0;  // to z
    if (ratio > worst_residual_) {
      // If nothing accelerates (a wheel driven at constant speed), z is rounding only.
      const double size = model.solver().residual_size();
      const double usual = size / model.usual_acceleration(size / worst_residual_);
      worst_residual_ = std::max(worst_residual_, std::min(ratio, usual));
    }
    return finite;
  };
  return planar_ ? evaluated(*planar_) : evaluated(*spatial_);
}

const Eigen::VectorXd& Dynamics::lambda() const { return planar_ ? planar_->lambda() : spatial_->lambda(); }

bool Dynamics::linearise(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                         const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda) {
  ++linearised_states_;
  return planar_ ? planar_->linearise(t, y, angles, a, lambda) : spatial_->linearise(t, y, angles, a, lambda);
}

void Dynamics::acceleration_tangent(const ParameterBlock& block, const LaneRows& y_dir, Eigen::Ref<LaneRows> a_dir) {
  planar_ ? planar_->acceleration_tangent(block, y_dir, a_dir) : spatial_->acceleration_tangent(block, y_dir, a_dir);
}

void Dynamics::add_adjoint(const Eigen::VectorXd& w, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar,
                           Eigen::VectorXd& rho_bar) {
  planar_ ? planar_->add_adjoint(w, y_bar, theta_bar, rho_bar) : spatial_->add_adjoint(w, y_bar, theta_bar, rho_bar);
}

long Dynamics::factor_blocks() const {
  return planar_ ? planar_->solver().factor_blocks() : spatial_->solver().factor_blocks();
}

long Dynamics::factorisations() const {
  return planar_ ? planar_->solver().factorisations() : spatial_->solver().factorisations();
}

}  // namespace mbsopt
