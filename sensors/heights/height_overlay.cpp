#include "sensors/heights/height_overlay.h"

#include <fmt/format.h>

#include <climits>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/error.h"
#include "sensors/image/drawing.h"

namespace touchstone::sensors {
namespace {

const cv::Scalar kTrustedRim(60, 220, 60);
const cv::Scalar kUntrustedRim(40, 40, 230);
const cv::Scalar kWords(0, 200, 255);

void draw_beside(const cv::Mat& frame, const cv::Mat& height_mm, const cv::Mat& contact, bool trusted,
                 double highest_mm, cv::Mat& picture) {
  if (!(highest_mm > 0.0 && std::isfinite(highest_mm))) {
    fail("height overlay: highest_mm is {}, it must be above 0", highest_mm);
  }
  cv::Mat levels, heights;
  height_mm.convertTo(levels, CV_8U, 255.0 / highest_mm);
  cv::cvtColor(levels, heights, cv::COLOR_GRAY2BGR);
  cv::Mat drawn;
  cv::hconcat(frame, heights, drawn);
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(contact.clone(), outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const cv::Scalar rim = trusted ? kTrustedRim : kUntrustedRim;
  cv::drawContours(drawn, outlines, -1, rim);
  cv::drawContours(drawn, outlines, -1, rim, 1, cv::LINE_8, cv::noArray(), INT_MAX, {frame.cols, 0});
  double highest = 0.0;
  cv::minMaxLoc(height_mm, nullptr, &highest);
  cv::putText(drawn, fmt::format("{:.3f} mm", highest), {frame.cols + 4, 14}, cv::FONT_HERSHEY_SIMPLEX, 0.4, kWords, 1,
              cv::LINE_AA);
  picture = drawn;
}

}  // namespace

void draw_overlay(const cv::Mat& frame, const HeightResult& result, double highest_mm, cv::Mat& picture) {
  if (frame.type() != CV_8UC3 || frame.size() != result.height_mm.size()) {
    fail("height overlay: the frame isn't of 8 bit and 3 channels, or isn't of the heights' size");
  }
  draw_beside(frame, result.height_mm, result.contact, result.trusted(), highest_mm, picture);
}

void draw_overlay(const cv::Mat& frame, const DarknessResult& result, double highest_mm, cv::Mat& picture) {
  if ((frame.type() != CV_8UC3 && frame.type() != CV_8UC1) || frame.size() != result.height_mm.size()) {
    fail("height overlay: the frame isn't of 8 bit and 1 or 3 channels, or isn't of the heights' size");
  }
  cv::Mat colour;
  copy_in_colour(frame, colour);
  draw_beside(colour, result.height_mm, result.contact, result.trusted(), highest_mm, picture);
}

}  // namespace touchstone::sensors
