#include "app/import/mjcf_model.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "app/import/geom.hpp"
#include "app/import/mjcf_defaults.hpp"

namespace mbsopt {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDensity = 1000;  // of geoms without mass and density, by MuJoCo's XML reference [kg/m^3]

// The smallest rotation that moves z there. If it is opposite to z, this is half a turn about x, as in MuJoCo.
Matrix3d with_z_along(const Vector3d& direction) {
  const Vector3d across = Vector3d::UnitZ().cross(direction);
  const Vector3d axis = across.norm() > 0 ? across.normalized() : Vector3d::UnitX();
  return Eigen::AngleAxisd(std::atan2(across.norm(), direction.z()), axis).toRotationMatrix();
}

// The reader does not read bodies or joints in these elements; without them the model would move differently.
constexpr std::array kRefused{"include", "composite", "flexcomp", "replicate", "attach"};

class MjcfReader {
 public:
  MjcfReader(const XmlElement& mujoco, const std::string& file)
      : mujoco_(mujoco), errors_(file), defaults_(mujoco, errors_) {}

  ImportedModel read() {
    model_.name = mujoco_.text("model").value_or("mujoco");
    model_.bodies.push_back({.name = "ground"});
    refuse_unread_mechanics(mujoco_);
    for (const XmlElement* compiler : mujoco_.children("compiler")) read_compiler(*compiler);
    for (const XmlElement* option : mujoco_.children("option")) read_option(*option);
    if (!enabled("gravity")) model_.gravity.setZero();
    for (const XmlElement* world : mujoco_.children("worldbody"))
      read_contents(*world, {0, Isometry3d::Identity(), "", false});
    if (total_mass_) scale_masses();
    for (const XmlElement* equality : mujoco_.children("equality")) {
      for (const XmlElement* e : equality->children("connect")) read_connect(*e);
      for (const XmlElement* e : equality->children("weld")) read_connection(*e, "fixed", Vector3d::Zero());
      for (const XmlElement* e : equality->children("joint")) read_joint_tie(*e);
    }
    errors_.throw_if_any();
    return std::move(model_);
  }

 private:
  struct Around {  // an element: its body, and its frame in that of the body
    int body;
    Isometry3d frame;
    std::string childclass;
    bool geoms_weigh;  // not those of the world, nor of a body whose <inertial> says its mass
  };

  void refuse_unread_mechanics(const XmlElement& element) {
    for (const XmlElement* child : element.children()) {
      if (std::ranges::find(kRefused, child->name) != kRefused.end())
        errors_.add(*child, "is not read; let MuJoCo write the model as one plain file first (mj_saveLastXML)");
      refuse_unread_mechanics(*child);
    }
  }

  void read_compiler(const XmlElement& compiler) {
    degrees_ = keyword(compiler, "angle", {"degree", "radian"}, degrees_ ? "degree" : "radian") == "degree";
    if (const auto sequence = compiler.text("eulerseq")) {
      if (sequence->size() != 3 || sequence->find_first_not_of("xyzXYZ") != std::string::npos)
        errors_.add(compiler, fmt::format("eulerseq: is '{}', must be three of x y z X Y Z", *sequence));
      else
        euler_sequence_ = *sequence;
    }
    if (compiler.text("coordinate").value_or("local") != "local")
      errors_.add(compiler, "coordinate: only local coordinates are read");
    inertia_from_geoms_ = keyword(compiler, "inertiafromgeom", {"auto", "true", "false"}, inertia_from_geoms_);
    if (const auto sum = compiler.text("settotalmass")) {
      const double mass = numbers(compiler, "settotalmass", *sum, 1, errors_)(0);
      if (mass > 0) total_mass_ = mass;
    }
  }

  void read_option(const XmlElement& option) {
    if (const auto g = option.text("gravity")) model_.gravity = numbers(option, "gravity", *g, 3, errors_);
    const XmlElement* const flag = option.child("flag");
    if (!flag) return;
    for (auto& [name, value] : flags_) value = keyword(*flag, name, {"enable", "disable"}, value);
  }

