// The variance of a sum of scores s_i = J_i' z_i whose residuals z are not independent. Its inverse image is the
// uncertainty of a fit: statistics.hpp.
//
// Newey and West, Econometrica 55 (1987) 703, within each record:
//   B = sum_ij k(|t_i - t_j|/H) s_i s_j'          k(u) = 1 - u for u < 1, else 0
// The lag H is a tenth of the record's duration. It is a time and not a number of samples: rules that find it from the
// first autocorrelations (Andrews, Econometrica 59 (1991) 817; Newey and West, Review of Economic Studies 61 (1994)
// 631) miss a slow error of the model below the noise of a fast sensor, and then standard errors fall with the sampling
// rate. With H a given part b of the record (Kiefer and Vogelsang, Econometric Theory 21 (2005) 1130) the estimate has
// about 3/(2 b) degrees of freedom, for Student's quantiles (Priestley, "Spectral Analysis and Time Series" (1981),
// section 6.2.4). k is the share of the windows of length H that hold both samples of those that hold the first one. So
// B is the mean square of the sums over all such windows. It costs no more than the sum itself.
//
// Between records: each record's sum is one observation, whatever happens within the record (Liang and Zeger,
// Biometrika 73 (1986) 13; Cameron and Miller, Journal of Human Resources 50 (2015) 317), with E - 1 degrees of
// freedom:
//   B = sum_e s_e s_e',   s_e = sum_i s_i
// A parameter that acts in one record only has s_e = 0 at the fit. This record alone tells no variation between
// records, so the variance is that of Newey and West. Correlations are those of Newey and West, too.
//
// The fit takes off the residuals what it can explain, so that B is too small. In the direction a of the parameters it
// leaves this share of white noise, with the orthonormal basis q of the columns of J,
//   left = 1 - sum_p a' B(J q_p) a/sum_i (a' J_i)^2,       B(J q_p): of the scores J_i q_ip
// by which B is divided, whatever the noise (Bell and McCaffrey, Survey Methodology 28 (2002) 169).
//
// A motion in several windows tells more. A wrong law has other best parameters in each window, and the fit hides this
// best where a window decides. So z of each window w is what a fit to all others would leave, to first order, and
// nothing is divided (CR3 of Bell and McCaffrey; Cameron and Miller, section VI.B, whose factor (W - 1)/W for W windows
// is left out, since sums over the lag take its place):
//   (I - H_w)^-1 z_w,   H_w = J_w (J'J)^-1 J_w' = Q_w S Q_w',   J_w = Q_w R_w,   S = R_w (J'J)^-1 R_w'
//                     = z_w + Q_w S (I - S)^-1 Q_w' z_w
// A window's own start, which no other shows, has the eigenvalue 1 of S. There Q_w' z_w = 0, so that the start is the
// best one for the parameters of the others.
//
//   const ScoreVariance variance(CovarianceType::newey_west, {{0, t}});
//   variance.within(scores);
#pragma once

#include <Eigen/Core>
#include <vector>

#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// Consecutive rows of the scores, at times that do not descend.
struct SampledRecord {
  Eigen::Index first = 0;
  Eigen::VectorXd t;
  double duration() const { return t.size() > 0 ? t(t.size() - 1) - t(0) : 0; }
};

inline constexpr double kLagPart = 0.1;  // H over the record's duration

class ScoreVariance {
 public:
  // newey_west, or windows (between records): at least two. motions: the records that are one in time, for within();
  // empty: as records.
  ScoreVariance(CovarianceType type, std::vector<SampledRecord> records, std::vector<SampledRecord> motions = {});

  Eigen::MatrixXd within(const Eigen::MatrixXd& scores) const;   // B of Newey and West
  Eigen::MatrixXd between(const Eigen::MatrixXd& scores) const;  // B between records
  bool is_between(bool of_one_record) const { return type_ == CovarianceType::windows && !of_one_record; }
  // Returns whether a motion is in several windows, so that left_out() serves parameters that act in more than one.
  bool has_windows() const { return records_.size() > motions_.size(); }
  // Each record's z as a fit to the other records would leave it. inverse: (J'J)^-1, 0 of parameters held by a bound.
  Eigen::VectorXd left_out(Eigen::VectorXd z, const Eigen::MatrixXd& J, const Eigen::MatrixXd& inverse) const;
  // The part of the variance that the fit leaves. a_J: a' J_i; q: columns.
  double share_left(const Eigen::VectorXd& a_J, const Eigen::MatrixXd& q, bool of_one_record) const;
  long freedom() const;  // of the estimate of each variance

 private:
  CovarianceType type_;
  std::vector<SampledRecord> records_, motions_;
};

}  // namespace mbsopt::inline optim
