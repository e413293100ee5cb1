#include "sensors/beads/bead_overlay.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/image/drawing.h"

namespace touchstone::sensors {

namespace {

const cv::Scalar kFound(60, 200, 60);
const cv::Scalar kMissing(40, 40, 230);
const cv::Scalar kForce(230, 150, 30);

}  // namespace

void draw_overlay(const cv::Mat& frame, const TrackedBeads& beads, const ForceEstimate& force, cv::Mat& picture,
                  const BeadOverlay& how) {
  const bool known_depth = frame.depth() == CV_8U || frame.depth() == CV_16U;
  if (frame.empty() || !known_depth || (frame.channels() != 1 && frame.channels() != 3)) {
    fail("bead overlay: the image is of type {}; 8 or 16 bit with 1 or 3 channels is needed",
         frame.empty() ? "none" : cv::typeToString(frame.type()));
  }
  if (!(how.px_per_N > 0.0 && std::isfinite(how.px_per_N))) {
    fail("bead overlay: px_per_N is {}, it must be above 0", how.px_per_N);
  }
  if (how.ring_px < 1) fail("bead overlay: ring_px is {}, it must be above 0", how.ring_px);

  cv::Mat eight = frame;
  if (frame.depth() == CV_16U) frame.convertTo(eight, CV_8U, 1.0 / 257.0);
  copy_in_colour(eight, picture);

  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < beads.positions.size(); ++i) {
    const cv::Scalar& colour = is_found(beads.status[i]) ? kFound : kMissing;
    cv::circle(picture, drawn_at(beads.positions[i]), how.ring_px << kDrawingShift, colour, 1, cv::LINE_AA,
               kDrawingShift);
    middle += beads.positions[i] / static_cast<double>(beads.positions.size());
  }
  const Eigen::Vector2d tip = middle + how.px_per_N * force.force.head<2>();
  cv::line(picture, drawn_at(middle), drawn_at(tip), kForce, 2, cv::LINE_AA, kDrawingShift);
  cv::circle(picture, drawn_at(tip), 3 << kDrawingShift, kForce, cv::FILLED, cv::LINE_AA, kDrawingShift);
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "x %.2f  y %.2f  z %.2f N%s", force.force.x(), force.force.y(),
                force.force.z(), force.extrapolated || force.beads_missing > 0 ? " ?" : "");
  cv::putText(picture, text.data(), {8, picture.rows - 12}, cv::FONT_HERSHEY_SIMPLEX, 0.6, kForce, 1, cv::LINE_AA);
}

}  // namespace touchstone::sensors
