#include "optim/problem/unused_parameters.hpp"

#include <algorithm>
#include <numeric>
#include <set>
#include <unordered_map>
#include <utility>

#include "core/force/bound_force.hpp"
#include "core/scene/field_visitor.hpp"
#include "core/scene/scene_facts.hpp"
#include "core/scene/scene_path.hpp"
#include "optim/problem/load_cases.hpp"
#include "optim/problem/problem_vocabulary.hpp"

namespace mbsopt::inline optim {

namespace {

// The names in the fields of elements, and in those of the joints, drives, forces and sensors that these name. Of a
// body only the name counts, since its fields belong to the body alone.
struct Mentions {
  std::set<std::string> parameters, bodies;
  bool whole = false;  // a quantity of all bodies
  std::set<std::pair<ElementKind, std::string>> elements;
};

class MentionSearch {
 public:
  explicit MentionSearch(const Scene& scene) : facts_(scene) {}

  template <class T>
  Mentions of(const T& element) const {
    Mentions found;
    add(element, found);
    return found;
  }
  template <class T>
  void add(const T& element, Mentions& found) const {
    describe_to(found, element);
  }
  void add(const Body& body, Mentions& found) const {
    found.bodies.insert(body.name);
    describe_to(found, body);
  }
  void add(Force force, Mentions& found) const {
    std::visit(
        [](auto& kind) {
          if constexpr (requires { kind.law; })
            if (kind.law) drop_coefficients(kind);
        },
        force.kind);
    describe_to(found, force);
    if (const auto* const user = std::get_if<UserForceSpec>(&force.kind))
      for (const std::string& body : bodies_of(*user)) add(ElementKind::body, body, found);
  }
  void add(const Sensor& sensor, Mentions& found) const {
    found.whole = found.whole || measures_everything(sensor);
    describe_to(found, sensor);
  }
  void add(const ObjectiveSpec& objective, Mentions& found) const {
    found.whole = found.whole || objective.eigenvalue || (objective.user && objective.user->bodies.empty());
    describe_to(found, objective);
  }
  void add(const Expression& expression, Scope names, Mentions& found) const {
    if (expression.is_number()) return;
    const Symbols& symbols = facts_.symbols(names);
    const Program program(expression, symbols);
    for (const int input : program.used_inputs()) {
      const std::string& name = symbols.input_names()[static_cast<std::size_t>(input)];
      if (input < facts_.symbols(Scope::none).inputs())
        found.parameters.insert(name);
      else if (names == Scope::objective || names == Scope::sensor || names == Scope::state)
        add(ElementKind::sensor, name, found);
    }
  }

 private:
  // A law replaces the coefficients.
  static void drop_coefficients(auto& kind) {
    kind.stiffness = kind.damping = 0.0;
    if constexpr (requires { kind.free_length; })
      kind.free_length = kind.actuator = 0.0;
    else
      kind.free_angle = 0.0;
  }
  // A quantity that names no part of the mechanism is one of the whole.
  static bool measures_everything(const Sensor& sensor) {
    const TypeRow* const row = find_row(kSensorQuantities, sensor.quantity);
    constexpr const char* kParts[] = {"body", "body2", "joint", "force", "drive", "value"};
    return row && std::ranges::all_of(kParts, [&](const char* part) { return need_of(*row, part) == Need::unknown; });
  }

