// The files of a comparison.

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/inspection/contact_sheet.h"
#include "datasets/sets/csv_cells.h"
#include "lab/likeness/likeness.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

constexpr double kEnlarged = 10.0;  // how much differences of differences are enlarged
constexpr int kTileWidth_px = 240;

/// A way to make a press's picture, by name; null where a press doesn't have it.
struct Way {
  const char* name;
  std::function<const PictureLikeness*(const PressLikeness&)> of;
};

std::vector<Way> ways() {
  return {
      {"device", [](const PressLikeness& press) { return &press.device; }},
      {"device with residual", [](const PressLikeness& press) { return press.residual ? &*press.residual : nullptr; }},
      {"device, raw", [](const PressLikeness& press) { return &press.raw; }},
      {"rest alone", [](const PressLikeness& press) { return &press.rest; }},
      {"table of slopes", [](const PressLikeness& press) { return press.table ? &*press.table : nullptr; }}};
}

LikenessSummary::Range range_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {sum / static_cast<double>(values.size()), *low, *high};
}

cv::Mat on_grey(const cv::Mat& difference, double factor) {
  cv::Mat out;
  difference.convertTo(out, CV_8U, factor, 128.0);
  return out;
}

std::string csv_row(const PressLikeness& press, const char* way, const PictureLikeness& of) {
  return fmt::format(
      "{},{},{},{:.2f},{:.2f},{:.4f},{:.4f},{:.4f},{},{:.4f},{:.4f},{:.4f},{:.3f},{:.4f},{:.2f},{:.2f}\n",
      datasets::csv_cell(press.name), press.learned ? "yes" : "no", way, press.radius_px, press.simulated_radius_px,
      press.place_mm.x(), press.place_mm.y(), press.depth_mm, press.shallow ? "yes" : "no", press.gain[2],
      press.gain[1], press.gain[0], of.psnr, of.ssim, of.off.inside, of.off.ring);
}

}  // namespace

LikenessSummary summary_of(const Likeness& likeness) {
  std::vector<const PressLikeness*> counted;
  for (const PressLikeness& press : likeness.presses) {
    if (!press.learned) counted.push_back(&press);
  }
  if (counted.empty()) {
    for (const PressLikeness& press : likeness.presses) counted.push_back(&press);
  }
  LikenessSummary summary;
  summary.presses = static_cast<int>(counted.size());
  for (const Way& way : ways()) {
    std::vector<double> psnr, ssim, inside, ring;
    for (const PressLikeness* press : counted) {
      const PictureLikeness* const of = way.of(*press);
      if (of == nullptr) continue;
      psnr.push_back(of->psnr);
      ssim.push_back(of->ssim);
      inside.push_back(of->off.inside);
      ring.push_back(of->off.ring);
    }
    if (psnr.empty()) continue;
    summary.rows.push_back({way.name, range_of(psnr), range_of(ssim), range_of(inside), range_of(ring)});
  }
  return summary;
}

std::string to_text(const LikenessSummary& summary) {
  std::string text = fmt::format("{:<20} {:>22} {:>24} {:>20} {:>20}\n", fmt::format("{} presses", summary.presses),
                                 "PSNR, dB", "SSIM", "inside, of 255", "ring, of 255");
  for (const LikenessSummary::Of& row : summary.rows) {
    text += fmt::format(
        "{:<20} {:6.2f} ({:5.2f} to {:5.2f}) {:7.4f} ({:.4f}-{:.4f}) {:6.2f} ({:4.1f} to {:4.1f}) "
        "{:6.2f} ({:4.1f} to {:4.1f})\n",
        row.what, row.psnr.mean, row.psnr.low, row.psnr.high, row.ssim.mean, row.ssim.low, row.ssim.high,
        row.inside.mean, row.inside.low, row.inside.high, row.ring.mean, row.ring.low, row.ring.high);
  }
  return text;
}

std::string to_csv(const Likeness& likeness) {
  std::string csv =
      "file,learned,way,radius_px,simulated_radius_px,x_mm,y_mm,depth_mm,shallow,gain_red,gain_green,gain_blue,psnr_dB,"
      "ssim,"
      "inside_DN,ring_DN\n";
  for (const PressLikeness& press : likeness.presses) {
    for (const Way& way : ways()) {
      if (const PictureLikeness* const of = way.of(press)) {
        const std::string name = std::string("\"") + way.name + "\"";
        csv += csv_row(press, name.c_str(), *of);
      }
    }
  }
  const LikenessSummary summary = summary_of(likeness);
  for (const char* which : {"mean", "low", "high"}) {
    const auto pick = [&](const LikenessSummary::Range& range) {
      return which == std::string("mean") ? range.mean : which == std::string("low") ? range.low : range.high;
    };
    for (const LikenessSummary::Of& row : summary.rows) {
      csv += fmt::format("{} of {},no,\"{}\",,,,,,,,,,{:.3f},{:.4f},{:.2f},{:.2f}\n", which, summary.presses, row.what,
                         pick(row.psnr), pick(row.ssim), pick(row.inside), pick(row.ring));
    }
  }
  return csv;
}

cv::Mat likeness_sheet(const Likeness& likeness) {
  std::vector<cv::Mat> images;
  std::vector<std::string> captions;
  const bool corrected = !likeness.residual.empty();
  for (const PressLikeness& press : likeness.presses) {
    images.insert(images.end(), {press.frame, press.simulated_frame, on_grey(press.recorded, 1.0),
                                 on_grey(press.simulated, 1.0), on_grey(press.simulated - press.recorded, kEnlarged)});
    captions.insert(captions.end(),
                    {fmt::format("{}{}, balanced", press.name, press.learned ? " (learned)" : ""),
                     fmt::format("{}, {:.2f} mm deep", likeness.device, press.depth_mm), "recorded less rest",
                     fmt::format("simulated: {:.1f} dB, SSIM {:.3f}", press.device.psnr, press.device.ssim),
                     fmt::format("simulated less recorded, x {:.0f}", kEnlarged)});
    if (!corrected) continue;
    images.insert(images.end(), {on_grey(press.corrected, 1.0), on_grey(press.corrected - press.recorded, kEnlarged)});
    captions.insert(captions.end(),
                    {fmt::format("with residual: {:.1f} dB, SSIM {:.3f}", press.residual->psnr, press.residual->ssim),
                     fmt::format("the same less recorded, x {:.0f}", kEnlarged)});
  }
  return datasets::contact_sheet(images, captions, corrected ? 7 : 5, kTileWidth_px);
}

void write_likeness(const Likeness& likeness, const std::filesystem::path& folder) {
  write_whole_file(folder / "likeness.csv", to_csv(likeness));
  sim::write_png(folder / "likeness.png", likeness_sheet(likeness));
  for (const PressLikeness& press : likeness.presses) {
    const std::string stem = std::filesystem::path(press.name).stem().string();
    sim::write_png(folder / (stem + "-balanced.png"), press.fit_frame);
  }
}

}  // namespace touchstone::lab
