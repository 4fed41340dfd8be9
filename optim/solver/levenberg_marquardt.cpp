#include "optim/solver/levenberg_marquardt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <numeric>
#include <utility>

#include "core/linear/dense.hpp"
#include "optim/solver/bounded_linear_least_squares.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

constexpr double kFirstDamping = 1e-4;
constexpr double kLeastDamping = 1e-16;  // its root is the rounding of the factors
constexpr double kAccepted = 1e-3;       // part of the promised gain
constexpr int kInvalidSteps = 30;        // in a row; each shortens the step, the last ones to nothing
constexpr double kNothing = 1e-14;       // norm of the residuals, which are in units of their sigma
constexpr double kGradient = 1e-14;      // cosine between the residuals and any column: rounding
// D keeps at least this part of a column's length at the last point. Near a point where the column vanishes, steps
// scaled by its length alone would grow without limit.
constexpr double kShrinking = 0.5;
// The weights are good enough if the step changes by less than this part; a remaining hundredth costs no evaluation.
constexpr double kWeighed = 1e-2;
constexpr int kWeighings = 100;  // of one step; each lowers its cost, so fewer are harmless

struct LinearModel {
  VectorXd q;
  SparseMatrix R;  // with q a triangle per part, of the weighted residuals: |z + J d|^2 = |q + R d|^2 + constant
  VectorXd gradient;
  VectorXd D;   // lengths of the columns, or more
  double size;  // half the weighted sum of squares

  LinearModel(const LeastSquaresProblem& problem, const LeastSquaresPoint& point)
      : LinearModel(problem, point, problem.weights(point.z).cwiseSqrt()) {}
  // w holds square roots of the weights.
  LinearModel(const LeastSquaresProblem& problem, const LeastSquaresPoint& point, const VectorXd& w)
      : R(triangles(point, w, problem.parts)),
        gradient(R.transpose() * q),
        D(column_norms(R)),
        size(0.5 * w.cwiseProduct(point.z).squaredNorm()) {}
  double promised(const VectorXd& d) const { return 0.5 * (q.squaredNorm() - (q + R * d).squaredNorm()); }

 private:
  // Sets q.
  SparseMatrix triangles(const LeastSquaresPoint& point, const VectorXd& w, std::vector<Dependence> parts) {
    if (parts.empty()) parts = {{all(point.z.size()), all(point.z_x.cols())}};
    std::vector<Eigen::Triplet<double, Index>> entries;
    q.resize(point.z.size());
    Index row = 0;
    for (const Dependence& part : parts) {
      const Index n = static_cast<Index>(part.variables.size());
      MatrixXd J_z(static_cast<Index>(part.rows.size()), n + 1);
      J_z.leftCols(n) = w(part.rows).asDiagonal() * point.z_x(part.rows, part.variables);
      J_z.rightCols(1) = w(part.rows).cwiseProduct(point.z(part.rows));
      const Index rows = std::min(J_z.rows(), n);
      const MatrixXd T = triangular_factor(std::move(J_z)).topRows(rows);
      for (Index j = 0; j < n; ++j)
        for (Index i = 0; i < std::min(rows, j + 1); ++i)
          entries.emplace_back(row + i, part.variables[static_cast<std::size_t>(j)], T(i, j));
      q.segment(row, rows) = T.col(n);
      row += rows;
    }
    q.conservativeResize(row);
    SparseMatrix R_of_parts(row, point.z_x.cols());
    R_of_parts.setFromTriplets(entries.begin(), entries.end());
    return R_of_parts;
  }
  static std::vector<Index> all(Index count) {
    std::vector<Index> indices(static_cast<std::size_t>(count));
    std::iota(indices.begin(), indices.end(), Index{0});
    return indices;
  }
};

