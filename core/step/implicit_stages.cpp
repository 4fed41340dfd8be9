#include "core/step/implicit_stages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace mbsopt {
namespace {

constexpr long kMostNewtonIterations = 10;  // at a tolerance
constexpr long kMostExactIterations = 60;   // to rounding, with a new Jacobian wherever convergence is slow
constexpr double kSlow = 0.1;               // contraction per iteration from which a new Jacobian pays
constexpr double kRounding = 1e-11;         // relative; iterations that stop falling below it are at rounding
constexpr double kPolished = 1e-12;   // relative, of what the next iteration would change where stages are polished
constexpr int kMostOwnJacobians = 4;  // of each stage, in one step
constexpr int kOwnSteps = 20;         // steps for which they are used once the Jacobian of the start did not serve

}  // namespace

ImplicitStages::ImplicitStages(const Mechanism& mechanism, const Method& method, const IntegratorSettings& settings,
                               SpatialDynamics& dynamics)
    : data_(mechanism.data()),
      layout_{data_.n},
      rk_(method),
      settings_(settings),
      tolerances_(data_, settings),
      start_(data_, dynamics) {
  int largest = 0;
  for (const StageGroup& g : rk_.stage_groups()) {
    int found = -1;
    if (is_implicit(rk_, g)) {
      Eigen::MatrixXd A(g.size(), g.size());
      for (int i = 0; i < g.size(); ++i) {
        for (int j = 0; j < g.size(); ++j) A(i, j) = rk_.a(g.first + i, g.first + j);
      }
      found = static_cast<int>(std::ranges::find(matrices_, A, &Matrix::A) - matrices_.begin());
      if (at(found) == matrices_.size()) matrices_.push_back({A, StageMatrix(data_, start_.jacobian(), g.size())});
      largest = std::max(largest, g.size());
    }
    for (int i = g.first; i <= g.last; ++i) matrix_of_.push_back(found);
  }
  const Eigen::Index rows = StageEquations::count(data_);
  own_values_.assign(at(largest), start_.values());
  for (Points* points : {&past_, &present_}) {
    points->places.assign(at(rk_.stages), {0, Eigen::VectorXd::Zero(rows)});
  }
  x_.setZero(rows, largest);
  r_.setZero(rows * largest, 1);
  change_.setZero(layout_.size(), largest);
  a_start_.setZero(layout_.positions());
  lambda_start_.setZero(data_.m);
  y_.setZero(layout_.size());
}

void ImplicitStages::add_to(SimulationStatistics& s) const {
  s.rhs_evaluations += evaluations_;
  s.newton_iterations += iterations_;
  s.linear_solves += iterations_ + filters_;
  s.linearised_states += start_.places();
  s.jacobians += jacobians_ + own_jacobians_;
  s.factorisations += start_.factorisations();
  for (const Matrix& m : matrices_) s.factorisations += m.matrix.factorisations();
}

void ImplicitStages::begin(const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::VectorXd& lambda) {
  a_start_ = a;
  lambda_start_ = lambda;
  past_.count = present_.count = 0;
  renew_ = true;
  own_steps_ = 0;
  age_ = 0;
  rate_ = 1;
}

void ImplicitStages::accept(const Step& step) {
  const Eigen::Index n = layout_.positions();
  std::swap(past_, present_);
  present_.count = 0;
  // The next Jacobian is that of the latest stage.
  int latest = 0;
  for (int i = 1; i < rk_.stages; ++i) {
    if (rk_.c[i] >= rk_.c[latest]) latest = i;
  }
  a_start_ = step.K.col(latest).tail(n);
  lambda_start_ = step.lambda.col(latest);
  ++age_;
  if (rate_ > kSlow) renew_ = true;
  if (own_steps_ > 0) {
    --own_steps_;
    renew_ = true;
  }
}

void ImplicitStages::evaluate_jacobian(const Step& step) {
  start_.linearise(step.t, step.y0, step.angles0, a_start_, lambda_start_);
  ++jacobians_;
  age_ = 0;
  renew_ = false;
}

bool ImplicitStages::ready(const Step& step, Matrix& m) {
  if (renew_) evaluate_jacobian(step);
  if (m.jacobian == jacobians_ && m.h == step.h) return true;
  m.jacobian = -1;
  if (!m.matrix.factor(step.h, m.A, std::span(&start_.values(), 1))) return false;
  m.h = step.h;
  m.jacobian = jacobians_;
  return true;
}

