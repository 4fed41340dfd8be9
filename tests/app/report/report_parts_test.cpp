#include "app/report/report_parts.hpp"

#include <catch2/catch.hpp>

using namespace mbsopt;

TEST_CASE("a value between bounds has its place on the scale of the parameter", "[report]") {
  Scene scene;
  scene.parameters = {{"k", 1}, {"c", 1}};
  scene.parameters[1].scale = ParameterScale::log10;
  const Json bounds{{"lower", 0.01}, {"upper", 100}};
  CHECK((*bounds_of(scene, "k", bounds))(50.005) == Approx(0.5));
  CHECK((*bounds_of(scene, "c", bounds))(1) == Approx(0.5));
  CHECK((*bounds_of(scene, "run1.c", bounds))(0.1) == Approx(0.25));
  CHECK_FALSE(bounds_of(scene, "k", {{"lower", 0.01}, {"upper", nullptr}}).has_value());
}
