// Facts on the whole scene, for checks of single fields: its names, and the values and units of its parameters.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/expression/dimension.hpp"
#include "core/expression/dimension_inference.hpp"
#include "core/expression/program.hpp"
#include "core/scene/scene.hpp"
#include "core/scene/vocabulary.hpp"

namespace mbsopt {

class SceneFacts {
 public:
  explicit SceneFacts(const Scene& scene);

  const Scene& scene() const { return scene_; }

  // Return nullptr if nothing has that name. The ground counts as no body.
  const Body* body(const std::string& name) const { return found(scene_.bodies, ElementKind::body, name); }
  const Joint* joint(const std::string& name) const { return found(scene_.joints, ElementKind::joint, name); }
  const Drive* drive(const std::string& name) const { return found(scene_.drives, ElementKind::drive, name); }
  const Force* force(const std::string& name) const { return found(scene_.forces, ElementKind::force, name); }
  const Sensor* sensor(const std::string& name) const { return found(scene_.sensors, ElementKind::sensor, name); }
  // The ground is among the names of bodies. Objectives are those added with add_objectives.
  const std::vector<std::string>& names(ElementKind what) const { return names_[at(what)].all; }
  bool has(ElementKind what, const std::string& name) const {
    return names_[at(what)].place.contains(name) || (what == ElementKind::body && name == "ground");
  }
  void add_objectives(const std::vector<std::string>& names) { set_names(ElementKind::objective, names); }

  // Parameters, definitions, and the other names that an expression may use.
  const Symbols& symbols(Scope names) const;

  // Returns whether a definition or a sensor's expression cannot be evaluated: it is circular, nested too deep, or has
  // unknown names.
  bool is_broken(const std::string& definition) const { return broken_.contains(definition); }
  // The circular and too deeply nested ones among them: path and fault.
  const std::vector<std::pair<std::string, std::string>>& endless_definitions() const { return endless_; }

  // The finite value at the parameters' values; nullopt if it cannot be evaluated. A parameter of NaN has no readable
  // value, which is an issue of its own. So fields that depend on it cannot be evaluated either.
  std::optional<double> value(const Field& field) const;
  std::optional<double> any_value(const Field& field) const;  // infinite ones, too
  std::optional<std::array<double, 3>> value(const VectorField& field) const;
  std::optional<std::array<double, 3>> value(const PointField& field, const std::string& body) const;

  struct Scale {
    double length = 0;  // the largest distance of a point from the origin of its body or of the ground [m]
    double mass = 0;    // the largest of a body [kg]
  };
  const Scale& scale() const;

  // A law of time alone and its first two derivatives; nullopt if it depends on more or cannot be evaluated.
  std::optional<std::array<double, 3>> law_at(const Expression& law, double t) const;

  std::optional<Dimension> dimension_of_name(const std::string& name) const;  // nullopt: not known

  // An expression reads the largest of these. An expression of velocities is not linear in them, and reads the state.
  Reads reads_of(const Sensor& sensor) const;
  std::optional<Dimension> dimension_of(const Sensor& sensor,
                                        PlainNumbers plain = PlainNumbers::fit_everything) const;  // nullopt: not known
  // The dimension of a name in a sensor's expression.
  std::optional<Dimension> dimension_in_sensor(const std::string& name,
                                               PlainNumbers plain = PlainNumbers::fit_everything) const;

 private:
  struct Named {  // a definition or an expression sensor
    std::string path, name;
    const Expression* value;
    const Symbols* symbols;
  };
  void find_broken(const std::vector<Named>& all);  // and evaluates the other definitions
  double value_at(const Program& program) const;    // of constants_
  // The program's names of an expression that can be evaluated; otherwise none.
  std::vector<std::string> used_names(const Expression& expression, const Symbols& symbols) const;
  bool can_be_evaluated(const Expression& expression, const Symbols& symbols) const;

  struct Names {
    std::vector<std::string> all;
    std::unordered_map<std::string, std::size_t> place;  // of the first element with a name in its list
  };
  static std::size_t at(ElementKind what) { return static_cast<std::size_t>(what); }
  void set_names(ElementKind what, const std::vector<std::string>& names);
  template <class T>
  const T* found(const std::vector<T>& list, ElementKind what, const std::string& name) const {
    const auto it = names_[at(what)].place.find(name);
    return it == names_[at(what)].place.end() ? nullptr : &list[it->second];
  }

  const Scene& scene_;
  std::array<Names, kElementKinds> names_;
  Symbols none_, tsda_law_, rsda_law_, time_law_, objective_;
  Symbols constants_;           // parameters, then definitions, all of them inputs
  std::vector<double> values_;  // of constants_
  bool any_unread_ = false;
  std::set<std::string> broken_;
  std::vector<std::pair<std::string, std::string>> endless_;
  mutable Program::Scratch scratch_;
  mutable std::unordered_map<const SyntaxTree*, double> computed_;
  mutable std::optional<Scale> scale_;
  mutable std::map<std::string, std::optional<Dimension>> dimensions_;
  mutable std::map<std::pair<std::string, PlainNumbers>, std::optional<Dimension>> dimensions_of_sensors_;
};

// Adds t and the sensors as inputs, in this order. The name of an expression sensor stands for its expression, so that
// programs read the sensors that it measures by.
void add_time_and_sensors(Symbols& symbols, const Scene& scene);

// The dimension and unit in which a sensor's values are printed: "rad", "m/s"; "-" for a number; empty if unknown.
// Plain numbers of an expression count as pure.
std::optional<Dimension> shown_dimension(const Scene& scene, const Sensor& sensor);
std::string unit_of(const Scene& scene, const Sensor& sensor);

}  // namespace mbsopt
