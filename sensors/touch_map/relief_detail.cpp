#include "sensors/touch_map/relief_detail.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr double kLeastShare = 0.05;  // of a neighbourhood that must have been touched for a mean

cv::Mat blurred(const cv::Mat& image, double sigma_px) {
  cv::Mat result;
  // The kernel reaches 3 sigma; beyond the border there is nothing.
  const int size = 2 * static_cast<int>(std::ceil(3.0 * sigma_px)) + 1;
  cv::GaussianBlur(image, result, {size, size}, sigma_px, sigma_px, cv::BORDER_CONSTANT);
  return result;
}

}  // namespace

cv::Mat support_of(const TouchImage& touch, const DetailSettings& settings) {
  const cv::Mat contact = touch.contact != 0;
  // Distances stand for dilating and eroding by discs, which would cost the square of their radius.
  const auto grown = [](const cv::Mat& mask, double px) {
    if (cv::countNonZero(mask) == 0) return mask;
    cv::Mat distance;
    cv::distanceTransform(~mask, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    return cv::Mat(distance <= px);
  };
  const double gap_px = settings.gap_mm / touch.mm_per_px, margin_px = settings.margin_mm / touch.mm_per_px;
  // Beyond the picture's border nothing is touched, else the border would close gaps too.
  cv::Mat far;
  cv::copyMakeBorder(~grown(contact, gap_px), far, 1, 1, 1, 1, cv::BORDER_CONSTANT, 255);
  const cv::Mat closed = ~grown(far, gap_px)(cv::Rect(1, 1, contact.cols, contact.rows));
  return grown(contact | closed, margin_px);
}

cv::Mat evened(const ReliefDetail& detail, double sigma_mm, double least_rms_mm) {
  cv::Mat touched;
  cv::Mat(detail.weight > 0.0).convertTo(touched, CV_32F, 1.0 / 255.0);
  const double sigma_px = sigma_mm / detail.frame.mm_per_px;
  const cv::Mat squares = blurred(detail.detail_mm.mul(detail.detail_mm).mul(touched), sigma_px);
  const cv::Mat share = blurred(touched, sigma_px);
  cv::Mat result(detail.detail_mm.size(), CV_32F, cv::Scalar(0));
  for (int v = 0; v < result.rows; ++v) {
    for (int u = 0; u < result.cols; ++u) {
      if (touched.at<float>(v, u) == 0.0F) continue;
      const double rms = std::sqrt(squares.at<float>(v, u) / std::max<double>(share.at<float>(v, u), kLeastShare));
      result.at<float>(v, u) = static_cast<float>(detail.detail_mm.at<float>(v, u) / std::max(rms, least_rms_mm));
    }
  }
  return result;
}

ReliefDetail relief_detail(const cv::Mat& height_mm, const cv::Mat& support, const PixelFrame& frame,
                           const DetailSettings& settings) {
  TS_ASSERT(support.size() == height_mm.size() && support.type() == CV_8UC1);
  cv::Mat share;
  support.convertTo(share, CV_32F, 1.0 / 255.0);
  const cv::Mat masked = height_mm.mul(share);
  const double noise_px = settings.noise_mm / frame.mm_per_px, shape_px = settings.shape_mm / frame.mm_per_px;
  const cv::Mat fine_sum = blurred(masked, noise_px), fine_share = blurred(share, noise_px);
  const cv::Mat wide_sum = blurred(masked, shape_px), wide_share = blurred(share, shape_px);
  cv::Mat border_px;  // to the support's border; the image's own isn't one
  cv::distanceTransform(support, border_px, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const double fade_px = std::max(settings.fade_mm / frame.mm_per_px, 1e-9);

  ReliefDetail result;
  result.frame = frame;
  result.detail_mm = cv::Mat(height_mm.size(), CV_32F, cv::Scalar(0));
  result.weight = cv::Mat(height_mm.size(), CV_32F, cv::Scalar(0));
  double squares = 0.0, weights = 0.0;
  for (int v = 0; v < height_mm.rows; ++v) {
    for (int u = 0; u < height_mm.cols; ++u) {
      const double near = fine_share.at<float>(v, u), far = wide_share.at<float>(v, u);
      if (support.at<std::uint8_t>(v, u) == 0 || near < kLeastShare || far < kLeastShare) continue;
      const double fade = std::min(1.0, border_px.at<float>(v, u) / fade_px);
      const double detail = fade * (fine_sum.at<float>(v, u) / near - wide_sum.at<float>(v, u) / far);
      result.detail_mm.at<float>(v, u) = static_cast<float>(detail);
      result.weight.at<float>(v, u) = static_cast<float>(far);
      squares += far * detail * detail;
      weights += far;
    }
  }
  if (weights > 0.0) result.rms_mm = std::sqrt(squares / weights);
  return result;
}

ReliefDetail relief_detail(const TouchImage& touch, const DetailSettings& settings) {
  check(touch);
  return relief_detail(touch.height_mm, support_of(touch, settings),
                       touch_frame(touch.height_mm.size(), touch.mm_per_px), settings);
}

}  // namespace touchstone::sensors