// The polynomial through the three nearest points of the past, at most.
void ImplicitStages::predict(const Step& step, int stage, Eigen::Ref<Eigen::VectorXd> x) const {
  const double t = step.t + rk_.c[stage] * step.h;
  std::array<const Point*, 3> nodes;
  std::size_t count = 0;
  auto is_new = [&](const Point& p) {
    return std::all_of(nodes.begin(), nodes.begin() + count,
                       [&](const Point* q) { return std::abs(q->t - p.t) > 0.05 * step.h; });
  };
  while (count < nodes.size()) {
    const Point* nearest = nullptr;
    for (const Points* points : {&present_, &past_}) {
      for (const Point& p : std::span(points->places).first(points->count)) {
        if (is_new(p) && (!nearest || std::abs(p.t - t) < std::abs(nearest->t - t))) nearest = &p;
      }
    }
    if (!nearest) break;
    nodes[count++] = nearest;
  }
  if (count == 0) {
    x << a_start_, lambda_start_;
    return;
  }
  x.setZero();
  for (std::size_t i = 0; i < count; ++i) {
    double weight = 1;
    for (std::size_t j = 0; j < count; ++j) {
      if (j != i) weight *= (t - nodes[j]->t) / (nodes[i]->t - nodes[j]->t);
    }
    x += weight * nodes[i]->x;
  }
}

// Y and K of the group's stages from the accelerations in x_.
void ImplicitStages::set_stages(Step& step, const StageGroup& g) {
  const Eigen::Index n = layout_.positions();
  for (int i = g.first; i <= g.last; ++i) {
    step.K.col(i).tail(n) = x_.col(i - g.first).head(n);
    step.lambda.col(i) = x_.col(i - g.first).tail(data_.m);
  }
  set_group_stages(rk_, g, step.h, step.y0, step.Y, step.K);
}

// A Jacobian of each stage's own, where its iterate is.
bool ImplicitStages::linearise_stages(const Step& step, const StageGroup& g, Matrix& m) {
  for (int i = 0; i < g.size(); ++i) {
    const int stage = g.first + i;
    y_ = step.Y.col(stage);
    start_.equations().place_at(step.t + rk_.c[stage] * step.h, y_, step.angles0,
                                step.K.col(stage).tail(layout_.positions()), step.lambda.col(stage));
    start_.jacobian().evaluate(start_.equations(), own_values_[at(i)]);
    ++own_jacobians_;
  }
  m.jacobian = -1;  // not that of the start
  return m.matrix.factor(step.h, m.A, std::span(own_values_).first(at(g.size())));
}

// Residuals of the group's stages at x_ into r_.
bool ImplicitStages::evaluate_residuals(Step& step, const StageGroup& g) {
  const Eigen::Index n = layout_.positions(), rows = n + data_.m;
  set_stages(step, g);
  for (int i = 0; i < g.size(); ++i) {
    const int stage = g.first + i;
    y_ = step.Y.col(stage);
    start_.equations().place_at(step.t + rk_.c[stage] * step.h, y_, step.angles0, x_.col(i).head(n),
                                x_.col(i).tail(data_.m));
    start_.equations().residual(r_.col(0).segment(i * rows, rows));
    ++evaluations_;
  }
  return r_.topRows(g.size() * rows).allFinite();
}

// Adds the change in r_ to x_. Returns the change of the stages: root mean square in units of the tolerance (exact: of
// the state's size).
double ImplicitStages::add_change(const Step& step, const StageGroup& g, const Matrix& m, bool exact) {
  const Eigen::Index n = layout_.positions(), rows = n + data_.m;
  const int s = g.size();
  double sum = 0;
  for (int i = 0; i < s; ++i) {
    auto dV = change_.col(i).tail(n);
    dV.setZero();
    for (int j = 0; j < s; ++j) dV += (step.h * m.A(i, j)) * r_.col(0).segment(j * rows, n);
  }
  for (int i = 0; i < s; ++i) {
    auto dQ = change_.col(i).head(n);
    dQ.setZero();
    for (int j = 0; j < s; ++j) dQ += (step.h * m.A(i, j)) * change_.col(j).tail(n);
    for (Eigen::Index e = 0; e < 2 * n; ++e) {
      const double size = std::abs(step.y0(e));
      const double unit = exact ? 1 + size : tolerances_.of(e, size);
      const double x = change_(e, i) / unit;
      sum += x * x;
    }
    x_.col(i) += r_.col(0).segment(i * rows, rows);
  }
  return std::sqrt(sum / static_cast<double>(2 * n * s));
}