  bool enabled(const std::string& flag) const { return flags_.at(flag) == "enable"; }

  // Returns one of MuJoCo's words. Any other word is a finding, and gives the first one.
  std::string keyword(const XmlElement& element, const std::string& attribute, const std::vector<std::string>& words,
                      const std::string& otherwise) {
    const std::string word = element.text(attribute).value_or(otherwise);
    if (std::ranges::find(words, word) != words.end()) return word;
    errors_.add(element, fmt::format("{}: is '{}', must be {}", attribute, word, fmt::join(words, " or ")));
    return words.front();
  }

  // Reads bodies, geoms and sites of the world, of a body or of a <frame>, which only moves and turns its contents.
  void read_contents(const XmlElement& element, const Around& around) {
    for (const XmlElement* geom : element.children("geom")) read_geom(*geom, around);
    for (const XmlElement* site : element.children("site")) {
      const auto name = site->text("name");
      const Vector3d at = around.frame * vector(*site, around, "pos", Vector3d::Zero());
      if (name && around.body > 0) body(around).points.emplace_back(*name, at);
    }
    for (const XmlElement* child : element.children()) {  // in the order of the file
      if (child->name != "body" && child->name != "frame") continue;
      child->mark_read();
      if (child->name == "body")
        read_body(*child, around);
      else
        read_contents(*child, {around.body, around.frame * placement(*child, around), childclass(*child, around),
                               around.geoms_weigh});
    }
  }

  void read_body(const XmlElement& element, const Around& around) {
    Around inside{around.body, around.frame * placement(element, around), childclass(element, around), true};
    const std::string name = element.text("name").value_or(fmt::format("body{}", model_.bodies.size()));
    std::vector<PlacedJoint> joints;
    collect_joints(element, {inside.body, Isometry3d::Identity(), inside.childclass, false}, joints);
    const bool free = joints.size() == 1 && is_free(joints[0]);
    if (free) read_free_joint(joints[0]);
    if (!joints.empty()) {
      // Each joint lies between two bodies; those before the last one have no mass.
      const std::size_t count = joints.size();
      for (std::size_t k = 0; k < count; ++k) {
        const int parent = inside.body;
        const Isometry3d between = inside.frame;
        inside.body = static_cast<int>(model_.bodies.size());
        inside.frame = Isometry3d::Identity();
        const bool last = k + 1 == count;
        const std::string joint_name =
            free ? "" : joints[k].element->text("name").value_or(fmt::format("{}_joint{}", name, k + 1));
        model_.bodies.push_back({.name = body_names_.body(last ? name : name + "_" + joint_name),
                                 .frame = model_.bodies[static_cast<std::size_t>(parent)].frame * between,
                                 .source = &element});
        if (!last)
          model_.changed.push_back(fmt::format("'{}' has {} joints: '{}' without mass stands between two of them", name,
                                               count, model_.bodies.back().name));
        if (!free) read_joint(joints[k], joint_name, parent, between, inside.body);
      }
    } else if (around.body > 0) {
      body(around).points.emplace_back(name, inside.frame.translation());
      model_.changed.push_back(fmt::format("body '{}' has no joint and is a part of '{}'", name, body(around).name));
    }
    placed_[name] = inside;
    const XmlElement* const inertial = element.child("inertial");
    inside.geoms_weigh = inertia_from_geoms_ == "true" || (!inertial && inertia_from_geoms_ == "auto");
    if (inertial && inertia_from_geoms_ != "true") read_inertial(*inertial, inside);
    read_contents(element, inside);
  }

  struct PlacedJoint {
    const XmlElement* element;
    Around around;  // frame: that of the <frame> around the joint, in the frame of its body
  };

  // The joints of a body, also those in a <frame>, in the order of the file.
  void collect_joints(const XmlElement& element, const Around& around, std::vector<PlacedJoint>& joints) {
    for (const XmlElement* child : element.children()) {
      if (child->name == "joint" || child->name == "freejoint") {
        child->mark_read();
        joints.push_back({child, around});
      } else if (child->name == "frame") {
        collect_joints(
            *child, {around.body, around.frame * placement(*child, around), childclass(*child, around), false}, joints);
        if (const XmlElement* const inertial = child->child("inertial"))
          errors_.add(*inertial, "is in a <frame>; it must be directly in its body");
      }
    }
  }

