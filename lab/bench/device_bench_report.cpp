#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <iterator>
#include <optional>
#include <thread>

#include "core/edited_yaml.h"
#include "core/error.h"
#include "datasets/sets/processor.h"
#include "lab/bench/device_bench.h"
#include "plots/line_plot.h"
#include "sim/scene/light_limits.h"

namespace touchstone::lab {
namespace {

constexpr double kMillisecond = 1e-3;

std::string number(double value, double unit = 1.0) {
  return std::isfinite(value) ? fmt::format("{:.3g}", value / unit) : std::string();
}

bool any(const BenchCurve& curve, double BenchPoint::*of) {
  return std::any_of(curve.points.begin(), curve.points.end(), [&](const auto& p) { return std::isfinite(p.*of); });
}

/// A column of a curve's table, left out where no point has it.
struct Column {
  std::string head;
  double BenchPoint::*of;
  double unit;
};

std::vector<Column> columns_of(const BenchCurve& curve) {
  const double each = curve.each.find(" ms") != std::string::npos ? kMillisecond : 1.0;
  return {{curve.once, &BenchPoint::once_s, 1.0},
          {curve.each, &BenchPoint::each_s, each},
          {curve.work, &BenchPoint::work, 1.0},
          {"force error, %", &BenchPoint::force_error, 0.01},
          {"beads off, um", &BenchPoint::beads_um, 1.0},
          {"pixel error", &BenchPoint::pixel_error, 1.0},
          {"all pixels but 1 %", &BenchPoint::pixel_worst, 1.0},
          {"wrong events, %", &BenchPoint::event_error, 0.01}};
}

std::string table_of(const BenchCurve& curve, double least_pixel_error) {
  std::vector<Column> columns;
  for (const Column& column : columns_of(curve)) {
    if (any(curve, column.of)) columns.push_back(column);
  }
  std::string text = "| |";
  std::string line = "|---|";
  for (const Column& column : columns) {
    text += fmt::format(" {} |", column.head);
    line += "---|";
  }
  text += " |\n" + line + "---|\n";
  for (const BenchPoint& point : curve.points) {
    text += point.as_is ? fmt::format("| **{}** |", point.setting) : fmt::format("| {} |", point.setting);
    for (const Column& column : columns) {
      const bool too_small = column.of == &BenchPoint::pixel_error && point.*column.of < least_pixel_error;
      text += too_small ? fmt::format(" < {:.2g} |", least_pixel_error)
                        : fmt::format(" {} |", number(point.*column.of, column.unit));
    }
    text += fmt::format(" {} |\n", point.note);
  }
  return text;
}

std::string csv_of(const DeviceBench& bench) {
  std::string csv =
      "curve,setting,value,as_is,once_s,each_s,work,force_error,beads_um,pixel_error,pixel_worst,event_error,"
      "estimator_error,estimator_least,estimator_most,estimator_unit,note\n";
  const auto quoted = [](std::string text) {
    std::replace(text.begin(), text.end(), '"', '\'');
    return '"' + text + '"';
  };
  const auto add = [&](std::initializer_list<double> values) {
    for (const double value : values) csv += "," + (std::isfinite(value) ? fmt::format("{:.6g}", value) : "");
  };
  const auto note = [&](const std::string& text) { return text.empty() ? text : quoted(text); };
  for (const BenchCurve& curve : bench.curves) {
    for (const BenchPoint& p : curve.points) {
      csv += fmt::format("{},{},{},{}", curve.name, quoted(p.setting), number(p.value), p.as_is ? 1 : 0);
      add({p.once_s, p.each_s, p.work, p.force_error, p.beads_um, p.pixel_error, p.pixel_worst, p.event_error});
      csv += ",,,,," + note(p.note) + "\n";
    }
  }
  if (!bench.estimator || !bench.estimator->none.empty()) return csv;
  const auto add_row = [&](const char* curve, const EstimatorRow& row, bool as_reference) {
    csv += fmt::format("{},{},{},{}", curve, quoted(row.name), row.frames, as_reference ? 1 : 0);
    add({row.once_s, row.each_s});
    csv += ",,,,,,";
    if (row.errors.empty()) {
      add({kUnknown, kUnknown, kUnknown});
    } else {
      const auto [least, most] = row.range();
      add({row.mean(), least, most});
    }
    csv += fmt::format(",{},{}\n", bench.estimator->unit, note(row.note));
  };
  add_row("estimator", bench.estimator->reference, true);
  for (const EstimatorRow& row : bench.estimator->rows) add_row("estimator", row, false);
  for (const EstimatorRow& row : bench.estimator->counts) add_row("estimator frames", row, false);
  return csv;
}

/// A light setting's words, short enough for a legend; + for what the plan leaves out.
std::string short_name(std::string words) {
  const std::size_t exact = words.find(", with ");
  if (exact != std::string::npos) words = words.substr(0, exact) + " +";
  const std::string noise = " of the imager's noise";
  const std::size_t found = words.find(noise);
  if (found != std::string::npos) words.replace(found, noise.size(), " of noise");
  return words;
}

/// Error against seconds. Pixel errors too small to be distinguished from zero stand on a line of their own.
std::optional<plots::LinePlot> plot_of(const BenchCurve& curve, double least_pixel_error) {
  plots::LinePlot plot;
  plot.title = curve.name + ": error against seconds";
  if (curve.name == "light") plot.title += " (+: with what the plan leaves out)";
  const bool by_setup = curve.name == "mesh" || curve.name == "element";
  double BenchPoint::*const seconds = by_setup ? &BenchPoint::once_s : &BenchPoint::each_s;
  const std::string& head = by_setup ? curve.once : curve.each;  // "a press, ms"
  plot.x_label = head.substr(0, head.rfind(',')) + ", seconds";
  plot.y_label = "error";
  const auto add = [&](const char* what, double BenchPoint::*error, double least) {
    std::vector<plots::PlotCurve> parts;
    plots::PlotCurve limit;
    for (const BenchPoint& point : curve.points) {
      if (!std::isfinite(point.*error) || !std::isfinite(point.*seconds)) continue;
      const std::string name = point.series.empty() ? what : short_name(point.series);
      auto part =
          std::find_if(parts.begin(), parts.end(), [&](const plots::PlotCurve& one) { return one.name == name; });
      if (part == parts.end()) part = parts.insert(part, {name, {}});
      part->points.emplace_back(point.*seconds, std::max(point.*error, least));
      if (least > 0.0) limit.points.emplace_back(point.*seconds, least);
    }
    std::move(parts.begin(), parts.end(), std::back_inserter(plot.curves));
    if (limit.points.size() < 2) return;
    std::sort(limit.points.begin(), limit.points.end());
    limit.name = "least measurable error";
    limit.dashed = true;
    plot.curves.push_back(limit);
  };
  if (any(curve, &BenchPoint::force_error)) add("force error, relative", &BenchPoint::force_error, 0.0);
  if (any(curve, &BenchPoint::pixel_error)) {
    add("pixel error, of the imager's noise", &BenchPoint::pixel_error, least_pixel_error);
  }
  if (any(curve, &BenchPoint::event_error)) add("wrong events", &BenchPoint::event_error, 0.0);
  if (plot.curves.empty()) return std::nullopt;
  return plot;
}

std::string file_name(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

std::string name_of(sim::Switch one) {
  return one == sim::Switch::on ? "on" : "off";
}

std::string choice_in_words(const DeviceBench& bench) {
  const BenchChoice& choice = bench.choice;
  const bool pictures = std::isfinite(choice.verified_pixel);
  std::string text = fmt::format(
      "Wanted: {:.3g} % of a force{}. ", 100.0 * bench.settings.force_error,
      pictures
          ? fmt::format(" and {:.3g} of the imager's noise in a pixel, root mean square", bench.settings.pixel_error)
          : std::string());
  text += fmt::format("The cheapest setting found has edges of {:.3g} mm{}: {:.3g} s once and {:.3g} s a frame ",
                      choice.fine_mm, choice.light_words.empty() ? "" : " and is lit by " + choice.light_words,
                      choice.once_s, choice.frame_s);
  text += fmt::format("(the device as it is: {:.3g} s and {:.3g} s).\n\n", choice.as_is_once_s, choice.as_is_frame_s);
  text += "| on presses that nothing was chosen by | wanted | cheapest | device as it is |\n|---|---|---|---|\n";
  text += fmt::format("| force error, % | {:.3g} | {:.3g} | {:.3g} |\n", 100.0 * bench.settings.force_error,
                      100.0 * choice.verified_force, 100.0 * choice.as_is_force);
  if (pictures) {
    text += fmt::format("| pixel error, of the imager's noise | {:.3g} | {:.3g} | {:.3g} |\n",
                        bench.settings.pixel_error, choice.verified_pixel, choice.as_is_pixel);
  }
  text += fmt::format("| once, s | | {:.3g} | {:.3g} |\n| a frame, s{} | | {:.3g} | {:.3g} |\n\n", choice.once_s,
                      choice.as_is_once_s, choice.by_middle ? " (from the middle, by the number of pixels)" : "",
                      choice.frame_s, choice.as_is_frame_s);
  text += choice.holds ? "**It holds on them.**" : "**It doesn't hold on them.**";
  if (!choice.remark.empty()) text += " " + choice.remark;
  for (const std::string& round : choice.remark_rounds) text += fmt::format(" Before it, {}.", round);
  text += "\n\nIn the device:\n\n```yaml\n";
  text += fmt::format("mesh: {{fine_mm: {:.4g}, coarse_mm: {:.4g}}}\n```\n", choice.fine_mm, choice.coarse_mm);
  if (!choice.light_words.empty()) {
    text += "\nIn scenes:\n\n```yaml\n";
    text += fmt::format("light: {{noise_fraction: {:.3g}, max_samples: {}}}\n",
                        choice.light.noise_fraction.value_or(sim::LightLimits{}.noise_fraction),
                        choice.light.max_samples.value_or(sim::LightLimits{}.max_samples));
    std::string switches;
    const auto add = [&](const char* name, sim::Switch one) {
      if (one != sim::Switch::automatic)
        switches += fmt::format("{}{}: {}", switches.empty() ? "" : ", ", name, name_of(one));
    };
    add("interreflection", choice.effects.interreflection);
    add("fine_relief", choice.effects.fine_relief);
    add("diffraction", choice.effects.diffraction);
    add("direct_light", choice.effects.direct_light);
    add("shared_paths", choice.effects.shared_paths);
    if (!switches.empty()) text += fmt::format("effects: {{{}}}\n", switches);
    text += "```\n";
  }
  return text;
}

std::string effects_table(const DeviceBench& bench) {
  const EffectShare& all = bench.effects.front();
  std::string text = fmt::format(
      "Each is switched over by itself: what the plan simulates off, what it leaves out on. A force's change is "
      "relative, a picture's in the imager's noise and free of the paths' own, the numbers' as delivered, with their "
      "noise. As planned a frame takes {:.3g} s{}; seconds are what the effect adds to that.\n\n",
      all.seconds, all.once_s > 0.0 ? fmt::format(" and a scene's camera {:.3g} s", all.once_s) : std::string());
  text +=
      "| effect | as planned | switched | force changes, % | picture | numbers | it takes, s a frame | of the frame, % "
      "| s once | |\n|---|---|---|---|---|---|---|---|---|---|\n";
  for (const EffectShare& share : bench.effects) {
    if (&share == &all) continue;
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", share.name,
                        share.planned ? "on" : "off", share.planned ? "off" : "on", number(share.force_change, 0.01),
                        number(share.pixel_change), number(share.number_change), number(share.seconds),
                        number(share.seconds / all.seconds, 0.01), number(share.once_s), share.note);
  }
  return text;
}

/// The device's file with the chosen mesh; empty where the file doesn't name its edges.
std::string with_mesh(const std::string& text, const DeviceBench& bench) {
  std::vector<std::pair<YamlNumber, double>> numbers;
  try {
    const SourceLocation nowhere{bench.device, 0};
    const std::pair<const char*, double> edges[] = {{"mesh.fine_mm", bench.choice.fine_mm},
                                                    {"mesh.coarse_mm", bench.choice.coarse_mm}};
    for (const auto& [path, value] : edges) {
      const auto found = find_yaml_numbers(text, bench.device, path, nowhere);
      numbers.emplace_back(found.front().front(), std::round(value * 1e4) / 1e4);
    }
  } catch (const Error&) {
    return {};
  }
  return with_yaml_numbers(text, numbers);
}

}  // namespace

StudyResult report(const DeviceBench& bench, const std::string& text) {
  StudyResult result;
  if (bench.settings.estimator.alone) {
    std::string page = fmt::format("# What accuracy costs: {}\n\n", bench.device);
    page += estimator_page(bench.estimator.value(), file_name(bench.device), result.files);
    page +=
        fmt::format("\nMachine: {}, {} threads.\n", datasets::processor_kind(), std::thread::hardware_concurrency());
    result.files.insert(result.files.begin(), {"bench.md", page});
    result.files.push_back({"bench.csv", csv_of(bench)});
    return result;
  }
  const bool planned_alone = bench.settings.planned_alone;
  const std::string planned = planned_page(bench);
  std::string page =
      fmt::format("# What accuracy costs: {}\n\n{}\n", bench.device, planned_alone ? planned : choice_in_words(bench));
  page += fmt::format(
      "## How it was measured\n\n- Presses: {}.\n- Pictures: {}.\n- Reference: {}; light by paths, each pixel by "
      "itself, twice with other random numbers: the product of the differences from both is free of the reference's "
      "own noise.\n- Machine: {} threads, {}. Seconds are of single runs; other work on the machine shows in them.\n- "
      "Bold: the device as it is.\n\n",
      bench.presses, bench.pictures, bench.reference, std::thread::hardware_concurrency(), datasets::processor_kind());
  const double least_pixel_error = bench.least_pixel_error;
  for (const BenchCurve& curve : bench.curves) {
    page += fmt::format("## {}{}\n\n{}\n\n", static_cast<char>(std::toupper(curve.name[0])), curve.name.substr(1),
                        curve.what);
    if (const auto plot = plot_of(curve, least_pixel_error)) {
      const std::string name = fmt::format("{}-{}.svg", file_name(bench.device), file_name(curve.name));
      result.files.push_back({name, plots::to_svg(*plot)});
      page += fmt::format("![Error against seconds]({})\n\n", name);
    }
    page += table_of(curve, least_pixel_error) + "\n";
  }
  if (planned_alone) {
    result.files.push_back({"bench.md", page});
    return result;
  }
  page += planned + "\n## Effects\n\n" + effects_table(bench);
  if (bench.estimator) page += "\n" + estimator_page(*bench.estimator, file_name(bench.device), result.files);
  result.files.insert(result.files.begin(), {"bench.md", page});
  result.files.push_back({"bench.csv", csv_of(bench)});
  if (const std::string device = with_mesh(text, bench); !device.empty()) {
    result.files.push_back({bench.device + ".yaml", device});
  }
  if (!bench.choice.holds) result.notes.push_back("the wanted errors weren't reached; bench.md says by how much");
  return result;
}

}  // namespace touchstone::lab
