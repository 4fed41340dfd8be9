#include "optim/objective/obstructed_parameters.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "core/start/assembly.hpp"

namespace mbsopt::inline optim {

void require_unobstructed(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active,
                          const std::vector<std::shared_ptr<const UserForce>>& user_forces) {
  std::vector<int> obstructed;
  try {
    obstructed = Assembly(Mechanism(scene, rho, active, user_forces), scene.simulation.start_time).obstructed();
  } catch (const SceneError&) {  // a field that these values drive out of its range
  }
  std::string words;
  for (const int k : obstructed) {
    const std::string& name = scene.parameters[static_cast<std::size_t>(k)].name;
    words += fmt::format(
        "{}parameters.{}: '{}' cannot change by itself: the redundant equations of the joints would contradict each "
        "other, the loop closes for no other value, and the motion has no derivative with respect to it. Let what it "
        "has to agree with depend on the same parameter, or make it a number or a definition",
        words.empty() ? "" : "\n", name, name);
  }
  if (!words.empty()) throw std::invalid_argument(words);
}

}  // namespace mbsopt::inline optim
