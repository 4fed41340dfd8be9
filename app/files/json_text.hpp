// JSON as text, and vectors and matrices as JSON. This file alone compiles nlohmann's parser and writer, which cost
// each source several seconds.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace mbsopt::inline app {

using Json = nlohmann::ordered_json;

Json read_json(std::string_view text);               // throws Json::parse_error
Json read_json_or_discarded(std::string_view text);  // is_discarded() where the text is not JSON

// indent is the number of spaces per level; -1 writes one line. U+FFFD replaces invalid UTF-8, so check file names
// before.
std::string json_text(const Json& json, int indent = -1);

// The numbers of a vector and the rows of a matrix. Their text reads back as the same numbers.
std::vector<double> entries_of(const Eigen::VectorXd& v);
Json rows_of(const Eigen::MatrixXd& m);

}  // namespace mbsopt::inline app
