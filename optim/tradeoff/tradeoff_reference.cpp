#include "optim/tradeoff/tradeoff_reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "core/scene/default_integrator.hpp"
#include "core/tableau/tableaus.hpp"

namespace mbsopt::inline optim {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr const char* kStepped[] = {"gauss6", "radau5"};  // methods that also take steps of one size

struct Candidate {
  ReferenceMethod method;
  SimulationSettings settings;
  Answer answer;
  double change = kInfinity;  // made by the last refinement

  bool has_settled() const { return change < 1e-9; }
  double evaluations() const { return static_cast<double>(answer.statistics.rhs_evaluations); }
  // Returns whether a stage came so close to a singular position that its equations were regularised ones.
  bool is_unmet() const { return answer.statistics.max_acceleration_residual > 1e-9; }
};

// Gradients of two methods; the second certifies the first.
struct GradientPair {
  Answer answer, certificate;
  double apart = kInfinity;  // of the closest two
};

// Settings of a method from loose to tight, and what ends their series.
struct Refinement {
  std::vector<ReferenceMethod> methods;
  double growth;                        // of the cost, from one setting to the next
  double settled;                       // a change below it: the remaining error is small
  double resolved = kInfinity;          // a change above it may grow: steps are still too large
  double most_evaluations = kInfinity;  // right-hand sides
};

Refinement tighter_tolerances(const std::string& integrator) {
  constexpr double kSettled = 1e-11;  // the remaining error is a tenth of it
  Refinement series{{}, 1.5, kSettled};
  for (const double rtol : {1e-7, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13}) series.methods.push_back({integrator, rtol, {}});
  return series;
}

// Halved steps, which use no more right-hand sides than step-size control did.
Refinement halved_steps(const char* integrator, double span, double most_evaluations) {
  constexpr double kLeft = 6e-11, kResolved = 1e-3;
  constexpr int kFewest = 125, kMost = 1 << 16;  // steps
  Refinement series{{}, 2, kLeft * (1 << runge_kutta_method(integrator)->order), kResolved, most_evaluations};
  for (int count = kFewest; count <= kMost; count *= 2) series.methods.push_back({integrator, 0, span / count});
  return series;
}

class ReferenceSearch {
 public:
  ReferenceSearch(const TradeoffRuns& runs, const ReferenceOptions& options) : runs_(runs), options_(options) {}

  TradeoffReference run() {
    const Stopwatch stopwatch(options_.clock);
    TradeoffReference reference;
    std::vector<Candidate> found;
    for (const char* integrator : {"dopri853", "gauss6", "verner6", "radau5"}) {
      const bool agree = std::ranges::count_if(found, &Candidate::has_settled) >= 2 && closest(found).apart < kAgreeing;
      if (agree || interrupted()) break;
      if (std::optional<Candidate> next = refined(tighter_tolerances(integrator))) found.push_back(std::move(*next));
    }
    if (std::ranges::any_of(found, &Candidate::is_unmet)) add_stepped(found);
    reference.interrupted = interrupted();
    if (found.size() < 2) {
      reference.message = fmt::format("no reference was found by two methods: {}", problem_);
    } else {
      Pair pair = closest(found);
      if (found[pair.second].change < found[pair.first].change) std::swap(pair.first, pair.second);
      Candidate &a = found[pair.first], &b = found[pair.second];
      if (runs_.has_gradients() && options_.gradients) add_gradients(a, b, reference);
      reference.first = a.method;
      reference.second = b.method;
      reference.errors.emplace(runs_, std::move(a.answer), b.answer);
    }
    reference.wall_seconds = stopwatch.seconds();
    return reference;
  }

 private:
  static constexpr double kAgreeing = 1e-7;

  const SimulationSettings& own() const { return runs_.scene().simulation; }
  bool interrupted() const { return options_.interrupted && options_.interrupted(); }
  RunLimit limit(const std::string& doing) const {
    RunLimit limit{options_.seconds_per_run, options_.interrupted, options_.clock};
    if (options_.progress)
      limit.progress = [this, doing](double t) {
        options_.progress(doing, (t - own().start_time) / (own().end_time - own().start_time));
      };
    return limit;
  }

