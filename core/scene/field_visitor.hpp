// The visitor (core/scene/vocabulary.hpp) that finds the expressions and the points of an object, for whoever asks on
// what it depends.
#pragma once

#include <utility>

#include "core/scene/vocabulary.hpp"

namespace mbsopt {

// on_expression(const Expression&, Names);  on_point(const std::string& body, const std::string& name) for points that
// are referred to by name. Of a body, its named points and its drawing are left out: they matter where they are used.
template <class OnExpression, class OnPoint>
class FieldVisitor {
 public:
  FieldVisitor(OnExpression on_expression, OnPoint on_point)
      : on_expression_(std::move(on_expression)), on_point_(std::move(on_point)) {}

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
  void number(std::string_view, const Field& value, const Says& says) {
    if (says.need != Need::unknown) on_expression_(value, Names::none);
  }
  void number(std::string_view, const std::optional<Field>& value, const Says&) {
    if (value) on_expression_(*value, Names::none);
  }
  void vector(std::string_view, const VectorField& value, const Says&) {
    for (const Field& field : value) on_expression_(field, Names::none);
  }
  void point(std::string_view key, const PointField& value, const std::string& body, const Says& says) {
    if (says.need == Need::unknown) return;
    if (const auto* given = std::get_if<VectorField>(&value))
      vector(key, *given, says);
    else
      on_point_(body, std::get<std::string>(value));
  }
  void point(std::string_view key, const std::optional<PointField>& value, const std::string& body, const Says& says) {
    if (value) point(key, *value, body, says);
  }
  void inertia(std::string_view, const InertiaField& value, const Says&) { describe(*this, value); }
  void orientation(std::string_view, const OrientationField& value, const Says&) {
    if (const auto* e = std::get_if<EulerParametersField>(&value)) {
      for (const Field& field : e->e) on_expression_(field, Names::none);
    } else if (const auto* a = std::get_if<AxisAngleField>(&value)) {
      describe(*this, *a);
    } else {
      describe(*this, std::get<RollPitchYawField>(value));
    }
  }
  void points(std::string_view, const std::map<std::string, VectorField>&, const Says&) {}
  void law(std::string_view, const std::optional<Expression>& value, Names names, const Says&) {
    if (value) on_expression_(*value, names);
  }
  void expression(std::string_view, const Expression& value, Names names, const Says&) { on_expression_(value, names); }
  void time_law(std::string_view, const Expression& value, const std::optional<SampledLaw>& samples, const Says&) {
    if (!samples) on_expression_(value, Names::time_law);
  }
  void laws(std::string_view, const LawVector& values, Names names, const Says&) {
    for (const Expression& value : values) on_expression_(value, names);
  }
  void plain(std::string_view, const auto&, const Range&, const Says&) {}
  void numbers(std::string_view, const std::vector<double>&, const Range&, const Says&) {}
  void overrides(std::string_view, const std::vector<std::pair<std::string, double>>&, const Says&) {}
  template <class T>
  void object(std::string_view, const T& value, const Says&) {
    describe(*this, value);
  }
  template <class T>
  void object(std::string_view, const std::optional<T>& value, const Says&) {
    if (value) describe(*this, *value);
  }
  void group(std::string_view, const Says&, auto&& fields) { fields(*this); }
  template <class T>
  void list(std::string_view, const std::vector<T>& values, const Says&) {
    if constexpr (!std::is_same_v<T, Shape>)
      for (const T& value : values) describe(*this, value);
  }
  template <class T>
  void named(std::string_view, const std::vector<T>& values, const Says&) {
    for (const T& value : values) describe(*this, value);
  }
  void version(std::string_view, int, const Says&) {}
  void later(std::string_view, std::string_view) {}
  void rest_unknown() {}

 private:
  OnExpression on_expression_;
  OnPoint on_point_;
};

}  // namespace mbsopt
