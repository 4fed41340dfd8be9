// Default classes of MJCF: an element that omits an attribute takes that of its class, or of the classes around it.
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

  // The element, and the elements of its kind in its class and in the classes around this one, from near to far. An
  // element's own class precedes `childclass`, that of the bodies around it. An empty name means the outermost class.
  std::vector<const XmlElement*> sources(const XmlElement& element, const std::string& childclass);

  // Returns the attribute of the first source that has it. It reads all sources, so an overridden class is not
  // reported.
  std::optional<std::string> text(const XmlElement& element, const std::string& childclass, std::string_view attribute);

 private:
  void add(const XmlElement& node, const std::string& around, bool outermost);
  ModelErrors& errors_;
  std::map<std::string, std::string> around_;                                           // the class that holds a class
  std::map<std::string, std::map<std::string, std::vector<const XmlElement*>>> found_;  // elements of a class by name
  std::string outermost_ = "main";                                                      // MuJoCo's name for it
};

}  // namespace mbsopt
