// The readers of URDF and MJCF share numbers in attributes, names, and findings with their place in the file.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "app/import/imported_model.hpp"

namespace mbsopt {

// "joint 'a'", "joint".
std::string described(const XmlElement& element);

// A sentence for ImportedModel::changed: the problem file lacks `what` of the element, which acts on the motion.
std::string left_out(const XmlElement& element, const std::string& what);

class ModelErrors {
 public:
  explicit ModelErrors(std::string file) : file_(std::move(file)) {}
  void add(const XmlElement& element, const std::string& message);
  void throw_if_any() const;  // InputError with every finding

 private:
  std::string file_;
  std::vector<Finding> findings_;
};

// Numbers with blanks between them, all finite. What is none is a finding, and the result is empty.
std::vector<double> numbers(const XmlElement& element, std::string_view attribute, const std::string& text,
                            ModelErrors& errors);
// As many as `count`, else a finding and zeros.
Eigen::VectorXd numbers(const XmlElement& element, std::string_view attribute, const std::string& text,
                        Eigen::Index count, ModelErrors& errors);

// add_mass (imported_model.hpp) of what the element describes. A mass or inertia that no body has is a finding.
void add_part(ImportedBody& body, const XmlElement& element, double mass, const Eigen::Vector3d& com,
              const Eigen::Matrix3d& inertia, ModelErrors& errors);

// A rotation about a coordinate axis, 0 to 2.
Eigen::Matrix3d rotation(int axis, double angle);

// Names that a problem file takes, each once: characters that it refuses become "_", a number follows where one is
// taken. renamed: takes a sentence for each name that is not as wanted.
class Names {
 public:
  explicit Names(std::vector<std::string> taken, std::vector<std::string>* renamed = nullptr)
      : taken_(std::move(taken)), renamed_(renamed) {}
  std::string body(const std::string& wanted);        // of bodies and joints
  std::string identifier(const std::string& wanted);  // of sensors and points

 private:
  std::string unique(std::string name, const std::string& wanted);
  std::vector<std::string> taken_;
  std::vector<std::string>* renamed_;
};

}  // namespace mbsopt
