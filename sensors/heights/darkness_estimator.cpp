#include "sensors/heights/darkness_estimator.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/wide_clones.h"

namespace touchstone::sensors {
namespace {

/// What a row's lookup needs.
struct Lookup {
  const float* table;
  float first;       // knots from darkening 0
  float last;        // of the table, counted from its first
  float calibrated;  // likewise: the curve's last
};

struct Counts {
  int deeper = 0;
  int bulged = 0;
};

TS_WIDE_CLONES Counts look_up(const Lookup& curve, const float* darkening, const unsigned char* saturated,
                              const unsigned char* unlit, int count, float* height, unsigned char* doubt) {
  constexpr auto kKnots = static_cast<float>(1.0 / DarknessCurve::kStep);
  const float* const table = curve.table;
  const float first = curve.first;
  const float last = curve.last;
  const float calibrated = curve.calibrated;
  Counts counts;
  for (int u = 0; u < count; ++u) {
    const float place = darkening[u] * kKnots - first;
    const float above = place > 0.0F ? place : 0.0F;
    const float within = above < last ? above : last;
    const auto knot = static_cast<std::int32_t>(within);
    const float part = within - static_cast<float>(knot);
    const float low = table[knot];
    height[u] = low + part * (table[knot + 1] - low);
    const int deeper = place > calibrated ? 1 : 0;
    const int bulged = place < 0.0F ? 1 : 0;
    doubt[u] = static_cast<unsigned char>((saturated[u] & kSaturated) | (unlit[u] & kUnlit) | deeper * kDeeper |
                                          bulged * kBulged);
    counts.deeper += deeper;
    counts.bulged += bulged;
  }
  return counts;
}

const DarknessModel& checked(const DarknessModel& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("darkness model: {}", fault);
  return model;
}

}  // namespace

DarknessEstimator::DarknessEstimator(const DarknessModel& model, const DarknessSettings& settings)
    : model_(checked(model)), settings_(settings), meter_(model_.rest, model_.darkening) {
  const int last = static_cast<int>(std::lround(1.0 / DarknessCurve::kStep));
  for (int knot = model_.curve.first; knot <= last; ++knot) {
    table_.push_back(static_cast<float>(model_.curve.height_at(knot * DarknessCurve::kStep)));
  }
  table_.push_back(table_.back());  // read at the last knot, with weight 0
  result_.height_mm.create(model_.rest.mean.size(), CV_32FC1);
  result_.doubt.create(model_.rest.mean.size(), CV_8UC1);
  result_.contact.create(model_.rest.mean.size(), CV_8UC1);
}

const DarknessResult& DarknessEstimator::estimate(const cv::Mat& frame) {
  const Darkening& darkening = meter_.measure(frame);
  const DarknessCurve& curve = model_.curve;
  const Lookup lookup{table_.data(), static_cast<float>(curve.first), static_cast<float>(table_.size() - 2),
                      static_cast<float>(curve.heights_mm.size() - 1)};
  Counts counts;
  for (int v = 0; v < frame.rows; ++v) {
    const Counts here = look_up(lookup, darkening.map.ptr<float>(v), darkening.saturated.ptr(v), meter_.unlit().ptr(v),
                                frame.cols, result_.height_mm.ptr<float>(v), result_.doubt.ptr(v));
    counts.deeper += here.deeper;
    counts.bulged += here.bulged;
  }
  const auto pixels = static_cast<double>(frame.total());
  result_.contact_pixels = mark_contact(result_.height_mm, settings_.contact, result_.contact);
  result_.exposure = darkening.exposure;
  result_.exposure_followed = darkening.exposure_followed;
  result_.saturated_share = darkening.saturated_share;
  result_.dark_share = darkening.dark_share;
  result_.deeper_share = counts.deeper / pixels;
  result_.bulged_share = counts.bulged / pixels;
  result_.overexposed = result_.saturated_share > settings_.most_saturated;
  result_.dark = result_.dark_share > settings_.most_dark;
  result_.contact_at_border = touches_border(result_.contact);
  return result_;
}

}  // namespace touchstone::sensors
