#include "optim/fit/fit_doubts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/scene/scene_facts.hpp"
#include "optim/fit/experiment_influence.hpp"
#include "optim/fit/sigma_estimation.hpp"
#include "optim/problem/logged_columns.hpp"

namespace mbsopt {
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

// A channel of a record: its rows in the stack, and the sizes of what the loss keeps of them.
struct Series {
  std::size_t member, channel;  // the first one of the record
  std::string record, column, sensor;
  std::vector<Eigen::Index> rows = {}, taken_out = {};
  Eigen::VectorXd measured = {}, residual = {};
  double left = 0, spread = 0;  // rms of the residuals, of measured about its mean
  double noise = 0;             // that may be left: sigma, or what differences show where it is estimated
  bool is_beyond() const { return left > kBeyond * noise; }
  bool is_resolved() const { return left > kIntegrated * spread; }
  bool is_explained() const { return left <= kUnexplained * spread; }
};

std::vector<Series> series_of(const FitContext& fit, const ExperimentStack& stack) {
  std::vector<Series> all;
  Eigen::Index row = 0;
  for (std::size_t m = 0; m < stack.members().size(); ++m) {
    const ExperimentSpec& spec = fit.spec.experiments[stack.members()[m].experiment];
    for (const Experiment::Sample& sample : stack.members()[m].model.samples()) {
      const ChannelSpec& channel = spec.channels[sample.channel];
      auto found = std::ranges::find_if(
          all, [&](const Series& s) { return s.channel == sample.channel && s.record == record_name(spec); });
      if (found == all.end())
        found = all.insert(all.end(), {m, sample.channel, record_name(spec), channel.column, channel.sensor});
      const double z = fit.result.residuals[static_cast<std::size_t>(row)].scaled;
      (stack.loss.at(z * z).rho1 < kTakenOut ? found->taken_out : found->rows).push_back(row++);
    }
  }
  const Eigen::VectorXd measured = stack.measured();
  Eigen::VectorXd residual = measured;
  for (Eigen::Index i = 0; i < row; ++i) residual(i) -= fit.result.residuals[static_cast<std::size_t>(i)].model;
  for (Series& s : all) {
    s.measured = measured(s.rows), s.residual = residual(s.rows);
    s.left = rms(s.residual), s.spread = deviation(s.measured);
    const ExperimentStack::Member& m = stack.members()[s.member];
    const bool estimated = fit.spec.experiments[m.experiment].channels[s.channel].estimate_sigma != SigmaEstimate::none;
    s.noise = estimated ? differenced_noise(s.measured) : m.model.sigma(s.channel);
  }
  return all;
}

class Doubts {
 public:
  Doubts(const FitContext& fit, const ExperimentStack& stack)
      : fit_(fit), stack_(stack), series_(series_of(fit, stack)) {}

  std::vector<std::string> all(const LeastSquaresResult& solution, const std::vector<UnknownParameter>& unknowns) {
    for (const Series& s : series_) say_taken_out(s), doubt_explanation(s), doubt_given_sigma(s);
    for (const Series& s : series_) compare_elsewhere(s);
    // A record that estimated sigmas have given up tells nothing of the others.
    if (std::ranges::all_of(reasons_, [](const auto& of) { return of.second.empty(); }))
      leave_out_each(solution, unknowns);
    for (const auto& [record, why] : reasons_)
      if (!why.empty())
        add("experiment '{}' disagrees with the others{}. Look at its columns, units, signs and clock, or free the "
            "parameters that differ there",
            record, why);
    for (auto b = series_.begin(); b != series_.end(); ++b)
      for (auto a = series_.begin(); a != b; ++a) compare_noise(*a, *b);
    return std::move(doubts_);
  }

 private:
  template <class... T>
  void add(fmt::format_string<T...> words, T&&... values) {
    doubts_.push_back(fmt::format(words, std::forward<T>(values)...));
  }
  double time(Eigen::Index i) const { return fit_.result.residuals[static_cast<std::size_t>(i)].t; }

