#include "app/import/urdf_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "app/import/model_reader.hpp"

namespace mbsopt {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// Each type of URDF becomes one of the problem format. "" leaves the child free; "fixed" unites both bodies.
const std::map<std::string, std::string> kUrdfTypes{
    {"revolute", "revolute"}, {"continuous", "revolute"}, {"prismatic", "translational"},
    {"planar", "planar"},     {"fixed", "fixed"},         {"floating", ""}};

class UrdfReader {
 public:
  UrdfReader(const XmlElement& robot, const std::string& file) : robot_(robot), errors_(file) {}

  ImportedModel read() {
    model_.name = robot_.text("name").value_or("robot");
    model_.bodies.push_back({.name = "ground"});
    robot_.text("version");
    for (const XmlElement* link : robot_.children("link")) index(*link, links_);
    for (const XmlElement* joint : robot_.children("joint")) index_joint(*joint);
    errors_.throw_if_any();
    const XmlElement* const root = root_link();
    errors_.throw_if_any();
    // URDF does not define the support of its root. It is fixed here, as in MuJoCo.
    fill(*root);
    model_.changed.push_back(fmt::format("the root link '{}' is fixed to the ground", *root->text("name")));
    for (const auto& [name, link] : links_) {
      if (!placed_.contains(name)) errors_.add(*link, "is not reached from the root link: joints form a circle");
    }
    add_mimics();
    errors_.throw_if_any();
    return std::move(model_);
  }

 private:
  using Elements = std::map<std::string, const XmlElement*>;

  std::string required(const XmlElement& element, const char* attribute) {
    const std::optional<std::string> text = element.text(attribute);
    if (!text || text->empty()) errors_.add(element, fmt::format("has no attribute '{}'", attribute));
    return text.value_or("");
  }

  void index(const XmlElement& element, Elements& elements) {
    if (!elements.emplace(required(element, "name"), &element).second)
      errors_.add(element, "the name is taken by an element before it");
  }

  void index_joint(const XmlElement& joint) {
    index(joint, joints_);
    const std::string type = required(joint, "type");
    if (!type.empty() && !kUrdfTypes.contains(type))
      errors_.add(joint, fmt::format("the type is '{}'; available: revolute, continuous, prismatic, planar, fixed, "
                                     "floating",
                                     type));
    const std::string parent = linked(joint, "parent"), child = linked(joint, "child");
    children_[parent].push_back(&joint);
    if (!child.empty() && !parents_.emplace(child, &joint).second)
      errors_.add(joint, fmt::format("the link '{}' is the child of a joint before it", child));
  }

  std::string linked(const XmlElement& joint, const char* end) {
    const XmlElement* const element = joint.child(end);
    if (!element) {
      errors_.add(joint, fmt::format("has no <{}>", end));
      return "";
    }
    const std::string name = required(*element, "link");
    if (!name.empty() && !links_.contains(name)) errors_.add(*element, fmt::format("there is no link '{}'", name));
    return name;
  }

  const XmlElement* root_link() {
    const XmlElement* root = nullptr;
    for (const XmlElement* link : robot_.children("link")) {
      if (parents_.contains(*link->text("name"))) continue;
      if (root)
        errors_.add(*link, fmt::format("is a second root; '{}' is no joint's child, either", *root->text("name")));
      else
        root = link;
    }
    if (!root) errors_.add(robot_, "has no root: each link is the child of a joint, or there is no link");
    return root;
  }

  Vector3d vector(const XmlElement& element, const char* attribute, const Vector3d& otherwise) {
    const std::optional<std::string> text = element.text(attribute);
    return text ? Vector3d(numbers(element, attribute, *text, 3, errors_)) : otherwise;
  }
  double number(const XmlElement& element, const char* attribute, double otherwise) {
    const std::optional<std::string> text = element.text(attribute);
    return text ? numbers(element, attribute, *text, 1, errors_)(0) : otherwise;
  }
  double required_number(const XmlElement& element, const char* attribute) {
    const std::string text = required(element, attribute);
    return text.empty() ? 0 : numbers(element, attribute, text, 1, errors_)(0);
  }

  // rpy turns about the fixed axes x, y, z, in this order.
  Isometry3d origin(const XmlElement& element) {
    Isometry3d frame = Isometry3d::Identity();
    const XmlElement* const o = element.child("origin");
    if (!o) return frame;
    const Vector3d rpy = vector(*o, "rpy", Vector3d::Zero());
    frame.linear() = rotation(2, rpy(2)) * rotation(1, rpy(1)) * rotation(0, rpy(0));
    frame.translation() = vector(*o, "xyz", Vector3d::Zero());
    return frame;
  }

  // Adds each link to its body, from the root on. The tree may have any depth, so this is no recursion over links.
  void fill(const XmlElement& root) {
    struct Waiting {
      const XmlElement* link;
      int body;
      Isometry3d frame;  // of the link, in that of its body
    };
    std::vector<Waiting> waiting{{&root, 0, Isometry3d::Identity()}};
    while (!waiting.empty()) {
      const Waiting now = waiting.back();
      waiting.pop_back();
      const std::string name = *now.link->text("name");
      placed_.insert(name);
      add_link(*now.link, model_.bodies[static_cast<std::size_t>(now.body)], now.frame);
      std::vector<Waiting> found;
      for (const XmlElement* joint : children_[name]) {
        const XmlElement& child = *links_.at(*joint->child("child")->text("link"));
        const Isometry3d frame = now.frame * origin(*joint);
        const int body = body_of(*joint, child, now.body, frame);
        found.push_back({&child, body, body == now.body ? frame : Isometry3d::Identity()});
      }
      waiting.insert(waiting.end(), found.rbegin(), found.rend());  // in the order of the file
    }
  }

