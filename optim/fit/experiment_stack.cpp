#include "optim/fit/experiment_stack.hpp"

#include <algorithm>
#include <numeric>

namespace mbsopt {
namespace {

// A trial that needs so many times the steps of all before it has gone astray (negative damping, say): it counts as
// failed before it takes forever.
constexpr long kStepGrowth = 30;

Eigen::Index samples_of(const std::vector<ExperimentStack::Member>& members) {
  return std::accumulate(members.begin(), members.end(), Eigen::Index{0}, [](Eigen::Index n, const auto& m) {
    return n + static_cast<Eigen::Index>(m.model.samples().size());
  });
}

Eigen::Index priors_of(const std::vector<UnknownParameter>& unknowns) {
  return std::count_if(unknowns.begin(), unknowns.end(), [](const auto& u) { return u.description.prior.has_value(); });
}

// f(model, sample) of every sample.
template <class F>
Eigen::VectorXd per_sample(const std::vector<ExperimentStack::Member>& members, F&& f) {
  Eigen::VectorXd values(samples_of(members));
  Eigen::Index row = 0;
  for (const ExperimentStack::Member& m : members)
    for (const Experiment::Sample& sample : m.model.samples()) values(row++) = f(m.model, sample);
  return values;
}

}  // namespace

ExperimentStack::ExperimentStack(std::vector<Member> members, const std::vector<UnknownParameter>& unknowns,
                                 const VariableScaling& scaling, const Loss& fit_loss)
    : LeastSquaresProblem(scaling.size(), samples_of(members) + priors_of(unknowns)),
      members_(std::move(members)),
      scaling_(scaling) {
  x_lower = scaling.x_lower(), x_upper = scaling.x_upper();
  loss = fit_loss;
  for (std::size_t i = 0; i < unknowns.size(); ++i)
    if (const auto& prior = unknowns[i].description.prior)
      priors_.push_back({static_cast<Eigen::Index>(i), prior->mean, prior->sigma});
  plain = static_cast<Eigen::Index>(priors_.size());
}

Eigen::VectorXd ExperimentStack::measured() const {
  return per_sample(members_, [](const Experiment&, const Experiment::Sample& sample) { return sample.measured; });
}

Eigen::VectorXd ExperimentStack::sigma() const {
  return per_sample(members_,
                    [](const Experiment& model, const Experiment::Sample& s) { return model.sigma(s.channel); });
}

std::vector<SampledRecord> ExperimentStack::records_in_time() const {
  const Eigen::VectorXd t =
      per_sample(members_, [](const Experiment& model, const Experiment::Sample& s) { return model.times()[s.time]; });
  std::vector<SampledRecord> in_time;
  Eigen::Index row = 0;
  for (const Member& m : members_) {
    const Eigen::Index n = static_cast<Eigen::Index>(m.model.samples().size());
    in_time.push_back({row, t.segment(row, n)});
    row += n;
  }
  return in_time;
}

Experiment::Residuals ExperimentStack::residuals(const Member& member, const Eigen::VectorXd& u) {
  ResidualRecords::Asked asked{member.experiment, u, {}};
  Experiment::Residuals r;
  if (records) {
    for (std::size_t c = 0; c < member.model.channels(); ++c) asked.sigma.push_back(member.model.sigma(c));
    if (records->recall(asked, r)) return r;
  }
  ++simulations_;
  Experiment::Limits limits{go_on, {}};
  if (member.most_steps > 0) limits.max_steps = kStepGrowth * member.most_steps;
  r = member.model.residuals(u, limits);
  if (records && r.ok) records->record(asked, r);
  return r;
}

void ExperimentStack::evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& point) {
  const Eigen::VectorXd u = scaling_.to_rho(x), u_x = scaling_.rho_x(x);
  Eigen::Index row = 0;
  for (Member& m : members_) {
    const Experiment::Residuals r = residuals(m, u);
    if (!r.ok) {
      point.ok = false, point.message = r.message;
      return;
    }
    m.most_steps = std::max(m.most_steps, r.steps);
    const Eigen::Index n = r.z.size();
    point.z.segment(row, n) = r.z;
    point.z_x.middleRows(row, n) = r.z_u * u_x.asDiagonal();
    row += n;
  }
  for (const Prior& p : priors_) {
    point.z(row) = (u(p.at) - p.mean) / p.sigma;
    point.z_x(row, p.at) = u_x(p.at) / p.sigma;
    ++row;
  }
}

}  // namespace mbsopt
