#include "datasets/inspection/estimate_page.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>

#include "core/error.h"
#include "core/natural_order.h"
#include "datasets/inspection/contact_sheet.h"
#include "datasets/inspection/estimate_quantities.h"
#include "datasets/inspection/page_parts.h"
#include "plots/line_plot.h"
#include "plots/state_plot.h"
#include "sim/files/image_file.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBuckets = 300;  // of a curve: each has its least and its largest value
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A table with what is known of its columns and lines.
struct ReadTable {
  const EstimateTable& table;
  EstimateParts parts;
  std::vector<EstimateSequence> sequences;
  const EstimateColumn* trusted;  ///< null: it doesn't say
  bool many_lines = false;        ///< of one frame

  explicit ReadTable(const EstimateTable& from)
      : table(from), parts(parts_of(from)), sequences(sequences_of(from)), trusted(from.column("trusted")) {
    for (const EstimateSequence& sequence : sequences) {
      for (const EstimateFrame& frame : sequence.frames) many_lines |= frame.count > 1;
    }
  }
  std::size_t frames() const {
    std::size_t all = 0;
    for (const EstimateSequence& sequence : sequences) all += sequence.frames.size();
    return all;
  }
};

std::string axis_label(const EstimateSequence& sequence) {
  return sequence.axis == "second" ? "time, s" : "frame";
}

/// Indices of points that show the curve as all of them would: of each bucket the least and the largest value.
std::vector<std::size_t> shown_points(const std::vector<std::pair<double, double>>& points) {
  std::vector<std::size_t> shown;
  const std::size_t buckets = std::min(points.size(), kMostBuckets);
  for (std::size_t bucket = 0; bucket < buckets; ++bucket) {
    const std::size_t first = bucket * points.size() / buckets, last = (bucket + 1) * points.size() / buckets;
    std::size_t least = first, most = first;
    for (std::size_t i = first; i < last; ++i) {
      if (points[i].second < points[least].second) least = i;
      if (points[i].second > points[most].second) most = i;
    }
    shown.push_back(std::min(least, most));
    if (least != most) shown.push_back(std::max(least, most));
  }
  return shown;
}

plots::PlotCurve curve_of(const std::string& name, std::vector<std::pair<double, double>> points,
                          const std::vector<double>& spread, std::size_t colour, bool dashed) {
  plots::PlotCurve curve{
      .name = name, .points = {}, .dashed = dashed, .marked = points.size() <= 40, .spread = {}, .colour = colour};
  for (const std::size_t i : shown_points(points)) {
    curve.points.push_back(points[i]);
    if (!spread.empty()) curve.spread.push_back(spread[i]);
  }
  return curve;
}

/// One quantity's curves over a sequence, of a line a frame.
void add_curves(const EstimatedQuantity& quantity, const EstimateSequence& sequence, plots::LinePlot& plot) {
  std::size_t colour = 0;
  for (const EstimatedComponent& component : quantity.components) {
    std::vector<std::pair<double, double>> values, truths;
    std::vector<double> spread;
    for (const EstimateFrame& frame : sequence.frames) {
      const double value = component.value->numbers[frame.first];
      const double truth = component.truth == nullptr ? kNaN : component.truth->numbers[frame.first];
      const double sigma = component.sigma == nullptr ? kNaN : component.sigma->numbers[frame.first];
      if (!std::isnan(truth)) truths.emplace_back(frame.at, truth);
      if (std::isnan(value)) continue;
      values.emplace_back(frame.at, value);
      spread.push_back(std::isnan(sigma) ? 0.0 : sigma);
    }
    if (component.sigma == nullptr) spread.clear();
    const std::string name = quantity.components.size() > 1 ? component.name : "";
    if (!values.empty()) plot.curves.push_back(curve_of(name, std::move(values), spread, colour, false));
    if (!truths.empty()) {
      plot.curves.push_back(curve_of("", std::move(truths), {}, colour, true));
    }
    ++colour;
  }
}

