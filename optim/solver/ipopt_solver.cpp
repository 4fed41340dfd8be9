#include "optim/solver/ipopt_solver.hpp"

#include <coin/IpIpoptApplication.hpp>
#include <coin/IpTNLP.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <new>
#include <optional>
#include <vector>

#include "core/expression/counted.hpp"
#include "core/linear/dense.hpp"
#include "optim/solver/evaluated_points.hpp"
#include "optim/solver/optimality.hpp"
#include "optim/solver/search_watch.hpp"
#include "optim/solver/secant_curvature.hpp"
#include "optim/solver/stationary_point.hpp"

namespace mbsopt {
namespace {

using Ipopt::Index;
using Ipopt::Number;
using VectorIn = Eigen::Map<const Eigen::VectorXd>;
using VectorView = Eigen::Map<Eigen::VectorXd>;

constexpr int kFreshStarts = 2;
constexpr double kAcceptable = 100;  // times the tolerance: where noise hides the rest
constexpr const char* kConvergedInNoise =
    "converged: the objective does not change any more, and the optimality conditions hold to the accuracy of its "
    "derivatives";
constexpr const char* kConverged = "converged: the optimality conditions hold";
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kNoBound = 1e20;  // Ipopt's: at least 1e19 means none

class Adapter : public Ipopt::TNLP {
 public:
  Adapter(NonlinearProgram& problem, const Eigen::VectorXd& x_start, const IpoptOptions& options, NlpResult& result)
      : problem_(problem),
        x_start_(x_start),
        options_(options),
        result_(result),
        points_(problem, result, options.constraint_tolerance, options.records),
        solution_(problem, points_, options.tolerance, options.constraint_tolerance),
        secants_(1 / problem.f_scale),
        watch_(options.tolerance, problem.constraints() == 0),
        second_order_(options.second_order) {
    result_.x = x_start;
  }

  bool start_is_valid() { return evaluate(x_start_); }
  bool out_of_evaluations() const { return out_of_evaluations_; }
  SearchEnd end() const { return end_; }  // the end of the last round, if chosen here
  bool creeps() const { return end_ == SearchEnd::creeping; }
  bool second_order() const { return second_order_; }
  int left_newton_at() const { return left_newton_at_; }  // iteration; 0: never

  // Returns whether the start is feasible and the objective falls nowhere within the bounds. The barrier would only
  // lead away.
  bool start_is_optimal() {
    const double distance = optimality(problem_, points_.x(), *point_);
    if (!points_.feasible(*point_) || distance > options_.tolerance) return false;
    result_.point = *point_;
    if (options_.progress) options_.progress({0, point_->f, problem_.violation(point_->c), distance, points_.x()});
    return true;
  }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hess, IndexStyleEnum& style) override {
    n = static_cast<Index>(problem_.variables());
    m = static_cast<Index>(problem_.constraints());
    nnz_jac = n * m, nnz_hess = options_.second_order ? n * (n + 1) / 2 : 0;
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* c_l, Number* c_u) override {
    auto finite = [](double bound) { return std::isfinite(bound) ? bound : std::copysign(kNoBound, bound); };
    VectorView(x_l, n) = near_bounds(problem_.x_lower, x_start_).unaryExpr(finite);
    VectorView(x_u, n) = near_bounds(problem_.x_upper, x_start_).unaryExpr(finite);
    VectorView(c_l, m) = problem_.c_lower.unaryExpr(finite), VectorView(c_u, m) = problem_.c_upper.unaryExpr(finite);
    return true;
  }

  bool get_scaling_parameters(Number& f_scaling, bool& use_x, Index, Number*, bool& use_c, Index m,
                              Number* c_scaling) override {
    f_scaling = problem_.f_scale;
    use_x = false, use_c = m > 0;
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
      for (Index k = 0; k < n * m; ++k) row[k] = k / n, column[k] = k % n;
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
    if (round_ > 0 && iteration == 0) return true;  // the start of this round
    if (point_->abandoned) return false;            // Ipopt counts a step that was not computed
    result_.iterations = iterations_before_ + iteration;
    out_of_evaluations_ = options_.max_evaluations && result_.evaluations >= *options_.max_evaluations;
    if (iterate_.size() == 0) return !out_of_evaluations_;
    const bool known = evaluate(iterate_);  // in memory
    const double distance = known ? optimality(problem_, iterate_, *point_) : kUnknown;
    if (options_.progress && !told_progress(distance)) return false;
    if (known && points_.feasible(*point_)) look_at_iterate(distance);
    return !out_of_evaluations_ && end_ == SearchEnd::none;
  }

