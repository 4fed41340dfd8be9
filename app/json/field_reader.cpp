#include "app/json/field_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <concepts>
#include <iterator>
#include <limits>
#include <type_traits>

#include "core/expression/did_you_mean.hpp"
#include "core/expression/dimension_inference.hpp"
#include "optim/problem/problem_vocabulary.hpp"

namespace mbsopt::inline app {
namespace {

PlacedNode of_kind(const PlacedNode& given, Node::Kind kind) {
  if (!given || given->kind == kind) return given;
  given.must_be(kind == Node::Kind::array ? "a list [...]" : "an object {...}");
  return {};
}

bool read_expression(const PlacedNode& given, Expression& value) {
  if (given->kind == Node::Kind::number) {
    value = Expression(given->number);
    return true;
  }
  if (given->kind != Node::Kind::string) {
    given.must_be("a number or an expression in a string");
    return false;
  }
  try {
    value = Expression::parse(given->string);
    return true;
  } catch (const ExpressionError& error) {
    given.refuse_inside(error.offset, error.what());
    return false;
  }
}

// Values that depend on no parameter.
bool read_plain(const PlacedNode& given, double& value, const std::optional<Dimension>& expected) {
  Expression expression;
  if (!read_expression(given, expression)) return false;
  const auto refuse = [&](const std::string& message) {
    given.refuse(message);
    return false;
  };
  if (!expression.is_number())
    return refuse("must be a number; '" + expression.names()[0] + "' is a name, which is not allowed here");
  if (!std::isfinite(expression.number())) return refuse("is " + expression.text() + ", which is not finite");
  try {
    const auto found = infer_dimension(expression, [](const std::string&) { return std::nullopt; });
    if (expected && !fits(found, *expected))
      return refuse("has the dimension " + to_string(*found) + ", expected is " + to_string(*expected));
  } catch (const DimensionError& error) {
    given.refuse_inside(error.offset, error.what());
    return false;
  }
  value = expression.number();
  return true;
}

void read_plain(const PlacedNode& given, std::integral auto& value, const std::optional<Dimension>&) {
  using Integer = std::remove_reference_t<decltype(value)>;
  double number = 0;
  if (!read_plain(given, number, Dimension{})) return;
  const bool is_whole = number == std::round(number);
  if (!is_whole || std::abs(number) > static_cast<double>(std::numeric_limits<Integer>::max() / 2))
    given.refuse((is_whole ? "is too large, " : "must be a whole number, found ") + Expression(number).text());
  else
    value = static_cast<Integer>(number);
}

void read_plain(const PlacedNode& given, bool& value, const std::optional<Dimension>&) {
  if (given->kind == Node::Kind::boolean)
    value = given->boolean;
  else
    given.must_be("true or false");
}

template <std::size_t N>
bool read_vector(const PlacedNode& given, std::array<Field, N>& value) {
  if (given->kind != Node::Kind::array || given->items.size() != N) {
    given.must_be("a list of " + std::to_string(N) + " numbers or expressions");
    return false;
  }
  bool good = true;
  Field* entry = value.data();
  for (const PlacedNode& item : given.items()) good = read_expression(item, *entry++) && good;
  return good;
}

void read_point(const PlacedNode& given, PointField& value) {
  if (given->kind == Node::Kind::string)
    value = given->string;
  else if (given->kind == Node::Kind::array)
    read_vector(given, value.emplace<VectorField>());
  else
    given.must_be("the name of a point or a list of 3 coordinates");
}

// A value with a unit has the meaning of "unit", and must not contradict it.
void take_unit(const PlacedNode& given, Parameter& parameter) {
  if (given->kind != Node::Kind::string) return;
  const auto found = infer_dimension(Expression::parse(given->string), [](const std::string&) { return std::nullopt; });
  if (!found || found->is_none()) return;
  if (parameter.unit.empty()) parameter.unit = to_string(*found);
  const std::optional<Unit> unit = parse_unit(parameter.unit);
  if (unit && !compatible(unit->dimension, *found))
    given.refuse("has the dimension " + to_string(*found) + ", that of the parameter is " + to_string(unit->dimension));
}

template <class T>
T& made(T& value) {
  return value;
}
template <class T>
T& made(std::optional<T>& value) {
  return value.emplace();
}

class FieldReader {
 public:
  explicit FieldReader(const PlacedNode& object) : object_(object) {}

  // Reads an object's fields into `value`, and reports the keys that it does not have.
  template <class T>
  static void read(const PlacedNode& given, T& value) {
    if (given->kind != Node::Kind::object) return given.must_be("an object {...}");
    FieldReader reader(given);
    describe(reader, value);
    reader.report_keys();
  }

