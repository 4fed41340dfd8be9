// MJCF, the models of MuJoCo (its documentation, "XML Reference"): bodies in bodies, joints between a body and its
// parent.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/import/geom.hpp"
#include "app/import/model_builder.hpp"

namespace mbsopt::inline app {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

const std::vector<std::string> kSwitch{"enable", "disable"};

// Units: m, kg, N, s; angles in degrees unless <compiler angle="radian">. Switches of flag: passive is springs and
// dampers, constraint is equality, frictionloss and others. Attributes that act and are dropped: inertia of rotors,
// stops, contact, actuators, a medium.
// clang-format off
const std::vector<ModelAttribute> kMjcf{
    {"mujoco model", kWord, "mujoco"}, {"default class"},
    {"compiler angle", kWord, "degree", {"degree", "radian"}}, {"compiler coordinate", kWord, "local", {"local"}},
    {"compiler inertiafromgeom", kWord, "auto", {"auto", "true", "false"}}, {"compiler settotalmass", 1, "-1"},
    {"compiler eulerseq", kWord, "xyz"}, {"compiler balanceinertia", kActs}, {"compiler boundinertia", kActs},
    {"compiler boundmass", kActs}, {"compiler inertiagrouprange", kActs},
    {"option gravity", 3, "0 0 -9.81"}, {"option density", kActs}, {"option viscosity", kActs}, {"option wind", kActs},
    {"flag gravity", kWord, "enable", kSwitch}, {"flag passive", kWord, "enable", kSwitch},
    {"flag constraint", kWord, "enable", kSwitch}, {"flag equality", kWord, "enable", kSwitch},
    {"flag frictionloss", kWord, "enable", kSwitch},
    {"* pos", 3, "0 0 0"}, {"* quat", kNonzero + 4}, {"* axisangle", 4}, {"* xyaxes", 6}, {"* zaxis", kNonzero + 3}, {"* euler", 3},
    {"body gravcomp", kActs}, {"body mocap", kActs},
    {"joint type", kWord, "hinge"}, {"joint axis", kNonzero + 3, "0 0 1"}, {"joint ref", 1, "0"}, {"joint springref", 1, "0"},
    {"joint stiffness", 1, "0"}, {"joint damping", 1, "0"}, {"joint frictionloss", 1, "0"},
    {"joint armature", kActs}, {"joint margin", kActs}, {"joint range", kActs}, {"joint springdamper", kActs},
    {"inertial mass", 1}, {"inertial diaginertia", 3, "0 0 0"}, {"inertial fullinertia", 6},
    {"geom type", kWord, "sphere"}, {"geom size", kList, "0"}, {"geom fromto", 6}, {"geom mass", 1},
    {"geom density", 1, "1000"}, {"geom fluidshape", kActs}, {"geom shellinertia", kActs}, {"geom", kActs},
    {"* active", kWord, "true", {"true", "false"}}, {"* body1"}, {"* body2", kWord, "world"},
    {"connect anchor", 3}, {"joint polycoef", kList, "0 1 0 0 0"}, {"weld relpose", kActs},
    {"actuator", kActs}, {"contact", kActs}, {"distance", kActs}, {"tendon", kActs}};
// clang-format on

const std::map<std::string, std::string> kMjcfTypes{
    {"hinge", "revolute"}, {"slide", "translational"}, {"ball", "spherical"}, {"free", ""}};

using Kinds = std::vector<std::string>;
const Kinds kOrientations{"quat", "axisangle", "xyaxes", "zaxis", "euler"};  // an element has one of them

bool is_one_of(const std::string& word, const Kinds& words) { return std::ranges::find(words, word) != words.end(); }

// The smallest rotation that moves z there. If it is opposite to z, this is half a turn about x, as in MuJoCo.
Matrix3d with_z_along(const Vector3d& direction) {
  const Vector3d across = Vector3d::UnitZ().cross(direction);
  const Vector3d axis = across.norm() > 0 ? across.normalized() : Vector3d::UnitX();
  return Eigen::AngleAxisd(std::atan2(across.norm(), direction.z()), axis).toRotationMatrix();
}

// The reader does not read bodies or joints in these elements; without them the model would move differently.
void refuse_unread_mechanics(const ModelElement& element) {
  for (const ModelElement& child : element.children()) {
    if (is_one_of(child.name(), {"include", "composite", "flexcomp", "replicate", "attach"}))
      child.error("is not read; let MuJoCo write the model as one plain file first (mj_saveLastXML)");
    refuse_unread_mechanics(child);
  }
}

class MjcfReader : ModelBuilder {
 public:
  explicit MjcfReader(ModelFile& file) : ModelBuilder(file, kMjcf) {}

