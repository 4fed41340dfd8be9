#include "app/import/model_reader.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "core/expression/operation.hpp"
#include "core/scene/inertia_check.hpp"

namespace mbsopt {

std::string described(const XmlElement& element) {
  const std::optional<std::string> name = element.text("name");
  return name ? fmt::format("{} '{}'", element.name, *name) : element.name;
}

std::string left_out(const XmlElement& element, const std::string& what) {
  return fmt::format("line {}: {} is left out (may change the motion)", element.line, what);
}

void ModelErrors::add(const XmlElement& element, const std::string& message) {
  const Finding finding{file_, element.line, element.column, described(element), message};
  if (std::ranges::find(findings_, finding) == findings_.end()) findings_.push_back(finding);
}

void ModelErrors::throw_if_any() const {
  if (!findings_.empty()) throw InputError(findings_);
}

std::vector<double> numbers(const XmlElement& element, std::string_view attribute, const std::string& text,
                            ModelErrors& errors) {
  std::vector<double> values;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    double value = 0;
    const char* const begin = word.data() + (word.starts_with('+') ? 1 : 0);  // from_chars takes no "+"
    const auto [end, failure] = std::from_chars(begin, word.data() + word.size(), value);
    if (failure == std::errc() && end == word.data() + word.size() && std::isfinite(value)) {
      values.push_back(value);
      continue;
    }
    errors.add(element, fmt::format("{}: '{}' is not a number{}", attribute, word,
                                    text.find("${") == std::string::npos ? "" : "; run xacro on the file first"));
    return {};
  }
  if (values.empty()) errors.add(element, fmt::format("{}: is empty, must hold numbers", attribute));
  return values;
}

Eigen::VectorXd numbers(const XmlElement& element, std::string_view attribute, const std::string& text,
                        Eigen::Index count, ModelErrors& errors) {
  const std::vector<double> values = numbers(element, attribute, text, errors);
  if (static_cast<Eigen::Index>(values.size()) == count) return Eigen::Map<const Eigen::VectorXd>(values.data(), count);
  if (!values.empty())
    errors.add(element, fmt::format("{}: has {} numbers, must have {}", attribute, values.size(), count));
  return Eigen::VectorXd::Zero(count);
}

void add_part(ImportedBody& body, const XmlElement& element, double mass, const Eigen::Vector3d& com,
              const Eigen::Matrix3d& inertia, ModelErrors& errors) {
  if (mass < 0) return errors.add(element, fmt::format("mass: is {} kg, a mass must not be negative", mass));
  if (inertia.allFinite()) {
    const Eigen::Matrix3d& J = inertia;
    const std::string problem = inertia_problem({J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2), J(1, 2)});
    if (!problem.empty()) return errors.add(element, "inertia: " + problem);
  }
  add_mass(body, mass, com, inertia);
}

Eigen::Matrix3d rotation(int axis, double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
}

std::string Names::unique(std::string name, const std::string& wanted) {
  const auto is_taken = [&](const std::string& n) {
    return std::ranges::find(taken_, n) != taken_.end() || find_function(n) != nullptr;
  };
  const std::string stem = name;
  for (int k = 2; is_taken(name); ++k) name = fmt::format("{}_{}", stem, k);
  taken_.push_back(name);
  if (renamed_ && name != wanted) renamed_->push_back(fmt::format("'{}' is named '{}'", wanted, name));
  return name;
}

std::string Names::body(const std::string& wanted) {
  std::string name = wanted;
  std::ranges::replace_if(
      name,
      [](unsigned char c) {
        return c < ' ' || std::string_view(".,;\"'[]/\\").find(static_cast<char>(c)) != std::string_view::npos;
      },
      '_');
  return unique(name.empty() ? "unnamed" : name, wanted);
}

std::string Names::identifier(const std::string& wanted) {
  std::string name = wanted;
  const auto fits = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); };
  std::ranges::replace_if(
      name, [&](char c) { return !fits(c); }, '_');
  if (name.empty() || (name[0] >= '0' && name[0] <= '9')) name.insert(0, "_");
  return unique(name, wanted);
}

}  // namespace mbsopt
