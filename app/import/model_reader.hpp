// The readers of URDF and MJCF share this: numbers in attributes, names, and findings with their place in the file.
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

// Reads finite numbers separated by blanks. Anything else is a finding and gives an empty result.
std::vector<double> numbers(const XmlElement& element, std::string_view attribute, const std::string& text,
                            ModelErrors& errors);
// Reads exactly `count` numbers; otherwise it reports a finding and returns zeros.
Eigen::VectorXd numbers(const XmlElement& element, std::string_view attribute, const std::string& text,
                        Eigen::Index count, ModelErrors& errors);

// Calls add_mass (imported_model.hpp) for the element. An impossible mass or inertia is a finding.
void add_part(ImportedBody& body, const XmlElement& element, double mass, const Eigen::Vector3d& com,
              const Eigen::Matrix3d& inertia, ModelErrors& errors);

// A rotation about a coordinate axis, 0 to 2.
Eigen::Matrix3d rotation(int axis, double angle);

// Makes unique names for a problem file. Refused characters become "_", and a number follows a taken name. renamed
// receives a sentence for each changed name.
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
