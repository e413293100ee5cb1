#include "sensors/skin/skin_marks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr int kLargest = 255;
constexpr int kDarkest = 4;         // digital numbers of green: below, a ratio is noise
constexpr double kBeadPart = 0.75;  // of the red that would be there without beads
constexpr double kBeadRim_px = 4.0;
constexpr double kFine_px = 2.0;    // standard deviation of smoothing before beads are looked for
constexpr double kLeastSeen = 0.5;  // of a frame, and of a mark or its ring

/// A frame's erythema index where it is seen.
struct IndexMap {
  cv::Mat index;  // CV_32FC1
  cv::Mat red;    // CV_32FC1, what the index is made of
  cv::Mat seen;   // CV_8UC1
};

cv::Mat disc(double radius_px) {
  const int side = 2 * static_cast<int>(std::ceil(radius_px)) + 1;
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side});
}

IndexMap index_map(const cv::Mat& frame, const SkinMarkSettings& settings, const char* which) {
  std::vector<cv::Mat> channels;
  cv::split(frame, channels);
  const cv::Mat sound =
      (channels[1] >= kDarkest) & (channels[2] >= kDarkest) & (channels[1] < kLargest) & (channels[2] < kLargest);
  const double share = cv::countNonZero(sound) / static_cast<double>(sound.total());
  if (share < kLeastSeen) {
    fail("skin marks: {:.0f} % of the frame {} are neither dark nor at {}; at least {:.0f} % are needed", 100 * share,
         which, kLargest, 100 * kLeastSeen);
  }
  // Means of red and of green over what is sound and no bead.
  // Beads are dark and narrow: the closing fills them and leaves marks.
  cv::Mat red;
  channels[2].convertTo(red, CV_32F);
  cv::GaussianBlur(red, red, {}, kFine_px);
  cv::Mat filled;
  cv::morphologyEx(red, filled, cv::MORPH_CLOSE, disc(0.5 * settings.bead_px));
  cv::Mat hidden = (red < kBeadPart * filled) | ~sound;
  cv::morphologyEx(hidden, hidden, cv::MORPH_OPEN, disc(1.0));  // single pixels are noise
  cv::dilate(hidden, hidden, disc(kBeadRim_px));
  IndexMap map;
  map.seen = ~hidden & sound;
  cv::Mat weight;
  map.seen.convertTo(weight, CV_32F, 1.0 / kLargest);
  cv::Mat share_seen;
  cv::GaussianBlur(weight, share_seen, {}, settings.smooth_px);
  cv::Mat sums[2];
  for (int k = 0; k < 2; ++k) {
    channels[k == 0 ? 2 : 1].convertTo(sums[k], CV_32F);
    sums[k] = sums[k].mul(weight);
    cv::GaussianBlur(sums[k], sums[k], {}, settings.smooth_px);
    sums[k] = cv::max(sums[k], 1e-6f);
  }
  map.seen = ~hidden;
  cv::Mat logs[2];
  for (int k = 0; k < 2; ++k) cv::log(sums[k], logs[k]);
  cv::divide(sums[0], cv::max(share_seen, 1e-3f), map.red);
  map.index = (logs[0] - logs[1]) * (100.0 / std::log(10.0));
  return map;
}

