// The points of a design, and the residuals of an identification, as JSON: finds those of an earlier run, and reports
// those of this one.
#pragma once

#include <functional>
#include <map>
#include <tuple>
#include <vector>

#include "app/files/result_json.hpp"
#include "optim/fit/experiment_stack.hpp"
#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline app {

class JsonPointRecords : public PointRecords {
 public:
  using Tell = std::function<void(const char* kind, const Json& content)>;  // kind: "point", "hessians"
  JsonPointRecords(const std::vector<Json>& points, const std::vector<Json>& hessians, Tell tell);

  bool recall(const Eigen::VectorXd& x, Wanted wanted, NlpPoint& point) override;
  void record(const Eigen::VectorXd& x, Wanted wanted, const NlpPoint& point) override;
  bool recall(const Eigen::VectorXd& x, NlpHessians& hessians) override;
  void record(const Eigen::VectorXd& x, const NlpHessians& hessians) override;

  bool all_recalled() const { return points_left_ == 0; }

 private:
  using Key = std::vector<double>;
  struct Known {
    NlpPoint point;
    bool recalled = false;
  };
  // Points with values alone differ from those with derivatives.
  std::map<std::pair<Key, Wanted>, Known> points_;
  std::map<Key, NlpHessians> hessians_;
  std::size_t points_left_ = 0;
  Tell tell_;
};

class JsonResidualRecords : public ResidualRecords {
 public:
  using Tell = std::function<void(const Json& content)>;
  JsonResidualRecords(const std::vector<Json>& residuals, Tell tell);

  bool recall(const Asked& asked, Experiment::Residuals& found) override;
  void record(const Asked& asked, const Experiment::Residuals& found) override;

 private:
  using Key = std::tuple<std::size_t, std::vector<double>, std::vector<double>>;
  std::map<Key, Experiment::Residuals> known_;
  Tell tell_;
};

}  // namespace mbsopt::inline app
