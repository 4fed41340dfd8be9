// Visitors (core/scene/vocabulary.hpp) of objects that they do not change. FieldWalk goes through all fields and knows
// their places. FieldVisitor, made of it, finds the expressions of an object, its points, and the names of other
// objects. It serves functions that ask what the object depends on.
#pragma once

#include <string>
#include <utility>

#include "core/scene/scene_path.hpp"
#include "core/scene/vocabulary.hpp"

namespace mbsopt {

// A visitor derives from FieldWalk<itself>. It gets each expression by formula(path, expression, names, info). It
// declares again the functions of other fields that it asks for, and left(object), which follows an object's fields.
template <class Visitor>
class FieldWalk {
 public:
  using Key = std::string_view;

  explicit FieldWalk(std::string path = "") : path_(std::move(path)) {}
  const std::string& path() const { return path_; }  // of the object whose fields are visited
  std::string path(Key key) const { return child_path(path_, key); }

  void name(Key, const std::string&, const FieldInfo&) {}
  void text(Key, const std::string&, const FieldInfo&) {}
  void texts(Key, const std::vector<std::string>&, const FieldInfo&) {}
  void reference(Key, const std::string&, ElementKind, const FieldInfo&) {}
  void references(Key, const std::vector<std::string>&, ElementKind, const FieldInfo&) {}
  void word(Key, const std::string&, const Words&, const FieldInfo&) {}
  void choice(Key, const auto&, const auto&, const FieldInfo&) {}
  void plain(Key, const auto&, const Range&, const FieldInfo&) {}
  void level(Key, const std::optional<double>&, const auto&, const Range&, const FieldInfo&) {}
  void instead_of(Key, Key, const Words&) {}
  void numbers(Key, const std::vector<double>&, const Range&, const FieldInfo&) {}
  void values_of(Key, const std::vector<std::pair<std::string, double>>&, ElementKind, const Range&, const FieldInfo&) {
  }
  void tolerance(Key, double, const std::optional<KindTolerances>&, const FieldInfo&) {}
  void version(Key, int, const FieldInfo&) {}
  void misplaced(Key, Key) {}
  void rest_unknown() {}
  void named_point(const std::string&, const std::string&, const std::string&) {}  // path, body and name of its point
  void defined_point(const std::string&, const std::string&) {}                    // path and name
  void left(const auto&) {}

  const TypeRow* type(Key, Key current, std::span<const TypeRow> rows, const FieldInfo&) {
    return find_row(rows, current);
  }
  void number(Key key, const Field& value, const FieldInfo& info) {
    if (info.need != Need::unknown) own().formula(path(key), value, Scope::none, info);
  }
  void number(Key key, const std::optional<Field>& value, const FieldInfo& info) {
    if (value) number(key, *value, info);
  }
  void vector(Key key, const VectorField& value, const FieldInfo& info) {
    formulas(path(key), value, Scope::none, info);
  }
  void point(Key key, const PointField& value, const std::string& body, const FieldInfo& info) {
    if (info.need == Need::unknown) return;
    if (const auto* given = std::get_if<VectorField>(&value))
      formulas(path(key), *given, Scope::none, info);
    else
      own().named_point(path(key), body, std::get<std::string>(value));
  }
  void point(Key key, const std::optional<PointField>& value, const std::string& body, const FieldInfo& info) {
    if (value) point(key, *value, body, info);
  }
  void inertia(Key key, const InertiaField& tensor, const std::optional<ConsistentInertiaField>& consistent,
               const FieldInfo&) {
    consistent ? visit(child_path(path(key), "consistent"), *consistent) : visit(path(key), tensor);
  }
  void orientation(Key key, const OrientationField& value, const FieldInfo&) {
    std::visit([&](const auto& form) { visit(path(key), form); }, value);
  }
  void points(Key key, const std::map<std::string, VectorField>& value, const FieldInfo& info) {
    for (const auto& [name, coordinates] : value) {
      own().defined_point(child_path(path(key), name), name);
      formulas(child_path(path(key), name), coordinates, Scope::none, info);
    }
  }
  void expression(Key key, const Expression& value, Scope names, const FieldInfo& info) {
    own().formula(path(key), value, names, info);
  }
  void expression(Key key, const std::optional<Expression>& value, Scope names, const FieldInfo& info) {
    if (value) own().expression(key, *value, names, info);
  }
  void time_law(Key key, const Expression& value, const std::optional<SampledLaw>& samples, const FieldInfo& info) {
    if (!samples) own().formula(path(key), value, Scope::time_law, info);
  }
  void laws(Key key, const LawVector& values, Scope names, const FieldInfo& info) {
    formulas(path(key), values, names, info);
  }

