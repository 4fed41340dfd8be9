#include "core/step/rosenbrock_stages.hpp"

namespace mbsopt {

RosenbrockStages::RosenbrockStages(const Mechanism& mechanism, const Method& method, Dynamics& dynamics)
    : rk_(method), dynamics_(dynamics), matrix_(mechanism.data(), dynamics.in_space()) {
  for (Eigen::VectorXd* x : {&f_, &f_t_, &y_, &ydot_, &s_, &x_}) x->setZero(mechanism.states());
}

bool RosenbrockStages::begin(const Step& step) {
  ++evaluations_;
  ++jacobians_;
  if (!dynamics_.evaluate(step.t, step.y0, step.angles0, f_)) return false;
  matrix_.linearise(step.t, step.y0, step.angles0, f_.tail(f_.size() / 2), dynamics_.lambda());
  return true;
}

bool RosenbrockStages::factor(const Step& step) { return begin(step) && matrix_.factor(step.h * rk_.gamma_of(0, 0)); }

bool RosenbrockStages::solve(Step& step) {
  const double h = step.h, g = rk_.gamma_of(0, 0);
  const Eigen::Index half = f_.size() / 2;
  f_t_ = kWeights[0] / kSpacing * f_;
  for (int k = 1; k < kPoints; ++k) {
    ++evaluations_;
    if (!dynamics_.evaluate(step.t + k * kSpacing * h, step.y0, step.angles0, ydot_)) return false;
    f_t_ += kWeights[static_cast<std::size_t>(k)] / kSpacing * ydot_;
  }
  if (!matrix_.factor(h * g)) return false;
  for (int i = 0; i < rk_.stages; ++i) {
    sum_stages(
        step.K, i, [&](int j) { return h * rk_.a(i, j); }, step.y0, y_);
    s_.setZero();
    add_stages(
        step.K, i, [&](int j) { return rk_.gamma_of(i, j) / g; }, s_);
    step.Y.col(i) = y_;
    if (i == 0) {
      x_ = f_;
    } else {
      ++evaluations_;
      if (!dynamics_.evaluate(step.t + rk_.c[i] * h, y_, step.angles0, x_)) return false;
    }
    x_ += s_;
    x_.tail(half) += rk_.gamma_sum[i] * f_t_.tail(half);
    solve(x_);
    ++solves_;
    step.K.col(i) = x_ - s_;
    set_rosenbrock_rates(rk_, i, h, step.y0, step.K);
  }
  return true;
}

bool RosenbrockStages::linearise_at(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  ++linearised_;
  if (!dynamics_.evaluate(t, y, angles, ydot_)) return false;
  dynamics_.in_space().linearise_here();
  return true;
}

bool RosenbrockStages::linearise_stage(const Step& step, int i) {
  y_ = step.Y.col(i);
  return linearise_at(step.t + rk_.c[i] * step.h, y_, step.angles0);
}

bool RosenbrockStages::linearise_common(const Step& step, int k) {
  const double e = k * kSpacing * step.h;
  y_ = step.y0 + e * step.K.col(0);
  return linearise_at(step.t + e, y_, step.angles0);
}

bool RosenbrockStages::linearise_own(const Step& step, int i, int sign) {
  const double e = sign * kSpacing * step.h;
  StageSum sum;
  double of_first = 0;
  for (int j = 1; j <= i; ++j) {
    const double weight = e * rk_.gamma_of(i, j);
    sum.add(weight, step.K.col(j).data());
    of_first -= weight;
  }
  sum.add(of_first, step.K.col(0).data());
  sum.to(step.y0.data(), y_.data(), y_.size());
  return linearise_at(step.t, y_, step.angles0);
}

}  // namespace mbsopt
