#include "optim/objective/objective.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <stdexcept>

#include "core/expression/did_you_mean.hpp"
#include "core/scene/scene_path.hpp"
#include "core/scene/signals.hpp"
#include "optim/objective/bound_costs.hpp"

namespace mbsopt::inline optim {
namespace {

// Adds the objective's name to an exception of f.
auto named(const std::string& objective, const auto& f) {
  try {
    return f();
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("objective '{}': {}", objective, error.what()));
  }
}

template <class Make>
auto at_place(const std::string& place, const Make& make) {
  try {
    return make();
  } catch (const UnknownName& error) {
    throw std::invalid_argument(place + ": " + error.what());
  }
}

// M(x - x0), whose integral gives a mean of x.
class Integrand final : public PointCost {
 public:
  Integrand(std::shared_ptr<const PointCost> x, const MeanKind& kind, double k, double x0)
      : x_(std::move(x)), kind_(kind), k_(k), x0_(x0) {}
  double value(const StatePoint& at) const override { return kind_.M(x_->value(at) - x0_, k_).value; }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const override {
    const Derivatives m = kind_.M(x_->value(at) - x0_, k_);
    x_->add_gradient(at, scale * m.first, y_bar, rho_bar);
    return m.value;
  }
  const Eigen::VectorXd* rho() const override { return x_->rho(); }
  const SwitchedProgram* program() const override { return x_->program(); }
  std::shared_ptr<const PointCost> bound_to(const Mechanism& mechanism, const Program* program) const override {
    std::shared_ptr<const PointCost> x = x_->bound_to(mechanism, program);
    return x ? std::make_shared<Integrand>(std::move(x), kind_, k_, x0_) : nullptr;
  }

 private:
  std::shared_ptr<const PointCost> x_;
  const MeanKind& kind_;
  double k_, x0_;
};

}  // namespace

Objective::Objective(const Scene& scene, const ObjectiveSpec& spec) : name_(spec.name), spec_(spec) {
  const std::string place = "objectives." + spec.name;
  auto compile = [&](const std::optional<Expression>& expression, const std::string& part) {
    std::optional<CostExpression> result;
    if (!expression) return result;
    result = at_place(place + "." + part, [&] { return CostExpression(*expression, scene); });
    if (result->is_zero()) result.reset();
    return result;
  };
  mean_ = given_kind(spec.means);
  const std::string_view part = mean_ ? mean_->name : "running";
  if (mean_ && (spec.running || spec.terminal || spec.parameters_only || !spec.samples.empty() || !spec.track.empty()))
    throw std::invalid_argument(
        fmt::format("{}.{}: must be the only part of its objective, but other parts are given", place, part));
  sharpness_ = spec.sharpness.value_or(ObjectiveSpec::kSharpness);
  duration_ = scene.simulation.end_time - scene.simulation.start_time;
  running_ = compile(mean_ ? mean_of(spec.means, part) : spec.running, std::string(part));
  terminal_ = compile(spec.terminal, "terminal");
  const double t0 = scene.simulation.start_time, t1 = scene.simulation.end_time;
  for (std::size_t i = 0; i < spec.samples.size(); ++i) {
    const ObjectiveSample& sample = spec.samples[i];
    const std::string sample_part = fmt::format("samples[{}]", i);
    if (!(sample.time >= t0 && sample.time <= t1))
      throw std::invalid_argument(fmt::format("{}.{}.time: is {} s, outside the simulated time {} to {} s", place,
                                              sample_part, sample.time, t0, t1));
    if (std::optional<CostExpression> value = compile(sample.value, sample_part + ".value"))
      samples_.push_back({sample.time, *std::move(value)});
  }
  for (std::size_t i = 0; i < spec.track.size(); ++i)
    follow(spec.track[i], scene, fmt::format("{}.track[{}]", place, i));
  for (std::vector<Sample>* const all : {&samples_, &residuals_})
    std::stable_sort(all->begin(), all->end(), [](const Sample& a, const Sample& b) { return a.time < b.time; });
  if (spec.frequency_response)
    response_ = at_place(place + ".frequency_response",
                         [&] { return std::make_shared<const FrequencyResponse>(scene, *spec.frequency_response); });
  if (spec.eigenvalue) mode_ = std::make_shared<const FollowedMode>(scene, *spec.eigenvalue);
  if (spec.parameters_only)
    parameters_only_ =
        at_place(place + ".parameters_only", [&] { return Program(*spec.parameters_only, parameter_symbols(scene)); });
}

