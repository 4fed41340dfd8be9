// The residuals of an identification as JSON: finds those of an earlier run, and reports those of this one.
#pragma once

#include <functional>
#include <map>
#include <tuple>
#include <vector>

#include "app/files/result_json.hpp"
#include "optim/fit/experiment_stack.hpp"

namespace mbsopt {

class JsonResidualRecords : public ResidualRecords {
 public:
  using Tell = std::function<void(const Json& content)>;
  JsonResidualRecords(const std::vector<Json>& residuals, Tell tell);

  bool recall(const Asked& asked, Experiment::Residuals& found) override;
  void record(const Asked& asked, const Experiment::Residuals& found) override;

 private:
  using Key = std::tuple<std::size_t, std::vector<double>, std::vector<double>>;
  static Key key_of(const Asked& asked);
  std::map<Key, Experiment::Residuals> known_;
  Tell tell_;
};

}  // namespace mbsopt
