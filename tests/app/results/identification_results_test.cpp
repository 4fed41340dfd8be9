#include "app/results/identification_results.hpp"

#include <catch2/catch.hpp>

using namespace mbsopt;
using Catch::Contains;

namespace {

IdentificationResult fit_of(Eigen::Index parameters, Eigen::Index combinations) {
  IdentificationResult fit;
  for (Eigen::Index k = 0; k < parameters; ++k) {
    fit.parameters.emplace_back();
    fit.parameters.back().name = "p" + std::to_string(k);
  }
  fit.statistics.singular_values.setOnes(combinations), fit.statistics.rank = static_cast<long>(combinations);
  return fit;
}

std::string determined(const IdentificationResult& fit) {
  Json result;
  add_to_result(result, fit);
  return result.at("identifiability").at("in_words");
}

}  // namespace

TEST_CASE("parameters that equations tie are not counted as undetermined", "[identifiability]") {
  CHECK_THAT(determined(fit_of(3, 3)), Contains("the data determine 3 combinations of 3 parameters: "));
  CHECK_THAT(determined(fit_of(13, 7)),
             Contains("the data determine 7 of the 7 combinations that continuity leaves of 13 parameters: "));
}

TEST_CASE("an experiment has one rms if its channels have one unit", "[identification]") {
  IdentificationResult fit = fit_of(1, 1);
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