/// The median of a map's layer over what is seen within a mask; nothing where less than half of it is.
std::optional<double> median_of(const IndexMap& map, const cv::Mat& layer, const cv::Mat& mask) {
  std::vector<float> values;
  int all = 0;
  for (int row = 0; row < mask.rows; ++row) {
    const auto* wanted = mask.ptr<std::uint8_t>(row);
    const auto* seen = map.seen.ptr<std::uint8_t>(row);
    const auto* value = layer.ptr<float>(row);
    for (int column = 0; column < mask.cols; ++column) {
      if (wanted[column] == 0) continue;
      ++all;
      if (seen[column] != 0) values.push_back(value[column]);
    }
  }
  if (values.empty() || static_cast<double>(values.size()) < kLeastSeen * all) return std::nullopt;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void check(const cv::Mat& before, const cv::Mat& pressed, const SkinMarkSettings& settings) {
  for (const cv::Mat* frame : {&before, &pressed}) {
    if (frame->empty() || frame->type() != CV_8UC3) fail("skin marks: a frame needs three bytes a pixel");
  }
  if (before.size() != pressed.size()) {
    fail("skin marks: frames of {} x {} and {} x {} pixels; both must be of one size", before.cols, before.rows,
         pressed.cols, pressed.rows);
  }
  const auto within = [](double value, double low, double high, const char* name) {
    if (!(value >= low && value <= high)) fail("skin marks: {} is {}; allowed is {} to {}", name, value, low, high);
  };
  within(settings.smooth_px, 0.5, 100.0, "smooth_px");
  within(settings.least_index, 0.1, 1000.0, "least_index");
  within(settings.least_area_px, 1.0, 1e9, "least_area_px");
  within(settings.rim_px, 0.0, 1000.0, "rim_px");
  within(settings.ring_px, 1.0, 1000.0, "ring_px");
  within(settings.bead_px, 2.0, 200.0, "bead_px");
  within(settings.blanched_share, 0.01, 1.0, "blanched_share");
  within(settings.wetted_part, 0.0, 1.0, "wetted_part");
}

}  // namespace

const char* name_of(SkinMarkKind kind) {
  switch (kind) {
    case SkinMarkKind::erythema:
      return "erythema";
    case SkinMarkKind::purpura:
      return "purpura";
    case SkinMarkKind::unknown:
      return "unknown";
  }
  TS_ASSERT(false);
  return "";
}

std::vector<SkinMark> skin_marks(const cv::Mat& before, const cv::Mat& pressed, const SkinMarkSettings& settings) {
  check(before, pressed, settings);
  const IndexMap first = index_map(before, settings, "before pressure");
  const IndexMap second = index_map(pressed, settings, "under pressure");
  const cv::Mat everywhere(before.size(), CV_8UC1, cv::Scalar(kLargest));
  const std::optional<double> skin = median_of(first, first.index, everywhere);
  if (!skin) return {};

  const cv::Mat red = (first.index > *skin + settings.least_index) & first.seen;
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  const int count = cv::connectedComponentsWithStats(red, labels, stats, centres);
  const cv::Mat reach = disc(settings.rim_px);
  const cv::Mat far_reach = disc(settings.ring_px);
  cv::Mat all_marks;
  cv::dilate(red, all_marks, reach);
  std::vector<SkinMark> marks;
  for (int k = 1; k < count; ++k) {
    SkinMark mark;
    mark.area_px = stats.at<int>(k, cv::CC_STAT_AREA);
    if (mark.area_px < settings.least_area_px) continue;
    mark.centre = {centres.at<double>(k, 0) + 0.5, centres.at<double>(k, 1) + 0.5};
    const cv::Mat own = labels == k;
    cv::Mat core;
    cv::erode(own, core, reach);
    cv::Mat ring;
    cv::dilate(own, ring, reach);
    cv::dilate(ring, ring, far_reach);
    ring &= ~all_marks;
    const auto above_ring = [&](const IndexMap& map) -> std::optional<double> {
      const std::optional<double> inside = median_of(map, map.index, core);
      const std::optional<double> outside = median_of(map, map.index, ring);
      if (!inside || !outside) return std::nullopt;
      return *inside - *outside;
    };
    const std::optional<double> was = above_ring(first);
    const std::optional<double> is = above_ring(second);
    if (was && is && *was >= settings.least_index) {
      mark.index_before = *was;
      mark.index_pressed = *is;
      mark.blanched = 1.0 - *is / *was;
      mark.darkened = *median_of(second, second.red, core) / std::max(*median_of(first, first.red, core), 1e-6);
      const bool touched = settings.wetted_part == 0.0 || mark.darkened <= settings.wetted_part;
      if (touched)
        mark.kind = mark.blanched >= settings.blanched_share ? SkinMarkKind::erythema : SkinMarkKind::purpura;
    }
    marks.push_back(mark);
  }
  std::stable_sort(marks.begin(), marks.end(),
                   [](const SkinMark& a, const SkinMark& b) { return a.area_px > b.area_px; });
  return marks;
}

}  // namespace touchstone::sensors
