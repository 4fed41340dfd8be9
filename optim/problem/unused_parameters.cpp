#include "optim/problem/unused_parameters.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "core/force/bound_force.hpp"
#include "core/scene/field_visitor.hpp"
#include "core/scene/scene_facts.hpp"
#include "core/scene/scene_path.hpp"
#include "optim/problem/load_cases.hpp"
#include "optim/problem/problem_vocabulary.hpp"

namespace mbsopt {

namespace {

template <class Kind>
concept ForceOfJoint = requires(const Kind& kind) {
  kind.joint;
};
template <class Kind>
concept ForceBetweenBodies = requires(const Kind& kind) {
  kind.body1;
};

// Sets of bodies that joints, forces and conditions connect. Make all connections before a query. The ground is no body
// here.
class ConnectedBodies {
 public:
  explicit ConnectedBodies(const Scene& scene) : parent_(scene.bodies.size()) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) index_.emplace(scene.bodies[i].name, i);
  }

  void connect(const std::vector<std::string>& bodies) {
    std::optional<std::size_t> first;
    for (const std::string& body : bodies) {
      const auto it = index_.find(body);
      if (it == index_.end()) continue;
      const std::size_t root = root_of(it->second);
      if (first) parent_[root] = *first;
      first = root_of(root);
    }
  }
  void look_at(const std::vector<std::string>& bodies) {
    for (const std::string& body : bodies)
      if (const auto it = index_.find(body); it != index_.end()) seen_.insert(root_of(it->second));
  }
  void look_at_all() {
    for (std::size_t i = 0; i < parent_.size(); ++i) seen_.insert(root_of(i));
  }
  // Returns whether any of them is connected with an observed body.
  bool matter(const std::vector<std::string>& bodies) {
    for (const std::string& body : bodies)
      if (const auto it = index_.find(body); it != index_.end() && seen_.contains(root_of(it->second))) return true;
    return false;
  }
  bool any_seen() const { return !seen_.empty(); }

 private:
  std::size_t root_of(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  std::vector<std::size_t> parent_;
  std::map<std::string, std::size_t> index_;
  std::set<std::size_t> seen_;  // roots
};

class FieldSearch {
 public:
  explicit FieldSearch(const Problem& problem)
      : problem_(problem), scene_(problem.scene), facts_(scene_), bodies_(scene_) {}

  std::set<std::string> used_parameters() {
    connect_bodies();
    const bool judged_by_anything = !problem_.objectives.empty() || problem_.identification;
    if (judged_by_anything) {
      collect(problem_.objectives);
      if (problem_.identification) collect(problem_.identification->experiments);
    } else {
      for (const Sensor& sensor : scene_.sensors) use_sensor(sensor.name);
      bodies_.look_at_all();
    }
    collect_model();
    return used_;
  }

  // The scene without bodies that no objective depends on, and without elements that act on these alone.
  Scene needed(std::vector<std::string>& left_out) {
    used_parameters();
    Scene needed = scene_;
    const auto idle = [this](const auto& part) { return !bodies_.matter(bodies_of(part)); };
    for (const Body& body : scene_.bodies)
      if (!bodies_.matter({body.name})) left_out.push_back(body.name);
    if (left_out.empty() || left_out.size() == scene_.bodies.size()) return left_out.clear(), needed;
    std::erase_if(needed.bodies, [this](const Body& body) { return !bodies_.matter({body.name}); });
    std::erase_if(needed.joints, idle);
    std::erase_if(needed.drives, idle);
    std::erase_if(needed.forces, idle);
    std::erase_if(needed.conditions, [&](const Condition& condition) {
      const Sensor* const sensor = facts_.sensor(condition.sensor);
      return sensor && idle(*sensor);
    });
    const std::set<std::string> gone(left_out.begin(), left_out.end());
    std::erase_if(needed.sensors, [&](const Sensor& sensor) { return reads(sensor, gone); });
    return needed;
  }

 private:
  // Returns whether the sensor reads one of the bodies; it may also read others.
  bool reads(const Sensor& sensor, const std::set<std::string>& bodies) const {
    if (measures_everything(sensor)) return false;
    const std::vector<std::string> read = bodies_of(sensor);
    return std::any_of(read.begin(), read.end(), [&](const std::string& body) { return bodies.contains(body); });
  }

