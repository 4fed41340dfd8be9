#include <catch2/catch.hpp>
#include <cmath>

#include "optim/fit/identification.hpp"
#include "tests/optim/repetitions.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

TEST_CASE("influence: as the fit without the experiment", "[identification]") {
  Problem p = repetitions::slider(50, 1.2);
  p.identification.emplace();
  p.identification->variables = {"k", "c"};
  std::vector<CsvTable> data;
  for (unsigned e = 0; e < 4; ++e) {  // the last one is of another spring
    p.identification->experiments.push_back(repetitions::slider_run("run" + std::to_string(e), {"x0", "v0"}));
    data.push_back(repetitions::damped_decay(e == 3 ? 25.02 : 25, 0.6, 0.2, 0.1, 2, 0.05));
    for (std::size_t i = 0; i < data.back().rows(); ++i)
      data.back().columns[1][i] += 1e-5 * std::sin(37. * static_cast<double>(i * i + e));
  }
  const IdentificationResult all = run_identification(p, data);
  REQUIRE(all.ok());
  for (std::size_t e = 0; e < 4; ++e) {
    Problem fewer = p;
    std::vector<CsvTable> rest = data;
    fewer.identification->experiments.erase(fewer.identification->experiments.begin() + static_cast<long>(e));
    rest.erase(rest.begin() + static_cast<long>(e));
    const IdentificationResult without = run_identification(fewer, rest);
    REQUIRE(without.ok());
    REQUIRE(all.experiments[e].influence);
    const Influence& influence = *all.experiments[e].influence;
    const std::size_t k = influence.parameter == "k" ? 0 : 1;
    const double change = (without.parameters[k].value - all.parameters[k].value) / all.parameters[k].std_error;
    INFO(influence.parameter << ": " << influence.change << ", really " << change);
    CHECK(influence.change == Approx(change).epsilon(0.02).margin(0.01));
  }
  CHECK(std::abs(all.experiments[3].influence->change) > 1);
}