  ImportedModel read() {
    model_.name = root_.word("model");
    refuse_unread_mechanics(root_);
    for (const ModelElement& node : root_.children("default")) {
      if (classes_.empty()) outermost_ = node.given("class").value_or(outermost_);
      add_class(node, node.given("class").value_or(outermost_), "");
    }
    for (const ModelElement& compiler : root_.children("compiler")) read_compiler(compiler);
    for (const ModelElement& option : root_.children("option")) {
      if (option.given("gravity")) model_.gravity = option.numbers("gravity");
      const ModelElement flag = option.child("flag");
      for (auto& [name, acts] : acts_)
        if (flag && flag.given(name)) acts = flag.word(name) == "enable" ? 1 : 0;
    }
    if (acts_["gravity"] == 0) model_.gravity.setZero();
    for (const char* constraint : {"equality", "frictionloss"}) acts_[constraint] *= acts_["constraint"];
    for (const ModelElement& world : root_.children("worldbody")) {
      inherit_from_classes(world, "");
      read_contents(world, {});
    }
    if (total_mass_ > 0) scale_masses();
    for (const ModelElement& equality : root_.children("equality")) {
      for (const ModelElement& e : equality.children("connect")) read_connection(e);
      for (const ModelElement& e : equality.children("weld")) read_connection(e);
      for (const ModelElement& e : equality.children("joint")) read_joint_tie(e);
    }
    return finished();
  }

 private:
  struct Place {  // of an element
    int body = 0;
    Isometry3d frame = Isometry3d::Identity();  // in that of the body
    bool geoms_weigh = false;                   // not those of the world, nor of a body whose <inertial> says its mass
  };

  // Default classes: an element that omits an attribute takes that of its class, or of the classes around it. An
  // element's own class precedes `childclass`, that of the bodies around it. An empty name means the outermost class.
  struct DefaultClass {
    std::string around;
    std::vector<ModelElement> elements;
  };

  void add_class(const ModelElement& node, const std::string& name, const std::string& around) {
    DefaultClass& added = classes_.try_emplace(name, DefaultClass{around, {}}).first->second;
    for (const ModelElement& child : node.children()) added.elements.push_back(child);
    for (const ModelElement& child : node.children("default")) add_class(child, child.word("class"), name);
  }

  void inherit_from_classes(const ModelElement& element, const std::string& childclass) {
    for (const ModelElement& child : element.children()) {
      if (!is_one_of(child.name(), {"body", "frame", "geom", "inertial", "joint", "site"})) continue;
      std::string name = child.given("class").value_or(childclass);
      if (name.empty()) name = outermost_;
      if (name != outermost_ && !classes_.contains(name))
        child.error(fmt::format("there is no default class '{}'", name));
      for (; !name.empty(); name = classes_[name].around) {
        for (const ModelElement& defaults : classes_[name].elements)
          if (defaults.name() == child.name()) child.inherit(defaults, kOrientations);
      }
      inherit_from_classes(child, child.given("childclass").value_or(childclass));
    }
  }

  void read_compiler(const ModelElement& compiler) {
    compiler.word("coordinate");
    if (compiler.given("angle")) angle_unit_ = compiler.word("angle") == "degree" ? std::numbers::pi / 180 : 1;
    if (compiler.given("inertiafromgeom")) inertia_from_geoms_ = compiler.word("inertiafromgeom");
    if (const double mass = compiler.number("settotalmass"); mass > 0) total_mass_ = mass;
    if (!compiler.given("eulerseq")) return;
    euler_sequence_ = compiler.word("eulerseq");
    if (euler_sequence_.size() == 3 && euler_sequence_.find_first_not_of("xyzXYZ") == std::string::npos) return;
    compiler.error(fmt::format("eulerseq: is '{}', must be three of x y z X Y Z", euler_sequence_));
    euler_sequence_ = "xyz";
  }

  struct Placed {
    ModelElement element;
    Place place;  // of what is around the element
  };