  std::vector<std::string> bodies_of_joint(const std::string& name) const {
    const Joint* const joint = facts_.joint(name);
    return joint ? bodies_of(*joint) : std::vector<std::string>{};
  }
  std::vector<std::string> bodies_of(const Joint& joint) const {
    if (!ties_joints(joint)) return {joint.body1, joint.body2};
    std::vector<std::string> all;
    for (const std::string& name : {joint.joint1, joint.joint2}) {
      const Joint* const tied = facts_.joint(name);
      if (tied && !ties_joints(*tied)) all.insert(all.end(), {tied->body1, tied->body2});
    }
    return all;
  }
  std::vector<std::string> bodies_of(const Drive& drive) const {
    std::vector<std::string> all = bodies_of_joint(drive.joint);
    all.insert(all.end(), {drive.body, drive.body1, drive.body2});
    return all;
  }

  std::vector<std::string> bodies_of(const Force& force) const {
    return std::visit([this](const auto& kind) { return bodies_of(kind); }, force.kind);
  }
  template <class Kind>
  std::vector<std::string> bodies_of(const Kind& kind) const {
    if constexpr (ForceOfJoint<Kind>) {
      return bodies_of_joint(kind.joint);
    } else if constexpr (ForceBetweenBodies<Kind>) {
      return {kind.body1, kind.body2};
    } else if constexpr (std::is_same_v<Kind, UserForceSpec>) {
      return mbsopt::bodies_of(kind);
    } else {  // on one body, of which its sensors may make it depend on others
      std::vector<std::string> all{kind.body};
      for (const Expression& component : kind.components)
        for (const std::string& name : component.names())
          if (const Sensor* sensor = facts_.sensor(name))
            for (const std::string& body : bodies_of(*sensor)) all.push_back(body);
      return all;
    }
  }

  std::vector<std::string> bodies_of(const Sensor& measured) const {
    std::vector<std::string> all;
    for (const Sensor* const sensor : facts_.measured_by(measured)) {
      const std::vector<std::string> read = bodies_read_by(*sensor);
      all.insert(all.end(), read.begin(), read.end());
    }
    return all;
  }
  std::vector<std::string> bodies_read_by(const Sensor& sensor) const {
    std::vector<std::string> all = bodies_of_joint(sensor.joint);
    if (measures_everything(sensor))
      for (const Body& body : scene_.bodies) all.push_back(body.name);
    if (const Force* force = facts_.force(sensor.force))
      for (const std::string& body : bodies_of(*force)) all.push_back(body);
    for (const std::string& body : {sensor.body, sensor.body1, sensor.body2}) all.push_back(body);
    if (sensor.relative_to) all.push_back(sensor.relative_to->body);
    for (const Drive& drive : scene_.drives) {
      if (drive.name != sensor.drive) continue;
      const std::vector<std::string> driven = bodies_of(drive);
      all.insert(all.end(), driven.begin(), driven.end());
    }
    return all;
  }
  // A quantity that names no part of the mechanism is one of the whole.
  static bool measures_everything(const Sensor& sensor) {
    const TypeRow* const row = find_row(kSensorQuantities, sensor.quantity);
    constexpr const char* kParts[] = {"body", "body2", "joint", "force", "drive", "value"};
    return row && std::ranges::all_of(kParts, [&](const char* part) { return need_of(*row, part) == Need::unknown; });
  }

  void connect_bodies() {
    for (const Joint& joint : scene_.joints) bodies_.connect(bodies_of(joint));
    for (const Drive& drive : scene_.drives) bodies_.connect(bodies_of(drive));
    for (const Force& force : scene_.forces) bodies_.connect(bodies_of(force));
    for (const Condition& condition : scene_.conditions)
      if (const Sensor* sensor = facts_.sensor(condition.sensor)) bodies_.connect(bodies_of(*sensor));
  }

  template <class T>
  void collect(const T& object) {
    FieldVisitor visitor(
        [this](const FieldPlace& at, const Expression& e, Names names) {
          if (!at.in_named_point && !at.in_drawing) use(e, names);
        },
        [this](const std::string& body, const std::string& point) { use_point(body, point); });
    describe(visitor, object);
  }
  void collect(const std::vector<ObjectiveSpec>& objectives) {
    for (const ObjectiveSpec& objective : objectives) {
      collect(objective);
      for (const TrackTerm& term : objective.track) use_sensor(term.sensor);
      if (objective.eigenvalue || (objective.user && objective.user->bodies.empty())) bodies_.look_at_all();
      if (objective.user) bodies_.look_at(objective.user->bodies);
    }
  }
  void collect(const std::vector<ExperimentSpec>& experiments) {
    for (const ExperimentSpec& experiment : experiments) {
      for (const ChannelSpec& channel : experiment.channels) {
        collect(channel);
        use_sensor(channel.sensor);
      }
      for (const DriveLaw& law : experiment.drives) collect(law);
    }
  }

