#include "sensors/markers/marker_overlay.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/image/drawing.h"

namespace touchstone::sensors {

namespace {

constexpr double kRing = 0.65;       // of a marker's diameter: just outside its rim
constexpr double kLeastArrow = 0.5;  // px: a shorter one is noise
const cv::Scalar kTrusted(60, 220, 60);
const cv::Scalar kHeld(40, 40, 230);
const cv::Scalar kArrow(0, 200, 255);

}  // namespace

void draw_overlay(const cv::Mat& frame, const TrackedMarkers& markers, const MarkerAppearance& appearance,
                  cv::Mat& picture, const MarkerOverlay& how) {
  if (frame.empty() || (frame.type() != CV_8UC1 && frame.type() != CV_8UC3)) {
    fail("marker overlay: the image is of type {}; 8 bit with 1 or 3 channels is needed",
         frame.empty() ? "none" : cv::typeToString(frame.type()));
  }
  if (!(how.arrow_scale > 0.0 && std::isfinite(how.arrow_scale))) {
    fail("marker overlay: arrow_scale is {}, it must be above 0", how.arrow_scale);
  }
  copy_in_colour(frame, picture);
  const int ring = std::max(static_cast<int>(std::lround(kRing * appearance.diameter_px * (1 << kDrawingShift))),
                            1 << kDrawingShift);
  for (std::size_t i = 0; i < markers.rest.size(); ++i) {
    const bool trusted = markers.trusted(i);
    cv::circle(picture, drawn_at(markers.positions[i]), ring, trusted ? kTrusted : kHeld, 1, cv::LINE_AA,
               kDrawingShift);
    const Eigen::Vector2d arrow = how.arrow_scale * markers.displacement(i);
    if (arrow.norm() < kLeastArrow) continue;
    cv::arrowedLine(picture, drawn_at(markers.rest[i]), drawn_at(markers.rest[i] + arrow), trusted ? kArrow : kHeld, 1,
                    cv::LINE_AA, kDrawingShift, 0.3);
  }
}

}  // namespace touchstone::sensors
