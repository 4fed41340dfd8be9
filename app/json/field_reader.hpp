// The visitor that fills a problem from nodes (core/scene/vocabulary.hpp lists the fields). It checks shapes and
// syntax; other checks on the finished problem find wrong meanings.
#pragma once

#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/json/findings.hpp"
#include "app/json/node.hpp"
#include "optim/problem/problem_vocabulary.hpp"

namespace mbsopt::inline app {

class FieldReader {
 public:
  FieldReader(const Node& node, std::string path, Findings& findings)
      : node_(node), path_(std::move(path)), findings_(findings) {}

  // Reads an object's fields into `value`, and reports the keys that it does not have.
  template <class T>
  static void read(const Node& node, const std::string& path, Findings& findings, T& value) {
    if (node.kind != Node::Kind::object) {
      findings.add(node, path, "must be an object {...}, found " + what_is(node));
      return;
    }
    FieldReader reader(node, path, findings);
    describe(reader, value);
    reader.report_keys();
  }

  void name(std::string_view key, std::string& value, const FieldInfo& info) { text(key, value, info); }
  void text(std::string_view key, std::string& value, const FieldInfo& info);
  void texts(std::string_view key, std::vector<std::string>& values, const FieldInfo& info);
  void reference(std::string_view key, std::string& value, ElementKind, const FieldInfo& info);
  void references(std::string_view key, std::vector<std::string>& values, ElementKind, const FieldInfo& info);
  void reference_or(std::string_view key, std::string& value, ElementKind to, const FieldInfo& info, auto&& fields) {
    const Node* const node = node_.find(key);
    if (!node || node->kind != Node::Kind::object) return reference(key, value, to, info);
    group(key, info, [&](FieldReader& inside) {
      inside.reference(kObjectiveKey, value, to, {info.description, Need::required});
      fields(inside);
    });
  }
  void word(std::string_view key, std::string& value, const Words& words, const FieldInfo& info);
  template <class T, std::size_t N>
  void choice(std::string_view key, T& value, const Choice<T> (&choices)[N], const FieldInfo& info);
  const TypeRow* type(std::string_view key, std::string_view, std::span<const TypeRow> rows, const FieldInfo& info);

  void number(std::string_view key, Field& value, const FieldInfo& info);
  void number(std::string_view key, std::optional<Field>& value, const FieldInfo& info);
  void vector(std::string_view key, VectorField& value, const FieldInfo& info);
  void point(std::string_view key, PointField& value, std::string_view, const FieldInfo& info);
  void point(std::string_view key, std::optional<PointField>& value, std::string_view, const FieldInfo& info);
  void inertia(std::string_view key, InertiaField& tensor, std::optional<ConsistentInertiaField>& consistent,
               const FieldInfo& info);
  void orientation(std::string_view key, OrientationField& value, const FieldInfo& info);
  void points(std::string_view key, std::map<std::string, VectorField>& value, const FieldInfo& info);
  void law(std::string_view key, std::optional<Expression>& value, Scope, const FieldInfo& info) {
    number(key, value, info);
  }
  void expression(std::string_view key, Expression& value, Scope, const FieldInfo& info) { number(key, value, info); }
  void time_law(std::string_view key, Expression& value, std::optional<SampledLaw>& samples, const FieldInfo& info);
  void laws(std::string_view key, LawVector& value, Scope, const FieldInfo& info) { vector(key, value, info); }

  void plain(std::string_view key, double& value, const Range&, const FieldInfo& info);
  void plain(std::string_view key, int& value, const Range&, const FieldInfo& info);
  void plain(std::string_view key, long& value, const Range&, const FieldInfo& info);
  void plain(std::string_view key, bool& value, const Range&, const FieldInfo& info);
  template <class T>
  void plain(std::string_view key, std::optional<T>& value, const Range& range, const FieldInfo& info) {
    T given{};
    if (!has(key)) return skip(key, info);
    plain(key, given, range, info);
    value = given;
  }
  template <std::size_t N>
  void level(std::string_view key, std::optional<double>& value, const Choice<double> (&choices)[N], const Range& range,
             const FieldInfo& info) {
    level(key, value, std::span<const Choice<double>>(choices), range, info);
  }
  void level(std::string_view key, std::optional<double>& value, std::span<const Choice<double>> choices, const Range&,
             const FieldInfo& info);
  void instead_of(std::string_view key, std::string_view object, const Words& fields);
  void numbers(std::string_view key, std::vector<double>& values, const Range&, const FieldInfo& info);
  void values_of(std::string_view key, std::vector<std::pair<std::string, double>>& values, ElementKind, const Range&,
                 const FieldInfo& info);
  void tolerance(std::string_view key, double& value, std::optional<KindTolerances>& kinds, const FieldInfo& info);

