#include "datasets/sets/data_card.h"

#include <algorithm>
#include <cmath>

#include "datasets/sets/run_identity.h"

namespace touchstone::datasets {
namespace {

/// The bounds that a drawn number can't leave, widened where they are one.
Histogram histogram_of(const std::string& name, const std::string& unit, double low, double high) {
  Histogram histogram;
  histogram.name = name;
  histogram.unit = unit;
  histogram.low = low;
  histogram.high = high > low ? high : low + 1.0;
  return histogram;
}

std::string bars(const Histogram& histogram) {
  constexpr const char* kBars[] = {"·", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const std::int64_t most =
      std::max<std::int64_t>(1, *std::max_element(histogram.count.begin(), histogram.count.end()));
  std::string text;
  for (const std::int64_t count : histogram.count) text += kBars[(count * 8 + most - 1) / most];
  return text;
}

std::string how(VariationKind how) {
  return how == VariationKind::set ? "set to" : how == VariationKind::times ? "times" : "plus";
}

std::string list_of(const std::vector<NumberVariation>& all) {
  std::string text;
  for (const NumberVariation& vary : all)
    text += fmt::format("  - `{}` {} {}\n", vary.path, how(vary.how), vary.spread.text());
  return text;
}

}  // namespace

void Histogram::add(double value) {
  const auto bins = static_cast<double>(count.size());
  const double at = std::clamp(std::floor((value - low) / (high - low) * bins), 0.0, bins - 1.0);
  ++count[static_cast<std::size_t>(at)];
  least = samples == 0 ? value : std::min(least, value);
  most = samples == 0 ? value : std::max(most, value);
  sum += value;
  ++samples;
}

DrawnFigures::DrawnFigures(const PreparedDraw& prepared) : objects(prepared.job.draw.objects.size(), 0) {
  const DrawSpec& draw = prepared.job.draw;
  constexpr double kForceOfDepth_N = 10.0;  // where nobody says how large it'll be
  histograms = {histogram_of("normal force", "N", 0.0, draw.force_N ? draw.force_N->high : kForceOfDepth_N),
                histogram_of("shear force", "N", 0.0, 0.5 * (draw.force_N ? draw.force_N->high : kForceOfDepth_N)),
                histogram_of("depth", "mm", 0.0, prepared.deepest_mm),
                histogram_of("place x", "mm", draw.place_mm.x.low, draw.place_mm.x.high),
                histogram_of("place y", "mm", draw.place_mm.y.low, draw.place_mm.y.high),
                histogram_of("turn", "deg", draw.turn_deg.low, draw.turn_deg.high),
                histogram_of("tilt", "deg", draw.tilt_deg.low, draw.tilt_deg.high),
                histogram_of("drag", "mm", draw.drag_mm.low, draw.drag_mm.high),
                histogram_of("largest strain", "1", 0.0, 1.0)};
}

void DrawnFigures::add(const BlockColumns& block) {
  const std::vector<double>* columns[] = {&block.force_N,    &block.shear_N,    &block.deepest_mm,
                                          &block.place_x_mm, &block.place_y_mm, &block.turn_deg,
                                          &block.tilt_deg,   &block.drag_mm,    &block.largest_strain};
  TS_ASSERT(std::size(columns) == histograms.size());
  for (std::size_t k = 0; k < histograms.size(); ++k) {
    for (const double value : *columns[k]) histograms[k].add(value);
  }
  for (std::size_t i = 0; i < block.sample.size(); ++i) {
    ++splits.at(static_cast<std::size_t>(block.split[i]));
    ++objects.at(static_cast<std::size_t>(block.object[i]));
    drawn_again += block.attempt[i];
    strained += block.largest_strain[i] > kLargeStrain ? 1 : 0;
    untouched += block.contact_area_mm2[i] > 0.0 ? 0 : 1;
    if (block.force_N[i] > kSmallForce_N) {
      worst_force_error = std::max(worst_force_error, block.force_error_N[i] / block.force_N[i]);
    }
  }
  under_resolved += block.under_resolved;
  ++light[block.light];
}

std::string data_card(const PreparedDraw& prepared, const DrawnFigures& figures) {
  const DrawJob& job = prepared.job;
  const DrawSpec& draw = job.draw;
  const auto share = [&](std::int64_t count) {
    return 100.0 * static_cast<double>(count) / static_cast<double>(job.samples);
  };
  std::string card =
      fmt::format("# {}\n\n{} presses on {} unit{} of the sensor `{}`, simulated by {}.\n\n", job.name, job.samples,
                  draw.units.count, draw.units.count == 1 ? "" : "s", draw.device.stem().string(), program_name());
  card += fmt::format("- licence: {}\n- seed: {}; sample i is a function of the job and i alone\n",
                      job.licence.empty() ? "not stated" : job.licence, job.seed);
  card += fmt::format("- files: {} in `blocks/`, of up to {} samples; `dataset.json` has their checksums\n",
                      prepared.blocks.size(), job.samples_per_file);
  card += "- splits (by " + std::string(job.splits.by == SplitBy::unit ? "unit" : "sample") + "):";
  for (int k = 0; k < kSplits; ++k) {
    const std::int64_t count = figures.splits[static_cast<std::size_t>(k)];
    card += fmt::format("{} {} {} ({:.1f} %)", k > 0 ? "," : "", name_of(static_cast<Split>(k)), count, share(count));
  }
  card += "\n\n## What is drawn\n";
  card += fmt::format("- units: {}{}\n{}", draw.units.count, draw.units.vary.empty() ? ", all alike" : "",
                      list_of(draw.units.vary));
  for (std::size_t k = 0; k < draw.objects.size(); ++k) {
    const DrawnObjectSpec& object = draw.objects[k];
    card += fmt::format("- object {}: `{}`, {} samples ({:.1f} %)\n{}", k, object.file.stem().string(),
                        figures.objects[k], share(figures.objects[k]), list_of(object.vary));
  }
  card += fmt::format("- place x: {} mm; y: {} mm\n- turn: {} deg; tilt: {} deg about an axis at {} deg\n",
                      draw.place_mm.x.text(), draw.place_mm.y.text(), draw.turn_deg.text(), draw.tilt_deg.text(),
                      draw.tilt_axis_deg.text());
  card += draw.force_N ? fmt::format("- normal force: {} N\n", draw.force_N->text())
                       : fmt::format("- depth: {} mm\n", draw.depth_mm->text());
  card += fmt::format("- drag: {} mm towards {} deg\n", draw.drag_mm.text(), draw.drag_toward_deg.text());
  card += "\n## What came out\n| | least | mean | most | histogram over | |\n|---|---|---|---|---|---|\n";
  for (const Histogram& one : figures.histograms) {
    card += fmt::format("| {}, {} | {:.4g} | {:.4g} | {:.4g} | {:.4g} to {:.4g} | `{}` |\n", one.name, one.unit,
                        one.least, one.mean(), one.most, one.low, one.high, bars(one));
  }
  card += "\n## Known limits\n";
  card += fmt::format(
      "- Forces are those of linear elasticity: first-order in the strain. {} samples ({:.1f} %) have a largest strain "
      "above {}; there don't trust percents (`largest_strain`).\n",
      figures.strained, share(figures.strained), kLargeStrain);
  card += fmt::format(
      "- One standard error of the force from the mesh is at most {:.2g} % of forces above {} N (`wrench_error`). {} "
      "samples ({:.1f} %) touch too few nodes for a percent (`under_resolved`).\n",
      100.0 * figures.worst_force_error, kSmallForce_N, figures.under_resolved, share(figures.under_resolved));
  card +=
      fmt::format("- Contact is solved on cells of {} um; finer detail of an object isn't there.\n", job.membrane_um);
  card += "- Gels have no dust, bubbles or wear, and lamps don't flicker.\n";
  card += fmt::format(
      "- {} samples don't touch. {} draws couldn't be pressed and were drawn again, so what can't be "
      "pressed is rarer here than the distributions above say.\n",
      figures.untouched, figures.drawn_again);
  card += "- Light, by blocks:\n";
  for (const auto& [text, blocks] : figures.light) card += fmt::format("  - {}: {}\n", blocks, text);
  card +=
      "\n## How to read it\n```python\nimport h5py\nwith h5py.File('blocks/000000.h5') as f:\n"
      "    for name, array in f.items(): print(name, getattr(array, 'shape', ''), dict(array.attrs))\n```\n";
  return card;
}

}  // namespace touchstone::datasets
