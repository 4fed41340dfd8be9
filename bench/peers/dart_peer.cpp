// DART: the articulated-body algorithm in joint coordinates. Its loops are closed by impulses in a time-stepping
// scheme, which has no right-hand side: open mechanisms only.
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>

#include "bench/peers/peer.hpp"

namespace mbsopt::bench {
namespace {

namespace dynamics = dart::dynamics;

class Dart final : public Peer {
 public:
  explicit Dart(const Linkage& linkage) : skeleton_(dynamics::Skeleton::create("linkage")) {
    skeleton_->setGravity(linkage.gravity);
    bodies_.resize(linkage.rods.size());
    const SpanningTree tree = spanning_tree(linkage);
    rates_.resize(static_cast<Eigen::Index>(linkage.rods.size()));
    for (const auto& [parent, rod, hinge] : tree.branches) {
      const Linkage::Hinge& h = linkage.hinges[static_cast<std::size_t>(hinge)];
      const Linkage::Rod& r = linkage.rod(rod);
      dynamics::RevoluteJoint::Properties joint;
      joint.mName = "hinge" + std::to_string(hinge);
      joint.mAxis = h.axis;
      joint.mT_ParentBodyToJoint.translation() = h.point - linkage.centre(parent);
      joint.mT_ChildBodyToJoint.translation() = h.point - r.centre;
      dynamics::BodyNode::Properties body;
      body.mName = "rod" + std::to_string(rod);
      body.mInertia.setMass(r.mass);
      body.mInertia.setMoment(r.inertia.asDiagonal());
      dynamics::BodyNode* on = parent == Linkage::kGround ? nullptr : bodies_[static_cast<std::size_t>(parent)];
      const auto made = skeleton_->createJointAndBodyNodePair<dynamics::RevoluteJoint>(on, joint, body);
      bodies_[static_cast<std::size_t>(rod)] = made.second;
      made.first->setVelocity(0, h.axis.dot(r.omega - linkage.omega(parent)));
    }
    positions_ = skeleton_->getPositions();
    rates_ = skeleton_->getVelocities();
  }

  void right_hand_side() override {
    nudge_ = -nudge_;  // the same positions again would be ignored, and what was computed from them kept
    positions_.array() += nudge_, rates_.array() += nudge_;
    skeleton_->setPositions(positions_);
    skeleton_->setVelocities(rates_);
    skeleton_->computeForwardDynamics();
  }
  Vector3d acceleration(int rod) override { return bodies_[static_cast<std::size_t>(rod)]->getCOMLinearAcceleration(); }

 private:
  dynamics::SkeletonPtr skeleton_;
  std::vector<dynamics::BodyNode*> bodies_;
  Eigen::VectorXd positions_, rates_;
  double nudge_ = 1e-13;
};

}  // namespace

std::unique_ptr<Peer> dart_peer(const Linkage& linkage) {
  if (!spanning_tree(linkage).closing.empty()) return nullptr;
  return std::make_unique<Dart>(linkage);
}

}  // namespace mbsopt::bench
