#include "optim/solver/ipopt_solver.hpp"

#include <coin/IpIpoptApplication.hpp>
#include <coin/IpTNLP.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <new>
#include <utility>
#include <vector>

#include "core/expression/counted.hpp"
#include "core/linear/dense.hpp"
#include "optim/solver/nlp_search.hpp"
#include "optim/solver/optimality.hpp"
#include "optim/solver/secant_curvature.hpp"

namespace mbsopt::inline optim {
namespace {

using Ipopt::Index;
using Ipopt::Number;
using VectorIn = Eigen::Map<const Eigen::VectorXd>;
using VectorView = Eigen::Map<Eigen::VectorXd>;

constexpr double kNoBound = 1e20;  // Ipopt's: at least 1e19 means none

// Ipopt's linear solver, MUMPS, takes some MB at once. Without this memory Ipopt reports an error in its step. So this
// throws std::bad_alloc if the system does not have it.
void require_memory() {
  constexpr std::size_t kOfMumps = 16 << 20;  // [bytes]
  ::operator delete(::operator new(kOfMumps));
}

// Iterations in which f changes by noise only, which a line search would try to lower without end.
constexpr int kStalled = 10;

class IpoptSearch : public Ipopt::TNLP, private NlpSearch {
 public:
  IpoptSearch(NonlinearProgram& problem, const Eigen::VectorXd& x_start, const IpoptOptions& options, NlpResult& result)
      : NlpSearch(problem, options, result), x_start_(x_start), options_(options), secants_(1 / problem.f_scale) {
    result_.x = x_start;
  }

  void run() {
    if (!evaluate(x_start_)) return end_refused();
    if (const double distance = look(*point_); distance <= tolerance_) {  // the barrier would only lead away
      report(*point_, distance);
      return conclude({});
    }
    result_.end(SolverStatus::failed, "Ipopt refused its options");
    const Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);  // no console
    set_options(*application->Options());
    if (application->Initialize("") == Ipopt::Solve_Succeeded)  // "": no options file is read
      end(application->OptimizeTNLP(this));
  }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hess, IndexStyleEnum& style) override {
    n = static_cast<Index>(problem_.variables());
    m = static_cast<Index>(problem_.constraints());
    nnz_jac = n * m;
    nnz_hess = options_.second_order ? n * (n + 1) / 2 : 0;
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* c_l, Number* c_u) override {
    auto finite = [](double bound) { return std::isfinite(bound) ? bound : std::copysign(kNoBound, bound); };
    VectorView(x_l, n) = near_bounds(problem_.x_lower, x_start_).unaryExpr(finite);
    VectorView(x_u, n) = near_bounds(problem_.x_upper, x_start_).unaryExpr(finite);
    VectorView(c_l, m) = problem_.c_lower.unaryExpr(finite);
    VectorView(c_u, m) = problem_.c_upper.unaryExpr(finite);
    return true;
  }

  bool get_scaling_parameters(Number& f_scaling, bool& use_x, Index, Number*, bool& use_c, Index m,
                              Number* c_scaling) override {
    f_scaling = problem_.f_scale;
    use_x = false;
    use_c = m > 0;
    if (use_c) VectorView(c_scaling, m) = problem_.c_scale;
    return true;
  }

  bool get_starting_point(Index n, bool, Number* x, bool, Number*, Number*, Index, bool, Number*) override {
    VectorView(x, n) = x_start_;
    return true;
  }

  // The first of the four functions that Ipopt calls computes all of them. So a point fails where Ipopt can shorten the
  // step (f, c), and never where Ipopt would give up (the gradients).
  bool eval_f(Index n, const Number* x, bool, Number& f) override {
    if (!evaluate(VectorIn(x, n))) return false;
    f = point_->f;
    return true;
  }
  bool eval_g(Index n, const Number* x, bool, Index m, Number* c) override {
    if (!evaluate(VectorIn(x, n))) return false;
    VectorView(c, m) = point_->c;
    return true;
  }
  // Ipopt asks for derivatives only at its iterates.
  bool eval_grad_f(Index n, const Number* x, bool, Number* f_x) override {
    if (!evaluate(VectorIn(x, n))) return false;
    VectorView(f_x, n) = point_->f_x;
    keep_iterate();
    return true;
  }
  bool eval_jac_g(Index n, const Number* x, bool, Index m, Index, Index* row, Index* column, Number* values) override {
    if (!values) {
      for (Index k = 0; k < n * m; ++k) {
        row[k] = k / n;
        column[k] = k % n;
      }
      return true;
    }
    if (!evaluate(VectorIn(x, n))) return false;
    for (Index i = 0; i < m; ++i) VectorView(values + i * n, n) = point_->c_x.row(i);
    keep_iterate();
    return true;
  }

