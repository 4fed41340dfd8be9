#include "app/files/json_text.hpp"

namespace mbsopt {

Json read_json(std::string_view text) { return Json::parse(text); }
Json read_json_or_discarded(std::string_view text) { return Json::parse(text, nullptr, false); }

std::string json_text(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace mbsopt
