#include "sensors/beads/bead_window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "core/random.h"
#include "sensors/image/grey_pixels.h"
#include "tests/sensors/beads/rendered_beads.h"

namespace touchstone::sensors {
namespace {

using fixtures::BeadPainter;
using fixtures::BeadPicture;

GreyWindow window_of(const cv::Mat& grey) {
  GreyWindow window;
  window.width = grey.cols;
  window.height = grey.rows;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      window.grey[static_cast<std::size_t>(y * grey.cols + x)] = grey.at<std::uint8_t>(y, x);
    }
  }
  return window;
}

cv::Mat noise_image(RandomStream& random, int width, int height, double mean, double deviation) {
  cv::Mat image(height, width, CV_8U);
  for (auto& value : cv::Mat_<std::uint8_t>(image)) {
    value = cv::saturate_cast<std::uint8_t>(mean + deviation * random.normal());
  }
  return image;
}

std::vector<ValueCount> histogram_of(const cv::Mat& image) {
  std::array<int, 256> counts{};
  for (const auto value : cv::Mat_<std::uint8_t>(image)) ++counts[value];
  std::vector<ValueCount> histogram;
  for (int value = 0; value < 256; ++value) {
    const int count = counts[static_cast<std::size_t>(value)];
    if (count > 0) histogram.push_back({value, count});
  }
  return histogram;
}

TEST(Otsu, PartsPixelsAsOpenCvDoes) {
  RandomStream random(1, 0, Purpose::kTest);
  for (int trial = 0; trial < 200; ++trial) {
    cv::Mat image = noise_image(random, 30, 30, 40.0 + 150.0 * random.uniform(), 2.0 + 20.0 * random.uniform());
    const int bead = static_cast<int>(25 * random.uniform());
    if (bead > 3) {
      noise_image(random, bead, bead, 255.0 * random.uniform(), 5.0).copyTo(image(cv::Rect(2, 3, bead, bead)));
    }
    const std::vector<ValueCount> histogram = histogram_of(image);
    const auto ours = otsu_threshold(histogram);
    ASSERT_TRUE(ours.has_value());
    cv::Mat theirs;
    cv::threshold(image, theirs, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
    EXPECT_EQ(cv::norm(theirs, image > histogram[*ours].value, cv::NORM_INF), 0.0) << "trial " << trial;
  }
}

TEST(Otsu, OneValueHasNoThreshold) {
  EXPECT_FALSE(otsu_threshold({}).has_value());
  EXPECT_FALSE(otsu_threshold(histogram_of(cv::Mat(30, 30, CV_8U, cv::Scalar(77)))).has_value());
}

TEST(BrightnessScale, GreyOfColourIsOpenCvs) {
  RandomStream random(2, 0, Purpose::kTest);
  for (const int depth : {CV_8U, CV_16U}) {
    cv::Mat colour(20, 33, CV_MAKETYPE(depth, 3));
    const double full = depth == CV_8U ? 255.0 : 65535.0;
    for (int y = 0; y < colour.rows; ++y) {
      for (int x = 0; x < 3 * colour.cols; ++x) {
        const double value = std::floor((full + 1.0) * random.uniform());
        if (depth == CV_8U) {
          colour.ptr<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(value);
        } else {
          colour.ptr<std::uint16_t>(y)[x] = static_cast<std::uint16_t>(value);
        }
      }
    }
    cv::Mat grey;
    cv::cvtColor(colour, grey, cv::COLOR_BGR2GRAY);
    const double factor = depth == CV_8U ? 1.0 : 1.0 / 257.0;
    BrightnessScale scale;
    scale.set(factor);
    std::array<std::uint8_t, 33> row;
    for (int y = 0; y < colour.rows; ++y) {
      scale.read(colour, 0, y, 1, colour.cols, row.data());
      for (int x = 0; x < colour.cols; ++x) {
        const double value = depth == CV_8U ? grey.at<std::uint8_t>(y, x) : grey.at<std::uint16_t>(y, x);
        EXPECT_EQ(row[static_cast<std::size_t>(x)], static_cast<int>(factor * value + 0.5));
      }
    }
    EXPECT_NEAR(mean_grey(colour, {0, 0, 33, 20}) / full, cv::mean(grey)[0] / full, 0.002);
  }
}

/// Steps iii to vii of [VisioHaptic2024, sec. 3.2], spelled out with OpenCV's own functions.
Eigen::Vector2d plain_pipeline(const cv::Mat& grey, double contrast) {
  const double mean = cv::mean(grey)[0];
  cv::Mat enhanced;
  grey.convertTo(enhanced, CV_8U, -contrast, contrast * mean);
  cv::Mat binary;
  cv::threshold(enhanced, binary, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
  const cv::Mat element = cv::getStructuringElement(cv::MORPH_RECT, {3, 3});
  cv::morphologyEx(binary, binary, cv::MORPH_OPEN, element);
  cv::morphologyEx(binary, binary, cv::MORPH_CLOSE, element);
  const cv::Moments moments = cv::moments(binary, true);
  return {moments.m10 / moments.m00 + 0.5, moments.m01 / moments.m00 + 0.5};
}

TEST(MeasureBead, IsTheTextsPipelineWhereOneBeadIsSeen) {
  RandomStream random(3, 0, Purpose::kTest);
  BeadTrackerSettings settings;
  for (int trial = 0; trial < 100; ++trial) {
    const double radius = 5.0 + 5.0 * random.uniform();
    BeadPainter painter({.width = 30, .height = 30, .radius_px = radius, .noise = 2.0},
                        static_cast<std::uint64_t>(trial));
    const Eigen::Vector2d bead(15.0 + 4.0 * (random.uniform() - 0.5), 15.0 + 4.0 * (random.uniform() - 0.5));
    const cv::Mat image = painter.paint({bead});
    const auto measured = measure_bead(window_of(image), {settings, {15.0, 15.0}, 0.0, false});
    ASSERT_TRUE(measured.has_value());
    const Eigen::Vector2d plain = plain_pipeline(image, settings.contrast);
    EXPECT_NEAR((measured->centroid - plain).norm(), 0.0, 1e-9) << "trial " << trial;
  }
}

TEST(MeasureBead, OfSeveralRegionsTheNearestIsTaken) {
  BeadPainter painter({.width = 60, .height = 60, .radius_px = 6.0});
  const std::vector<Eigen::Vector2d> beads = {{16.3, 20.1}, {44.6, 38.2}};
  const GreyWindow window = window_of(painter.paint(beads));
  BeadTrackerSettings settings;
  settings.roi_b_px = 60;
  settings.roi_a_px = 180;
  for (const Eigen::Vector2d& bead : beads) {
    const auto measured = measure_bead(window, {settings, bead + Eigen::Vector2d(3.0, -2.0), 0.0, false});
    ASSERT_TRUE(measured.has_value());
    EXPECT_LT((measured->centroid - bead).norm(), 0.15);
  }
}

TEST(MeasureBead, NoiseShadeAndLinesAreNoBead) {
  RandomStream random(4, 0, Purpose::kTest);
  BeadTrackerSettings settings;
  int taken = 0;
  const auto compare = [&](const cv::Mat& image) {
    const auto found = measure_bead(window_of(image), {settings, {15.0, 15.0}, 0.0, false});
    if (found && !found->cut) ++taken;  // what is cut is measured again by the tracker, and refused if it stays so
  };
  for (int trial = 0; trial < 200; ++trial) {
    compare(noise_image(random, 30, 30, 150.0, 20.0 * random.uniform()));
    cv::Mat ramp(30, 30, CV_8U);
    const double slope_x = 6.0 * (random.uniform() - 0.5);
    const double slope_y = 6.0 * (random.uniform() - 0.5);
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 30; ++x) {
        ramp.at<std::uint8_t>(y, x) =
            cv::saturate_cast<std::uint8_t>(150 + slope_x * (x - 15) + slope_y * (y - 15) + 2.0 * random.normal());
      }
    }
    compare(ramp);
    cv::Mat line = noise_image(random, 30, 30, 150.0, 2.0);
    const int column = 3 + static_cast<int>(20 * random.uniform());
    noise_image(random, 4, 22, 40.0, 2.0).copyTo(line(cv::Rect(column, 4, 4, 22)));
    compare(line);
  }
  EXPECT_EQ(taken, 0);
}

