// The physical dimension of a number with a unit, as powers of the SI base units of mechanics.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace mbsopt {

struct Dimension {
  // m, kg, s, rad. Angles have a power of their own, so that "[deg]" does not fit a length. With other units they count
  // as pure numbers: N m/rad is N m, and rad/s is 1/s.
  std::array<int, 4> power{0, 0, 0, 0};
  bool operator==(const Dimension&) const = default;
  bool is_none() const { return *this == Dimension{}; }
};

Dimension operator*(const Dimension& a, const Dimension& b);
Dimension operator/(const Dimension& a, const Dimension& b);
Dimension pow(const Dimension& a, int exponent);

// Returns whether a quantity of one dimension may replace one of the other: the powers are equal except for the angle.
bool compatible(const Dimension& a, const Dimension& b);

struct Unit {
  double to_si = 1;
  Dimension dimension;
};

// Reads "N/mm", "kg m^2", "deg", "1/s", "N*s/m", "1/(m s)": factors, side by side or with "*", and quotients from left
// to right. A product after "/" needs brackets, because "N/m s" is ambiguous. Returns nullopt for an unknown unit.
std::optional<Unit> parse_unit(std::string_view text);
std::string known_units();                          // "m, mm, ..."
std::string to_string(const Dimension& dimension);  // "N/m", "kg m"

namespace dimension {
inline constexpr Dimension kNone{};
inline constexpr Dimension kLength{{1, 0, 0, 0}};
inline constexpr Dimension kMass{{0, 1, 0, 0}};
inline constexpr Dimension kTime{{0, 0, 1, 0}};
inline constexpr Dimension kAngle{{0, 0, 0, 1}};
inline constexpr Dimension kRate{{0, 0, -1, 1}};
inline constexpr Dimension kVelocity{{1, 0, -1, 0}};
inline constexpr Dimension kAcceleration{{1, 0, -2, 0}};
inline constexpr Dimension kInertia{{2, 1, 0, 0}};
inline constexpr Dimension kForce{{1, 1, -2, 0}};
inline constexpr Dimension kTorque{{2, 1, -2, 0}};  // of energy, too; and of a torsional stiffness
inline constexpr Dimension kStiffness{{0, 1, -2, 0}};
inline constexpr Dimension kDamping{{0, 1, -1, 0}};
inline constexpr Dimension kTorsionalDamping{{2, 1, -1, 0}};
}  // namespace dimension

}  // namespace mbsopt
