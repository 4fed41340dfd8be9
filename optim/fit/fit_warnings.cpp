#include "optim/fit/fit_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/linear/dense.hpp"
#include "core/scene/scene_facts.hpp"
#include "optim/fit/sigma_estimation.hpp"
#include "optim/problem/logged_columns.hpp"

namespace mbsopt::inline optim {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
const double kNear = std::sqrt(kDegrees);  // ratios up to so far from kDegrees are nearer to it than to 1
constexpr double kUnexplained = 0.5;       // rms of the residuals over the deviation of the record
constexpr double kTakenOut = 0.1;          // weight by the loss: normal noise has less in one of 1e6 samples at most
constexpr double kBeyond = 2;              // of sigma: a static channel is its mean and noise
constexpr double kElsewhere = 3;           // by chance, rms values of records differ by far less
constexpr double kRevised = 10;            // estimated over given sigma: not even its order of magnitude is right
constexpr double kDisagree = 0.5;          // rms of the others without a record, over that with it
constexpr double kCopied = 0.9;            // correlation: 1.9 times the variance of two independent channels
constexpr double kIntegrated = 1e-5;       // of the record: smaller residuals are errors of the integration

double rms(const Eigen::VectorXd& x) { return x.norm() / std::sqrt(std::max(1.0, static_cast<double>(x.size()))); }
double deviation(const Eigen::VectorXd& x) { return x.size() > 0 ? rms(x.array() - x.mean()) : 0; }
double span_of(const Eigen::VectorXd& x) { return x.maxCoeff() - x.minCoeff(); }

class FitWarnings {
 public:
  FitWarnings(const FitContext& fit, const std::vector<ChannelRecord>& records, const ExperimentStack& stack)
      : fit_(fit), stack_(stack), records_(records) {}

  std::vector<std::string> all(const LeastSquaresResult& solution) {
    for (const ChannelRecord& s : records_) {
      name_outliers(s);
      check_explanation(s);
      check_given_sigma(s);
    }
    for (const ChannelRecord& s : records_) compare_elsewhere(s);
    // A record that estimated sigmas have given up tells nothing of the others.
    if (std::ranges::all_of(reasons_, [](const auto& of) { return of.second.empty(); })) leave_out_each(solution);
    for (const auto& [record, why] : reasons_)
      if (!why.empty())
        add("experiment '{}' disagrees with the others{}. Look at its columns, units, signs and clock, or free the "
            "parameters that differ there",
            record, why);
    for (auto b = records_.begin(); b != records_.end(); ++b)
      for (auto a = records_.begin(); a != b; ++a) compare_noise(*a, *b);
    return std::move(warnings_);
  }

 private:
  template <class... T>
  void add(fmt::format_string<T...> words, T&&... values) {
    warnings_.push_back(fmt::format(words, std::forward<T>(values)...));
  }
  double time(Eigen::Index i) const { return fit_.result.residuals[static_cast<std::size_t>(i)].t; }

  // Huber's loss takes out none: its pull is constant. Neighbours are one part: "run.csv:57 (1.12 s), run.csv:60 to
  // run.csv:64 (1.2 to 1.28 s)".
  void name_outliers(const ChannelRecord& s) {
    constexpr int kMost = 5;  // parts in a sentence
    std::string places;
    int parts = 0;
    const auto place = [&](Eigen::Index i) {
      const ResidualRow& sample = fit_.result.residuals[static_cast<std::size_t>(i)];
      return fit_.data[sample.experiment].place(sample.row);
    };
    for (std::size_t i = 0, k = 0; i < s.taken_out.size(); i = k + 1) {
      const auto kept_before = [&](Eigen::Index x) { return std::ranges::lower_bound(s.rows, x) - s.rows.begin(); };
      const Eigen::Index first = s.taken_out[i];
      for (k = i; k + 1 < s.taken_out.size() && kept_before(s.taken_out[k + 1]) == kept_before(first);) ++k;
      const Eigen::Index last = s.taken_out[k];
      if (++parts > kMost) continue;
      places += (parts > 1 ? ", " : "") + (k == i ? fmt::format("{} ({:.6g} s)", place(first), time(first))
                                                  : fmt::format("{} to {} ({:.6g} to {:.6g} s)", place(first),
                                                                place(last), time(first), time(last)));
    }
    if (parts > kMost) places += fmt::format(", and {} more", parts - kMost);
    if (parts > 0 && stack_.loss.type != LossType::huber)
      add("identification.loss: {} of {} samples of '{}' in '{}' have less than a tenth of their weight: {}",
          s.taken_out.size(), s.taken_out.size() + s.rows.size(), s.column, s.record, places);
  }

