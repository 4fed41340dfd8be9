#include "app/json/schema.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/files/result_json.hpp"
#include "core/scene/default_integrator.hpp"
#include "optim/problem/problem_vocabulary.hpp"

namespace mbsopt::inline app {

namespace {

Json ref(const char* name) { return {{"$ref", std::string("#/$defs/") + name}}; }

Json array_of(Json items, std::size_t count) {
  return {{"type", "array"}, {"items", std::move(items)}, {"minItems", count}, {"maxItems", count}};
}

Json names_pattern() { return {{"pattern", "^[A-Za-z_][A-Za-z0-9_]*$"}}; }

Json default_of(const Field& field) { return field.is_number() ? Json(field.number()) : Json(field.text()); }
Json default_of(const VectorField& field) {
  return Json::array({default_of(field[0]), default_of(field[1]), default_of(field[2])});
}

Json default_of(const PointField& field) {
  const std::string* const name = std::get_if<std::string>(&field);
  return name ? Json(*name) : Json();
}
Json default_of(const auto& number) { return number; }
template <class T>
Json default_of(const std::optional<T>&) {
  return {};
}

template <class T>
Json object_schema();
template <class T>
Json object_schema_of(T value);

// Collects the properties of one object.
class SchemaWriter {
 public:
  Json properties = Json::object();
  Json required = Json::array();
  Json dependent = Json::object();  // requirements that a key makes on others
  std::span<const TypeRow> rows;    // of an object with a type

  Json object() const {
    Json schema{{"type", "object"}, {"properties", properties}};
    if (!required.empty()) schema["required"] = required;
    if (!dependent.empty()) schema["dependentSchemas"] = dependent;
    schema["additionalProperties"] = false;
    return schema;
  }

  void name(std::string_view key, std::string&, const FieldInfo& info) {
    put(key, info, {{"type", "string"}, {"minLength", 1}});
  }
  void text(std::string_view key, std::string& value, const FieldInfo& info) {
    put(key, info, {{"type", "string"}}, value.empty() ? Json() : Json(value));
  }
  void reference(std::string_view key, std::string& value, ElementKind, const FieldInfo& info) {
    text(key, value, info);
  }
  void references(std::string_view key, std::vector<std::string>&, ElementKind, const FieldInfo& info) {
    put(key, info, {{"type", "array"}, {"items", {{"type", "string"}}}});
  }
  void reference_or(std::string_view key, std::string& value, ElementKind to, const FieldInfo& info, auto&& fields) {
    SchemaWriter form;
    form.reference(kObjectiveKey, value, to, {"the objective to minimise"});
    fields(form);
    put(key, info, {{"anyOf", {{{"type", "string"}}, form.object()}}});
  }
  template <class T, std::size_t N>
  void choice(std::string_view key, T& value, const Choice<T> (&choices)[N], const FieldInfo& info) {
    Json all = Json::array(), initial;
    for (const Choice<T>& choice : choices) {
      const bool is_truth = choice.word == "true" || choice.word == "false";
      all.push_back(is_truth ? Json(choice.word == "true") : Json(choice.word));
      if (choice.value == value) initial = all.back();
    }
    put(key, info, {{"enum", all}}, initial);
  }
  void word(std::string_view key, std::string& value, const Words& allowed, const FieldInfo& info) {
    put(key, info, {{"enum", words(allowed.available)}}, value.empty() ? Json() : Json(value));
  }
  const TypeRow* type(std::string_view key, std::string_view current, std::span<const TypeRow> all,
                      const FieldInfo& info) {
    rows = all;
    const TypeRow* const row = find_row(all, current);
    if (row) put(key, {row->description, info.need, {}}, {{"const", row->name}});
    return row;
  }

