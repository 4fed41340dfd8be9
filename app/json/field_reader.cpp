#include "app/json/field_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>

#include "core/expression/did_you_mean.hpp"
#include "core/expression/dimension_inference.hpp"

namespace mbsopt::inline app {

namespace {

const char* shape_of(Node::Kind kind) { return kind == Node::Kind::array ? "a list [...]" : "an object {...}"; }

}  // namespace

const Node* FieldReader::get(std::string_view key, const FieldInfo& info) {
  if (info.need == Need::unknown) return nullptr;
  known_.emplace_back(key);
  const Node* const node = node_.find(key);
  if (!node && info.need == Need::required)
    missing_.push_back({std::string(key), "is missing; expected: " + std::string(info.description)});
  return node;
}

const Node* FieldReader::get_kind(std::string_view key, const FieldInfo& info, Node::Kind kind) {
  const Node* const node = get(key, info);
  if (!node || node->kind == kind) return node;
  findings_.add(*node, inside(key), std::string("must be ") + shape_of(kind) + ", found " + what_is(*node));
  return nullptr;
}

const FieldReader::Missing* FieldReader::missing_like(const std::string& unknown) const {
  const auto found = std::find_if(missing_.begin(), missing_.end(),
                                  [&](const Missing& m) { return !did_you_mean(unknown, {m.key}).empty(); });
  return found == missing_.end() ? nullptr : &*found;
}

void FieldReader::report_keys() {
  std::vector<std::string> reported;
  std::string known_here;  // made for the first unknown key, the same for all
  for (std::size_t i = 0; i < node_.keys.size(); ++i) {
    const std::string& key = node_.keys[i];
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    const Missing* const missing = missing_like(key);
    if (rest_unknown_ && !missing) continue;
    if (known_here.empty()) known_here = "; known here: " + joined(known_);
    std::string message = "unknown key" + did_you_mean(key, known_) + known_here;
    if (missing) {
      message = "unknown key" + did_you_mean(key, {missing->key}) + "; " + missing->key + " " + missing->message;
      reported.push_back(missing->key);
      findings_.add_elsewhere(inside(missing->key));
    }
    if (node_.source == 0 && node_.items[i].source == 0)
      findings_.add_at(node_.key_offsets[i], inside(key), message);
    else
      findings_.add_override(inside(key), message);
  }
  for (const auto& [key, message] : missing_)
    if (std::find(reported.begin(), reported.end(), key) == reported.end()) findings_.add(node_, inside(key), message);
}

bool FieldReader::read_string(const Node& node, const std::string& path, std::string& value) {
  if (node.kind != Node::Kind::string) {
    findings_.add(node, path, "must be a string, found " + what_is(node));
    return false;
  }
  value = node.string;
  return true;
}

void FieldReader::text(std::string_view key, std::string& value, const FieldInfo& info) {
  if (const Node* node = get(key, info)) read_string(*node, inside(key), value);
}

void FieldReader::texts(std::string_view key, std::vector<std::string>& values, const FieldInfo& info) {
  const Node* const node = get(key, info);
  if (!node) return;
  if (node->kind != Node::Kind::array) {
    read_string(*node, inside(key), values.emplace_back());
    return;
  }
  if (node->items.empty()) findings_.add(*node, inside(key), "is empty; expected: " + std::string(info.description));
  for (std::size_t i = 0; i < node->items.size(); ++i)
    read_string(node->items[i], child_path(inside(key), i), values.emplace_back());
}

void FieldReader::reference(std::string_view key, std::string& value, ElementKind, const FieldInfo& info) {
  text(key, value, info);
  const Node* const node = info.need == Need::unknown ? nullptr : node_.find(key);
  if (node && node->kind == Node::Kind::string && node->string.empty())
    findings_.add(*node, inside(key), "is empty; expected: " + std::string(info.description));
}

void FieldReader::references(std::string_view key, std::vector<std::string>& values, ElementKind,
                             const FieldInfo& info) {
  const Node* const node = get_kind(key, info, Node::Kind::array);
  if (!node) return;
  for (std::size_t i = 0; i < node->items.size(); ++i)
    read_string(node->items[i], child_path(inside(key), i), values.emplace_back());
}

void FieldReader::word(std::string_view key, std::string& value, const Words& words_allowed, const FieldInfo& info) {
  const Node* const node = get(key, info);
  if (!node || !read_string(*node, inside(key), value)) return;
  if (!has_word(words_allowed.available, value))
    findings_.add(*node, inside(key), not_among(key, value, words(words_allowed.available), words_allowed.later));
}

const TypeRow* FieldReader::type(std::string_view key, std::string_view, std::span<const TypeRow> rows,
                                 const FieldInfo& info) {
  const Node* const node = get(key, {info.description, Need::optional, {}});
  if (!node) {
    missing_.push_back({std::string(key), "is missing; available: " + joined(names_of(rows))});
    findings_.add_elsewhere(path_);  // other requirements of the object depend on it
    return nullptr;
  }
  std::string given;
  if (!read_string(*node, inside(key), given)) return nullptr;
  const TypeRow* const row = find_row(rows, given);
  if (!row) {
    findings_.add(*node, inside(key), not_among(key, given, names_of(rows)));
    findings_.add_elsewhere(path_);
  }
  return row;
}

bool FieldReader::read_expression(const Node& node, const std::string& path, Expression& value) {
  if (node.kind == Node::Kind::number) {
    value = Expression(node.number);
    return true;
  }
  if (node.kind != Node::Kind::string) {
    findings_.add(node, path, "must be a number or an expression in a string, found " + what_is(node));
    return false;
  }
  try {
    value = Expression::parse(node.string);
    return true;
  } catch (const ExpressionError& error) {
    findings_.add_inside(node, error.offset, path, error.what());
    return false;
  }
}

void FieldReader::number(std::string_view key, Field& value, const FieldInfo& info) {
  if (const Node* node = get(key, info)) read_expression(*node, inside(key), value);
}

void FieldReader::number(std::string_view key, std::optional<Field>& value, const FieldInfo& info) {
  if (const Node* node = get(key, info)) read_expression(*node, inside(key), value.emplace());
}

void FieldReader::time_law(std::string_view key, Expression& value, std::optional<SampledLaw>& samples,
                           const FieldInfo& info) {
  const Node* const node = get(key, info);
  if (!node) return;
  if (node->kind == Node::Kind::object)
    read(*node, inside(key), findings_, samples.emplace());
  else
    read_expression(*node, inside(key), value);
}

template <std::size_t N>
bool FieldReader::read_vector(const Node& node, const std::string& path, std::array<Field, N>& value) {
  if (node.kind != Node::Kind::array || node.items.size() != N) {
    findings_.add(node, path,
                  "must be a list of " + std::to_string(N) + " numbers or expressions, found " + what_is(node));
    return false;
  }
  bool good = true;
  for (std::size_t i = 0; i < N; ++i) good = read_expression(node.items[i], child_path(path, i), value[i]) && good;
  return good;
}

void FieldReader::vector(std::string_view key, VectorField& value, const FieldInfo& info) {
  if (const Node* node = get(key, info)) read_vector(*node, inside(key), value);
}

bool FieldReader::read_point(const Node& node, const std::string& path, PointField& value) {
  if (node.kind == Node::Kind::string) {
    value = node.string;
    return true;
  }
  if (node.kind != Node::Kind::array) {
    findings_.add(node, path, "must be the name of a point or a list of 3 coordinates, found " + what_is(node));
    return false;
  }
  return read_vector(node, path, value.emplace<VectorField>());
}

void FieldReader::point(std::string_view key, PointField& value, std::string_view, const FieldInfo& info) {
  if (const Node* node = get(key, info)) read_point(*node, inside(key), value);
}

void FieldReader::point(std::string_view key, std::optional<PointField>& value, std::string_view,
                        const FieldInfo& info) {
  if (const Node* node = get(key, info)) read_point(*node, inside(key), value.emplace());
}

void FieldReader::inertia(std::string_view key, InertiaField& tensor, std::optional<ConsistentInertiaField>& consistent,
                          const FieldInfo& info) {
  const Node* const node = get(key, info);
  if (!node) return;
  if (node->kind == Node::Kind::object) {
    const Node* const inside_it = node->find("consistent");
    if (!inside_it) return read(*node, inside(key), findings_, tensor);
    if (node->keys.size() > 1)
      findings_.add(*node, inside(key), "has \"consistent\" and other keys; \"consistent\" must be the only key");
    return read(*inside_it, child_path(inside(key), "consistent"), findings_, consistent.emplace());
  }
  std::array<Field, 3> diagonal;
  if (node->kind != Node::Kind::array || node->items.size() != 3) {
    findings_.add(*node, inside(key),
                  "must be {\"xx\":..,\"yy\":..,\"zz\":..,\"xy\":..,\"xz\":..,\"yz\":..}, [xx, yy, zz] or "
                  "{\"consistent\": {\"x\":..,\"y\":..,\"z\":..}}, found " +
                      what_is(*node));
  } else if (read_vector(*node, inside(key), diagonal)) {
    tensor = {diagonal[0], diagonal[1], diagonal[2], 0.0, 0.0, 0.0};
  }
}

void FieldReader::orientation(std::string_view key, OrientationField& value, const FieldInfo& info) {
  const Node* const node = get(key, info);
  if (!node) return;
  const bool is_object = node->kind == Node::Kind::object;
  if (node->kind == Node::Kind::array && node->items.size() == 4) {
    read_vector(*node, inside(key), value.emplace<EulerParametersField>().e);
  } else if (is_object && (node->find("axis") || node->find("angle"))) {
    read(*node, inside(key), findings_, value.emplace<AxisAngleField>());
  } else if (is_object && node->find("rpy")) {
    read(*node, inside(key), findings_, value.emplace<RollPitchYawField>());
  } else {
    findings_.add(*node, inside(key),
                  "must be [e0, e1, e2, e3], {\"axis\": [x, y, z], \"angle\": a} or {\"rpy\": [r, p, y]}, found " +
                      what_is(*node));
  }
}

void FieldReader::points(std::string_view key, std::map<std::string, VectorField>& value, const FieldInfo& info) {
  const Node* const node = get_kind(key, info, Node::Kind::object);
  if (!node) return;
  for (std::size_t i = 0; i < node->keys.size(); ++i)
    read_vector(node->items[i], child_path(inside(key), node->keys[i]), value[node->keys[i]]);
}

bool FieldReader::read_plain(const Node& node, const std::string& path, double& value,
                             const std::optional<Dimension>& expected) {
  Expression expression;
  if (!read_expression(node, path, expression)) return false;
  if (!expression.is_number()) {
    findings_.add(node, path, "must be a number; '" + expression.names()[0] + "' is a name, which is not allowed here");
    return false;
  }
  if (!std::isfinite(expression.number())) {
    findings_.add(node, path, "is " + expression.text() + ", which is not finite");
    return false;
  }
  try {
    const auto found = infer_dimension(expression, [](const std::string&) { return std::nullopt; });
    if (expected && !fits(found, *expected)) {
      findings_.add(node, path, "has the dimension " + to_string(*found) + ", expected is " + to_string(*expected));
      return false;
    }
  } catch (const DimensionError& error) {
    findings_.add_inside(node, error.offset, path, error.what());
    return false;
  }
  value = expression.number();
  return true;
}

void FieldReader::plain(std::string_view key, double& value, const Range&, const FieldInfo& info) {
  if (const Node* node = get(key, info)) read_plain(*node, inside(key), value, info.dimension);
}

template <class Integer>
void FieldReader::read_integer(const Node& node, const std::string& path, Integer& value) {
  double given = 0;
  if (!read_plain(node, path, given, Dimension{})) return;
  const bool is_whole = given == std::round(given);
  if (!is_whole || std::abs(given) > static_cast<double>(std::numeric_limits<Integer>::max() / 2)) {
    const char* const wanted = is_whole ? "is too large, " : "must be a whole number, found ";
    findings_.add(node, path, wanted + Expression(given).text());
    return;
  }
  value = static_cast<Integer>(given);
}

void FieldReader::plain(std::string_view key, int& value, const Range&, const FieldInfo& info) {
  if (const Node* node = get(key, info)) read_integer(*node, inside(key), value);
}

void FieldReader::plain(std::string_view key, long& value, const Range&, const FieldInfo& info) {
  if (const Node* node = get(key, info)) read_integer(*node, inside(key), value);
}

void FieldReader::plain(std::string_view key, bool& value, const Range&, const FieldInfo& info) {
  const Node* const node = get(key, info);
  if (!node) return;
  if (node->kind == Node::Kind::boolean)
    value = node->boolean;
  else
    findings_.add(*node, inside(key), "must be true or false, found " + what_is(*node));
}

void FieldReader::level(std::string_view key, std::optional<double>& value, std::span<const Choice<double>> choices,
                        const Range& range, const FieldInfo& info) {
  const Node* const node = get(key, info);
  if (!node) return;
  std::vector<std::string> available;
  for (const Choice<double>& choice : choices) {
    if (node->kind == Node::Kind::string && node->string == choice.word) {
      value = choice.value;
      return;
    }
    available.emplace_back(choice.word);
  }
  const bool is_word = node->kind == Node::Kind::string && !node->string.empty() &&
                       std::isalpha(static_cast<unsigned char>(node->string[0]));
  if (is_word)
    findings_.add(*node, inside(key), not_among(key, node->string, available) + ", or a number");
  else
    plain(key, value, range, info);
}

void FieldReader::instead_of(std::string_view key, std::string_view object, const Words& fields) {
  const Node* const node = node_.find(object);
  if (!has(key) || !node || node->kind != Node::Kind::object) return;
  for (const std::string& field : words(fields.available))
    if (const Node* const value = node->find(field))
      findings_.add(
          *value, child_path(inside(object), field),
          fmt::format("is chosen by {0}, and must not be given as well: leave out one of the two ({1} is left "
                      "out with --set {1}={{}})",
                      inside(key), inside(object)));
}

void FieldReader::numbers(std::string_view key, std::vector<double>& values, const Range&, const FieldInfo& info) {
  const Node* const node = get_kind(key, info, Node::Kind::array);
  if (!node) return;
  for (std::size_t i = 0; i < node->items.size(); ++i)
    read_plain(node->items[i], child_path(inside(key), i), values.emplace_back(0.0), info.dimension);
}

void FieldReader::tolerance(std::string_view key, double& value, std::optional<KindTolerances>& kinds,
                            const FieldInfo& info) {
  const Node* const node = node_.find(key);
  if (!node || node->kind != Node::Kind::object) return plain(key, value, kPositive, info);
  object(key, kinds, info);
  if (kinds) value = kinds->smallest();
}

void FieldReader::values_of(std::string_view key, std::vector<std::pair<std::string, double>>& values, ElementKind,
                            const Range&, const FieldInfo& info) {
  const Node* const node = get_kind(key, info, Node::Kind::object);
  if (!node) return;
  for (std::size_t i = 0; i < node->keys.size(); ++i) {
    auto& [name, value] = values.emplace_back(node->keys[i], 0.0);
    read_plain(node->items[i], child_path(inside(key), name), value, std::nullopt);
  }
}

// "k1": 100  is short for  "k1": {"value": 100}.
void FieldReader::read_named(const Node& node, const std::string& path, Parameter& value) {
  if (node.kind == Node::Kind::object)
    read(node, path, findings_, value);
  else
    read_plain(node, path, value.value, std::nullopt);

  if (findings_.concerns(child_path(path, "value"))) value.value = std::numeric_limits<double>::quiet_NaN();
  if (findings_.concerns(path)) return;
  if (node.kind != Node::Kind::object) return take_unit(node, path, value);
  for (const char* key : {"value", "lower", "upper"})
    if (const Node* number = node.find(key)) take_unit(*number, child_path(path, key), value);
}

// A value with a unit has the meaning of "unit", and must not contradict it.
void FieldReader::take_unit(const Node& node, const std::string& path, Parameter& parameter) {
  if (node.kind != Node::Kind::string) return;
  const auto found = infer_dimension(Expression::parse(node.string), [](const std::string&) { return std::nullopt; });
  if (!found || found->is_none()) return;
  if (parameter.unit.empty()) parameter.unit = to_string(*found);
  const std::optional<Unit> unit = parse_unit(parameter.unit);
  if (unit && !compatible(unit->dimension, *found))
    findings_.add(
        node, path,
        "has the dimension " + to_string(*found) + ", that of the parameter is " + to_string(unit->dimension));
}

void FieldReader::read_named(const Node& node, const std::string& path, Definition& value) {
  if (!read_expression(node, path, value.value)) value.value = std::numeric_limits<double>::quiet_NaN();
}

void FieldReader::read_named(const Node& node, const std::string& path, TermParameter& value) {
  if (!read_expression(node, path, value.value)) value.value = std::numeric_limits<double>::quiet_NaN();
}

void FieldReader::version(std::string_view key, int only, const FieldInfo& info) {
  const Node* const node = get(key, info);
  if (node && (node->kind != Node::Kind::number || node->number != only))
    findings_.add(*node, inside(key), "must be " + std::to_string(only) + ", found " + what_is(*node));
}

void FieldReader::later(std::string_view key, std::string_view what) {
  refuse(key, std::string(what) + " is not available in this version");
}

void FieldReader::misplaced(std::string_view key, std::string_view where) { refuse(key, "is " + std::string(where)); }

void FieldReader::refuse(std::string_view key, const std::string& message) {
  const Node* const node = node_.find(key);
  if (!node) return;
  known_.emplace_back(key);
  findings_.add(*node, inside(key), message);
}

}  // namespace mbsopt::inline app
