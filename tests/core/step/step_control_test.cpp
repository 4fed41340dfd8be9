#include "core/step/step_control.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace mbsopt;

TEST_CASE("steps are rounded down, by a hundredth at most", "[step_control]") {
  for (double h = 1e-12; h < 1e6; h *= 1.0037) {
    const double rounded = rounded_step(h);
    INFO("h = " << h);
    CHECK(rounded <= h * (1 + 1e-10));
    CHECK(rounded_step(rounded) == Approx(rounded).epsilon(1e-14));
    CHECK(rounded > h * 0.99);
    CHECK(100 * std::log(rounded) == Approx(std::round(100 * std::log(rounded))).margin(1e-9));
  }
}

TEST_CASE("estimates of error that differ by rounding propose the very same step", "[step_control]") {
  int same = 0, all = 0;
  for (double error = 1e-12; error < 1; error *= 1.013, ++all) {
    StepController one(8, {}), other(8, {});
    if (rounded_step(0.01 * one.after_acceptance(error)) ==
        rounded_step(0.01 * other.after_acceptance(error * (1 + 1e-6))))
      ++same;
  }
  CHECK(all > 2000);
  CHECK(all - same <= 2);  // next to a step of few digits
}

TEST_CASE("an estimate of error so small that it is mostly rounding asks for the largest growth", "[step_control]") {
  for (const int order : {2, 5, 8}) {
    const double small = 0.4 * std::pow(6, -order);
    INFO("order " << order);
    CHECK(StepController(order, {}).after_acceptance(small) == 6);
    CHECK(StepController(order, {}).after_acceptance(1e-3 * small) == 6);
    CHECK(StepController(order, {}).after_acceptance(0) == 6);
    StepController rejected(order, {});
    CHECK(rejected.after_rejection(20) < 1);
    CHECK(rejected.after_acceptance(0) == 1);
  }
}