  bool told_progress(double distance) const {
    return options_.progress({result_.iterations, iterate_f_, iterate_violation_, distance, iterate_});
  }

  // If this class ended the run, it has already chosen the end point.
  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number*, const Number*, Index,
                         const Number*, const Number*, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    if (end_ != SearchEnd::optimal && end_ != SearchEnd::stalled) final_ = VectorIn(x, n);
  }

  // The optimality of the end point of a stalled search.
  double distance() const { return watch_.most_stationary().distance; }

  // Returns whether a feasible point on the way is better than Ipopt's end point by more than the tolerance.
  bool passed_a_better_point() {
    if (final_.size() == 0 || !points_.have_best() || !evaluate(final_)) return false;
    const double gain = (point_->f - points_.best().f) * problem_.f_scale;
    return points_.feasible(points_.best()) && gain > options_.tolerance;
  }
  void go_on_from_best() {
    x_start_ = points_.best_x();
    iterations_before_ = result_.iterations;
    if (end_ == SearchEnd::creeping) second_order_ = false, left_newton_at_ = result_.iterations;
    watch_.start_afresh(), end_ = SearchEnd::none;
    ++round_;
  }

  bool best_is_feasible() const { return points_.have_best() && points_.feasible(points_.best()); }

  // Takes Ipopt's end point if it converged, else the best point. In noise another one may be as good and more
  // stationary. Returns the optimality.
  double finish(bool converged) {
    if (converged && final_.size() > 0 && evaluate(final_)) {
      result_.x = points_.x(), result_.point = *point_;
    } else if (points_.have_best()) {
      result_.x = points_.best_x(), result_.point = points_.best();
    }
    if (!result_.point.ok) return kUnknown;
    const double distance = optimality(problem_, result_.x, result_.point);
    if (!solution_.found() || solution_.distance() >= distance) return distance;
    result_.x = solution_.x(), result_.point = solution_.point();
    return solution_.distance();
  }

 private:
  // Interior points may leave the bounds by a rounding error; EvaluatedPoints moves them back.
  bool evaluate(const Eigen::VectorXd& x) {
    point_ = &points_.at(x, Wanted::derivatives);
    if (points_.is_new() && point_->ok) solution_.look(*point_);
    return point_->ok;
  }

  // Ipopt would continue. A search without progress starts again, a few times. If Newton steps progress slowly, BFGS
  // replaces them.
  void look_at_iterate(double distance) {
    end_ = watch_.look({iterate_, point_->f * problem_.f_scale, distance});
    if (creeps() && (round_ >= kFreshStarts || !second_order_)) end_ = SearchEnd::none;
    if (end_ == SearchEnd::optimal) final_ = iterate_;
    if (end_ == SearchEnd::stalled) final_ = watch_.most_stationary().x;
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
    bool ok = options_.records && options_.records->recall(x, found);
    if (!ok) {
      ok = problem_.hessians(x, found.of);
      if (ok && options_.records) options_.records->record(x, found);
    }
    if (ok) hessians_ = std::move(found);
    if (hessians_.of.empty()) {
      const Eigen::Index n = problem_.variables();
      hessians_.of.assign(static_cast<std::size_t>(problem_.constraints()) + 1, Eigen::MatrixXd::Zero(n, n));
      hessians_.of[0] = Eigen::MatrixXd::Identity(n, n) / problem_.f_scale;
    }
    hessians_x_ = x;
  }

  void keep_iterate() {
    iterate_ = points_.x(), iterate_f_ = point_->f, iterate_violation_ = problem_.violation(point_->c);
    secants_.add(iterate_, point_->f_x);
  }

  NonlinearProgram& problem_;
  Eigen::VectorXd x_start_;
  const IpoptOptions& options_;
  NlpResult& result_;
  EvaluatedPoints points_;
  StationaryPoint solution_;
  SecantCurvature secants_;
  const NlpPoint* point_ = nullptr;  // the last one
  Eigen::VectorXd final_, iterate_, hessians_x_;
  NlpHessians hessians_;
  SearchWatch watch_;
  SearchEnd end_ = SearchEnd::none;
  bool second_order_, out_of_evaluations_ = false;
  int round_ = 0, iterations_before_ = 0, left_newton_at_ = 0;
  double iterate_f_ = 0, iterate_violation_ = 0;
};

struct Outcome {
  SolverStatus status;
  std::string words;
};

