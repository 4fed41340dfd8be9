// A self-contained HTML page: a verdict, warnings, then headings, sentences, tables and plots. It is light or dark, has
// its contents at the side, and is fit for print. It loads nothing from the network and has no time stamp.
//
// The page shows everything without scripts. Its script (script/*.js) adds functions. Plots get the values under the
// pointer, zoom and legends that hide. A mechanism gets its motion, and tables a copy as CSV. The script reads the
// values of a plot from its drawing, and motions from one block of JSON.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/terminal/text_table.hpp"

namespace mbsopt::inline app {

struct LinePlot;

class HtmlPage {
 public:
  explicit HtmlPage(std::string title) : title_(std::move(title)) {}

  void heading(std::string_view text);
  // The top of the page: one sentence with the numbers that matter most, text that a reader must see first, notes.
  void verdict(std::string_view text) { add(top_, "<p class=\"verdict\">", text); }
  void banner(std::string_view text) { add(top_, "<p class=\"banner\" role=\"alert\">", text); }
  void remark(std::string_view text) { add(top_, "<p>", text); }
  void warning(std::string_view text) { add(top_, "<p class=\"warning\">Warning: ", text); }
  void paragraph(std::string_view text) { add(body_, "<p>", text); }
  void note(std::string_view text) { add(body_, "<p class=\"note\">", text); }  // in small print
  void code(std::string_view text) { add(body_, "<code>", text, "</code>\n"); }
  // The first column holds names; the others are numbers or short words. A dense table has narrow columns, for colours.
  // An empty cell without a colour is a dash.
  void table(const std::vector<std::string>& header, const std::vector<TableRow>& rows, bool dense = false);
  void table(const TextTable& shown) { table(shown.header(), shown.rows()); }
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
  static void add(std::string& part, std::string_view opening, std::string_view text,
                  std::string_view closing = "</p>\n");

  std::string title_, top_, body_;
  std::vector<std::string> headings_;
  Json data_ = {{"motions", Json::array()}, {"runs", Json::array()}};  // for the script
};

}  // namespace mbsopt::inline app
