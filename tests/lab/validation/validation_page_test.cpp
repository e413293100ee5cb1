#include "lab/validation/validation_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plots/line_plot.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

std::vector<ValidationRow> some_rows() {
  ValidationRow published;
  published.id = "vhs.force";
  published.title = "mean <error> of \"x\" & y | z";
  published.unit = "N";
  published.published = 0.2;
  published.ours = 0.15;
  published.ci95 = {0.14, 0.16};
  published.holds = true;
  published.seconds = 3.25;
  ValidationRow reference;
  reference.id = "mechanics.order";
  reference.title = "order";
  reference.unit = "1";
  reference.reference = 0.0;
  reference.ours = 0.0123;
  reference.quick = true;
  reference.series = ValidationSeries{"mesh edge, mm", "error", {{0.4, 1e-2}, {0.2, 2e-3}}};
  ValidationRow broken;
  broken.id = "vhs.broken";
  broken.title = "nothing to hold it against";
  broken.ours = std::nan("");
  return {published, reference, broken};
}

TEST(ValidationPage, ListsEveryRowInItsGroup) {
  const std::string html = to_html(some_rows(), {"1.2.3", "avx2, BLAS for Haswell", "a day"});
  for (const char* text : {"vhs.force", "mechanics.order", "vhs.broken", "<h2>vhs</h2>", "<h2>mechanics</h2>", "1.2.3",
                           "avx2, BLAS for Haswell", "Date: a day", "0.15 N", "0.14 to 0.16", "0.2 N (published)",
                           "-25 %", "+0.0123", "(quick form)", "3.2", "1 of 3 rows hold."}) {
    EXPECT_THAT(html, HasSubstr(text));
  }
  EXPECT_EQ(count(html, "<td class=\"id\">"), 3);
  EXPECT_EQ(count(html, "<td class=\"no\">NO</td>"), 2);
  EXPECT_LT(html.find("vhs.force"), html.find("mechanics.order"));
  EXPECT_LT(html.find("vhs.broken"), html.find("mechanics.order")) << "a group stays together";
}

TEST(ValidationPage, EscapesTextAndNeedsNothingElse) {
  const std::string html = to_html(some_rows(), {"1", "<script>alert(1)</script>", ""});
  EXPECT_THAT(html, HasSubstr("mean &lt;error&gt; of &quot;x&quot; &amp; y | z"));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("Date:")));
  EXPECT_THAT(html, Not(HasSubstr("href=")));
  EXPECT_THAT(html, Not(HasSubstr("src=")));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
}

TEST(ValidationPage, DrawsTheSeriesOfTheRowsThatHaveOne) {
  const std::string html = to_html(some_rows(), {"1", "p", ""});
  EXPECT_EQ(count(html, "<svg"), 1);
  EXPECT_EQ(count(html, "<circle"), 2);
  EXPECT_THAT(html, HasSubstr("mesh edge, mm"));
}

TEST(ValidationPage, MarkdownHasTheSameRowsAsCellsOfEqualNumber) {
  const std::string markdown = to_markdown(some_rows(), {"1.2.3", "p", "today"});
  EXPECT_THAT(markdown, HasSubstr("vhs.force"));
  EXPECT_THAT(markdown, HasSubstr("- Date: today\n"));
  EXPECT_THAT(markdown, HasSubstr("y \\| z"));
  EXPECT_THAT(markdown, HasSubstr("(0.4, 0.01) (0.2, 0.002)"));
  EXPECT_EQ(count(markdown, "\n| vhs."), 2);
  EXPECT_EQ(count(markdown, "\n| mechanics."), 1);
}

TEST(ValidationPage, TheSameRowsMakeTheSameBytes) {
  const PageHeader header{"1", "p", "today"};
  EXPECT_EQ(to_html(some_rows(), header), to_html(some_rows(), header));
  EXPECT_EQ(to_markdown(some_rows(), header), to_markdown(some_rows(), header));
}

TEST(ValidationPage, NoRowsAreAPageToo) {
  EXPECT_THAT(to_html({}, {"1", "p", ""}), HasSubstr("0 of 0 rows hold."));
}

TEST(LinePlot, PowerLawIsAStraightLine) {
  plots::LinePlot plot;
  plot.curves = {{"law", {{1.0, 1.0}, {10.0, 100.0}, {100.0, 10000.0}}, false}};
  const std::string svg = plots::to_svg(plot);
  const std::size_t at = svg.find("points=\"") + 8;
  double x[3], y[3];
  ASSERT_EQ(std::sscanf(svg.c_str() + at, "%lf,%lf %lf,%lf %lf,%lf", &x[0], &y[0], &x[1], &y[1], &x[2], &y[2]), 6);
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.11);
  EXPECT_NEAR(y[1] - y[0], y[2] - y[1], 0.11);
  EXPECT_LT(y[2], y[0]) << "larger is higher";
}

TEST(LinePlot, LeavesOutWhatHasNoPlace) {
  const double nan = std::nan("");
  plots::LinePlot plot;
  plot.curves = {{"a", {{0.0, 1.0}, {-1.0, 1.0}, {1.0, nan}, {std::numeric_limits<double>::infinity(), 1.0}}, false},
                 {"b", {{1.0, 2.0}, {2.0, 0.0}}, false}};
  const std::string svg = plots::to_svg(plot);
  EXPECT_EQ(count(svg, "<circle"), 1);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(LinePlot, EmptyPlotAndConstantCurveHaveFiniteAxes) {
  for (const bool logarithmic : {false, true}) {
    plots::LinePlot plot;
    plot.log_x = plot.log_y = logarithmic;
    EXPECT_THAT(plots::to_svg(plot), Not(HasSubstr("nan")));
    plot.curves = {{"a", {{3.0, 5.0}, {3.0, 5.0}}, false}};
    EXPECT_THAT(plots::to_svg(plot), Not(HasSubstr("nan")));
    EXPECT_EQ(count(plots::to_svg(plot), "<circle"), 2);
  }
}

TEST(LinePlot, LabelsAreEscaped) {
  plots::LinePlot plot;
  plot.title = "a<b";
  plot.x_label = "x & y\x01";
  const std::string svg = plots::to_svg(plot);
  EXPECT_THAT(svg, HasSubstr("a&lt;b"));
  EXPECT_THAT(svg, HasSubstr("x &amp; y?"));
}

}  // namespace
}  // namespace touchstone::lab
