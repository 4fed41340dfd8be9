#include "core/scene/type_table.hpp"

#include <algorithm>

#include "core/expression/did_you_mean.hpp"
#include "core/scene/scene.hpp"
#include "core/tableau/tableaus.hpp"

namespace mbsopt {

namespace {

// Calls f(word) for each word until it returns true.
template <class F>
bool any_word(std::string_view list, F&& f) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(' '), list.size());
    if (end > 0 && f(list.substr(0, end))) return true;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

}  // namespace

Need need_of(const TypeRow& row, std::string_view field) {
  Need need = Need::unknown;
  any_word(row.fields, [&](std::string_view word) {
    const bool required = word.back() == '!';
    if (required) word.remove_suffix(1);
    if (word != field) return false;
    need = required ? Need::required : Need::optional;
    return true;
  });
  return need;
}

const TypeRow* find_row(std::span<const TypeRow> rows, std::string_view name) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const TypeRow& r) { return r.name == name; });
  return row == rows.end() ? nullptr : &*row;
}

std::vector<std::string> names_of(std::span<const TypeRow> rows) {
  std::vector<std::string> names;
  for (const TypeRow& row : rows) names.emplace_back(row.name);
  return names;
}

std::vector<std::string> words(std::string_view list) {
  std::vector<std::string> all;
  any_word(list, [&](std::string_view word) { return all.emplace_back(word), false; });
  return all;
}

bool has_word(std::string_view list, std::string_view word) {
  return any_word(list, [&](std::string_view w) { return w == word; });
}

std::string not_among(std::string_view what, std::string_view found, const std::vector<std::string>& available,
                      std::string_view later) {
  const std::string quoted = "'" + std::string(found) + "'";
  const std::string list = "; available: " + joined(available);
  if (has_word(later, found)) return std::string(what) + " " + quoted + " is not available in this version" + list;
  std::vector<std::string> all = available;
  for (const std::string& word : words(later)) all.push_back(word);
  return quoted + " is not a known " + std::string(what) + did_you_mean(found, all) + list;
}

bool ties_joints(const Joint& joint) { return joint.type == "gear" || joint.type == "rack_pinion"; }

bool is_sliding(std::string_view motion, std::string_view joint_type) {
  if (!motion.empty()) return motion == "translation";
  return has_word(kJointsWithDisplacement, joint_type) && !has_word(kJointsWithAngle, joint_type);
}

std::string_view type_of(const Force& force) {
  return std::visit([](const auto& kind) { return std::decay_t<decltype(kind)>::kType; }, force.kind);
}

namespace {

// Makes the kind that is called so the one in hand; nothing where there is none.
template <class... Kinds>
void emplace_kind(std::variant<Kinds...>& kind, std::string_view type) {
  ((Kinds::kType == type ? void(kind.template emplace<Kinds>()) : void()), ...);
}

}  // namespace

void set_type(Force& force, std::string_view type) {
  if (type != type_of(force)) emplace_kind(force.kind, type);
}

std::string_view integrator_names() {
  static const std::string names = [] {
    std::string all;
    for (const Method& method : runge_kutta_methods()) all.append(method.name).append(" ");
    return all.append(kMultistepMethods);
  }();
  return names;
}

Dimension dimension_of_drive(std::string_view type, std::string_view coordinate) {
  if (type == "angle") return dimension::kAngle;
  return type == "coordinate" && coordinate.starts_with('e') ? Dimension{} : dimension::kLength;
}

namespace {

bool is_imu_rate(const Sensor& sensor) { return sensor.quantity == "imu" && sensor.component.starts_with('w'); }

}  // namespace

std::optional<Dimension> dimension_of_quantity(const Sensor& sensor) {
  const TypeRow* const row = find_row(kSensorQuantities, sensor.quantity);
  if (!row || has_word(row->unit, "or")) return std::nullopt;
  if (is_imu_rate(sensor)) return dimension::kRate;
  return sensor.kind == "torque" ? dimension::kTorque : row->dimension;
}

Reads reads_of_quantity(const Sensor& sensor) {
  const TypeRow* const row = find_row(kSensorQuantities, sensor.quantity);
  if (!row) return Reads::positions;
  return is_imu_rate(sensor) ? Reads::velocities : row->reads;
}

bool is_identifier(std::string_view text) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  return !text.empty() && letter(text[0]) &&
         std::all_of(text.begin(), text.end(), [&](char c) { return letter(c) || digit(c); });
}

}  // namespace mbsopt
