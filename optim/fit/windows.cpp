#include "optim/fit/windows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "core/linear/dense.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/start/assembly.hpp"
#include "optim/fit/experiment_stack.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/solver/levenberg_marquardt.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A polynomial reaches so far to both sides of its time, in lengths of a window. It takes at least so many samples,
// twice its coefficients.
constexpr double kReach = 0.1;
constexpr int kCoefficients = 4;
constexpr std::size_t kLeastSamples = 2 * kCoefficients;
// The time between the two points where the model meets a polynomial, in lengths of a window. Wrong accelerations spoil
// the velocity in proportion to it, the integrator's tolerance in proportion to its inverse.
constexpr double kApart = 0.01;
// Directions of the start that differ by less are the same: the assembly's derivatives are exact to about 1e-12.
constexpr double kSameStart = 1e-8;

// Value of the local polynomial about `centre` at t.
class LocalPolynomial {
 public:
  LocalPolynomial(const std::vector<double>& t, const std::vector<double>& measured, double centre, double reach)
      : centre_(centre), reach_(reach) {
    std::vector<std::pair<double, double>> near;  // by distance
    for (std::size_t i = 0; i < t.size(); ++i)
      if (!std::isnan(measured[i])) near.emplace_back(t[i] - centre, measured[i]);
    const auto distance = [](const auto& sample) { return std::abs(sample.first); };
    std::ranges::stable_sort(near, {}, distance);
    const auto within = static_cast<std::size_t>(std::ranges::upper_bound(near, reach, {}, distance) - near.begin());
    near.resize(std::min(near.size(), std::max(within, kLeastSamples)));
    reach_ = std::max(reach_, std::abs(near.back().first));
    const Index n = static_cast<Index>(near.size());
    MatrixXd powers(n, std::min<Index>(kCoefficients, n));
    VectorXd values(n);
    for (Index i = 0; i < n; ++i) {
      const auto [tau, value] = near[static_cast<std::size_t>(i)];
      for (Index k = 0; k < powers.cols(); ++k) powers(i, k) = std::pow(tau / reach_, k);
      values(i) = value;
    }
    coefficients_ = least_squares(powers, values);
  }

  double at(double t) const {
    double value = 0;
    for (Index k = coefficients_.size(); k-- > 0;) value = value * (t - centre_) / reach_ + coefficients_(k);
    return value;
  }

 private:
  double centre_, reach_;
  VectorXd coefficients_;
};

CsvTable rows_between(const CsvTable& data, const std::vector<double>& t, double start, double end, bool with_end) {
  CsvTable part{data.name, data.header, std::vector<std::vector<double>>(data.columns.size()), {}, data.files, {}};
  for (std::size_t row = 0; row < t.size(); ++row) {
    if (t[row] < start || t[row] > end || (t[row] == end && !with_end)) continue;
    for (std::size_t c = 0; c < data.columns.size(); ++c) part.columns[c].push_back(data.columns[c][row]);
    part.lines.push_back(data.lines[row]);
    if (!data.file_of_row.empty()) part.file_of_row.push_back(data.file_of_row[row]);
  }
  return part;
}

class Cut {
 public:
  Cut(const Scene& scene, const ExperimentSpec& whole, std::string place, const CsvTable& data,
      const std::function<bool(double t)>& go_on)
      : scene_(scene), whole_(whole), place_(std::move(place)), data_(data), t_(ascending_times(data, whole.time)) {
    if (go_on) go_on_ = [this, &go_on](double t) { return abandoned_ = abandoned_ || !go_on(t), !abandoned_; };
  }