  // The elements of these kinds in the world or a body, in the order of the file. A <frame> only moves and turns its
  // contents.
  std::vector<Placed> contents(const ModelElement& element, const Place& place, const Kinds& kinds) const {
    std::vector<Placed> list;
    for (const ModelElement& child : element.children()) {
      if (child.name() == "frame") {
        child.mark_read();
        const std::vector<Placed> inside = contents(child, moved(place, placement(child)), kinds);
        list.insert(list.end(), inside.begin(), inside.end());
      } else if (child.name() == "inertial" && element.name() == "frame") {
        child.error("is in a <frame>; it must be directly in its body");
      } else if (is_one_of(child.name(), kinds)) {
        child.mark_read();
        list.push_back({child, place});
      }
    }
    return list;
  }

  static Place moved(Place place, const Isometry3d& by) {
    place.frame = place.frame * by;
    return place;
  }

  void read_contents(const ModelElement& element, const Place& place) {
    for (const auto& [geom, around] : contents(element, place, {"geom"})) read_geom(geom, around);
    for (const auto& [site, around] : contents(element, place, {"site"})) read_site(site, around);
    for (const auto& [inner, around] : contents(element, place, {"body"}))
      read_body(inner, moved(around, placement(inner)));
  }

  void read_site(const ModelElement& site, const Place& around) {
    const std::optional<std::string> name = site.given("name");
    const Vector3d at = around.frame * Vector3d(site.numbers("pos"));
    if (name && around.body > 0) body(around.body).points.emplace_back(*name, at);
  }

  void read_body(const ModelElement& element, Place place) {
    const std::string name = element.given("name").value_or(fmt::format("body{}", model_.bodies.size()));
    const std::vector<Placed> joints = contents(element, {}, {"joint", "freejoint"});
    if (joints.empty() && place.body > 0) {
      ImportedBody& carrier = body(place.body);
      carrier.points.emplace_back(name, place.frame.translation());
      model_.changed.push_back(fmt::format("body '{}' has no joint and is a part of '{}'", name, carrier.name));
    }
    // Each joint lies between two bodies; those before the last one have no mass.
    for (std::size_t k = 1; k <= joints.size(); ++k) {
      const auto& [joint, around] = joints[k - 1];
      const std::string joint_name = joint.given("name").value_or(fmt::format("{}_joint{}", name, k));
      ImportedJoint link{.body1 = place.body, .between = place.frame};
      link.body2 = add_body(k == joints.size() ? name : name + "_" + joint_name, link.body1, link.between, element);
      place = {link.body2};
      if (k < joints.size())
        model_.changed.push_back(fmt::format("'{}' has {} joints: '{}' without mass stands between two of them", name,
                                             joints.size(), model_.bodies.back().name));
      read_joint(joint, around.frame, joint_name, link, joints.size());
    }
    placed_.emplace(name, place);
    const ModelElement inertial = element.child("inertial");
    place.geoms_weigh = inertia_from_geoms_ == "true" || (!inertial && inertia_from_geoms_ == "auto");
    if (inertial && inertia_from_geoms_ != "true") read_inertial(inertial, place);
    read_contents(element, place);
  }

  // `frame` is that around the joint in its body, which has `count` joints. No class acts on <freejoint>.
  void read_joint(const ModelElement& element, const Isometry3d& frame, const std::string& name, ImportedJoint joint,
                  std::size_t count) {
    const std::string type = element.name() == "freejoint" ? "free" : element.word("type");
    const auto ours = kMjcfTypes.find(type);
    if (ours == kMjcfTypes.end())
      return element.error(fmt::format("the type is '{}'; available: free, ball, slide, hinge", type));
    joint.type = ours->second;
    const bool free = type == "free";
    if (free && count > 1) return element.error("a free joint must be its body's only one");
    if (element.name() == "joint") {
      joint.damping = acts_["passive"] * element.number("damping");
      joint.stiffness = acts_["passive"] * element.number("stiffness");
      joint.coulomb = acts_["frictionloss"] * element.number("frictionloss");
    }
    if (type == "hinge" || type == "slide")  // the spring is at rest at springref; the model is drawn at ref
      joint.free_value = (type == "hinge" ? angle_unit_ : 1) * (element.number("springref") - element.number("ref"));
    if (!free) {
      joint.point = frame * Vector3d(element.numbers("pos"));
      joint.axis = frame.linear() * element.numbers("axis");
    }
    add_joint(name, joint, element, element, type);
  }

