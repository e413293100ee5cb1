#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "lab/bench/device_bench_estimator.h"

namespace touchstone::lab {
namespace {

constexpr double kThousand = 1000.0;
constexpr double kSameCost = 0.1;  // of a frame's seconds: single runs of a machine differ by as much

/// Two digits, large numbers whole.
std::string rounded(double value) {
  constexpr double kLarge = 10.0;
  return std::abs(value) < kLarge ? fmt::format("{:.2g}", value) : fmt::format("{:.0f}", value);
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::string range_of(const std::vector<double>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return fmt::format("{:.3g} to {:.3g}", *least, *most);
}

/// "3.1 um more (2.5 to 3.7)", or that it can't be distinguished.
std::string more_in_words(const EstimatorBench& bench, const EstimatorRow& row) {
  const std::vector<double> more = more_errors(row, bench.reference);
  const auto [least, most] = std::minmax_element(more.begin(), more.end());
  const double mean = mean_of(more);
  if (*least <= 0.0 && *most >= 0.0) return fmt::format("as much, within their spread ({})", range_of(more));
  if (mean > 0.0) return fmt::format("by {:.2g} {} more ({})", mean, bench.unit, range_of(more));
  return fmt::format("by {:.2g} {} less ({})", -mean, bench.unit, range_of(more));
}

/// "40 s less"; empty where two figures differ by no more than single runs do.
std::string other_seconds(double seconds, double than, double times) {
  if (std::abs(seconds - than) < kSameCost * than) return {};
  return fmt::format("{} s {}", rounded(times * std::abs(seconds - than)), seconds > than ? "more" : "less");
}

std::string cost_in_words(const EstimatorRow& row, const EstimatorRow& reference) {
  const std::string each = other_seconds(row.each_s, reference.each_s, kThousand);
  const std::string once = other_seconds(row.once_s, reference.once_s, 1.0);
  return fmt::format("a thousand frames cost {}{}", each.empty() ? "about the same" : each,
                     once.empty() ? "" : fmt::format(", and their set-up {}", once));
}

std::string capital(std::string words) {
  if (!words.empty()) words[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(words[0])));
  return words;
}

std::string sentences(const EstimatorBench& bench) {
  std::string text;
  for (const EstimatorRow& row : bench.rows) {
    if (row.errors.empty()) continue;
    text += fmt::format("- {}: {} err {}; {}.\n", capital(row.name), bench.quantity, more_in_words(bench, row),
                        cost_in_words(row, bench.reference));
  }
  return text;
}

std::string line_of(const EstimatorBench& bench, const EstimatorRow& row, bool bold) {
  const std::string name = bold ? fmt::format("**{}**", row.name) : row.name;
  if (row.errors.empty()) return fmt::format("| {} | {} | | | | | | {} |\n", name, row.frames, row.note);
  const double mean = row.mean();
  const std::string left_out = row.left_out == 0
                                   ? ""
                                   : fmt::format("; {} of {} frames couldn't be used", row.left_out,
                                                 static_cast<std::size_t>(row.frames) * row.errors.size());
  return fmt::format("| {} | {} | {:.3g} | {} | {} | {:.3g} | {:.3g} | {}{} |\n", name, row.frames, mean,
                     range_of(row.errors), rounded(100.0 * mean / bench.typical), row.each_s, row.once_s, row.light,
                     left_out);
}

std::string table_head(const EstimatorBench& bench) {
  return fmt::format(
      "| training frames | number | error, {} | over the sets | error, % | a frame, s | once, s | |\n"
      "|---|---|---|---|---|---|---|---|\n",
      bench.unit);
}

/// A mark at the mean, and a dashed line over the sets.
void add_point(const EstimatorRow& row, double x, std::size_t colour, const std::string& label, plots::LinePlot& plot) {
  const auto [least, most] = row.range();
  plots::PlotCurve mark;
  mark.points = {{x, row.mean()}};
  mark.colour = colour;
  mark.labels = {label};
  plots::PlotCurve range;
  range.points = {{x, least}, {x, most}};
  range.dashed = true;
  range.colour = colour;
  plot.curves.push_back(mark);
  plot.curves.push_back(range);
}

/// An axis over a few times its least value reads best even.
bool is_wide(const plots::LinePlot& plot, double std::pair<double, double>::*coordinate) {
  constexpr double kWide = 5.0;
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const plots::PlotCurve& curve : plot.curves) {
    for (const auto& point : curve.points) {
      least = std::min(least, point.*coordinate);
      most = std::max(most, point.*coordinate);
    }
  }
  return most > kWide * least;
}

void choose_axes(plots::LinePlot& plot) {
  plot.log_x = is_wide(plot, &std::pair<double, double>::first);
  plot.log_y = is_wide(plot, &std::pair<double, double>::second);
}

plots::LinePlot plot_of_rows(const EstimatorBench& bench) {
  plots::LinePlot plot;
  plot.title = fmt::format("{}: error of the estimator against seconds of its training frames", bench.quantity);
  plot.x_label = "a training frame, seconds of a core";
  plot.y_label = fmt::format("error on frames with everything on, {}", bench.unit);
  std::vector<std::string> groups = {bench.reference.group};
  add_point(bench.reference, bench.reference.each_s, 0, bench.reference.name, plot);
  for (const EstimatorRow& row : bench.rows) {
    if (row.errors.empty()) continue;
    auto group = std::find(groups.begin(), groups.end(), row.group);
    if (group == groups.end()) group = groups.insert(group, row.group);
    add_point(row, row.each_s, static_cast<std::size_t>(group - groups.begin()), row.name, plot);
  }
  choose_axes(plot);
  return plot;
}

plots::LinePlot plot_of_counts(const EstimatorBench& bench) {
  plots::LinePlot plot;
  plot.title = fmt::format("{}: error of the estimator against the number of training frames", bench.quantity);
  plot.x_label = "training frames";
  plot.y_label = fmt::format("error on frames with everything on, {}", bench.unit);
  plots::PlotCurve line;
  line.colour = 0;
  for (const EstimatorRow& row : bench.counts) {
    if (row.errors.empty()) continue;
    add_point(row, row.frames, 0, {}, plot);
    line.points.emplace_back(row.frames, row.mean());
  }
  plot.curves.push_back(line);
  choose_axes(plot);
  return plot;
}

}  // namespace

