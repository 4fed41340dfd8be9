// A static, self-contained HTML page: headings, sentences, tables and plots; light and dark. No scripts, nothing from
// the network, no time stamp.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mbsopt {

struct LinePlot;

class HtmlPage {
 public:
  explicit HtmlPage(std::string title) : title_(std::move(title)) {}

  void heading(std::string_view text);
  void paragraph(std::string_view text);
  void banner(std::string_view text);  // what a reader must see first
  // The first column holds names; the others are numbers or short words.
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);
  void plot(const LinePlot& plot);
  void drawing(std::string_view svg) { body_ += svg; }
  std::string text() const;

 private:
  std::string title_, body_;
};

}  // namespace mbsopt
