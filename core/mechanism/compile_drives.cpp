// Drives: a coordinate, distance, angle or displacement follows a law of time. Each drive is one row of Phi.
#include "core/constraint/constraint.hpp"
#include "core/mechanism/compilation.hpp"
#include "core/mechanism/kinks_in_time.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/scene_programs.hpp"
#include "core/scene/signals.hpp"

namespace mbsopt {
namespace {

constexpr std::string_view kCoordinates[] = {"x", "y", "z", "e0", "e1", "e2", "e3"};

// A global coordinate of any body point: a dot-2 with the ground. kinematic_scene.hpp makes such drives.
Constraint point_coordinate(Compilation& model, const Drive& drive, const std::string& where) {
  Constraint c;
  c.body2 = model.body_index(drive.body, where + ".body");
  Dot2 dot2;
  dot2.s2 = numbers(model.keep(c.slot2, model.point(c.body2, drive.point2, where + ".point2")));
  dot2.s3 = Vector3d::Unit(drive.coordinate == "x" ? 0 : drive.coordinate == "y" ? 1 : 2);
  c.primitive = dot2;
  return c;
}

Constraint measured(Compilation& model, const Drive& drive, const std::string& where) {
  if (drive.type == "angle") {
    Constraint c = model.joint_angle_term(drive.joint, Compilation::Zero::normals, where + ".joint");
    c.angle = Constraint::kNearestLaw;
    return c;
  }
  if (drive.type == "displacement") return model.joint_displacement_term(drive.joint, where + ".joint");
  Constraint c;
  if (drive.type == "coordinate") {
    c.body2 = model.body_index(drive.body, where + ".body");
    if (c.body2 == 0) throw SceneError(where + ".body: is the ground, which never moves");
    Coordinate coordinate;
    const auto found = std::find(std::begin(kCoordinates), std::end(kCoordinates), drive.coordinate);
    if (found == std::end(kCoordinates)) {
      throw SceneError(where + ".coordinate: is '" + drive.coordinate + "'; allowed: x, y, z, e0, e1, e2, e3");
    }
    coordinate.index = static_cast<int>(found - std::begin(kCoordinates));
    c.primitive = coordinate;
    return c;
  }
  if (drive.type == "point") return point_coordinate(model, drive, where);
  if (drive.type != "distance") throw SceneError(where + ".type: '" + drive.type + "' is not a drive known here");
  c.body1 = model.body_index(drive.body1, where + ".body1");
  c.body2 = model.body_index(drive.body2, where + ".body2");
  Distance distance;
  distance.s1 = numbers(model.keep(c.slot1, model.point(c.body1, drive.point1, where + ".point1")));
  distance.s2 = numbers(model.keep(c.slot2, model.point(c.body2, drive.point2, where + ".point2")));
  c.primitive = distance;
  return c;
}

TimeLaw law_of(Compilation& model, const Drive& drive, const std::string& where) {
  TimeLaw law;
  if (drive.samples) {
    if (!drive.samples->curve) throw SceneError(where + ".law: has no samples: nothing has read its file");
    const SimulationSettings& s = model.scene.simulation;
    if (const auto why = uncovered(covered_by(*drive.samples->curve), s.start_time, s.end_time))
      throw SceneError(where + ".law: " + *why);
    law.smooth = true;
  }
  try {
    ScenePrograms& programs = model.fields.programs();
    law.programs = drive.samples ? programs.law(*drive.samples) : programs.law(drive.law);
    add_kinks_in_time((*law.programs)[2], static_cast<int>(model.data.rho.size()), model.data.rho, model.data.kinks);
  } catch (const UnknownName& e) {
    throw SceneError(where + ".law: " + e.what());
  }
  return law;
}

}  // namespace

void compile_drives(Compilation& model) {
  for (std::size_t i = 0; i < model.scene.drives.size(); ++i) {
    const Drive& drive = model.scene.drives[i];
    const std::string where = child_path("drives", i);
    Constraint c = measured(model, drive, where);
    c.drive = static_cast<int>(i);
    model.data.drive_names.push_back(drive.name);
    const int row = model.add_constraint(std::move(c));
    model.data.laws.push_back({row, law_of(model, drive, where), static_cast<int>(i)});
  }
}

}  // namespace mbsopt
