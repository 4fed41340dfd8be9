#include "core/scene/scene_facts.hpp"

#include <algorithm>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/strong_components.hpp>
#include <cmath>
#include <numeric>

#include "core/scene/scene_path.hpp"
#include "core/scene/signals.hpp"

namespace mbsopt {

namespace {

bool is_expression(const Sensor& sensor) { return sensor.quantity == "expression"; }

// The first of several equal names counts. The checks report duplicates elsewhere.
void add_once(Symbols& symbols, const std::string& name) {
  if (symbols.input(name) < 0 && !symbols.definition(name)) symbols.add_input(name);
}

bool knows(const Symbols& symbols, const std::string& name) {
  return symbols.input(name) >= 0 || symbols.definition(name);
}

std::vector<std::string> names_in(const auto& list) {
  std::vector<std::string> names;
  for (const auto& one : list) names.push_back(one.name);
  return names;
}

}  // namespace

SceneFacts::SceneFacts(const Scene& scene) : scene_(scene) {
  set_names(ElementKind::body, names_in(scene.bodies));
  set_names(ElementKind::joint, names_in(scene.joints));
  set_names(ElementKind::drive, names_in(scene.drives));
  set_names(ElementKind::force, names_in(scene.forces));
  set_names(ElementKind::sensor, names_in(scene.sensors));
  set_names(ElementKind::parameter, names_in(scene.parameters));
  names_[at(ElementKind::body)].all.insert(names_[at(ElementKind::body)].all.begin(), "ground");
  for (const Parameter& parameter : scene.parameters) {
    if (none_.input(parameter.name) >= 0) continue;
    none_.add_input(parameter.name);
    values_.push_back(parameter.value);
    any_unread_ = any_unread_ || std::isnan(parameter.value);
    const std::optional<Unit> unit = parse_unit(parameter.unit);
    dimensions_[parameter.name] = unit ? std::optional(unit->dimension) : std::nullopt;
  }
  constants_ = none_;
  for (const Definition& definition : scene.definitions) {
    if (none_.input(definition.name) < 0 && !none_.definition(definition.name))
      none_.add_definition(definition.name, definition.value);
    any_unread_ = any_unread_ || (definition.value.is_number() && std::isnan(definition.value.number()));
  }
  for (const Signal& signal : scene.signals) {
    const std::optional<Unit> unit = parse_unit(signal.unit);
    dimensions_[signal.name] = unit && signal.gain.is_number() ? std::optional(unit->dimension) : std::nullopt;
  }
  std::vector<Named> named;
  for (const auto& [name, value] : scene.definitions)
    if (is_identifier(name) && none_.definition(name))
      named.push_back({child_path("definitions", name), name, &value, &none_});
  Symbols with_signals = none_;
  add_signals(with_signals, scene);
  tsda_law_ = rsda_law_ = time_law_ = objective_ = with_signals;
  for (const char* name : {"l", "ldot", "t"}) add_once(tsda_law_, name);
  for (const char* name : {"angle", "rate", "t"}) add_once(rsda_law_, name);
  add_once(time_law_, "t");
  add_once(objective_, "t");
  for (const Sensor& sensor : scene.sensors) {
    if (!is_expression(sensor))
      add_once(objective_, sensor.name);
    else if (!knows(objective_, sensor.name))
      objective_.add_definition(sensor.name, sensor.value);
  }
  for (const Sensor& sensor : scene.sensors)
    if (is_expression(sensor) && is_identifier(sensor.name) && objective_.definition(sensor.name))
      named.push_back(
          {child_path(child_path("sensors", sensor.name), "value"), sensor.name, &sensor.value, &objective_});
  find_broken(named);
}

// The strong components of the graph "one name uses another", children first: names in a circle form one component.
// Outside circles, the height of a name is one more than that of the highest one it uses.
void SceneFacts::find_broken(const std::vector<Named>& all) {
  std::unordered_map<std::string_view, std::size_t> index;
  for (std::size_t i = 0; i < all.size(); ++i) index.emplace(all[i].name, i);
  boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS> uses(all.size());
  std::vector<char> in_circle(all.size(), 0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const std::string& name : all[i].value->names()) {
      const auto used = index.find(name);
      if (used == index.end() || !knows(*all[i].symbols, name)) continue;
      add_edge(i, used->second, uses);
      in_circle[i] = in_circle[i] || used->second == i;
    }
  }
  std::vector<std::size_t> component(all.size()), order(all.size()), size(all.size(), 0);
  boost::strong_components(uses, boost::make_iterator_property_map(component.begin(), get(boost::vertex_index, uses)));
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return component[i]; });
  for (const std::size_t c : component) ++size[c];
  std::vector<int> height(all.size(), 1);
  bool any_too_deep = false;
  for (const std::size_t i : order) {
    const auto& [path, name, value, symbols] = all[i];
    in_circle[i] = in_circle[i] || size[component[i]] > 1;
    if (in_circle[i]) endless_.emplace_back(path, "'" + name + "' refers to itself");
    bool broken = in_circle[i];
    for (const std::string& used : value->names()) {
      broken = broken || is_broken(used) || !knows(*symbols, used);
      if (const auto it = index.find(used); it != index.end() && !broken)
        height[i] = std::max(height[i], height[it->second] + 1);
    }
    if (!broken && height[i] > kDeepestDefinitions) {
      if (!any_too_deep)
        endless_.emplace_back(path, "definitions nest deeper than " + std::to_string(kDeepestDefinitions) + " levels");
      broken = any_too_deep = true;
    }
    if (broken) broken_.insert(name);
    if (broken || symbols != &none_ || constants_.input(name) >= 0) continue;
    values_.push_back(value_at(Program(*value, constants_)));
    constants_.add_input(name);
  }
}