  void add_to(CutProblem& cut) {
    const std::string place = place_ + ".windows";
    // Errors of the whole experiment, once.
    const Experiment all(scene_, without_windows(), place_, data_, parameter_values(scene_), {});
    const double length = whole_.windows->length;
    const double start = whole_.windows->start_time.value_or(all.start_time());
    const double end = std::min(whole_.windows->end_time.value_or(all.end_time()), all.end_time());
    if (!(end > start))
      throw std::invalid_argument(
          fmt::format("{}: end at {} s, must end after their start at {} s", place, end, start));
    if (whole_.free.empty())
      throw std::invalid_argument(place_ +
                                  ".free: is empty; windows need start parameters of their own, on which "
                                  "initial.conditions or the guess of a body's state depend");
    const double windows = std::max(1.0, std::round((end - start) / length));
    if (windows > static_cast<double>(t_.size()))
      throw std::invalid_argument(
          fmt::format("{}.length: is {} s, which makes {} windows of {} rows", place, length, windows, t_.size()));
    if (length > end - start)
      cut.warnings.push_back(
          fmt::format("{}.length: is {:g} s, but the record has only {:.6g} s: it is one window, as without windows",
                      place, length, end - start));
    ExperimentSpec window = without_windows();
    for (std::size_t k = 0; k < static_cast<std::size_t>(windows); ++k) {
      const bool last = static_cast<double>(k + 1) == windows;
      const double from = start + static_cast<double>(k) * length;
      window.start_time = from;
      window.end_time = last ? end : start + static_cast<double>(k + 1) * length;
      window.name = fmt::format("{}.{}", whole_.name, k + 1);
      window.origin = {whole_.name, k + 1, whole_.windows->continuity && !last};
      CsvTable rows = rows_between(data_, t_, from, *window.end_time, last);
      guess_start(window, rows, cut.warnings);
      cut.problem.identification->experiments.push_back(window);
      cut.data.push_back(std::move(rows));
    }
  }

 private:
  ExperimentSpec without_windows() const {
    ExperimentSpec spec = whole_;
    spec.windows.reset();
    spec.place = place_;
    return spec;
  }

  // Overrides of its free parameters, from those of the window before it.
  void guess_start(ExperimentSpec& window, const CsvTable& rows, std::vector<std::string>& warnings) {
    IdentificationSpec alone;
    alone.experiments = {window};
    const std::vector<UnknownParameter> unknowns = free_in(scene_, alone, 0);
    const std::vector<Experiment::Unknown> here = unknowns_in(scene_, alone, 0, unknowns);
    const VectorXd rho = parameter_values(scene_);
    const Experiment model(scene_, window, place_, rows, rho, here);
    require_starts(model);
    alone.experiments[0].end_time.reset(), alone.experiments[0].origin->continues = false;
    std::vector<ExperimentStack::Member> members;
    members.push_back({0, Experiment(scene_, alone.experiments[0], place_, smoothed(model), rho, here)});
    ExperimentStack stack(std::move(members), unknowns, {}, go_on_);
    LeastSquaresOptions options;
    options.tolerance = 1e-6;  // of a guess
    const LeastSquaresResult found = solve_least_squares(stack, stack.start(), options);
    if (abandoned_) return;
    if (found.point.z.size() == 0) {
      warnings.push_back(fmt::format("{}.windows: the start of window {} could not be guessed: {}", place_,
                                     window.origin->number, found.message));
      return;
    }
    const VectorXd values = stack.scaling().to_rho(found.x);
    for (std::size_t i = 0; i < unknowns.size(); ++i)
      set_override(window, unknowns[i].description.name, values(static_cast<Index>(i)));
  }

  // Each free parameter of a window must act on its start, since samples there say nothing of the others.
  void require_starts(const Experiment& model) const {
    const Scene scene = model.simulated();
    const Assembly assembly(Mechanism(scene, parameter_values(scene), model.active()), model.start_time());
    if (!assembly.result().ok)
      throw std::invalid_argument(
          fmt::format("{}.windows: the mechanism cannot be assembled at the start of a "
                      "window at {} s: {}",
                      place_, model.start_time(), assembly.result().message));
    const int degrees = assembly.summary().degrees_of_freedom;
    if (whole_.windows->continuity && model.unknowns().size() != 2 * static_cast<std::size_t>(degrees))
      throw std::invalid_argument(
          fmt::format("{}.windows.continuity: needs a start that is free in all coordinates and rates of the "
                      "mechanism, {} numbers; "
                      "the experiment's free parameters are {}",
                      place_, 2 * degrees, model.unknowns().size()));
    std::vector<Index> columns;
    for (const Experiment::Unknown& unknown : model.unknowns()) columns.push_back(unknown.parameter);
    const MatrixXd y_u = assembly.tangent()(Eigen::all, columns);
    if (whole_.windows->continuity) require_all_motions(y_u, degrees);
    for (Index k = 0; k < y_u.cols(); ++k)
      if (y_u.col(k).isZero(0))
        throw std::invalid_argument(fmt::format(
            "{}.free: '{}' does not act on the initial state; in an experiment with windows only start parameters can "
            "be free, each window has a value of its own",
            place_, scene.parameters[static_cast<std::size_t>(columns[static_cast<std::size_t>(k)])].name));
  }