  std::string joint_type(const XmlElement& joint, const Around& around) {
    return text(joint, around, "type").value_or("hinge");
  }
  bool is_free(const PlacedJoint& joint) {
    return joint.element->name == "freejoint" || joint_type(*joint.element, joint.around) == "free";
  }

  // No class acts on <freejoint>.
  void read_free_joint(const PlacedJoint& joint) {
    joint.element->text("name");
    if (joint.element->name == "joint") leave_out(joint, {"damping", "stiffness", "frictionloss"});
  }

  // Returns damping, stiffness or frictionloss, or 0 if a flag switches it off.
  double coefficient(const PlacedJoint& joint, const std::string& attribute) {
    const double value = number(*joint.element, joint.around, attribute, 0);
    const bool acts =
        attribute == "frictionloss" ? enabled("frictionloss") && enabled("constraint") : enabled("passive");
    return acts ? value : 0;
  }

  void leave_out(const PlacedJoint& joint, const std::vector<std::string>& attributes) {
    for (const std::string& attribute : attributes) {
      const double value = coefficient(joint, attribute);
      if (value == 0) continue;
      const std::string type = joint_type(*joint.element, joint.around);
      model_.changed.push_back(left_out(*joint.element, fmt::format("{} {} of a {} joint", attribute, value, type)));
    }
  }

  void read_joint(const PlacedJoint& placed_joint, const std::string& name, int parent, const Isometry3d& between,
                  int child) {
    const auto& [source, around] = placed_joint;
    const XmlElement& element = *source;
    const std::string type = is_free(placed_joint) ? "free" : joint_type(element, around);
    const std::string ours = type == "hinge"   ? "revolute"
                             : type == "slide" ? "translational"
                             : type == "ball"  ? "spherical"
                                               : "";
    if (ours.empty())
      return errors_.add(element, type == "free"
                                      ? "a free joint must be its body's only one"
                                      : fmt::format("the type is '{}'; available: free, ball, slide, hinge", type));
    ImportedJoint joint{.name = joint_names_.body(name), .type = ours, .body1 = parent, .body2 = child};
    joint.source = &element;
    joint.between = between;
    joint.point = around.frame * vector(element, around, "pos", Vector3d::Zero());
    const Vector3d axis = around.frame.linear() * vector(element, around, "axis", Vector3d::UnitZ());
    if (axis.norm() == 0) errors_.add(element, "axis: is zero");
    joint.axis = axis.normalized();
    joint.damping = coefficient(placed_joint, "damping");
    if (type == "ball") {
      leave_out(placed_joint, {"stiffness", "frictionloss"});
    } else {
      // The spring is at rest at springref; the model is drawn at ref.
      const double unit = type == "hinge" ? angle_unit() : 1;
      joint.stiffness = coefficient(placed_joint, "stiffness");
      joint.free_value = unit * (number(element, around, "springref", 0) - number(element, around, "ref", 0));
      joint.coulomb = coefficient(placed_joint, "frictionloss");
    }
    joint_index_[name] = static_cast<int>(model_.joints.size());
    model_.joints.push_back(joint);
  }

  void read_inertial(const XmlElement& inertial, const Around& inside) {
    const Isometry3d at = inside.frame * placement(inertial, inside);
    Matrix3d tensor = Matrix3d::Zero();
    if (const auto full = inertial.text("fullinertia")) {  // xx yy zz xy xz yz
      const Eigen::VectorXd J = numbers(inertial, "fullinertia", *full, 6, errors_);
      tensor << J(0), J(3), J(4), J(3), J(1), J(5), J(4), J(5), J(2);
    } else {
      tensor.diagonal() = vector(inertial, inside, "diaginertia", Vector3d::Zero());
    }
    if (!inertial.text("mass")) errors_.add(inertial, "has no attribute 'mass'");
    add_part(body(inside), inertial, number(inertial, inside, "mass", 0), at.translation(),
             at.linear() * tensor * at.linear().transpose(), errors_);
  }

