// A residual map learned from a few presses knows what is missing in others.

#include "lab/likeness/residual_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/random.h"
#include "sim/sensor/residual_light.h"
#include "tests/support/message_of.h"

namespace touchstone::lab {
namespace {

using test::message_of;
using ::testing::HasSubstr;

constexpr int kWidth = 120, kHeight = 90;
constexpr double kMmPerPx = 0.1;
constexpr double kRadius_mm = 2.0;

/// A ball's cap with a sunk rim around it.
cv::Mat ball_dent(double u, double v, double depth_mm) {
  cv::Mat height(kHeight, kWidth, CV_32F);
  const double contact = std::sqrt(kRadius_mm * kRadius_mm - std::pow(kRadius_mm - 0.6 * depth_mm, 2));
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const double far = kMmPerPx * std::hypot(column + 0.5 - u, row + 0.5 - v);
      const double rim = depth_mm - kRadius_mm + std::sqrt(kRadius_mm * kRadius_mm - contact * contact);
      height.at<float>(row, column) =
          static_cast<float>(far < contact ? depth_mm - kRadius_mm + std::sqrt(kRadius_mm * kRadius_mm - far * far)
                                           : rim * std::exp(-(far - contact) / 0.9));
    }
  }
  return height;
}

/// What a device is missing: colours of a slope, a shadow that goes with depth, and a halo of the dent's neighbourhood.
cv::Mat missing_in(const cv::Mat& height) {
  cv::Mat wide, u, v;
  cv::GaussianBlur(height, wide, {0, 0}, 1.0 / kMmPerPx);
  cv::Sobel(height, u, CV_32F, 1, 0, 3, 1.0 / (8 * kMmPerPx));
  cv::Sobel(height, v, CV_32F, 0, 1, 3, 1.0 / (8 * kMmPerPx));
  cv::Mat missing(height.size(), CV_32FC3);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const float slope_u = u.ptr<float>()[i], slope_v = v.ptr<float>()[i];
    missing.ptr<cv::Vec3f>()[i] = {25.0f * std::tanh(slope_u), -18.0f * std::tanh(slope_v) - 10.0f * slope_u * slope_u,
                                   30.0f * wide.ptr<float>()[i] - 12.0f * height.ptr<float>()[i]};
  }
  return missing;
}

ResidualSample sample_of(int number, double noise_DN) {
  RandomStream random(7, static_cast<std::uint64_t>(number), Purpose::kTest);
  const auto between = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  ResidualSample sample;
  sample.name = "press " + std::to_string(number);
  const double u = between(45, 75), v = between(35, 55), depth = between(0.6, 1.3);
  sample.height = ball_dent(u, v, depth);
  sample.missing = missing_in(sample.height);
  sample.saturated = cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(0));
  for (int i = 0; i < kWidth * kHeight; ++i) {
    for (int c = 0; c < 3; ++c) {
      sample.missing.ptr<cv::Vec3f>()[i][c] += static_cast<float>(noise_DN * random.normal());
    }
  }
  return sample;
}

std::vector<ResidualSample> samples_of(int count, double noise_DN) {
  std::vector<ResidualSample> samples;
  for (int i = 0; i < count; ++i) samples.push_back(sample_of(i, noise_DN));
  return samples;
}

double rms(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L2) / std::sqrt(3.0 * static_cast<double>(a.total()));
}

TEST(ResidualFit, KnownMissingLightIsRecoveredOnPressesNotShown) {
  const ResidualFit fit = fit_residual(samples_of(6, 1.5), kMmPerPx, "six drawn dents");
  EXPECT_EQ(fit.map.presses, 6);
  ASSERT_EQ(fit.left_out.size(), 6U);
  for (int number = 100; number < 105; ++number) {
    const ResidualSample other = sample_of(number, 0.0);
    const double before = rms(other.missing, cv::Mat::zeros(other.missing.size(), CV_32FC3));
    const double after = rms(other.missing, sim::residual_numbers(fit.map, other.height));
    EXPECT_LT(after, 0.2 * before) << number;
  }
  // The left-out figure says how good it is on others: noise and what isn't recovered.
  EXPECT_GT(fit.map.left_out_after_DN, 1.4);
  EXPECT_LT(fit.map.left_out_after_DN, 2.2);
  const cv::Mat rest = cv::Mat::zeros(kHeight, kWidth, CV_32F);
  EXPECT_EQ(cv::norm(sim::residual_numbers(fit.map, rest), cv::NORM_INF), 0.0);
}

TEST(ResidualFit, NoiseAloneTeachesNothing) {
  std::vector<ResidualSample> samples = samples_of(6, 1.5);
  for (ResidualSample& sample : samples) sample.missing -= missing_in(sample.height);
  const ResidualFit fit = fit_residual(samples, kMmPerPx, "noise");
  const ResidualSample other = sample_of(200, 0.0);
  EXPECT_LT(rms(sim::residual_numbers(fit.map, other.height), cv::Mat::zeros(kHeight, kWidth, CV_32FC3)), 0.3);
}

TEST(ResidualFit, WhatIsSaturatedIsALowerBound) {
  constexpr float kMost = 8.0f;  // what the recorded numbers can show of the first colour
  std::vector<ResidualSample> samples = samples_of(6, 0.5);
  for (std::size_t i = 1; i < samples.size(); i += 2) {  // the deepest three; another one shows how bright
    for (int k = 0; k < kWidth * kHeight; ++k) {
      float& number = samples[i].missing.ptr<cv::Vec3f>()[k][0];
      if (number <= kMost) continue;
      number = kMost;
      samples[i].saturated.ptr<cv::Vec3b>()[k][0] = 255;
    }
  }
  std::vector<ResidualSample> taken_as_known = samples;
  // A picture of its own: copies of a cv::Mat share their pixels, and zeros() would write into them.
  for (ResidualSample& sample : taken_as_known) sample.saturated = cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(0));
  // How far off the first colour is where the clipped presses couldn't show it, over ten presses of all depths.
  const auto off = [&](const std::vector<ResidualSample>& learned) {
    const sim::ResidualMap map = fit_residual(learned, kMmPerPx, "").map;
    double squares = 0.0;
    int pixels = 0;
    for (int number = 300; number < 310; ++number) {
      const ResidualSample other = sample_of(number, 0.0);
      const cv::Mat found = sim::residual_numbers(map, other.height);
      for (int k = 0; k < kWidth * kHeight; ++k) {
        const float missing = other.missing.ptr<cv::Vec3f>()[k][0];
        if (missing <= kMost) continue;
        squares += std::pow(found.ptr<cv::Vec3f>()[k][0] - missing, 2);
        ++pixels;
      }
    }
    return std::sqrt(squares / pixels);
  };
  EXPECT_LT(off(samples), 0.3 * off(taken_as_known));  // 0.19
}

TEST(ResidualFit, TooFewPressesOrNoneAreNamed) {
  EXPECT_THAT(message_of([] { fit_residual(samples_of(2, 1.0), kMmPerPx, ""); }),
              HasSubstr("2 presses to learn from; at least 3 are needed"));
  std::vector<ResidualSample> untouched = samples_of(3, 1.0);
  for (ResidualSample& sample : untouched) sample.height.setTo(0);
  EXPECT_THAT(message_of([&] { fit_residual(untouched, kMmPerPx, ""); }), HasSubstr("nothing is pressed"));
}

}  // namespace
}  // namespace touchstone::lab
