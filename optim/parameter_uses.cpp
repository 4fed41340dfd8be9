#include "optim/parameter_uses.hpp"

#include <algorithm>
#include <functional>

#include "core/scene/scene_facts.hpp"
#include "core/scene/scene_path.hpp"
#include "optim/problem_vocabulary.hpp"

namespace mbsopt {
namespace {

using OnField = std::function<void(const std::string& path, const Expression&, Names)>;

// The visitor (core/scene/vocabulary.hpp) that tells every expression with its place.
class FieldPaths {
 public:
  FieldPaths(std::string path, const OnField& on_field) : path_(std::move(path)), on_field_(on_field) {}

  void name(std::string_view, const std::string&, const Says&) {}
  void text(std::string_view, const std::string&, const Says&) {}
  void reference(std::string_view, const std::string&, To, const Says&) {}
  void references(std::string_view, const std::vector<std::string>&, To, const Says&) {}
  void word(std::string_view, const std::string&, const Words&, const Says&) {}
  template <class T, std::size_t N>
  void choice(std::string_view, const T&, const Choice<T> (&)[N], const Says&) {}
  const TypeRow* type(std::string_view, std::string_view current, std::span<const TypeRow> rows, std::string_view,
                      const Says&) {
    return find_row(rows, current);
  }
  void number(std::string_view key, const Field& value, const Says& says) {
    if (says.need != Need::unknown) on_field_(at(key), value, Names::none);
  }
  void number(std::string_view key, const std::optional<Field>& value, const Says&) {
    if (value) on_field_(at(key), *value, Names::none);
  }
  void vector(std::string_view key, const VectorField& value, const Says&) { all(at(key), value, Names::none); }
  void point(std::string_view key, const PointField& value, const std::string&, const Says& says) {
    if (const auto* given = std::get_if<VectorField>(&value); given && says.need != Need::unknown)
      all(at(key), *given, Names::none);
  }
  void point(std::string_view key, const std::optional<PointField>& value, const std::string& body, const Says& says) {
    if (value) point(key, *value, body, says);
  }
  void inertia(std::string_view key, const InertiaField& value, const Says&) { inside(key, value); }
  void orientation(std::string_view key, const OrientationField& value, const Says&) {
    if (const auto* e = std::get_if<EulerParametersField>(&value))
      all(at(key), e->e, Names::none);
    else if (const auto* a = std::get_if<AxisAngleField>(&value))
      inside(key, *a);
    else
      inside(key, std::get<RollPitchYawField>(value));
  }
  void points(std::string_view key, const std::map<std::string, VectorField>& value, const Says&) {
    for (const auto& [name, coordinates] : value) all(child_path(at(key), name), coordinates, Names::none);
  }
  void law(std::string_view key, const std::optional<Expression>& value, Names names, const Says&) {
    if (value) on_field_(at(key), *value, names);
  }
  void laws(std::string_view key, const LawVector& values, Names names, const Says&) { all(at(key), values, names); }
  void expression(std::string_view key, const Expression& value, Names names, const Says&) {
    on_field_(at(key), value, names);
  }
  void time_law(std::string_view key, const Expression& value, const std::optional<SampledLaw>& samples, const Says&) {
    if (!samples) on_field_(at(key), value, Names::time_law);
  }
  void plain(std::string_view, const auto&, const Range&, const Says&) {}
  void numbers(std::string_view, const std::vector<double>&, const Range&, const Says&) {}
  void overrides(std::string_view, const std::vector<std::pair<std::string, double>>&, const Says&) {}
  template <class T>
  void object(std::string_view key, const T& value, const Says&) {
    inside(key, value);
  }
  template <class T>
  void object(std::string_view key, const std::optional<T>& value, const Says&) {
    if (value) inside(key, *value);
  }
  void group(std::string_view key, const Says&, auto&& fields) {
    FieldPaths visitor(at(key), on_field_);
    fields(visitor);
  }
  template <class T>
  void list(std::string_view key, const std::vector<T>& values, const Says&) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      FieldPaths visitor(child_path(at(key), i), on_field_);
      describe(visitor, values[i]);
    }
  }
  template <class T>
  void named(std::string_view key, const std::vector<T>& values, const Says&) {
    for (const T& value : values) {
      FieldPaths visitor(child_path(at(key), value.name), on_field_);
      if constexpr (!std::is_same_v<T, Definition>) describe(visitor, value);  // counted where it is used
    }
  }
  void version(std::string_view, int, const Says&) {}
  void later(std::string_view, std::string_view) {}
  void rest_unknown() {}

 private:
  std::string at(std::string_view key) const { return child_path(path_, key); }
  template <class T>
  void inside(std::string_view key, const T& value) {
    FieldPaths visitor(at(key), on_field_);
    describe(visitor, value);
  }
  void all(const std::string& path, const auto& values, Names names) {
    for (std::size_t i = 0; i < values.size(); ++i) on_field_(child_path(path, i), values[i], names);
  }

  std::string path_;
  const OnField& on_field_;
};

}  // namespace

std::vector<ParameterUse> parameter_uses(const Problem& problem) {
  const SceneFacts facts(problem.scene);
  std::vector<ParameterUse> uses;
  for (const Parameter& p : problem.scene.parameters) uses.push_back({p.name, {}});
  const OnField on_field = [&](const std::string& path, const Expression& expression, Names names) {
    if (expression.is_number()) return;
    const Symbols& symbols = facts.symbols(names);
    const Program program(expression, symbols);
    for (const int input : program.used_inputs()) {
      if (input < static_cast<int>(uses.size())) uses[static_cast<std::size_t>(input)].fields.push_back(path);
    }
  };
  FieldPaths visitor("", on_field);
  describe(visitor, problem);
  return uses;
}

}  // namespace mbsopt