Outcome stalled_in_words(double distance, const NlpResult& result, const IpoptOptions& options) {
  if (distance <= kAcceptable * options.tolerance) return {SolverStatus::converged, kConvergedInNoise};
  return {SolverStatus::no_progress,
          fmt::format("no further progress: in {} the objective has changed by no more than noise, but the optimality "
                      "conditions hold to {:.1e} only, not to {:g}; try tighter simulation tolerances, or a larger "
                      "optimiser tolerance{}",
                      counted(SearchWatch::kStalled, "iteration"), distance, options.tolerance, result.failures())};
}

// Ipopt's linear solver, MUMPS, takes some MB at once. Without this memory Ipopt reports an error in its step. So this
// throws std::bad_alloc if the system does not have it.
void require_memory() {
  constexpr std::size_t kOfMumps = 16 << 20;  // [bytes]
  ::operator delete(::operator new(kOfMumps));
}

Outcome in_words(Ipopt::ApplicationReturnStatus status, const NlpResult& result, const IpoptOptions& options) {
  using namespace Ipopt;  // NOLINT: its enumerators
  if (status == Error_In_Step_Computation || status == Restoration_Failed || status == Internal_Error) require_memory();
  const std::string failures = result.failures();
  switch (status) {
    case Solve_Succeeded:
      return {SolverStatus::converged, kConverged};
    case Solved_To_Acceptable_Level:
      return {SolverStatus::converged, kConvergedInNoise};
    case Search_Direction_Becomes_Too_Small:
    case Restoration_Failed:
    case Error_In_Step_Computation:
    case Feasible_Point_Found:
      return {
          SolverStatus::no_progress,
          fmt::format("no further progress: no step lowers the objective any more, but the optimality conditions do "
                      "not hold to {:g}; try tighter simulation tolerances, or a larger optimiser tolerance{}",
                      options.tolerance, failures)};
    case Infeasible_Problem_Detected:
      return {
          SolverStatus::infeasible,
          "infeasible: no point near the last one satisfies the constraints; relax them or start elsewhere" + failures};
    case Maximum_Iterations_Exceeded:
    case Maximum_CpuTime_Exceeded:
      return {SolverStatus::iteration_limit,
              fmt::format("stopped at the limit of {}{}", counted(options.max_iterations, "iteration"), failures)};
    case User_Requested_Stop:
      return {SolverStatus::stopped, "stopped on request"};
    case Diverging_Iterates:
      return {SolverStatus::failed,
              "the variables grow without limit: the objective seems to have no minimum; give bounds"};
    case Not_Enough_Degrees_Of_Freedom:
      return {SolverStatus::failed, "there are fewer variables than equality constraints"};
    case Insufficient_Memory:
      return {SolverStatus::failed, "not enough memory"};
    default:
      return {SolverStatus::failed, fmt::format("Ipopt failed (status {}){}", static_cast<int>(status), failures)};
  }
}

void set_options(Ipopt::IpoptApplication& application, const IpoptOptions& options, bool second_order,
                 bool near_solution, bool constrained) {
  Ipopt::OptionsList& list = *application.Options();
  list.SetIntegerValue("print_level", 0);
  list.SetStringValue("sb", "yes");  // no banner
  list.SetStringValue("hessian_approximation", second_order ? "exact" : "limited-memory");
  list.SetIntegerValue("limited_memory_max_history", options.history);
  // Newton steps converge faster than the barrier falls from its usual 0.1. BFGS needs that time to learn.
  if (second_order) list.SetNumericValue("mu_init", 1e-3);
  if (second_order && !constrained) {  // all matrices are positive definite: Newton's steps need no barrier
    list.SetNumericValue("mu_init", 0.1 * options.tolerance);
    list.SetStringValue("bound_mult_init_method", "mu-based");  // multipliers of 1 would count as curvature
  }
  list.SetStringValue("nlp_scaling_method", "user-scaling");
  list.SetStringValue("mu_strategy",
                      "monotone");                // "adaptive" leaps away from good points of problems with many minima
  list.SetNumericValue("bound_relax_factor", 0);  // a bound is a bound: masses and logarithms stay positive
  list.SetNumericValue("tol", options.tolerance);
  list.SetNumericValue("constr_viol_tol", options.constraint_tolerance);
  // Simulations have noise. If optimality stays just above the tolerance and f (about 1 in size) changes by less than
  // the tolerance implies (f - f* = f_x^2/(2 f_xx)), no further progress is possible.
  list.SetNumericValue("acceptable_tol", kAcceptable * options.tolerance);
  list.SetNumericValue("acceptable_obj_change_tol", options.tolerance * options.tolerance);
  list.SetNumericValue("acceptable_constr_viol_tol", options.constraint_tolerance);
  list.SetIntegerValue("acceptable_iter", 3);
  if (options.warm_start) {
    list.SetNumericValue("mu_init", std::min(1e-6, options.tolerance));
    list.SetStringValue("bound_mult_init_method", "mu-based");
    for (const char* const push : {"bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac"})
      list.SetNumericValue(push, 1e-8);
  } else if (near_solution) {
    if (!second_order || constrained) list.SetNumericValue("mu_init", 1e-4);
    list.SetNumericValue("bound_push", 1e-6), list.SetNumericValue("bound_frac", 1e-6);
  }
}

}  // namespace

