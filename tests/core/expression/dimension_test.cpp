#include "core/expression/dimension.hpp"

#include <catch2/catch.hpp>
#include <map>

#include "core/expression/dimension_inference.hpp"

using namespace mbsopt;

namespace {

std::optional<Dimension> infer(const std::string& text) {
  static const std::map<std::string, Dimension> kNames{
      {"L", dimension::kLength}, {"m", dimension::kMass},    {"k", dimension::kStiffness},
      {"a", dimension::kAngle},  {"J", dimension::kInertia}, {"g", dimension::kAcceleration},
  };
  return infer_dimension(Expression::parse(text), [](const std::string& name) -> std::optional<Dimension> {
    const auto it = kNames.find(name);
    return it == kNames.end() ? std::nullopt : std::optional(it->second);
  });
}

bool mixes(const std::string& text) {
  try {
    infer(text);
  } catch (const DimensionError&) {
    return true;
  }
  return false;
}

}  // namespace

TEST_CASE("units are products, quotients and powers of known ones", "[expression]") {
  const struct {
    const char* text;
    double to_si;
    Dimension dimension;
  } cases[] = {
      {"m", 1, dimension::kLength},
      {" mm ", 1e-3, dimension::kLength},
      {"N/mm", 1e3, dimension::kStiffness},
      {"kg m^2", 1, dimension::kInertia},
      {"kg*m^2", 1, dimension::kInertia},
      {"kg mm^2", 1e-6, dimension::kInertia},
      {"N s/m", 1, dimension::kDamping},
      {"N*s/m", 1, dimension::kDamping},
      {"N/(m/s)", 1, dimension::kDamping},
      {"1/s", 1, {{0, 0, -1, 0}}},
      {"m s^-2", 1, dimension::kAcceleration},
      {"m/s^2", 1, dimension::kAcceleration},
      {"m/s/s", 1, dimension::kAcceleration},
      {"1/(m s)", 1, {{-1, 0, -1, 0}}},
      {"g/cm^3", 1000, {{-3, 1, 0, 0}}},
      {"\u00b0", 3.14159265358979323846 / 180, dimension::kAngle},
      {"kg m\u00b2", 1, dimension::kInertia},
      {"N\u00b7m", 1, dimension::kTorque},
      {"lbf/in", 175.12683524647636, dimension::kStiffness},
      {"MPa", 1e6, {{-1, 1, -2, 0}}},
  };
  for (const auto& c : cases) {
    CAPTURE(c.text);
    const std::optional<Unit> unit = parse_unit(c.text);
    REQUIRE(unit);
    CHECK(unit->to_si == Approx(c.to_si).epsilon(1e-14));
    CHECK(unit->dimension == c.dimension);
  }
}

TEST_CASE("what is not a unit, or could be read in two ways, is refused", "[expression]") {
  for (const char* text :
       {"", "furlong", "N/m s", "N/", "/s", "m^", "m^x", "m^99", "2", "(m", "m)", "m**2", "m^2.5", "()"})
    CHECK_FALSE(parse_unit(text));
  CHECK_FALSE(parse_unit(std::string(100000, '(')));
}

TEST_CASE("dimensions are written in SI base units", "[expression]") {
  CHECK(to_string(dimension::kForce) == "N");
  CHECK(to_string(dimension::kStiffness) == "N/m");
  CHECK(to_string(dimension::kRate) == "rad/s");
  CHECK(to_string(Dimension{{-1, 0, -1, 0}}) == "1/(m s)");
  CHECK(to_string(Dimension{}) == "1");
}

TEST_CASE("the dimension of an expression follows from its names and units", "[expression]") {
  CHECK(infer("-L") == dimension::kLength);
  CHECK(infer("m*L^2") == dimension::kInertia);
  CHECK(infer("sqrt(L^2 + (3 [cm])^2)") == dimension::kLength);
  CHECK(infer("m*g/k") == dimension::kLength);
  CHECK(infer("L + 3") == dimension::kLength);
  CHECK(infer("3 + L") == dimension::kLength);
  CHECK(infer("min(L, 2, 1 [mm])") == dimension::kLength);
  CHECK(infer("smooth_max(L, 1)") == dimension::kLength);
  CHECK(infer("atan2(L, L + 2)") == dimension::kAngle);
  CHECK(infer("2*3 - pi") == Dimension{});
  CHECK(infer("pi*L^2") == Dimension{{2, 0, 0, 0}});
  CHECK(infer("smooth_max(L, 2 [cm])") == dimension::kLength);
  CHECK(infer("12 [m]/2 [s]") == dimension::kVelocity);
  CHECK(infer("L/2") == std::nullopt);  // 2 may be a time
  CHECK(infer("m*0.5^2/12") == std::nullopt);
  CHECK(infer("sin(a)") == Dimension{});
  CHECK(infer("7850 [kg/m^3]*L^3") == dimension::kMass);
  CHECK(infer("L*unknown") == std::nullopt);
  CHECK(infer("L^unknown") == std::nullopt);
  CHECK(infer("sqrt(L)") == std::nullopt);
  CHECK(compatible(*infer("sqrt(k/m)"), dimension::kRate));
}

TEST_CASE("dimensions that do not fit each other are refused, pure numbers fit all", "[expression]") {
  CHECK(mixes("L + m"));
  CHECK(mixes("L + 90 [deg]"));
  CHECK(mixes("L - 1 [kg]"));
  CHECK(mixes("max(L, k)"));
  CHECK(mixes("sin(L)"));
  CHECK(mixes("exp(k)"));
  CHECK(mixes("2^L"));
  CHECK(mixes("atan2(L, m)"));
  CHECK_FALSE(mixes("sin(2*a + 1)"));
  CHECK_FALSE(mixes("exp(-L/2 [m])"));
  CHECK_FALSE(mixes("L + unknown*m"));
  CHECK_FALSE(mixes("L + 2*m"));
  CHECK(fits(infer("m*0.5^2/12"), dimension::kInertia));
  CHECK(fits(infer("3"), dimension::kMass));
  CHECK(fits(infer("L/L"), dimension::kMass));
  CHECK(fits(infer("unknown"), dimension::kMass));
  CHECK(fits(infer("a"), dimension::kAngle));
  CHECK_FALSE(fits(infer("90 [deg]"), dimension::kLength));
  CHECK_FALSE(fits(infer("L"), dimension::kMass));
}

TEST_CASE("a dimension error points at the operator", "[expression]") {
  try {
    infer("1 + 2*(L + m)");
    FAIL("must throw");
  } catch (const DimensionError& error) {
    CHECK(error.offset == 9);
    CHECK(std::string(error.what()).find("m with kg") != std::string::npos);
  }
}