  void read_geom(const XmlElement& element, const Around& around) {
    const std::string type = text(element, around, "type").value_or("sphere");
    // The ground has no shape. Its bodies without joints count in settotalmass.
    if (around.body == 0 && !(total_mass_ && around.geoms_weigh)) return element.mark_unread();
    if (type == "plane" || type == "hfield" || type == "sdf") return element.mark_unread();
    if (type == "mesh" || element.text("mesh")) {
      if (around.geoms_weigh && number(element, around, "mass", 1) != 0)
        errors_.add(element, "its mass is that of a mesh, which is not read: give the body an <inertial>");
      return element.mark_unread();
    }
    const std::optional<Geom> geom = solid(element, around, type);
    if (!geom) return;
    if (around.geoms_weigh) {
      const std::optional<std::string> given = text(element, around, "mass");
      const double density = number(element, around, "density", kDensity);
      const double mass = given ? number(element, around, "mass", 0) : density * volume(*geom);
      const Matrix3d R = geom->at.linear();
      add_part(body(around), element, mass, geom->at.translation(),
               mass * R * unit_inertia(*geom).asDiagonal() * R.transpose(), errors_);
    }
    if (around.body > 0) body(around).shapes.push_back(shape_of(*geom));
  }

  std::optional<Geom> solid(const XmlElement& element, const Around& around, const std::string& type) {
    constexpr std::array<std::pair<const char*, std::size_t>, 5> kSizes{
        {{"sphere", 1}, {"capsule", 2}, {"cylinder", 2}, {"ellipsoid", 3}, {"box", 3}}};
    const auto row = std::ranges::find(kSizes, type, [](const auto& r) { return std::string(r.first); });
    if (row == kSizes.end()) {
      errors_.add(element, fmt::format("there is no type '{}' of geoms", type));
      return std::nullopt;
    }
    std::vector<double> size = numbers(element, "size", text(element, around, "size").value_or("0"), errors_);
    Geom geom{.type = type, .size = Vector3d::Zero()};
    const std::optional<std::string> fromto = text(element, around, "fromto");
    if (fromto && element.text("pos")) errors_.add(element, "pos: must not be given with fromto, not even by a class");
    if (fromto && type != "sphere") {  // the z axis runs from one end to the other
      const Eigen::VectorXd ends = numbers(element, "fromto", *fromto, 6, errors_);
      const Vector3d from = ends.head<3>(), along = Vector3d(ends.tail<3>()) - from;
      geom.at.translation() = from + along / 2;
      geom.at.linear() = with_z_along(along);
      if (row->second == 3 && !size.empty()) size = {size[0], size[0]};
      size.resize(row->second - 1);
      size.push_back(along.norm() / 2);
    } else {
      geom.at = placement(element, around);
    }
    geom.at = around.frame * geom.at;
    if (size.size() < row->second ||
        *std::min_element(size.begin(), size.begin() + static_cast<long>(row->second)) <= 0) {
      errors_.add(element, fmt::format("size: a {} needs {} above 0", type,
                                       row->second == 1 ? "a number" : fmt::format("{} numbers", row->second)));
      return std::nullopt;
    }
    for (std::size_t k = 0; k < row->second; ++k) geom.size(static_cast<Eigen::Index>(k)) = size[k];
    return geom;
  }

  void scale_masses() {
    double sum = 0;
    for (const ImportedBody& b : model_.bodies) sum += b.mass;
    if (sum == 0) return;
    for (ImportedBody& b : model_.bodies) {
      b.mass *= *total_mass_ / sum;
      b.inertia *= *total_mass_ / sum;
    }
  }

