#include "app/starts/json_records.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "app/files/journal.hpp"

namespace mbsopt::inline app {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The limit of residuals and their derivatives. Longer records are not kept: a new simulation costs less than a journal
// of many megabytes.
constexpr Index kMostNumbers = 50'000;
constexpr Index kMostColumns = 1'000'000;  // of a damaged line, before memory is requested

NlpPoint point_of(const Json& json, Index variables) {
  NlpPoint point;
  point.ok = !json.contains("failed");
  if (!point.ok) {
    point.message = json.at("failed").get<std::string>();
    return point;
  }
  point.f = json.at("f").get<double>();
  point.c = vector_in(json.at("c"));
  if (!json.contains("f_x")) return point;
  point.f_x = vector_in(json.at("f_x"));
  if (point.f_x.size() != variables) throw std::length_error("a vector of another size");
  point.c_x = matrix_in(json.at("c_x"), point.c.size(), variables);
  return point;
}

Experiment::Residuals residuals_of(const Json& json) {
  const auto at = json.at("at").get<std::vector<Index>>();  // of the columns of z_u that are not zero
  const Index columns = json.at("columns").get<Index>();
  const bool within = std::ranges::all_of(at, [&](Index k) { return 0 <= k && k < columns; });
  if (columns < 0 || columns > kMostColumns || !within) throw std::length_error("a matrix of another size");
  Experiment::Residuals r;
  r.ok = true;
  r.z = vector_in(json.at("z"));
  r.z_u.setZero(r.z.size(), columns);
  r.z_u(Eigen::all, at) = matrix_in(json.at("z_u"), static_cast<Index>(at.size()), r.z.size()).transpose();
  r.steps = json.at("steps").get<long>();
  if (!json.contains("ends")) return r;
  const Json& ends = json["ends"];
  r.start = vector_in(ends.at("start")), r.end = vector_in(ends.at("end"));
  r.start_u = matrix_in(ends.at("start_u"), r.start.size(), columns);
  r.end_u = matrix_in(ends.at("end_u"), r.end.size(), columns);
  return r;
}

}  // namespace

JsonPointRecords::JsonPointRecords(const std::vector<Json>& points, const std::vector<Json>& hessians, Tell tell)
    : tell_(std::move(tell)) {
  read_record([&] {
    for (const Json& json : points) {
      const Key x = json.at("x").get<Key>();
      const Wanted wanted = json.at("derivatives").get<bool>() ? Wanted::derivatives : Wanted::values;
      points_[{x, wanted}] = {point_of(json, static_cast<Index>(x.size())), false};
    }
    for (const Json& json : hessians) {
      const Key x = json.at("x").get<Key>();
      const auto n = static_cast<Index>(x.size());
      NlpHessians& known = hessians_[x];
      for (const Json& matrix : json.at("of")) known.of.push_back(matrix_in(matrix, n, n));
    }
  });
  points_left_ = points_.size();
}

bool JsonPointRecords::recall(const VectorXd& x, Wanted wanted, NlpPoint& point) {
  const auto known = points_.find({entries_of(x), wanted});
  if (known == points_.end()) return false;
  if (!known->second.recalled) --points_left_;
  known->second.recalled = true;
  point = known->second.point;
  return true;
}

void JsonPointRecords::record(const VectorXd& x, Wanted wanted, const NlpPoint& point) {
  Json json{{"x", entries_of(x)}, {"derivatives", wanted == Wanted::derivatives}};
  if (point.ok) {
    json["f"] = point.f, json["c"] = entries_of(point.c);
    if (wanted == Wanted::derivatives) json["f_x"] = entries_of(point.f_x), json["c_x"] = rows_of(point.c_x);
  } else {
    json["failed"] = point.message;
  }
  tell_("point", json);
}

bool JsonPointRecords::recall(const VectorXd& x, NlpHessians& hessians) {
  const auto known = hessians_.find(entries_of(x));
  if (known == hessians_.end()) return false;
  hessians = known->second;
  return true;
}

void JsonPointRecords::record(const VectorXd& x, const NlpHessians& hessians) {
  Json of = Json::array();
  for (const MatrixXd& H : hessians.of) of.push_back(rows_of(H));
  tell_("hessians", {{"x", entries_of(x)}, {"of", of}});
}

JsonResidualRecords::JsonResidualRecords(const std::vector<Json>& residuals, Tell tell) : tell_(std::move(tell)) {
  read_record([&] {
    for (const Json& json : residuals)
      known_[{json.at("experiment").get<std::size_t>(), json.at("u").get<std::vector<double>>(),
              json.at("sigma").get<std::vector<double>>()}] = residuals_of(json);
  });
}

bool JsonResidualRecords::recall(const Asked& asked, Experiment::Residuals& found) {
  const auto known = known_.find({asked.experiment, entries_of(asked.u), asked.sigma});
  if (known == known_.end()) return false;
  found = known->second;
  return true;
}

void JsonResidualRecords::record(const Asked& asked, const Experiment::Residuals& found) {
  std::vector<Index> at;
  for (Index k = 0; k < found.z_u.cols(); ++k)
    if (!found.z_u.col(k).isZero(0)) at.push_back(k);
  const MatrixXd z_u = found.z_u(Eigen::all, at);
  if (found.z.size() + z_u.size() > kMostNumbers) return;
  known_[{asked.experiment, entries_of(asked.u), asked.sigma}] = found;  // nor is a point simulated twice in one run
  Json content{{"experiment", asked.experiment}, {"u", entries_of(asked.u)},       {"sigma", asked.sigma},
               {"steps", found.steps},           {"columns", found.z_u.cols()},    {"at", at},
               {"z", entries_of(found.z)},       {"z_u", rows_of(z_u.transpose())}};
  if (found.start.size() + found.end.size() > 0)
    content["ends"] = {{"start", entries_of(found.start)},
                       {"start_u", rows_of(found.start_u)},
                       {"end", entries_of(found.end)},
                       {"end_u", rows_of(found.end_u)}};
  tell_(content);
}

}  // namespace mbsopt::inline app
