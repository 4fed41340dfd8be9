#include "app/report/run_page.hpp"

#include <catch2/catch.hpp>

using namespace mbsopt;

TEST_CASE("a value between bounds has its place on the scale of the parameter", "[report]") {
  Scene scene;
  scene.parameters = {{"k", 1}, {"c", 1}};
  scene.parameters[1].scale = ParameterScale::log10;
  const Json bounds{{"lower", 0.01}, {"upper", 100}};
  CHECK(place_between_bounds(scene, "k", bounds)(50.005) == Approx(0.5));
  CHECK(place_between_bounds(scene, "c", bounds)(1) == Approx(0.5));
  CHECK(place_between_bounds(scene, "run1.c", bounds)(0.1) == Approx(0.25));
  CHECK_FALSE(place_between_bounds(scene, "k", {{"lower", 0.01}, {"upper", nullptr}}));
}

TEST_CASE("starts in words: how many of how many, and whether the best one is an optimum", "[report]") {
  Json multistart{{"starts", 10}, {"finished", 10}, {"seed", 5}, {"best", 8}, {"at_the_best_optimum", 4}};
  multistart["waterfall"].push_back(Json{{"start", 8}, {"status", "iteration_limit"}});
  CHECK(counted_starts(multistart) == "all 10 starts");
  CHECK(starts_in_words(multistart) == "all 10 starts, seed 5: 4 at the best optimum");
  multistart["finished"] = 3, multistart["at_the_best_optimum"] = 0;
  CHECK(counted_starts(multistart) == "3 of 10 starts");
  CHECK(starts_in_words(multistart) ==
        "3 of 10 starts, seed 5: the best one has not converged to an optimum (iteration_limit)");
  multistart["best"] = nullptr;
  CHECK(starts_in_words(multistart) == "3 of 10 starts, seed 5: none could be evaluated");
  CHECK(std::string(end_of_search("converged_beyond_limit")) == "optimum");
  CHECK(std::string(end_of_search("iteration_limit")) == "best point");
}
