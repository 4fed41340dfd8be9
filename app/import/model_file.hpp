// A model file: XML whose attributes a table describes. It records what is read; an import drops all else.
//
//   ModelFile file(read_text_file("arm.urdf"), "arm.urdf");
//   file.table = {{"link name"}, {"axis xyz", 3, "1 0 0"}, {"limit", kActs}};
//   for (const ModelElement& axis : file.root().children("axis")) axis.numbers("xyz");
//   file.dropped();          // elements and attributes that no call above named
//   file.throw_if_any();     // one InputError with every finding
#pragma once

#include <Eigen/Core>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "app/json/input_error.hpp"
#include "app/json/source_text.hpp"

namespace mbsopt::inline app {

constexpr int kWord = 0;       // a text
constexpr int kList = -1;      // one number or more
constexpr int kActs = -2;      // not read, although it acts on the motion in the program that the model is for
constexpr int kNonzero = 100;  // kNonzero + 3: three numbers that are not all 0

// A row of a format's table: what a reader takes from an attribute, or that an unread part matters. An unread part
// without a row is drawing, or settings of another program.
struct ModelAttribute {
  std::string what;                           // "joint damping"; "* pos": of any element; "limit": an element
  int kind = kWord;                           // or the count of its numbers
  std::optional<std::string> otherwise = {};  // its default; without one the attribute is required
  std::vector<std::string> words = {};        // all that it may say; none: any text
};

struct ModelFile;

// An element of a model file, by reference.
class ModelElement {
 public:
  ModelElement(ModelFile& file, const pugi::xml_node& node) : file_(&file), node_(node) {}
  explicit operator bool() const { return !node_.empty(); }

  std::string name() const { return node_.name(); }
  std::optional<std::string> given(const std::string& attribute) const;

  // By the table. A missing attribute, another word or another count of numbers is a finding, and gives "", the first
  // word or zeros. Numbers are finite; of a list with a finding there are none.
  std::string word(const std::string& attribute) const;
  Eigen::VectorXd numbers(const std::string& attribute) const;
  double number(const std::string& attribute) const { return numbers(attribute)(0); }

  ModelElement child(const char* name) const;                              // the first one, if any
  std::vector<ModelElement> children(const std::string& name = "") const;  // without a name: all; marks none as read
  void mark_read(bool read = true) const;                                  // false: it was read, and is not used

  // Takes the attributes of another element that this one omits, except its name and classes (default classes of MJCF).
  // An element gives one attribute of `alternatives` only: if it has one, it takes none of them.
  void inherit(const ModelElement& from, const std::vector<std::string>& alternatives) const;

  Finding place() const;                         // its line and its name, "joint 'a'"
  void error(const std::string& message) const;  // adds a finding

 private:
  ModelFile* file_;
  pugi::xml_node node_;
};

struct ModelFile {
  // Throws InputError with line and column if the text is not XML; `file` names it in findings.
  ModelFile(const std::string& text, std::string file);
  ModelElement root() { return {*this, document.document_element()}; }
  void throw_if_any() const;

  // Lists each kind of what nothing read once, with the line of its first place: "line 12: joint range (may change the
  // motion)". It lists nothing below an unread element.
  std::vector<std::string> dropped() const;

  std::string name;
  SourceText source;
  pugi::xml_document document;
  std::vector<ModelAttribute> table;
  std::unordered_set<const void*> read;                               // elements and attributes
  std::unordered_map<const void*, std::vector<const void*>> origins;  // of an attribute: those that are read with it
  std::vector<Finding> findings;
};

}  // namespace mbsopt::inline app