  void describe_to(Mentions& found, const auto& element) const {
    FieldVisitor visitor(
        [&](const FieldPlace& at, const Expression& expression, Scope names) {
          if (!at.in_named_point && !at.in_drawing) add(expression, names, found);
        },
        [&](const std::string& body, const std::string& point) { add_point(body, point, found); },
        [&](ElementKind to, const std::string& name) { add(to, name, found); });
    describe(visitor, element);
  }
  void add_point(const std::string& body, const std::string& point, Mentions& found) const {
    const Body* const owner = facts_.body(body);
    if (!owner) return;
    if (const auto it = owner->points.find(point); it != owner->points.end())
      for (const Field& field : it->second) add(field, Scope::none, found);
  }
  void add(ElementKind to, const std::string& name, Mentions& found) const {
    const auto add_if_any = [&](const auto* element) {
      if (element && found.elements.emplace(to, name).second) add(*element, found);
    };
    if (to == ElementKind::body && facts_.body(name)) found.bodies.insert(name);
    if (to == ElementKind::joint) add_if_any(facts_.joint(name));
    if (to == ElementKind::drive) add_if_any(facts_.drive(name));
    if (to == ElementKind::force) add_if_any(facts_.force(name));
    if (to == ElementKind::sensor) add_if_any(facts_.sensor(name));  // "t" is none
  }

  SceneFacts facts_;
};

// Sets of bodies that joints, forces and conditions connect. Make all connections before a query. The ground is no body
// here.
class ConnectedBodies {
 public:
  explicit ConnectedBodies(const std::vector<Body>& bodies) : parent_(bodies.size()), is_observed_(bodies.size()) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    for (std::size_t i = 0; i < bodies.size(); ++i) index_.emplace(bodies[i].name, i);
  }

  void connect(const Mentions& mentions) {
    const std::vector<std::size_t> bodies = roots_of(mentions);
    for (const std::size_t body : bodies) parent_[root_of(body)] = root_of(bodies.front());
  }
  void observe(const Mentions& mentions) {
    for (const std::size_t body : roots_of(mentions)) is_observed_[body] = true;
  }
  // Returns whether any of the bodies is connected with an observed one.
  bool matter(const Mentions& mentions) {
    return std::ranges::any_of(roots_of(mentions), [&](std::size_t body) { return is_observed_[body]; });
  }

 private:
  std::vector<std::size_t> roots_of(const Mentions& mentions) {
    std::vector<std::size_t> roots;
    if (mentions.whole)
      for (std::size_t i = 0; i < parent_.size(); ++i) roots.push_back(root_of(i));
    else
      for (const std::string& body : mentions.bodies) roots.push_back(root_of(index_.at(body)));
    return roots;
  }
  std::size_t root_of(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  std::vector<std::size_t> parent_;
  std::vector<bool> is_observed_;  // of roots
  std::unordered_map<std::string, std::size_t> index_;
};

// Collects what the objectives and measurements of a problem depend on. Without any, a sensor of everything replaces
// them.
class Reach {
 public:
  explicit Reach(const Problem& problem) : scene_(problem.scene), search_(scene_), bodies_(scene_.bodies) {
    std::vector<Mentions> model;
    const auto add = [&](const auto& elements) {
      for (const auto& element : elements) bodies_.connect(model.emplace_back(search_.of(element)));
    };
    add(scene_.bodies), add(scene_.joints), add(scene_.drives), add(scene_.forces), add(scene_.conditions);
    Mentions observed = observed_by(problem);
    bodies_.observe(observed);
    if (observed.whole || !observed.bodies.empty())
      for (const Field& field : scene_.gravity) search_.add(field, Scope::none, observed);
    for (Mentions& element : model)
      if (bodies_.matter(element)) observed.parameters.merge(element.parameters);
    parameters_ = std::move(observed.parameters);
  }

  const std::set<std::string>& parameters() const { return parameters_; }

  // The scene without bodies that nothing observed depends on, and without elements that act on these alone.
  Scene needed(std::vector<std::string>& left_out) {
    const auto is_idle = [&](const auto& element) { return !bodies_.matter(search_.of(element)); };
    std::set<std::string> gone;
    for (const Body& body : scene_.bodies)
      if (is_idle(body)) left_out.push_back(body.name), gone.insert(body.name);
    Scene needed = scene_;
    if (left_out.empty() || left_out.size() == scene_.bodies.size()) return left_out.clear(), needed;
    std::erase_if(needed.bodies, is_idle);
    std::erase_if(needed.joints, is_idle);
    std::erase_if(needed.drives, is_idle);
    std::erase_if(needed.forces, is_idle);
    std::erase_if(needed.conditions, is_idle);
    std::erase_if(needed.sensors, [&](const Sensor& sensor) {
      const std::set<std::string> read = search_.of(sensor).bodies;
      return std::ranges::any_of(read, [&](const std::string& body) { return gone.contains(body); });
    });
    return needed;
  }