std::string estimator_page(const EstimatorBench& bench, const std::string& device, std::vector<StudyFile>& files) {
  std::string text = "## What the estimator feels\n\n";
  if (!bench.none.empty()) return text + fmt::format("No estimator is measured for this device: {}.\n", bench.none);
  const std::size_t sets = bench.reference.errors.size();
  const std::string rows = device + "-estimator.svg";
  const std::string counts = device + "-estimator-frames.svg";
  text += fmt::format(
      "- Estimator: {}.\n- Test: {}. Root mean square of what is estimated: {:.3g} {}.\n- Each row: {} training sets "
      "of "
      "other presses, the same presses in all rows; the error is root mean square over the test, its mean over the "
      "sets "
      "and the least and the most of them. Bold: training frames as the plan has them.\n- Seconds are of a core: "
      "single "
      "runs, without the truth of pixels. All of this took {:.0f} s.\n\n",
      bench.training, bench.test, bench.typical, bench.unit, sets, bench.seconds);
  text += sentences(bench) + fmt::format("\n![Error against seconds]({})\n\n", rows) + table_head(bench);
  text += line_of(bench, bench.reference, true);
  for (const EstimatorRow& row : bench.rows) text += line_of(bench, row, false);
  text += fmt::format("\n![Error against the number of training frames]({})\n\n", counts) + table_head(bench);
  for (const EstimatorRow& row : bench.counts) text += line_of(bench, row, row.frames == bench.reference.frames);
  files.push_back({rows, plots::to_svg(plot_of_rows(bench))});
  files.push_back({counts, plots::to_svg(plot_of_counts(bench))});
  return text;
}

}  // namespace touchstone::lab