  void name(std::string_view key, std::string& value, const FieldInfo& info) { text(key, value, info); }
  void text(std::string_view key, std::string& value, const FieldInfo& info) {
    if (const PlacedNode given = get(key, info)) read_string(given, value);
  }
  void texts(std::string_view key, std::vector<std::string>& values, const FieldInfo& info) {
    const PlacedNode given = get(key, info);
    if (!given) return;
    if (given->kind != Node::Kind::array) {
      read_string(given, values.emplace_back());
      return;
    }
    if (given->items.empty()) given.refuse("is empty; expected: " + std::string(info.description));
    for (const PlacedNode& item : given.items()) read_string(item, values.emplace_back());
  }
  void reference(std::string_view key, std::string& value, ElementKind, const FieldInfo& info) {
    const PlacedNode given = get(key, info);
    if (given && read_string(given, value) && value.empty())
      given.refuse("is empty; expected: " + std::string(info.description));
  }
  void references(std::string_view key, std::vector<std::string>& values, ElementKind, const FieldInfo& info) {
    const PlacedNode given = get_list(key, info);
    for (const PlacedNode& item : given.items()) read_string(item, values.emplace_back());
  }
  void reference_or(std::string_view key, std::string& value, ElementKind to, const FieldInfo& info, auto&& fields) {
    if (!has_object(key)) return reference(key, value, to, info);
    group(key, info, [&](FieldReader& inside) {
      inside.reference(kObjectiveKey, value, to, {info.description});
      fields(inside);
    });
  }
  void word(std::string_view key, std::string& value, const Words& allowed, const FieldInfo& info) {
    const PlacedNode given = get(key, info);
    if (given && read_string(given, value) && !has_word(allowed.available, value))
      given.refuse(not_among(key, value, words(allowed.available)));
  }
  template <class T, std::size_t N>
  void choice(std::string_view key, T& value, const Choice<T> (&choices)[N], const FieldInfo& info) {
    const PlacedNode given = get(key, info);
    std::string word;
    if (!given) return;
    const bool has_truth = std::ranges::find(choices, "true", &Choice<T>::word) != std::end(choices);
    if (given->kind == Node::Kind::boolean && has_truth)
      word = given->boolean ? "true" : "false";
    else if (!read_string(given, word))
      return;
    take(given, key, word, choices, value);
  }
  const TypeRow* type(std::string_view key, std::string_view, std::span<const TypeRow> rows, const FieldInfo& info) {
    const PlacedNode given = get(key, {info.description, Need::optional, {}});
    std::string name;
    if (given && !read_string(given, name)) return nullptr;
    const TypeRow* const row = given ? find_row(rows, name) : nullptr;
    if (row) return row;
    if (given)
      given.refuse(not_among(key, name, names_of(rows)));
    else
      missing_.push_back({std::string(key), "is missing; available: " + joined(names_of(rows))});
    object_.findings().add_elsewhere(object_.path());  // other requirements of the object depend on it
    return nullptr;
  }

  void number(std::string_view key, auto& value, const FieldInfo& info) {
    if (const PlacedNode given = get(key, info)) read_expression(given, made(value));
  }
  void vector(std::string_view key, VectorField& value, const FieldInfo& info) {
    if (const PlacedNode given = get(key, info)) read_vector(given, value);
  }
  void point(std::string_view key, auto& value, std::string_view, const FieldInfo& info) {
    if (const PlacedNode given = get(key, info)) read_point(given, made(value));
  }
  void inertia(std::string_view key, InertiaField& tensor, std::optional<ConsistentInertiaField>& consistent,
               const FieldInfo& info) {
    const PlacedNode given = get(key, info);
    if (!given) return;
    if (given->kind == Node::Kind::object) {
      const PlacedNode lengths = given.find("consistent");
      if (!lengths) return read(given, tensor);
      if (given->items.size() > 1)
        given.refuse("has \"consistent\" and other keys; \"consistent\" must be the only key");
      return read(lengths, consistent.emplace());
    }
    std::array<Field, 3> diagonal;
    if (given->kind != Node::Kind::array || given->items.size() != 3)
      given.must_be(
          "{\"xx\":..,\"yy\":..,\"zz\":..,\"xy\":..,\"xz\":..,\"yz\":..}, [xx, yy, zz] or "
          "{\"consistent\": {\"x\":..,\"y\":..,\"z\":..}}");
    else if (read_vector(given, diagonal))
      tensor = {diagonal[0], diagonal[1], diagonal[2], 0.0, 0.0, 0.0};
  }
  void orientation(std::string_view key, OrientationField& value, const FieldInfo& info) {
    const PlacedNode given = get(key, info);
    if (!given) return;
    const bool is_object = given->kind == Node::Kind::object;
    if (given->kind == Node::Kind::array && given->items.size() == 4)
      read_vector(given, value.emplace<EulerParametersField>().e);
    else if (is_object && (given->find("axis") || given->find("angle")))
      read(given, value.emplace<AxisAngleField>());
    else if (is_object && given->find("rpy"))
      read(given, value.emplace<RollPitchYawField>());
    else
      given.must_be("[e0, e1, e2, e3], {\"axis\": [x, y, z], \"angle\": a} or {\"rpy\": [r, p, y]}");
  }
  void points(std::string_view key, std::map<std::string, VectorField>& value, const FieldInfo& info) {
    const PlacedNode given = get_object(key, info);
    for (const PlacedNode& item : given.items()) read_vector(item, value[item.key()]);
  }
  void expression(std::string_view key, auto& value, Scope, const FieldInfo& info) { number(key, value, info); }
  void time_law(std::string_view key, Expression& value, std::optional<SampledLaw>& samples, const FieldInfo& info) {
    const PlacedNode given = get(key, info);
    if (given && given->kind == Node::Kind::object)
      read(given, samples.emplace());
    else if (given)
      read_expression(given, value);
  }
  void laws(std::string_view key, LawVector& value, Scope, const FieldInfo& info) { vector(key, value, info); }

