// The visitor (core/scene/vocabulary.hpp) that checks every field of a scene or problem: referenced names, expressions,
// dimensions, ranges. check_meaning() checks what only a whole object can show.
#pragma once

#include <fmt/format.h>

#include <concepts>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/field_visitor.hpp"
#include "core/scene/scene_facts.hpp"
#include "core/scene/scene_issue.hpp"

namespace mbsopt {

// A number in a message: the shortest text that reads back as it.
std::string text_of(double value);

// The words with a value in place of each "{}".
inline std::string shown(double value) { return text_of(value); }
inline std::string_view shown(std::string_view value) { return value; }
auto shown(std::integral auto value) { return value; }
std::string filled(std::string_view words, const auto&... values) {
  return fmt::format(fmt::runtime(words), shown(values)...);
}

class Checker : public FieldWalk<Checker> {
 public:
  Checker(const SceneFacts& facts, std::vector<SceneIssue>& issues) : facts_(facts), issues_(issues) {}

  const SceneFacts& facts() const { return facts_; }
  void issue(const std::string& path, const std::string& message) { issues_.push_back({path, message}); }
  void warning(const std::string& path, const std::string& message) { issues_.push_back({path, message, true}); }
  // The same about a field of the object, or about the object if the key is "".
  void refuse(std::string_view key, std::string_view words, const auto&... values) {
    issue(key.empty() ? path() : path(key), filled(words, values...));
  }
  void warn(std::string_view key, std::string_view words, const auto&... values) {
    warning(path(key), filled(words, values...));
  }

  // Checks an object's fields, then their meaning together.
  void check(const auto& value) { visit(value); }
  void left(const auto& value) { check_meaning(*this, value); }

  void name(std::string_view key, const std::string& value, const FieldInfo& info);
  void reference(std::string_view key, const std::string& value, ElementKind what, const FieldInfo& info);
  void references(std::string_view key, const std::vector<std::string>& values, ElementKind what,
                  const FieldInfo& info);
  void word(std::string_view key, const std::string& value, const Words& words, const FieldInfo& info);
  const TypeRow* type(std::string_view key, std::string_view current, std::span<const TypeRow> rows,
                      const FieldInfo& info);

  using FieldWalk::point;
  void point(std::string_view key, const std::optional<PointField>& value, const std::string& body,
             const FieldInfo& info);
  void named_point(const std::string& path, const std::string& body, const std::string& name);
  void defined_point(const std::string& path, const std::string& name);
  void formula(const std::string& path, const Expression& value, Scope names, const FieldInfo& info) {
    check_expression(path, value, names, info.dimension);
  }
  using FieldWalk::expression;
  void expression(std::string_view key, const Expression& value, Scope names, const FieldInfo& info);
  void time_law(std::string_view key, const Expression& value, const std::optional<SampledLaw>& samples,
                const FieldInfo& info);

  template <class T>
  void plain(std::string_view key, const T& value, const Range& range, const FieldInfo&) {
    if constexpr (!std::is_same_v<T, bool>) check_number(path(key), static_cast<double>(value), range);
  }
  template <class T>
  void plain(std::string_view key, const std::optional<T>& value, const Range& range, const FieldInfo& info) {
    if (value) plain(key, *value, range, info);
  }
  void level(std::string_view key, const std::optional<double>& value, const auto&, const Range& range,
             const FieldInfo& info) {
    plain(key, value, range, info);
  }
  void numbers(std::string_view key, const std::vector<double>& values, const Range& range, const FieldInfo& info);
  void values_of(std::string_view key, const std::vector<std::pair<std::string, double>>& values, ElementKind what,
                 const Range& range, const FieldInfo& info);
  void tolerance(std::string_view key, double value, const std::optional<KindTolerances>& kinds, const FieldInfo& info);

  // Checks a field at any path.
  void check_expression(const std::string& path, const Expression& value, Scope names,
                        const std::optional<Dimension>& expected);
  void must_be_identifier(const std::string& path, const std::string& name);
  void must_be_readable(const std::string& path, const std::string& name);  // short, and shown as it is written

 private:
  void check_reference(const std::string& path, const std::string& value, ElementKind what);
  void check_number(const std::string& at, double value, const Range& range);
  bool names_are_known(const std::string& path, const Expression& value, Scope names);
  void check_size(const std::string& where, const Expression& value);
  void check_sensors_of_state(const std::string& path, const Expression& value);
  void check_dimension(const std::string& path, const Expression& value, Scope names,
                       const std::optional<Dimension>& expected);
  void ask_for_degrees(const std::string& path, const Expression& value, Scope names, const Dimension& expected);

  const SceneFacts& facts_;
  std::vector<SceneIssue>& issues_;
};

template <class T>
void check_meaning(Checker&, const T&) {}  // most objects are right when their fields are
void check_meaning(Checker& checker, const Parameter& parameter);
void check_meaning(Checker& checker, const Body& body);
void check_meaning(Checker& checker, const InertiaField& inertia);
void check_meaning(Checker& checker, const EulerParametersField& orientation);
void check_meaning(Checker& checker, const AxisAngleField& orientation);
void check_meaning(Checker& checker, const Joint& joint);
void check_meaning(Checker& checker, const SampledLaw& law);
void check_meaning(Checker& checker, const Signal& signal);
void check_meaning(Checker& checker, const Drive& drive);
void check_meaning(Checker& checker, const Force& force);
void check_meaning(Checker& checker, const Sensor& sensor);
void check_meaning(Checker& checker, const Condition& condition);
void check_meaning(Checker& checker, const Limit& limit);
void check_meaning(Checker& checker, const IntegratorOptions& options);
void check_meaning(Checker& checker, const IntegratorSettings& settings);
void check_meaning(Checker& checker, const SimulationSettings& settings);
void check_meaning(Checker& checker, const Scene& scene);

// Checks the units of samples.
void check_units(Checker& checker, const SampleColumn& samples);
// Checks samples of a quantity: their unit fits, and an angle does not jump by a turn.
void check_quantity(Checker& checker, const SampleColumn& samples, const Dimension& quantity);

// Reports names that occur more than once in a list, at paths of(index).
template <class T, class PathOf>
void check_unique_names(Checker& checker, const std::vector<T>& all, std::string_view what, PathOf&& path_of) {
  std::map<std::string, std::size_t> first;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto [it, is_new] = first.emplace(all[i].name, i);
    if (!is_new)
      checker.issue(path_of(i), filled("there is already {} '{}', {}; names must be unique", what, all[i].name,
                                       path_of(it->second)));
  }
}

}  // namespace mbsopt
