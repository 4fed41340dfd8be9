// The evaluations of a design and of an identification as JSON: finds those of an earlier run, and reports those of
// this one. In the journal they are the kinds "point", "hessians" and "residuals", all of one form:
//
//   {"asked": {"x": [...], "derivatives": true}, "found": {"f": 0.12, "c": [...], "f_x": [...], "c_x": [[...]]}}
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>

#include "app/files/journal.hpp"
#include "optim/fit/experiment_stack.hpp"
#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline app {

class JsonRecords : public PointRecords, public ResidualRecords {
 public:
  using Tell = std::function<void(const std::string& kind, const Json& content)>;
  // Throws OutputError if a record is not of this form.
  JsonRecords(const JournalRecords& earlier, Tell tell);

  bool recall(const Eigen::VectorXd& x, Wanted wanted, NlpPoint& point) override;
  void record(const Eigen::VectorXd& x, Wanted wanted, const NlpPoint& point) override;
  bool recall(const Eigen::VectorXd& x, NlpHessians& hessians) override;
  void record(const Eigen::VectorXd& x, const NlpHessians& hessians) override;
  bool recall(const Asked& asked, Experiment::Residuals& found) override;
  void record(const Asked& asked, const Experiment::Residuals& found) override;

  bool all_points_recalled() const { return recalled_points_.size() == known_.at("point").size(); }

 private:
  // Reads what was found. Returns false if that is not known, or not readable: it is then evaluated again.
  bool known(const std::string& kind, const Json& asked, const std::function<void(const Json& found)>& read);

  std::map<std::string, std::map<std::string, Json>> known_;  // by kind and by the text of what was asked
  std::set<std::string> recalled_points_;
  Tell tell_;
};

}  // namespace mbsopt::inline app
