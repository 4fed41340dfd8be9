#include "optim/solver/nlopt_solver.hpp"

#include <fmt/format.h>
#include <nlopt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/expression/counted.hpp"
#include "optim/solver/nlp_search.hpp"
#include "optim/solver/optimality.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using VectorIn = Eigen::Map<const VectorXd>;
using VectorView = Eigen::Map<VectorXd>;

constexpr int kFailuresInARow = 40;     // of local methods, which then end
constexpr double kFirstStep = 0.1;      // of x, without derivatives
constexpr long kRequestsPerPoint = 20;  // requests of stored points; beyond it a method repeats itself

using Optimizer = std::unique_ptr<nlopt_opt_s, decltype(&nlopt_destroy)>;

class NloptSearch : private NlpSearch {
 public:
  NloptSearch(NonlinearProgram& problem, const NloptMethod& method, const NloptOptions& options, NlpResult& result)
      : NlpSearch(problem, options, result),
        method_(method),
        algorithm_(static_cast<nlopt_algorithm>(method.algorithm)),
        options_(options),
        wanted_(method.gradients ? Wanted::derivatives : Wanted::values),
        max_evaluations_(options.max_evaluations.value_or(default_max_evaluations(method, problem.variables()))) {
    moves_to_best_ = !method.global;
    for (Index i = 0; i < problem.constraints(); ++i) {
      const double lower = problem.c_lower(i), upper = problem.c_upper(i);
      if (lower == upper) {
        equalities_.all.push_back({i, 1, lower});
        continue;
      }
      if (std::isfinite(lower)) inequalities_.all.push_back({i, -1, lower});
      if (std::isfinite(upper)) inequalities_.all.push_back({i, 1, upper});
    }
  }

  void run(const VectorXd& x_start) {
    result_.x = x_start;
    const NlpPoint& start = at(x_start, wanted_);
    took(start);
    if (!start.ok) return end_refused();
    const unsigned n = static_cast<unsigned>(problem_.variables());
    const bool constrained = problem_.constraints() > 0;
    const bool augmented = constrained && method_.constraints == ConstraintSupport::augmented_lagrangian;
    const Optimizer outer(nlopt_create(augmented ? NLOPT_AUGLAG : algorithm_, n), nlopt_destroy);
    opt_ = outer.get();
    limit(opt_, x_start);
    nlopt_set_vector_storage(opt_, options_.history);
    if (augmented || algorithm_ == NLOPT_G_MLSL) {
      const Optimizer inner(nlopt_create(augmented ? algorithm_ : NLOPT_LD_LBFGS, n), nlopt_destroy);
      limit(inner.get(), x_start);
      nlopt_set_vector_storage(inner.get(), options_.history);
      if (algorithm_ == NLOPT_G_MLSL) {  // whose search ends when a local one cannot get anywhere
        nlopt_set_xtol_abs(inner.get(), VectorXd(tolerance_ * x_start.cwiseAbs().cwiseMax(1)).data());
        nlopt_set_ftol_abs(inner.get(), 1e-3 * tolerance_);
      }
      nlopt_set_local_optimizer(opt_, inner.get());  // a copy
    }
    state_program();
    if (method_.random) nlopt_srand(options_.seed);
    result_.algorithm = nlopt_algorithm_name(algorithm_);
    if (augmented) result_.algorithm = std::string(nlopt_algorithm_name(NLOPT_AUGLAG)) + ": " + result_.algorithm;
    if (!ended_) {
      VectorXd x = x_start;
      double f = 0;
      const nlopt_result code = nlopt_optimize(opt_, x.data(), &f);
      if (const char* const words = nlopt_get_errmsg(opt_)) library_message_ = words;
      if (exception_) std::rethrow_exception(exception_);
      if (!ended_) end_by_itself(code);
    }
    opt_ = nullptr;
    take_solution();
  }

 private:
  struct Side {
    Index constraint;
    double sign, bound;  // sign (c - bound) <= 0, or = 0
  };
  struct Sides {
    NloptSearch& search;
    std::vector<Side> all;
  };
  using AddConstraints = nlopt_result (*)(nlopt_opt, unsigned, nlopt_mfunc, void*, const double*);