  void number(std::string_view key, auto& value, const FieldInfo& info) {
    put(key, info, ref("expression"), default_of(value));
  }
  void vector(std::string_view key, VectorField& value, const FieldInfo& info) {
    put(key, info, ref("vector"), default_of(value));
  }
  void point(std::string_view key, auto& value, std::string_view, const FieldInfo& info) {
    put(key, info, ref("point"), default_of(value));
  }
  void inertia(std::string_view key, InertiaField&, std::optional<ConsistentInertiaField>&, const FieldInfo& info) {
    SchemaWriter form;
    form.put("consistent", {"lengths that give a possible tensor whatever they are", Need::required, {}},
             object_schema<ConsistentInertiaField>());
    put(key, info, {{"anyOf", {array_of(ref("expression"), 3), object_schema<InertiaField>(), form.object()}}});
  }
  void orientation(std::string_view key, OrientationField&, const FieldInfo& info) {
    put(key, info,
        {{"anyOf",
          {array_of(ref("expression"), 4), object_schema<AxisAngleField>(), object_schema<RollPitchYawField>()}}},
        Json::array({1, 0, 0, 0}));
  }
  void points(std::string_view key, std::map<std::string, VectorField>&, const FieldInfo& info) {
    put(key, info, {{"type", "object"}, {"propertyNames", names_pattern()}, {"additionalProperties", ref("vector")}});
  }
  void expression(std::string_view key, auto& value, Scope, const FieldInfo& info) { number(key, value, info); }
  void time_law(std::string_view key, Expression&, std::optional<SampledLaw>&, const FieldInfo& info) {
    SampledLaw called;
    called.function = "f";
    Json samples = object_schema<SampledLaw>(), function = object_schema_of(called);
    samples["properties"].erase("user"), function["properties"]["user"].erase("default");
    put(key, info, {{"anyOf", {ref("expression"), samples, function}}});
  }
  void texts(std::string_view key, std::vector<std::string>&, const FieldInfo& info) {
    const Json text = {{"type", "string"}};
    put(key, info, {{"anyOf", {text, {{"type", "array"}, {"items", text}, {"minItems", 1}}}}});
  }
  void laws(std::string_view key, LawVector& value, Scope, const FieldInfo& info) { vector(key, value, info); }

  template <class T>
  void plain(std::string_view key, T& value, const Range& range, const FieldInfo& info) {
    if constexpr (std::is_same_v<T, double> || std::is_same_v<T, std::optional<double>>)
      put(key, info, ranged(ref("number"), range), default_of(value));
    else
      put(key, info, ranged({{"type", std::is_same_v<T, bool> ? "boolean" : "integer"}}, range), default_of(value));
  }
  template <std::size_t N>
  void level(std::string_view key, std::optional<double>&, const Choice<double> (&choices)[N], const Range& range,
             const FieldInfo& info) {
    Json words = Json::array();
    for (const Choice<double>& choice : choices) words.push_back(choice.word);
    put(key, info, {{"anyOf", {{{"enum", words}}, ranged(ref("number"), range)}}});
  }
  void instead_of(std::string_view key, std::string_view object, const Words& fields) {
    Json none = Json::object();
    for (const std::string& field : words(fields.available)) none[field] = false;
    dependent[std::string(key)] = {{"properties", {{std::string(object), {{"properties", none}}}}}};
  }
  void numbers(std::string_view key, std::vector<double>&, const Range& range, const FieldInfo& info) {
    put(key, info, {{"type", "array"}, {"items", ranged(ref("number"), range)}});
  }
  void values_of(std::string_view key, std::vector<std::pair<std::string, double>>&, ElementKind, const Range& range,
                 const FieldInfo& info) {
    put(key, info, {{"type", "object"}, {"additionalProperties", ranged(ref("number"), range)}});
  }
  void tolerance(std::string_view key, double& value, std::optional<KindTolerances>&, const FieldInfo& info) {
    put(key, info, {{"anyOf", {ranged(ref("number"), kPositive), object_schema<KindTolerances>()}}}, value);
  }

  template <class T>
  void object(std::string_view key, T&, const FieldInfo& info) {
    put(key, info, object_schema<T>());
  }
  template <class T>
  void object(std::string_view key, std::optional<T>&, const FieldInfo& info) {
    put(key, info, object_schema<T>());
  }
  void group(std::string_view key, const FieldInfo& info, auto&& fields) {
    SchemaWriter inside;
    fields(inside);
    put(key, info, inside.object());
  }
  template <class T>
  void list(std::string_view key, std::vector<T>&, const FieldInfo& info) {
    put(key, info, {{"type", "array"}, {"items", object_schema<T>()}});
  }
  template <class T>
  void named(std::string_view key, std::vector<T>&, const FieldInfo& info) {
    put(key, info,
        {{"type", "object"}, {"propertyNames", names_pattern()}, {"additionalProperties", named_schema<T>()}});
  }
  void version(std::string_view key, int only, const FieldInfo& info) { put(key, info, {{"const", only}}); }
  void misplaced(std::string_view, std::string_view) {}
  void rest_unknown() {}