  // Huber's loss takes out none: its pull is constant. Neighbours are one part: "run.csv:57 (1.12 s), run.csv:60 to
  // run.csv:64 (1.2 to 1.28 s)".
  void say_taken_out(const Series& s) {
    constexpr int kMost = 5;  // parts in a sentence
    std::string places;
    int parts = 0;
    const auto place = [&](Eigen::Index i) {
      const std::size_t e = fit_.result.residuals[static_cast<std::size_t>(i)].experiment;
      const std::vector<double>& t = fit_.data[e].column(fit_.spec.experiments[e].time);
      return fit_.data[e].place(static_cast<std::size_t>(std::ranges::lower_bound(t, time(i)) - t.begin()));
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

  void doubt_explanation(const Series& s) {
    if (s.left > s.spread && s.is_beyond())
      add("the fit explains nothing of '{}' in '{}': its residuals are {:.3g} (rms), the measured values differ from "
          "their own mean by {:.3g} (rms). A unit, a sign or the model is wrong, or the fit ended in another minimum: "
          "start elsewhere",
          s.column, s.record, s.left, s.spread);
  }

  // Doubts a shared sigma once, and none that the file does not give.
  void doubt_given_sigma(const Series& s) {
    const ExperimentStack::Member& m = stack_.members()[s.member];
    const ChannelSpec& channel = fit_.spec.experiments[m.experiment].channels[s.channel];
    const double sigma = m.model.sigma(s.channel), given = m.model.given_sigma(s.channel);
    const bool own = channel.estimate_sigma == SigmaEstimate::own;
    if (has_sigma(channel) && sigma > kRevised * given && (own || revised_.insert(s.column).second))
      add("the sigma of '{}'{} is estimated as {:.3g}, {:.3g} times the given {:.3g}: the model explains this column "
          "far "
          "worse than expected",
          s.column, own ? fmt::format(" in '{}'", s.record) : "", sigma, sigma / given, given);
  }

  // Compares with the same sensor in the other records, also in parts of the signal: larger motions have larger errors.
  void compare_elsewhere(const Series& s) {
    std::string& why = reasons_[s.record];
    double most = 0, part = 0;
    for (const Series& other : series_)
      if (other.record != s.record && other.sensor == s.sensor)
        most = std::max(most, other.left), part = std::max(part, other.left / other.spread);
    if (most > 0 && s.is_beyond() && s.left > kElsewhere * std::max(most, part * s.spread))
      why += fmt::format("; its residuals of '{}' are {:.3g} (rms), those of others {:.3g} at most", s.column, s.left,
                         most);
  }

  void leave_out_each(const LeastSquaresResult& solution, const std::vector<UnknownParameter>& unknowns) {
    const bool shares = std::ranges::any_of(unknowns, &UnknownParameter::shared);
    if (reasons_.size() < 2 || stack_.equalities > 0 || !shares || std::ranges::none_of(series_, &Series::is_resolved))
      return;
    std::vector<std::size_t> group_of_member;
    std::vector<std::string> names;  // of the groups
    for (const ExperimentStack::Member& m : stack_.members()) {
      const std::string& name = record_name(fit_.spec.experiments[m.experiment]);
      if (names.empty() || names.back() != name) names.push_back(name);
      group_of_member.push_back(names.size());
    }
    const std::vector<OthersWithout> others = others_without(stack_, solution, unknowns, group_of_member);
    for (std::size_t g = 0; g < names.size(); ++g) {
      const auto& [change, samples, before, after] = others[g];
      const double n = static_cast<double>(samples), freedom = n - static_cast<double>(stack_.variables());
      if (freedom > 0 && after / freedom < kDisagree * kDisagree * before / n)
        reasons_[names[g]] +=
            fmt::format("; without it the residuals of the others would fall from {:.3g} to {:.3g} sigma (rms)",
                        std::sqrt(before / n), std::sqrt(after / freedom));
    }
  }

  // Errors of the model may be alike in two channels, but change slowly. Noise of two sensors is not alike, and
  // differences from sample to sample show it.
  void compare_noise(const Series& a, const Series& b) {
    constexpr int kFewest = 10;
    const auto is_usable = [](const Series& s) { return s.is_resolved() && s.is_explained(); };
    if (a.record != b.record || !is_usable(a) || !is_usable(b)) return;
    double aa = 0, bb = 0, ab = 0, last_a = 0, last_b = 0;
    int pairs = 0;
    for (Eigen::Index i = 0, k = 0; i < a.residual.size() && k < b.residual.size();) {
      const double t_a = time(a.rows[static_cast<std::size_t>(i)]), t_b = time(b.rows[static_cast<std::size_t>(k)]);
      if (t_a == t_b) {
        const double da = a.residual(i) - last_a, db = b.residual(k) - last_b;
        if (pairs++ > 0) aa += da * da, bb += db * db, ab += da * db;
        last_a = a.residual(i), last_b = b.residual(k);
      }
      i += t_a <= t_b, k += t_b <= t_a;
    }
    if (pairs >= kFewest && ab * ab > kCopied * kCopied * aa * bb)
      add("the residuals of '{}' and '{}' in '{}' change alike from sample to sample (correlation {:.3f}): one column "
          "may "
          "be a copy of the other, or the model errs alike in both. They count as two independent measurements but "
          "tell "
          "little more than one, so that standard errors may be too small by up to sqrt(2)",
          a.column, b.column, a.record, ab / std::sqrt(aa * bb));
  }

  const FitContext& fit_;
  const ExperimentStack& stack_;
  const std::vector<Series> series_;
  std::map<std::string, std::string> reasons_;  // why a record disagrees
  std::set<std::string> revised_;               // columns whose shared sigma is doubted
  std::vector<std::string> doubts_;
};

}  // namespace

std::vector<std::string> doubts_of_fit(const FitContext& fit, const ExperimentStack& stack,
                                       const LeastSquaresResult& solution,
                                       const std::vector<UnknownParameter>& unknowns) {
  return Doubts(fit, stack).all(solution, unknowns);
}

std::vector<AngleDoubt> angle_doubts(const FitContext& fit, const ExperimentStack& stack,
                                     const Eigen::VectorXd& z_start) {
  std::vector<AngleDoubt> doubts;
  for (const Series& s : series_of(fit, stack)) {
    const std::size_t e = stack.members()[s.member].experiment;
    const auto sensor = std::ranges::find(fit.scene.sensors, s.sensor, &Sensor::name);
    const std::string unit = unit_of(fit.scene, *sensor);
    const bool is_stated = !stated_unit(fit.spec.experiments[e].channels[s.channel], fit.data[e]).empty();
    if ((unit != "rad" && unit != "rad/s") || is_stated || s.rows.size() < 2) continue;
    const double span = span_of(s.measured), end = span_of(s.measured - s.residual),
                 start = span_of(s.measured - z_start(s.rows).cwiseProduct(stack.sigma()(s.rows)));
    const auto as_degrees = [&](double model) { return span > kNear * model && span < kNear * kDegrees * model; };
    const bool plausible = s.is_explained() || (unit == "rad" && span <= std::numbers::pi);
    doubts.push_back(
        {s.record, s.column, fmt::format("{}.channels[{}].column", place_of(fit.spec, e), s.channel), unit,
         fmt::format("the values of '{}' span {:.3g}, those of the model {:.3g} {} at the start of the fit "
                     "and {:.3g} {} at its end",
                     s.column, span, start, unit, end, unit),
         !plausible && (as_degrees(start) || as_degrees(end))});
  }
  if (std::ranges::none_of(doubts, &AngleDoubt::is_likely)) doubts.clear();
  return doubts;
}

double unexplained(const IdentificationResult& result, const std::string& record, const std::string& column) {
  std::vector<double> measured, residual;
  for (const ResidualRow& row : result.residuals) {
    const ExperimentFit& fit = result.experiments[row.experiment];
    if ((fit.window ? fit.window->experiment : fit.name) != record || fit.channels[row.channel].column != column)
      continue;
    measured.push_back(row.measured), residual.push_back(row.measured - row.model);
  }
  const auto n = static_cast<Eigen::Index>(measured.size());
  return n == 0 ? 1
                : rms(Eigen::Map<Eigen::VectorXd>(residual.data(), n)) /
                      deviation(Eigen::Map<Eigen::VectorXd>(measured.data(), n));
}

}  // namespace mbsopt
