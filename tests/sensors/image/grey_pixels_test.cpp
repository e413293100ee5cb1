#include "sensors/image/grey_pixels.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/random.h"

namespace touchstone::sensors {
namespace {

/// Values over the whole range, every eighth at its upper end: sums that run over are found out.
template <typename Value>
cv::Mat random_image(RandomStream& random, int width, int height, int channels) {
  cv::Mat image(height, width, CV_MAKETYPE(cv::DataType<Value>::depth, channels));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < channels * width; ++x) {
      image.ptr<Value>(y)[x] = random() % 8 == 0 ? std::numeric_limits<Value>::max() : static_cast<Value>(random());
    }
  }
  return image;
}

TEST(GreyPixels, OfColourAreOpenCvsForEveryCount) {
  RandomStream random(1, 0, Purpose::kTest);
  const cv::Mat colour = random_image<std::uint8_t>(random, 80, 4, 3);
  cv::Mat grey;
  cv::cvtColor(colour, grey, cv::COLOR_BGR2GRAY);
  for (int count = 1; count <= 70; ++count) {
    const int begin = count % 9;
    std::vector<std::uint8_t> ours(static_cast<std::size_t>(count) + 1, 77);
    grey_of_bgr(colour.ptr<std::uint8_t>(2) + 3 * begin, count, ours.data());
    for (int i = 0; i < count; ++i) {
      ASSERT_EQ(ours[static_cast<std::size_t>(i)], grey.at<std::uint8_t>(2, begin + i)) << i << " of " << count;
    }
    EXPECT_EQ(ours.back(), 77) << "written past its end";
  }
}

template <typename Value>
void expect_exact_means(RandomStream& random) {
  for (const int channels : {1, 3}) {
    for (const int width : {1, 5, 31, 32, 33, 96, 220, 640, 30000}) {
      const cv::Mat image = random_image<Value>(random, width + 3, 12, channels);
      for (const cv::Rect& part : {cv::Rect(2, 1, width, 11), cv::Rect(1, 11, width, 1), cv::Rect(3, 0, width, 3)}) {
        std::vector<std::uint64_t> sum(3);
        for (int y = part.y; y < part.y + part.height; ++y) {
          for (int x = 0; x < channels * width; ++x) {
            sum[static_cast<std::size_t>(x % channels)] += image.ptr<Value>(y)[channels * part.x + x];
          }
        }
        const auto mean = [&](std::size_t channel) { return static_cast<double>(sum[channel]) * (1.0 / part.area()); };
        const double expected =
            channels == 1 ? mean(0) : (3735 * mean(0) + 19235 * mean(1) + 9798 * mean(2)) / (1 << 15);
        EXPECT_EQ(mean_grey(image, part), expected) << channels << " channels, " << part;
      }
    }
  }
}

TEST(GreyPixels, MeanIsExactForEverySize) {
  RandomStream random(2, 0, Purpose::kTest);
  expect_exact_means<std::uint8_t>(random);
  expect_exact_means<std::uint16_t>(random);
}

TEST(GreyPixels, MeanOfWhiteDoesNotRunOver) {
  EXPECT_DOUBLE_EQ(mean_grey(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(255)), {0, 0, 640, 480}), 255.0);
  EXPECT_DOUBLE_EQ(mean_grey(cv::Mat(480, 640, CV_16UC1, cv::Scalar::all(65535)), {0, 0, 640, 480}), 65535.0);
}

}  // namespace
}  // namespace touchstone::sensors