  void check_explanation(const ChannelRecord& s) {
    if (s.left > s.spread && s.is_beyond())
      add("the fit explains nothing of '{}' in '{}': its residuals are {:.3g} (rms), the measured values differ from "
          "their own mean by {:.3g} (rms). A unit, a sign or the model is wrong, or the fit ended in another minimum: "
          "start elsewhere",
          s.column, s.record, s.left, s.spread);
  }

  // Questions a shared sigma once, and none that the file does not give.
  void check_given_sigma(const ChannelRecord& s) {
    const Experiment& model =
        std::ranges::find(stack_.members(), s.experiment, &ExperimentStack::Member::experiment)->model;
    const ChannelSpec& channel = fit_.spec.experiments[s.experiment].channels[s.channel];
    const double sigma = model.sigma(s.channel), given = model.given_sigma(s.channel);
    const bool own = channel.estimate_sigma == SigmaEstimate::own;
    if (has_sigma(channel) && sigma > kRevised * given && (own || revised_.insert(s.column).second))
      add("the sigma of '{}'{} is estimated as {:.3g}, {:.3g} times the given {:.3g}: the model explains this column "
          "far worse than expected",
          s.column, own ? fmt::format(" in '{}'", s.record) : "", sigma, sigma / given, given);
  }

  // Compares with the same sensor in the other records, also in parts of the signal: larger motions have larger errors.
  void compare_elsewhere(const ChannelRecord& s) {
    std::string& why = reasons_[s.record];
    double most = 0, part = 0;
    for (const ChannelRecord& other : records_)
      if (other.record != s.record && other.sensor == s.sensor)
        most = std::max(most, other.left), part = std::max(part, other.left / other.spread);
    if (most > 0 && s.is_beyond() && s.left > kElsewhere * std::max(most, part * s.spread))
      why += fmt::format("; its residuals of '{}' are {:.3g} (rms), those of others {:.3g} at most", s.column, s.left,
                         most);
  }

