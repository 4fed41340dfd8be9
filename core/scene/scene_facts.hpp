// Facts on the whole scene, for checks of single fields: its names, and its parameters' values and units.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/expression/dimension.hpp"
#include "core/expression/program.hpp"
#include "core/scene/scene.hpp"
#include "core/scene/vocabulary.hpp"

namespace mbsopt {

class SceneFacts {
 public:
  explicit SceneFacts(const Scene& scene);

  const Scene& scene() const { return scene_; }

  // nullptr when there is none of that name (or when it is the ground, of bodies).
  const Body* body(const std::string& name) const;
  const Joint* joint(const std::string& name) const;
  const Force* force(const std::string& name) const;
  const Sensor* sensor(const std::string& name) const;
  std::vector<std::string> names(To what) const;  // objectives: those added with add_objectives
  bool has(To what, const std::string& name) const;
  void add_objectives(std::vector<std::string> names) { objectives_ = std::move(names); }

  // Parameters and definitions, and what else an expression may use.
  const Symbols& symbols(Names names) const;

  // Definitions that cannot be evaluated: circular, nested too deep, or with unknown names.
  bool is_broken(const std::string& definition) const { return broken_.contains(definition); }
  // Of those, the ones that are circular or nested too deep: name and what is wrong.
  const std::vector<std::pair<std::string, std::string>>& endless_definitions() const { return endless_; }

  // At the parameters' values, finite; nullopt where it cannot be evaluated. A parameter of NaN has no value that
  // could be read, which is an issue of its own: what depends on it cannot be evaluated either.
  std::optional<double> value(const Field& field) const;
  std::optional<double> any_value(const Field& field) const;  // infinite ones, too
  std::optional<std::array<double, 3>> value(const VectorField& field) const;
  std::optional<std::array<double, 3>> value(const PointField& field, const std::string& body) const;

  // A law of time alone, and its first two derivatives in it; nullopt where it depends on more or cannot be evaluated.
  std::optional<std::array<double, 3>> law_at(const Expression& law, double t) const;

  std::optional<Dimension> dimension_of_name(const std::string& name) const;  // nullopt: not known

 private:
  void find_broken_definitions();
  bool can_be_evaluated(const Expression& expression, const Symbols& symbols) const;

  const Scene& scene_;
  std::map<std::string, const Body*> bodies_;
  std::map<std::string, const Joint*> joints_;
  std::map<std::string, const Drive*> drives_;
  std::map<std::string, const Force*> forces_;
  std::map<std::string, const Sensor*> sensors_;
  std::vector<std::string> objectives_;
  Symbols none_, tsda_law_, rsda_law_, time_law_, objective_;
  std::vector<double> parameter_values_;
  bool any_unread_ = false;
  std::set<std::string> broken_;
  std::vector<std::pair<std::string, std::string>> endless_;
  mutable Program::Scratch scratch_;
  mutable std::map<std::string, std::optional<Dimension>> dimensions_;
};

}  // namespace mbsopt
