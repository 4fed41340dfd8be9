#include "app/starts/point_records.hpp"

#include <stdexcept>
#include <utility>

#include "app/files/journal.hpp"

namespace mbsopt {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<double> as_vector(const VectorXd& v) { return {v.begin(), v.end()}; }

Json to_json(const MatrixXd& m) {
  Json rows = Json::array();
  for (const auto& row : m.rowwise()) rows.push_back(as_vector(row.transpose()));
  return rows;
}

VectorXd vector_of(const Json& json) {
  const auto values = json.get<std::vector<double>>();
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

VectorXd vector_of(const Json& json, Eigen::Index size) {
  VectorXd v = vector_of(json);
  if (v.size() != size) throw std::length_error("a vector of another size");
  return v;
}

MatrixXd matrix_of(const Json& json, Eigen::Index rows, Eigen::Index columns) {
  if (json.size() != static_cast<std::size_t>(rows)) throw std::length_error("a matrix of another size");
  MatrixXd m(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i)
    m.row(i) = vector_of(json.at(static_cast<std::size_t>(i)), columns).transpose();
  return m;
}

NlpPoint point_of(const Json& json, Eigen::Index variables) {
  NlpPoint point;
  point.ok = !json.contains("failed");
  if (!point.ok) {
    point.message = json.at("failed").get<std::string>();
    return point;
  }
  point.f = json.at("f").get<double>();
  point.c = vector_of(json.at("c"));
  if (!json.contains("f_x")) return point;
  point.f_x = vector_of(json.at("f_x"), variables);
  point.c_x = matrix_of(json.at("c_x"), point.c.size(), variables);
  return point;
}

}  // namespace

JsonPointRecords::JsonPointRecords(const std::vector<Json>& points, const std::vector<Json>& hessians, Tell tell)
    : tell_(std::move(tell)) {
  read_record([&] {
    for (const Json& json : points) {
      const Key x = json.at("x").get<Key>();
      const Wanted wanted = json.at("derivatives").get<bool>() ? Wanted::derivatives : Wanted::values;
      points_[{x, wanted}] = {point_of(json, static_cast<Eigen::Index>(x.size())), false};
    }
    for (const Json& json : hessians) {
      const Key x = json.at("x").get<Key>();
      const auto n = static_cast<Eigen::Index>(x.size());
      NlpHessians& known = hessians_[x];
      for (const Json& matrix : json.at("of")) known.of.push_back(matrix_of(matrix, n, n));
    }
  });
  points_left_ = points_.size();
}

bool JsonPointRecords::recall(const VectorXd& x, Wanted wanted, NlpPoint& point) {
  const auto known = points_.find({as_vector(x), wanted});
  if (known == points_.end()) return false;
  if (!known->second.recalled) --points_left_;
  known->second.recalled = true;
  point = known->second.point;
  return true;
}

void JsonPointRecords::record(const VectorXd& x, Wanted wanted, const NlpPoint& point) {
  Json json{{"x", as_vector(x)}, {"derivatives", wanted == Wanted::derivatives}};
  if (point.ok) {
    json["f"] = point.f, json["c"] = as_vector(point.c);
    if (wanted == Wanted::derivatives) json["f_x"] = as_vector(point.f_x), json["c_x"] = to_json(point.c_x);
  } else {
    json["failed"] = point.message;
  }
  tell_("point", json);
}

bool JsonPointRecords::recall(const VectorXd& x, NlpHessians& hessians) {
  const auto known = hessians_.find(as_vector(x));
  if (known == hessians_.end()) return false;
  hessians = known->second;
  return true;
}

void JsonPointRecords::record(const VectorXd& x, const NlpHessians& hessians) {
  Json of = Json::array();
  for (const MatrixXd& H : hessians.of) of.push_back(to_json(H));
  tell_("hessians", {{"x", as_vector(x)}, {"of", of}});
}

}  // namespace mbsopt