  // between is the frame of the child link in that of the parent's body.
  int body_of(const XmlElement& element, const XmlElement& child, int parent, const Isometry3d& between) {
    const std::string type = kUrdfTypes.at(*element.text("type"));
    if (type == "fixed") {
      if (parent > 0) {
        const ImportedBody& carrier = model_.bodies[static_cast<std::size_t>(parent)];
        model_.changed.push_back(fmt::format("link '{}' is a part of '{}'", *child.text("name"), carrier.name));
      }
      return parent;
    }
    const int body = static_cast<int>(model_.bodies.size());
    const Isometry3d frame = model_.bodies[static_cast<std::size_t>(parent)].frame * between;
    model_.bodies.push_back({.name = body_names_.body(*child.text("name")), .frame = frame, .source = &child});
    const XmlElement* const dynamics = element.child("dynamics");
    if (dynamics && (type.empty() || type == "planar")) leave_out(*dynamics, *element.text("type"));
    if (type.empty()) return body;
    ImportedJoint joint{.name = joint_names_.body(*element.text("name")), .type = type, .body1 = parent, .body2 = body};
    joint.source = &element;
    joint.between = between;
    Vector3d axis = Vector3d::UnitX();
    if (const XmlElement* const a = element.child("axis")) axis = vector(*a, "xyz", axis);
    if (axis.norm() == 0) errors_.add(element, "the axis is zero");
    joint.axis = axis.normalized();
    if (dynamics && type != "planar") {
      joint.damping = number(*dynamics, "damping", 0);
      joint.coulomb = number(*dynamics, "friction", 0);
    }
    joint_index_[*element.text("name")] = static_cast<int>(model_.joints.size());
    model_.joints.push_back(joint);
    return body;
  }

  void leave_out(const XmlElement& dynamics, const std::string& type) {
    for (const char* attribute : {"damping", "friction"}) {
      const double value = number(dynamics, attribute, 0);
      if (value != 0)
        model_.changed.push_back(left_out(dynamics, fmt::format("{} {} of a {} joint", attribute, value, type)));
    }
  }

  void add_link(const XmlElement& link, ImportedBody& body, const Isometry3d& frame) {
    if (body.source && body.source != &link) body.points.emplace_back(*link.text("name"), frame.translation());
    if (const XmlElement* const inertial = link.child("inertial")) add_inertial(link, *inertial, body, frame);
    for (const XmlElement* visual : link.children("visual")) {
      const XmlElement* const geometry = visual->child("geometry");
      if (geometry) add_shape(*geometry, body, frame * origin(*visual));
    }
  }

  void add_inertial(const XmlElement& link, const XmlElement& inertial, ImportedBody& body, const Isometry3d& frame) {
    const Isometry3d at = frame * origin(inertial);
    const XmlElement* const mass = inertial.child("mass");
    const XmlElement* const inertia = inertial.child("inertia");
    if (!mass) return errors_.add(inertial, "has no <mass>");
    if (!inertia) return errors_.add(inertial, "has no <inertia>");
    const auto J = [&](const char* entry) { return required_number(*inertia, entry); };
    Matrix3d tensor;
    tensor << J("ixx"), J("ixy"), J("ixz"), J("ixy"), J("iyy"), J("iyz"), J("ixz"), J("iyz"), J("izz");
    add_part(body, link, required_number(*mass, "value"), at.translation(),
             at.linear() * tensor * at.linear().transpose(), errors_);
  }

  void add_shape(const XmlElement& geometry, ImportedBody& body, const Isometry3d& at) {
    if (const XmlElement* const box = geometry.child("box")) {
      body.shapes.push_back(box_shape(vector(*box, "size", Vector3d::Ones()) / 2, at));
    } else if (const XmlElement* const sphere = geometry.child("sphere")) {
      body.shapes.push_back({"sphere", at.translation(), at.translation(), required_number(*sphere, "radius")});
    } else if (const XmlElement* const cylinder = geometry.child("cylinder")) {
      const Vector3d half(0, 0, required_number(*cylinder, "length") / 2);
      body.shapes.push_back({"cylinder", at * Vector3d(-half), at * half, required_number(*cylinder, "radius")});
    }
  }

  // <mimic>: value = multiplier value(other) + offset.
  void add_mimics() {
    for (const XmlElement* element : robot_.children("joint")) {
      const XmlElement* const mimic = element->child("mimic");
      if (!mimic) continue;
      const auto own = joint_index_.find(*element->text("name"));
      const auto other = joint_index_.find(required(*mimic, "joint"));
      if (other == joint_index_.end() || own == joint_index_.end()) {
        errors_.add(*mimic, "ties no two joints that move");
        continue;
      }
      if (number(*mimic, "offset", 0) != 0)
        model_.changed.push_back(
            fmt::format("line {}: mimic has no offset: both joints count from where the file draws them", mimic->line));
      model_.ties.push_back({.name = joint_names_.body(own->first + " mimics " + other->first),
                             .joint1 = other->second,
                             .joint2 = own->second,
                             .factor = number(*mimic, "multiplier", 1),
                             .source = mimic});
    }
  }

  const XmlElement& robot_;
  ModelErrors errors_;
  ImportedModel model_;
  Names body_names_{{"ground"}, &model_.changed}, joint_names_{{}, &model_.changed};
  Elements links_, joints_;
  std::map<std::string, std::vector<const XmlElement*>> children_;  // joints of a link
  Elements parents_;                                                // the joint that carries a link
  std::map<std::string, int> joint_index_;
  std::set<std::string> placed_;
};

}  // namespace

ImportedModel urdf_model(const XmlElement& robot, const std::string& file) { return UrdfReader(robot, file).read(); }

}  // namespace mbsopt
