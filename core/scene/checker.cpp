#include "core/scene/checker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "core/expression/did_you_mean.hpp"
#include "core/expression/dimension_inference.hpp"
#include "core/expression/syntax_tree.hpp"

namespace mbsopt {

namespace {

constexpr std::size_t kListed = 20;
// A hint compares a name with all others. Only so many errors get hints, because no more are shown.
constexpr std::size_t kWithHints = 100;

// "; bodies: ground, crank"
std::string listed(std::string_view what, std::vector<std::string> names) {
  const bool more = names.size() > kListed;
  if (more) names.resize(kListed);
  if (names.empty()) return "; there are no " + std::string(what);
  return "; " + std::string(what) + ": " + joined(names) + (more ? ", ..." : "");
}

struct Kind {
  const char* one;
  const char* all;
};
constexpr Kind kKinds[kElementKinds] = {{"body", "bodies"},         {"joint", "joints"},   {"drive", "drives"},
                                        {"force", "forces"},        {"sensor", "sensors"}, {"parameter", "parameters"},
                                        {"objective", "objectives"}};

constexpr std::size_t kLongestName = 255;  // bytes, as of a file: a problem's name becomes one

// Finds the first control character (C0, DEL, C1) or one that changes the order of text (Unicode UAX #9) or its lines:
// U+061C, U+200E, U+200F, U+2028 to U+202E, U+2066 to U+2069. Returns npos if there is none. The text is UTF-8.
std::size_t unreadable_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const unsigned b0 = byte(i), b1 = byte(i + 1), b2 = byte(i + 2);
    const bool control = b0 < 0x20 || b0 == 0x7F || (b0 == 0xC2 && b1 >= 0x80 && b1 < 0xA0);
    const bool direction = (b0 == 0xD8 && b1 == 0x9C) ||
                           (b0 == 0xE2 && b1 == 0x80 && (b2 == 0x8E || b2 == 0x8F || (b2 >= 0xA8 && b2 <= 0xAE))) ||
                           (b0 == 0xE2 && b1 == 0x81 && b2 >= 0xA6 && b2 <= 0xA9);
    if (control || direction) return i;
  }
  return std::string::npos;
}

}  // namespace

std::string text_of(double value) { return std::isnan(value) ? "not a number" : Expression(value).text(); }

void Checker::name(std::string_view key, const std::string& value, const FieldInfo&) {
  if (value.empty()) return refuse(key, "is empty, a name is expected");
  must_be_readable(path(key), value);
  if (value.find_first_of(".,;\"'[]/\\") != std::string::npos)
    refuse(key, "the name '{}' must not contain . , ; \" ' [ ] / \\ or control characters", value);
}

void Checker::must_be_readable(const std::string& where, const std::string& name) {
  if (name.size() > kLongestName)
    issue(where, filled("the name is {} bytes long, at most {} are allowed", name.size(), kLongestName));
  if (const std::size_t at = unreadable_character(name); at != std::string::npos)
    issue(where, filled("the name has a control character or a mark of text direction at byte {}; it must show as it "
                        "is written",
                        at + 1));
}

void Checker::must_be_identifier(const std::string& where, const std::string& name) {
  if (!is_identifier(name))
    return issue(
        where, filled("the name '{}' must be an identifier: letters, digits and _, not beginning with a digit", name));
  must_be_readable(where, name);
  if (has_word(kReservedNames, name))
    issue(where, filled("the name '{}' is reserved; reserved are {}", name, joined(words(kReservedNames))));
  else if (find_function(name))
    issue(where, filled("the name '{}' is that of a function", name));
}

void Checker::check_reference(const std::string& where, const std::string& value, ElementKind what) {
  if (facts_.has(what, value)) return;
  const auto [one, all] = kKinds[static_cast<std::size_t>(what)];
  const std::string text = filled("there is no {} '{}'", one, value);
  if (issues_.size() >= kWithHints) return issue(where, text);
  const std::vector<std::string>& names = facts_.names(what);
  issue(where, text + did_you_mean(value, names) + listed(all, names));
}

void Checker::reference(std::string_view key, const std::string& value, ElementKind what, const FieldInfo& info) {
  if (info.need == Need::unknown || (value.empty() && info.need == Need::optional)) return;
  if (value.empty()) return refuse(key, "is missing; expected: {}", info.description);
  check_reference(path(key), value, what);
}

