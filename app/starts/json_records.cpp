#include "app/starts/json_records.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

namespace mbsopt::inline app {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The limit of residuals and their derivatives. Longer records are not kept: a new simulation costs less than a journal
// of many megabytes.
constexpr Index kMostNumbers = 50'000;

Json asked_of(const VectorXd& x, Wanted wanted) {
  return {{"x", entries_of(x)}, {"derivatives", wanted == Wanted::derivatives}};
}

Json asked_of(const ResidualRecords::Asked& asked) {
  return {{"experiment", asked.experiment}, {"u", entries_of(asked.u)}, {"sigma", asked.sigma}};
}

NlpPoint point_in(const Json& found, Index variables) {
  NlpPoint point;
  point.ok = !found.contains("failed");
  if (!point.ok) {
    point.message = found["failed"].get<std::string>();
    return point;
  }
  point.f = found.at("f").get<double>();
  point.c = vector_in(found.at("c"));
  if (!found.contains("f_x")) return point;
  point.f_x = vector_in(found["f_x"]);
  if (point.f_x.size() != variables) throw std::length_error("a vector of another size");
  point.c_x = matrix_in(found.at("c_x"), point.c.size(), variables);
  return point;
}

Experiment::Residuals residuals_in(const Json& found, Index columns) {
  const auto at = found.at("at").get<std::vector<Index>>();  // of the columns of z_u that are not zero
  const bool within = std::ranges::all_of(at, [&](Index k) { return 0 <= k && k < columns; });
  if (!within) throw std::length_error("a matrix of another size");
  Experiment::Residuals r;
  r.ok = true;
  r.z = vector_in(found.at("z"));
  r.z_u.setZero(r.z.size(), columns);
  r.z_u(Eigen::all, at) = matrix_in(found.at("z_u"), static_cast<Index>(at.size()), r.z.size()).transpose();
  r.steps = found.at("steps").get<long>();
  if (!found.contains("ends")) return r;
  const Json& ends = found["ends"];
  r.start = vector_in(ends.at("start")), r.end = vector_in(ends.at("end"));
  r.start_u = matrix_in(ends.at("start_u"), r.start.size(), columns);
  r.end_u = matrix_in(ends.at("end_u"), r.end.size(), columns);
  return r;
}

}  // namespace

JsonRecords::JsonRecords(const JournalRecords& earlier, Tell tell) : tell_(std::move(tell)) {
  for (const char* kind : {"point", "hessians", "residuals"}) {
    auto& known = known_[kind];
    if (!earlier.contains(kind)) continue;
    read_record([&] {
      for (const Json& record : earlier.at(kind)) known[json_text(record.at("asked"))] = record.at("found");
    });
  }
}

bool JsonRecords::known(const std::string& kind, const Json& asked, const std::function<void(const Json&)>& read) {
  const auto& of_kind = known_.at(kind);
  const auto record = of_kind.find(json_text(asked));
  if (record == of_kind.end()) return false;
  try {
    read(record->second);
  } catch (const std::exception&) {  // none may pass through a solver
    return false;
  }
  if (kind == "point") recalled_points_.insert(record->first);
  return true;
}

bool JsonRecords::recall(const VectorXd& x, Wanted wanted, NlpPoint& point) {
  return known("point", asked_of(x, wanted), [&](const Json& found) { point = point_in(found, x.size()); });
}

void JsonRecords::record(const VectorXd& x, Wanted wanted, const NlpPoint& point) {
  Json found = Json::object();
  if (!point.ok) {
    found["failed"] = point.message;
  } else {
    found = {{"f", point.f}, {"c", entries_of(point.c)}};
    if (wanted == Wanted::derivatives) found["f_x"] = entries_of(point.f_x), found["c_x"] = rows_of(point.c_x);
  }
  tell_("point", {{"asked", asked_of(x, wanted)}, {"found", found}});
}

bool JsonRecords::recall(const VectorXd& x, NlpHessians& hessians) {
  return known("hessians", entries_of(x), [&](const Json& found) {
    NlpHessians read;
    for (const Json& matrix : found) read.of.push_back(matrix_in(matrix, x.size(), x.size()));
    hessians = std::move(read);
  });
}

void JsonRecords::record(const VectorXd& x, const NlpHessians& hessians) {
  Json found = Json::array();
  for (const MatrixXd& H : hessians.of) found.push_back(rows_of(H));
  tell_("hessians", {{"asked", entries_of(x)}, {"found", found}});
}

bool JsonRecords::recall(const Asked& asked, Experiment::Residuals& residuals) {
  return known("residuals", asked_of(asked),
               [&](const Json& found) { residuals = residuals_in(found, asked.u.size()); });
}

void JsonRecords::record(const Asked& asked, const Experiment::Residuals& r) {
  std::vector<Index> at;
  for (Index k = 0; k < r.z_u.cols(); ++k)
    if (!r.z_u.col(k).isZero(0)) at.push_back(k);
  const MatrixXd z_u = r.z_u(Eigen::all, at);
  if (r.z.size() + z_u.size() > kMostNumbers) return;
  Json found{{"steps", r.steps}, {"at", at}, {"z", entries_of(r.z)}, {"z_u", rows_of(z_u.transpose())}};
  if (r.start.size() + r.end.size() > 0)
    found["ends"] = {{"start", entries_of(r.start)},
                     {"start_u", rows_of(r.start_u)},
                     {"end", entries_of(r.end)},
                     {"end_u", rows_of(r.end_u)}};
  const Json record{{"asked", asked_of(asked)}, {"found", found}};
  known_["residuals"][json_text(record["asked"])] = found;  // nor is a point simulated twice in one run
  tell_("residuals", record);
}

}  // namespace mbsopt::inline app