  // How well the linear model at the solution would explain the others without a record. With their normal equations
  // H d = g the squares of their residuals fall by g'd. Cook and Weisberg, "Residuals and Influence in Regression"
  // (1982), section 3.4. Own parameters at a bound stay there; a parameter that no other record determines drops out.
  void leave_out_each(const LeastSquaresResult& solution) {
    constexpr double kDetermined = 1e-10;  // of H, its columns of unit length
    const bool shares = std::ranges::any_of(stack_.unknowns(), &UnknownParameter::shared);
    if (reasons_.size() < 2 || stack_.equalities > 0 || !shares ||
        std::ranges::none_of(records_, &ChannelRecord::is_resolved))
      return;
    std::vector<Eigen::Index> columns;
    for (Eigen::Index k = 0; k < stack_.variables(); ++k)
      if (stack_.unknowns()[static_cast<std::size_t>(k)].shared || !stack_.is_at_bound(solution.x, k))
        columns.push_back(k);
    const Eigen::VectorXd root = stack_.weights(solution.point.z).cwiseSqrt();
    const Eigen::VectorXd z = root.cwiseProduct(solution.point.z);
    Eigen::MatrixXd J = root.asDiagonal() * solution.point.z_x(Eigen::all, columns);
    for (Eigen::Index k = 0; k < J.cols(); ++k) J.col(k).normalize();
    const Eigen::MatrixXd H = J.transpose() * J;
    const Eigen::VectorXd g = J.transpose() * z;
    std::vector<std::pair<std::string, Eigen::Index>> samples_of;  // record after record
    for (const ExperimentStack::Member& m : stack_.members()) {
      const std::string& name = record_name(fit_.spec.experiments[m.experiment]);
      if (samples_of.empty() || samples_of.back().first != name) samples_of.emplace_back(name, 0);
      samples_of.back().second += std::ssize(m.model.samples());
    }
    Eigen::Index first = 0;
    for (const auto& [record, n] : samples_of) {
      const Eigen::MatrixXd J_r = J.middleRows(first, n);
      const Eigen::VectorXd z_r = z.segment(first, n), g_others = g - J_r.transpose() * z_r;
      first += n;
      const Eigen::VectorXd d = OrthogonalDecomposition(H - J_r.transpose() * J_r, kDetermined).solve(g_others);
      const double fall = g_others.dot(d);
      const double before = z.head(stack_.samples()).squaredNorm() - z_r.squaredNorm();
      const double after = std::max(before - fall, 0.0), others = static_cast<double>(stack_.samples() - n);
      const double freedom = others - static_cast<double>(stack_.variables());
      if (freedom > 0 && after / freedom < kDisagree * kDisagree * before / others)
        reasons_[record] +=
            fmt::format("; without it the residuals of the others would fall from {:.3g} to {:.3g} sigma (rms)",
                        std::sqrt(before / others), std::sqrt(after / freedom));
    }
  }

  // Errors of the model may be alike in two channels, but change slowly. Noise of two sensors is not alike, and
  // differences from sample to sample show it.
  void compare_noise(const ChannelRecord& a, const ChannelRecord& b) {
    constexpr int kFewest = 10;
    const auto is_usable = [](const ChannelRecord& s) { return s.is_resolved() && s.is_explained(); };
    if (a.record != b.record || !is_usable(a) || !is_usable(b)) return;
    double aa = 0, bb = 0, ab = 0, last_a = 0, last_b = 0;
    int pairs = 0;
    for (Eigen::Index i = 0, k = 0; i < a.residual.size() && k < b.residual.size();) {
      const double t_a = time(a.rows[static_cast<std::size_t>(i)]), t_b = time(b.rows[static_cast<std::size_t>(k)]);
      if (t_a == t_b) {
        const double da = a.residual(i) - last_a, db = b.residual(k) - last_b;
        if (pairs++ > 0) {
          aa += da * da;
          bb += db * db;
          ab += da * db;
        }
        last_a = a.residual(i);
        last_b = b.residual(k);
      }
      i += t_a <= t_b;
      k += t_b <= t_a;
    }
    if (pairs >= kFewest && ab * ab > kCopied * kCopied * aa * bb)
      add("the residuals of '{}' and '{}' in '{}' change alike from sample to sample (correlation {:.3f}): one column "
          "may be a copy of the other, or the model errs alike in both. They count as two independent measurements but "
          "tell little more than one, so that standard errors may be too small by up to sqrt(2)",
          a.column, b.column, a.record, ab / std::sqrt(aa * bb));
  }

  const FitContext& fit_;
  const ExperimentStack& stack_;
  const std::vector<ChannelRecord>& records_;
  std::map<std::string, std::string> reasons_;  // why a record disagrees
  std::set<std::string> revised_;               // columns whose shared sigma is questioned already
  std::vector<std::string> warnings_;
};

}  // namespace

bool ChannelRecord::is_explained() const { return left <= kUnexplained * spread; }
bool ChannelRecord::is_beyond() const { return left > kBeyond * noise; }
bool ChannelRecord::is_resolved() const { return left > kIntegrated * spread; }