  // Refines until the answer no longer settles. Steps that are too large for any answer are left out.
  std::optional<Candidate> refined(const Refinement& series) {
    std::optional<Candidate> best;
    for (const ReferenceMethod& method : series.methods) {
      if (best && (best->change < series.settled || series.growth * best->evaluations() > series.most_evaluations ||
                   series.growth * best->method.wall_seconds > options_.seconds_per_run))
        break;
      Candidate next{
          method, with_tolerance(own(), method.integrator, method.step ? own().integrator.rtol : method.rtol), {}};
      next.settings.integrator.step = method.step;
      next.settings.formulation = constrained(next.settings.formulation);
      next.answer = runs_.motion(next.settings, limit(in_words(method)));
      if (!next.answer.ok) {
        if (method.step && !best && !next.answer.out_of_time && !interrupted()) continue;
        if (!method.step && !best)
          problem_ += fmt::format("{}{}: {}", problem_.empty() ? "" : "; ", method.integrator, next.answer.message);
        break;
      }
      next.method.wall_seconds = next.answer.wall_seconds;
      if (best) next.change = apart(next.answer, best->answer);
      if (best && next.change >= best->change && best->change < series.resolved) break;
      best = std::move(next);
    }
    return best;
  }

  std::optional<Candidate> stepped(const char* integrator, double most_evaluations) {
    return refined(halved_steps(integrator, own().end_time - own().start_time, most_evaluations));
  }

  // If these agree, nothing else counts.
  void add_stepped(std::vector<Candidate>& found) {
    double most_evaluations = 0;
    for (const Candidate& c : found) most_evaluations = std::max(most_evaluations, c.evaluations());
    for (const char* integrator : kStepped) {
      if (interrupted()) return;
      if (std::optional<Candidate> next = stepped(integrator, most_evaluations)) found.push_back(std::move(*next));
    }
    std::vector<Candidate> met = found;
    std::erase_if(met, std::mem_fn(&Candidate::is_unmet));
    if (met.size() >= 2 && closest(met).apart < kAgreeing) found = std::move(met);
  }

  // The largest relative difference of the motion and of the objectives, or of the gradients.
  double apart(const Answer& a, const Answer& b, bool gradients = false) const {
    const TradeoffErrors errors = gradients ? TradeoffErrors(runs_, a, b, 0) : TradeoffErrors(runs_, a, b);
    double largest = 0;
    for (const Quantity& q : errors.quantities()) {
      const bool of_values = q.kind == QuantityKind::motion || (q.kind == QuantityKind::objective && q.relative);
      if (gradients ? q.kind == QuantityKind::gradient : of_values) largest = std::max(largest, q.certificate);
    }
    return largest;
  }

  struct Pair {
    std::size_t first = 0, second = 1;
    double apart = kInfinity;
  };
  // Compare a method with its fixed-step form only if no two methods agree. Compare an answer that has not settled only
  // if there are no two others: it may be close by chance.
  Pair closest(const std::vector<Candidate>& found) const {
    Pair pair;
    int best = 1;  // the rank with its sign reversed
    for (std::size_t i = 0; i < found.size(); ++i) {
      for (std::size_t j = i + 1; j < found.size(); ++j) {
        const double here = apart(found[i].answer, found[j].answer);
        const bool differ = found[i].method.integrator != found[j].method.integrator && here < kAgreeing;
        const int rank = -2 * differ - (found[i].has_settled() && found[j].has_settled());
        if (std::pair(rank, here) < std::pair(best, pair.apart)) {
          best = rank;
          pair = {i, j, here};
        }
      }
    }
    return pair;
  }

  // Takes the gradients of two ways to the same answer that agree best. `a` is the more exact way.
  void add_gradients(Candidate& a, Candidate& b, TradeoffReference& reference) {
    GradientPair best = closest_gradients(gradients_of(a), gradients_of(b));
    if (!best.answer.ok) return;
    reference.gradients_by = to_string(runs_.discrete_method());
    if (!a.method.step && !b.method.step) {
      shorten_steps(a.settings, b.settings, best);
      if (step_evenly(best)) reference.gradients_by += " on even steps of gauss6 and radau5";
    }
    a.answer.psi_rho = std::move(best.answer.psi_rho);
    b.answer.psi_rho = std::move(best.certificate.psi_rho);
  }

  Answer gradients_at(const SimulationSettings& settings) const {
    RunLimit longer = limit("gradients");
    longer.seconds *= 4;
    return runs_.gradients(settings, runs_.discrete_method(), longer);
  }

  // Derivatives magnify the rounding of positions near singular ones, by how close stages come to them, which is
  // chance. So if steps are of one size, it also takes steps up to eight times the motion's.
  std::vector<Answer> gradients_of(const Candidate& candidate) const {
    if (!candidate.method.step) return {gradients_at(candidate.settings)};
    std::vector<Answer> answers;
    for (const double longer : {8.0, 4.0, 2.0, 1.0}) {
      SimulationSettings settings = candidate.settings;
      *settings.integrator.step *= longer;
      answers.push_back(gradients_at(settings));
    }
    return answers;
  }