  // Windows that continue each other meet in all coordinates and rates.
  void require_all_motions(MatrixXd y_u, int degrees) const {
    for (Index k = 0; k < y_u.cols(); ++k) y_u.col(k).normalize();
    const auto rank_of = [](const MatrixXd& A) { return OrthogonalDecomposition(A, kSameStart).rank(); };
    const Index all = rank_of(y_u), coordinates = rank_of(y_u.topRows(y_u.rows() / 2));
    if (all == 2 * degrees) return;
    throw std::invalid_argument(
        fmt::format("{}.windows.continuity: needs a start that is free in all coordinates and rates of the mechanism, "
                    "{} each; the experiment's free parameters move {} and {} of them",
                    place_, degrees, coordinates, all - coordinates));
  }

  // Two rows per channel: where its samples begin, and shortly after.
  CsvTable smoothed(const Experiment& model) const {
    const double length = whole_.windows->length;
    std::map<std::size_t, double> first;  // time of each channel's first sample
    for (const Experiment::Sample& sample : model.samples())
      first.try_emplace(sample.channel, model.times()[sample.time]);
    std::set<double> times;
    for (const auto& [channel, t] : first) times.insert({t, t + kApart * length});
    CsvTable table;
    table.name = data_.name;
    table.header = {whole_.time};
    table.columns.emplace_back(times.begin(), times.end());
    table.lines.resize(times.size());
    for (std::size_t c = 0; c < whole_.channels.size(); ++c) {
      const std::string& column = whole_.channels[c].column;
      table.header.push_back(column);
      std::vector<double>& values = table.columns.emplace_back();
      const auto begins = first.find(c);
      if (begins == first.end()) {
        values.assign(times.size(), std::numeric_limits<double>::quiet_NaN());
        continue;
      }
      const double from = begins->second;
      const LocalPolynomial polynomial(t_, data_.column(column), from, kReach * length);
      for (const double t : times)
        values.push_back(t == from || t == from + kApart * length ? polynomial.at(t)
                                                                  : std::numeric_limits<double>::quiet_NaN());
    }
    return table;
  }

  const Scene& scene_;
  const ExperimentSpec& whole_;
  const std::string place_;
  const CsvTable& data_;
  const std::vector<double>& t_;
  std::function<bool(double t)> go_on_;
  bool abandoned_ = false;
};

}  // namespace

CutProblem cut_into_windows(const Problem& problem, const std::vector<CsvTable>& data,
                            const std::function<bool(double t)>& go_on) {
  if (!problem.identification || data.size() != problem.identification->experiments.size()) return {problem, data, {}};
  CutProblem cut{problem, {}, {}};
  const IdentificationSpec& spec = *problem.identification;
  cut.problem.identification->experiments.clear();
  for (std::size_t e = 0; e < data.size(); ++e) {
    if (spec.experiments[e].windows) {
      Cut(problem.scene, spec.experiments[e], place_of(spec, e), data[e], go_on).add_to(cut);
    } else {
      cut.problem.identification->experiments.push_back(spec.experiments[e]);
      cut.problem.identification->experiments.back().place = place_of(spec, e);
      cut.data.push_back(data[e]);
    }
  }
  return cut;
}

}  // namespace mbsopt::inline optim
