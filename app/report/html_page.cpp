#include "app/report/html_page.hpp"

#include <fmt/format.h>

#include "app/report/html_text.hpp"
#include "app/report/line_plot.hpp"

namespace mbsopt {
namespace {

// Okabe and Ito's colours, which colour-blind readers tell apart; lightened where the page is dark.
constexpr std::string_view kStyle = R"(
:root { --ink:#1b1f24; --paper:#ffffff; --soft:#5d6670; --rule:#dfe3e8;
  --c0:#0072b2; --c1:#d55e00; --c2:#009e73; --c3:#cc79a7; --c4:#b8860b; --c5:#56b4e9; --c6:#7a5195; --c7:#444444; }
@media (prefers-color-scheme: dark) { :root { --ink:#e6e9ec; --paper:#14171a; --soft:#9aa4ae; --rule:#30363c;
  --c0:#5fb0e6; --c1:#ff8c42; --c2:#3fcf9f; --c3:#e6a0c4; --c4:#e6c15a; --c5:#8fd3ff; --c6:#b79ad6; --c7:#c0c0c0; } }
body { color:var(--ink); background:var(--paper); font:15px/1.45 system-ui,sans-serif; max-width:820px; margin:2em auto;
  padding:0 1em; }
h1 { font-size:1.5em } h2 { font-size:1.15em; margin-top:1.8em }
table + table { margin-top:1.2em }
table { border-collapse:collapse; font-variant-numeric:tabular-nums; display:block; overflow-x:auto }
th,td { padding:.25em .8em; border-bottom:1px solid var(--rule); text-align:right; white-space:nowrap }
th:first-child,td:first-child { text-align:left; padding-left:0 } th { color:var(--soft); font-weight:600 }
svg { width:100%; height:auto; margin-top:.8em } svg text { fill:var(--soft); font-size:12px }
svg .title { fill:var(--ink); font-size:14px; font-weight:600 }
.grid { stroke:var(--rule); stroke-width:1 } .frame { fill:none; stroke:var(--soft); stroke-width:1 }
.line { fill:none; stroke-width:1.6; stroke-linejoin:round } .dashed { stroke-dasharray:6 4 }
.points { fill:none; stroke-width:3; stroke-linecap:round }
.legend { display:flex; flex-wrap:wrap; gap:.2em 1.2em; font-size:.85em; color:var(--soft); padding-left:5em }
svg.key { display:inline-block; width:2.1em; height:.7em; margin:0 .4em 0 0; vertical-align:middle }
.banner { border-left:.4em solid var(--c1); padding:.5em 1em; font-weight:600 }
.body { fill-opacity:.12; stroke-width:2.4; stroke-linejoin:round; stroke-linecap:round } .earlier { opacity:.55 }
.earlier .body { stroke-dasharray:6 4; fill-opacity:.05 } .spring { fill:none; stroke:var(--soft); stroke-width:1.2 }
.joint { fill:var(--paper); stroke:var(--ink); stroke-width:1.2 } .ground { fill:var(--soft); stroke:none }
.c0{stroke:var(--c0)} .c1{stroke:var(--c1)} .c2{stroke:var(--c2)} .c3{stroke:var(--c3)} .c4{stroke:var(--c4)}
.c5{stroke:var(--c5)} .c6{stroke:var(--c6)} .c7{stroke:var(--c7)}
.f0{fill:var(--c0)} .f1{fill:var(--c1)} .f2{fill:var(--c2)} .f3{fill:var(--c3)} .f4{fill:var(--c4)}
.f5{fill:var(--c5)} .f6{fill:var(--c6)} .f7{fill:var(--c7)}
)";

}  // namespace

void HtmlPage::heading(std::string_view text) { body_ += fmt::format("<h2>{}</h2>\n", html_escaped(text)); }

void HtmlPage::paragraph(std::string_view text) { body_ += fmt::format("<p>{}</p>\n", html_escaped(text)); }

void HtmlPage::banner(std::string_view text) {
  body_ += fmt::format("<p class=\"banner\" role=\"alert\">{}</p>\n", html_escaped(text));
}

void HtmlPage::table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows) {
  const auto row_of = [](const std::vector<std::string>& cells, const char* tag) {
    std::string row = "<tr>";
    for (const std::string& cell : cells) row += fmt::format("<{0}>{1}</{0}>", tag, html_escaped(cell));
    return row + "</tr>\n";
  };
  body_ += "<table>\n" + row_of(header, "th");
  for (const auto& row : rows) body_ += row_of(row, "td");
  body_ += "</table>\n";
}

void HtmlPage::plot(const LinePlot& plot) { body_ += to_svg(plot); }

std::string HtmlPage::text() const {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<meta name=\"color-scheme\" "
      "content=\"light dark\">\n<title>{0}</title><style>{1}</style></head>\n<body>\n<h1>{0}</h1>\n{2}</body></html>\n",
      html_escaped(title_), kStyle, body_);
}

}  // namespace mbsopt