// The matrix of |R D^-1 e|^2 + lambda |e|^2.
SparseMatrix scaled_and_damped(const SparseMatrix& R, const VectorXd& D, double lambda) {
  SparseMatrix A(R.rows() + D.size(), D.size());
  for (Index k = 0; k < D.size(); ++k) {
    A.startVec(k);
    for (SparseMatrix::InnerIterator entry(R, k); entry; ++entry) A.insertBack(entry.row(), k) = entry.value() / D(k);
    A.insertBack(R.rows() + k, k) = std::sqrt(lambda);
  }
  A.finalize();
  return A;
}

class LevenbergMarquardt {
 public:
  LevenbergMarquardt(LeastSquaresProblem& problem, const LeastSquaresOptions& options)
      : problem_(problem), options_(options) {}

  LeastSquaresResult run(const VectorXd& x_start) {
    x_ = result_.x = x_start.cwiseMax(problem_.x_lower).cwiseMin(problem_.x_upper);
    point_ = evaluated(x_);
    if (!point_.ok) return refused_start(point_.message);
    result_.z_initial = point_.z;
    cost_ = result_.cost_initial = problem_.cost(point_.z);
    if (!std::isfinite(cost_)) return refused_start("the loss of its residuals is not finite");
    iterate();
    result_.x = x_;
    result_.cost_final = cost_;
    result_.point = std::move(point_);
    return std::move(result_);
  }

 private:
  LeastSquaresPoint evaluated(const VectorXd& x) {
    LeastSquaresPoint point;
    point.z.setZero(problem_.size);
    point.z_x.setZero(problem_.size, problem_.variables());
    ++result_.evaluations;
    try {
      problem_.evaluate(x, point);
    } catch (const std::exception& error) {
      point.ok = false;
      point.message = error.what();
    }
    if (point.ok && !(point.z.allFinite() && point.z_x.allFinite())) {
      point.ok = false;
      point.message = "a residual or its derivative is not finite";
    }
    if (point.ok && !std::isfinite(point.z.squaredNorm() + point.z_x.squaredNorm())) {
      point.ok = false;
      point.message = fmt::format(
          "the squares of the residuals or of their derivatives are beyond all numbers: the largest "
          "residual is {:.3g} (measured - model)/sigma, the largest derivative {:.3g}. Look for "
          "wrong values in the data, and check sigma, also that of priors",
          point.z.lpNorm<Eigen::Infinity>(), point.z_x.lpNorm<Eigen::Infinity>());
    }
    if (!point.ok) {
      ++result_.failed_evaluations;
      if (result_.first_error.empty()) result_.first_error = point.message;
    }
    return point;
  }

  LeastSquaresResult refused_start(const std::string& why) {
    result_.refuse_start(why);
    return std::move(result_);
  }

  // A point at the end of a step, and what its cost gained; promised by the model.
  struct Trial {
    VectorXd x;
    LeastSquaresPoint point;
    double cost, promised, gained;
  };

  // Ends with a status and a message.
  void iterate() {
    LinearModel model(problem_, point_);
    if (!report(model, 0)) return;
    first_size_ = model.size;
    VectorXd d = step(model, lambda_);
    while (true) {
      if (no_gradient(model) || is_short(model, d)) return converged(model, lambda_);
      if (at_limit()) return;
      ++result_.iterations;
      Trial trial = tried(model, d);
      const bool settled = std::abs(trial.gained) <= options_.tolerance * model.size;
      const bool accepted = std::isfinite(trial.cost) && (trial.gained > kAccepted * std::max(trial.promised, 0.0) ||
                                                          (settled && trial.gained >= 0));
      if (accepted) accept(std::move(trial), model);
      if (!report(model, d.norm())) return;
      if (settled) return converged(model, lambda_);
      if (!accepted && is_last(trial, model, d)) return;
      d = accepted ? step(model, lambda_) : shorter_step(model, d, trial);
    }
  }

  bool at_limit() {
    if (result_.iterations == options_.max_iterations) {
      result_.end_at_limit(options_.max_iterations, "iteration");
    } else if (options_.max_evaluations && result_.evaluations >= *options_.max_evaluations) {
      result_.end_at_limit(*options_.max_evaluations, "evaluation");
    }
    return result_.status == SolverStatus::iteration_limit;
  }