std::vector<ChannelRecord> channel_records(const FitContext& fit, const ExperimentStack& stack) {
  const RecordChannels channels = record_channels(fit.spec);
  std::vector<ChannelRecord> all;
  for (const auto& [e, c] : channels.all) {
    const ChannelSpec& channel = fit.spec.experiments[e].channels[c];
    all.push_back({e, c, record_name(fit.spec.experiments[e]), channel.column, channel.sensor});
  }
  for (std::size_t i = 0; i < fit.result.residuals.size(); ++i) {
    const ResidualRow& row = fit.result.residuals[i];
    ChannelRecord& record = all[channels.first[row.experiment] + row.channel];
    const bool is_kept = stack.loss.at(row.scaled * row.scaled).rho1 >= kTakenOut;
    (is_kept ? record.rows : record.taken_out).push_back(static_cast<Eigen::Index>(i));
  }
  std::erase_if(all, [](const ChannelRecord& r) { return r.rows.empty() && r.taken_out.empty(); });
  for (ChannelRecord& r : all) {
    r.measured.resize(static_cast<Eigen::Index>(r.rows.size()));
    r.residual.resize(r.measured.size());
    for (Eigen::Index i = 0; i < r.measured.size(); ++i) {
      const ResidualRow& row = fit.result.residuals[static_cast<std::size_t>(r.rows[static_cast<std::size_t>(i)])];
      r.measured(i) = row.measured;
      r.residual(i) = row.measured - row.model;
    }
    r.left = rms(r.residual);
    r.spread = deviation(r.measured);
    const bool estimated = fit.spec.experiments[r.experiment].channels[r.channel].estimate_sigma != SigmaEstimate::none;
    r.noise =
        estimated ? differenced_noise(r.measured) : fit.result.experiments[r.experiment].channels[r.channel].sigma;
  }
  return all;
}

std::vector<std::string> warnings_of_fit(const FitContext& fit, const std::vector<ChannelRecord>& records,
                                         const ExperimentStack& stack, const LeastSquaresResult& solution) {
  return FitWarnings(fit, records, stack).all(solution);
}

std::vector<DegreesCandidate> degrees_candidates(const FitContext& fit, const std::vector<ChannelRecord>& records,
                                                 const ExperimentStack& stack, const Eigen::VectorXd& z_start) {
  std::vector<DegreesCandidate> candidates;
  for (const ChannelRecord& s : records) {
    const std::string unit = unit_of(fit.scene, *std::ranges::find(fit.scene.sensors, s.sensor, &Sensor::name));
    const bool is_stated =
        !stated_unit(fit.spec.experiments[s.experiment].channels[s.channel], fit.data[s.experiment]).empty();
    if ((unit != "rad" && unit != "rad/s") || is_stated || s.rows.size() < 2) continue;
    const double span = span_of(s.measured), end = span_of(s.measured - s.residual),
                 start = span_of(s.measured - z_start(s.rows).cwiseProduct(stack.sigma()(s.rows)));
    const auto as_degrees = [&](double model) { return span > kNear * model && span < kNear * kDegrees * model; };
    const bool plausible = s.is_explained() || (unit == "rad" && span <= std::numbers::pi);
    candidates.push_back(
        {s.record, s.column, fmt::format("{}.channels[{}].column", place_of(fit.spec, s.experiment), s.channel), unit,
         fmt::format("the values of '{}' span {:.3g}, those of the model {:.3g} {} at the start of the fit "
                     "and {:.3g} {} at its end",
                     s.column, span, start, unit, end, unit),
         !plausible && (as_degrees(start) || as_degrees(end)), s.unexplained()});
  }
  if (std::ranges::none_of(candidates, &DegreesCandidate::is_likely)) candidates.clear();
  return candidates;
}

}  // namespace mbsopt::inline optim
