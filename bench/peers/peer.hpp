// Another multibody program, with a linkage in it. What it cannot do is null.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "bench/linkage.hpp"

namespace mbsopt::bench {

class Peer {
 public:
  virtual ~Peer() = default;

  // Accelerations of the start, all of it: poses, velocities, loads, constraints. Nothing is kept from the call before.
  virtual void right_hand_side() = 0;
  // Of that: the acceleration of a rod's centre.
  virtual Vector3d acceleration(int rod) = 0;

  // Its settings for runs, from coarse to fine.
  virtual int levels() const { return 0; }
  virtual std::string level_name(int) const { return {}; }
  // From the start through the times; centres of all rods at each. Null where it failed or took more processor time
  // than allowed.
  virtual std::optional<std::vector<Eigen::Matrix3Xd>> run(int, const std::vector<double>&, double /*most_seconds*/) {
    return std::nullopt;
  }
};

#ifdef MBSOPT_PEER_SIMBODY
std::unique_ptr<Peer> simbody_peer(const Linkage& linkage);
#endif
#ifdef MBSOPT_PEER_MUJOCO
std::unique_ptr<Peer> mujoco_peer(const Linkage& linkage);
#endif
#ifdef MBSOPT_PEER_DART
std::unique_ptr<Peer> dart_peer(const Linkage& linkage);  // open chains and trees only
#endif

}  // namespace mbsopt::bench
