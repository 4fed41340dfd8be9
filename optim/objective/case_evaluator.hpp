// Evaluator for the objectives of a problem in all its load cases. Threads compute the cases; results do not depend on
// their number.
//
//   CaseEvaluator evaluator(problem, {"track", "peak"}, {"k1"}, {}, 2);
//   const CaseEvaluation e = evaluator.gradients(evaluator.start());
//   e.psi(2 * c), e.psi(2 * c + 1);   // track and peak in case c
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "optim/objective/evaluator.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// psi and its derivatives case by case, each with all objectives. ok holds if all cases are ok. Statistics are those of
// the first.
struct CaseEvaluation : Evaluation {
  std::vector<Evaluation> of_cases;
};

class CaseEvaluator {
 public:
  // A problem without cases is its own only case. Each case is reduced to the needs of its objectives. Forces written
  // in C++ prevent this, because they name bodies by number.
  CaseEvaluator(const Problem& problem, const std::vector<std::string>& objectives,
                const std::vector<std::string>& variables, const EvaluatorOptions& options = {}, int threads = 1);

  CaseEvaluation values(const Eigen::VectorXd& rho);
  CaseEvaluation gradients(const Eigen::VectorXd& rho);
  // Does the same as Evaluator's, case by case.
  std::vector<std::optional<double>> true_values(const Eigen::VectorXd& rho) const;

  // Calls work(c) in up to threads() threads. The case with most right-hand sides in the last evaluation is first.
  void for_each_case(const std::function<void(std::size_t c)>& work) const;

  std::size_t cases() const { return evaluators_.size(); }
  std::size_t objectives() const { return evaluators_[0].objectives().size(); }  // of each case
  Evaluator& of_case(std::size_t c) { return evaluators_[c]; }
  const Evaluator& of_case(std::size_t c) const { return evaluators_[c]; }
  std::string case_name(std::size_t c) const { return has_cases() ? problem_.cases[c].name : std::string(); }
  std::string in_case(std::size_t c, const std::string& what) const;  // "what (cold)", with the problem's names

  const std::vector<int>& variables() const { return evaluators_[0].variables(); }
  Eigen::VectorXd start() const { return evaluators_[0].start(); }
  long simulations() const;
  int threads() const { return threads_; }

 private:
  template <class Evaluate>
  CaseEvaluation evaluated(const Eigen::VectorXd& rho, const Evaluate& evaluate);

  bool has_cases() const { return !problem_.cases.empty(); }
  // "case 'cold': words", with the problem's names of parameters.
  std::string with_case(std::size_t c, const std::string& words) const;

  const Problem problem_;
  std::vector<Evaluator> evaluators_;
  std::shared_ptr<std::mutex> progress_;  // shared by all threads, which report to one listener
  const int threads_;
  CaseEvaluation last_;
};

}  // namespace mbsopt::inline optim
