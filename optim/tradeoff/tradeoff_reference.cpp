#include "optim/tradeoff/tradeoff_reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "optim/problem/parameter_values.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;

struct Candidate {
  ReferenceMethod method;
  SimulationSettings settings;
  Answer answer;
  double change = std::numeric_limits<double>::infinity();  // made by the last tightening
};

struct Stepped {
  const char* integrator;
  int order;
};
constexpr Stepped kStepped[] = {{"gauss6", 6}, {"radau5", 5}};

class Search {
 public:
  Search(const TradeoffRuns& runs, const ReferenceOptions& options)
      : runs_(runs), options_(options), distance_(runs.mechanism()) {}

  TradeoffReference run() {
    const Stopwatch stopwatch(options_.clock);
    TradeoffReference reference;
    std::vector<Candidate> found;
    for (const char* integrator : {"dopri853", "gauss6", "verner6", "radau5"}) {
      if (agree(found) || interrupted()) break;
      if (std::optional<Candidate> candidate = converged(integrator)) found.push_back(std::move(*candidate));
    }
    if (std::any_of(found.begin(), found.end(), is_unmet)) add_stepped(found);
    reference.interrupted = interrupted();
    if (found.size() < 2) {
      reference.message = fmt::format("no reference was found by two methods: {}", problem_);
      reference.wall_seconds = stopwatch.seconds();
      return reference;
    }
    auto [first, second] = closest(found);
    if (found[second].change < found[first].change) std::swap(first, second);
    Candidate &a = found[first], &b = found[second];
    add_gradients(a, b, reference);
    reference.first = a.method, reference.second = b.method;
    reference.errors.emplace(runs_, std::move(a.answer), b.answer);
    reference.wall_seconds = stopwatch.seconds();
    return reference;
  }

 private:
  bool interrupted() const { return options_.interrupted && options_.interrupted(); }
  RunLimit limit(const std::string& doing) const {
    RunLimit limit{options_.seconds_per_run, options_.interrupted, options_.clock};
    if (!options_.progress) return limit;
    const SimulationSettings& s = runs_.scene().simulation;
    limit.progress = [this, &s, doing](double t) {
      options_.progress(doing, (t - s.start_time) / (s.end_time - s.start_time));
    };
    return limit;
  }

  static constexpr double kAgreeing = 1e-7;
  static constexpr double kSettledWell = 1e-10;  // gradients

  static bool has_settled(const Candidate& c) {
    constexpr double kSettled = 1e-9;
    return c.change < kSettled;
  }

  // Returns whether two candidates have settled on the same answer.
  bool agree(const std::vector<Candidate>& found) const {
    if (std::count_if(found.begin(), found.end(), has_settled) < 2) return false;
    return least_apart(found) < kAgreeing;
  }

  double least_apart(const std::vector<Candidate>& found) const {
    const auto [first, second] = closest(found);
    return apart(found[first].answer, found[second].answer);
  }

  // Tightens until the answer no longer settles.
  std::optional<Candidate> converged(const std::string& integrator) {
    std::optional<Candidate> best;
    for (const double rtol : {1e-7, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13}) {
      constexpr double kGrowth = 1.5;     // of the cost, a decade
      constexpr double kSettled = 1e-11;  // the remaining error is a tenth of it
      if (best && (kGrowth * best->method.wall_seconds > options_.seconds_per_run || best->change < kSettled)) break;
      Candidate next;
      next.settings = with_tolerance(runs_.scene().simulation, integrator, rtol);
      next.settings.formulation = constrained(next.settings.formulation);
      next.method = {integrator, rtol, {}};
      next.answer = runs_.motion(next.settings, limit(in_words(next.method)));
      if (!next.answer.ok) {
        if (!best) problem_ += fmt::format("{}{}: {}", problem_.empty() ? "" : "; ", integrator, next.answer.message);
        break;
      }
      next.method.wall_seconds = next.answer.wall_seconds;
      if (best) next.change = apart(next.answer, best->answer);
      if (best && next.change >= best->change) break;
      best = std::move(next);
    }
    return best;
  }

