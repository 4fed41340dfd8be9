#include "core/start/singular_window.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/start/poses.hpp"

namespace mbsopt {

using Eigen::Index;

SingularWindow::Weights SingularWindow::weights(double time) const {
  Weights w = Weights::Ones();
  for (std::size_t k = 0; k < kNodes; ++k)
    for (std::size_t j = 0; j < kNodes; ++j)
      if (j != k) w(static_cast<Index>(k)) *= (time - nodes[j].t) / (nodes[k].t - nodes[j].t);
  return w;
}

bool SingularWindow::for_nodes(double time, const std::function<bool(double, const DrivenState&)>& f) const {
  const Weights w = weights(time);
  const double* weight = w.data();
  return std::ranges::all_of(nodes, [&](const DrivenState& node) { return f(*weight++, node); });
}

DrivenState SingularWindow::state_at(double time) const {
  DrivenState s = nodes.front();
  s.t = time;
  s.y.setZero();
  s.angles.setZero();
  s.a.setZero();
  for_nodes(time, [&](double weight, const DrivenState& node) {
    s.y += weight * node.y;
    s.angles += weight * node.angles;
    s.a += weight * node.a;
    return true;
  });
  return s;
}

Eigen::ArrayXd SingularWindow::roughness(const Eigen::MatrixXd& x) const {
  constexpr double kNegligible = 1e-6;  // of the largest row: rows that vanish consist of rounding
  Weights u = Weights::Ones(), v;
  for (std::size_t k = 0; k < kNodes; ++k) {
    for (std::size_t j = 0; j < kNodes; ++j)
      if (j != k) u(static_cast<Index>(k)) *= half / (nodes[k].t - nodes[j].t);
    v(static_cast<Index>(k)) = u(static_cast<Index>(k)) * (nodes[k].t - t) / half;
  }
  const double least = kNegligible * x.cwiseAbs().maxCoeff() + 1e-300;
  const auto relative = [&](const Weights& difference) -> Eigen::ArrayXd {
    return (x * difference).array().abs() /
           ((x.cwiseAbs() * difference.cwiseAbs()).array() + least * difference.lpNorm<1>());
  };
  return relative(u).max(relative(v));
}

const Motion& ContinuedMotion::motion(const StatePoint& at, MotionPart part) {
  constexpr double kNoLimit = 1e-3;  // of the roughness: 1e-5 for five waves in the width of the nodes, 0.1 for a pole
  const SingularWindow* const w = window_(at.t);
  if (!w) return solved_.motion(at, part);
  Eigen::MatrixXd z, lambda;
  Index k = 0;
  w->for_nodes(at.t, [&](double, const DrivenState& node) {
    motion_ = solved_.motion({node.t, node.y, node.angles}, part);
    z.resize(flat(motion_.z).size(), SingularWindow::kNodes);
    lambda.resize(motion_.lambda.size(), z.cols());
    z.col(k) = flat(motion_.z);
    lambda.col(k++) = motion_.lambda;
    return true;
  });
  const SingularWindow::Weights weights = w->weights(at.t);
  Eigen::Map<Eigen::VectorXd>(motion_.z.front().data(), z.rows()) = z * weights;
  motion_.lambda = (w->roughness(lambda) < kNoLimit).select((lambda * weights).array(), NAN);
  return motion_;
}

void ContinuedMotion::fold_bar(const StatePoint& at, VecOut y_bar, VecOut rho_bar) {
  const SingularWindow* const w = window_(at.t);
  if (!w) return solved_.fold_bar(at, y_bar, rho_bar);
  Motion& of_node = solved_.bar(MotionPart::all);
  const Motion whole = of_node;
  Eigen::VectorXd bar(y_bar.size());
  std::size_t k = 0;
  w->for_nodes(at.t, [&](double weight, const DrivenState& node) {
    solved_.bar(MotionPart::all).lambda = weight * whole.lambda;
    for (std::size_t i = 0; i < whole.z.size(); ++i) of_node.z[i] = weight * whole.z[i];
    bar.setZero();
    solved_.fold_bar({node.t, node.y, node.angles}, bar, rho_bar);
    if (tangents.empty())
      y_bars[k++] += bar;
    else
      rho_bar += tangents[k++].transpose() * bar;
    return true;
  });
}

void SingularPosition::note(const std::string& name) {
  if (std::ranges::find(lacking, name) == lacking.end()) lacking.push_back(name);
}

std::vector<std::string> lacking_sensors(const Mechanism& mechanism, const StatePoint& at) {
  std::vector<std::string> names;
  for (int i = 0; i < mechanism.sensors(); ++i)
    if (std::isnan(mechanism.sensor_value(i, at)))
      names.push_back("sensor '" + mechanism.data().sensor_names[static_cast<std::size_t>(i)] + "'");
  return names;
}

std::string in_words(const std::vector<SingularPosition>& positions, const std::vector<std::string>& parameter_names) {
  std::set<std::string> owners, lacking, parameters;
  std::size_t count = 0;
  double first = 0, half = 0;
  bool is_rough = false;
  for (const SingularPosition& s : positions) {
    if (s.lacking.empty() && s.parameters.empty() && s.half > 0) continue;
    if (count++ == 0) first = s.t;
    owners.insert(s.owners.begin(), s.owners.end());
    lacking.insert(s.lacking.begin(), s.lacking.end());
    for (const int k : parameter_names.empty() ? std::vector<int>{} : s.parameters)
      parameters.insert("'" + parameter_names[at(k)] + "'");
    half = std::max(half, s.half);
    is_rough = is_rough || s.half == 0;
  }
  if (count == 0) return {};
  std::string words = fmt::format("singular position at t = {:.5g} s{}", first,
                                  count > 1 ? fmt::format(", the first of {}", count) : "");
  if (!owners.empty()) words += fmt::format(": the equations of {} depend on each other", fmt::join(owners, ", "));
  if (!lacking.empty())
    words += fmt::format(". There is no limit of {}: rows, extremes, ranges and integrals leave out {:.2g} s around it",
                         fmt::join(lacking, ", "), half);
  if (!parameters.empty())
    words +=
        fmt::format(". The motion has no derivative there in {}: gradients may be wrong", fmt::join(parameters, ", "));
  if (is_rough)
    words += ". The motion does not pass it smoothly: values next to it, and the branch after it, may be wrong";
  return words;
}

}  // namespace mbsopt
