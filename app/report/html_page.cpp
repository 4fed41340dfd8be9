#include "app/report/html_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "app/report/html_text.hpp"
#include "app/report/line_plot.hpp"
#include "app/report/report_assets.hpp"

namespace mbsopt::inline app {
namespace {

// A cell of so many characters is a sentence, which wraps. The longest other cell, an interval of two numbers, has 30:
// [-1.234567e-05, -1.234567e-05].
constexpr std::size_t kWords = 32;
constexpr std::size_t kUpright = 2;  // letters of a name that stands upright above a narrow column

constexpr std::size_t kFewColumns = 8;  // they fit a printed page of 18 cm without breaks within words

// Escaped text, in which no line ends within "1e-9" or "--out".
std::string html_words(std::string_view text) {
  std::string words;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text[begin] == ' ' ? begin + 1 : std::min(text.find(' ', begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    const std::size_t exponent = word.find("e-");
    const bool number = exponent != std::string_view::npos && exponent > 0 &&
                        std::isdigit(static_cast<unsigned char>(word[exponent - 1]));
    const std::string escaped = html_escaped(word);
    words +=
        number || (word.starts_with('-') && word.size() > 1) ? "<span class=\"whole\">" + escaped + "</span>" : escaped;
    begin = end;
  }
  return words;
}

// Writes words as the value of an attribute.
std::string list_of(const std::vector<std::string>& words) { return html_escaped(json_text(Json(words))); }

// breaks allows several lines of text.
std::string cell_of(const TableCell& cell, bool words, bool breaks) {
  std::string attributes, shown = cell.brief.empty() ? cell.text : cell.brief;
  if (shown.empty() && !cell.shade) shown = "-";
  if (!cell.full.empty() && cell.full != shown) attributes += fmt::format(" title=\"{}\"", html_escaped(cell.full));
  if (cell.shade) {
    attributes += fmt::format(" class=\"shade\" style=\"--tone:var({});--depth:{:.2f}\"",
                              *cell.shade < 0 ? "--c1" : "--c0", std::min(1.0, std::abs(*cell.shade)));
  } else if (words) {
    attributes += " class=\"words\"";
  }
  std::string text = breaks ? html_words(shown) : html_escaped(shown);
  if (!cell.link.empty()) text = fmt::format("<a href=\"{}\">{}</a>", html_escaped(cell.link), text);
  return fmt::format("<td{}>{}</td>", attributes, text);
}

}  // namespace

void HtmlPage::add(std::string& part, std::string_view opening, std::string_view text, std::string_view closing) {
  part += fmt::format("{}{}{}", opening, html_words(text), closing);
}

void HtmlPage::heading(std::string_view text) {
  headings_.emplace_back(text);
  body_ += fmt::format("<h2 id=\"part{}\">{}</h2>\n", headings_.size(), html_escaped(text));
}

void HtmlPage::table(const std::vector<std::string>& header, const std::vector<TableRow>& rows, bool dense) {
  if (rows.empty()) return;
  std::vector<bool> words(header.size());  // a column with a sentence is aligned as text, in all its rows
  for (const TableRow& row : rows)
    for (std::size_t k = 0; k < std::min(row.size(), words.size()); ++k)
      words[k] = words[k] || row[k].text.size() >= kWords;
  const bool named = std::ranges::any_of(header, [](const std::string& name) { return !name.empty(); });
  const char* const kind = dense                         ? " class=\"dense\""
                           : !named                      ? " class=\"pairs\""
                           : header.size() > kFewColumns ? " class=\"wide\""
                                                         : "";
  body_ += fmt::format("<div class=\"table\" tabindex=\"0\"><table{}>\n", kind);
  if (named) body_ += "<thead><tr>";
  for (std::size_t k = 0; k < header.size() && named; ++k) {
    const bool upright = dense && header[k].size() <= kUpright;
    const char* const style = words[k] ? " class=\"words\"" : upright ? " class=\"upright\"" : "";
    body_ += fmt::format("<th{}>{}</th>", style, html_escaped(header[k]));
  }
  body_ += named ? "</tr></thead>\n<tbody>" : "<tbody>";
  for (const TableRow& row : rows) {
    body_ += "<tr>";
    for (std::size_t k = 0; k < row.size(); ++k) {
      const bool sentence = k < words.size() && words[k];
      body_ += cell_of(row[k], sentence, sentence || k == 0 || !named);
    }
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table></div>\n";
}

void HtmlPage::plot(const LinePlot& plot) {
  body_ += fmt::format("<figure data-plot=\"{}\">{}</figure>\n", html_escaped(plot_data(plot)), to_svg(plot));
}

void HtmlPage::begin_choices(const std::vector<std::string>& names) {
  body_ += fmt::format("<div data-choices=\"{}\">\n", list_of(names));
}

void HtmlPage::begin_choice(const std::vector<std::string>& keys, std::string_view id) {
  body_ += fmt::format("<div data-keys=\"{}\"{}>\n", list_of(keys), id.empty() ? "" : fmt::format(" id=\"{}\"", id));
}

void HtmlPage::motion(Json scene, std::string_view stills) {
  Json& motions = data_["motions"];
  body_ += fmt::format("<div class=\"viewer\" data-motion=\"{}\"></div><div class=\"still\">{}</div>\n", motions.size(),
                       stills);
  motions.push_back(std::move(scene));
}

void HtmlPage::comparison(Json runs) {
  heading("Two runs compared");
  body_ += "<div data-comparison></div><noscript><p>A browser with scripts compares them here.</p></noscript>\n";
  data_["runs"] = std::move(runs);
}

std::string HtmlPage::text() const {
  std::string contents;
  for (std::size_t k = 0; k < headings_.size(); ++k)
    contents += fmt::format("<a href=\"#part{}\">{}</a>", k + 1, html_escaped(headings_[k]));
  std::string data = json_text(data_);  // "<" stands in texts only, where "</script" would end the script
  for (std::size_t at = 0; (at = data.find('<', at)) != std::string::npos;) data.replace(at, 1, "\\u003c");
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<meta name=\"color-scheme\" "
      "content=\"light dark\">\n<title>{0}</title><style>{1}</style></head>\n<body>\n"
      "<nav aria-label=\"Contents\">{2}</nav>\n<main>\n<h1>{0}</h1>\n{3}{6}</main>\n"
      "<script type=\"application/json\" "
      "id=\"data\">{4}</script>\n<script>{5}</script>\n</body></html>\n",
      html_escaped(title_), kReportStyle, contents, top_, data, kReportScript, body_);
}

}  // namespace mbsopt::inline app