  void read_inertial(const ModelElement& inertial, const Place& around) {
    const Isometry3d at = around.frame * placement(inertial);
    Matrix3d tensor = Matrix3d::Zero();
    if (inertial.given("fullinertia")) {  // xx yy zz xy xz yz
      const VectorXd J = inertial.numbers("fullinertia");
      tensor << J(0), J(3), J(4), J(3), J(1), J(5), J(4), J(5), J(2);
    } else {
      tensor.diagonal() = inertial.numbers("diaginertia");
    }
    add_part(body(around.body), inertial.number("mass"), at.translation(),
             at.linear() * tensor * at.linear().transpose(), inertial);
  }

  void read_geom(const ModelElement& element, const Place& around) {
    const std::string type = element.word("type");
    // The ground has no shape. Its bodies without joints count in settotalmass.
    if (around.body == 0 && !(total_mass_ > 0 && around.geoms_weigh)) return element.mark_read(false);
    if (is_one_of(type, {"plane", "hfield", "sdf"})) return element.mark_read(false);
    if (type == "mesh" || element.given("mesh")) {
      if (around.geoms_weigh && !(element.given("mass") && element.number("mass") == 0))
        element.error("its mass is that of a mesh, which is not read: give the body an <inertial>");
      return element.mark_read(false);
    }
    const std::optional<Geom> geom = solid(element, around, type);
    if (!geom) return;
    if (around.geoms_weigh) {
      const double density = element.number("density");
      const double mass = element.given("mass") ? element.number("mass") : density * volume(*geom);
      const Matrix3d R = geom->at.linear();
      add_part(body(around.body), mass, geom->at.translation(),
               mass * R * unit_inertia(*geom).asDiagonal() * R.transpose(), element);
    }
    if (around.body > 0) body(around.body).shapes.push_back(shape_of(*geom));
  }

  std::optional<Geom> solid(const ModelElement& element, const Place& around, const std::string& type) {
    const Eigen::Index count = sizes_of(type);
    if (count == 0) {
      element.error(fmt::format("there is no type '{}' of geoms", type));
      return std::nullopt;
    }
    VectorXd size = element.numbers("size");
    Geom geom{.type = type};
    const bool fromto = element.given("fromto").has_value();
    if (fromto && !element.numbers("pos").isZero(0))
      element.error("pos: must not be given with fromto, not even by a class");
    if (fromto && type != "sphere") {  // the z axis runs from one end to the other
      const VectorXd ends = element.numbers("fromto");
      const Vector3d from = ends.head<3>(), along = Vector3d(ends.tail<3>()) - from;
      geom.at.translation() = from + along / 2;
      geom.at.linear() = with_z_along(along);
      const double radius = size.size() > 0 ? size(0) : 0;
      size = Vector3d(radius, count == 3 ? radius : along.norm() / 2, along.norm() / 2);
    } else {
      geom.at = placement(element);
    }
    geom.at = around.frame * geom.at;
    if (size.size() < count || size.head(count).minCoeff() <= 0) {
      element.error(
          fmt::format("size: a {} needs {} above 0", type, count == 1 ? "a number" : fmt::format("{} numbers", count)));
      return std::nullopt;
    }
    geom.size.head(count) = size.head(count);
    return geom;
  }

  void scale_masses() {
    double sum = 0;
    for (const ImportedBody& b : model_.bodies) sum += b.mass;
    if (sum == 0) return;
    for (ImportedBody& b : model_.bodies) {
      b.mass *= total_mass_ / sum;
      b.inertia *= total_mass_ / sum;
    }
  }

  // Finds a body of the model by an attribute of an equality. If there is none, it reports a finding.
  const Place* placed(const ModelElement& element, const char* attribute) {
    const std::string name = element.word(attribute);
    if (const auto found = placed_.find(name); found != placed_.end()) return &found->second;
    if (element.given(attribute)) element.error(fmt::format("{}: there is no body '{}'", attribute, name));
    return nullptr;
  }

  bool is_active(const ModelElement& element) {
    const bool active = element.word("active") == "true" && acts_["equality"] != 0;
    if (!active)
      model_.changed.push_back(
          fmt::format("line {}: {} is not active, and left out", element.place().line, element.name()));
    return active;
  }

