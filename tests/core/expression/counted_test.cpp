#include "core/expression/counted.hpp"

#include <catch2/catch.hpp>

using namespace mbsopt;

TEST_CASE("counts agree with their nouns", "[counted]") {
  CHECK(counted(1, "step") == "1 step");
  CHECK(counted(0, "step") == "0 steps");
  CHECK(counted(2u, "body", "bodies") == "2 bodies");
  CHECK(counted(1L, "degree of freedom", "degrees of freedom") == "1 degree of freedom");
}
