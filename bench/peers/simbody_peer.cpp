// Simbody: joint coordinates, loops closed by constraints. A plane loop takes two equations per closing hinge (a point
// in two planes), a spatial one five (a ball and two constant angles).
#include <Simbody.h>
#include <fmt/format.h>

#include "bench/peers/peer.hpp"
#include "bench/repeated.hpp"

namespace mbsopt::bench {
namespace {

SimTK::Vec3 vec(const Vector3d& x) { return {x(0), x(1), x(2)}; }

class Simbody final : public Peer {
 public:
  explicit Simbody(const Linkage& linkage)
      : matter_(system_), forces_(system_), gravity_(forces_, matter_, vec(linkage.gravity)) {
    const SpanningTree tree = spanning_tree(linkage);
    bodies_.resize(linkage.rods.size());
    std::vector<double> rates(linkage.rods.size());
    const auto mobilized = [&](int body) -> SimTK::MobilizedBody& {
      return body == Linkage::kGround ? matter_.updGround() : matter_.updMobilizedBody(at(body));
    };
    for (const auto& [parent, rod, hinge] : tree.branches) {
      const Linkage::Hinge& h = linkage.hinges[static_cast<std::size_t>(hinge)];
      const Linkage::Rod& r = linkage.rod(rod);
      const SimTK::Rotation R(SimTK::UnitVec3(vec(h.axis)), SimTK::ZAxis);
      const SimTK::Body::Rigid body(
          SimTK::MassProperties(r.mass, SimTK::Vec3(0), SimTK::Inertia(r.inertia(0), r.inertia(1), r.inertia(2))));
      const SimTK::MobilizedBody::Pin pin(mobilized(parent), SimTK::Transform(R, vec(h.point - linkage.centre(parent))),
                                          body, SimTK::Transform(R, vec(h.point - r.centre)));
      bodies_[static_cast<std::size_t>(rod)] = pin.getMobilizedBodyIndex();
      rates[static_cast<std::size_t>(rod)] = h.axis.dot(r.omega - linkage.omega(parent));
    }
    for (const int hinge : tree.closing) {
      const Linkage::Hinge& h = linkage.hinges[static_cast<std::size_t>(hinge)];
      SimTK::MobilizedBody &b1 = mobilized(h.body1), &b2 = mobilized(h.body2);
      const SimTK::Vec3 p1 = vec(h.point - linkage.centre(h.body1)), p2 = vec(h.point - linkage.centre(h.body2));
      if (linkage.planar()) {
        for (const int axis : {0, 1}) {
          SimTK::Vec3 normal(0);
          normal[axis] = 1;
          SimTK::Constraint::PointInPlane(b1, SimTK::UnitVec3(normal), p1[axis], b2, p2);
        }
      } else {
        SimTK::Constraint::Ball(b1, p1, b2, p2);
        const SimTK::UnitVec3 axis(vec(h.axis)), one = axis.perp(), two(SimTK::cross(axis, one));
        SimTK::Constraint::ConstantAngle(b1, one, b2, axis);
        SimTK::Constraint::ConstantAngle(b1, two, b2, axis);
      }
    }
    system_.realizeTopology();
    start_ = system_.getDefaultState();
    system_.realizeModel(start_);
    for (std::size_t i = 0; i < bodies_.size(); ++i) matter_.getMobilizedBody(bodies_[i]).setOneU(start_, 0, rates[i]);
  }

  void right_hand_side() override {
    start_.updQ();  // forgets what was computed from the positions
    system_.realize(start_, SimTK::Stage::Acceleration);
  }
  Vector3d acceleration(int rod) override {
    const SimTK::Vec3 a = matter_.getMobilizedBody(at(rod)).getBodyOriginAcceleration(start_);
    return {a[0], a[1], a[2]};
  }

  int levels() const override { return 7; }
  std::string level_name(int level) const override {
    return fmt::format("Runge-Kutta-Merson, accuracy {:.0e}", accuracy(level));
  }
  std::optional<std::vector<Eigen::Matrix3Xd>> run(int level, const std::vector<double>& times,
                                                   double most_seconds) override {
    SimTK::RungeKuttaMersonIntegrator integrator(system_);
    integrator.setAccuracy(accuracy(level));
    SimTK::TimeStepper stepper(system_, integrator);
    const ThreadClock clock;
    std::vector<Eigen::Matrix3Xd> centres;
    try {
      stepper.initialize(start_);
      for (const double t : times) {
        stepper.stepTo(t);
        if (clock.seconds() > most_seconds) return std::nullopt;
        Eigen::Matrix3Xd now(3, static_cast<Eigen::Index>(bodies_.size()));
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
          const SimTK::Vec3 r = matter_.getMobilizedBody(bodies_[i]).getBodyOriginLocation(integrator.getState());
          now.col(static_cast<Eigen::Index>(i)) << r[0], r[1], r[2];
        }
        centres.push_back(std::move(now));
      }
    } catch (const std::exception&) {
      return std::nullopt;
    }
    return centres;
  }

 private:
  static double accuracy(int level) { return std::pow(10.0, -3 - level); }
  SimTK::MobilizedBodyIndex at(int rod) const { return bodies_[static_cast<std::size_t>(rod)]; }

  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_;
  SimTK::GeneralForceSubsystem forces_;
  SimTK::Force::UniformGravity gravity_;
  std::vector<SimTK::MobilizedBodyIndex> bodies_;
  SimTK::State start_;
};

}  // namespace

std::unique_ptr<Peer> simbody_peer(const Linkage& linkage) { return std::make_unique<Simbody>(linkage); }

}  // namespace mbsopt::bench
