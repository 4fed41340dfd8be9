// A fit of parameters to a record, with a force written in C++: here the record is a simulation with other values.
#include <cmath>
#include <cstdio>
#include <mbsopt/mbsopt.hpp>
#include <sstream>

#include "drag.hpp"

int main(int, char** argv) {
  mbsopt::Problem problem = mbsopt::read_problem(argv[1]);
  const std::vector<std::shared_ptr<const mbsopt::UserForce>> forces{std::make_shared<Drag>()};
  const Eigen::Vector3d truth(0.8, 1.7, 0.25);
  const mbsopt::Mechanism real(problem.scene, truth, {}, forces);
  std::ostringstream record;
  record.precision(17);
  record << "t,angle\n";
  mbsopt::Sampling sampling;
  for (int i = 0; i <= 150; ++i) sampling.times.push_back(0.01 * i);
  sampling.observe = [&](std::size_t i, const mbsopt::StatePoint& at) {
    record << at.t << ',' << real.sensor_value(real.sensor("theta"), at) + 1e-3 * std::sin(37.0 * double(i * i))
           << '\n';
  };
  if (!mbsopt::simulate(real, problem.scene.simulation, {}, sampling).ok()) return 1;

  mbsopt::ChannelSpec channel;
  channel.column = "angle", channel.sensor = "theta", channel.sigma = 1e-3;
  mbsopt::ExperimentSpec experiment;
  experiment.name = "swing", experiment.channels = {channel};
  mbsopt::IdentificationSpec identification;
  identification.experiments = {experiment}, identification.variables = {"drag", "theta0"};
  problem.identification = identification;
  mbsopt::IdentificationOptions options;
  options.user_forces = forces;
  const mbsopt::IdentificationResult fit =
      mbsopt::run_identification(problem, {mbsopt::parse_csv(record.str(), "swing.csv")}, options);
  std::printf("%s\n", fit.message.c_str());
  bool found = fit.ok();
  for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
    const mbsopt::FittedParameter& p = fit.parameters[k];
    std::printf("%s = %.5f +- %.5f\n", p.name.c_str(), p.value, p.std_error);
    found = found && std::abs(p.value - truth(Eigen::Index(k) + 1)) < 4 * p.std_error;
  }
  return found ? 0 : 1;
}