void Checker::references(std::string_view key, const std::vector<std::string>& values, ElementKind what,
                         const FieldInfo& info) {
  if (values.empty() && info.need == Need::required) refuse(key, "is empty; expected: {}", info.description);
  std::set<std::string> listed_before;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string where = child_path(path(key), i);
    check_reference(where, values[i], what);
    if (!listed_before.insert(values[i]).second) issue(where, filled("'{}' is listed twice", values[i]));
  }
}

void Checker::word(std::string_view key, const std::string& value, const Words& allowed, const FieldInfo& info) {
  if (info.need == Need::unknown) return;
  if (value.empty() && info.need == Need::required)
    refuse(key, "is missing; available: {}", joined(words(allowed.available)));
  else if (!value.empty() && !has_word(allowed.available, value))
    issue(path(key), not_among(key, value, words(allowed.available)));
}

const TypeRow* Checker::type(std::string_view key, std::string_view current, std::span<const TypeRow> rows,
                             const FieldInfo&) {
  const TypeRow* const row = find_row(rows, current);
  if (!row) issue(path(key), not_among(key, current, names_of(rows)));
  return row;
}

bool Checker::names_are_known(const std::string& where, const Expression& value, Scope names) {
  const Symbols& symbols = facts_.symbols(names);
  bool known = true;
  for (const std::string& name : value.names()) {
    if (symbols.input(name) >= 0) continue;
    if (symbols.definition(name)) {
      known = known && !facts_.is_broken(name);
      continue;
    }
    known = false;
    std::string message = filled("unknown name '{}'", name);
    if (issues_.size() < kWithHints) {
      const std::vector<std::string> all = symbols.names();
      message += all.empty() ? "" : did_you_mean(name, all) + listed("known names", all);
    }
    const auto node = std::ranges::find(value.tree().nodes, name, &SyntaxNode::name);
    issues_.push_back({where, message, false, node->offset});
  }
  return known;
}

void Checker::check_dimension(const std::string& where, const Expression& value, Scope names,
                              const std::optional<Dimension>& expected) {
  try {
    const auto found = infer_dimension(value, [&](const std::string& name) {
      return names == Scope::sensor ? facts_.dimension_in_sensor(name) : facts_.dimension_of_name(name);
    });
    if (expected && !fits(found, *expected))
      issue(where,
            filled("'{}' has the dimension {}, expected is {}", value.text(), to_string(*found), to_string(*expected)));
    if (expected && (!found || found->is_none())) ask_for_degrees(where, value, names, *expected);
  } catch (const DimensionError& error) {
    issues_.push_back({where, error.what(), false, error.offset});
  }
}

// Asks for the unit of an angle of more than a turn, or of a rate that is a round number in degrees: a multiple of an
// eighth of a turn. Multiples of 50 are round in radians, too. Who writes pi or a unit means radians.
void Checker::ask_for_degrees(const std::string& where, const Expression& value, Scope names,
                              const Dimension& expected) {
  const bool is_law = names == Scope::time_law;
  const bool is_angle = expected == dimension::kAngle, is_rate = expected == dimension::kRate;
  if (!(is_angle || is_rate) || !(is_law || names == Scope::none)) return;
  const auto law = is_law ? facts_.law_at(value, facts_.scene().simulation.start_time) : std::nullopt;
  const double x = is_law ? 0 : facts_.value(value).value_or(0);
  const double angle = law ? (*law)[0] : is_angle ? x : 0, rate = law ? (*law)[1] : is_rate ? x : 0;
  const bool is_large = std::abs(angle) > 2 * std::numbers::pi;
  const bool is_round = rate != 0 && std::remainder(rate, 45) == 0 && std::remainder(rate, 50) != 0;
  const std::string& text = value.text();
  if (!is_large && !is_round) return;
  if (text.find_first_of('[') != std::string::npos || text.find("pi") != std::string::npos) return;
  const std::string per = is_large ? "" : "/s", found = text_of(is_large ? angle : rate);
  warning(where, filled("'{0}' is {1} rad{2}{3}: are degrees meant? Write the unit, as in \"{1} [deg{2}]\" or "
                        "\"[rad{2}]\"",
                        text, found, per, is_law ? " at the start" : ""));
}

void Checker::check_expression(const std::string& where, const Expression& value, Scope names,
                               const std::optional<Dimension>& expected) {
  if (!names_are_known(where, value, names)) return;
  if (names == Scope::state) check_sensors_of_state(where, value);
  if (names != Scope::objective) check_dimension(where, value, names, expected);
  if (value.is_number() || names == Scope::none) check_size(where, value);
}

