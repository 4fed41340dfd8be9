#include "optim/fit/nearest_turn.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "optim/fit/identification.hpp"
#include "tests/optim/pendulum.hpp"

using namespace mbsopt;
using Catch::Matchers::Contains;

TEST_CASE("an unwrapped record is put on the turn nearest to the model at its start", "[identification]") {
  Problem p = pendulum::problem(64.4, 0.06, 1.5, 1.5);
  p.identification.emplace();
  p.identification->variables = {"w2", "c"};
  const double gain = GENERATE(1.0, -0.5), turns = GENERATE(-3.0, 0.0, 1.0);
  p.identification->experiments = {pendulum::experiment("run1", {"theta0", "omega0"})};
  ChannelSpec& channel = p.identification->experiments[0].channels[0];
  channel.gain = gain, channel.bias = 0.2;
  std::vector<CsvTable> data{pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2)};
  const CsvTable exact = data[0];
  for (double& x : data[0].columns[1]) x = gain * x + 0.2 + 2 * M_PI * std::abs(gain) * turns;
  CHECK(move_to_nearest_turn(p, data).empty());  // without "unwrap" it stays
  channel.unwrap = true;
  const std::vector<std::string> moved = move_to_nearest_turn(p, data);
  CHECK(moved.size() == (turns == 0 ? 0 : 1));
  if (turns == -3) CHECK_THAT(moved.front(), Contains("'theta' moved up by 3 turns"));
  for (std::size_t i = 0; i < exact.rows(); ++i)
    CHECK(data[0].columns[1][i] == Approx(gain * exact.columns[1][i] + 0.2).margin(1e-12));
  CHECK(run_identification(p, data).parameters[0].value == Approx(64).epsilon(1e-6));
}
