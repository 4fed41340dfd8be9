// One right-hand side of a mechanism, ready to be evaluated again and again at one state.
#pragma once

#include "bench/models.hpp"
#include "core/dynamics/dynamics.hpp"
#include "core/integrate/model_choice.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt::bench {

class RightHandSide {
 public:
  RightHandSide(const Scene& scene, const SimulationSettings& settings, Eigen::VectorXd y)
      : mechanism_(scene, Eigen::VectorXd(0)),
        dynamics_(mechanism_, settings.formulation,
                  model_of(mechanism_, settings, *runge_kutta_method(settings.integrator.type))),
        y_(std::move(y)) {
    ydot_.setZero(y_.size());
    angles_.setZero(static_cast<Eigen::Index>(mechanism_.data().angles.size()));
  }
  static RightHandSide of(const Linkage& linkage, const std::string& model) {
    Scene scene = scene_of(linkage);
    choose_model(scene.simulation, model);
    return {scene, scene.simulation, start_of(linkage)};
  }

  bool operator()() { return dynamics_.evaluate(0, y_, angles_, ydot_); }
  Vector3d acceleration(int rod) const { return ydot_.segment<3>(ydot_.size() / 2 + 7 * rod); }
  const Mechanism& mechanism() const { return mechanism_; }
  const Eigen::VectorXd& y() const { return y_; }

 private:
  Mechanism mechanism_;
  Dynamics dynamics_;
  Eigen::VectorXd y_, ydot_, angles_;
};

}  // namespace mbsopt::bench
