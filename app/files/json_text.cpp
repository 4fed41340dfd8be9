#include "app/files/json_text.hpp"

#include <stdexcept>

namespace mbsopt::inline app {

Json read_json(std::string_view text) { return Json::parse(text); }
Json read_json_or_discarded(std::string_view text) { return Json::parse(text, nullptr, false); }

std::string json_text(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

std::vector<double> entries_of(const Eigen::VectorXd& v) { return {v.begin(), v.end()}; }

Json rows_of(const Eigen::MatrixXd& m) {
  Json rows = Json::array();
  for (const auto& row : m.rowwise()) rows.push_back(entries_of(row.transpose()));
  return rows;
}

Eigen::VectorXd vector_in(const Json& json) {
  const auto values = json.get<std::vector<double>>();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

Eigen::MatrixXd matrix_in(const Json& json, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd m(rows, columns);
  if (json.size() != static_cast<std::size_t>(rows)) throw std::length_error("a matrix of another size");
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::VectorXd row = vector_in(json.at(static_cast<std::size_t>(i)));
    if (row.size() != columns) throw std::length_error("a matrix of another size");
    m.row(i) = row.transpose();
  }
  return m;
}

}  // namespace mbsopt::inline app