// Sums of squares must stay below the largest double, 1.8e308.
void Checker::check_size(const std::string& where, const Expression& value) {
  constexpr double kLargest = 1e150;
  const std::optional<double> x = facts_.any_value(value);
  if (!x || std::abs(*x) <= kLargest) return;
  issue(where, filled("'{}' is {} at the values of the parameters; {}", value.text(), *x,
                      std::isfinite(*x) ? filled("its square must be a number: at most {} is allowed", kLargest)
                                        : "it must be finite"));
}

// Accelerations and reactions follow from the forces, so no force may depend on them.
void Checker::check_sensors_of_state(const std::string& where, const Expression& value) {
  for (const std::string& name : value.names()) {
    const Sensor* const sensor = facts_.sensor(name);
    if (sensor && facts_.reads_of(*sensor) == Reads::motion)
      issue(where, filled("uses the sensor '{}', whose quantity is {}: it follows from the forces, so a force cannot "
                          "depend on it; sensors of positions, velocities, angles, energies and spring forces can be "
                          "used",
                          name, sensor->quantity));
  }
}

void Checker::named_point(const std::string& where, const std::string& body, const std::string& name) {
  if (name == "O") return;
  const Body* const owner = facts_.body(body);
  if (!owner && body != "ground") return;  // the body is what is wrong
  std::vector<std::string> known{"O"};
  if (owner) {
    if (owner->points.contains(name)) return;
    for (const auto& [point, coordinates] : owner->points) known.push_back(point);
  }
  issue(where, filled("body '{}' has no point '{}'", body, name) + did_you_mean(name, known) + listed("points", known));
}

void Checker::point(std::string_view key, const std::optional<PointField>& value, const std::string& body,
                    const FieldInfo& info) {
  if (value && info.need == Need::unknown)
    refuse(key, "is given, and this type does not have it");
  else if (value)
    point(key, *value, body, info);
  else if (info.need == Need::required)
    refuse(key, "is missing; expected: {}", info.description);
}

void Checker::defined_point(const std::string& where, const std::string& name) {
  if (is_identifier(name)) must_be_readable(where, name);
  if (!is_identifier(name) || name == "O")
    issue(where, filled("the name '{}' of a point must be an identifier other than 'O', which is the origin", name));
}

void Checker::expression(std::string_view key, const Expression& value, Scope names, const FieldInfo& info) {
  // Scope::none here means parameters_only, where weights without units are usual, as in other objectives.
  if (names == Scope::none && !info.dimension) {
    if (names_are_known(path(key), value, names)) check_size(path(key), value);
  } else {
    check_expression(path(key), value, names, info.dimension);
  }
}

void Checker::time_law(std::string_view key, const Expression& value, const std::optional<SampledLaw>& samples,
                       const FieldInfo& info) {
  FieldWalk::time_law(key, value, samples, info);
  if (!samples) return;
  below(path(key), [&] {
    check(*samples);
    if (info.dimension) check_quantity(*this, *samples, *info.dimension);
  });
}

void Checker::check_number(const std::string& at, double value, const Range& range) {
  if (!std::isfinite(value))
    issue(at, filled("is {}, it must be finite", value));
  else if (value < range.least || (range.open && value == range.least))
    issue(at, filled("is {}, it must be {} {}", value, range.open ? "greater than" : "at least", range.least));
}

void Checker::numbers(std::string_view key, const std::vector<double>& values, const Range& range, const FieldInfo&) {
  for (std::size_t i = 0; i < values.size(); ++i) check_number(child_path(path(key), i), values[i], range);
}

void Checker::values_of(std::string_view key, const std::vector<std::pair<std::string, double>>& values,
                        ElementKind what, const Range& range, const FieldInfo&) {
  for (const auto& [name, value] : values) {
    check_reference(child_path(path(key), name), name, what);
    check_number(child_path(path(key), name), value, range);
  }
}

void Checker::tolerance(std::string_view key, double value, const std::optional<KindTolerances>& kinds,
                        const FieldInfo& info) {
  if (!kinds) return plain(key, value, kPositive, info);
  object(key, kinds, info);
  if (!kinds->position && !kinds->angle && !kinds->velocity && !kinds->rate)
    refuse(key, "needs at least one of the tolerances position, angle, velocity and rate");
}

}  // namespace mbsopt
