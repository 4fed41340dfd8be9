// The visitor (core/scene/vocabulary.hpp) that finds the expressions of an object with their places, its points, and
// the names of other objects. It serves functions that ask what the object depends on.
#pragma once

#include <string>
#include <utility>

#include "core/scene/scene_path.hpp"
#include "core/scene/vocabulary.hpp"

namespace mbsopt {

struct FieldPlace {
  const std::string& path;  // "bodies[2].mass", below the path that the visit began at
  // A body's named points count where they are used. Nothing that is computed depends on its drawing.
  bool in_named_point = false, in_drawing = false;
};

// on_expression(const FieldPlace&, const Expression&, Names), on_point(const std::string& body, const std::string&
// name) for points that are used by name, and on_reference(To, const std::string& name). Definitions are left out: they
// count where they are used.
template <class OnExpression, class OnPoint, class OnReference = decltype([](ElementKind, const std::string&) {})>
class FieldVisitor {
 public:
  FieldVisitor(OnExpression on_expression, OnPoint on_point, OnReference on_reference = {})
      : on_expression_(std::move(on_expression)),
        on_point_(std::move(on_point)),
        on_reference_(std::move(on_reference)) {}

  void name(std::string_view, const std::string&, const FieldInfo&) {}
  void text(std::string_view, const std::string&, const FieldInfo&) {}
  void texts(std::string_view, const std::vector<std::string>&, const FieldInfo&) {}
  void reference(std::string_view, const std::string& name, ElementKind to, const FieldInfo& info) {
    if (info.need != Need::unknown) on_reference_(to, name);
  }
  void references(std::string_view, const std::vector<std::string>& names, ElementKind to, const FieldInfo&) {
    for (const std::string& name : names) on_reference_(to, name);
  }
  void reference_or(std::string_view, const std::string&, ElementKind, const FieldInfo&, auto&&) {}
  void word(std::string_view, const std::string&, const Words&, const FieldInfo&) {}
  template <class T, std::size_t N>
  void choice(std::string_view, const T&, const Choice<T> (&)[N], const FieldInfo&) {}
  const TypeRow* type(std::string_view, std::string_view current, std::span<const TypeRow> rows, const FieldInfo&) {
    return find_row(rows, current);
  }
  void number(std::string_view key, const Field& value, const FieldInfo& info) {
    if (info.need != Need::unknown) tell(at(key), value, Scope::none);
  }
  void number(std::string_view key, const std::optional<Field>& value, const FieldInfo&) {
    if (value) tell(at(key), *value, Scope::none);
  }
  void vector(std::string_view key, const VectorField& value, const FieldInfo&) {
    tell_all(at(key), value, Scope::none);
  }
  void point(std::string_view key, const PointField& value, const std::string& body, const FieldInfo& info) {
    if (info.need == Need::unknown) return;
    if (const auto* given = std::get_if<VectorField>(&value))
      tell_all(at(key), *given, Scope::none);
    else if (!in_drawing_)
      on_point_(body, std::get<std::string>(value));
  }
  void point(std::string_view key, const std::optional<PointField>& value, const std::string& body,
             const FieldInfo& info) {
    if (value) point(key, *value, body, info);
  }
  void inertia(std::string_view key, const InertiaField& tensor,
               const std::optional<ConsistentInertiaField>& consistent, const FieldInfo&) {
    if (consistent)
      visit(child_path(at(key), "consistent"), *consistent);
    else
      visit(at(key), tensor);
  }
  void orientation(std::string_view key, const OrientationField& value, const FieldInfo&) {
    if (const auto* e = std::get_if<EulerParametersField>(&value))
      tell_all(at(key), e->e, Scope::none);
    else if (const auto* a = std::get_if<AxisAngleField>(&value))
      visit(at(key), *a);
    else
      visit(at(key), std::get<RollPitchYawField>(value));
  }
  void points(std::string_view key, const std::map<std::string, VectorField>& value, const FieldInfo&) {
    in_named_point_ = true;
    for (const auto& [name, coordinates] : value) tell_all(child_path(at(key), name), coordinates, Scope::none);
    in_named_point_ = false;
  }
  void law(std::string_view key, const std::optional<Expression>& value, Scope names, const FieldInfo&) {
    if (value) tell(at(key), *value, names);
  }
  void expression(std::string_view key, const Expression& value, Scope names, const FieldInfo&) {
    tell(at(key), value, names);
  }
  void time_law(std::string_view key, const Expression& value, const std::optional<SampledLaw>& samples,
                const FieldInfo&) {
    if (!samples) tell(at(key), value, Scope::time_law);
  }
  void laws(std::string_view key, const LawVector& values, Scope names, const FieldInfo&) {
    tell_all(at(key), values, names);
  }
  void plain(std::string_view, const auto&, const Range&, const FieldInfo&) {}
  template <std::size_t N>
  void level(std::string_view, const std::optional<double>&, const Choice<double> (&)[N], const Range&,
             const FieldInfo&) {}
  void instead_of(std::string_view, std::string_view, const Words&) {}
  void numbers(std::string_view, const std::vector<double>&, const Range&, const FieldInfo&) {}
  void values_of(std::string_view, const std::vector<std::pair<std::string, double>>&, ElementKind, const Range&,
                 const FieldInfo&) {}
  void tolerance(std::string_view, double, const std::optional<KindTolerances>&, const FieldInfo&) {}
  template <class T>
  void object(std::string_view key, const T& value, const FieldInfo&) {
    visit(at(key), value);
  }
  template <class T>
  void object(std::string_view key, const std::optional<T>& value, const FieldInfo&) {
    if (value) visit(at(key), *value);
  }
  void group(std::string_view key, const FieldInfo&, auto&& fields) {
    below(at(key), [&] { fields(*this); });
  }
  template <class T>
  void list(std::string_view key, const std::vector<T>& values, const FieldInfo&) {
    in_drawing_ = std::is_same_v<T, Shape>;
    for (std::size_t i = 0; i < values.size(); ++i) visit(child_path(at(key), i), values[i]);
    in_drawing_ = false;
  }
  template <class T>
  void named(std::string_view key, const std::vector<T>& values, const FieldInfo&) {
    if constexpr (std::is_same_v<T, TermParameter>)
      for (const T& value : values) tell(child_path(at(key), value.name), value.value, Scope::none);
    else if constexpr (!std::is_same_v<T, Definition>)
      for (const T& value : values) visit(child_path(at(key), value.name), value);
  }
  void version(std::string_view, int, const FieldInfo&) {}
  void misplaced(std::string_view, std::string_view) {}
  void rest_unknown() {}

 private:
  std::string at(std::string_view key) const { return child_path(path_, key); }
  void tell(const std::string& path, const Expression& value, Scope names) {
    on_expression_(FieldPlace{path, in_named_point_, in_drawing_}, value, names);
  }
  void tell_all(const std::string& path, const auto& values, Scope names) {
    for (std::size_t i = 0; i < values.size(); ++i) tell(child_path(path, i), values[i], names);
  }
  void below(std::string path, auto&& tell_fields) {
    std::swap(path_, path);
    tell_fields();
    std::swap(path_, path);
  }
  template <class T>
  void visit(std::string path, const T& value) {
    below(std::move(path), [&] { describe(*this, value); });
  }

  OnExpression on_expression_;
  OnPoint on_point_;
  OnReference on_reference_;
  std::string path_;
  bool in_named_point_ = false, in_drawing_ = false;
};

}  // namespace mbsopt