  // Returns whether a stage came so close to a singular position that its equations were regularised ones.
  static bool is_unmet(const Candidate& c) { return c.answer.statistics.max_acceleration_residual > 1e-9; }

  // If these agree, nothing else counts.
  void add_stepped(std::vector<Candidate>& found) {
    long most_evaluations = 0;
    for (const Candidate& c : found) most_evaluations = std::max(most_evaluations, c.answer.statistics.rhs_evaluations);
    for (const Stepped& method : kStepped) {
      if (interrupted()) return;
      if (std::optional<Candidate> candidate = stepped(method, most_evaluations))
        found.push_back(std::move(*candidate));
    }
    if (std::count_if(found.begin(), found.end(), is_unmet) > static_cast<std::ptrdiff_t>(found.size()) - 2) return;
    std::vector<Candidate> met;
    for (const Candidate& c : found)
      if (!is_unmet(c)) met.push_back(c);
    if (least_apart(met) < kAgreeing) found = std::move(met);
  }

  // Halves the steps until the remaining error is small or the answer no longer settles. It uses no more right-hand
  // sides than step-size control did.
  std::optional<Candidate> stepped(const Stepped& method, long most_evaluations) const {
    constexpr double kResolved = 1e-3;  // above it changes may grow: steps are still too large
    constexpr double kLeft = 6e-11;
    constexpr int kMostSteps = 1 << 16;
    const SimulationSettings& own = runs_.scene().simulation;
    std::optional<Candidate> best;
    for (int count = 125; count <= kMostSteps; count *= 2) {
      if (best && (2 * best->method.wall_seconds > options_.seconds_per_run ||
                   2 * best->answer.statistics.rhs_evaluations > most_evaluations))
        break;
      Candidate next;
      next.settings = with_tolerance(own, method.integrator, own.integrator.rtol);
      next.settings.integrator.step = (own.end_time - own.start_time) / count;
      next.settings.formulation = constrained(next.settings.formulation);
      next.method = {method.integrator, 0, next.settings.integrator.step};
      next.answer = runs_.motion(next.settings, limit(in_words(next.method)));
      if (!next.answer.ok) {
        if (best || next.answer.out_of_time || interrupted()) break;
        continue;
      }
      next.method.wall_seconds = next.answer.wall_seconds;
      if (best) next.change = apart(next.answer, best->answer);
      if (best && next.change >= best->change && best->change < kResolved) break;
      best = std::move(next);
      if (best->change < kLeft * (1 << method.order)) break;
    }
    return best;
  }

  // The largest relative difference of the motion and of the objectives.
  double apart(const Answer& a, const Answer& b) const {
    const double extent = distance_.extent(a.motion, a.y_initial);
    double largest = distance_.between(a.motion, b.motion);
    if (extent > 1e3 * largest) largest /= extent;
    for (Index i = 0; i < a.psi.size(); ++i) {
      const double change = std::abs(a.psi(i) - b.psi(i)), size = std::abs(a.psi(i));
      if (size > 1e3 * change) largest = std::max(largest, change / size);
    }
    return largest;
  }

  // Compare a method with its fixed-step form only if no two methods agree. Compare an answer that has not settled only
  // if there are no two others: it may be close by chance.
  std::pair<std::size_t, std::size_t> closest(const std::vector<Candidate>& found) const {
    std::pair<std::size_t, std::size_t> pair{0, 1};
    double least = std::numeric_limits<double>::infinity();
    int best_rank = -1;
    for (std::size_t i = 0; i < found.size(); ++i) {
      for (std::size_t j = i + 1; j < found.size(); ++j) {
        const double here = apart(found[i].answer, found[j].answer);
        const bool differ = found[i].method.integrator != found[j].method.integrator && here < kAgreeing;
        const int rank = 2 * differ + (has_settled(found[i]) && has_settled(found[j]));
        if (rank < best_rank || (rank == best_rank && here >= least)) continue;
        least = here, pair = {i, j}, best_rank = rank;
      }
    }
    return pair;
  }