double SceneFacts::value_at(const Program& program) const {
  program.grow(scratch_);
  return program.value(values_, scratch_);
}

void SceneFacts::set_names(ElementKind what, const std::vector<std::string>& names) {
  Names& of = names_[at(what)];
  of.all = names;
  of.place.clear();
  for (std::size_t i = 0; i < names.size(); ++i) of.place.emplace(names[i], i);
}

const Symbols& SceneFacts::symbols(Scope names) const {
  switch (names) {
    case Scope::none:
      return none_;
    case Scope::tsda_law:
      return tsda_law_;
    case Scope::rsda_law:
      return rsda_law_;
    case Scope::time_law:
      return time_law_;
    default:  // expressions that may read sensors
      return objective_;
  }
}

// This is faster than an attempt: the exception collects all names that resemble the wrong one.
bool SceneFacts::can_be_evaluated(const Expression& expression, const Symbols& symbols) const {
  const std::vector<std::string>& names = expression.names();
  return std::all_of(names.begin(), names.end(),
                     [&](const std::string& name) { return knows(symbols, name) && !is_broken(name); });
}

std::optional<double> SceneFacts::value(const Field& field) const {
  const std::optional<double> x = any_value(field);
  return x && std::isfinite(*x) ? x : std::nullopt;
}

std::optional<double> SceneFacts::any_value(const Field& field) const {
  if (field.is_number()) return field.number();
  if (!can_be_evaluated(field, none_)) return std::nullopt;
  try {
    const auto [it, is_new] = computed_.try_emplace(&field.tree(), 0.0);  // several checks ask for long expressions
    if (is_new) it->second = value_at(Program(field, constants_));
    return std::isnan(it->second) && any_unread_ ? std::nullopt : std::optional(it->second);
  } catch (const UnknownName&) {
    return std::nullopt;
  }
}

std::optional<std::array<double, 3>> SceneFacts::value(const VectorField& field) const {
  const auto x = value(field[0]), y = value(field[1]), z = value(field[2]);
  if (!x || !y || !z) return std::nullopt;
  return std::array{*x, *y, *z};
}

std::optional<std::array<double, 3>> SceneFacts::value(const PointField& field, const std::string& body_name) const {
  if (const auto* vector = std::get_if<VectorField>(&field)) return value(*vector);
  const std::string& point = std::get<std::string>(field);
  if (point == "O") return std::array{0.0, 0.0, 0.0};
  const Body* const owner = body(body_name);
  if (!owner) return std::nullopt;
  const auto it = owner->points.find(point);
  return it == owner->points.end() ? std::nullopt : value(it->second);
}

const SceneFacts::Scale& SceneFacts::scale() const {
  if (scale_) return *scale_;
  scale_ = Scale{};
  double &length = scale_->length, &mass = scale_->mass;
  const auto add = [&](const PointField& point, const std::string& owner) {
    if (const auto x = value(point, owner)) length = std::max(length, std::hypot((*x)[0], (*x)[1], (*x)[2]));
  };
  for (const Body& body : scene_.bodies) {
    mass = std::max(mass, value(body.mass).value_or(0));
    add(body.position, "");
    add(body.com, "");
    for (const auto& [name, point] : body.points) add(point, "");
  }
  for (const Joint& joint : scene_.joints) {
    add(joint.point1, joint.body1);
    add(joint.point2, joint.body2);
  }
  for (const Force& force : scene_.forces)
    if (const auto* tsda = std::get_if<Tsda>(&force.kind))
      add(tsda->point1, tsda->body1), add(tsda->point2, tsda->body2);
  return *scale_;
}

