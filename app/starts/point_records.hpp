// The points of a design as JSON: finds those of an earlier run, and reports those of this one.
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "app/files/result_json.hpp"
#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt {

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

}  // namespace mbsopt