/// The same of many lines a frame: the mean and the largest size of what the components make up.
void add_size_curves(const EstimatedQuantity& quantity, const EstimateSequence& sequence, plots::LinePlot& plot) {
  std::vector<std::pair<double, double>> means, largest;
  for (const EstimateFrame& frame : sequence.frames) {
    double sum = 0.0, most = 0.0;
    std::size_t known = 0;
    for (std::size_t line = frame.first; line < frame.first + frame.count; ++line) {
      double squares = 0.0;
      for (const EstimatedComponent& component : quantity.components) {
        squares += std::pow(component.value->numbers[line], 2);
      }
      if (std::isnan(squares)) continue;
      sum += std::sqrt(squares);
      most = std::max(most, std::sqrt(squares));
      ++known;
    }
    if (known == 0) continue;
    means.emplace_back(frame.at, sum / static_cast<double>(known));
    largest.emplace_back(frame.at, most);
  }
  if (means.empty()) return;
  plot.curves.push_back(curve_of("mean", std::move(means), {}, 0, false));
  plot.curves.push_back(curve_of("largest", std::move(largest), {}, 1, false));
}

std::string figure(const std::string& svg) {
  return "<figure>" + svg + "</figure>\n";
}

std::string curves(const ReadTable& one, const EstimateSequence& sequence) {
  std::string html;
  for (const EstimatedQuantity& quantity : one.parts.quantities) {
    std::string title = quantity.name;
    if (one.many_lines && quantity.components.size() > 1) title = "size of " + title;
    plots::LinePlot plot{title, axis_label(sequence), quantity.unit, false, false, {}};
    one.many_lines ? add_size_curves(quantity, sequence, plot) : add_curves(quantity, sequence, plot);
    if (!plot.curves.empty()) html += figure(plots::to_svg(plot));
  }
  return html;
}

/// Contact, slip, trust and what else is said in words or by 0 and 1.
std::string states(const ReadTable& one, const EstimateSequence& sequence) {
  if (one.many_lines || sequence.frames.size() < 2) return "";
  plots::StatePlot plot{.title = "what was seen", .x_label = axis_label(sequence)};
  plot.begin = sequence.frames.front().at;
  // The last frame lasts as long as the others.
  const double frames = static_cast<double>(sequence.frames.size());
  plot.end = sequence.frames.back().at + (sequence.frames.back().at - plot.begin) / (frames - 1.0);
  const auto add_row = [&](const EstimateColumn& column, const auto& state) {
    plots::StateRow row{.name = column.name};
    bool any = false;
    for (const EstimateFrame& frame : sequence.frames) {
      row.states.emplace_back(frame.at, state(frame.first));
      any |= !row.states.back().second.empty();
    }
    if (any) plot.rows.push_back(std::move(row));
  };
  for (const EstimateColumn* const flag : one.parts.flags) {
    add_row(*flag, [&](std::size_t line) { return flag->numbers[line] == 1.0 ? std::string("yes") : std::string(); });
  }
  for (const EstimateColumn* const words : one.parts.states) {
    add_row(*words, [&](std::size_t line) { return words->word(line); });
  }
  return plot.rows.empty() ? "" : figure(plots::to_svg(plot));
}

bool is_trusted(const ReadTable& one, std::size_t line) {
  return one.trusted == nullptr || one.trusted->numbers[line] != 0.0;
}

