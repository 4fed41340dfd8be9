#include "core/expression/dimension.hpp"

#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>

namespace mbsopt {

namespace {

struct UnitEntry {
  std::string_view name;
  double to_si;
  Dimension dimension;
};

using namespace dimension;
constexpr Dimension kPressure{{-1, 1, -2, 0}};
constexpr Dimension kPower{{2, 1, -3, 0}};
constexpr Dimension kFrequency{{0, 0, -1, 0}};
constexpr double kPound = 0.45359237;         // kg, exact (international agreement of 1959)
constexpr double kInch = 0.0254;              // m, exact
constexpr double kStandardGravity = 9.80665;  // m/s^2, exact (CGPM 1901)

constexpr UnitEntry kUnits[] = {
    {"m", 1, kLength},
    {"mm", 1e-3, kLength},
    {"cm", 1e-2, kLength},
    {"um", 1e-6, kLength},
    {"km", 1e3, kLength},
    {"in", kInch, kLength},
    {"ft", 12 * kInch, kLength},
    {"kg", 1, kMass},
    {"g", 1e-3, kMass},
    {"mg", 1e-6, kMass},
    {"t", 1e3, kMass},
    {"lb", kPound, kMass},
    {"s", 1, kTime},
    {"ms", 1e-3, kTime},
    {"us", 1e-6, kTime},
    {"min", 60, kTime},
    {"h", 3600, kTime},
    {"rad", 1, kAngle},
    {"mrad", 1e-3, kAngle},
    {"deg", std::numbers::pi / 180, kAngle},
    {"rev", 2 * std::numbers::pi, kAngle},
    {"rpm", 2 * std::numbers::pi / 60, kRate},
    {"Hz", 1, kFrequency},
    {"N", 1, kForce},
    {"mN", 1e-3, kForce},
    {"kN", 1e3, kForce},
    {"MN", 1e6, kForce},
    {"lbf", kPound* kStandardGravity, kForce},
    {"Nm", 1, kTorque},
    {"J", 1, kTorque},
    {"mJ", 1e-3, kTorque},
    {"kJ", 1e3, kTorque},
    {"W", 1, kPower},
    {"kW", 1e3, kPower},
    {"Pa", 1, kPressure},
    {"kPa", 1e3, kPressure},
    {"MPa", 1e6, kPressure},
    {"GPa", 1e9, kPressure},
};

// Characters that are often typed instead of ASCII.
constexpr std::pair<std::string_view, std::string_view> kSpellings[] = {
    {"\u00b7", "*"}, {"\u22c5", "*"},  {"\u00b0", "deg"}, {"\u00b5", "u"},
    {"\u03bc", "u"}, {"\u00b2", "^2"}, {"\u00b3", "^3"},
};

constexpr int kLargestPower = 9;
constexpr std::size_t kLongestUnit = 100;

std::string in_ascii(std::string_view text) {
  std::string out(text);
  for (const auto& [from, to] : kSpellings)
    for (std::size_t at = out.find(from); at != std::string::npos; at = out.find(from))
      out.replace(at, from.size(), to);
  return out;
}

class UnitParser {
 public:
  explicit UnitParser(std::string_view text) : text_(text) {}

  std::optional<Unit> run() {
    skip_space();
    const std::optional<Unit> unit = product();
    return unit && at_ == text_.size() ? unit : std::nullopt;
  }

 private:
  std::optional<Unit> product() {
    std::optional<Unit> left = factor();
    bool divided = false;
    while (left && at_ < text_.size() && text_[at_] != ')') {
      const bool divides = take('/');
      if (!divides) {
        if (divided) return std::nullopt;  // "N/m s"
        take('*');
      }
      const std::optional<Unit> right = factor();
      if (!right) return std::nullopt;
      left = divides ? Unit{left->to_si / right->to_si, left->dimension / right->dimension}
                     : Unit{left->to_si * right->to_si, left->dimension * right->dimension};
      divided = divided || divides;
    }
    return left;
  }

