#include "app/import/imported_model.hpp"

namespace mbsopt {

ImportedShape box_shape(const Eigen::Vector3d& half_sides, const Eigen::Isometry3d& at) {
  Eigen::Index longest = 0;
  half_sides.maxCoeff(&longest);
  const Eigen::Vector3d half = half_sides(longest) * Eigen::Vector3d::Unit(longest);
  Eigen::Vector3d others = half_sides;
  others(longest) = 0;
  return {"box", at * Eigen::Vector3d(-half), at * half, others.maxCoeff()};
}

void add_mass(ImportedBody& body, double mass, const Eigen::Vector3d& com, const Eigen::Matrix3d& inertia) {
  body.inertia += inertia;
  if (mass == 0) return;
  const double sum = body.mass + mass;
  const Eigen::Vector3d d = com - body.com;
  body.inertia += body.mass * mass / sum * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  body.com = body.mass == 0 ? com : Eigen::Vector3d((body.mass * body.com + mass * com) / sum);
  body.mass = sum;
}

}  // namespace mbsopt
