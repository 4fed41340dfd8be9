// The visitor (core/scene/vocabulary.hpp) that checks every field of a scene or problem: referenced names, expressions,
// dimensions, ranges. check_meaning() checks what only a whole object can show.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/scene/scene_facts.hpp"
#include "core/scene/scene_issue.hpp"
#include "core/scene/scene_path.hpp"
#include "core/scene/vocabulary.hpp"

namespace mbsopt {

// A number in a message: the shortest text that reads back as it.
std::string text_of(double value);

class Checker {
 public:
  Checker(const SceneFacts& facts, std::vector<SceneIssue>& issues, std::string path = "")
      : facts_(facts), issues_(issues), path_(std::move(path)) {}

  const SceneFacts& facts() const { return facts_; }
  const std::string& path() const { return path_; }
  std::string path(std::string_view key) const { return child_path(path_, key); }
  void issue(const std::string& path, const std::string& message) { issues_.push_back({path, message}); }
  void warning(const std::string& path, const std::string& message) { issues_.push_back({path, message, true}); }

  // Checks an object's fields, then their meaning together.
  template <class T>
  void check(const T& value) {
    describe(*this, value);
    check_meaning(*this, value);
  }

  void name(std::string_view key, const std::string& value, const FieldInfo& info);
  void text(std::string_view, const std::string&, const FieldInfo&) {}
  void texts(std::string_view, const std::vector<std::string>&, const FieldInfo&) {}
  void reference(std::string_view key, const std::string& value, ElementKind what, const FieldInfo& info);
  void references(std::string_view key, const std::vector<std::string>& values, ElementKind what,
                  const FieldInfo& info);
  void reference_or(std::string_view key, const std::string& value, ElementKind what, const FieldInfo& info,
                    auto&& fields) {
    reference(key, value, what, info);
    Checker inside = at(key);
    fields(inside);
  }
  void word(std::string_view key, const std::string& value, const Words& words, const FieldInfo& info);
  template <class T, std::size_t N>
  void choice(std::string_view, const T&, const Choice<T> (&)[N], const FieldInfo&) {}
  const TypeRow* type(std::string_view key, std::string_view current, std::span<const TypeRow> rows,
                      const FieldInfo& info);

  void number(std::string_view key, const Field& value, const FieldInfo& info);
  void number(std::string_view key, const std::optional<Field>& value, const FieldInfo& info);
  void vector(std::string_view key, const VectorField& value, const FieldInfo& info);
  void point(std::string_view key, const PointField& value, const std::string& body, const FieldInfo& info);
  void point(std::string_view key, const std::optional<PointField>& value, const std::string& body,
             const FieldInfo& info);
  void inertia(std::string_view key, const InertiaField& tensor,
               const std::optional<ConsistentInertiaField>& consistent, const FieldInfo&) {
    if (consistent)
      at(key).at("consistent").check(*consistent);
    else
      at(key).check(tensor);
  }
  void orientation(std::string_view key, const OrientationField& value, const FieldInfo&);
  void points(std::string_view key, const std::map<std::string, VectorField>& value, const FieldInfo& info);
  void law(std::string_view key, const std::optional<Expression>& value, Scope names, const FieldInfo& info);
  void expression(std::string_view key, const Expression& value, Scope names, const FieldInfo& info);
  void time_law(std::string_view key, const Expression& value, const std::optional<SampledLaw>& samples,
                const FieldInfo& info);
  void laws(std::string_view key, const LawVector& values, Scope names, const FieldInfo& info);

  template <class T>
  void plain(std::string_view key, const T& value, const Range& range, const FieldInfo&) {
    if constexpr (!std::is_same_v<T, bool>) check_number(path(key), static_cast<double>(value), range);
  }
  template <class T>
  void plain(std::string_view key, const std::optional<T>& value, const Range& range, const FieldInfo& info) {
    if (value) plain(key, *value, range, info);
  }
  template <std::size_t N>
  void level(std::string_view key, const std::optional<double>& value, const Choice<double> (&)[N], const Range& range,
             const FieldInfo& info) {
    plain(key, value, range, info);
  }
  void instead_of(std::string_view, std::string_view, const Words&) {}
  void numbers(std::string_view key, const std::vector<double>& values, const Range& range, const FieldInfo& info);
  void values_of(std::string_view key, const std::vector<std::pair<std::string, double>>& values, ElementKind what,
                 const Range& range, const FieldInfo& info);
  void tolerance(std::string_view key, double value, const std::optional<KindTolerances>& kinds, const FieldInfo& info);

  template <class T>
  void object(std::string_view key, const T& value, const FieldInfo&) {
    at(key).check(value);
  }
  template <class T>
  void object(std::string_view key, const std::optional<T>& value, const FieldInfo&) {
    if (value) at(key).check(*value);
  }
  template <class F>
  void group(std::string_view key, const FieldInfo&, F&& fields) {
    Checker inside = at(key);
    fields(inside);
  }
  template <class T>
  void list(std::string_view key, const std::vector<T>& values, const FieldInfo&) {
    for (std::size_t i = 0; i < values.size(); ++i) Checker(facts_, issues_, child_path(path(key), i)).check(values[i]);
  }
  template <class T>
  void named(std::string_view key, const std::vector<T>& values, const FieldInfo&) {
    for (const T& value : values) {
      Checker inside(facts_, issues_, child_path(path(key), value.name));
      if constexpr (std::is_same_v<T, Definition> || std::is_same_v<T, TermParameter>)
        inside.check_expression(inside.path(), value.value, Scope::none, {});
      else
        inside.check(value);
    }
  }
  void version(std::string_view, int, const FieldInfo&) {}
  void misplaced(std::string_view, std::string_view) {}
  void rest_unknown() {}

  // Checks a field at any path.
  void check_expression(const std::string& path, const Expression& value, Scope names,
                        const std::optional<Dimension>& expected);
  void check_size(const std::string& where, const Expression& value);
  void must_be_identifier(const std::string& path, const std::string& name);
  void must_be_readable(const std::string& path, const std::string& name);  // short, and shown as it is written

 private:
  Checker at(std::string_view key) const { return {facts_, issues_, path(key)}; }
  void check_reference(const std::string& path, const std::string& value, ElementKind what);
  void check_number(const std::string& at, double value, const Range& range);
  void check_vector(const std::string& path, const VectorField& value, const std::optional<Dimension>& expected);
  bool names_are_known(const std::string& path, const Expression& value, Scope names);
  void check_sensors_of_state(const std::string& path, const Expression& value);
  void check_dimension(const std::string& path, const Expression& value, Scope names,
                       const std::optional<Dimension>& expected);

  void ask_for_degrees(const std::string& path, const Expression& value, Scope names, const Dimension& expected);

  const SceneFacts& facts_;
  std::vector<SceneIssue>& issues_;
  std::string path_;
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
      checker.issue(path_of(i), "there is already " + std::string(what) + " '" + all[i].name + "', " +
                                    path_of(it->second) + "; names must be unique");
  }
}

}  // namespace mbsopt
