// Mechanisms of a scene at different parameter values share its expressions as programs, each compiled once, and what
// is known of its loops. Several threads may use them.
//
//   const auto programs = std::make_shared<ScenePrograms>(scene);
//   const Mechanism first(scene, rho, active, {}, programs), second(scene, other_rho, active, {}, programs);
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "core/expression/program.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt {

// Whether the equations of a mechanism's loops were found independent: within its plane, or in space.
struct IndependentLoops {
  std::atomic<bool> in_plane = false, in_space = false;
};

class ScenePrograms {
 public:
  explicit ScenePrograms(const Scene& scene);

  IndependentLoops independent_loops;

  const Symbols& symbols() const { return symbols_; }  // parameters (inputs, in order), definitions, signals

  // The program of a numeric field, and f, f_t, f_tt of a law of time, whose last input is t. Both throw UnknownName.
  std::shared_ptr<const Program> field(const Expression& field);
  std::shared_ptr<const std::array<Program, 3>> law(const Expression& law);
  std::shared_ptr<const std::array<Program, 3>> law(const SampledLaw& samples);

 private:
  using Law = std::array<Program, 3>;
  template <class Made>
  struct Entry {
    Expression expression;  // keeps the tree or the curve, by which it is found
    std::shared_ptr<const Made> made;
  };
  template <class Made>
  using Table = std::unordered_map<const void*, Entry<Made>>;

  Law made(const Expression& law) const;

  Symbols symbols_, symbols_of_time_;
  std::mutex mutex_;
  Table<Program> fields_;
  Table<Law> laws_;
};

}  // namespace mbsopt