// sum over rows k of weight (sensor(t_k) - column_k)^2
void Objective::follow(const TrackTerm& term, const Scene& scene, const std::string& place) {
  if (!term.curve) throw std::invalid_argument(place + ": has no samples: nothing has read its file");
  const Expression sensor = Expression::parse(term.sensor);
  const Expression root = term.weight.is_number() ? Expression(std::sqrt(term.weight.number()))
                                                  : Expression::parse("sqrt(" + term.weight.text() + ")");
  const auto compile = [&](const Expression& expression) {
    return at_place(place + ".weight", [&] { return CostExpression(expression, scene); });
  };
  const double t0 = scene.simulation.start_time, t1 = scene.simulation.end_time;
  if (term.timing == Timing::prescribed) {
    const Expression off = sensor - expression_of(term, "column");
    const CostExpression square = compile(term.weight * (off * off)), residual = compile(root * off);
    for (const double t : term.curve->x())
      if (t >= t0 && t <= t1) samples_.push_back({t, square}), residuals_.push_back({t, residual});
    return;
  }
  if (!free_instants_) free_instants_.emplace(scene.simulation);
  const std::vector<std::size_t> points = free_instants_->add(term.file, term.timing == Timing::ordered, *term.curve,
                                                              compile(sensor), compile(term.weight));
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Expression off = sensor - Expression(term.curve->y()[k]);
    samples_.push_back({t0, compile(term.weight * (off * off)), points[k]});
    residuals_.push_back({t0, compile(root * off), points[k]});
  }
}

std::vector<Objective::Instant> Objective::instants_of(const std::vector<Sample>& samples, const Mechanism& mechanism,
                                                       const Progress& progress) const {
  std::vector<FreeInstants::Instant> free;
  try {
    if (free_instants_) free = free_instants_->nearest(mechanism, progress);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(
        fmt::format("objectives.{}.track: timing that is not prescribed needs a motion that the "
                    "drives determine ({})",
                    name_, error.what()));
  }
  std::vector<Instant> instants;
  for (const Sample& sample : samples) {
    if (sample.point)
      instants.push_back({free[*sample.point].tau, free[*sample.point].block});
    else
      instants.push_back({sample.time, {}});
  }
  return instants;
}

Objective::Objective(std::string name, std::shared_ptr<const RunningCost> running,
                     std::shared_ptr<const TerminalCost> terminal)
    : name_(std::move(name)), user_running_(std::move(running)), user_terminal_(std::move(terminal)) {
  if (!user_running_ && !user_terminal_)
    throw std::invalid_argument(fmt::format("objective '{}': has neither a running nor a terminal cost (null)", name_));
}

bool Objective::needs_simulation() const {
  return running_ || terminal_ || !samples_.empty() || user_running_ || user_terminal_;
}

std::shared_ptr<const PointCost> Objective::expression(const Mechanism& mechanism) const {
  return running_ ? running_->bind(mechanism) : nullptr;
}

std::vector<ObjectivePart> Objective::parts() const {
  switch (extreme()) {
    case Extreme::maximum:
      return {{1, 1}};
    case Extreme::minimum:
      return {{-1, 1}};
    case Extreme::both:
      return {{1, 1}, {-1, -1}};
    case Extreme::none:
      break;
  }
  return {{}};
}

Cost Objective::cost(const Mechanism& mechanism, const ObjectivePart& part, double x0, const Progress& progress) const {
  Cost cost;
  cost.name = name_;
  cost.is_extreme = is_extreme();
  if (running_) cost.running = running_->bind(mechanism);
  if (running_ && mean_) cost.running = std::make_shared<Integrand>(cost.running, *mean_, exponent(part), x0);
  if (terminal_) cost.terminal = terminal_->bind(mechanism);
  std::map<const void*, std::shared_ptr<const PointCost>> bound;  // rows of a file share an expression
  const std::vector<Instant> instants = instants_of(samples_, mechanism, progress);
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    std::shared_ptr<const PointCost>& value = bound[samples_[i].value.id()];
    if (!value) value = samples_[i].value.bind(mechanism);
    cost.samples.push_back({instants[i].time, value});
  }
  const std::string user = "objective '" + name_ + "': its ";
  if (user_running_) cost.running = point_cost(user_running_, mechanism, user + "running cost");
  if (user_terminal_) cost.terminal = point_cost(user_terminal_, mechanism, user + "terminal cost");
  return cost;
}

