#include "optim/problem/unused_parameters.hpp"

#include <algorithm>
#include <memory>
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
    if (measures_everything(sensor)) add_whole(found);
    describe_to(found, sensor);
  }
  void add(const ObjectiveSpec& objective, Mentions& found) const {
    if (objective.eigenvalue || objective.frequency_response || (objective.user && objective.user->bodies.empty()))
      add_whole(found);
    describe_to(found, objective);
  }
  void add_whole(Mentions& found) const {
    found.whole = true;
    for (const Body& body : facts_.scene().bodies) found.bodies.insert(body.name);
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
    return row && std::ranges::all_of(kParts, [&](const char* part) { return (*row)[part] == Need::unknown; });
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

// The lists of what acts on bodies.
void for_acting(auto& scene, const auto& f) {
  f(scene.bodies), f(scene.joints), f(scene.drives), f(scene.forces), f(scene.limits), f(scene.conditions);
}

// Collects what the objectives and measurements of a problem depend on. Without any, a sensor of everything replaces
// them. Joints, forces and conditions on an observed body make all their bodies observed. The ground is no body here.
class Reach {
 public:
  explicit Reach(const Problem& problem, bool whole = false) : scene_(problem.scene), search_(scene_) {
    Mentions observed = observed_by(problem);
    if (whole || (problem.objectives.empty() && !problem.identification)) {
      for (const Sensor& sensor : scene_.sensors) search_.add(sensor, observed);
      search_.add_whole(observed);
    }
    if (!observed.bodies.empty())
      for (const Field& field : scene_.gravity) search_.add(field, Scope::none, observed);
    std::unordered_map<std::string, std::vector<std::shared_ptr<Mentions>>> acting;  // on each body
    for_acting(scene_, [&](const auto& elements) {
      for (const auto& element : elements) {
        const auto mentions = std::make_shared<Mentions>(search_.of(element));
        for (const std::string& body : mentions->bodies) acting[body].push_back(mentions);
      }
    });
    parameters_ = std::move(observed.parameters);
    bodies_ = std::move(observed.bodies);
    std::vector<std::string> found(bodies_.begin(), bodies_.end());
    while (!found.empty()) {
      const std::vector<std::shared_ptr<Mentions>> here = std::move(acting[found.back()]);
      found.pop_back();
      for (const std::shared_ptr<Mentions>& element : here) {
        parameters_.merge(element->parameters);
        for (const std::string& body : element->bodies)
          if (bodies_.insert(body).second) found.push_back(body);
        element->bodies.clear();
      }
    }
  }

  const std::set<std::string>& parameters() const { return parameters_; }

  // The scene without bodies that nothing observed depends on, and without elements that act on these alone.
  Scene needed(std::vector<std::string>* left_out) const {
    const auto is_observed = [&](const std::string& body) { return bodies_.contains(body); };
    std::vector<std::string> gone;
    for (const Body& body : scene_.bodies)
      if (!is_observed(body.name)) gone.push_back(body.name);
    Scene needed = scene_;
    if (gone.empty() || bodies_.empty()) return needed;
    if (left_out) *left_out = std::move(gone);
    for_acting(needed, [&](auto& elements) {
      std::erase_if(elements,
                    [&](const auto& element) { return std::ranges::none_of(search_.of(element).bodies, is_observed); });
    });
    std::erase_if(needed.sensors, [&](const Sensor& sensor) {
      const Mentions read = search_.of(sensor);
      return !read.whole && !std::ranges::all_of(read.bodies, is_observed);
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
    return observed;
  }

  const Scene& scene_;
  MentionSearch search_;
  std::set<std::string> bodies_, parameters_;  // observed; in use
};

// The parameters in use in the problem or in one of its load cases, by the names of the problem.
std::set<std::string> used_in(const Problem& problem, bool whole = false) {
  std::set<std::string> used;
  if (problem.cases.empty() || problem.identification) used = Reach(problem, whole).parameters();
  for (const CaseSpec& load_case : problem.cases) {
    const Problem of_case = problem_of(problem, load_case);
    const std::set<std::string> names = Reach(of_case).parameters();
    for (std::size_t k = 0; k < problem.scene.parameters.size(); ++k)
      if (names.contains(of_case.scene.parameters[k].name)) used.insert(problem.scene.parameters[k].name);
  }
  return used;
}

// The problem with only those objectives that its design uses.
Problem as_designed(Problem problem) {
  problem.identification.reset();
  std::erase_if(problem.objectives,
                [&](const ObjectiveSpec& objective) { return !problem.design->uses(objective.name); });
  return problem;
}

Problem as_identified(Problem problem) {
  problem.objectives.clear();
  problem.cases.clear();
  return problem;
}

Problem without_measurements(Problem problem) {
  problem.identification.reset();
  problem.cases.clear();
  return problem;
}

void add_idle(const std::vector<std::string>& variables, const Problem& judged_by, const std::string& list,
              const std::string& what, std::vector<SceneIssue>& issues) {
  const std::set<std::string> used = used_in(judged_by);
  const std::vector<Parameter>& parameters = judged_by.scene.parameters;
  for (std::size_t i = 0; i < variables.size(); ++i) {
    const auto parameter = std::ranges::find(parameters, variables[i], &Parameter::name);
    if (parameter == parameters.end() || parameter->allow_unused || used.contains(variables[i])) continue;
    issues.push_back({child_path(list, i), "'" + variables[i] + "' cannot influence " + what +
                                               ": its derivatives are zero, and it would stay as it is; take it out"});
  }
}

// Whatever uses a parameter counts, also coefficients if no law replaces them.
std::set<std::string> used_anywhere(Problem problem, bool with_laws) {
  problem.objectives.clear();
  problem.identification.reset();
  for (Force& force : problem.scene.forces)
    std::visit(
        [&](auto& kind) {
          if constexpr (requires { kind.law; })
            if (!with_laws) kind.law.reset();
        },
        force.kind);
  return Reach(problem).parameters();
}

}  // namespace

std::vector<SceneIssue> find_unused_parameters(const Problem& problem, bool whole) {
  std::vector<SceneIssue> issues;
  std::set<std::string> used = used_in(problem, whole);
  if (!problem.cases.empty()) {
    const std::set<std::string> without_cases = Reach(problem, whole).parameters();
    for (const CaseSpec& load_case : problem.cases)  // a value that every load case replaces has its use in none
      for (const Definition& override : load_case.overrides)
        if (without_cases.contains(override.name)) used.insert(override.name);
  }
  std::vector<const Parameter*> unused;
  for (const Parameter& parameter : problem.scene.parameters)
    if (!parameter.allow_unused && !used.contains(parameter.name)) unused.push_back(&parameter);
  if (unused.empty()) return issues;
  const std::set<std::string> anywhere = used_anywhere(problem, true), beside_laws = used_anywhere(problem, false);
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
  const std::set<std::string> by_objectives = Reach(without_measurements(problem)).parameters();
  for (Parameter& p : problem.scene.parameters)
    p.allow_unused = p.allow_unused || (used.contains(p.name) && !by_objectives.contains(p.name));
}

Problem what_objectives_need(const Problem& problem, std::vector<std::string>* left_out) {
  Problem needed = problem;
  // Costs written in C++ read the state by the numbers of bodies: they need all bodies.
  const bool opaque = std::ranges::any_of(problem.objectives, &ObjectiveSpec::is_written_in_cpp);
  if (!problem.objectives.empty() && !opaque) needed.scene = Reach(without_measurements(problem)).needed(left_out);
  return needed;
}

Problem what_measurements_need(const Problem& problem, std::vector<std::string>* left_out) {
  Problem needed = problem;
  if (!problem.identification) return needed;
  needed.scene = Reach(as_identified(problem)).needed(left_out);
  const auto has = [](const Scene& scene, const DriveLaw& law) {
    return std::ranges::find(scene.drives, law.drive, &Drive::name) != scene.drives.end();
  };
  for (ExperimentSpec& experiment : needed.identification->experiments)
    std::erase_if(experiment.drives,
                  [&](const DriveLaw& law) { return has(problem.scene, law) && !has(needed.scene, law); });
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

std::vector<ParameterUse> parameter_uses(const Problem& problem) {
  const SceneFacts facts(problem.scene);
  std::vector<ParameterUse> uses;
  for (const Parameter& p : problem.scene.parameters) uses.push_back({p.name, {}});
  auto on_expression = [&](const FieldPlace& at, const Expression& expression, Scope names) {
    if (expression.is_number()) return;
    const Symbols& symbols = facts.symbols(names);
    const Program program(expression, symbols);
    for (const int input : program.used_inputs()) {
      if (input < static_cast<int>(uses.size())) uses[static_cast<std::size_t>(input)].fields.push_back(at.path);
    }
  };
  FieldVisitor visitor(on_expression, [](const std::string&, const std::string&) {});
  describe(visitor, problem);
  return uses;
}

}  // namespace mbsopt::inline optim
