#include "bench/picture_comparison.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::bench {
namespace {

cv::Mat first_channel(const cv::Mat& picture) {
  cv::Mat channel;
  cv::extractChannel(picture, channel, 0);
  return channel;
}

/// Of a few numbers.
struct Moments {
  double mean = 0.0;
  double variance_of_mean = 0.0;
};

Moments moments(const std::vector<double>& values) {
  const double count = static_cast<double>(values.size());
  Moments result;
  for (const double value : values) result.mean += value / count;
  for (const double value : values) {
    result.variance_of_mean += (value - result.mean) * (value - result.mean) / (count * (count - 1.0));
  }
  return result;
}

/// The means of one block in all pictures.
std::vector<double> block_means(const std::vector<cv::Mat>& channels, const cv::Rect& block) {
  std::vector<double> means;
  means.reserve(channels.size());
  for (const cv::Mat& channel : channels) means.push_back(cv::mean(channel(block))[0]);
  return means;
}

std::vector<cv::Mat> first_channels(const std::vector<cv::Mat>& pictures) {
  std::vector<cv::Mat> channels;
  channels.reserve(pictures.size());
  for (const cv::Mat& picture : pictures) channels.push_back(first_channel(picture));
  return channels;
}

double squared(double x) {
  return x * x;
}

}  // namespace

bool PictureComparison::equal() const {
  return std::abs(mean_ratio - 1.0) <= 3.0 * ratio_error &&
         std::abs(mean_square_z - expected_mean_square_z) <= 3.0 * mean_square_z_error;
}

PictureComparison compare_pictures(const std::vector<cv::Mat>& first, const std::vector<cv::Mat>& second, int block) {
  TS_ASSERT(first.size() >= 8 && second.size() >= 8 && block > 0);
  const std::vector<cv::Mat> a = first_channels(first);
  const std::vector<cv::Mat> b = first_channels(second);
  const cv::Rect whole({0, 0}, a.front().size());
  const Moments whole_a = moments(block_means(a, whole));
  const Moments whole_b = moments(block_means(b, whole));
  PictureComparison result;
  result.mean_ratio = whole_b.mean / whole_a.mean;
  result.ratio_error = result.mean_ratio * std::sqrt(whole_a.variance_of_mean / squared(whole_a.mean) +
                                                     whole_b.variance_of_mean / squared(whole_b.mean));
  double variance = 0.0;
  for (int top = 0; top < whole.height; top += block) {
    for (int left = 0; left < whole.width; left += block) {
      const cv::Rect place = cv::Rect(left, top, block, block) & whole;
      const Moments in_a = moments(block_means(a, place));
      const Moments in_b = moments(block_means(b, place));
      const double both = in_a.variance_of_mean + in_b.variance_of_mean;
      if (!(both > 0.0)) continue;
      // Welch's degrees of freedom; z^2 is then F(1, freedom).
      const double freedom = squared(both) / (squared(in_a.variance_of_mean) / (static_cast<double>(a.size()) - 1.0) +
                                              squared(in_b.variance_of_mean) / (static_cast<double>(b.size()) - 1.0));
      const double z2 = squared(in_a.mean - in_b.mean) / both;
      ++result.blocks;
      result.mean_square_z += z2;
      result.expected_mean_square_z += freedom / (freedom - 2.0);
      variance += 2.0 * squared(freedom) * (freedom - 1.0) / (squared(freedom - 2.0) * (freedom - 4.0));
      result.largest_z = std::max(result.largest_z, std::sqrt(z2));
    }
  }
  if (result.blocks == 0) fail("no block of the pictures has any light");
  result.mean_square_z /= result.blocks;
  result.expected_mean_square_z /= result.blocks;
  result.mean_square_z_error = std::sqrt(variance) / result.blocks;
  return result;
}

double relative_noise(const std::vector<cv::Mat>& pictures) {
  TS_ASSERT(pictures.size() >= 2);
  const double count = static_cast<double>(pictures.size());
  cv::Mat sum = cv::Mat::zeros(pictures.front().size(), CV_64FC1);
  cv::Mat squares = sum.clone();
  for (const cv::Mat& picture : pictures) {
    cv::Mat channel;
    first_channel(picture).convertTo(channel, CV_64F);
    sum += channel;
    squares += channel.mul(channel);
  }
  const cv::Mat variance = (squares - sum.mul(sum) / count) / (count - 1.0);
  return std::sqrt(std::max(0.0, cv::mean(variance)[0])) / (cv::mean(sum)[0] / count);
}

}  // namespace touchstone::bench