 private:
  Mentions observed_by(const Problem& problem) const {
    Mentions observed;
    for (const ObjectiveSpec& objective : problem.objectives) search_.add(objective, observed);
    if (problem.identification)
      for (const ExperimentSpec& experiment : problem.identification->experiments) {
        for (const ChannelSpec& channel : experiment.channels) search_.add(channel, observed);
        for (const DriveLaw& law : experiment.drives)
          if (!law.samples) search_.add(law.law, Scope::time_law, observed);
      }
    if (problem.objectives.empty() && !problem.identification) {
      for (const Sensor& sensor : scene_.sensors) search_.add(sensor, observed);
      observed.whole = true;
    }
    return observed;
  }

  const Scene& scene_;
  MentionSearch search_;
  ConnectedBodies bodies_;
  std::set<std::string> parameters_;
};

// The parameters in use in the problem or in one of its load cases, by the names of the problem.
std::set<std::string> used_in(const Problem& problem) {
  std::set<std::string> used;
  if (problem.cases.empty() || problem.identification) used = Reach(problem).parameters();
  for (const CaseSpec& load_case : problem.cases) {
    const Problem of_case = problem_of(problem, load_case);
    const std::set<std::string> names = Reach(of_case).parameters();
    for (std::size_t k = 0; k < problem.scene.parameters.size(); ++k)
      if (names.contains(of_case.scene.parameters[k].name)) used.insert(problem.scene.parameters[k].name);
  }
  return used;
}

// The problem with only those objectives that its design uses.
Problem as_designed(const Problem& problem) {
  Problem designed;
  designed.scene = problem.scene, designed.cases = problem.cases;
  for (const ObjectiveSpec& objective : problem.objectives) {
    const std::vector<ObjectiveBound>& bounds = problem.design->subject_to;
    const auto bounds_it = [&](const ObjectiveBound& bound) { return bound.objective == objective.name; };
    if (objective.name == problem.design->minimize || std::any_of(bounds.begin(), bounds.end(), bounds_it))
      designed.objectives.push_back(objective);
  }
  return designed;
}

Problem as_identified(const Problem& problem) {
  Problem identified;
  identified.scene = problem.scene;
  identified.identification = problem.identification;
  return identified;
}

void add_idle(const std::vector<std::string>& variables, const Problem& judged_by, const std::string& list,
              const std::string& what, std::vector<SceneIssue>& issues) {
  const std::set<std::string> used = used_in(judged_by);
  std::set<std::string> reported;  // when nothing uses them
  for (const Parameter& parameter : judged_by.scene.parameters)
    if (!parameter.allow_unused) reported.insert(parameter.name);
  for (std::size_t i = 0; i < variables.size(); ++i) {
    if (!reported.contains(variables[i]) || used.contains(variables[i])) continue;
    issues.push_back({child_path(list, i), "'" + variables[i] + "' cannot influence " + what +
                                               ": its derivatives are zero, and it would stay as it is; take it out"});
  }
}

// Without objectives and identification, every use of a parameter counts.
std::set<std::string> used_anywhere(const Problem& problem) {
  Problem model_only;
  model_only.scene = problem.scene;
  return Reach(model_only).parameters();
}

// This counts coefficients that a law replaces, too.
std::set<std::string> used_beside_laws(Problem problem) {
  for (Force& force : problem.scene.forces)
    std::visit(
        [](auto& kind) {
          if constexpr (requires { kind.law; }) kind.law.reset();
        },
        force.kind);
  return used_anywhere(problem);
}

}  // namespace

std::vector<SceneIssue> find_unused_parameters(const Problem& problem) {
  std::vector<SceneIssue> issues;
  const std::set<std::string> used = used_in(problem);
  std::vector<const Parameter*> unused;
  for (const Parameter& parameter : problem.scene.parameters)
    if (!parameter.allow_unused && !used.contains(parameter.name)) unused.push_back(&parameter);
  if (unused.empty()) return issues;
  const std::set<std::string> anywhere = used_anywhere(problem), beside_laws = used_beside_laws(problem);
  for (const Parameter* const parameter : unused) {
    const std::string what =
        anywhere.contains(parameter->name)
            ? "'" + parameter->name + "' cannot influence any objective or measurement: its derivatives are zero"
        : beside_laws.contains(parameter->name)
            ? "'" + parameter->name + "' is used only by coefficients that a law replaces"
            : "'" + parameter->name + "' is used by nothing";
    issues.push_back({"parameters." + parameter->name, what + "; \"allow_unused\": true lifts this error"});
  }
  return issues;
}

void allow_what_only_measurements_use(Problem& problem) {
  if (problem.objectives.empty() || (!problem.identification && problem.cases.empty())) return;
  const std::set<std::string> used = used_in(problem);
  Problem judged = problem;
  judged.identification.reset(), judged.cases.clear();
  const std::set<std::string> by_objectives = Reach(judged).parameters();
  for (Parameter& p : problem.scene.parameters)
    p.allow_unused = p.allow_unused || (used.contains(p.name) && !by_objectives.contains(p.name));
}

Problem what_objectives_need(const Problem& problem, std::vector<std::string>* left_out) {
  Problem needed = problem;
  std::vector<std::string> names;
  // Costs written in C++ read the state by the numbers of bodies: they need all bodies.
  const bool opaque = std::ranges::any_of(problem.objectives, &ObjectiveSpec::is_written_in_cpp);
  if (!problem.objectives.empty() && !opaque) {
    Problem judged = problem;
    judged.identification.reset();
    needed.scene = Reach(judged).needed(names);
  }
  if (left_out) *left_out = std::move(names);
  return needed;
}

Problem what_measurements_need(const Problem& problem, std::vector<std::string>* left_out) {
  Problem needed = problem;
  std::vector<std::string> names;
  if (problem.identification) {
    needed.scene = Reach(as_identified(problem)).needed(names);
    const auto has = [](const Scene& scene, const std::string& drive) {
      return std::any_of(scene.drives.begin(), scene.drives.end(), [&](const Drive& d) { return d.name == drive; });
    };
    const auto is_left_out = [&](const DriveLaw& law) {
      return has(problem.scene, law.drive) && !has(needed.scene, law.drive);
    };
    for (ExperimentSpec& experiment : needed.identification->experiments) std::erase_if(experiment.drives, is_left_out);
  }
  if (left_out) *left_out = std::move(names);
  return needed;
}

std::vector<SceneIssue> find_idle_variables(const Problem& problem) {
  std::vector<SceneIssue> issues;
  if (problem.design)
    add_idle(problem.design->variables, as_designed(problem), "design.variables",
             "any objective that the design minimises or bounds", issues);
  if (problem.identification) {
    const IdentificationSpec& identification = *problem.identification;
    const Problem identified = as_identified(problem);
    constexpr const char* kMeasured = "anything that is measured";
    add_idle(identification.variables, identified, "identification.variables", kMeasured, issues);
    for (std::size_t e = 0; e < identification.experiments.size(); ++e)
      add_idle(identification.experiments[e].free, identified, child_path("identification.experiments", e) + ".free",
               kMeasured, issues);
  }
  return issues;
}

}  // namespace mbsopt::inline optim