  // Finds a body of the model by an attribute of an equality. If there is none, it reports a finding.
  std::optional<Around> placed(const XmlElement& element, const char* attribute, bool world_otherwise) {
    const std::optional<std::string> name = element.text(attribute);
    if ((!name && world_otherwise) || name == "world") return Around{0, Isometry3d::Identity(), "", false};
    if (!name) {
      errors_.add(element, fmt::format("has no attribute '{}'", attribute));
      return std::nullopt;
    }
    const auto found = placed_.find(*name);
    if (found != placed_.end()) return found->second;
    errors_.add(element, fmt::format("{}: there is no body '{}'", attribute, *name));
    return std::nullopt;
  }

  bool is_active(const XmlElement& element) {
    const bool active =
        keyword(element, "active", {"true", "false"}, "true") == "true" && enabled("equality") && enabled("constraint");
    if (!active)
      model_.changed.push_back(fmt::format("line {}: {} is not active, and left out", element.line, element.name));
    return active;
  }

  // MuJoCo's equalities are springs of its solver; here they hold exactly. point is in the frame of the body `a`.
  void read_connection(const XmlElement& element, const std::string& type, const Vector3d& point) {
    std::optional<Around> a = placed(element, "body1", false), b = placed(element, "body2", true);
    if (!a || !b || !is_active(element)) return;
    if (a->body == b->body) return errors_.add(element, "its bodies are one body: no joint lets them move");
    const Vector3d place = body(*a).frame * a->frame * point;
    if (b->body == 0) std::swap(a, b);  // the ground comes first
    ImportedJoint joint{
        .name = joint_names_.body(element.text("name").value_or(fmt::format("{}{}", element.name, element.line))),
        .type = type,
        .body1 = a->body,
        .body2 = b->body,
        .between = body(*a).frame.inverse() * body(*b).frame,
        .point = body(*b).frame.inverse() * place};
    joint.source = &element;
    model_.joints.push_back(joint);
  }

  void read_connect(const XmlElement& element) {
    const std::optional<std::string> anchor = element.text("anchor");
    if (!anchor) return errors_.add(element, "has no attribute 'anchor'");
    read_connection(element, "spherical", numbers(element, "anchor", *anchor, 3, errors_));
  }

  // q1 = q1_0 + c0 + c1 (q2 - q2_0) + c2 (q2 - q2_0)^2 + ...   Ties here are linear and start where the file draws the
  // joints.
  void read_joint_tie(const XmlElement& element) {
    const std::string coefficients = element.text("polycoef").value_or("0 1 0 0 0");
    const std::vector<double> c = numbers(element, "polycoef", coefficients, errors_);
    const auto driven = joint_index_.find(element.text("joint1").value_or(""));
    const auto driver = joint_index_.find(element.text("joint2").value_or(""));
    if (driven == joint_index_.end() || driver == joint_index_.end())
      return errors_.add(element, "must tie two joints of hinges or slides: joint1 and joint2");
    const bool linear =
        c.size() >= 2 && c[0] == 0 && std::all_of(c.begin() + 2, c.end(), [](double x) { return x == 0; });
    if (!linear) return errors_.add(element, "polycoef: only 0 c 0 0 0 is read");
    if (!is_active(element)) return;
    model_.ties.push_back({.name = joint_names_.body(driven->first + " follows " + driver->first),
                           .joint1 = driver->second,
                           .joint2 = driven->second,
                           .factor = c[1],
                           .source = &element});
  }

  ImportedBody& body(const Around& around) { return model_.bodies[static_cast<std::size_t>(around.body)]; }

  std::string childclass(const XmlElement& element, const Around& around) {
    return element.text("childclass").value_or(around.childclass);
  }
  std::optional<std::string> text(const XmlElement& element, const Around& around, std::string_view attribute) {
    return defaults_.text(element, around.childclass, attribute);
  }
  Vector3d vector(const XmlElement& element, const Around& around, std::string_view attribute,
                  const Vector3d& otherwise) {
    const std::optional<std::string> given = text(element, around, attribute);
    return given ? Vector3d(numbers(element, attribute, *given, 3, errors_)) : otherwise;
  }
  double number(const XmlElement& element, const Around& around, std::string_view attribute, double otherwise) {
    const std::optional<std::string> given = text(element, around, attribute);
    return given ? numbers(element, attribute, *given, 1, errors_)(0) : otherwise;
  }
  double angle_unit() const { return degrees_ ? std::numbers::pi / 180 : 1; }