/// How far a component is off, over the frames that are trusted.
std::string error_row(const ReadTable& one, const EstimatedQuantity& quantity, const EstimatedComponent& component,
                      bool with_bars) {
  std::size_t count = 0, within = 0, with_sigma = 0;
  double squares = 0.0, sum = 0.0, largest = 0.0;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t line = 0; line < one.table.lines; ++line) {
    const double off = component.value->numbers[line] - component.truth->numbers[line];
    if (std::isnan(off) || !is_trusted(one, line)) continue;
    ++count;
    squares += off * off;
    sum += off;
    largest = std::max(largest, std::abs(off));
    low = std::min(low, component.truth->numbers[line]);
    high = std::max(high, component.truth->numbers[line]);
    if (component.sigma == nullptr || !(component.sigma->numbers[line] > 0.0)) continue;
    ++with_sigma;
    within += std::abs(off) <= 2.0 * component.sigma->numbers[line] ? 1 : 0;
  }
  if (count == 0) return "";
  const auto frames = static_cast<double>(count);
  const double rms = std::sqrt(squares / frames), most = std::max(std::abs(low), std::abs(high));
  const auto rounded = [&](double value) { return std::abs(value) < 1e-4 * most ? 0.0 : value; };
  std::string row = "<tr>" +
                    cell(quantity.components.size() > 1 ? quantity.name + " " + component.name : quantity.name) +
                    cell(quantity.unit) + number_cell(frames) + number_cell(rms) +
                    cell(most > 0.0 ? fmt::format("{:.2g} %", 100.0 * rms / most) : "") + number_cell(sum / frames) +
                    number_cell(largest) + cell(fmt::format("{:.3g} to {:.3g}", rounded(low), rounded(high)));
  if (with_bars) {
    const double share = with_sigma > 0 ? static_cast<double>(within) / static_cast<double>(with_sigma) : 0.0;
    row += cell(with_sigma > 0 ? fmt::format("{:.0f} %", 100.0 * share) : "");
  }
  return row + "</tr>\n";
}

std::string errors(const ReadTable& one) {
  bool with_bars = false;
  for (const EstimatedQuantity& quantity : one.parts.quantities) {
    for (const EstimatedComponent& component : quantity.components) {
      with_bars |= component.truth != nullptr && component.sigma != nullptr;
    }
  }
  std::string rows;
  for (const EstimatedQuantity& quantity : one.parts.quantities) {
    for (const EstimatedComponent& component : quantity.components) {
      if (component.truth != nullptr) rows += error_row(one, quantity, component, with_bars);
    }
  }
  if (rows.empty()) return "";
  const bool all = one.trusted == nullptr;
  std::vector<std::string> head = {"",     "unit",    "frames",     "root mean square", "of the largest true value",
                                   "mean", "largest", "true values"};
  if (with_bars) head.push_back("within two error bars");
  return fmt::format(
             "<h3>How far off</h3>\n<p class=\"note\">Estimates less the true values that the recording has{}. "
             "A mean away from 0 is a bias.{}</p>\n",
             all ? "" : ", in frames that are trusted", with_bars ? " Of good error bars 95 % lie within two." : "") +
         table(head, rows);
}

/// Texts of a line's remarks.
std::string remarks_of(const ReadTable& one, std::size_t line) {
  std::string all;
  for (const auto* columns : {&one.parts.remarks, &one.parts.states}) {
    for (const EstimateColumn* const column : *columns) {
      const std::string word = column->word(line);
      if (!word.empty()) all += (all.empty() ? "" : "; ") + column->name + ": " + word;
    }
  }
  return all;
}

std::string name_of_frame(const ReadTable& one, const EstimateSequence& sequence, std::size_t line) {
  std::string name = sequence.name;
  for (const char* const key : {"file", "frame"}) {
    const EstimateColumn* const column = one.table.column(key);
    if (column == nullptr) continue;
    const std::string text = column->text(line);
    if (text.empty()) continue;
    return name.empty() ? text : name + ": " + text;
  }
  return name;
}

/// Frames that aren't to be trusted, or that have a remark.
std::string doubtful(const ReadTable& one, int most) {
  if (one.trusted == nullptr && one.parts.remarks.empty()) return "";
  std::string rows;
  int count = 0;
  for (const EstimateSequence& sequence : one.sequences) {
    for (const EstimateFrame& frame : sequence.frames) {
      bool trusted = false;
      bool remark = false;
      for (std::size_t line = frame.first; line < frame.first + frame.count; ++line) {
        trusted |= is_trusted(one, line);
        for (const EstimateColumn* const column : one.parts.remarks) remark |= column->words[line] >= 0;
      }
      if (trusted && !remark) continue;
      if (++count > most) continue;
      rows += "<tr>" + cell(name_of_frame(one, sequence, frame.first)) + cell(remarks_of(one, frame.first)) + "</tr>\n";
    }
  }
  if (count == 0) return "<p class=\"note\">All frames are trusted.</p>\n";
  return fmt::format("<h3>Frames not to be trusted</h3>\n<p class=\"note\">{} of {}{}.</p>\n", count, one.frames(),
                     count > most ? fmt::format("; the first {}", most) : std::string()) +
         table({"frame", "what is said of it"}, rows);
}

