#include "core/mechanism/compilation.hpp"

#include "core/scene/scene_error.hpp"

namespace mbsopt {
namespace {

std::vector<int> active_list(const Eigen::VectorXd& rho, const std::vector<bool>& active) {
  std::vector<int> list;
  for (int k = 0; k < rho.size(); ++k) {
    if (active.empty() || active.at(static_cast<std::size_t>(k))) list.push_back(k);
  }
  return list;
}

}  // namespace

Compilation::Compilation(const Scene& s, const Eigen::VectorXd& rho, const std::vector<bool>& active,
                         std::shared_ptr<ScenePrograms> programs)
    : scene(s), fields(std::move(programs), rho, active_list(rho, active)) {
  data.rho = rho;
  data.active = active_list(rho, active);
  data.gravity = numbers(keep(data.slot_gravity, fields.values(scene.gravity, "gravity")));
  bodies_.emplace("ground", 0);
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) bodies_.emplace(scene.bodies[i].name, static_cast<int>(i) + 1);
  for (std::size_t i = 0; i < scene.joints.size(); ++i) joints_.emplace(scene.joints[i].name, i);
}

int Compilation::body_index(const std::string& name, const std::string& where) const {
  const auto found = bodies_.find(name);
  if (found == bodies_.end()) throw SceneError(where + ": there is no body '" + name + "'");
  return found->second;
}

std::size_t Compilation::joint_index(const std::string& name, const std::string& where) const {
  const auto found = joints_.find(name);
  if (found == joints_.end()) throw SceneError(where + ": there is no joint '" + name + "'");
  return found->second;
}

FieldVector3 Compilation::vector(int body, const PointField& field, const std::string& where) const {
  if (const auto* name = std::get_if<std::string>(&field)) {
    if (*name == "O") return fields.constants(Vector3d::Zero());
    if (body > 0) {
      const auto& points = scene.bodies[static_cast<std::size_t>(body - 1)].points;
      if (const auto found = points.find(*name); found != points.end()) {
        return fields.values(found->second,
                             child_path("bodies", static_cast<std::size_t>(body - 1)) + ".points." + *name);
      }
    }
    throw SceneError(where + ": body '" + data.body_names[static_cast<std::size_t>(body)] + "' has no point '" + *name +
                     "'");
  }
  return fields.values(std::get<VectorField>(field), where);
}

FieldVector3 Compilation::point(int body, const PointField& field, const std::string& where) const {
  return vector(body, field, where) - com[static_cast<std::size_t>(body)];
}

FieldVector3 Compilation::direction(int body, const std::optional<PointField>& field, const std::string& where) const {
  if (!field) throw SceneError(where + ": is missing; this joint needs it");
  return unit_axis(vector(body, *field, where), where);
}

FieldVector3 Compilation::unit_axis(const FieldVector3& axis, const std::string& where) const {
  if (numbers(axis).norm() == 0) throw SceneError(where + ": is a zero vector, a direction must not be");
  return unit(axis);
}

}  // namespace mbsopt