 private:
  static Json ranged(Json schema, const Range& range) {
    if (std::isfinite(range.least)) schema[range.open ? "exclusiveMinimum" : "minimum"] = range.least;
    return schema;
  }

  template <class T>
  static Json named_schema() {
    if constexpr (std::is_same_v<T, Definition> || std::is_same_v<T, TermParameter>)
      return ref("expression");
    else if constexpr (std::is_same_v<T, Parameter>)
      return {{"anyOf", {ref("number"), object_schema<T>()}}};
    else
      return object_schema<T>();
  }

  void put(std::string_view key, const FieldInfo& info, Json schema, const Json& initial = {}) {
    if (info.need == Need::unknown) return;
    schema["description"] = info.description;
    if (info.need == Need::required)
      required.push_back(key);
    else if (!initial.is_null())
      schema["default"] = initial;
    properties[std::string(key)] = std::move(schema);
  }
};

template <class T>
Json object_schema_of(T value) {
  SchemaWriter writer;
  describe(writer, value);
  return writer.object();
}

template <class T>
Json object_schema() {
  T value;
  SchemaWriter writer;
  describe(writer, value);
  if (writer.rows.empty()) return writer.object();
  Json variants = Json::array();
  for (const TypeRow& row : writer.rows) {
    T variant;
    become(variant, row);
    Json schema = object_schema_of(variant);
    schema["title"] = row.name;
    variants.push_back(std::move(schema));
  }
  return {{"oneOf", std::move(variants)}};
}

// The default integrator is one choice as a whole (core/scene/default_integrator.hpp).
template <>
Json object_schema<IntegratorSettings>() {
  const IntegratorSettings of_other_types;
  IntegratorSettings settings = default_integrator(0, 1);
  Json schema = object_schema_of(settings);
  const auto also = [&](const char* key, const std::string& words) {
    Json& description = schema["properties"][key]["description"];
    description = description.get<std::string>() + words;
  };
  also("rtol", fmt::format("; with another type than {}: {:g}", settings.type, of_other_types.rtol));
  also("atol", fmt::format("; with another type than {}: {:g}", settings.type, of_other_types.atol));
  also("max_step", "; where type is left out: 1/150 of the run, else none");
  return schema;
}

// The defaults of a formulation depend on its type; the first type is the default.
template <>
Json object_schema<FormulationSettings>() {
  Json variants = Json::array();
  for (const auto& [word, type] : kFormulations) {
    FormulationSettings settings;
    if (type == FormulationType::penalty) settings = FormulationSettings::penalty();
    Json schema = object_schema_of(settings);
    schema["properties"]["type"] = {{"const", word}};
    if (!variants.empty()) schema["required"] = {"type"};
    variants.push_back(std::move(schema));
  }
  return {{"oneOf", std::move(variants)}};
}

}  // namespace

std::string problem_schema_text() {
  Json schema{
      {"$schema", "https://json-schema.org/draft/2020-12/schema"},
      {"title", "mbsopt problem"},
      {"description",
       "A mechanism, what may be changed of it, and what is wanted of it. SI units, radians, right-handed frames."}};
  schema.update(object_schema<Problem>());
  schema["$defs"] = {
      {"expression",
       {{"type", {"number", "string"}},
        {"description", "A number, or an expression such as \"rho*L1*w^2\", \"L1 + 3 [cm]\" or \"90 [deg]\"."}}},
      {"number",
       {{"type", {"number", "string"}}, {"description", "A number, or one with its unit such as \"4.2 [N/mm]\"."}}},
      {"vector", array_of(ref("expression"), 3)},
      {"point",
       {{"anyOf",
         {{{"type", "string"}, {"description", "A named point of the body; \"O\" is its origin."}}, ref("vector")}}}},
  };
  return schema.dump(2) + "\n";
}

}  // namespace mbsopt::inline app