  // The Hessian of the Lagrangian: the lower triangle, row by row. If it cannot be computed, the previous one serves
  // again.
  bool eval_h(Index n, const Number* x, bool, Number f_factor, Index m, const Number* multipliers, bool, Index,
              Index* row, Index* column, Number* values) override {
    Index k = 0;
    if (!values) {
      for (Index i = 0; i < n; ++i)
        for (Index j = 0; j <= i; ++j, ++k) row[k] = i, column[k] = j;
      return true;
    }
    update_hessians(VectorIn(x, n));
    const Eigen::MatrixXd of_f = for_steps();
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j <= i; ++j, ++k) {
        values[k] = f_factor * of_f(i, j);
        for (Index c = 0; c < m; ++c) values[k] += multipliers[c] * hessians_.of[static_cast<std::size_t>(c) + 1](i, j);
      }
    }
    return true;
  }

  bool intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number, Number, Number, Number, Number, Number,
                             Number, Number, Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    if (point_->abandoned) return false;  // Ipopt counts a step that was not computed
    result_.iterations = iteration;
    out_of_evaluations_ = options_.max_evaluations && result_.evaluations >= *options_.max_evaluations;
    if (iterate_.size() == 0 || !evaluate(iterate_)) return !out_of_evaluations_;  // it is in memory
    const double distance = optimality(problem_, iterate_, *point_);
    if (!report(*point_, distance)) return false;
    has_settled_ = feasible(*point_) && (distance <= tolerance_ || is_stalled());
    return !out_of_evaluations_ && !has_settled_;
  }

  void finalize_solution(Ipopt::SolverReturn, Index, const Number*, const Number*, const Number*, Index, const Number*,
                         const Number*, Number, const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {}

 private:
  void set_options(Ipopt::OptionsList& list) const {
    list.SetIntegerValue("print_level", 0);
    list.SetStringValue("sb", "yes");  // no banner
    list.SetIntegerValue("max_iter", options_.max_iterations);
    list.SetStringValue("hessian_approximation", options_.second_order ? "exact" : "limited-memory");
    list.SetIntegerValue("limited_memory_max_history", options_.history);
    // Newton steps converge faster than the barrier falls from its usual 0.1. BFGS needs that time to learn.
    if (options_.second_order) list.SetNumericValue("mu_init", 1e-3);
    if (options_.second_order && problem_.constraints() == 0) {  // all matrices are positive definite: no barrier
      list.SetNumericValue("mu_init", 0.1 * tolerance_);
      list.SetStringValue("bound_mult_init_method", "mu-based");  // multipliers of 1 would count as curvature
    }
    list.SetStringValue("nlp_scaling_method", "user-scaling");
    // "adaptive" leaps away from good points of problems with many minima.
    list.SetStringValue("mu_strategy", "monotone");
    list.SetNumericValue("bound_relax_factor", 0);  // a bound is a bound: masses and logarithms stay positive
    list.SetNumericValue("tol", tolerance_);
    // The product of a bound's multiplier and slack. The measure of all methods takes the smaller of the two.
    const double complementarity = tolerance_ * tolerance_ / problem_.f_scale;  // unscaled
    list.SetNumericValue("compl_inf_tol", complementarity);
    list.SetNumericValue("acceptable_compl_inf_tol", complementarity);
    list.SetNumericValue("constr_viol_tol", options_.constraint_tolerance);
    // Simulations have noise. If optimality stays just above the tolerance and f (about 1 in size) changes by less than
    // the tolerance implies (f - f* = f_x^2/(2 f_xx)), no further progress is possible.
    list.SetNumericValue("acceptable_tol", kAcceptable * tolerance_);
    list.SetNumericValue("acceptable_obj_change_tol", tolerance_ * tolerance_);
    list.SetNumericValue("acceptable_constr_viol_tol", options_.constraint_tolerance);
    list.SetIntegerValue("acceptable_iter", 3);
    if (options_.warm_start) {
      list.SetNumericValue("mu_init", std::min(1e-6, tolerance_));
      list.SetStringValue("bound_mult_init_method", "mu-based");
      for (const char* const push : {"bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac"})
        list.SetNumericValue(push, 1e-8);
    }
  }

  void end(Ipopt::ApplicationReturnStatus status) {
    using namespace Ipopt;  // NOLINT: its enumerators
    if (has_settled_)
      return conclude(
          fmt::format("in {} the objective has changed by no more than noise", counted(kStalled, "iteration")));
    if (status == Error_In_Step_Computation || status == Restoration_Failed || status == Internal_Error)
      require_memory();
    take_solution();
    switch (status) {
      case Solve_Succeeded:
      case Solved_To_Acceptable_Level:
      case Search_Direction_Becomes_Too_Small:
      case Restoration_Failed:
      case Error_In_Step_Computation:
      case Feasible_Point_Found:
      case Infeasible_Problem_Detected:
        return conclude("no step lowers the objective any more");
      case Maximum_Iterations_Exceeded:
      case Maximum_CpuTime_Exceeded:
        return result_.end_at_limit(options_.max_iterations, "iteration");
      case User_Requested_Stop:
        return out_of_evaluations_ ? result_.end_at_limit(*options_.max_evaluations, "evaluation")
                                   : result_.end_on_request();
      case Diverging_Iterates:
        return result_.end(SolverStatus::failed,
                           "the variables grow without limit: the objective seems to have no minimum; give bounds");
      case Not_Enough_Degrees_Of_Freedom:
        return result_.end(SolverStatus::failed, "there are fewer variables than equality constraints");
      case Insufficient_Memory:
        return result_.end(SolverStatus::failed, "not enough memory");
      default:
        return result_.end(SolverStatus::failed,
                           fmt::format("Ipopt failed (status {}){}", static_cast<int>(status), result_.failures()));
    }
  }

  // Interior points may leave the bounds by a rounding error; NlpSearch moves them back.
  bool evaluate(const Eigen::VectorXd& x) {
    point_ = &at(x, Wanted::derivatives);
    if (is_new() && point_->ok) look(*point_);
    return point_->ok;
  }

  bool is_stalled() {
    constexpr double kNoise = 1e-2;  // times the tolerance, relative to f
    recent_.push_back(point_->f * problem_.f_scale);
    if (recent_.size() <= kStalled) return false;
    if (recent_.size() > kStalled + 1) recent_.pop_front();
    const auto [least, most] = std::ranges::minmax(recent_);
    return most - least <= std::max(tolerance_ * tolerance_, kNoise * tolerance_ * std::abs(most));
  }

  // The Hessian of f. If it is not positive definite and there are no constraints, BFGS replaces it: negative curvature
  // holds for a short distance only. Ipopt would add a multiple of the identity that shortens all steps; the gradients
  // of the iterates cover a longer distance. BFGS also corrects Gauss-Newton's Hessian if it contradicts the change of
  // the gradient.
  Eigen::MatrixXd for_steps() const {
    const Eigen::MatrixXd& of_f = hessians_.of[0];
    if (problem_.constraints() > 0) return of_f;
    if (options_.gauss_newton && secants_.contradicts(of_f)) return secants_.matrix_from(of_f);
    return cholesky_factor(of_f).size() > 0 ? of_f : secants_.matrix();
  }

  void update_hessians(const Eigen::VectorXd& x) {
    if (hessians_x_.size() > 0 && hessians_x_ == x) return;
    NlpHessians found;
    if (problem_.hessians(x, found.of)) hessians_ = std::move(found);
    if (hessians_.of.empty()) {
      const Eigen::Index n = problem_.variables();
      hessians_.of.assign(static_cast<std::size_t>(problem_.constraints()) + 1, Eigen::MatrixXd::Zero(n, n));
      hessians_.of[0] = Eigen::MatrixXd::Identity(n, n) / problem_.f_scale;
    }
    hessians_x_ = x;
  }

  void keep_iterate() {
    iterate_ = x();
    secants_.add(iterate_, point_->f_x);
  }

  const Eigen::VectorXd x_start_;
  const IpoptOptions& options_;
  SecantCurvature secants_;
  const NlpPoint* point_ = nullptr;  // the last one
  Eigen::VectorXd iterate_, hessians_x_;
  NlpHessians hessians_;
  std::deque<double> recent_;  // f of the last feasible iterates, scaled: its size and gradient about 1 at the start
  bool out_of_evaluations_ = false;
  bool has_settled_ = false;  // an iterate is optimal by the measure of all methods (optimality.hpp), or f has stalled
};

}  // namespace

NlpResult solve_with_ipopt(NonlinearProgram& problem, const Eigen::VectorXd& x_start, const IpoptOptions& options) {
  NlpResult result;
  result.algorithm = options.second_order
                         ? "Ipopt: interior point, Hessians of the problem"
                         : fmt::format("Ipopt: interior point, limited-memory BFGS of {} pairs", options.history);
  const Ipopt::SmartPtr<IpoptSearch> search = new IpoptSearch(problem, x_start, options, result);
  search->run();
  return result;
}

}  // namespace mbsopt::inline optim
