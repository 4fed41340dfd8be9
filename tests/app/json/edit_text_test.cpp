#include "app/json/edit_text.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "app/json/input_error.hpp"
#include "app/json/read_problem.hpp"

using namespace mbsopt;

TEST_CASE("parameter values are replaced in place, all else stays as written", "[json]") {
  const std::string text = R"({ // a comment with "parameters": {"k1": 1}
  "parameters": {
    "k1": {"value":  100 , "lower": 1},  /* the first */
    "k2": 3,
    "k3": {"lower": 0, "value": "4 [N/mm]"}
  },
  "name": "k1"
})";
  const std::string expected = R"({ // a comment with "parameters": {"k1": 1}
  "parameters": {
    "k1": {"value":  0.10000000000000001 , "lower": 1},  /* the first */
    "k2": -0.25,
    "k3": {"lower": 0, "value": 4000}
  },
  "name": "k1"
})";
  CHECK(with_parameter_values(text, {{"k1", 0.1}, {"k2", -0.25}, {"k3", 4000}}) == expected);
  CHECK(with_parameter_values(text, {}) == text);
}

TEST_CASE("a number written out reads back as the same double", "[json]") {
  for (const double x : {1.0 / 3, 2.1469536808839935, 1e-300, 1.7976931348623157e308, -0.1}) {
    const std::string text = with_parameter_values(
        R"({"bodies": [{"name": "a", "mass": 1, "inertia": [1, 1, 1]}],
            "parameters": {"m": {"value": 1, "allow_unused": true}}})",
        {{"m", x}});
    if (x > 0) CHECK(read_problem_text(text, "t.json").scene.parameters.at(0).value == x);
    CHECK(std::strtod(text.substr(text.rfind("value\": ") + 8).c_str(), nullptr) == x);
  }
}

TEST_CASE("what is missing on the way to a value is added", "[json]") {
  CHECK(with_value("{}", "parameters.k1.value", "2") == R"({"parameters": {"k1": {"value": 2}}})");
  CHECK(with_value(R"({"name": "x"})", "simulation.end_time", "2") ==
        R"({"simulation": {"end_time": 2}, "name": "x"})");
  CHECK(with_value(R"({"parameters": {"k1": 5}})", "parameters.k1.lower", "2") ==
        R"({"parameters": {"k1": {"value": 5, "lower": 2}}})");
  CHECK(with_value(R"({"bodies": [{"mass": 1}, {"mass": 2}]})", "bodies[1].mass", "\"m\"") ==
        R"({"bodies": [{"mass": 1}, {"mass": "m"}]})");
  CHECK(with_value(R"({"a": {}})", "a[\"odd key\"]", "1") == R"({"a": {"odd key": 1}})");
}

TEST_CASE("a path that leads nowhere is refused", "[json]") {
  CHECK_THROWS_AS(with_value(R"({"bodies": []})", "bodies[0].mass", "1"), InputError);
  CHECK_THROWS_AS(with_value(R"({"name": "x"})", "name.value", "1"), InputError);
  CHECK_THROWS_AS(with_value("{}", "", "1"), InputError);
  CHECK_THROWS_AS(with_value("{", "name", "1"), InputError);
}

TEST_CASE("a member is taken out with its comma, and nothing else", "[json]") {
  const std::string text = R"({"a": 1, "b": {"c": 2, "d": [3]}, "e": 4})";
  CHECK(without_member(text, "a") == R"({"b": {"c": 2, "d": [3]}, "e": 4})");
  CHECK(without_member(text, "b.d") == R"({"a": 1, "b": {"c": 2}, "e": 4})");
  CHECK(without_member(text, "b.c") == R"({"a": 1, "b": {"d": [3]}, "e": 4})");
  CHECK(without_member(R"({"b": {"c": 2}})", "b.c") == R"({"b": {}})");
  CHECK(without_member(text, "b.none") == text);
  CHECK(without_member(text, "a.c") == text);
}

TEST_CASE("an override is applied to the text as it is when it is read", "[json]") {
  const std::string text = R"({"name": "x", "bodies": [{"mass": 1}], "parameters": {"k": 1}})";
  CHECK(with_override(text, "bodies[0].mass=2.5") ==
        R"({"name": "x", "bodies": [{"mass": 2.5}], "parameters": {"k": 1}})");
  CHECK(with_override(text, "bodies[0].mass=2*k") ==
        R"({"name": "x", "bodies": [{"mass": "2*k"}], "parameters": {"k": 1}})");
  CHECK(with_override(text, "parameters.k.value=3") ==
        R"({"name": "x", "bodies": [{"mass": 1}], "parameters": {"k": 3}})");
}
