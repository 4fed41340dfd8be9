// A self-contained HTML page: a verdict, warnings, then headings, sentences, tables and plots. It is light or dark, has
// its contents at the side, and is fit for print. It loads nothing from the network and has no time stamp.
//
// The page shows everything without scripts. Its script (script/*.js) adds functions. Plots get the values under the
// pointer, zoom and legends that hide. A mechanism gets its motion, and tables a copy as CSV. The script reads the
// values of a plot from its drawing, and motions from one block of JSON.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/files/json_text.hpp"

namespace mbsopt::inline app {

struct LinePlot;

// A cell shows a rounded number and, under the pointer, all digits.
struct TableCell {
  std::string text, full = {};
  std::optional<double> shade = {};  // from -1 to 1: the colour of a heat map
  std::string link = {};
  TableCell(std::string shown, std::string digits = {}) : text(std::move(shown)), full(std::move(digits)) {}
  TableCell(const char* shown) : text(shown) {}
};
using TableRow = std::vector<TableCell>;

class HtmlPage {
 public:
  explicit HtmlPage(std::string title) : title_(std::move(title)) {}

  void heading(std::string_view text);
  // One sentence with the numbers that matter most.
  void verdict(std::string_view text) { add("<p class=\"verdict\">", text); }
  void warning(std::string_view text) { add("<p class=\"warning\">Warning: ", text); }
  void paragraph(std::string_view text) { add("<p>", text); }
  void note(std::string_view text) { add("<p class=\"note\">", text); }  // in small print
  // Text that a reader must see first.
  void banner(std::string_view text) { add("<p class=\"banner\" role=\"alert\">", text); }
  void code(std::string_view text) { add("<code>", text, "</code>\n"); }
  // The first column holds names; the others are numbers or short words. A dense table has narrow columns, for colours.
  void table(const std::vector<std::string>& header, const std::vector<TableRow>& rows, bool dense = false);
  void plot(const LinePlot& plot);
  // Parts of which the script shows one at a time. `names` are those of the selectors. `keys` give the choice of each,
  // and id serves links to it.
  //   page.begin_choices({"quantity"}), page.begin_choice({"x"}), page.plot(x), page.end_choice(), page.end_choices();
  void begin_choices(const std::vector<std::string>& names);
  void begin_choice(const std::vector<std::string>& keys, std::string_view id = "");
  void end_choice() { body_ += "</div>\n"; }
  void end_choices() { body_ += "</div>\n"; }
  void drawing(std::string_view svg) { body_ += svg; }
  // A moving mechanism, as JSON for script/viewer.js, above the drawings that replace it without a script.
  void motion(Json scene, std::string_view stills);
  // Compares two of several runs; runs is [{"name": "a", "numbers": {"objective path": 1.2}}, ...]
  void comparison(Json runs);
  std::string text() const;

 private:
  void add(std::string_view opening, std::string_view text, std::string_view closing = "</p>\n");

  std::string title_, body_;
  std::vector<std::string> headings_;
  Json data_ = {{"motions", Json::array()}, {"runs", Json::array()}};  // for the script
};

}  // namespace mbsopt::inline app
