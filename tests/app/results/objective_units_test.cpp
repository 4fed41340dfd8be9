#include "app/results/objective_units.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "app/json/read_problem.hpp"
#include "source_folder.hpp"

using namespace mbsopt;

namespace {

// A bar on a hinge and a spring, with the given objectives.
ObjectiveUnits units_with(const std::string& objectives) {
  const std::string text = R"({"format": 1, "name": "bar",
    "parameters": {"k": {"value": 1, "unit": "N/m"}, "w": {"value": 2}, "goal": {"value": 0.1, "unit": "m"}},
    "bodies": [{"name": "bar", "mass": 1, "inertia": [1, 1, 1], "points": {"tip": [1, 0, 0]}}],
    "joints": [{"name": "A", "type": "revolute", "body2": "bar", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}],
    "forces": [{"name": "spring", "type": "tsda", "body2": "bar", "point1": [1, 1, 0], "point2": "tip",
                "stiffness": "k*w*goal/goal", "free_length": 1}],
    "sensors": {"x": {"quantity": "position", "body": "bar", "point": "tip", "component": "x"},
                "theta": {"quantity": "angle", "joint": "A"},
                "F": {"quantity": "force", "force": "spring"},
                "E": {"quantity": "energy", "component": "kinetic"}},
    "simulation": {"start_time": 0, "end_time": 1}, "objectives": )" +
                           objectives + "}";
  return objective_units(read_problem_text(text, "bar.json"));
}

}  // namespace

TEST_CASE("the unit of an objective follows from its sensors, parameters and the time", "[results]") {
  const ObjectiveUnits units = units_with(R"({
    "miss": {"terminal": "(x - goal)^2"}, "travel": {"running": "theta^2"}, "work": {"running": "E"},
    "peak": {"maximum_of": "F"}, "rms": {"rms_of": "theta - 0.5"}, "samples": {"samples": [{"time": 1, "value": "x"}]},
    "ratio": {"terminal": "x/goal"}, "sum": {"running": "x^2", "terminal": "3*x^2*t"}, "wave": {"running": "(x - 0.2*sin(5*t))^2"}})");
  CHECK(units.at("miss") == "m^2");
  CHECK(units.at("travel") == "rad^2 s");
  CHECK(units.at("work") == "N m s");
  CHECK(units.at("peak") == "N");
  CHECK(units.at("rms") == "rad");
  CHECK(units.at("samples") == "m");
  CHECK(units.at("ratio") == "-");
  CHECK(units.at("sum") == "m^2 s");
  CHECK(units.at("wave") == "m^2 s");
}

TEST_CASE("where parts have no unit or do not fit each other, that of the objective is not known", "[results]") {
  const ObjectiveUnits units = units_with(
      R"({"weighed": {"terminal": "w*x^2"}, "mixed": {"running": "x^2", "terminal": "theta^2 + F"},
          "root": {"terminal": "x^0.5"}})");
  CHECK(units.at("weighed").empty());
  CHECK(units.at("mixed").empty());
  CHECK(units.at("root").empty());
  CHECK(shown_unit(units, "mixed") == kUnknownUnit);
  CHECK(shown_unit(units, "mixed") != shown_unit(units_with(R"({"ratio": {"terminal": "x/goal"}})"), "ratio"));
  CHECK(objective_line("mixed", {{"value", 1}}) == "mixed = 1\n");
  CHECK(objective_line("miss", {{"value", 1}, {"unit", "m^2"}}) == "miss = 1 m^2\n");
}

TEST_CASE("units stand beside the values of a result and of its load cases", "[results]") {
  Json result;
  result["objectives"] = {{"a", {{"value", 1}}}, {"b", {{"value", 2}}}};
  result["cases"]["cold"]["objectives"]["a"]["value"] = 3;
  add_units(result, {{"a", "m"}, {"b", ""}});
  CHECK(result["objectives"]["a"]["unit"] == "m");
  CHECK_FALSE(result["objectives"]["b"].contains("unit"));
  CHECK(result["cases"]["cold"]["objectives"]["a"]["unit"] == "m");
}

TEST_CASE("a table of objectives has those of load cases, with their units and margins", "[results]") {
  Json result;
  result["objectives"]["a"] = {{"value", 1}, {"unit", "m"}, {"lower", nullptr}, {"upper", 1.5}};
  result["cases"]["cold"]["objectives"]["a"] = {{"value", 2}, {"true_value", 2.25}, {"lower", 2.5}, {"upper", nullptr}};
  const Json rows = objective_rows(result);
  CHECK(rows.at("a").at("margin") == 0.5);
  CHECK(rows.at("a (cold)").at("margin") == -0.25);
  CHECK(rows.at("a (cold)").at("unit") == "m");
  CHECK(objective_table(result).text() ==
        "objective  value  unit  true extreme\n"
        "a              1  m\n"
        "a (cold)       2  m             2.25\n");
}