Derivatives Objective::of_integral(double I, const ObjectivePart& part, double x0) const {
  if (!running_ || !mean_) return {I, 1, 0};
  const Derivatives n = mean_->N(I / duration_, exponent(part));
  return {x0 + n.value, n.first / duration_, n.second / (duration_ * duration_)};
}

Derivatives Objective::integrand(double x, const ObjectivePart& part) const {
  return mean_ ? mean_->M(x, exponent(part)) : Derivatives{x, 1, 0};
}

double Objective::parameters_only(const Eigen::VectorXd& rho, const FollowedMode::UserForces& forces) const {
  if (mode_) return named(name_, [&] { return mode_->value(rho, forces); });
  if (response_) return named(name_, [&] { return response_->value(rho, forces); });
  if (!parameters_only_) return 0;
  Program::Scratch scratch = parameters_only_->scratch();
  return parameters_only_->value(numbers_of(rho), scratch);
}

std::vector<FrequencyResponse::Peak> Objective::parameters_only_gradients(const Eigen::VectorXd& rho,
                                                                          const FollowedMode::UserForces& forces,
                                                                          const std::vector<int>& variables,
                                                                          std::vector<std::string>* warnings) const {
  if (response_) return named(name_, [&] { return response_->peaks(rho, forces, variables); });
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(rho.size());
  double value = 0;
  if (mode_) {
    std::vector<FrequencyResponse::Peak> pieces;
    for (const FollowedMode::Slope& slope : named(name_, [&] { return mode_->slopes(rho, forces, warnings); }))
      pieces.push_back({slope.value, slope.value, slope.gradient(variables)});
    return pieces;
  }
  if (parameters_only_) {
    Program::Scratch scratch = parameters_only_->scratch();
    value = parameters_only_->add_gradient(numbers_of(rho), 1, numbers_of(gradient), scratch);
  }
  return {{0, value, gradient(variables)}};
}

void Objective::add_parameters_only_hessian(const Eigen::VectorXd& rho, const std::vector<int>& variables,
                                            Eigen::MatrixXd& H) const {
  if (!parameters_only_) return;
  Program::Scratch scratch = parameters_only_->scratch();
  Eigen::VectorXd direction(rho.size()), gradient(rho.size()), slope(rho.size());
  for (std::size_t j = 0; j < variables.size(); ++j) {
    direction.setZero();
    gradient.setZero();
    slope.setZero();
    direction(variables[j]) = 1;
    parameters_only_->add_gradient_tangent(numbers_of(rho), numbers_of(direction), 1, numbers_of(gradient),
                                           numbers_of(slope), scratch);
    for (std::size_t i = 0; i < variables.size(); ++i)
      H(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) += slope(variables[i]);
  }
}

bool Objective::is_sum_of_squares() const {
  return !residuals_.empty() && residuals_.size() == samples_.size() && !running_ && !terminal_ && !parameters_only_;
}

bool Objective::is_linear() const {
  if (mean_ || mode_ || response_) return false;
  if ((running_ && !running_->is_linear()) || (terminal_ && !terminal_->is_linear())) return false;
  if (std::any_of(samples_.begin(), samples_.end(), [](const Sample& s) { return !s.value.is_linear(); })) return false;
  if (!parameters_only_) return true;
  const std::vector<int>& used = parameters_only_->used_inputs();
  return std::all_of(used.begin(), used.end(), [&](int i) { return parameters_only_->derivative(i).is_constant(); });
}

std::vector<Objective> objectives_of(const Problem& problem, const std::vector<std::string>& names) {
  std::vector<Objective> result;
  std::vector<std::string> known;
  for (const ObjectiveSpec& spec : problem.objectives) known.push_back(spec.name);
  for (const std::string& name : names.empty() ? known : names) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end())
      throw std::invalid_argument(
          fmt::format("there is no objective '{}'{}; known: {}", name, did_you_mean(name, known), joined(known)));
    const ObjectiveSpec& spec = problem.objectives[static_cast<std::size_t>(found - known.begin())];
    if (spec.user) {
      const BoundCosts costs = bound_costs(problem.scene, *spec.user, child_path("objectives", name) + ".user");
      result.emplace_back(spec.name, costs.running, costs.terminal);
    } else if (spec.is_written_in_cpp())
      result.emplace_back(spec.name, spec.running_in_cpp, spec.terminal_in_cpp);
    else
      result.emplace_back(problem.scene, spec);
  }
  return result;
}

}  // namespace mbsopt::inline optim