std::string section(const ReadTable& one, const EstimatePageOptions& options) {
  const std::size_t all = one.sequences.size();
  std::string html = fmt::format("<h2>{}</h2>\n<p class=\"note\">{} frames in {} sequence{}{}.</p>\n",
                                 plots::escape_markup(one.table.file.filename().string()), one.frames(), all,
                                 all == 1 ? "" : "s", one.many_lines ? "; several lines a frame" : "");
  html += errors(one);
  const std::vector<std::size_t> shown = spread_over(0, all, static_cast<std::size_t>(options.most_sequences));
  if (shown.size() < all) html += fmt::format("<p class=\"note\">Curves of {} sequences.</p>\n", shown.size());
  for (const std::size_t i : shown) {
    const EstimateSequence& sequence = one.sequences[i];
    if (!sequence.name.empty()) html += "<h3>" + plots::escape_markup(sequence.name) + "</h3>\n";
    html += "<div class=\"plots\">\n" + states(one, sequence) + curves(one, sequence) + "</div>\n";
  }
  return html + doubtful(one, options.most_frames);
}

std::string sheet(const std::vector<fs::path>& pictures, const EstimatePageOptions& options) {
  std::vector<cv::Mat> images;
  std::vector<std::string> captions;
  for (const std::size_t i : spread_over(0, pictures.size(), static_cast<std::size_t>(options.most_tiles))) {
    images.push_back(sim::read_image(pictures[i]));
    captions.push_back(pictures[i].stem().string());
  }
  return picture_element(
      contact_sheet(images, captions, options.columns, options.tile_width),
      fmt::format("{} of {} frames with what was estimated of them", images.size(), pictures.size()));
}

}  // namespace

std::vector<EstimateTable> estimate_tables(const fs::path& place) {
  std::vector<fs::path> files;
  if (fs::is_directory(place)) {
    for (const fs::directory_entry& entry : fs::directory_iterator(place)) {
      const std::string name = entry.path().filename().string();
      if (entry.is_regular_file() && entry.path().extension() == ".csv" && !name.starts_with('.')) {
        files.push_back(entry.path());
      }
    }
    std::ranges::sort(files);
    if (files.empty()) {
      fail("{}: isn't a data set (dataset.json), nor a folder with tables of estimates (*.csv)", place.string());
    }
  } else {
    files.push_back(place);
  }
  std::vector<EstimateTable> tables;
  for (const fs::path& file : files) tables.push_back(read_estimate_table(file));
  return tables;
}

std::vector<fs::path> pictures_below(const fs::path& folder) {
  std::vector<fs::path> pictures;
  if (!fs::is_directory(folder)) return pictures;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path ending = entry.path().extension();
    const bool hidden = entry.path().filename().string().starts_with('.');
    if (entry.is_regular_file() && !hidden && (ending == ".png" || ending == ".jpg")) pictures.push_back(entry.path());
  }
  std::ranges::sort(pictures,
                    [](const fs::path& a, const fs::path& b) { return natural_less(a.string(), b.string()); });
  return pictures;
}

std::string estimate_page(const std::string& title, const std::vector<EstimateTable>& tables,
                          const std::vector<fs::path>& pictures, const EstimatePageOptions& options) {
  std::string html = page_begin("Estimates in " + title);
  html +=
      "<p class=\"note\">Curves are estimates, bands their standard errors, dashed lines true values. Of long "
      "recordings each point shows the least or the largest of some frames.</p>\n";
  if (!pictures.empty()) html += "<h2>Frames</h2>\n" + sheet(pictures, options);
  for (const EstimateTable& table : tables) html += section(ReadTable(table), options);
  return html + page_end();
}

}  // namespace touchstone::datasets
