// Sigmas that a fit estimates from its own residuals: one per channel and experiment, with all its windows, or one for
// all channels of a column.
//
// With normal noise the likelihood is largest where sigma^2 is the mean square of the residuals r of its channels:
//   -log L = sum_c [ n_c log sigma_c + 1/2 sum_i (r_ci/sigma_c)^2 ]    =>    sigma_c^2 = sum_i r_ci^2/n_c
// The fit eliminates these sigmas: they are the scale groups of LeastSquaresProblem, which weighs the residuals anew at
// each of its points. N/(N - P), the number of samples over that without the parameters, makes up for what the fit
// takes off the residuals: f_c = n_c (N - P)/N takes the place of n_c.
//
// This likelihood may have several optima: one channel or record is explained well, and others are given up. None is
// better than noise alone. So if a sigma is far above the noise of its channels, the fit converges again, first by the
// given sigmas, or by those of the noise where none is given, then with free ones. The best likelihood counts.
// Residuals that are linear in the parameters need no simulation for this. Differences of a smooth signal m show the
// noise e: m_(i-1) - 2 m_i + m_(i+1) ~ e_(i-1) - 2 e_i + e_(i+1), of variance 6 sigma^2.
//
// With a loss other than the square, which has outliers in mind, sigma is 1.4826 times the median of |r| (normal noise
// has that). Then fit and sigmas are found in turn, until no sigma changes any more.
//
//   SigmaEstimation sigmas(stack, spec);
//   stack.groups = sigmas.scale_groups();
//   const LeastSquaresResult fit = solve_least_squares(stack, x);
//   sigmas.take(fit.point.z);
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "optim/fit/experiment_stack.hpp"

namespace mbsopt::inline optim {

inline constexpr int kSigmaRounds = 40;
inline constexpr double kNoisy = 2;           // times the noise: a sigma that no other optimum lowers by much
inline constexpr double kSigmaChange = 1e-6;  // relative, of a sigma: below it the estimates have settled

bool has_sigma(const ChannelSpec& channel);            // other than the default
bool estimates_sigma(const IdentificationSpec& spec);  // in a fitted experiment
// The standard deviation of the noise by second differences, and by their median, which outliers hardly change. 0 for
// fewer than three samples, and if most of them follow a straight line.
double differenced_noise(const Eigen::VectorXd& measured);

class SigmaEstimation {
 public:
  // Gives all channels of a shared sigma that of the first one. stack must outlive it.
  SigmaEstimation(ExperimentStack& stack, const IdentificationSpec& spec);

  std::size_t size() const { return groups_.size(); }
  std::vector<ScaleGroup> scale_groups() const;
  // Sets the sigmas by residuals z, which are by the sigmas so far. Returns the largest change, relative.
  double take(const Eigen::VectorXd& z);
  std::vector<double> sigmas() const;  // per group
  void set(const std::vector<double>& sigmas);
  std::vector<double> noise() const;  // per group; its sigma where differences show none
  bool is_given(std::size_t group) const { return groups_[group].is_given; }
  // -log L with these sigmas, which are those of residuals z, but for a constant.
  double likelihood(const Eigen::VectorXd& z) const;

 private:
  struct Group {
    std::vector<std::pair<std::size_t, std::size_t>> channels;  // member of the stack, channel of its experiment
    std::vector<Eigen::Index> rows;                             // of the stack
    double largest = 0;                                         // measured value, as |x|
    bool is_given = false;                                      // the sigma that it starts from
  };
  double sigma(const Group& group) const;
  double least(const Group& group) const;
  double freedom() const;
  void set(const Group& group, double sigma);

  ExperimentStack& stack_;
  std::vector<Group> groups_;
};

}  // namespace mbsopt::inline optim