  std::optional<Unit> factor() {
    std::optional<Unit> base;
    if (take('(')) {
      base = product();
      if (!take(')')) return std::nullopt;
    } else if (take('1')) {
      base = Unit{};
    } else {
      base = named();
    }
    if (!base || !take('^')) return base;
    int exponent = 0;
    const char* const first = text_.data() + at_;
    const auto [last, error] = std::from_chars(first, text_.data() + text_.size(), exponent);
    if (error != std::errc() || std::abs(exponent) > kLargestPower) return std::nullopt;
    at_ += static_cast<std::size_t>(last - first);
    skip_space();
    return Unit{std::pow(base->to_si, exponent), pow(base->dimension, exponent)};
  }

  std::optional<Unit> named() {
    std::size_t end = at_;
    while (end < text_.size() && ((text_[end] >= 'a' && text_[end] <= 'z') || (text_[end] >= 'A' && text_[end] <= 'Z')))
      ++end;
    const std::string_view name = text_.substr(at_, end - at_);
    at_ = end;
    skip_space();
    for (const UnitEntry& entry : kUnits)
      if (entry.name == name) return Unit{entry.to_si, entry.dimension};
    return std::nullopt;
  }

  bool take(char c) {
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    skip_space();
    return true;
  }
  void skip_space() {
    while (at_ < text_.size() && text_[at_] == ' ') ++at_;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

Dimension operator*(const Dimension& a, const Dimension& b) {
  Dimension c;
  for (std::size_t i = 0; i < c.power.size(); ++i) c.power[i] = a.power[i] + b.power[i];
  return c;
}

Dimension operator/(const Dimension& a, const Dimension& b) { return a * pow(b, -1); }

Dimension pow(const Dimension& a, int exponent) {
  Dimension c;
  for (std::size_t i = 0; i < c.power.size(); ++i) c.power[i] = a.power[i] * exponent;
  return c;
}

bool compatible(const Dimension& a, const Dimension& b) {
  for (std::size_t i = 0; i < 3; ++i)
    if (a.power[i] != b.power[i]) return false;
  return true;
}

std::optional<Unit> parse_unit(std::string_view text) {
  if (text.size() > kLongestUnit) return std::nullopt;  // bounds the depth of brackets, too
  return UnitParser(in_ascii(text)).run();
}

std::string known_units() {
  std::string all;
  for (const UnitEntry& entry : kUnits) {
    if (!all.empty()) all += ' ';
    all += entry.name;
  }
  return all;
}

std::string to_string(const Dimension& dimension) {
  // Units in the form that engineers write, instead of kg m/s^2 and so on.
  constexpr std::pair<const char*, Dimension> kNamed[] = {{"N", dimension::kForce},
                                                          {"N m", dimension::kTorque},
                                                          {"N/m", dimension::kStiffness},
                                                          {"N s/m", dimension::kDamping},
                                                          {"N m s", dimension::kTorsionalDamping},
                                                          {"W", kPower},
                                                          {"Pa", kPressure}};
  for (const auto& [name, named] : kNamed)
    if (compatible(dimension, named)) return name;
  struct Base {
    std::size_t index;
    const char* name;
  };
  constexpr Base kOrder[] = {{1, "kg"}, {0, "m"}, {3, "rad"}, {2, "s"}};
  bool mechanical = dimension.power[0] != 0 || dimension.power[1] != 0;
  std::string over, under;
  int divisors = 0;
  for (const auto& [index, name] : kOrder) {
    const int power = dimension.power[index];
    if (power == 0 || (index == 3 && mechanical)) continue;
    std::string& side = power > 0 ? over : under;
    if (!side.empty()) side += ' ';
    side += name;
    if (std::abs(power) > 1) side += "^" + std::to_string(std::abs(power));
    if (power < 0) ++divisors;
  }
  if (over.empty()) over = "1";
  if (under.empty()) return over;
  return over + "/" + (divisors > 1 ? "(" + under + ")" : under);
}

}  // namespace mbsopt