  void plain(std::string_view key, auto& value, const Range&, const FieldInfo& info) {
    if (const PlacedNode given = get(key, info)) read_plain(given, made(value), info.dimension);
  }
  template <std::size_t N>
  void level(std::string_view key, std::optional<double>& value, const Choice<double> (&choices)[N], const Range&,
             const FieldInfo& info) {
    const PlacedNode given = get(key, info);
    if (!given) return;
    const std::string& word = given->string;  // "" of a number
    if (!word.empty() && std::isalpha(static_cast<unsigned char>(word[0])))
      take(given, key, word, choices, value, ", or a number");
    else
      read_plain(given, value.emplace(), info.dimension);
  }
  void instead_of(std::string_view key, std::string_view object, const Words& fields) {
    if (!object_->find(key) || !has_object(object)) return;
    const PlacedNode given = object_.find(object);
    for (const std::string& field : words(fields.available))
      if (const PlacedNode value = given.find(field))
        value.refuse(
            fmt::format("is chosen by {0}, and must not be given as well: leave out one of the two ({1} is left "
                        "out with --set {1}={{}})",
                        object_.find(key).path(), given.path()));
  }
  void numbers(std::string_view key, std::vector<double>& values, const Range&, const FieldInfo& info) {
    const PlacedNode given = get_list(key, info);
    for (const PlacedNode& item : given.items()) read_plain(item, values.emplace_back(0.0), info.dimension);
  }
  void values_of(std::string_view key, std::vector<std::pair<std::string, double>>& values, ElementKind, const Range&,
                 const FieldInfo& info) {
    const PlacedNode given = get_object(key, info);
    for (const PlacedNode& item : given.items())
      read_plain(item, values.emplace_back(item.key(), 0.0).second, std::nullopt);
  }
  void tolerance(std::string_view key, double& value, std::optional<KindTolerances>& kinds, const FieldInfo& info) {
    if (!has_object(key)) return plain(key, value, kPositive, info);
    object(key, kinds, info);
    if (kinds) value = kinds->smallest();
  }

  void object(std::string_view key, auto& value, const FieldInfo& info) {
    if (const PlacedNode given = get(key, info)) read(given, made(value));
  }
  void group(std::string_view key, const FieldInfo& info, auto&& fields) {
    const PlacedNode given = get_object(key, info);
    if (!given) return;
    FieldReader reader(given);
    fields(reader);
    reader.report_keys();
  }
  template <class T>
  void list(std::string_view key, std::vector<T>& values, const FieldInfo& info) {
    const PlacedNode given = get_list(key, info);
    for (const PlacedNode& item : given.items()) read(item, values.emplace_back());
  }
  template <class T>
  void named(std::string_view key, std::vector<T>& values, const FieldInfo& info) {
    const PlacedNode given = get_object(key, info);
    for (const PlacedNode& item : given.items()) {
      T& value = values.emplace_back();
      value.name = item.key();
      read_named(item, value);
    }
  }

