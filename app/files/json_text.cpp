#include "app/files/json_text.hpp"

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

}  // namespace mbsopt::inline app
