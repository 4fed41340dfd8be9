#include "app/starts/residual_records.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "app/files/base64.hpp"
#include "app/files/journal.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The limit of residuals and their derivatives. Longer records are not kept: a new simulation costs less than a journal
// of many megabytes.
constexpr Index kMostNumbers = 50'000;
constexpr Index kMostColumns = 1'000'000;  // of a damaged line, before memory is requested

Experiment::Residuals residuals_of(const Json& json) {
  const auto numbers = [](const Json& text) { return doubles_of(text.get_ref<const std::string&>()); };
  const std::vector<double> z = numbers(json.at("z")), z_u = numbers(json.at("z_u"));
  const auto at = json.at("at").get<std::vector<Index>>();  // of the columns of z_u that are not zero
  const Index rows = static_cast<Index>(z.size()), columns = json.at("columns").get<Index>(),
              written = static_cast<Index>(at.size());
  const bool within = std::ranges::all_of(at, [&](Index k) { return 0 <= k && k < columns; });
  if (columns < 0 || columns > kMostColumns || !within || rows * written != static_cast<Index>(z_u.size()))
    throw std::length_error("a matrix of another size");
  Experiment::Residuals r;
  r.ok = true;
  r.z = Eigen::Map<const VectorXd>(z.data(), rows);
  r.z_u.setZero(rows, columns);
  r.z_u(Eigen::all, at) = Eigen::Map<const MatrixXd>(z_u.data(), rows, written);
  r.steps = json.at("steps").get<long>();
  if (!json.contains("ends")) return r;
  const auto of = [&](const char* key, VectorXd& s, MatrixXd& s_u) {
    const std::vector<double> values = numbers(json.at("ends").at(key));
    const Index n = static_cast<Index>(values.size()) / (1 + columns);
    if (n * (1 + columns) != static_cast<Index>(values.size())) throw std::length_error("a matrix of another size");
    s = Eigen::Map<const VectorXd>(values.data(), n);
    s_u = Eigen::Map<const MatrixXd>(values.data() + n, n, columns);
  };
  of("start", r.start, r.start_u), of("end", r.end, r.end_u);
  return r;
}

}  // namespace

JsonResidualRecords::JsonResidualRecords(const std::vector<Json>& residuals, Tell tell) : tell_(std::move(tell)) {
  read_record([&] {
    for (const Json& json : residuals)
      known_[{json.at("experiment").get<std::size_t>(), json.at("u").get<std::vector<double>>(),
              json.at("sigma").get<std::vector<double>>()}] = residuals_of(json);
  });
}

JsonResidualRecords::Key JsonResidualRecords::key_of(const Asked& asked) {
  return {asked.experiment, {asked.u.begin(), asked.u.end()}, asked.sigma};
}

bool JsonResidualRecords::recall(const Asked& asked, Experiment::Residuals& found) {
  const auto known = known_.find(key_of(asked));
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
  known_[key_of(asked)] = found;  // nor is a point simulated twice in one run
  Json content{{"experiment", asked.experiment},
               {"u", std::vector<double>(asked.u.begin(), asked.u.end())},
               {"sigma", asked.sigma},
               {"steps", found.steps},
               {"columns", found.z_u.cols()},
               {"at", at},
               {"z", base64_of({found.z.data(), static_cast<std::size_t>(found.z.size())})},
               {"z_u", base64_of({z_u.data(), static_cast<std::size_t>(z_u.size())})}};
  const auto add = [&](const char* key, const VectorXd& s, const MatrixXd& s_u) {  // s, then the columns of s_u
    std::vector<double> values(s.begin(), s.end());
    values.insert(values.end(), s_u.data(), s_u.data() + s_u.size());
    content["ends"][key] = base64_of(values);
  };
  if (found.start.size() + found.end.size() > 0)
    add("start", found.start, found.start_u), add("end", found.end, found.end_u);
  tell_(content);
}

}  // namespace mbsopt