bool ImplicitStages::iterate(Step& step, const StageGroup& g, Matrix& m, Goal goal, bool own) {
  const Eigen::Index rows = StageEquations::count(data_);
  const bool exact = goal != Goal::tolerance;
  for (int i = 0; i < g.size(); ++i) {
    if (goal == Goal::polish) {
      x_.col(i) << step.K.col(g.first + i).tail(layout_.positions()), step.lambda.col(g.first + i);
    } else {
      predict(step, g.first + i, x_.col(i));
    }
  }
  if (own) {
    set_stages(step, g);
    if (!linearise_stages(step, g, m)) return false;
  } else if (!ready(step, m)) {
    return false;
  }
  const long most = exact ? kMostExactIterations : settings_.options.newton_iterations.value_or(kMostNewtonIterations);
  double before = INFINITY;
  int own_left = kMostOwnJacobians;
  for (long k = 0; k < most; ++k) {
    if (!evaluate_residuals(step, g)) return false;
    m.matrix.solve(r_.topRows(g.size() * rows), 0);
    ++iterations_;
    const double now = add_change(step, g, m, exact);
    if (!std::isfinite(now)) return false;
    const Convergence convergence = judged(now, before, most - 1 - k, goal, own);
    if (convergence == Convergence::reached) return true;
    before = now;
    if (convergence == Convergence::ahead) continue;
    if ((!own && !exact) || own_left-- == 0) return false;
    set_stages(step, g);
    if (!linearise_stages(step, g, m)) return false;
    before = INFINITY;
  }
  return false;
}

ImplicitStages::Convergence ImplicitStages::judged(double now, double before, long left, Goal goal, bool own) {
  const bool exact = goal != Goal::tolerance, has_rate = std::isfinite(before);
  if (has_rate) rate_ = before > 0 ? now / before : 0;
  if (now <= (exact ? 1e-15 : 1e-10)) return Convergence::reached;
  const double ahead = rate_ / (1 - rate_) * now;  // what all further iterations change, if rate_ is below 1
  if (goal == Goal::polish && (has_rate || !own) && rate_ <= 0.5 && ahead <= kPolished) return Convergence::reached;
  if (!has_rate) return Convergence::ahead;
  if (exact && rate_ <= 0.5) return Convergence::ahead;
  if (exact) return now < kRounding ? Convergence::reached : Convergence::lost;
  if (!(rate_ < 1)) return Convergence::lost;
  const double tolerance =
      std::max(settings_.options.newton_tolerance.value_or(std::min(1e-2, std::sqrt(settings_.rtol))),
               10 * std::numeric_limits<double>::epsilon() / settings_.rtol);
  if (ahead <= tolerance) return Convergence::reached;
  const bool in_time = std::pow(rate_, static_cast<double>(left)) / (1 - rate_) * now <= tolerance;
  return in_time ? Convergence::ahead : Convergence::lost;
}

bool ImplicitStages::solve(Step& step, const StageGroup& g, Goal goal) {
  Matrix& m = matrices_[at(matrix_of_[at(g.first)])];
  bool solved = own_steps_ == 0 && iterate(step, g, m, goal, false);
  if (!solved) {
    if (stale()) return false;  // a new Jacobian at the start is tried first
    own_steps_ = kOwnSteps;
    solved = iterate(step, g, m, goal, true);
  }
  if (!solved) return false;
  set_stages(step, g);
  for (int i = g.first; i <= g.last; ++i) {
    Point& p = present_.places[present_.count++];
    p.t = step.t + rk_.c[i] * step.h;
    p.x << step.K.col(i).tail(layout_.positions()), step.lambda.col(i);
  }
  return true;
}

bool ImplicitStages::filter(const Step& step, Eigen::VectorXd& error) {
  if (renew_) evaluate_jacobian(step);
  if (!start_.factor(step.h * rk_.error_filter)) return false;
  start_.solve(error);
  ++filters_;
  return true;
}

}  // namespace mbsopt
