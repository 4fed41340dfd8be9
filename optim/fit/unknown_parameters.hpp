// The unknowns of an identification: parameters shared by its experiments, and those with a value per experiment.
//
// clang-format off
//   const std::vector<UnknownParameter> unknowns = unknowns_of_fit(scene, spec);  // "k1", "run1.theta0", "run2.theta0"
//   Experiment run1(..., unknowns_in(scene, spec, 0, unknowns));                   // those that act in experiment 0
// clang-format on
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "optim/fit/experiment.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

struct UnknownParameter {
  int parameter = 0;           // in the scene
  std::size_t experiment = 0;  // where it is free
  bool shared = true;
  Parameter description;  // with the value it starts from
};

std::string place_of(const IdentificationSpec& spec, std::size_t experiment);  // its path in the problem file

// The experiment of the file that an experiment, or a window, belongs to.
const std::string& record_name(const ExperimentSpec& experiment);

// The channels of all records, counted through. A record is an experiment of the file with all its windows.
struct RecordChannels {
  struct Place {
    std::size_t experiment, channel;  // the first window
  };
  std::vector<Place> all;
  std::vector<std::size_t> first;  // per experiment or window: the number of its first channel
};
RecordChannels record_channels(const IdentificationSpec& spec);

// Gives a parameter its own value in an experiment.
void set_override(ExperimentSpec& experiment, const std::string& parameter, double value);

// A parameter whose bounds leave it nowhere to go is a constant, not an unknown.
bool is_held(const Parameter& parameter);
// Throws std::invalid_argument with the place where nothing is to be fitted, or something that no experiment sees.
std::vector<UnknownParameter> unknowns_of_fit(const Scene& scene, const IdentificationSpec& spec);
// The free ones of one experiment.
std::vector<UnknownParameter> free_in(const Scene& scene, const IdentificationSpec& spec, std::size_t experiment);

// An experiment's own values of what is free there, else the shared ones; an override replaces a shared value.
std::vector<Experiment::Unknown> unknowns_in(const Scene& scene, const IdentificationSpec& spec, std::size_t experiment,
                                             const std::vector<UnknownParameter>& unknowns);

std::string name_of(const UnknownParameter& unknown, const IdentificationSpec& spec);  // "run1.theta0"
Eigen::VectorXd start_of(const std::vector<UnknownParameter>& unknowns);

}  // namespace mbsopt::inline optim