  template <class T>
  void object(std::string_view key, T& value, const FieldInfo& info) {
    if (const Node* node = get(key, info)) read(*node, inside(key), findings_, value);
  }
  template <class T>
  void object(std::string_view key, std::optional<T>& value, const FieldInfo& info) {
    if (const Node* node = get(key, info)) read(*node, inside(key), findings_, value.emplace());
  }
  template <class F>
  void group(std::string_view key, const FieldInfo& info, F&& fields) {
    const Node* const node = get_kind(key, info, Node::Kind::object);
    if (!node) return;
    FieldReader reader(*node, inside(key), findings_);
    fields(reader);
    reader.report_keys();
  }
  template <class T>
  void list(std::string_view key, std::vector<T>& values, const FieldInfo& info) {
    const Node* const node = get_kind(key, info, Node::Kind::array);
    if (!node) return;
    for (std::size_t i = 0; i < node->items.size(); ++i)
      read(node->items[i], child_path(inside(key), i), findings_, values.emplace_back());
  }
  template <class T>
  void named(std::string_view key, std::vector<T>& values, const FieldInfo& info) {
    const Node* const node = get_kind(key, info, Node::Kind::object);
    if (!node) return;
    for (std::size_t i = 0; i < node->keys.size(); ++i) {
      T& value = values.emplace_back();
      value.name = node->keys[i];
      read_named(node->items[i], child_path(inside(key), node->keys[i]), value);
    }
  }

  void version(std::string_view key, int only, const FieldInfo& info);
  void later(std::string_view key, std::string_view what);
  void misplaced(std::string_view key, std::string_view where);
  void rest_unknown() { rest_unknown_ = true; }
  // Reports, at the end of an object, unknown keys and missing required ones. An unknown key that resembles a missing
  // one is one finding.
  void report_keys();

 private:
  bool has(std::string_view key) const { return node_.find(key) != nullptr; }
  std::string inside(std::string_view key) const { return child_path(path_, key); }
  struct Missing {
    std::string key, message;
  };
  const Missing* missing_like(const std::string& unknown) const;
  void skip(std::string_view key, const FieldInfo& info) { get(key, info); }
  void refuse(std::string_view key, const std::string& message);  // reports a given key

  // Returns the value of a key, which is known from now on. If it is absent, it returns nullptr and reports a required
  // one.
  const Node* get(std::string_view key, const FieldInfo& info);
  const Node* get_kind(std::string_view key, const FieldInfo& info, Node::Kind kind);

  template <class T>
  void read_named(const Node& node, const std::string& path, T& value) {
    read(node, path, findings_, value);
  }
  void read_named(const Node& node, const std::string& path, Parameter& value);
  void read_named(const Node& node, const std::string& path, Definition& value);
  void read_named(const Node& node, const std::string& path, TermParameter& value);
  void take_unit(const Node& node, const std::string& path, Parameter& parameter);

  bool read_expression(const Node& node, const std::string& path, Expression& value);
  bool read_plain(const Node& node, const std::string& path, double& value, const std::optional<Dimension>& expected);
  template <class Integer>
  void read_integer(const Node& node, const std::string& path, Integer& value);
  template <std::size_t N>
  bool read_vector(const Node& node, const std::string& path, std::array<Field, N>& value);
  bool read_point(const Node& node, const std::string& path, PointField& value);
  bool read_string(const Node& node, const std::string& path, std::string& value);

  const Node& node_;
  std::string path_;
  Findings& findings_;
  std::vector<std::string> known_;
  std::vector<Missing> missing_;
  bool rest_unknown_ = false;
};

template <class T, std::size_t N>
void FieldReader::choice(std::string_view key, T& value, const Choice<T> (&choices)[N], const FieldInfo& info) {
  const Node* const node = get(key, info);
  std::string given;
  if (!node) return;
  const bool has_truth = std::ranges::find(choices, "true", &Choice<T>::word) != std::end(choices);
  if (node->kind == Node::Kind::boolean && has_truth)
    given = node->boolean ? "true" : "false";
  else if (!read_string(*node, inside(key), given))
    return;
  std::vector<std::string> available;
  for (const Choice<T>& choice : choices) {
    if (choice.word == given) {
      value = choice.value;
      return;
    }
    available.emplace_back(choice.word);
  }
  findings_.add(*node, inside(key), not_among(key, given, available));
}

}  // namespace mbsopt::inline app