  Trial tried(const LinearModel& model, const VectorXd& d) {
    Trial trial{moved(d), {}, kInfinity, promised_by(model, d), 0};
    trial.point = evaluated(trial.x);
    if (trial.point.ok) trial.cost = problem_.cost(trial.point.z);
    trial.gained = cost_ - trial.cost;
    return trial;
  }

  void accept(Trial&& trial, LinearModel& model) {
    invalid_ = 0;
    missed_ = 0;
    x_ = trial.x;
    cost_ = trial.cost;
    point_ = std::move(trial.point);
    const double ratio = trial.gained / trial.promised;
    lambda_ = std::max(lambda_ * std::max(1. / 3, 1 - std::pow(2 * ratio - 1, 3)), kLeastDamping);
    const VectorXd D = model.D;
    model = LinearModel(problem_, point_);
    model.D = model.D.cwiseMax(kShrinking * D);
  }

  // Ends the search after a refused step from which none leads on. The error of the model's cost falls with the square
  // of the step where the cost is smooth, and with its length at a kink.
  bool is_last(const Trial& trial, const LinearModel& model, const VectorXd& d) {
    if (!trial.point.ok && ++invalid_ == kInvalidSteps) {
      result_.end(SolverStatus::failed, "failed: too many evaluations in a row" + result_.failures());
      return true;
    }
    const double length = model.D.cwiseProduct(d).norm(), miss = std::abs(trial.promised - trial.gained);
    if (missed_ > 0 && miss < kSimulationNoise * model.size && miss > std::sqrt(length / missed_) * missed_by_) {
      result_.end(
          SolverStatus::converged,
          fmt::format("converged: errors of the simulation change the cost by {:.1g}, more than the {:.1g} that the "
                      "derivatives promise",
                      miss, trial.promised));
      return true;
    }
    missed_ = std::isfinite(miss) ? length : 0;
    missed_by_ = miss;
    return false;
  }

  // Uses the parabola through both costs with the slope at the start.
  VectorXd shorter_step(const LinearModel& model, const VectorXd& d, const Trial& trial) {
    const double slope = model.gradient.dot(d);
    const double part =
        std::isfinite(trial.cost) ? std::clamp(-slope / (2 * (trial.cost - cost_ - slope)), 0.1, 0.5) : 0.25;
    const double longest = part * model.D.cwiseProduct(d).norm();
    VectorXd shorter;
    do {
      lambda_ *= 2;
      shorter = step(model, lambda_);
    } while (model.D.cwiseProduct(shorter).norm() > longest);
    return shorter;
  }

  // The weights are those of the residuals z + J d after the step (levenberg_marquardt.hpp).
  VectorXd step(const LinearModel& model, double lambda) const {
    VectorXd d = weighed_step(model, model.D, lambda);
    for (int i = 0; i < kWeighings && has_weights(); ++i) {
      const VectorXd w = problem_.weights(point_.z + point_.z_x * d).cwiseSqrt();
      const VectorXd before = std::exchange(d, weighed_step(LinearModel(problem_, point_, w), model.D, lambda));
      if (model.D.cwiseProduct(d - before).norm() <= kWeighed * model.D.cwiseProduct(d).norm()) break;
    }
    return d;
  }

  bool has_weights() const { return !problem_.groups.empty() || problem_.loss.type != LossType::squared; }

  double promised_by(const LinearModel& model, const VectorXd& d) const {
    if (has_weights()) return cost_ - problem_.cost(point_.z + point_.z_x * d);
    return model.promised(d);
  }

  VectorXd weighed_step(const LinearModel& model, const VectorXd& lengths, double lambda) const {
    const VectorXd D = lengths.unaryExpr([](double length) { return length > 0 ? length : 1; });
    const SparseMatrix A = scaled_and_damped(model.R, D, lambda);  // of D d: columns of length one
    const VectorXd lower = D.cwiseProduct(problem_.x_lower - x_), upper = D.cwiseProduct(problem_.x_upper - x_);
    VectorXd b = VectorXd::Zero(model.q.size() + D.size());
    b.head(model.q.size()) = -model.q;
    return bounded_linear_least_squares(A, b, lower, upper).cwiseQuotient(D);
  }

