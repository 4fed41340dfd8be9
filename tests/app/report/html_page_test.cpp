#include "app/report/html_page.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "app/report/line_plot.hpp"
#include "app/report/row_plot.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

// The block of JSON that the page's script reads.
nlohmann::json data_of(const std::string& page) {
  const std::string before = "<script type=\"application/json\" id=\"data\">";
  const std::size_t begin = page.find(before) + before.size();
  return nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
}

LinePlot line(const std::string& name, const std::vector<double>& y) {
  LinePlot plot{.title = name, .x_label = "t [s]", .y_label = "y [m]"};
  plot.series.push_back({name, {0, 0.5, 1}, y, Mark::line});
  return plot;
}

}  // namespace

TEST_CASE("a figure holds what its drawing does not tell: ranges of the axes, names of the series", "[report]") {
  HtmlPage page("p");
  LinePlot plot = line("a \"b\" <c>", {1, 2, std::numeric_limits<double>::quiet_NaN()});
  plot.logarithmic_x = true;
  page.plot(plot);
  CHECK_THAT(page.text(),
             Contains("<figure data-plot=\"{&quot;x&quot;:[") &&
                 Contains("&quot;log&quot;:{&quot;x&quot;:true,&quot;y&quot;:false}") &&
                 Contains("[{&quot;name&quot;:&quot;a \\&quot;b\\&quot; &lt;c&gt;&quot;,&quot;part&quot;:-1}]"));
}

TEST_CASE("no name of a run can end the block of JSON", "[report]") {
  HtmlPage page("p");
  Json runs = Json::array();
  runs.push_back({{"name", "<!--<SCRIPT>"}});
  page.comparison(runs);
  const std::string text = page.text();
  CHECK(data_of(text).at("runs")[0].at("name") == "<!--<SCRIPT>");
  const std::size_t begin = text.find("id=\"data\">") + 10;
  CHECK(text.find('<', begin) == text.find("</script>", begin));
}

TEST_CASE("a cell shows rounded numbers and holds all their digits", "[report]") {
  HtmlPage page("p");
  page.table({"name", "value"}, {{"a", TableCell("1.23", "1.2345678901234567")}, {"b", "2"}});
  CHECK_THAT(page.text(), Contains("<td title=\"1.2345678901234567\">1.23</td>") && Contains("<td>2</td>"));
}

TEST_CASE("no line ends within a number or an option", "[report]") {
  HtmlPage page("p");
  page.paragraph("at rtol 1e-02 - or");
  page.code("mbsopt simulate a-b.json --out \"a b\"");
  CHECK_THAT(page.text(), Contains("<p>at rtol <span class=\"whole\">1e-02</span> - or</p>") &&
                              Contains("a-b.json <span class=\"whole\">--out</span> &quot;a b&quot;"));
}

TEST_CASE("a column with a sentence is text in all its rows, a column of intervals is not", "[report]") {
  const std::string sentence = "the residuals are correlated in time", interval = "[-1.234567e-05, -1.234567e-05]";
  HtmlPage page("p");
  page.table({"name", "interval", "in words"}, {{"a", interval.c_str(), "white"}, {"b", "-", sentence.c_str()}});
  CHECK_THAT(page.text(), Contains("<th>interval</th><th class=\"words\">in words</th>") &&
                              Contains("<td>" + interval + "</td><td class=\"words\">white</td>") &&
                              Contains("<td>-</td><td class=\"words\">" + sentence + "</td>"));
}

TEST_CASE("headers of many columns may break, so that print does not cut them", "[report]") {
  HtmlPage few("p"), many("p");
  few.table(std::vector<std::string>(8, "name"), std::vector<TableRow>(1, TableRow(8, "1")));
  many.table(std::vector<std::string>(9, "name"), std::vector<TableRow>(1, TableRow(9, "1")));
  CHECK_THAT(few.text(), Contains("<table>") && !Contains("<table class="));
  CHECK_THAT(many.text(), Contains("<table class=\"wide\">"));
}

TEST_CASE("short names stand upright above narrow columns", "[report]") {
  HtmlPage page("p");
  page.table({"", "J", "run1.theta0"}, {{"J", "", ""}}, true);
  CHECK_THAT(page.text(), Contains("<th class=\"upright\">J</th><th>run1.theta0</th>"));
}

TEST_CASE("parts of a page that selectors choose hold their keys and their place for links", "[report]") {
  HtmlPage page("p");
  page.begin_choices({"objective", "parameter"});
  page.begin_choice({"path", "\"k\""}, "ladder-0-0");
  page.end_choice(), page.end_choices();
  CHECK_THAT(page.text(), Contains("data-choices=\"[&quot;objective&quot;,&quot;parameter&quot;]\"") &&
                              Contains(" id=\"ladder-0-0\">"));
}

TEST_CASE("an instant is a line across a plot, with its name", "[report]") {
  LinePlot plot = line("y", {0, 2, 0});
  plot.instants = {{"singular", 0.25}, {"outside", 2}};
  CHECK_THAT(to_svg(plot), Contains("class=\"limit dashed\" d=\"M250000 0v1000000\"") &&
                               Contains("x=\"25%\" dx=\"4\"") && Contains(">singular</text>") && !Contains("outside"));
}

TEST_CASE("headings make the contents of the page", "[report]") {
  HtmlPage page("p");
  page.heading("a < b");
  CHECK_THAT(page.text(), Contains("<a href=\"#part1\">a &lt; b</a>") && Contains("<h2 id=\"part1\">a &lt; b</h2>"));
}

TEST_CASE("what of a line lies beyond a limit is shaded", "[report]") {
  LinePlot plot = line("y", {0, 2, 0});
  plot.limits.push_back({"at most", 1, true});
  CHECK_THAT(to_svg(plot), Contains("class=\"beyond\"") && Contains("class=\"limit\"") && Contains(">at most</text>"));
  plot.limits = {{"at most", 2.5, true}};
  CHECK_THAT(to_svg(plot), !Contains("class=\"beyond\"") && Contains("class=\"limit\""));
  plot.limits = {{"at least", 1, false}};
  CHECK_THAT(to_svg(plot), Contains("class=\"beyond\""));
  plot.limits = {{"far away", 1000, true}};  // would flatten the line
  CHECK_THAT(to_svg(plot), !Contains("class=\"limit\""));
}

TEST_CASE("bars of a row plot begin at zero and end at their values, within its range", "[report]") {
  RowPlot plot{.title = "t", .x_label = "x [-]", .range = std::pair(-1.0, 1.0)};
  CHECK(to_svg(plot).empty());
  plot.rows.push_back({.name = "k", .low = 0, .high = 0.5, .words = "0.5"});
  plot.rows.push_back({.name = "far", .low = 0, .high = 5, .words = "5"});
  CHECK_THAT(to_svg(plot), Contains("x1=\"50%\" x2=\"75%\"") && Contains("x1=\"50%\" x2=\"100%\""));
}
