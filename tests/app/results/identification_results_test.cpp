#include "app/results/identification_results.hpp"

#include <catch2/catch.hpp>

using namespace mbsopt;

namespace {

IdentificationResult fit_of(Eigen::Index parameters) {
  IdentificationResult fit;
  for (Eigen::Index k = 0; k < parameters; ++k) {
    fit.parameters.emplace_back();
    fit.parameters.back().name = "p" + std::to_string(k);
  }
  return fit;
}

}  // namespace

TEST_CASE("an experiment has one rms if its channels have one unit", "[identification]") {
  IdentificationResult fit = fit_of(1);
  fit.experiments.resize(1);
  fit.experiments[0].name = "swing", fit.experiments[0].rms = 0.1;
  fit.experiments[0].channels.resize(2);
  fit.experiments[0].channels[0].column = "a", fit.experiments[0].channels[0].unit = "rad";
  fit.experiments[0].channels[1].column = "b", fit.experiments[0].channels[1].unit = "rad";
  const auto rms = [&] {
    Json result;
    add_to_result(result, fit);
    CHECK(result.at("experiments").at("swing").at("channels").at("a").at("unit") == "rad");
    return result.at("experiments").at("swing").at("rms");
  };
  CHECK(rms() == 0.1);
  fit.experiments[0].channels[1].unit = "rad/s";
  CHECK(rms().is_null());
}
