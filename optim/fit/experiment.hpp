// One experiment: what was measured, and the simulation that explains it. Turns values of the unknowns into residuals
// and their exact Jacobian by one tangent-linear run from its start time to its last sample.
//
//   z = (measured - gain s(t - delay) - bias)/sigma             bias and delay may be functions of t
//   dz/du = -(gain (s_y (y_u - ydot delay_u) + s_rho rho_u) + s gain_u + bias_u)/sigma        sigma: constant in u
//
// y, y_u and ydot are the dense output, its derivative in u and in time. Before the start the mechanism stays as it is
// there; rows that a delay within its bounds could take there are left out.
//
// An experiment that another one continues is simulated to its end_time. Both are read there by the chart of the later
// one's start, which says how far they are apart (experiment_stack.hpp).
//
//   const Experiment run1(scene, spec, table, {{"k1", 0}, {"theta0", 1}});   // parameter and number of the unknown
//   Experiment::Residuals r = run1.residuals(u);
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/expression/program.hpp"
#include "core/mechanism/scene_programs.hpp"
#include "core/simulate/simulation.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// Coordinates of the states of a mechanism near one of them, y0, where they are those of the parameters u that set it:
//
//   s(y) = W (y' - y0),      W = (Y'Y)^-1 Y',   Y = dy0/du          so that s(y0(u + du)) = du to first order
//
// y' is y, with Euler parameters and their rates of each body by the sign that is nearer to y0: both are the same
// orientation.
class StateChart {
 public:
  // y: (q, v), 14 numbers per body; y_u: its derivatives, of full column rank.
  StateChart(const Eigen::VectorXd& y, const Eigen::MatrixXd& y_u);

  Eigen::Index size() const { return W_.rows(); }
  // y_rho: of these columns.
  void read(const Eigen::VectorXd& y, const Eigen::MatrixXd& y_rho, Eigen::VectorXd& s, Eigen::MatrixXd& s_rho) const;

 private:
  Eigen::VectorXd y0_;
  Eigen::MatrixXd W_;
};

struct ExperimentLimits {
  std::function<bool(double t)> progress;  // after accepted steps; false stops
  std::optional<long> max_steps;           // instead of the simulation's
  bool derivatives = true;                 // else z_u has no meaning
};

class Experiment {
 public:
  struct Unknown {
    int parameter;    // index in the scene
    Eigen::Index at;  // place in the vector of unknowns
  };
  struct Sample {
    std::size_t time;  // index in times()
    std::size_t channel;
    double measured;
    std::size_t row;  // of the data
  };
  struct Residuals {
    bool ok = false;
    std::string message;  // why not
    Eigen::VectorXd z;    // per sample
    Eigen::MatrixXd z_u;  // sample x all unknowns
    // The states at its start and at its end by their charts, where it has them, and derivatives in all unknowns.
    Eigen::VectorXd start, end;
    Eigen::MatrixXd start_u, end_u;
    long steps = 0;           // of the simulation
    std::vector<Jump> jumps;  // of it
  };

  // rho: values of parameters that are not unknown here (overrides are applied on top). Throws std::invalid_argument
  // and CsvError with the place: "identification.experiments[0].channels[1].sigma: ...".
  Experiment(const Scene& scene, const ExperimentSpec& spec, std::string place, const CsvTable& data,
             const Eigen::VectorXd& rho, std::vector<Unknown> unknowns);

  using Limits = ExperimentLimits;
  Residuals residuals(const Eigen::VectorXd& u, const Limits& limits = {}) const;

  // The chart of its start, in its unknowns `own`. Throws std::invalid_argument where it cannot be assembled.
  StateChart chart_of_start(const std::vector<Unknown>& own) const;
  void read_start(const StateChart& chart) { start_chart_ = chart; }
  void read_end(const StateChart& chart) { end_chart_ = chart; }

  // The simulated scene: with its laws and its span, at the values that are not unknown and those at which
  // the unknown ones start.
  Scene simulated() const;

  const std::vector<double>& times() const { return times_; }
  const std::vector<Sample>& samples() const { return samples_; }  // by time, then channel
  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  const std::vector<bool>& active() const { return active_; }  // of the scene's parameters, those that are unknown
  std::size_t channels() const { return channels_.size(); }
  double sigma(std::size_t channel) const { return channels_[channel].sigma; }
  double given_sigma(std::size_t channel) const { return channels_[channel].given_sigma; }
  void set_sigma(std::size_t channel, double sigma) { channels_[channel].sigma = sigma; }
  std::size_t missing(std::size_t channel) const { return channels_[channel].missing; }
  double start_time() const { return settings_.start_time; }
  double end_time() const { return settings_.end_time; }

 private:
  struct Channel {
    int sensor = 0;
    Program gain, bias, delay;  // inputs: all parameters, then t
    double sigma = 1, given_sigma = 1;
    double first = 0;  // samples before are left out [s]
    std::size_t missing = 0;
  };
  class Reading;  // of one run
  // Value of a field of a channel, with its gradient in all parameters and t.
  struct Differentiated {
    double value = 0;
    Eigen::VectorXd rho_bar;
  };
  static Differentiated evaluated(const Program& program, const Eigen::VectorXd& rho, double t,
                                  Program::Scratch& scratch);
  void replace_laws(const ExperimentSpec& spec, const std::string& place);
  void compile_channels(const ExperimentSpec& spec, const std::string& place);
  // The largest delay at any of the times that the bounds of the unknowns allow, where they say; else at their start
  // values, rho.
  double largest_delay(const Program& delay, const std::vector<double>& times) const;
  void refuse_time_dependence(const Sensor& sensor, const Program& delay, const std::string& place) const;
  void take_samples(const ExperimentSpec& spec, const std::string& place, const CsvTable& data);
  // The samples that do not reach from the start to `end`: whose they are, and what they cover.
  struct ShortSamples {
    bool of_signal;
    std::size_t index;  // among the scene's drives or signals
    std::string words;
  };
  std::optional<ShortSamples> short_samples(const Eigen::VectorXd& rho, double end) const;
  void refuse_short_laws(const ExperimentSpec& spec, const std::string& place) const;

  Scene scene_;
  std::shared_ptr<ScenePrograms> programs_;  // of the scene
  SimulationSettings settings_;
  Eigen::VectorXd rho_;
  std::vector<Unknown> unknowns_;
  std::vector<bool> active_;
  std::vector<Channel> channels_;
  std::vector<double> times_;  // at which something was measured
  std::vector<Sample> samples_;
  std::vector<std::size_t> first_;  // sample of each time, and the end
  bool delayed_ = false;            // some channel has a delay
  std::optional<StateChart> start_chart_, end_chart_;
};

}  // namespace mbsopt::inline optim
