// Warnings of a fit, in sentences. They judge the samples that the loss keeps, record by record: the windows of an
// experiment are one record.
//
//   const std::vector<ChannelRecord> records = channel_records(fit, stack);
//   for (std::string& words : warnings_of_fit(fit, records, stack, solution)) ...
//   for (const DegreesCandidate& c : degrees_candidates(fit, records, stack, z_start)) ...   // tested by another fit
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "optim/fit/experiment_stack.hpp"
#include "optim/fit/fit_context.hpp"

namespace mbsopt::inline optim {

// A channel of a record: its samples, as rows of the stack, and the sizes of what the loss keeps of them.
struct ChannelRecord {
  std::size_t experiment = 0, channel = 0;  // the first one of the record
  std::string record = {}, column = {}, sensor = {};
  std::vector<Eigen::Index> rows = {}, taken_out = {};
  Eigen::VectorXd measured = {}, residual = {};
  double left = 0, spread = 0;  // rms of the residuals, of measured about its mean
  double noise = 0;             // that may be left: sigma, or what differences show where it is estimated
  double unexplained() const { return left / spread; }
  bool is_explained() const;
  bool is_beyond() const;
  bool is_resolved() const;
};
// The experiments of the stack must be scored.
std::vector<ChannelRecord> channel_records(const FitContext& fit, const ExperimentStack& stack);

// Names samples that a loss takes out, channels of which the fit explains nothing, records that disagree with the
// others, estimated sigmas far above the given ones, and channels that repeat another one.
std::vector<std::string> warnings_of_fit(const FitContext& fit, const std::vector<ChannelRecord>& records,
                                         const ExperimentStack& stack, const LeastSquaresResult& solution);

// The column of a record that may be in degrees, since no unit is stated. It is likely if its measured values span
// about 180/pi times as much as the model at the start or at the end of the fit, angles more than half a turn, and if
// the fit does not explain it.
struct DegreesCandidate {
  std::string record, column, path, unit, words;
  bool is_likely = false;
  double unexplained = 1;
};

// None if none is likely. z_start: residuals by the sigmas of the stack.
std::vector<DegreesCandidate> degrees_candidates(const FitContext& fit, const std::vector<ChannelRecord>& records,
                                                 const ExperimentStack& stack, const Eigen::VectorXd& z_start);

}  // namespace mbsopt::inline optim