  // The answer that agrees best with any of the other method's, and its certificate. The certificate is that other
  // answer, or the next best of either method, since the best of many is chance. It is not ok if a method has none.
  GradientPair closest_gradients(const std::vector<Answer>& of_a, const std::vector<Answer>& of_b) const {
    struct Near {
      const Answer *answer = nullptr, *other = nullptr;
      double apart = kInfinity;
    };
    Near closest, next;
    const auto take_nearer = [&](Near& best, const Answer& answer, const Answer& other) {
      if (!answer.ok || !other.ok) return;
      const double here = apart(answer, other, true);
      if (!best.answer || here < best.apart) best = {&answer, &other, here};
    };
    for (const Answer& a : of_a)
      for (const Answer& b : of_b) take_nearer(closest, a, b);
    if (!closest.answer) return {};
    for (const std::vector<Answer>* answers : {&of_a, &of_b})
      for (const Answer& other : *answers)
        if (&other != closest.answer && &other != closest.other) take_nearer(next, *closest.answer, other);
    return {*closest.answer, next.answer && next.apart >= closest.apart ? *next.other : *closest.other, closest.apart};
  }

  // Step-size control sees only the motion. Effects on derivatives alone, such as a kink of a law in a parameter, need
  // shorter steps. This takes the pair that agrees best.
  void shorten_steps(SimulationSettings of_a, SimulationSettings of_b, GradientPair& best) const {
    constexpr double kSame = 1e-8, kShorter = 3;
    constexpr int kRounds = 4, kInVain = 2;
    const auto shorten = [&](SimulationSettings& s, Answer& answer) {
      s.integrator.max_step = std::ranges::max(answer.steps.sizes) / kShorter;
      answer = gradients_at(s);
      return answer.ok;
    };
    Answer a = best.answer, b = best.certificate;
    if (a.steps.sizes.empty() || b.steps.sizes.empty()) return;
    for (int round = 0, in_vain = 0; round < kRounds && in_vain < kInVain && best.apart > kSame; ++round) {
      if (kShorter * std::max(a.wall_seconds, b.wall_seconds) > options_.seconds_per_run) return;
      if (!shorten(of_a, a) || !shorten(of_b, b)) return;
      const double here = apart(a, b, true);
      ++in_vain;
      if (here < best.apart) {
        best = {a, b, here};
        in_vain = 0;
      }
    }
  }

  // Derivatives of steps past singular positions settle later than the motion, or not at all. Takes steps of one size
  // if they agree better, and returns whether they do.
  bool step_evenly(GradientPair& best) {
    constexpr double kSettled = 5e-10;
    if (best.apart < kSettled || interrupted()) return false;
    std::vector<std::vector<Answer>> answers;
    for (const char* integrator : kStepped) {
      const std::optional<Candidate> candidate = stepped(integrator, kInfinity);
      if (!candidate) return false;
      answers.push_back(gradients_of(*candidate));
    }
    GradientPair even = closest_gradients(answers[0], answers[1]);
    if (!(even.apart < best.apart)) return false;
    best = std::move(even);
    return true;
  }

  const TradeoffRuns& runs_;
  const ReferenceOptions& options_;
  std::string problem_;
};

}  // namespace

std::string in_words(const ReferenceMethod& method) {
  return method.step ? fmt::format("{} with steps of {:.3g} s", method.integrator, *method.step)
                     : fmt::format("{} at rtol {:.0e}", method.integrator, method.rtol);
}

TradeoffReference converged_reference(const TradeoffRuns& runs, const ReferenceOptions& options) {
  return ReferenceSearch(runs, options).run();
}

SimulationSettings with_tolerance(SimulationSettings settings, const std::string& integrator, double rtol) {
  IntegratorSettings& s = settings.integrator;
  const double atol = rtol * (s.step || s.rtol <= 0 ? 1e-2 : s.atol / s.rtol);
  s.atol = std::stod(fmt::format("{:.6e}", atol));  // 1e-07, not 1.0000000000000001e-07
  s.type = integrator;
  s.rtol = rtol;
  s.step.reset();
  s.options = {};  // these belong to the file's own setting only
  return settings;
}

SimulationSettings with_defaults(SimulationSettings settings) {
  settings.formulation = {};
  settings.integrator = default_integrator(settings.start_time, settings.end_time);
  return settings;
}

FormulationSettings constrained(const FormulationSettings& formulation) {
  const bool as_it_is = formulation.type == FormulationType::augmented_lagrangian &&
                        formulation.projection == Projection::position_velocity;
  return as_it_is ? formulation : FormulationSettings{};
}

}  // namespace mbsopt::inline optim