  // Reads connect and weld. MuJoCo's equalities are springs of its solver; here they hold exactly.
  void read_connection(const ModelElement& element) {
    const bool connect = element.name() == "connect";
    const Vector3d anchor = connect ? Vector3d(element.numbers("anchor")) : Vector3d::Zero();  // in the frame of body1
    if (connect && !element.given("anchor")) return;
    const Place *a = placed(element, "body1"), *b = placed(element, "body2");
    if (!a || !b || !is_active(element)) return;
    if (a->body == b->body) return element.error("its bodies are one body: no joint lets them move");
    const Vector3d point = body(a->body).frame * a->frame * anchor;
    if (b->body == 0) std::swap(a, b);  // the ground comes first
    const Isometry3d &frame1 = body(a->body).frame, &frame2 = body(b->body).frame;
    const std::string name = element.given("name").value_or(fmt::format("{}{}", element.name(), element.place().line));
    add_joint(name,
              {.type = connect ? "spherical" : "fixed",
               .body1 = a->body,
               .body2 = b->body,
               .between = frame1.inverse() * frame2,
               .point = frame2.inverse() * point},
              element, element, element.name());
  }

  // q1 = q1_0 + c0 + c1 (q2 - q2_0) + c2 (q2 - q2_0)^2 + ...   Ties here are linear and start where the file draws the
  // joints.
  void read_joint_tie(const ModelElement& element) {
    const VectorXd c = element.numbers("polycoef");
    const std::string driven = element.given("joint1").value_or(""), driver = element.given("joint2").value_or("");
    if (!joint_index_.contains(driven) || !joint_index_.contains(driver))
      return element.error("must tie two joints of hinges or slides: joint1 and joint2");
    if (c.size() < 2 || c(0) != 0 || !c.tail(c.size() - 2).isZero(0))
      return element.error("polycoef: only 0 c 0 0 0 is read");
    if (is_active(element)) add_tie(driven, " follows ", driver, c(1), element);
  }

  Isometry3d placement(const ModelElement& element) const {
    Isometry3d frame = Isometry3d::Identity();
    frame.translation() = element.numbers("pos");
    frame.linear() = orientation(element);
    return frame;
  }

  Matrix3d orientation(const ModelElement& element) const {
    const auto notation =
        std::ranges::find_if(kOrientations, [&](const std::string& n) { return element.given(n).has_value(); });
    if (notation == kOrientations.end()) return Matrix3d::Identity();
    const VectorXd v = element.numbers(*notation);
    if (*notation == "quat") return Quaterniond(v(0), v(1), v(2), v(3)).normalized().toRotationMatrix();
    if (*notation == "axisangle") {
      const Vector3d axis = v.head<3>().normalized();
      if (axis.norm() == 0) element.error("axisangle: the axis is zero");
      return Eigen::AngleAxisd(angle_unit_ * v(3), axis).toRotationMatrix();
    }
    if (*notation == "zaxis") return with_z_along(v);
    Matrix3d R = Matrix3d::Identity();
    if (*notation == "xyaxes") {
      const Vector3d x = v.head<3>().normalized(), z = x.cross(Vector3d(v.tail<3>()));
      if (z.norm() == 0) element.error("xyaxes: the axes are parallel");
      R << x, z.normalized().cross(x), z.normalized();
      return R;
    }
    for (int k = 0; k < 3; ++k) {  // euler; small letters: about the turned axes; capitals: about the fixed ones
      const char c = euler_sequence_[static_cast<std::size_t>(k)];
      const Matrix3d turn = rotation((c | 0x20) - 'x', angle_unit_ * v(k));
      R = c >= 'x' ? Matrix3d(R * turn) : Matrix3d(turn * R);
    }
    return R;
  }

  std::map<std::string, DefaultClass> classes_;
  std::string outermost_ = "main";                      // MuJoCo's name for this class
  std::map<std::string, Place> placed_{{"world", {}}};  // bodies of the model by name
  double angle_unit_ = std::numbers::pi / 180;          // compiler: angle
  std::string euler_sequence_ = "xyz";                  // compiler: eulerseq
  std::string inertia_from_geoms_ = "auto";             // compiler: inertiafromgeom
  double total_mass_ = 0;                               // compiler: settotalmass [kg]; 0: none
  std::map<std::string, double> acts_{                  // option: flag; 1, or 0 where it is switched off
                                      {"gravity", 1},
                                      {"passive", 1},
                                      {"constraint", 1},
                                      {"equality", 1},
                                      {"frictionloss", 1}};
};

}  // namespace

ImportedModel mjcf_model(ModelFile& file) { return MjcfReader(file).read(); }

}  // namespace mbsopt::inline app