  Isometry3d placement(const XmlElement& element, const Around& around) {
    Isometry3d frame = Isometry3d::Identity();
    frame.translation() = vector(element, around, "pos", Vector3d::Zero());
    frame.linear() = orientation(element, around);
    return frame;
  }

  // The orientation of the element, or of its class and the classes around it.
  Matrix3d orientation(const XmlElement& element, const Around& around) {
    std::optional<Matrix3d> found;
    for (const XmlElement* source : defaults_.sources(element, around.childclass)) {
      const std::optional<Matrix3d> own = own_orientation(*source);
      if (!found) found = own;
    }
    return found.value_or(Matrix3d::Identity());
  }

  std::optional<Matrix3d> own_orientation(const XmlElement& element) {
    const auto given = [&](const char* attribute, Eigen::Index count) -> std::optional<Eigen::VectorXd> {
      const std::optional<std::string> words = element.text(attribute);
      if (!words) return std::nullopt;
      const Eigen::VectorXd values = numbers(element, attribute, *words, count, errors_);
      if (values.head(std::min<Eigen::Index>(count, 4)).norm() > 0 || std::string(attribute) == "euler") return values;
      errors_.add(element, fmt::format("{}: is zero", attribute));
      return std::nullopt;
    };
    if (const auto q = given("quat", 4))
      return Quaterniond((*q)(0), (*q)(1), (*q)(2), (*q)(3)).normalized().toRotationMatrix();
    if (const auto a = given("axisangle", 4)) {
      const Vector3d axis = a->head<3>();
      if (axis.norm() > 0) return Eigen::AngleAxisd(angle_unit() * (*a)(3), axis.normalized()).toRotationMatrix();
      errors_.add(element, "axisangle: the axis is zero");
    }
    if (const auto axes = given("xyaxes", 6)) {
      const Vector3d x = axes->head<3>().normalized(), y = axes->tail<3>();
      const Vector3d z = x.cross(y);
      if (z.norm() == 0) errors_.add(element, "xyaxes: the axes are parallel");
      Matrix3d R;
      R << x, z.normalized().cross(x), z.normalized();
      return R;
    }
    if (const auto z = given("zaxis", 3)) return with_z_along(*z);
    if (const auto angles = given("euler", 3)) {
      Matrix3d R = Matrix3d::Identity();
      for (std::size_t k = 0; k < 3; ++k) {  // small letters: about the turned axes; capitals: about the fixed ones
        const char c = euler_sequence_[k];
        const Matrix3d turn = rotation((c | 0x20) - 'x', angle_unit() * (*angles)(static_cast<Eigen::Index>(k)));
        R = c >= 'x' ? Matrix3d(R * turn) : Matrix3d(turn * R);
      }
      return R;
    }
    return std::nullopt;
  }

  const XmlElement& mujoco_;
  ModelErrors errors_;
  MjcfDefaults defaults_;
  ImportedModel model_;
  Names body_names_{{"ground"}, &model_.changed}, joint_names_{{}, &model_.changed};
  std::map<std::string, Around> placed_;                               // bodies of the model by name
  std::map<std::string, int> joint_index_;                             // of hinges, slides and balls
  bool degrees_ = true;                                                // compiler: angle
  std::string euler_sequence_ = "xyz";                                 // compiler: eulerseq
  std::string inertia_from_geoms_ = "auto";                            // compiler: inertiafromgeom
  std::optional<double> total_mass_;                                   // compiler: settotalmass [kg]
  std::map<std::string, std::string> flags_{{"gravity", "enable"},     // option: flag
                                            {"passive", "enable"},     // springs and dampers
                                            {"constraint", "enable"},  // equality, frictionloss and others
                                            {"equality", "enable"},
                                            {"frictionloss", "enable"}};
};

}  // namespace

ImportedModel mjcf_model(const XmlElement& mujoco, const std::string& file) { return MjcfReader(mujoco, file).read(); }

}  // namespace mbsopt