std::optional<std::array<double, 3>> SceneFacts::law_at(const Expression& law, double t) const {
  if (any_unread_ || !can_be_evaluated(law, time_law_)) return std::nullopt;
  try {
    const Program f(law, time_law_), f_t = f.derivative(time_law_.input("t")),
                                     f_tt = f_t.derivative(time_law_.input("t"));
    for (const Program* program : {&f, &f_t, &f_tt}) program->grow(scratch_);
    std::vector<double> inputs(values_.begin(), values_.begin() + none_.inputs());
    inputs.push_back(t);
    return std::array{f.value(inputs, scratch_), f_t.value(inputs, scratch_), f_tt.value(inputs, scratch_)};
  } catch (const UnknownName&) {
    return std::nullopt;
  }
}

namespace {

// nullopt for an expression that is wrong: its own check reports that.
std::optional<Dimension> dimension_if_any(const Expression& expression, const DimensionOfName& dimension_of_name,
                                          PlainNumbers plain = PlainNumbers::fit_everything) {
  try {
    return infer_dimension(expression, dimension_of_name, plain);
  } catch (const DimensionError&) {
    return std::nullopt;
  }
}

}  // namespace

std::optional<Dimension> SceneFacts::dimension_of_name(const std::string& name) const {
  if (const auto it = dimensions_.find(name); it != dimensions_.end()) return it->second;
  const Expression* const definition = none_.definition(name);
  if (!definition || is_broken(name)) return std::nullopt;
  std::optional<Dimension> found =
      dimension_if_any(*definition, [this](const std::string& inner) { return dimension_of_name(inner); });
  if (found && found->is_none()) found.reset();  // a plain number may have any dimension
  return dimensions_[name] = found;
}

std::vector<std::string> SceneFacts::used_names(const Expression& expression, const Symbols& symbols) const {
  std::vector<std::string> names;
  if (!can_be_evaluated(expression, symbols)) return names;
  const Program program(expression, symbols);
  for (const int input : program.used_inputs()) names.push_back(symbols.input_names()[static_cast<std::size_t>(input)]);
  return names;
}

Reads SceneFacts::reads_of(const Sensor& measured) const {
  if (!is_expression(measured)) return reads_of_quantity(measured);
  Reads reads = Reads::positions;
  for (const std::string& name : used_names(measured.value, objective_)) {
    const Sensor* const below = sensor(name);
    reads = std::max(reads, below ? reads_of_quantity(*below) : name == "t" ? Reads::time_and_state : reads);
  }
  return reads == Reads::velocities ? Reads::state : reads;
}

std::optional<Dimension> SceneFacts::dimension_of(const Sensor& measured, PlainNumbers plain) const {
  if (!is_expression(measured)) return dimension_of_quantity(measured);
  if (!can_be_evaluated(measured.value, objective_)) return std::nullopt;
  const auto [it, is_new] = dimensions_of_sensors_.emplace(std::pair(measured.name, plain), std::nullopt);
  if (is_new)
    it->second = dimension_if_any(
        measured.value, [&](const std::string& name) { return dimension_in_sensor(name, plain); }, plain);
  return it->second;
}

std::optional<Dimension> SceneFacts::dimension_in_sensor(const std::string& name, PlainNumbers plain) const {
  const Sensor* const below = sensor(name);
  return below ? dimension_of(*below, plain) : dimension_of_name(name);
}

void add_time_and_sensors(Symbols& symbols, const Scene& scene) {
  symbols.add_input("t");
  for (const Sensor& sensor : scene.sensors) {
    if (is_expression(sensor))
      symbols.add_defined_input(sensor.name, sensor.value);
    else
      symbols.add_input(sensor.name);
  }
}

std::optional<Dimension> shown_dimension(const Scene& scene, const Sensor& sensor) {
  if (!is_expression(sensor)) return dimension_of_quantity(sensor);
  return SceneFacts(scene).dimension_of(sensor, PlainNumbers::are_pure);
}

std::string unit_of(const Scene& scene, const Sensor& sensor) {
  const TypeRow* const row = find_row(kSensorQuantities, sensor.quantity);
  if (row && !row->unit.empty()) return std::string(row->unit);
  const std::optional<Dimension> dimension = shown_dimension(scene, sensor);
  if (!dimension) return "";
  return dimension->is_none() ? "-" : to_string(*dimension);
}

}  // namespace mbsopt
