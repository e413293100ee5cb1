#include "sensors/touch_map/height_features.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/sensors/touch_map/drawn_relief.h"

namespace touchstone::sensors {
namespace {

TEST(ReliefDetail, DoesNotSeeDepthTiltOrSag) {
  const fixtures::Surface relief = fixtures::strewn_relief(1);
  const fixtures::Surface sagged = [&](const Eigen::Vector2d& p) {
    return relief(p) + 0.2 + 0.004 * p.x() - 0.003 * p.y() - 0.001 * p.squaredNorm();
  };
  fixtures::Camera still;
  still.noise_mm = 0.0;
  const ReliefDetail a = relief_detail(fixtures::touch_of(relief, {}, 1, still), {});
  const ReliefDetail b = relief_detail(fixtures::touch_of(sagged, {}, 1, still), {});
  // Away from the image's border, where a sloping surface's mean is one-sided.
  const cv::Rect inner(60, 60, 200, 120);
  EXPECT_LT(cv::norm(a.detail_mm(inner), b.detail_mm(inner), cv::NORM_INF), 0.003);
  EXPECT_GT(a.rms_mm, 0.01);
}

TEST(ReliefDetail, UntouchedSurroundingsDoNotLeakIn) {
  // Half the image is out of contact, and whatever stands there must not matter.
  const cv::Size size(200, 100);
  cv::Mat support(size, CV_8UC1, cv::Scalar(0)), height(size, CV_32FC1, cv::Scalar(0.3));
  support.colRange(0, 100).setTo(255);
  cv::Mat other = height.clone();
  other.colRange(100, 200).setTo(-7.0);
  const PixelFrame frame = touch_frame(size, 0.05);
  const ReliefDetail a = relief_detail(height, support, frame, {}), b = relief_detail(other, support, frame, {});
  EXPECT_EQ(cv::norm(a.detail_mm, b.detail_mm, cv::NORM_INF), 0.0);
  EXPECT_LT(cv::norm(a.detail_mm, cv::NORM_INF), 1e-6);
  EXPECT_EQ(a.weight.at<float>(50, 150), 0.0F);
  EXPECT_NEAR(a.weight.at<float>(50, 30), 1.0F, 0.1);
  EXPECT_NEAR(a.weight.at<float>(50, 99), 0.5F, 0.05);
}

TEST(HeightFeatures, StandOnlyWhereTheObjectTouches) {
  TouchImage touch = fixtures::touch_of(fixtures::strewn_relief(2), {}, 1);
  touch.contact.colRange(0, 160).setTo(0);
  DetailSettings settings;
  const HeightFeatures features = HeightFeatureDetector().detect(relief_detail(touch, settings));
  EXPECT_GT(features.points.size(), 40u);
  for (const auto& point : features.points) EXPECT_GT(point.x(), -settings.margin_mm - 0.5 * touch.mm_per_px);
}

TEST(HeightFeatures, NoiseMakesNextToNone) {
  const fixtures::Surface plane = [](const Eigen::Vector2d& p) { return 0.3 + 0.01 * p.x(); };
  const HeightFeatureDetector detector;
  const auto features = [&](const fixtures::Surface& surface) {
    return static_cast<double>(detector.detect(relief_detail(fixtures::touch_of(surface, {}, 1), {})).points.size());
  };
  EXPECT_LT(features(plane), 0.05 * features(fixtures::strewn_relief(2)));
}

TEST(HeightFeatures, TheStrongestAreKept) {
  FeatureSettings few;
  few.most_features = 20;
  const ReliefDetail detail = relief_detail(fixtures::touch_of(fixtures::strewn_relief(2), {}, 1), {});
  EXPECT_EQ(HeightFeatureDetector(few).detect(detail).points.size(), 20u);
}

TEST(HeightFeatures, HammingCountsBits) {
  BinaryDescriptor a{}, b{};
  EXPECT_EQ(hamming_distance(a, b), 0);
  b[0] = 5, b[7] = ~std::uint64_t{0};
  EXPECT_EQ(hamming_distance(a, b), 66);
}

TEST(HeightFeatures, MatchesAreTheNearestUnderTheThreshold) {
  HeightFeatures from, to;
  from.descriptors.resize(1);
  for (const std::uint64_t bits : {0xffu, 0x1u, 0x3u, 0x7u}) {
    to.descriptors.emplace_back();
    to.descriptors.back()[3] = bits;
  }
  const auto found = match(from, to, {.most_bits = 5, .most_partners = 2});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].to, 1);
  EXPECT_EQ(found[0].distance, 1);
  EXPECT_EQ(found[1].to, 2);
  EXPECT_EQ(match(from, to, {.most_bits = 2, .most_partners = 9}).size(), 2u);
  EXPECT_TRUE(match(from, to, {.most_bits = 0, .most_partners = 9}).empty());
}

TEST(HeightFeatures, SettingsOutOfRangeAreRefused) {
  FeatureSettings wrong;
  wrong.threshold = 0;
  EXPECT_THROW(HeightFeatureDetector{wrong}, Error);
  wrong = {};
  wrong.pattern_scale = 100.0;
  EXPECT_THROW(HeightFeatureDetector{wrong}, Error);
}

}  // namespace
}  // namespace touchstone::sensors
