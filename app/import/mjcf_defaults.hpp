// Default classes of MJCF: an attribute that an element leaves out is that of its class, else of the classes around it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/import/model_reader.hpp"

namespace mbsopt {

class MjcfDefaults {
 public:
  MjcfDefaults(const XmlElement& mujoco, ModelErrors& errors);

  // The element, and the elements of its kind in its class and in the classes around this one, from near to far.
  // An element's own class goes before `childclass`, that of the bodies around it; empty: the outermost class.
  std::vector<const XmlElement*> sources(const XmlElement& element, const std::string& childclass);

  // The attribute of the first source that has it. All are read: a class that a nearer one overrides is not dropped.
  std::optional<std::string> text(const XmlElement& element, const std::string& childclass, std::string_view attribute);

 private:
  void add(const XmlElement& node, const std::string& around, bool outermost);
  ModelErrors& errors_;
  std::map<std::string, std::string> around_;                                           // the class that holds a class
  std::map<std::string, std::map<std::string, std::vector<const XmlElement*>>> found_;  // elements of a class by name
  std::string outermost_ = "main";                                                      // MuJoCo's name for it
};

}  // namespace mbsopt