  void state_program() {
    nlopt_set_maxeval(opt_, static_cast<int>(std::min(kRequestsPerPoint * max_evaluations_, 2'000'000'000L)));
    nlopt_set_min_objective(opt_, objective, this);
    add(inequalities_, nlopt_add_inequality_mconstraint);
    add(equalities_, nlopt_add_equality_mconstraint);
  }

  // Sets bounds, and the sizes of steps and changes that end the search.
  void limit(nlopt_opt opt, const VectorXd& x_start) const {
    // A global method searches between its bounds.
    nlopt_set_lower_bounds(opt,
                           method_.global ? problem_.x_lower.data() : near_bounds(problem_.x_lower, x_start).data());
    nlopt_set_upper_bounds(opt,
                           method_.global ? problem_.x_upper.data() : near_bounds(problem_.x_upper, x_start).data());
    const VectorXd size = x_start.cwiseAbs().cwiseMax(1);
    // With gradients, these decide on convergence; the steps only show that nothing moves any more.
    const VectorXd x_tolerance = (method_.gradients ? 1e-6 : 1.0) * tolerance_ * size;
    nlopt_set_xtol_abs(opt, x_tolerance.data());
    nlopt_set_ftol_abs(opt, 1e-2 * tolerance_ * tolerance_);
    if (method_.gradients || method_.global) return;
    VectorXd step = kFirstStep * size;
    for (Index k = 0; k < step.size(); ++k) {
      const double width = problem_.x_upper(k) - problem_.x_lower(k);
      if (width > 0 && std::isfinite(width)) step(k) = std::min(step(k), width / 4);
    }
    nlopt_set_initial_step(opt, step.data());
  }

  void add(Sides& sides, AddConstraints add_to) {
    if (sides.all.empty()) return;
    VectorXd tolerance(static_cast<Index>(sides.all.size()));
    for (Index j = 0; j < tolerance.size(); ++j)
      tolerance(j) =
          options_.constraint_tolerance * problem_.c_scale(sides.all[static_cast<std::size_t>(j)].constraint);
    add_to(opt_, static_cast<unsigned>(sides.all.size()), constraint_values, &sides, tolerance.data());
  }

  // No exception may pass through NLopt, which is C.
  template <class F>
  static void guarded(NloptSearch& self, F&& evaluate) {
    try {
      evaluate();
    } catch (...) {
      self.exception_ = std::current_exception();
      self.force_stop();
    }
  }

  static double objective(unsigned n, const double* x, double* f_x, void* data) {
    NloptSearch& self = *static_cast<NloptSearch*>(data);
    double f = 0;
    guarded(self, [&] {
      const NlpPoint& point = self.answer_at(VectorIn(x, n));
      f = self.problem_.f_scale * point.f;
      if (f_x) VectorView(f_x, n) = self.problem_.f_scale * point.f_x;
    });
    return f;
  }
  static void constraint_values(unsigned m, double* values, unsigned n, const double* x, double* c_x, void* data) {
    const Sides& sides = *static_cast<const Sides*>(data);
    NloptSearch& self = sides.search;
    std::fill(values, values + m, 0);
    guarded(self, [&] {
      const NlpPoint& point = self.answer_at(VectorIn(x, n));
      for (unsigned j = 0; j < m; ++j) {
        const Side& side = sides.all[j];
        const double scale = side.sign * self.problem_.c_scale(side.constraint);
        values[j] = scale * (point.c(side.constraint) - side.bound);
        if (c_x) VectorView(c_x + j * n, n) = scale * point.c_x.row(side.constraint);
      }
    });
  }

  // The point for NLopt, or its substitute if it cannot be evaluated.
  const NlpPoint& answer_at(const VectorXd& x) {
    if (!x.allFinite())
      end(SolverStatus::failed,
          fmt::format("{} asked for a point that is not a number{}", method_.name, result_.failures()));
    if (ended_) return last_good_;
    const NlpPoint& point = at(x, wanted_);
    if (is_new()) took(point);
    if (point.ok) return point;
    set_stand_in();
    return stand_in_;
  }

  void took(const NlpPoint& point) {
    if (point.ok) {
      f_worst_ = last_good_x_.size() > 0 ? std::max(f_worst_, point.f) : point.f;
      last_good_ = point;
      last_good_x_ = x();
      if (is_local_with_gradients() && look(point) <= tolerance_ && !ended_) {
        conclude({});
        force_stop();
      }
      if (is_best()) took_better(point);
    } else if (point.abandoned) {
      stop_on_request();
    } else if (!method_.global && failed_in_a_row_ >= kFailuresInARow) {
      end(SolverStatus::no_progress, fmt::format("no further progress: {} in a row failed, the last: {}",
                                                 counted(failed_in_a_row_, "evaluation"), last_error_));
    }
    if (result_.evaluations >= max_evaluations_) end_at_limit(max_evaluations_, "evaluation");
  }

  void took_better(const NlpPoint& point) {
    if (result_.evaluations > 1) ++result_.iterations;  // not the start
    if (!report(point, method_.gradients ? optimality(problem_, x(), point) : NAN)) stop_on_request();
    if (options_.max_iterations && result_.iterations >= *options_.max_iterations)
      end_at_limit(*options_.max_iterations, "iteration");
  }

  bool is_local_with_gradients() const { return method_.gradients && !method_.global; }

  // If a point fails, its function value is high, so that the method returns. With gradients it rises along the step by
  // the decrease that the last good gradient promised. A line search then takes a quarter of its step. Without
  // gradients it exceeds all values so far. Constraints keep their values.
  void set_stand_in() {
    stand_in_ = last_good_;
    const double least = 1e-3 * std::max(std::abs(last_good_.f), 1 / problem_.f_scale);
    if (!method_.gradients) {
      stand_in_.f = f_worst_ + std::max(f_worst_ - best().f, least);
      return;
    }
    const VectorXd d = x() - last_good_x_;
    const double rise = std::max(std::abs(last_good_.f_x.dot(d)), least);
    stand_in_.f = std::max(last_good_.f, best().f) + rise;
    stand_in_.f_x = 2 * rise / std::max(d.squaredNorm(), std::numeric_limits<double>::min()) * d;
  }

  void force_stop() {
    ended_ = true;
    if (opt_) nlopt_force_stop(opt_);
  }
  // The first reason counts.
  void end(SolverStatus status, std::string words) {
    if (!ended_) result_.end(status, std::move(words));
    force_stop();
  }
  void stop_on_request() {
    if (!ended_) result_.end_on_request();
    force_stop();
  }
  void end_at_limit(long most, const char* of) {
    if (!ended_ && method_.global) end_searched(counted(most, of));
    if (!ended_) result_.end_at_limit(most, of);
    force_stop();
  }

  void end_searched(const std::string& limit) {
    take_solution();
    if (!feasible(result_.point))
      return end(SolverStatus::infeasible,
                 fmt::format("infeasible: none of {} satisfies the constraints; relax them, or search longer "
                             "(max_evaluations){}",
                             counted(result_.evaluations, "point"), result_.failures()));
    end(SolverStatus::searched,
        fmt::format("searched to the given limit, {}: the best point found, which a local method may improve{}", limit,
                    result_.failures()));
  }

  void end_by_itself(nlopt_result code) {
    const std::string failures = result_.failures(), library = library_message_.empty() ? "" : ": " + library_message_;
    if (code == NLOPT_OUT_OF_MEMORY) return end(SolverStatus::failed, "not enough memory");
    if (code == NLOPT_INVALID_ARGS)
      return end(SolverStatus::failed, fmt::format("{} refused the problem{}", method_.name, library));
    take_solution();
    if (is_local_with_gradients() || !feasible(result_.point)) return conclude("no step lowers the objective any more");
    if (code == NLOPT_MAXEVAL_REACHED) {  // requests of known points reached the limit
      if (method_.global) return end_searched(counted(max_evaluations_, "evaluation"));
      return end(SolverStatus::no_progress,
                 "no further progress: the method returns to points that it has already tried" + failures);
    }
    if (code == NLOPT_ROUNDOFF_LIMITED)
      return end(SolverStatus::converged, "converged: the steps are down to the accuracy of the objective" + failures);
    if (code < 0 && method_.global)  // mlsl: one of its local searches
      return end(SolverStatus::searched,
                 fmt::format("searched until nothing got any better, {}: the best point found{}",
                             counted(result_.evaluations, "evaluation"), failures));
    if (code < 0)
      return end(SolverStatus::failed,
                 fmt::format("{} failed ({}{}){}", method_.name, nlopt_result_to_string(code), library, failures));
    end(SolverStatus::converged,
        "converged: the steps, or the changes of the objective, are below the tolerance" + failures);
  }

  const NloptMethod& method_;
  const nlopt_algorithm algorithm_;
  const NloptOptions& options_;
  const Wanted wanted_;
  const long max_evaluations_;
  Sides inequalities_{*this, {}}, equalities_{*this, {}};
  nlopt_opt opt_ = nullptr;  // while it runs
  bool ended_ = false;
  std::exception_ptr exception_;
  std::string library_message_;
  NlpPoint last_good_, stand_in_;
  VectorXd last_good_x_;
  double f_worst_ = 0;
};

bool has_equality(const NonlinearProgram& problem) {
  return problem.constraints() > 0 && (problem.c_lower.array() == problem.c_upper.array()).any();
}

}  // namespace

NlpResult solve_with_nlopt(NonlinearProgram& problem, const VectorXd& x_start, const NloptOptions& options) {
  const NloptMethod* const method = find_nlopt_method(options.method);
  if (!method)
    throw std::invalid_argument(
        fmt::format("there is no NLopt method '{}'; available: {}", options.method, nlopt_method_names()));
  const NloptNeeds needs{static_cast<std::size_t>(problem.variables()), problem.constraints() > 0,
                         has_equality(problem)};
  if (const std::string refusal = nlopt_refusal(*method, needs); !refusal.empty()) throw std::invalid_argument(refusal);
  if (method->global && !(problem.x_lower.allFinite() && problem.x_upper.allFinite()))
    throw std::invalid_argument(fmt::format("'{}' searches between bounds; every variable needs both", options.method));
  NlpResult result;
  NloptSearch(problem, *method, options, result).run(x_start);
  return result;
}

}  // namespace mbsopt::inline optim
