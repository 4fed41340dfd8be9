#include "optim/fit/experiment_stack.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "optim/machine/on_threads.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// A trial that needs so many times the steps of all before it has gone astray, for example by negative damping. It
// counts as failed.
constexpr long kStepGrowth = 30;
constexpr double kRounding = 1e-12;  // of a motion with fixed steps, relative

Index samples_of(const std::vector<ExperimentStack::Member>& members) {
  return std::accumulate(members.begin(), members.end(), Index{0},
                         [](Index n, const auto& m) { return n + static_cast<Index>(m.model.samples().size()); });
}

Index priors_of(const std::vector<UnknownParameter>& unknowns) {
  return std::count_if(unknowns.begin(), unknowns.end(), [](const auto& u) { return u.description.prior.has_value(); });
}

VariableScaling scaling_of(const std::vector<UnknownParameter>& unknowns) {
  std::vector<Parameter> parameters;
  for (const UnknownParameter& u : unknowns) parameters.push_back(u.description);
  return VariableScaling(parameters);
}

// f(model, sample) of every sample.
template <class F>
VectorXd per_sample(const std::vector<ExperimentStack::Member>& members, F&& f) {
  VectorXd values(samples_of(members));
  Index row = 0;
  for (const ExperimentStack::Member& m : members)
    for (const Experiment::Sample& sample : m.model.samples()) values(row++) = f(m.model, sample);
  return values;
}

}  // namespace

ExperimentStack::ExperimentStack(std::vector<Member> members, std::vector<UnknownParameter> unknowns,
                                 const Loss& fit_loss, std::function<bool(double t)> go_on, int threads)
    : LeastSquaresProblem(std::ssize(unknowns), samples_of(members) + priors_of(unknowns)),
      members_(std::move(members)),
      unknowns_(std::move(unknowns)),
      scaling_(scaling_of(unknowns_)),
      go_on_(std::move(go_on)),
      threads_(threads) {
  x_lower = scaling_.x_lower();
  x_upper = scaling_.x_upper();
  loss = fit_loss;
  plain = priors_of(unknowns_);
  Index row = 0;
  for (const Member& m : members_) {
    Dependence& part = parts.emplace_back();
    part.rows.resize(m.model.samples().size());
    std::iota(part.rows.begin(), part.rows.end(), row);
    row += static_cast<Index>(part.rows.size());
    for (const Experiment::Unknown& unknown : m.model.unknowns()) part.variables.push_back(unknown.at);
  }
  tie();
  for (Index k = 0; k < variables(); ++k) {  // a prior stands beside the samples that depend on its variable
    if (!unknowns_[static_cast<std::size_t>(k)].description.prior) continue;
    auto part = std::ranges::find_if(
        parts, [&](const Dependence& p) { return std::ranges::find(p.variables, k) != p.variables.end(); });
    if (part == parts.end()) part = parts.insert(part, {{}, {k}});
    part->rows.push_back(row++);
  }
}

// The equations stand beside the samples of the member that ends there.
void ExperimentStack::tie() {
  // The largest start value of a parameter in any member.
  const auto size_of = [&](const Experiment::Unknown& given) {
    const std::string& name = unknowns_[static_cast<std::size_t>(given.at)].description.name;
    double largest = 0;
    for (const UnknownParameter& u : unknowns_)
      if (u.description.name == name) largest = std::max(largest, std::abs(u.description.value));
    return largest;
  };
  Index row = size;
  std::vector<double> sizes;  // of the equations, which are in units of the start parameters
  for (std::size_t i = 0; i + 1 < members_.size(); ++i) {
    if (!members_[i].continues) continue;
    Experiment& next = members_[i + 1].model;
    std::vector<Experiment::Unknown> own;
    for (const Experiment::Unknown& unknown : next.unknowns())
      if (!unknowns_[static_cast<std::size_t>(unknown.at)].shared) own.push_back(unknown);
    const StateChart chart = next.chart_of_start(own);
    members_[i].model.read_end(chart), next.read_start(chart);
    std::vector<Index>& variables = parts[i].variables;
    for (const Experiment::Unknown& unknown : next.unknowns())
      if (std::ranges::find(variables, unknown.at) == variables.end()) variables.push_back(unknown.at);
    for (Index k = 0; k < chart.size(); ++k) parts[i].rows.push_back(row++);
    for (const Experiment::Unknown& unknown : own) sizes.push_back(size_of(unknown));
  }
  equalities = row - size;
  size = row;
  if (sizes.empty()) return;
  const IntegratorSettings integrator = members_.front().model.simulated().simulation.integrator;
  closed = (integrator.step ? kRounding : integrator.rtol) *
           Eigen::Map<const VectorXd>(sizes.data(), static_cast<Index>(sizes.size()));
}

