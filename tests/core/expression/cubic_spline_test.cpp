#include "core/expression/cubic_spline.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

using namespace mbsopt;

TEST_CASE("a spline reproduces a cubic everywhere, its derivatives too", "[spline]") {
  auto f = [](double t) { return 1 + t * (2 + t * (-3 + 0.5 * t)); };
  auto f_t = [](double t) { return 2 + t * (-6 + 1.5 * t); };
  auto f_tt = [](double t) { return -6 + 3 * t; };
  std::vector<double> times{0, 0.3, 0.7, 1.1, 2, 2.4}, values;
  for (const double t : times) values.push_back(f(t));
  const CubicSpline spline(times, values);
  for (double t = -0.2; t < 2.7; t += 0.05) {
    const CubicSpline::Jet jet = spline(t);
    CHECK(jet.f == Approx(f(t)).margin(1e-13));
    CHECK(jet.f_t == Approx(f_t(t)).margin(1e-12));
    CHECK(jet.f_tt == Approx(f_tt(t)).margin(1e-11));
  }
}

TEST_CASE("two samples give a line, three a parabola", "[spline]") {
  CHECK(CubicSpline({0, 2}, {1, 5})(0.5).f == Approx(2));
  const CubicSpline parabola({0, 1, 3}, {0, 1, 9});
  for (const double t : {0.2, 0.9, 1.7, 2.9}) {
    CHECK(parabola(t).f == Approx(t * t).margin(1e-14));
    CHECK(parabola(t).f_tt == Approx(2).margin(1e-13));
  }
}

TEST_CASE("a spline is twice continuously differentiable and converges at order 4", "[spline]") {
  auto error = [](int n) {
    std::vector<double> times, values;
    for (int i = 0; i <= n; ++i) times.push_back(3.0 * i / n), values.push_back(std::sin(times.back()));
    const CubicSpline spline(times, values);
    double worst = 0;
    for (int i = 0; i < 4000; ++i) worst = std::max(worst, std::abs(spline(7.4e-4 * i).f - std::sin(7.4e-4 * i)));
    for (std::size_t i = 1; i + 1 < times.size(); ++i) {
      const double e = 1e-9;
      CHECK(spline(times[i] - e).f_tt == Approx(spline(times[i] + e).f_tt).margin(1e-6));
    }
    return worst;
  };
  CHECK(std::log2(error(80) / error(160)) == Approx(4).margin(0.2));
}

TEST_CASE("a spline refuses times that do not increase", "[spline]") {
  CHECK_THROWS_AS(CubicSpline({0, 1, 1}, {0, 1, 2}), std::invalid_argument);
  CHECK_THROWS_AS(CubicSpline({0}, {0}), std::invalid_argument);
}

TEST_CASE("a spline's slopes do not depend on the unit of time, and one beyond all numbers is refused", "[spline]") {
  const std::vector<double> values{0, 1, 0.5, 2, 1};
  const auto spline = [&](double unit) { return CubicSpline({0, unit, 1.5 * unit, 3 * unit, 4 * unit}, values); };
  const double slope = spline(1)(2).f_t;
  for (const double unit : {1e-100, 1e-12, 1e12, 1e156}) {
    INFO(unit);
    CHECK(spline(unit)(2 * unit).f_t * unit == Approx(slope).epsilon(1e-12));
  }
  CHECK_THROWS_AS(spline(1e-162), std::invalid_argument);
  CHECK_THROWS_AS(CubicSpline({0, 1, 2, 3, 4}, {0, 1e308, -1e308, 1e308, 0}), std::invalid_argument);
}

TEST_CASE("a spline's third derivative is continuous at the second and the last but one sample", "[spline]") {
  const std::vector<double> times{0, 0.1, 1.3, 1.7, 1.72, 4, 4.5}, values{1, -2, 0.5, 3, 3.1, -7, 2};
  const CubicSpline spline(times, values);
  const auto third = [&](std::size_t i) {  // in the piece from sample i
    const double h = times[i + 1] - times[i];
    return (spline(times[i] + 0.75 * h).f_tt - spline(times[i] + 0.25 * h).f_tt) / (0.5 * h);
  };
  CHECK(third(0) == Approx(third(1)).epsilon(1e-12));
  CHECK(third(5) == Approx(third(4)).epsilon(1e-12));
  for (std::size_t i = 1; i + 1 < times.size(); ++i) {
    const CubicSpline::Jet before = spline(std::nextafter(times[i], 0)), after = spline(times[i]);
    CHECK(before.f == Approx(after.f).epsilon(1e-12));
    CHECK(before.f_t == Approx(after.f_t).epsilon(1e-12));
    CHECK(before.f_tt == Approx(after.f_tt).epsilon(1e-11));
  }
}
