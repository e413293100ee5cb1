#include "sensors/beads/bit_window.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "core/random.h"

namespace touchstone::sensors {
namespace {

BitWindow random_window(RandomStream& random, int width, int height, double density) {
  BitWindow window;
  window.width = width;
  window.height = height;
  for (int y = 0; y < height; ++y) {
    std::uint64_t row = 0;
    for (int x = 0; x < width; ++x) row |= static_cast<std::uint64_t>(random.uniform() < density) << x;
    window.rows[static_cast<std::size_t>(y)] = row;
  }
  return window;
}

cv::Mat to_mat(const BitWindow& window) {
  cv::Mat mat(window.height, window.width, CV_8U);
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) {
      mat.at<std::uint8_t>(y, x) = window.at(x, y) ? std::uint8_t{255} : std::uint8_t{0};
    }
  }
  return mat;
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_INF) == 0.0;
}

const std::pair<int, int> kSizes[] = {{1, 1}, {1, 9}, {9, 1}, {7, 5}, {30, 30}, {63, 20}, {64, 64}};

TEST(BitWindow, OpeningAndClosingAreOpenCvs) {
  RandomStream random(1, 0, Purpose::kTest);
  for (const auto& [width, height] : kSizes) {
    for (const double density : {0.2, 0.5, 0.8, 0.95}) {
      for (const int radius : {1, 2}) {
        const BitWindow window = random_window(random, width, height, density);
        const cv::Mat element = cv::getStructuringElement(cv::MORPH_RECT, {2 * radius + 1, 2 * radius + 1});
        for (const bool opening : {true, false}) {
          BitWindow ours = window;
          opening ? open_regions(ours, radius) : close_regions(ours, radius);
          cv::Mat theirs;
          cv::morphologyEx(to_mat(window), theirs, opening ? cv::MORPH_OPEN : cv::MORPH_CLOSE, element);
          EXPECT_TRUE(same(to_mat(ours), theirs)) << width << "x" << height << " density " << density << " radius "
                                                  << radius << (opening ? " opening" : " closing");
        }
      }
    }
  }
}

TEST(BitWindow, RegionsAreOpenCvsConnectedComponents) {
  RandomStream random(2, 0, Purpose::kTest);
  for (const auto& [width, height] : kSizes) {
    for (const double density : {0.05, 0.3, 0.45, 0.6, 0.9}) {
      BitWindow window = random_window(random, width, height, density);
      cv::Mat labels, stats, centroids;
      const int count = cv::connectedComponentsWithStats(to_mat(window), labels, stats, centroids, 8);
      const cv::Mat all = to_mat(window);
      cv::Mat seen = cv::Mat::zeros(height, width, CV_8U);
      BitWindow region;
      int taken = 0;
      while (take_region(window, region)) {
        ++taken;
        const cv::Mat mask = to_mat(region);
        cv::Point any;
        cv::minMaxLoc(mask, nullptr, nullptr, nullptr, &any);
        const int label = labels.at<int>(any);
        EXPECT_TRUE(same(mask, labels == label));
        const RegionMoments moments = moments_of(region);
        EXPECT_EQ(moments.area, stats.at<int>(label, cv::CC_STAT_AREA));
        EXPECT_NEAR(moments.centroid.x() - 0.5, centroids.at<double>(label, 0), 1e-9);
        EXPECT_NEAR(moments.centroid.y() - 0.5, centroids.at<double>(label, 1), 1e-9);
        seen |= mask;
      }
      EXPECT_EQ(taken, count - 1) << width << "x" << height << " density " << density;
      EXPECT_TRUE(same(seen, all));
    }
  }
}

TEST(BitWindow, SpiralIsOneRegion) {
  const char* picture[] = {"#########", "........#", "#######.#", "#.....#.#", "#.###.#.#",
                           "#.#...#.#", "#.#####.#", "#.......#", "#########"};
  BitWindow window;
  window.width = window.height = 9;
  int pixels = 0;
  for (std::size_t y = 0; y < 9; ++y) {
    window.rows[y] = 0;
    for (std::size_t x = 0; x < 9; ++x) {
      if (picture[y][x] == '#') {
        window.rows[y] |= std::uint64_t{1} << x;
        ++pixels;
      }
    }
  }
  BitWindow region;
  ASSERT_TRUE(take_region(window, region));
  EXPECT_EQ(moments_of(region).area, pixels);
  EXPECT_FALSE(take_region(window, region));
}

TEST(BitWindow, DiscIsRoundAndABarIsNot) {
  BitWindow disc, bar;
  disc.width = disc.height = bar.width = bar.height = 40;
  for (int y = 0; y < 40; ++y) {
    disc.rows[static_cast<std::size_t>(y)] = bar.rows[static_cast<std::size_t>(y)] = 0;
    for (int x = 0; x < 40; ++x) {
      const double r2 = (x - 20.0) * (x - 20.0) + (y - 17.0) * (y - 17.0);
      if (r2 <= 81.0) disc.rows[static_cast<std::size_t>(y)] |= std::uint64_t{1} << x;
      // a bar along the diagonal: the ratio must not depend on direction
      if (std::abs(x - y) <= 2 && x + y >= 20 && x + y <= 60)
        bar.rows[static_cast<std::size_t>(y)] |= std::uint64_t{1} << x;
    }
  }
  EXPECT_NEAR(moments_of(disc).elongation, 1.0, 1e-9);
  EXPECT_GT(moments_of(bar).elongation, 20.0);
}

}  // namespace
}  // namespace touchstone::sensors
