#include "lab/likeness/picture_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/error.h"

namespace touchstone::lab {
namespace {

constexpr double kRange = 255.0;
constexpr int kWindow = 7;

cv::Mat window_mean(const cv::Mat& of) {
  cv::Mat mean;
  cv::boxFilter(of, mean, CV_64F, {kWindow, kWindow});
  return mean;
}

double ssim_of_channel(const cv::Mat& a, const cv::Mat& b) {
  constexpr double kUnbiased = kWindow * kWindow / (kWindow * kWindow - 1.0);
  const double c1 = std::pow(0.01 * kRange, 2);
  const double c2 = std::pow(0.03 * kRange, 2);
  const cv::Mat mean_a = window_mean(a), mean_b = window_mean(b);
  const cv::Mat mean_aa = window_mean(a.mul(a)), mean_bb = window_mean(b.mul(b)), mean_ab = window_mean(a.mul(b));
  double sum = 0.0;
  for (int v = kWindow / 2; v < a.rows - kWindow / 2; ++v) {
    for (int u = kWindow / 2; u < a.cols - kWindow / 2; ++u) {
      const double m = mean_a.at<double>(v, u), n = mean_b.at<double>(v, u);
      const double vary_a = kUnbiased * (mean_aa.at<double>(v, u) - m * m);
      const double vary_b = kUnbiased * (mean_bb.at<double>(v, u) - n * n);
      const double together = kUnbiased * (mean_ab.at<double>(v, u) - m * n);
      sum += (2 * m * n + c1) * (2 * together + c2) / ((m * m + n * n + c1) * (vary_a + vary_b + c2));
    }
  }
  return sum / ((a.rows - kWindow + 1.0) * (a.cols - kWindow + 1.0));
}

}  // namespace

double psnr(const cv::Mat& a, const cv::Mat& b) {
  TS_ASSERT(a.type() == CV_32FC3 && b.type() == CV_32FC3 && a.size() == b.size());
  const double square = std::pow(cv::norm(a, b, cv::NORM_L2), 2) / (3.0 * static_cast<double>(a.total()));
  return square > 0.0 ? 10.0 * std::log10(kRange * kRange / square) : std::numeric_limits<double>::infinity();
}

double ssim(const cv::Mat& a, const cv::Mat& b) {
  TS_ASSERT(a.type() == CV_32FC3 && b.type() == CV_32FC3 && a.size() == b.size());
  TS_ASSERT(a.rows >= kWindow && a.cols >= kWindow);
  cv::Mat of_a[3], of_b[3];
  const auto split = [](const cv::Mat& picture, cv::Mat* channels) {
    cv::Mat wide;
    picture.convertTo(wide, CV_64F, 1.0, 128.0);
    cv::split(wide, channels);
  };
  split(a, of_a);
  split(b, of_b);
  double sum = 0.0;
  for (int c = 0; c < 3; ++c) sum += ssim_of_channel(of_a[c], of_b[c]);
  return sum / 3.0;
}

RegionDifference region_difference(const cv::Mat& a, const cv::Mat& b, const sensors::ContactCircle& circle) {
  TS_ASSERT(a.type() == CV_32FC3 && b.type() == CV_32FC3 && a.size() == b.size());
  double sums[2] = {0, 0};
  std::int64_t counts[2] = {0, 0};
  for (int v = 0; v < a.rows; ++v) {
    for (int u = 0; u < a.cols; ++u) {
      const double far = (Eigen::Vector2d(u + 0.5, v + 0.5) - circle.centre).norm();
      if (far > 2 * circle.radius) continue;
      const int region = far > circle.radius ? 1 : 0;
      const cv::Vec3f off = a.at<cv::Vec3f>(v, u) - b.at<cv::Vec3f>(v, u);
      sums[region] += std::abs(off[0]) + std::abs(off[1]) + std::abs(off[2]);
      counts[region] += 3;
    }
  }
  const auto mean = [&](int region) {
    return counts[region] > 0 ? sums[region] / static_cast<double>(counts[region]) : 0.0;
  };
  return {mean(0), mean(1)};
}

}  // namespace touchstone::lab