  template <class T>
  void object(Key key, const T& value, const FieldInfo&) {
    visit(path(key), value);
  }
  template <class T>
  void object(Key key, const std::optional<T>& value, const FieldInfo&) {
    if (value) visit(path(key), *value);
  }
  void group(Key key, const FieldInfo&, auto&& fields) {
    below(path(key), [&] { fields(own()); });
  }
  void reference_or(Key key, const std::string& value, ElementKind what, const FieldInfo& info, auto&& fields) {
    own().reference(key, value, what, info);
    group(key, info, fields);
  }
  void list(Key key, const auto& values, const FieldInfo&) {
    for (std::size_t i = 0; i < values.size(); ++i) visit(child_path(path(key), i), values[i]);
  }
  template <class T>
  void named(Key key, const std::vector<T>& values, const FieldInfo&) {
    for (const T& value : values) {
      const std::string place = child_path(path(key), value.name);
      if constexpr (std::is_same_v<T, Definition> || std::is_same_v<T, TermParameter>)
        own().formula(place, value.value, Scope::none, {});
      else
        visit(place, value);
    }
  }

  // Visits an object at this path.
  void visit(const auto& value) {
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, EulerParametersField>)  // a list in the file
      formulas(path_, value.e, Scope::none, {"", Need::required, Dimension{}});
    else
      describe(own(), value);
    own().left(value);
  }

 protected:
  void visit(std::string path, const auto& value) {
    below(std::move(path), [&] { visit(value); });
  }
  void below(std::string path, auto&& visit_fields) {
    std::swap(path_, path);
    visit_fields();
    std::swap(path_, path);
  }
  void formulas(const std::string& path, const auto& values, Scope names, const FieldInfo& info) {
    for (std::size_t i = 0; i < values.size(); ++i) own().formula(child_path(path, i), values[i], names, info);
  }

 private:
  Visitor& own() { return static_cast<Visitor&>(*this); }

  std::string path_;
};

struct FieldPlace {
  const std::string& path;  // "bodies[2].mass", below the path that the visit began at
  // A body's named points count where they are used. Nothing that is computed depends on its drawing.
  bool in_named_point = false, in_drawing = false;
};

// on_expression(const FieldPlace&, const Expression&, Names), on_point(const std::string& body, const std::string&
// name) for points that are used by name, and on_reference(To, const std::string& name). Definitions are left out: they
// count where they are used.
template <class OnExpression, class OnPoint, class OnReference = decltype([](ElementKind, const std::string&) {})>
class FieldVisitor : public FieldWalk<FieldVisitor<OnExpression, OnPoint, OnReference>> {
  using Walk = FieldWalk<FieldVisitor>;
  using Key = std::string_view;

 public:
  FieldVisitor(OnExpression on_expression, OnPoint on_point, OnReference on_reference = {})
      : on_expression_(std::move(on_expression)),
        on_point_(std::move(on_point)),
        on_reference_(std::move(on_reference)) {}

  void formula(const std::string& path, const Expression& value, Scope names, const FieldInfo&) {
    on_expression_(FieldPlace{path, in_named_point_, in_drawing_}, value, names);
  }
  void reference(Key, const std::string& name, ElementKind to, const FieldInfo& info) {
    if (info.need != Need::unknown) on_reference_(to, name);
  }
  void references(Key, const std::vector<std::string>& names, ElementKind to, const FieldInfo&) {
    for (const std::string& name : names) on_reference_(to, name);
  }
  void reference_or(Key, const std::string&, ElementKind, const FieldInfo&, auto&&) {}
  void named_point(const std::string&, const std::string& body, const std::string& name) {
    if (!in_drawing_) on_point_(body, name);
  }
  void points(Key key, const std::map<std::string, VectorField>& value, const FieldInfo& info) {
    in_named_point_ = true;
    Walk::points(key, value, info);
    in_named_point_ = false;
  }
  template <class T>
  void list(Key key, const std::vector<T>& values, const FieldInfo& info) {
    in_drawing_ = std::is_same_v<T, Shape>;
    Walk::list(key, values, info);
    in_drawing_ = false;
  }
  template <class T>
  void named(Key key, const std::vector<T>& values, const FieldInfo& info) {
    if constexpr (!std::is_same_v<T, Definition>) Walk::named(key, values, info);
  }

 private:
  OnExpression on_expression_;
  OnPoint on_point_;
  OnReference on_reference_;
  bool in_named_point_ = false, in_drawing_ = false;
};

}  // namespace mbsopt