  // The exact one is a. If two differ, it is the one whose gradients change less by the last tightening.
  void add_gradients(Candidate& a, Candidate& b, TradeoffReference& reference) const {
    if (!runs_.has_gradients() || !options_.gradients) return;
    const GradientCost cost = gradient_cost(runs_.scene().parameters.size(), runs_.objectives().size());
    const GradientMethod method = cost.tlm <= cost.adjoint ? GradientMethod::tlm : GradientMethod::adjoint;
    RunLimit longer = limit("gradients");
    longer.seconds *= 4;
    auto [of_a, of_b, closest] = closest_gradients(gradients_of(a, method, longer), gradients_of(b, method, longer));
    if (!of_a.ok || !of_b.ok) return;
    std::string by(to_string(method));
    if (!a.method.step && !b.method.step) {
      shorten_steps({a.settings, b.settings}, method, longer, of_a, of_b);
      if (step_evenly(method, longer, of_a, of_b)) {
        by += " on even steps of gauss6 and radau5";
      } else if (gradients_apart(of_a, of_b) > kSettledWell && settles_better(b, of_b, a, of_a, method, longer)) {
        std::swap(a, b), std::swap(of_a, of_b);
      }
    }
    a.answer.psi_rho = std::move(of_a.psi_rho), b.answer.psi_rho = std::move(of_b.psi_rho);
    reference.gradients_by = by;
  }

  // Returns whether the gradients of b changed less than those of a by the last tightening of their tolerances.
  bool settles_better(const Candidate& b, const Answer& of_b, const Candidate& a, const Answer& of_a,
                      GradientMethod method, const RunLimit& limit) const {
    const auto change = [&](SimulationSettings s, const Answer& now) {
      s.integrator.rtol *= 10, s.integrator.atol *= 10;
      const Answer before = runs_.gradients(s, method, limit);
      return before.ok ? gradients_apart(now, before) : std::numeric_limits<double>::infinity();
    };
    return change(b.settings, of_b) < change(a.settings, of_a);
  }

  // Derivatives magnify the rounding of positions near singular ones, by how close stages come to them, which is
  // chance. So if steps are of one size, it also takes steps up to eight times the motion's.
  std::vector<Answer> gradients_of(const Candidate& candidate, GradientMethod method, const RunLimit& limit) const {
    if (!candidate.method.step) return {runs_.gradients(candidate.settings, method, limit)};
    std::vector<Answer> answers;
    for (const double longer : {8.0, 4.0, 2.0, 1.0}) {
      SimulationSettings settings = candidate.settings;
      *settings.integrator.step *= longer;
      answers.push_back(runs_.gradients(settings, method, limit));
    }
    return answers;
  }

