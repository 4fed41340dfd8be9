// Mechanisms of rods and hinges, of any size, as plain data: what mbsopt and its peers are measured on. Every rod lies
// along a global axis at the start, so that all body frames are the global one there, moved to the centre of mass.
//
//   const Linkage linkage = four_bars(40);
//   Scene scene = scene_of(linkage);             // for mbsopt; bench/peers/ build their own models
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace mbsopt {
struct Scene;
}

namespace mbsopt::bench {

using Eigen::Vector3d;

struct Linkage {
  static constexpr int kGround = -1;

  struct Rod {
    Vector3d centre, inertia;  // of mass; principal moments about it, in global axes [m], [kg m^2]
    double mass = 1;
    Vector3d velocity = Vector3d::Zero(), omega = Vector3d::Zero();  // of the centre, of the rod; global
  };
  struct Hinge {
    int body1 = kGround, body2 = 0;
    Vector3d point, axis;  // global
  };

  std::vector<Rod> rods;
  std::vector<Hinge> hinges;
  Vector3d gravity{0, -9.81, 0};

  int size() const { return static_cast<int>(rods.size()); }
  const Rod& rod(int i) const { return rods[static_cast<std::size_t>(i)]; }
  Vector3d centre(int body) const { return body == kGround ? Vector3d::Zero() : rod(body).centre; }
  Vector3d omega(int body) const { return body == kGround ? Vector3d::Zero() : rod(body).omega; }
  // All hinges about z: the mechanism moves in the plane x-y.
  bool planar() const;
};

// Open: 1 m, 1 kg, each hinge at a rate of its own.
Linkage planar_chain(int rods);   // stairs in x-y, hinges about z
Linkage spatial_chain(int rods);  // hinges about axes in turn
Linkage tree(int rods);           // two rods on the end of each, hinges about axes in turn
// Closed: N windows side by side, IFToMM benchmark A02; 2 N + 1 rods. Rods 0..N are the cranks, then come the couplers.
// Whenever the cranks lie flat, all rods are in one line and the mechanism has N more freedoms for an instant.
Linkage four_bars(int windows);
// Closed, five rods and the ground in a ring of six hinges: one of its equations is redundant.
Linkage bricard();

// Exact motion of four_bars(N): the cranks' angle from the upright, clockwise, at ascending times.
std::vector<double> four_bars_angles(int windows, const std::vector<double>& times);

// Which hinges make a tree that leaves from the ground, nearest first, and which close loops.
struct SpanningTree {
  struct Branch {
    int parent, rod, hinge;
  };
  std::vector<Branch> branches;  // parents before their children
  std::vector<int> closing;      // hinges
};
SpanningTree spanning_tree(const Linkage& linkage);

Scene scene_of(const Linkage& linkage);
// y of the start as mbsopt numbers it.
Eigen::VectorXd start_of(const Linkage& linkage);

}  // namespace mbsopt::bench
