#include "sensors/markers/touch_overlay.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>

#include "core/error.h"
#include "sensors/image/drawing.h"

namespace touchstone::sensors {
namespace {

const cv::Scalar kTrustedEllipse(60, 220, 60);
const cv::Scalar kDoubtedEllipse(40, 40, 230);
const cv::Scalar kTouchWords(0, 200, 255);
const cv::Scalar kSlipWords(60, 60, 255);
const cv::Scalar kBar(255, 170, 40);
const cv::Scalar kBarFrame(150, 150, 150);
constexpr int kBarWidth = 8;

/// The ellipse (p - c)^T E (p - c) = 1.
void draw_patch(const ContactPatch& patch, const cv::Scalar& colour, cv::Mat& picture) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(patch.edge);
  if (axes.info() != Eigen::Success || !(axes.eigenvalues().minCoeff() > 0.0)) return;
  const Eigen::Vector2d half = axes.eigenvalues().cwiseSqrt().cwiseInverse();
  const Eigen::Vector2d along = axes.eigenvectors().col(0);
  const double scale = 1 << kDrawingShift;
  cv::ellipse(
      picture, drawn_at(patch.centre),
      cv::Size(static_cast<int>(std::lround(scale * half.x())), static_cast<int>(std::lround(scale * half.y()))),
      std::atan2(along.y(), along.x()) * 180.0 / std::numbers::pi, 0.0, 360.0, colour, 1, cv::LINE_AA, kDrawingShift);
}

void draw_bar(double force_N, double error_N, double full_N, cv::Mat& picture) {
  const int bottom = picture.rows - 6, height = std::max(8, picture.rows - 12), left = picture.cols - kBarWidth - 4;
  const auto level = [&](double newton) {
    return bottom - static_cast<int>(std::lround(height * std::clamp(newton / full_N, 0.0, 1.0)));
  };
  cv::rectangle(picture, {left, bottom - height}, {left + kBarWidth, bottom}, kBarFrame, 1);
  if (force_N > 0.0) {
    cv::rectangle(picture, {left + 1, level(force_N)}, {left + kBarWidth - 1, bottom}, kBar, cv::FILLED);
  }
  const int middle = left + kBarWidth / 2;
  cv::line(picture, {middle, level(force_N - error_N)}, {middle, level(force_N + error_N)}, kTouchWords, 1);
}

std::string words_of(const TouchReading& touch) {
  std::string words;
  if (touch.normal_N) words += fmt::format("{:.2f} N ", *touch.normal_N);
  if (touch.shear_N) words += fmt::format("shear {:.2f} N ", touch.shear_N->norm());
  if (touch.beyond_calibration) words += "? ";
  return words + (touch.patch ? name_of(touch.rim.state) : "no contact");
}

}  // namespace

void draw_touch(const TouchReading& touch, cv::Mat& picture, const TouchOverlay& how) {
  if (picture.type() != CV_8UC3 || picture.empty()) fail("touch overlay: the picture isn't of 8 bit and 3 channels");
  if (!(how.full_force_N > 0.0 && std::isfinite(how.full_force_N))) {
    fail("touch overlay: full_force_N is {}, it must be above 0", how.full_force_N);
  }
  if (touch.patch) draw_patch(*touch.patch, touch.trusted ? kTrustedEllipse : kDoubtedEllipse, picture);
  if (touch.normal_N) draw_bar(*touch.normal_N, touch.normal_error_N, how.full_force_N, picture);
  const bool slips = touch.rule_slip || touch.rim.state == SlipState::kSliding;
  write_below(words_of(touch), slips ? kSlipWords : kTouchWords, picture);
}

}  // namespace touchstone::sensors