NlpResult solve_with_ipopt(NonlinearProgram& problem, const Eigen::VectorXd& x_start, const IpoptOptions& options) {
  NlpResult result;
  result.algorithm = options.second_order
                         ? "Ipopt: interior point, Hessians of the problem"
                         : fmt::format("Ipopt: interior point, limited-memory BFGS of {} pairs", options.history);
  Adapter* const adapter = new Adapter(problem, x_start, options, result);
  const Ipopt::SmartPtr<Ipopt::TNLP> owner(adapter);
  if (!adapter->start_is_valid()) {
    result.message = "the start point cannot be evaluated: " + result.first_error;
    result.point.ok = false;
    return result;
  }
  if (adapter->start_is_optimal()) {
    result.status = SolverStatus::converged, result.message = "converged: the start is optimal already";
    return result;
  }
  // From a far start a barrier method may leave the valley of a good point for a worse one. Then it starts once more at
  // the good point.
  Outcome outcome{SolverStatus::failed, "Ipopt refused its options"};
  for (int round = 0; round <= kFreshStarts; ++round) {
    const Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);  // no console
    set_options(*application, options, adapter->second_order(), round > 0, problem.constraints() > 0);
    application->Options()->SetIntegerValue("max_iter", std::max(0, options.max_iterations - result.iterations));
    if (application->Initialize("") != Ipopt::Solve_Succeeded) break;  // "": no options file is read
    outcome = in_words(application->OptimizeTNLP(owner), result, options);
    if (adapter->out_of_evaluations() && outcome.status == SolverStatus::stopped)
      outcome = {SolverStatus::iteration_limit,
                 "stopped at the limit of " + counted(*options.max_evaluations, "evaluation") + result.failures()};
    if (adapter->end() == SearchEnd::optimal) outcome = {SolverStatus::converged, kConverged};
    if (adapter->end() == SearchEnd::stalled) outcome = stalled_in_words(adapter->distance(), result, options);
    const bool ended = outcome.status == SolverStatus::converged || outcome.status == SolverStatus::no_progress;
    if (!adapter->creeps() && !(ended && adapter->passed_a_better_point())) break;
    adapter->go_on_from_best();
  }
  if (outcome.status == SolverStatus::converged && adapter->passed_a_better_point())
    outcome = {SolverStatus::no_progress,
               "no further progress: the search ends at worse points than the best one that it has passed, which is "
               "the result; scale the problem, or give tighter bounds" +
                   result.failures()};
  const double distance =
      adapter->finish(outcome.status == SolverStatus::converged || adapter->end() == SearchEnd::stalled);
  if (adapter->end() == SearchEnd::stalled) outcome = stalled_in_words(distance, result, options);
  result.status = outcome.status, result.message = outcome.words;
  if (outcome.status == SolverStatus::converged && distance > options.tolerance)
    result.message += fmt::format(" (as Ipopt measures them; by the measure of all methods to {:.1e})", distance);
  if (adapter->left_newton_at() > 0)
    result.message +=
        fmt::format("; by L-BFGS from iteration {} on, since steps by Hessians gained less than 1 % in {}",
                    adapter->left_newton_at(), counted(SearchWatch::kCreeping, "iteration"));
  // Ipopt gives up if the noise of a constraint exceeds its tolerance, or no step lowers the objective by more than
  // noise. The best point may still be optimal.
  const bool gave_up = outcome.status == SolverStatus::no_progress || outcome.status == SolverStatus::infeasible;
  if (gave_up && adapter->best_is_feasible() && distance <= kAcceptable * options.tolerance) {
    result.status = SolverStatus::converged, result.message = kConvergedInNoise;
  } else if (outcome.status == SolverStatus::infeasible && adapter->best_is_feasible()) {
    result.status = SolverStatus::no_progress;
    result.message =
        "no further progress: the constraints can be held, but not while the objective is lowered; try "
        "tighter simulation tolerances, or another start" +
        result.failures();
  }
  return result;
}

}  // namespace mbsopt
