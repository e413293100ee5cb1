#include "sensors/colour/colour_overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/image/drawing.h"

namespace touchstone::sensors {
namespace {

constexpr double kLeastColourArrow = 0.5;  // px: a shorter one is noise
const cv::Scalar kMeasured(60, 220, 60);
const cv::Scalar kBeyond(0, 220, 220);
const cv::Scalar kFlawed(40, 40, 230);
const cv::Scalar kColourArrow(0, 220, 255);
const cv::Scalar kColourWords(0, 220, 255);

}  // namespace

void draw_overlay(const cv::Mat& frame, const ColourMarkerReading& rest, const ColourMarkerReading& seen,
                  const HueField& field, cv::Mat& picture, const ColourOverlay& how) {
  if (frame.empty() || frame.type() != CV_8UC3) fail("colour overlay: the frame isn't of 8 bit and 3 channels");
  if (!(how.arrow_scale > 0.0 && std::isfinite(how.arrow_scale))) {
    fail("colour overlay: arrow_scale is {}, it must be above 0", how.arrow_scale);
  }
  copy_in_colour(frame, picture);
  for (std::size_t i = 0; i < std::min(rest.markers.size(), seen.markers.size()); ++i) {
    const ColourMarker& home = rest.markers[i];
    if (home.flaw != MarkerFlaw::kNone) continue;
    const ColourMarker& now = seen.markers[i];
    const bool sound = now.flaw == MarkerFlaw::kNone;
    const Eigen::Vector2d place = sound ? now.ink_centroid_px : home.ink_centroid_px;
    const double radius = 0.5 * std::sqrt(std::max(1.0, home.ink_area_px));
    const bool measured = sound && field.field.measured[i] != 0;
    const cv::Scalar& colour = !measured ? kFlawed : field.extrapolated[i] != 0 ? kBeyond : kMeasured;
    cv::circle(picture, drawn_at(place), static_cast<int>(std::lround(radius * (1 << kDrawingShift))), colour, 1,
               cv::LINE_AA, kDrawingShift);
    const Eigen::Vector2d arrow = how.arrow_scale * (place - home.ink_centroid_px);
    if (!measured || arrow.norm() < kLeastColourArrow) continue;
    cv::arrowedLine(picture, drawn_at(home.ink_centroid_px), drawn_at(home.ink_centroid_px + arrow), kColourArrow, 1,
                    cv::LINE_AA, kDrawingShift, 0.3);
  }
  std::string words = how.words;
  if (how.force_N) {
    words = fmt::format("{:.2f} {:.2f} {:.2f} N  {}", how.force_N->x(), how.force_N->y(), how.force_N->z(), words);
  }
  write_below(words, kColourWords, picture);
}

}  // namespace touchstone::sensors
