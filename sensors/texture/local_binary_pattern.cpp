#include "sensors/texture/local_binary_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr int kSteps = 256;  // of a pixel: bilinear weights are then multiples of 2^-16, and sums of 8 bit pixels exact

/// One of the four pixels round a neighbour's place. What turns the place by 90 degrees turns each of them.
struct Tap {
  int dx = 0;
  int dy = 0;
  float weight = 0.0F;
};

struct Neighbour {
  std::array<Tap, 4> taps;
  bool on_pixel = false;  // the first tap is all
};

Neighbour neighbour_at(double x, double y) {
  const long steps_x = std::lround(x * kSteps);
  const long steps_y = std::lround(y * kSteps);
  const int left = static_cast<int>(std::floor(static_cast<double>(steps_x) / kSteps));
  const int top = static_cast<int>(std::floor(static_cast<double>(steps_y) / kSteps));
  const int right_share = static_cast<int>(steps_x) - left * kSteps;
  const int low_share = static_cast<int>(steps_y) - top * kSteps;
  const auto tap = [&](int i, int j) {
    const int share = (i == 1 ? right_share : kSteps - right_share) * (j == 1 ? low_share : kSteps - low_share);
    return Tap{left + i, top + j, static_cast<float>(share) / (kSteps * kSteps)};
  };
  Neighbour result{{tap(0, 0), tap(1, 0), tap(0, 1), tap(1, 1)}, right_share == 0 && low_share == 0};
  for (Tap& one : result.taps) {
    if (one.weight == 0.0F) one = {left, top, 0.0F};  // it may stand outside of the image
  }
  return result;
}

Neighbour turned(const Neighbour& neighbour) {
  Neighbour result = neighbour;
  for (Tap& tap : result.taps) tap = {-tap.dy, tap.dx, tap.weight};
  return result;
}

std::vector<Neighbour> neighbours_of(const LbpCircle& circle) {
  const int count = circle.neighbours;
  // Cosines of 90 degrees come out exact if one quarter is computed and the others are turned.
  const int quarter = count % 4 == 0 ? count / 4 : count;
  std::vector<Neighbour> result;
  for (int p = 0; p < count; ++p) {
    if (p >= quarter) {
      result.push_back(turned(result[p - quarter]));
    } else {
      const double angle = 2.0 * std::numbers::pi * p / count;
      result.push_back(neighbour_at(circle.radius_px * std::cos(angle), circle.radius_px * std::sin(angle)));
    }
  }
  return result;
}

void check_gray(const cv::Mat& gray, int margin) {
  if (gray.empty()) fail("the gray image is empty");
  if (gray.dims != 2 || gray.type() != CV_8UC1) {
    fail("the gray image has {} channels of depth {}; 1 channel of 8 bit is needed", gray.channels(), gray.depth());
  }
  const int needed = 2 * margin + 1;
  if (gray.cols < needed || gray.rows < needed) {
    fail("the image is {} x {} px; patterns with this radius need at least {} x {}", gray.cols, gray.rows, needed,
         needed);
  }
}

}  // namespace

void check(const LbpCircle& circle) {
  if (circle.neighbours < kFewestNeighbours || circle.neighbours > kMostNeighbours) {
    fail("{} neighbours on the circle; from {} to {} are allowed", circle.neighbours, kFewestNeighbours,
         kMostNeighbours);
  }
  if (!(circle.radius_px >= 1.0 && circle.radius_px <= kLargestLbpRadius)) {
    fail("the circle's radius is {} px; it must be from 1 to {}", circle.radius_px, kLargestLbpRadius);
  }
}

int lbp_margin(const LbpCircle& circle) {
  // A radius is looked up to the same fraction of a pixel as any other place.
  return static_cast<int>(std::ceil(static_cast<double>(std::lround(circle.radius_px * kSteps)) / kSteps));
}

cv::Mat lbp_labels(const cv::Mat& gray, const LbpCircle& circle) {
  check(circle);
  const int margin = lbp_margin(circle);
  check_gray(gray, margin);
  const std::vector<Neighbour> neighbours = neighbours_of(circle);
  cv::Mat brightness;
  gray.convertTo(brightness, CV_32F);
  const int columns = gray.cols - 2 * margin;
  const int rows = gray.rows - 2 * margin;
  cv::Mat labels(rows, columns, CV_8UC1);
  std::vector<int> ones(columns), changes(columns), last(columns), first(columns);
  for (int j = 0; j < rows; ++j) {
    std::fill(ones.begin(), ones.end(), 0);
    std::fill(changes.begin(), changes.end(), 0);
    const float* centre = brightness.ptr<float>(j + margin) + margin;
    for (std::size_t p = 0; p < neighbours.size(); ++p) {
      const std::array<Tap, 4>& taps = neighbours[p].taps;
      const auto row = [&](const Tap& tap) { return brightness.ptr<float>(j + margin + tap.dy) + margin + tap.dx; };
      const float *a = row(taps[0]), *b = row(taps[1]), *c = row(taps[2]), *d = row(taps[3]);
      const float wa = taps[0].weight, wb = taps[1].weight, wc = taps[2].weight, wd = taps[3].weight;
      int *const one = ones.data(), *const change = changes.data(), *const before = last.data();
      const auto take = [&](int i, float value) {
        const int bit = value >= centre[i] ? 1 : 0;
        one[i] += bit;
        change[i] += bit ^ before[i];
        before[i] = bit;
      };
      if (neighbours[p].on_pixel) {
        for (int i = 0; i < columns; ++i) take(i, a[i]);
      } else {
        for (int i = 0; i < columns; ++i) take(i, wa * a[i] + wb * b[i] + wc * c[i] + wd * d[i]);
      }
      if (p == 0) {  // nothing stood before the first bit: the circle is closed after the last
        std::fill(changes.begin(), changes.end(), 0);
        first = last;
      }
    }
    auto* label = labels.ptr<std::uint8_t>(j);
    for (int i = 0; i < columns; ++i) {
      const int turns = changes[i] + (first[i] ^ last[i]);
      label[i] = static_cast<std::uint8_t>(turns <= 2 ? ones[i] : circle.neighbours + 1);
    }
  }
  return labels;
}

std::vector<std::uint32_t> lbp_histogram(const cv::Mat& gray, const LbpCircle& circle) {
  const cv::Mat labels = lbp_labels(gray, circle);
  std::vector<std::uint32_t> histogram(circle.neighbours + 2, 0);
  for (int j = 0; j < labels.rows; ++j) {
    const auto* row = labels.ptr<std::uint8_t>(j);
    for (int i = 0; i < labels.cols; ++i) ++histogram[row[i]];
  }
  return histogram;
}

}  // namespace touchstone::sensors