  // The answer of two methods that agrees best with any of the other's, and its certificate. The certificate is that
  // other answer, or the next best of either method, since the best of many is chance. It is not ok if a method has
  // none.
  struct Closest {
    Answer answer, certificate;
    double apart = std::numeric_limits<double>::infinity();  // of the closest two
  };
  Closest closest_gradients(const std::vector<Answer>& of_a, const std::vector<Answer>& of_b) const {
    const Answer *answer = nullptr, *closest = nullptr, *next = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const Answer& a : of_a) {
      for (const Answer& b : of_b) {
        if (!a.ok || !b.ok) continue;
        const double here = gradients_apart(a, b);
        if (answer && here >= least) continue;
        answer = &a, closest = &b, least = here;
      }
    }
    if (!answer) return {};
    const double closest_apart = std::exchange(least, std::numeric_limits<double>::infinity());
    for (const std::vector<Answer>* answers : {&of_a, &of_b}) {
      for (const Answer& other : *answers) {
        if (!other.ok || &other == answer || &other == closest) continue;
        const double here = gradients_apart(*answer, other);
        if (here < least) next = &other, least = here;
      }
    }
    return {*answer, next && least >= closest_apart ? *next : *closest, closest_apart};
  }

  // Step-size control sees only the motion. Effects on derivatives alone, such as a kink of a law in a parameter, need
  // shorter steps. This takes the pair that agrees best.
  void shorten_steps(std::pair<SimulationSettings, SimulationSettings> settings, GradientMethod method,
                     const RunLimit& limit, Answer& best_a, Answer& best_b) const {
    constexpr double kSame = 1e-8, kShorter = 3;
    constexpr int kRounds = 4, kInVain = 2;
    const auto shorten = [&](SimulationSettings& s, const Answer& by) {
      s.integrator.max_step = *std::max_element(by.steps.sizes.begin(), by.steps.sizes.end()) / kShorter;
    };
    if (best_a.steps.sizes.empty() || best_b.steps.sizes.empty()) return;
    double least = gradients_apart(best_a, best_b);
    Answer a = best_a, b = best_b;
    for (int round = 0, in_vain = 0; round < kRounds && in_vain < kInVain && least > kSame; ++round) {
      if (kShorter * std::max(a.wall_seconds, b.wall_seconds) > options_.seconds_per_run) return;
      shorten(settings.first, a), shorten(settings.second, b);
      a = runs_.gradients(settings.first, method, limit), b = runs_.gradients(settings.second, method, limit);
      if (!a.ok || !b.ok) return;
      const double apart = gradients_apart(a, b);
      ++in_vain;
      if (apart < least) best_a = a, best_b = b, least = apart, in_vain = 0;
    }
  }

  // Derivatives of steps past singular positions settle later than the motion, or not at all. Takes steps of one size
  // if they agree better, and returns whether they do.
  bool step_evenly(GradientMethod method, const RunLimit& limit, Answer& best_a, Answer& best_b) const {
    constexpr double kSettled = 5e-10;
    const double apart = gradients_apart(best_a, best_b);
    if (apart < kSettled || interrupted()) return false;
    std::vector<std::vector<Answer>> answers;
    for (const Stepped& by : kStepped) {
      const std::optional<Candidate> candidate = stepped(by, std::numeric_limits<long>::max() / 2);
      if (!candidate) return false;
      answers.push_back(gradients_of(*candidate, method, limit));
    }
    Closest closest = closest_gradients(answers[0], answers[1]);
    if (!(closest.apart < apart)) return false;
    best_a = std::move(closest.answer), best_b = std::move(closest.certificate);
    return true;
  }

  // The largest difference over the objectives, in units of the parameters' sizes.
  double gradients_apart(const Answer& a, const Answer& b) const {
    const std::vector<Parameter>& parameters = runs_.scene().parameters;
    Eigen::VectorXd size(static_cast<Index>(parameters.size()));
    for (Index k = 0; k < size.size(); ++k) {
      const Parameter& p = parameters[static_cast<std::size_t>(k)];
      size(k) = typical_size(p, p.value);
    }
    double largest = 0;
    for (Index i = 0; i < a.psi_rho.rows(); ++i) {
      const double whole = (a.psi_rho.row(i) * size.asDiagonal()).norm();
      const double change = ((a.psi_rho.row(i) - b.psi_rho.row(i)) * size.asDiagonal()).norm();
      if (change > 0) largest = std::max(largest, whole > 0 ? change / whole : change);
    }
    return largest;
  }

  const TradeoffRuns& runs_;
  const ReferenceOptions& options_;
  MotionDistance distance_;
  std::string problem_;
};

}  // namespace

std::string in_words(const ReferenceMethod& method) {
  return method.step ? fmt::format("{} with steps of {:.3g} s", method.integrator, *method.step)
                     : fmt::format("{} at rtol {:.0e}", method.integrator, method.rtol);
}

TradeoffReference converged_reference(const TradeoffRuns& runs, const ReferenceOptions& options) {
  return Search(runs, options).run();
}

SimulationSettings with_tolerance(SimulationSettings settings, const std::string& integrator, double rtol) {
  IntegratorSettings& s = settings.integrator;
  const double atol = rtol * (s.step || s.rtol <= 0 ? 1e-2 : s.atol / s.rtol);
  s.atol = std::stod(fmt::format("{:.6e}", atol));  // 1e-07, not 1.0000000000000001e-07
  s.type = integrator, s.rtol = rtol;
  s.step.reset();
  s.options = {};  // these belong to the file's own setting only
  return settings;
}

FormulationSettings constrained(const FormulationSettings& formulation) {
  const bool as_it_is = formulation.type == FormulationType::augmented_lagrangian &&
                        formulation.projection == Projection::position_velocity;
  return as_it_is ? formulation : FormulationSettings{};
}

}  // namespace mbsopt