VectorXd ExperimentStack::measured() const {
  return per_sample(members_, [](const Experiment&, const Experiment::Sample& sample) { return sample.measured; });
}

VectorXd ExperimentStack::sigma() const {
  return per_sample(members_,
                    [](const Experiment& model, const Experiment::Sample& s) { return model.sigma(s.channel); });
}

std::vector<SampledRecord> ExperimentStack::in_time(const std::function<bool(std::size_t)>& joins_last) const {
  const VectorXd t =
      per_sample(members_, [](const Experiment& model, const Experiment::Sample& s) { return model.times()[s.time]; });
  std::vector<SampledRecord> joined;
  Index row = 0;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    row += static_cast<Index>(members_[i].model.samples().size());
    const Index first = joined.empty() ? 0 : joined.back().first + joined.back().t.size();
    if (joined.empty() || !joins_last(i)) joined.push_back({first, {}});
    joined.back().t = t(Eigen::seq(joined.back().first, row - 1));
  }
  return joined;
}

std::vector<SampledRecord> ExperimentStack::records_in_time() const {
  return in_time([&](std::size_t i) { return members_[i - 1].continues; });
}

std::vector<SampledRecord> ExperimentStack::motions_in_time() const {
  return in_time([&](std::size_t i) { return members_[i].follows; });
}

std::vector<Experiment::Residuals> ExperimentStack::residuals(const VectorXd& u) {
  constexpr Index kMostNumbers = 50'000;  // of a member: more would fill the memory
  std::vector<Experiment::Residuals> found(members_.size());
  const auto key_of = [&](std::size_t i) {
    std::vector<double> sigma;
    for (std::size_t c = 0; c < members_[i].model.channels(); ++c) sigma.push_back(members_[i].model.sigma(c));
    return std::tuple(i, std::vector<double>(u.begin(), u.end()), std::move(sigma));
  };
  std::vector<std::size_t> simulated;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const auto known = remembers ? remembered_.find(key_of(i)) : remembered_.end();
    if (known == remembered_.end())
      simulated.push_back(i);
    else
      found[i] = known->second;
  }
  simulations_ += static_cast<long>(simulated.size());
  on_threads(simulated.size(), threads_, [&](std::size_t job) {
    const Member& m = members_[simulated[job]];
    Experiment::Limits limits{go_on_, {}};
    if (m.most_steps > 0) limits.max_steps = kStepGrowth * m.most_steps;
    found[simulated[job]] = m.model.residuals(u, limits);
  });
  for (const std::size_t i : simulated) {
    if (!found[i].ok) continue;
    members_[i].most_steps = std::max(members_[i].most_steps, found[i].steps);
    if (remembers && found[i].z.size() + found[i].z_u.size() <= kMostNumbers) remembered_[key_of(i)] = found[i];
  }
  return found;
}

Eigen::MatrixXd ExperimentStack::z_rho(const LeastSquaresPoint& point, const VectorXd& x) const {
  return point.z_x * scaling_.rho_x(x).cwiseInverse().asDiagonal();
}

LeastSquaresPoint ExperimentStack::collected(const std::vector<Experiment::Residuals>& found, const VectorXd& x) const {
  LeastSquaresPoint point{true, {}, VectorXd::Zero(size), Eigen::MatrixXd::Zero(size, variables())};
  const VectorXd u = scaling_.to_rho(x), u_x = scaling_.rho_x(x);
  Index row = 0;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Index n = found[i].z.size();
    if (!found[i].ok) return {false, found[i].message, std::move(point.z), std::move(point.z_x)};
    point.z.segment(row, n) = found[i].z;
    point.z_x.middleRows(row, n) = found[i].z_u * u_x.asDiagonal();
    row += n;
  }
  for (Index k = 0; k < u.size(); ++k)
    if (const auto& prior = unknowns_[static_cast<std::size_t>(k)].description.prior) {
      point.z(row) = (u(k) - prior->mean) / prior->sigma;
      point.z_x(row++, k) = u_x(k) / prior->sigma;
    }
  for (std::size_t i = 0; i + 1 < members_.size(); ++i) {
    if (!members_[i].continues) continue;
    const Index n = found[i].end.size();
    point.z.segment(row, n) = found[i].end - found[i + 1].start;
    point.z_x.middleRows(row, n) = (found[i].end_u - found[i + 1].start_u) * u_x.asDiagonal();
    row += n;
  }
  return point;
}

}  // namespace mbsopt::inline optim
