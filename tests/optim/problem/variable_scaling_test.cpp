#include "optim/problem/variable_scaling.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace mbsopt;

namespace {

Parameter variable(const std::string& name, double value, std::optional<double> lower, std::optional<double> upper,
                   ParameterScale scale) {
  Parameter p;
  p.name = name, p.value = value, p.lower = lower, p.upper = upper, p.scale = scale;
  return p;
}

std::vector<Parameter> every_scale() {
  return {variable("L", -0.5, {}, {}, ParameterScale::linear), variable("z", 0, {}, {}, ParameterScale::linear),
          variable("a", 1e-9, -1, 1, ParameterScale::linear), variable("k", 120, 1, 1e4, ParameterScale::log),
          variable("c", 3e-4, 1e-6, {}, ParameterScale::log10)};
}

Eigen::VectorXd values(const std::vector<Parameter>& parameters) {
  Eigen::VectorXd rho(static_cast<Eigen::Index>(parameters.size()));
  for (Eigen::Index k = 0; k < rho.size(); ++k) rho(k) = parameters[static_cast<std::size_t>(k)].value;
  return rho;
}

}  // namespace

TEST_CASE("variables go there and back", "[scaling]") {
  const std::vector<Parameter> parameters = every_scale();
  const VariableScaling scaling(parameters);
  const Eigen::VectorXd rho = values(parameters);
  const Eigen::VectorXd back = scaling.to_rho(scaling.to_x(rho));
  for (Eigen::Index k = 0; k < rho.size(); ++k) CHECK(back(k) == Approx(rho(k)).epsilon(1e-14));
}

TEST_CASE("rho_x is the derivative of to_rho", "[scaling]") {
  const std::vector<Parameter> parameters = every_scale();
  const VariableScaling scaling(parameters);
  const Eigen::VectorXd x = scaling.to_x(values(parameters));
  const double h = 1e-5;
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(x.size());
  const Eigen::VectorXd difference = (scaling.to_rho(x + h * ones) - scaling.to_rho(x - h * ones)) / (2 * h);
  const Eigen::VectorXd exact = scaling.rho_x(x);
  for (Eigen::Index k = 0; k < x.size(); ++k) CHECK(exact(k) == Approx(difference(k)).epsilon(1e-9));
}

TEST_CASE("a tiny value between wide bounds does not set the scale", "[scaling]") {
  const VariableScaling scaling({variable("a", 1e-9, -1, 1, ParameterScale::linear)});
  CHECK(scaling.x_upper()(0) == Approx(50));
  CHECK(scaling.x_lower()(0) == Approx(-50));
}

TEST_CASE("what is felt sets the scale where bounds are too wide to tell it", "[scaling]") {
  const auto unit = [](double value, double upper, double felt) {
    const VariableScaling scaling({variable("a", value, 0, upper, ParameterScale::linear)},
                                  Eigen::VectorXd::Constant(1, felt));
    return scaling.rho_x(Eigen::VectorXd::Zero(1))(0);
  };
  CHECK(unit(0.7, 1e9, 3) == 0.7);  // the value tells
  CHECK(unit(0, 1e9, 3) == 3);
  CHECK(unit(1e-9, 1e9, 3) == 3);
  CHECK(unit(0, 50, 3) == 0.5);     // the range tells
  CHECK(unit(0.7, 1e9, 0) == 0.7);  // not known
}

TEST_CASE("bounds go through the scale and are never left", "[scaling]") {
  const VariableScaling scaling(
      {variable("k", 120, 1, 1e4, ParameterScale::log), variable("L", 0.3, {}, 0.7, ParameterScale::linear)});
  CHECK(scaling.x_lower()(0) == 0);
  CHECK(scaling.x_upper()(0) == Approx(std::log(1e4)));
  CHECK(std::isinf(scaling.x_lower()(1)));
  const Eigen::VectorXd at_top = scaling.to_rho(scaling.x_upper());
  CHECK(at_top(0) <= 1e4);
  CHECK(at_top(1) <= 0.7);
}

TEST_CASE("scales and bounds that contradict each other are refused with the parameter's name", "[scaling]") {
  using Catch::Matchers::Contains;
  CHECK_THROWS_WITH(VariableScaling({variable("k", -1, {}, {}, ParameterScale::log)}),
                    Contains("parameters.k") && Contains("above 0"));
  CHECK_THROWS_WITH(VariableScaling({variable("k", 1, 0, {}, ParameterScale::log10)}), Contains("lower 0"));
  CHECK_THROWS_WITH(VariableScaling({variable("k", 1, 3, 2, ParameterScale::linear)}), Contains("lower is 3, above"));
  CHECK_THROWS_WITH(VariableScaling({variable("k", 5, 0, 2, ParameterScale::linear)}), Contains("outside its bounds"));
}