  void version(std::string_view key, int only, const FieldInfo& info) {
    const PlacedNode given = get(key, info);
    if (given && (given->kind != Node::Kind::number || given->number != only)) given.must_be(std::to_string(only));
  }
  void misplaced(std::string_view key, std::string_view where) {
    const PlacedNode given = object_.find(key);
    if (!given) return;
    known_.emplace_back(key);
    given.refuse("is " + std::string(where));
  }
  void rest_unknown() { rest_unknown_ = true; }
  // Reports, at the end of an object, unknown keys and missing required ones. An unknown key that resembles a missing
  // one is one finding.
  void report_keys() {
    Findings& findings = object_.findings();
    std::vector<std::string> reported;
    std::string known_here;  // made for the first unknown key, the same for all
    for (const PlacedNode& item : object_.items()) {
      const std::string& key = item.key();
      if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
      const Missing* const missing = missing_like(key);
      if (rest_unknown_ && !missing) continue;
      if (known_here.empty()) known_here = "; known here: " + joined(known_);
      std::string message = "unknown key" + did_you_mean(key, known_) + known_here;
      if (missing) {
        message = "unknown key" + did_you_mean(key, {missing->key}) + "; " + missing->key + " " + missing->message;
        reported.push_back(missing->key);
        findings.add_elsewhere(child_path(object_.path(), missing->key));
      }
      item.refuse_key(message);
    }
    for (const auto& [key, message] : missing_)
      if (std::find(reported.begin(), reported.end(), key) == reported.end())
        findings.add(*object_, child_path(object_.path(), key), message);
  }

 private:
  struct Missing {
    std::string key, message;
  };
  const Missing* missing_like(const std::string& unknown) const {
    const auto found = std::find_if(missing_.begin(), missing_.end(),
                                    [&](const Missing& m) { return !did_you_mean(unknown, {m.key}).empty(); });
    return found == missing_.end() ? nullptr : &*found;
  }
  bool has_object(std::string_view key) const {
    const Node* const given = object_->find(key);
    return given && given->kind == Node::Kind::object;
  }
  // Sets the value that a word stands for. `also` ends the finding about another word.
  template <class T, std::size_t N>
  static void take(const PlacedNode& given, std::string_view key, const std::string& word,
                   const Choice<T> (&choices)[N], auto& value, const char* also = "") {
    const auto found = std::ranges::find(choices, word, &Choice<T>::word);
    if (found != std::end(choices)) {
      value = found->value;
      return;
    }
    std::vector<std::string> available;
    for (const Choice<T>& choice : choices) available.emplace_back(choice.word);
    given.refuse(not_among(key, word, available) + also);
  }

  // Returns the value of a key, which is known from now on. If it is absent, it returns nothing and reports a required
  // one. get_list and get_object report a value of another kind, and return nothing, either.
  PlacedNode get(std::string_view key, const FieldInfo& info) {
    if (info.need == Need::unknown) return {};
    known_.emplace_back(key);
    const PlacedNode given = object_.find(key);
    if (!given && info.need == Need::required)
      missing_.push_back({std::string(key), "is missing; expected: " + std::string(info.description)});
    return given;
  }
  PlacedNode get_list(std::string_view key, const FieldInfo& info) {
    return of_kind(get(key, info), Node::Kind::array);
  }
  PlacedNode get_object(std::string_view key, const FieldInfo& info) {
    return of_kind(get(key, info), Node::Kind::object);
  }

  template <class T>
  static void read_named(const PlacedNode& given, T& value) {
    if constexpr (!std::is_same_v<T, Definition> && !std::is_same_v<T, TermParameter>)
      read(given, value);
    else if (!read_expression(given, value.value))
      value.value = std::numeric_limits<double>::quiet_NaN();
  }
  // "k1": 100  is short for  "k1": {"value": 100}.
  static void read_named(const PlacedNode& given, Parameter& value) {
    const bool is_object = given->kind == Node::Kind::object;
    if (is_object)
      read(given, value);
    else
      read_plain(given, value.value, std::nullopt);
    const Findings& findings = given.findings();
    const std::string path = given.path();
    if (findings.concerns(child_path(path, "value"))) value.value = std::numeric_limits<double>::quiet_NaN();
    if (findings.concerns(path)) return;
    if (!is_object) return take_unit(given, value);
    for (const char* key : {"value", "lower", "upper"})
      if (const PlacedNode number = given.find(key)) take_unit(number, value);
  }
  static bool read_string(const PlacedNode& given, std::string& value) {
    const bool is_string = given->kind == Node::Kind::string;
    if (is_string)
      value = given->string;
    else
      given.must_be("a string");
    return is_string;
  }

  const PlacedNode& object_;
  std::vector<std::string> known_;
  std::vector<Missing> missing_;
  bool rest_unknown_ = false;
};

}  // namespace

void read_fields(const PlacedNode& root, Problem& problem) { FieldReader::read(root, problem); }

}  // namespace mbsopt::inline app
