#include "core/scene/type_table.hpp"

#include <catch2/catch.hpp>

#include "core/scene/scene_path.hpp"

using namespace mbsopt;

TEST_CASE("rows say what a type needs, may have and does not know", "[scene]") {
  const TypeRow* const revolute = find_row(kJointTypes, "revolute");
  REQUIRE(revolute);
  CHECK((*revolute)["axis1"] == Need::required);
  CHECK((*revolute)["normal1"] == Need::optional);
  CHECK((*revolute)["axis"] == Need::unknown);
  CHECK(find_row(kJointTypes, "gearbox") == nullptr);
}

TEST_CASE("a wrong choice is answered with what is available", "[scene]") {
  CHECK(not_among("type", "revolut", {"revolute", "spherical"}) ==
        "'revolut' is not a known type (did you mean 'revolute'?); available: revolute, spherical");
  CHECK(not_among("type", "", {"a"}) == "'' is not a known type; available: a");
}

TEST_CASE("identifiers", "[scene]") {
  for (const char* good : {"a", "_a", "A1", "theta_0"}) CHECK(is_identifier(good));
  for (const char* bad : {"", "1a", "a b", "a-b", "a.b", "\xC3\xA4"}) CHECK_FALSE(is_identifier(bad));
}

TEST_CASE("paths quote keys that are no identifiers", "[scene]") {
  CHECK(child_path("", "bodies") == "bodies");
  CHECK(child_path(child_path("bodies", 2), "mass") == "bodies[2].mass");
  CHECK(child_path("objectives", "tip error") == "objectives[\"tip error\"]");
}
