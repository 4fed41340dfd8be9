// The kinds of forces between two bodies, one of which may be the ground; nothing else lists them. Each kind has
//   bodies()                       the two
//   add_load, pull_back            its loads, and the gradient of their virtual work
//   at, tangent                    what the tangent needs of a state, and the tangent of the loads in the two frames
//   add_field_tangent              the same in the directions of fields and parameters
//   potential, pull_back_potential 0 if it has none
//   conserves_energy               whether all of its work is that of its potential
//   natural_energy                 a scale of its potential [J]
// A kind with a Law also has measured and pull_back_measured: the law's value, which the sensor of a force needs.
#pragma once

#include <concepts>
#include <tuple>
#include <type_traits>
#include <vector>

#include "core/constraint/dot2.hpp"
#include "core/force/bushing.hpp"
#include "core/force/friction.hpp"
#include "core/force/joint_effort.hpp"
#include "core/force/tsda.hpp"

namespace mbsopt {

extern template struct JointEffort<Angle, FrictionLaw>;
extern template struct JointEffort<Dot2, FrictionLaw>;
extern template struct JointEffort<Dot2, Law>;
using TurningFriction = JointEffort<Angle, FrictionLaw>;
using SlidingFriction = JointEffort<Dot2, FrictionLaw>;
using SlidingForce = JointEffort<Dot2, Law>;  // of stops along an axis, and of planes

template <class Kind>
concept HasLaw = std::same_as<decltype(Kind::law), Law>;

template <class... Kinds>
class ForceLists {
 public:
  template <class Kind>
  std::vector<Kind>& of() {
    return std::get<std::vector<Kind>>(lists_);
  }
  template <class Kind>
  const std::vector<Kind>& of() const {
    return std::get<std::vector<Kind>>(lists_);
  }
  std::size_t size() const {
    return std::apply([](const auto&... list) { return (list.size() + ...); }, lists_);
  }
  bool empty() const { return size() == 0; }

  // Calls visitor(force), kind by kind, or visitor(force, place) if it takes two arguments.
  template <class Visitor>
  void for_each(Visitor&& visitor) const {
    std::size_t kind = 0;
    const auto visit = [&](const auto& list) {
      for (std::size_t i = 0; i < list.size(); ++i) {
        if constexpr (std::invocable<Visitor&, decltype(list[i])>) {
          visitor(list[i]);
        } else {
          visitor(list[i], ForcePlace{kind, i});
        }
      }
      ++kind;
    };
    std::apply([&](const auto&... list) { (visit(list), ...); }, lists_);
  }
  template <class Visitor>
  bool all_of(Visitor&& holds) const {
    bool all = true;
    for_each([&](const auto& force) { all = all && holds(force); });
    return all;
  }
  // Calls visitor(force) if its kind has a law.
  template <class Visitor>
  void visit_law(ForcePlace place, Visitor&& visitor) const {
    visit_law_in(lists_, place, visitor);
  }
  template <class Visitor>
  void change_law(ForcePlace place, Visitor&& visitor) {
    visit_law_in(lists_, place, visitor);
  }

 private:
  template <class Lists, class Visitor>
  static void visit_law_in(Lists& lists, ForcePlace place, Visitor&& visitor) {
    std::size_t kind = 0;
    const auto visit = [&](auto& list) {
      if constexpr (HasLaw<typename std::decay_t<decltype(list)>::value_type>) {
        if (kind == place.kind) visitor(list[place.index]);
      }
      ++kind;
    };
    std::apply([&](auto&... list) { (visit(list), ...); }, lists);
  }

  std::tuple<std::vector<Kinds>...> lists_;
};

struct Forces : ForceLists<TsdaForce, RsdaForce, TurningFriction, SlidingFriction, SlidingForce, Bushing> {};

}  // namespace mbsopt
