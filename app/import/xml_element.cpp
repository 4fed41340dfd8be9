#include "app/import/xml_element.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <pugixml.hpp>

#include "app/json/source_text.hpp"

namespace mbsopt {

struct XmlReader {
  const SourceText& source;
  std::string file;

  [[noreturn]] void refuse(std::size_t offset, const std::string& message) const {
    const Position at = source.position(offset);
    throw InputError({Finding{file, at.line, at.column, "", message}});
  }

  XmlElement element(const pugi::xml_node& node, int depth) const {
    constexpr int kDeepest = 1000;  // each level takes some of the stack; no mechanism has so many bodies in a row
    const auto offset = static_cast<std::size_t>(node.offset_debug() - 1);  // of its "<"
    if (depth > kDeepest) refuse(offset, fmt::format("elements are nested more than {} deep", kDeepest));
    const Position at = source.position(offset);
    XmlElement result;
    result.name = node.name();
    result.line = at.line;
    result.column = at.column;
    for (const pugi::xml_attribute& a : node.attributes()) {
      const auto same = [&](const XmlElement::Attribute& other) { return other.name == a.name(); };
      if (std::ranges::any_of(result.attributes_, same))
        refuse(offset, fmt::format("<{}> has the attribute '{}' twice", node.name(), a.name()));
      result.attributes_.push_back({a.name(), a.value()});
    }
    for (const pugi::xml_node& child : node.children()) {
      if (child.type() == pugi::node_element) result.children_.push_back(element(child, depth + 1));
    }
    return result;
  }
};

std::optional<std::string> XmlElement::text(std::string_view attribute) const {
  for (const Attribute& a : attributes_) {
    if (a.name != attribute) continue;
    a.read = true;
    return a.value;
  }
  return std::nullopt;
}

const XmlElement* XmlElement::child(std::string_view child_name) const {
  const auto found = std::ranges::find(children_, child_name, &XmlElement::name);
  if (found == children_.end()) return nullptr;
  found->read_ = true;
  return &*found;
}

std::vector<const XmlElement*> XmlElement::children(std::string_view child_name) const {
  std::vector<const XmlElement*> found;
  for (const XmlElement& c : children_) {
    if (c.name != child_name) continue;
    c.read_ = true;
    found.push_back(&c);
  }
  return found;
}

std::vector<const XmlElement*> XmlElement::children() const {
  std::vector<const XmlElement*> all;
  for (const XmlElement& c : children_) all.push_back(&c);
  return all;
}

void XmlElement::add_unread(std::vector<Unread>& list) const {
  const auto add = [&](int at, const std::string& what) {
    if (std::ranges::find(list, what, &Unread::what) == list.end()) list.push_back({at, what});
  };
  for (const Attribute& a : attributes_) {
    if (!a.read) add(line, name + " " + a.name);
  }
  for (const XmlElement& c : children_) c.read_ ? c.add_unread(list) : add(c.line, c.name);
}

std::vector<XmlElement::Unread> XmlElement::unread() const {
  std::vector<Unread> list;
  add_unread(list);
  return list;
}

XmlElement parse_xml(const std::string& text, const std::string& file) {
  const SourceText source(text);
  const XmlReader reader{source, file};
  if (const std::size_t bad = source.first_invalid_byte(); bad != std::string::npos)
    reader.refuse(bad, "is not UTF-8 here");
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(source.content().data(), source.content().size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed)
    reader.refuse(static_cast<std::size_t>(parsed.offset), fmt::format("is no XML: {}", parsed.description()));
  return reader.element(document.document_element(), 0);
}

}  // namespace mbsopt
