// URDF, the robot description of ROS (https://wiki.ros.org/urdf/XML): links and joints that form a tree.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/import/geom.hpp"
#include "app/import/model_builder.hpp"

namespace mbsopt::inline app {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// Units: m, rad, kg, N, s.
// clang-format off
const std::vector<ModelAttribute> kUrdf{
    {"robot name", kWord, "robot"}, {"robot version", kWord, ""}, {"link name"}, {"joint name"}, {"joint type"},
    {"parent link"}, {"child link"}, {"origin xyz", 3, "0 0 0"}, {"origin rpy", 3, "0 0 0"}, {"axis xyz", kNonzero + 3, "1 0 0"},
    {"dynamics damping", 1, "0"}, {"dynamics friction", 1, "0"},
    {"mimic joint"}, {"mimic multiplier", 1, "1"}, {"mimic offset", 1, "0"}, {"mass value", 1},
    {"inertia ixx", 1}, {"inertia ixy", 1}, {"inertia ixz", 1}, {"inertia iyy", 1}, {"inertia iyz", 1}, {"inertia izz", 1},
    {"box size", 3, "1 1 1"}, {"sphere radius", 1}, {"cylinder radius", 1}, {"cylinder length", 1},
    {"limit", kActs}, {"collision", kActs}, {"contact", kActs}, {"safety_controller", kActs}};
// clang-format on

// Each type of URDF becomes one of the problem format. "" leaves the child free; "fixed" unites both bodies.
const std::map<std::string, std::string> kUrdfTypes{
    {"revolute", "revolute"}, {"continuous", "revolute"}, {"prismatic", "translational"},
    {"planar", "planar"},     {"fixed", "fixed"},         {"floating", ""}};

class UrdfReader : ModelBuilder {
 public:
  explicit UrdfReader(ModelFile& file) : ModelBuilder(file, kUrdf) {}

  ImportedModel read() {
    model_.name = root_.word("name");
    root_.word("version");
    for (const ModelElement& link : root_.children("link")) {
      if (!links_.emplace(link.word("name"), link).second) name_is_taken(link);
    }
    std::set<std::string> names;
    for (const ModelElement& joint : root_.children("joint")) {
      if (!names.insert(joint.word("name")).second) name_is_taken(joint);
      index(joint);
    }
    file_.throw_if_any();
    std::vector<ModelElement> roots;
    for (const ModelElement& link : root_.children("link")) {
      if (!carried_.contains(link.word("name"))) roots.push_back(link);
    }
    if (roots.empty()) root_.error("has no root: each link is the child of a joint, or there is no link");
    for (std::size_t k = 1; k < roots.size(); ++k)
      roots[k].error(fmt::format("is a second root; '{}' is no joint's child, either", roots[0].word("name")));
    file_.throw_if_any();
    // URDF does not define the support of its root. It is fixed here, as in MuJoCo.
    fill(roots[0]);
    model_.changed.push_back(fmt::format("the root link '{}' is fixed to the ground", roots[0].word("name")));
    for (const auto& [name, link] : links_) link.error("is not reached from the root link: joints form a circle");
    for (const ModelElement& joint : root_.children("joint")) {
      if (const ModelElement mimic = joint.child("mimic")) add_mimic(joint.word("name"), mimic);
    }
    return finished();
  }

 private:
  static void name_is_taken(const ModelElement& element) { element.error("the name is taken by an element before it"); }

  void index(const ModelElement& joint) {
    const std::string type = joint.word("type");
    if (!type.empty() && !kUrdfTypes.contains(type))
      joint.error(
          fmt::format("the type is '{}'; available: revolute, continuous, prismatic, planar, fixed, floating", type));
    children_[link_of(joint, "parent")].push_back(joint);
    const std::string child = link_of(joint, "child");
    if (!child.empty() && !carried_.insert(child).second)
      joint.error(fmt::format("the link '{}' is the child of a joint before it", child));
  }

  std::string link_of(const ModelElement& joint, const char* end) {
    const ModelElement element = joint.child(end);
    if (!element) joint.error(fmt::format("has no <{}>", end));
    const std::string link = element ? element.word("link") : "";
    if (!link.empty() && !links_.contains(link)) element.error(fmt::format("there is no link '{}'", link));
    return link;
  }

  // rpy turns about the fixed axes x, y, z, in this order.
  static Isometry3d origin(const ModelElement& element) {
    Isometry3d frame = Isometry3d::Identity();
    if (const ModelElement o = element.child("origin")) {
      const Vector3d rpy = o.numbers("rpy");
      frame.linear() = rotation(2, rpy(2)) * rotation(1, rpy(1)) * rotation(0, rpy(0));
      frame.translation() = o.numbers("xyz");
    }
    return frame;
  }

  struct Place {  // of a link
    ModelElement link;
    int body;
    Isometry3d frame;  // in that of its body
  };

