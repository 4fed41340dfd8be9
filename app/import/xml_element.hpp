// An XML file as a tree that records which parts were read. An import drops the parts that nothing reads.
//
//   const XmlElement robot = parse_xml(read_text_file("arm.urdf"), "arm.urdf");
//   for (const XmlElement* link : robot.children("link")) link->text("name");
//   robot.unread();          // elements and attributes that no call above named
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/json/input_error.hpp"

namespace mbsopt {

class XmlElement {
 public:
  std::string name;
  int line = 0, column = 0;  // from 1

  std::optional<std::string> text(std::string_view attribute) const;
  const XmlElement* child(std::string_view child_name) const;  // the first one; nullptr: there is none
  std::vector<const XmlElement*> children(std::string_view child_name) const;
  std::vector<const XmlElement*> children() const;  // all of them, in the order of the file; marks none as read
  void mark_read() const { read_ = true; }
  void mark_unread() const { read_ = false; }  // read, and then not used

  struct Unread {
    int line;
    std::string what;  // "joint range", "actuator"
  };
  // Lists each kind once, with the line of its first place. It lists nothing below an unread element.
  std::vector<Unread> unread() const;

 private:
  friend struct XmlReader;
  struct Attribute {
    std::string name, value;
    mutable bool read = false;
  };
  void add_unread(std::vector<Unread>& list) const;
  std::vector<Attribute> attributes_;
  std::vector<XmlElement> children_;
  mutable bool read_ = false;
};

// Throws InputError with line and column if the text is not XML; `file` names it in findings.
XmlElement parse_xml(const std::string& text, const std::string& file);

}  // namespace mbsopt
