#include "core/integrate/gradient_quadrature.hpp"

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

GradientQuadrature::GradientQuadrature(const Mechanism& mechanism, const Method& method, std::span<const Cost> costs)
    : mechanism_(mechanism),
      costs_(costs),
      nodes_(static_cast<std::size_t>(method.nodes)),
      watch_(method, costs, nullptr),
      along_motion_(nodes_ * costs.size(), 0.0),
      along_parameters_(nodes_ * costs.size(), 0.0),
      influence_(Eigen::MatrixXd::Zero(mechanism.states(), static_cast<Eigen::Index>(costs.size()))),
      fastest_(Eigen::VectorXd::Zero(mechanism.states())) {}

void GradientQuadrature::take(std::size_t cost, int node, double weight, VecIn y_bar, VecIn ydot, VecIn rho_bar) {
  const std::size_t k = cost * nodes_ + static_cast<std::size_t>(node);
  const Eigen::VectorXd& rho = mechanism_.rho();
  double along_parameters = 0;
  for (const int p : mechanism_.data().active)  // a parameter of value 0 counts with the size 1
    along_parameters += rho_bar(p) * (rho(p) == 0 ? 1 : rho(p));
  influence_.col(static_cast<Eigen::Index>(cost)) += y_bar.cwiseAbs();
  fastest_ = fastest_.cwiseMax(ydot.cwiseAbs());
  along_motion_[k] = y_bar.dot(ydot) / weight, along_parameters_[k] = along_parameters / weight;
}

void GradientQuadrature::end_step(const Step& step) {
  using Integrand = QuadratureWatch::Integrand;
  for (std::size_t o = 0; o < costs_.size(); ++o) {
    if (!costs_[o].running) continue;
    watch_.look_at(step, o, std::span(along_motion_).subspan(o * nodes_, nodes_), Integrand::along_motion);
    watch_.look_at(step, o, std::span(along_parameters_).subspan(o * nodes_, nodes_), Integrand::along_parameters);
  }
}

void GradientQuadrature::add_to(SimulationStatistics& statistics) {
  for (std::size_t o = 0; o < costs_.size(); ++o)
    watch_.count_at_least(o, QuadratureWatch::Integrand::along_motion,
                          influence_.col(static_cast<Eigen::Index>(o)).dot(fastest_));
  watch_.add_to(statistics);
}

}  // namespace mbsopt