  // Adds each link to its body, from the root on, and takes it from links_. The tree may have any depth, so this is no
  // recursion over links.
  void fill(const ModelElement& root) {
    std::vector<Place> waiting{{root, 0, Isometry3d::Identity()}};
    while (!waiting.empty()) {
      const Place now = waiting.back();
      waiting.pop_back();
      const std::string name = now.link.word("name");
      add_link(now.link, now.body, now.frame);
      links_.erase(name);
      const auto first = static_cast<std::ptrdiff_t>(waiting.size());
      for (const ModelElement& joint : children_[name]) waiting.push_back(carried_by(joint, now));
      std::reverse(waiting.begin() + first, waiting.end());  // the next is the first in the file
    }
  }

  // Adds the joint and its child's body. The child of a fixed joint becomes a part of the parent's body.
  Place carried_by(const ModelElement& element, const Place& parent) {
    const ModelElement child = links_.at(element.child("child").word("link"));
    const Isometry3d between = parent.frame * origin(element);
    const std::string given = element.word("type"), type = kUrdfTypes.at(given);
    if (type == "fixed") {
      if (parent.body > 0)
        model_.changed.push_back(
            fmt::format("link '{}' is a part of '{}'", child.word("name"), body(parent.body).name));
      return {child, parent.body, between};
    }
    ImportedJoint joint{.type = type, .body1 = parent.body, .between = between};
    joint.body2 = add_body(child.word("name"), parent.body, between, child);
    const ModelElement dynamics = element.child("dynamics");
    if (dynamics) {
      joint.damping = dynamics.number("damping");
      joint.coulomb = dynamics.number("friction");
    }
    if (!type.empty()) {
      const ModelElement axis = element.child("axis");
      joint.axis = axis ? Vector3d(axis.numbers("xyz")) : Vector3d::UnitX();
    }
    add_joint(element.word("name"), joint, element, dynamics, given);
    return {child, joint.body2, Isometry3d::Identity()};
  }

  void add_link(const ModelElement& link, int index, const Isometry3d& frame) {
    ImportedBody& carrier = body(index);
    if (index > 0 && carrier.place != link.place()) carrier.points.emplace_back(link.word("name"), frame.translation());
    if (const ModelElement inertial = link.child("inertial")) {
      const ModelElement mass = inertial.child("mass"), inertia = inertial.child("inertia");
      if (mass && inertia)
        add_inertial(link, carrier, mass.number("value"), inertia, frame * origin(inertial));
      else
        inertial.error(mass ? "has no <inertia>" : "has no <mass>");
    }
    for (const ModelElement& visual : link.children("visual")) {
      if (const ModelElement geometry = visual.child("geometry")) add_shape(geometry, carrier, frame * origin(visual));
    }
  }

  void add_inertial(const ModelElement& link, ImportedBody& carrier, double mass, const ModelElement& inertia,
                    const Isometry3d& at) {
    const auto J = [&](const char* entry) { return inertia.number(entry); };
    Matrix3d tensor;
    tensor << J("ixx"), J("ixy"), J("ixz"), J("ixy"), J("iyy"), J("iyz"), J("ixz"), J("iyz"), J("izz");
    add_part(carrier, mass, at.translation(), at.linear() * tensor * at.linear().transpose(), link);
  }

  static void add_shape(const ModelElement& geometry, ImportedBody& carrier, const Isometry3d& at) {
    if (const ModelElement box = geometry.child("box"))
      carrier.shapes.push_back(shape_of({"box", box.numbers("size") / 2, at}));
    else if (const ModelElement sphere = geometry.child("sphere"))
      carrier.shapes.push_back(shape_of({"sphere", {sphere.number("radius"), 0, 0}, at}));
    else if (const ModelElement cylinder = geometry.child("cylinder"))
      carrier.shapes.push_back(
          shape_of({"cylinder", {cylinder.number("radius"), cylinder.number("length") / 2, 0}, at}));
  }

  // <mimic>: value = multiplier value(other) + offset.
  void add_mimic(const std::string& joint, const ModelElement& mimic) {
    const std::string other = mimic.word("joint");
    if (!joint_index_.contains(joint) || !joint_index_.contains(other))
      return mimic.error("ties no two joints that move");
    if (mimic.number("offset") != 0)
      model_.changed.push_back(fmt::format(
          "line {}: mimic has no offset: both joints count from where the file draws them", mimic.place().line));
    add_tie(joint, " mimics ", other, mimic.number("multiplier"), mimic);
  }

  std::map<std::string, ModelElement> links_;                  // not yet in a body
  std::map<std::string, std::vector<ModelElement>> children_;  // joints of a link
  std::set<std::string> carried_;                              // links that a joint carries
};

}  // namespace

ImportedModel urdf_model(ModelFile& file) { return UrdfReader(file).read(); }

}  // namespace mbsopt::inline app