  void use(const Expression& expression, Names names) {
    if (expression.is_number()) return;
    const Symbols& symbols = facts_.symbols(names);
    const Program program(expression, symbols);
    for (const int input : program.used_inputs()) {
      const std::string& name = symbols.input_names()[static_cast<std::size_t>(input)];
      if (input < facts_.symbols(Names::none).inputs())
        used_.insert(name);
      else if (names == Names::objective || names == Names::sensor || names == Names::state)
        use_sensor(name);
    }
  }

  void use_point(const std::string& body, const std::string& point) {
    const Body* const owner = facts_.body(body);
    if (!owner) return;
    if (const auto it = owner->points.find(point); it != owner->points.end())
      for (const Field& field : it->second) use(field, Names::none);
  }

  void use_sensor(const std::string& name) {
    const Sensor* const sensor = facts_.sensor(name);  // "t" is none
    if (!sensor || !used_sensors_.insert(name).second) return;
    collect(*sensor);
    if (measures_everything(*sensor))
      bodies_.look_at_all();
    else
      bodies_.look_at(bodies_of(*sensor));
    if (const Force* force = facts_.force(sensor->force)) collect_force(*force);
    // A joint's angle also depends on the joint's own axes and normals.
    if (const Joint* joint = facts_.joint(sensor->joint)) collect(*joint);
  }

  void collect_model() {
    if (bodies_.any_seen())
      for (const Field& field : scene_.gravity) use(field, Names::none);
    for (const Body& body : scene_.bodies)
      if (bodies_.matter({body.name})) collect(body);
    for (const Joint& joint : scene_.joints)
      if (bodies_.matter(bodies_of(joint))) collect(joint);
    for (const Drive& drive : scene_.drives)
      if (bodies_.matter(bodies_of(drive))) collect(drive);
    for (const Force& force : scene_.forces)
      if (bodies_.matter(bodies_of(force))) collect_force(force);
    for (const Condition& condition : scene_.conditions) {
      const Sensor* const sensor = facts_.sensor(condition.sensor);
      if (!sensor || !bodies_.matter(bodies_of(*sensor))) continue;
      collect(condition);
      collect(*sensor);
    }
  }

  // A law replaces the coefficients.
  void collect_force(Force force) {
    std::visit(
        [](auto& kind) {
          if constexpr (requires { kind.law; }) {
            if (!kind.law) return;
            kind.stiffness = kind.damping = 0.0;
            if constexpr (requires { kind.free_length; })
              kind.free_length = kind.actuator = 0.0;
            else
              kind.free_angle = 0.0;
          }
        },
        force.kind);
    collect(force);
  }

  const Problem& problem_;
  const Scene& scene_;
  SceneFacts facts_;
  ConnectedBodies bodies_;
  std::set<std::string> used_, used_sensors_;
};

// The parameters in use in the problem or in one of its load cases, by the names of the problem.
std::set<std::string> used_in(const Problem& problem) {
  std::set<std::string> used;
  if (problem.cases.empty() || problem.identification) used = FieldSearch(problem).used_parameters();
  for (const CaseSpec& load_case : problem.cases) {
    const Problem of_case = problem_of(problem, load_case);
    const std::set<std::string> names = FieldSearch(of_case).used_parameters();
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
  return FieldSearch(model_only).used_parameters();
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
  const std::set<std::string> by_objectives = FieldSearch(judged).used_parameters();
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
    needed.scene = FieldSearch(judged).needed(names);
  }
  if (left_out) *left_out = std::move(names);
  return needed;
}

Problem what_measurements_need(const Problem& problem, std::vector<std::string>* left_out) {
  Problem needed = problem;
  std::vector<std::string> names;
  if (problem.identification) {
    needed.scene = FieldSearch(as_identified(problem)).needed(names);
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

}  // namespace mbsopt