TEST(MeasureBead, BeadOnADarkEdgeComesApartFromIt) {
  // Half of what is behind the bead is half dark, as at the rim of an object that touches: one threshold joins the two.
  BeadPainter painter({.width = 30, .height = 30, .background = 160.0, .bead = 20.0, .radius_px = 6.0, .texture = 1.0});
  cv::Mat image = painter.paint({{15.2, 14.7}});
  for (int y = 0; y < 30; ++y) {
    for (int x = 16; x < 30; ++x) {
      auto& value = image.at<std::uint8_t>(y, x);
      value = std::min<std::uint8_t>(value, 70);
    }
  }
  BeadTrackerSettings settings;
  const auto measured = measure_bead(window_of(image), {settings, {15.0, 15.0}, 113.0, false});
  ASSERT_TRUE(measured.has_value());
  EXPECT_LT((measured->centroid - Eigen::Vector2d(15.2, 14.7)).norm(), 0.5);
}

TEST(MeasureBead, ARimNearlyAsDarkDoesNotCarryTheBeadAway) {
  // A blurred bead of depth 0.9 beside the slope round a pressed probe, a blurred line of depth 0.7 that ends at it.
  BeadTrackerSettings settings;
  RandomStream random(5, 0, Purpose::kTest);
  const Eigen::Vector2d bead(15.2, 14.7);
  double worst = 0.0;
  for (const double beside : {2.0, 4.0, 6.0}) {
    for (int angle = 0; angle < 12; ++angle) {
      const Eigen::Vector2d along(std::cos(angle * std::numbers::pi / 6.0), std::sin(angle * std::numbers::pi / 6.0));
      cv::Mat image(30, 30, CV_8U);
      for (int y = 0; y < 30; ++y) {
        for (int x = 0; x < 30; ++x) {
          const Eigen::Vector2d at = Eigen::Vector2d(x + 0.5, y + 0.5) - bead;
          const double across = (along.x() * at.y() - along.y() * at.x() - beside) / 3.5;
          const double end = 0.5 + 0.5 * std::tanh(at.dot(along) / 3.0);
          const double through =
              (1.0 - 0.9 * std::exp(-at.squaredNorm() / 40.0)) * (1.0 - 0.7 * end * std::exp(-across * across));
          image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(170.0 * through + 2.0 * random.normal());
        }
      }
      const auto measured = measure_bead(window_of(image), {settings, {15.0, 15.0}, 110.0, false});
      ASSERT_TRUE(measured.has_value()) << "line " << beside << " px beside it, at " << 30 * angle << " degrees";
      EXPECT_FALSE(measured->cut);
      worst = std::max(worst, (measured->centroid - bead).norm());
    }
  }
  EXPECT_LT(worst, 2.0);  // of a bead 13 px wide
}

}  // namespace
}  // namespace touchstone::sensors