  // If a step ends at a bound, x equals that bound.
  VectorXd moved(const VectorXd& d) const {
    constexpr double kRounding = 4e-16;
    VectorXd x = x_ + d;
    for (Index k = 0; k < x.size(); ++k)
      for (const double bound : {problem_.x_lower(k), problem_.x_upper(k)})
        if (std::isfinite(bound) && std::abs(x(k) - bound) <= kRounding * std::max(std::abs(bound), std::abs(x_(k))))
          x(k) = bound;
    return x.cwiseMax(problem_.x_lower).cwiseMin(problem_.x_upper);
  }

  // The step is measured by its change of the residuals, so that units of the variables do not matter.
  bool is_short(const LinearModel& model, const VectorXd& d) const {
    const double size = model.D.cwiseProduct(x_).norm() + options_.tolerance * std::sqrt(2 * model.size);
    return model.D.cwiseProduct(d).norm() <= options_.tolerance * size;
  }

  // The gradient, zero where it only presses on a bound.
  VectorXd free_gradient(const LinearModel& model) const {
    VectorXd free = model.gradient;
    for (Index k = 0; k < free.size(); ++k)
      if ((x_(k) <= problem_.x_lower(k) && free(k) > 0) || (x_(k) >= problem_.x_upper(k) && free(k) < 0)) free(k) = 0;
    return free;
  }

  bool no_gradient(const LinearModel& model) const {
    const double size = std::sqrt(2 * model.size);
    return size <= kNothing || (free_gradient(model).array().abs() <= kGradient * model.D.array() * size).all();
  }

  // The decrease of the cost by the best step along one free variable, from the derivatives: a lower bound of the rest.
  double promise(const LinearModel& model) const {
    const Eigen::ArrayXd D = model.D.array();
    return (D > 0).select(0.5 * (free_gradient(model).array() / D).square(), 0).maxCoeff();
  }

  // Steps that were shortened to nothing are not convergence.
  void converged(const LinearModel& model, double lambda) {
    const double left = promise(model);
    result_.promised = model.size > 0 ? left / model.size : 0;
    if (lambda > 1 && left > kSimulationNoise * first_size_)
      return result_.end(
          SolverStatus::no_progress,
          fmt::format(
              "no further progress: the derivatives promise to lower the cost by {:.2g}, but no step "
              "lowers it{}{}",
              left, result_.failures(),
              problem_.is_integrated ? ". Tighten rtol of the integrator; check the derivatives of C++ code" : ""));
    result_.end(
        SolverStatus::converged,
        fmt::format("converged: cost and parameters change by less than {:g} of themselves", options_.tolerance));
  }

  bool report(const LinearModel& model, double step) {
    const double gradient = free_gradient(model).lpNorm<Eigen::Infinity>();
    if (!options_.progress || options_.progress({result_.iterations, cost_, gradient, step, x_, point_.z})) return true;
    result_.end_on_request();
    return false;
  }

  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  LeastSquaresProblem& problem_;
  const LeastSquaresOptions& options_;
  LeastSquaresResult result_;
  VectorXd x_;
  LeastSquaresPoint point_;
  double cost_ = 0, first_size_ = 0, lambda_ = kFirstDamping;
  int invalid_ = 0;                    // trials in a row that could not be evaluated
  double missed_ = 0, missed_by_ = 0;  // length of the step refused last at this point, and what its model missed
};

}  // namespace

LeastSquaresResult solve_least_squares(LeastSquaresProblem& problem, const VectorXd& x_start,
                                       const LeastSquaresOptions& options) {
  return LevenbergMarquardt(problem, options).run(x_start);
}

}  // namespace mbsopt::inline optim
