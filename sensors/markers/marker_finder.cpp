#include "sensors/markers/marker_finder.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kWeighedMargin_px = 1;     ///< round a blob's pixels: the rim that the threshold cut off
constexpr int kBackgroundMargin_px = 3;  ///< up to here the background is fitted
constexpr int kLeastBackground_px = 8;   ///< fewer pixels don't hold a plane

void check_range(const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high)) fail("marker {} is {}, it must be from {} to {}", name, value, low, high);
}

}  // namespace

MarkerFinder::MarkerFinder(const MarkerAppearance& appearance) : appearance_(appearance) {
  check_range("diameter_px", appearance.diameter_px, 2.0, 256.0);
  check_range("spacing_px", appearance.spacing_px, appearance.diameter_px, 1024.0);
  check_range("darkness", appearance.darkness, 0.1, 0.99);
  check_range("least_difference", appearance.least_difference, 0.0, 255.0);
  check_range("least_area", appearance.least_area, 0.0, 1.0);
  blobs_.reserve(kMostBlobs);
}

const char* name_of(MarkerPolarity polarity) {
  return polarity == MarkerPolarity::kDark ? "dark" : "bright";
}

bool is_compact(const MarkerBlob& blob) {
  constexpr int kMostAspect = 2;
  constexpr double kLeastFilled = 0.45;  // of the box round it; a disc has 0.79, a square on its corner 0.5
  const int width = blob.right - blob.left + 1;
  const int height = blob.bottom - blob.top + 1;
  return std::max(width, height) <= kMostAspect * std::min(width, height) + 1 &&
         blob.area_px >= kLeastFilled * width * height;
}

FrameLight marker_brightness(const cv::Mat& image, cv::Mat& brightness) {
  if (image.empty()) fail("markers: the picture is empty");
  if (image.type() != CV_8UC1 && image.type() != CV_8UC3) {
    fail("markers: the picture has {} channels of depth {}, 8 bit grey or BGR is needed", image.channels(),
         image.depth());
  }
  brightness.create(image.rows, image.cols, CV_8UC1);
  std::uint8_t low = 255, high = 0;
  std::int64_t sum = 0;
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* in = image.ptr<std::uint8_t>(y);
    std::uint8_t* out = brightness.ptr<std::uint8_t>(y);
    std::int64_t row_sum = 0;
    for (int x = 0; x < image.cols; ++x) {
      const std::uint8_t value = image.channels() == 3 ? std::max({in[3 * x], in[3 * x + 1], in[3 * x + 2]}) : in[x];
      out[x] = value;
      row_sum += value;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    sum += row_sum;
  }
  const FrameLight light =
      light_of_mean(static_cast<double>(sum) / (255.0 * static_cast<double>(image.rows) * image.cols));
  return light == FrameLight::kNormal && low == high ? FrameLight::kFlat : light;
}

const std::vector<MarkerBlob>& MarkerFinder::find(const cv::Mat& image) {
  if (image.empty()) fail("markers: the picture is empty");
  if (image.cols < appearance_.spacing_px || image.rows < appearance_.spacing_px) {
    fail("markers: the picture is {} x {} px, smaller than their spacing of {} px", image.cols, image.rows,
         appearance_.spacing_px);
  }
  if (width_ != 0 && (image.cols != width_ || image.rows != height_)) {
    fail("markers: the picture is {} x {} px, the first one was {} x {}", image.cols, image.rows, width_, height_);
  }
  light_ = marker_brightness(image, brightness_);
  blobs_.clear();
  last_label_ = 0;
  make_room(image);
  if (light_ != FrameLight::kNormal) return blobs_;
  if (appearance_.polarity == MarkerPolarity::kDark) {
    mark_dark_pixels();
  } else {
    mark_bright_pixels();
  }
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      if (label_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)] != -1) {
        continue;
      }
      take_blob(x, y);
      if (blobs_.size() == kMostBlobs) return blobs_;
    }
  }
  return blobs_;
}

void MarkerFinder::make_room(const cv::Mat& image) {
  width_ = image.cols;
  height_ = image.rows;
  const std::size_t pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  label_.resize(pixels);
  stack_.resize(pixels);
  column_sum_.resize(static_cast<std::size_t>(width_));
  limit_.resize(static_cast<std::size_t>(width_));
}

void MarkerFinder::mark_dark_pixels() {
  gel_.read(brightness_, appearance_.diameter_px);
  const auto darkness = static_cast<float>(appearance_.darkness);
  const auto least_difference = static_cast<float>(appearance_.least_difference);
  for (int y = 0; y < height_; ++y) {
    if (y % gel_.block_px() == 0) {
      const std::uint8_t* gel = gel_.row(y);
      for (int x = 0; x < width_; ++gel) {
        // What is dark is below both; a whole number is if it's below the next whole one.
        const float most = std::min(darkness * *gel, *gel - least_difference);
        const auto limit = static_cast<std::uint8_t>(std::ceil(std::max(most, 0.0f)));
        for (const int end = std::min(x + gel_.block_px(), width_); x < end; ++x)
          limit_[static_cast<std::size_t>(x)] = limit;
      }
    }
    const std::uint8_t* row = brightness_.ptr<std::uint8_t>(y);
    std::int32_t* label = label_.data() + static_cast<std::ptrdiff_t>(y) * static_cast<std::ptrdiff_t>(width_);
    const std::uint8_t* limit = limit_.data();
    for (int x = 0; x < width_; ++x) label[x] = row[x] < limit[x] ? -1 : 0;
  }
}

void MarkerFinder::mark_bright_pixels() {
  // The window's mean by running sums: of columns over rows, then of those along the row.
  const int reach = static_cast<int>(std::lround(0.75 * appearance_.spacing_px));
  const auto add_row = [&](int y, int sign) {
    const std::uint8_t* row = brightness_.ptr<std::uint8_t>(y);
    for (int x = 0; x < width_; ++x) column_sum_[static_cast<std::size_t>(x)] += sign * row[x];
  };
  const auto darkness = static_cast<float>(appearance_.darkness);
  const auto least_difference = static_cast<float>(appearance_.least_difference);
  std::fill(column_sum_.begin(), column_sum_.end(), 0);
  for (int y = 0; y < std::min(reach, height_); ++y) add_row(y, 1);
  for (int y = 0; y < height_; ++y) {
    if (y + reach < height_) add_row(y + reach, 1);
    if (y - reach - 1 >= 0) add_row(y - reach - 1, -1);
    const int rows = std::min(y + reach, height_ - 1) - std::max(y - reach, 0) + 1;
    const std::uint8_t* row = brightness_.ptr<std::uint8_t>(y);
    std::int32_t* label = label_.data() + static_cast<std::ptrdiff_t>(y) * static_cast<std::ptrdiff_t>(width_);
    std::int32_t window = 0;
    for (int x = 0; x < std::min(reach, width_); ++x) window += column_sum_[static_cast<std::size_t>(x)];
    for (int x = 0; x < width_; ++x) {
      if (x + reach < width_) window += column_sum_[static_cast<std::size_t>(x + reach)];
      if (x - reach - 1 >= 0) window -= column_sum_[static_cast<std::size_t>(x - reach - 1)];
      const int columns = std::min(x + reach, width_ - 1) - std::max(x - reach, 0) + 1;
      const float mean = static_cast<float>(window) / static_cast<float>(rows * columns);
      const float value = row[x];
      label[x] = mean < darkness * value && value - mean >= least_difference ? -1 : 0;
    }
  }
}

void MarkerFinder::take_blob(int x0, int y0) {
  const std::int32_t label = ++last_label_;
  MarkerBlob blob;
  blob.left = blob.right = x0;
  blob.top = blob.bottom = y0;
  std::size_t waiting = 0;
  const std::int32_t first = y0 * width_ + x0;
  stack_[waiting++] = first;
  label_[static_cast<std::size_t>(first)] = label;
  while (waiting > 0) {
    const std::int32_t pixel = stack_[--waiting];
    const int x = pixel % width_;
    const int y = pixel / width_;
    ++blob.area_px;
    blob.left = std::min(blob.left, x);
    blob.right = std::max(blob.right, x);
    blob.top = std::min(blob.top, y);
    blob.bottom = std::max(blob.bottom, y);
    for (int ny = std::max(y - 1, 0); ny <= std::min(y + 1, height_ - 1); ++ny) {
      for (int nx = std::max(x - 1, 0); nx <= std::min(x + 1, width_ - 1); ++nx) {
        const std::int32_t next = ny * width_ + nx;
        if (label_[static_cast<std::size_t>(next)] != -1) continue;
        label_[static_cast<std::size_t>(next)] = label;
        stack_[waiting++] = next;
      }
    }
  }
  if (blob.area_px < appearance_.least_area * 0.25 * kPi * appearance_.diameter_px * appearance_.diameter_px) return;
  blob.at_border = blob.left == 0 || blob.top == 0 || blob.right == width_ - 1 || blob.bottom == height_ - 1;
  blob.centroid = weighted_centroid(blob, label);
  blobs_.push_back(blob);
}

Eigen::Vector2d MarkerFinder::weighted_centroid(const MarkerBlob& blob, std::int32_t label) const {
  const double middle_x = 0.5 * (blob.left + blob.right);
  const double middle_y = 0.5 * (blob.top + blob.bottom);
  const auto for_pixels = [&](int margin, auto&& use) {
    for (int y = std::max(blob.top - margin, 0); y <= std::min(blob.bottom + margin, height_ - 1); ++y) {
      const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
      for (int x = std::max(blob.left - margin, 0); x <= std::min(blob.right + margin, width_ - 1); ++x) {
        const std::size_t pixel = row + static_cast<std::size_t>(x);
        use(x, y, label_[pixel], static_cast<double>(brightness_.at<std::uint8_t>(y, x)));
      }
    }
  };
  const auto is_inside = [&](int x, int y, int margin) {
    return x >= blob.left - margin && x <= blob.right + margin && y >= blob.top - margin && y <= blob.bottom + margin;
  };

  // Under other markers' pixels nothing is known of the background.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for_pixels(kBackgroundMargin_px, [&](int x, int y, std::int32_t owner, double value) {
    if (owner != 0 || is_inside(x, y, kWeighedMargin_px)) return;
    const Eigen::Vector3d terms(1.0, x - middle_x, y - middle_y);
    normal += terms * terms.transpose();
    right += value * terms;
  });
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();
  const bool has_background = normal(0, 0) >= kLeastBackground_px;
  if (has_background) plane = normal.ldlt().solve(right);
  const bool is_dark = appearance_.polarity == MarkerPolarity::kDark;

  double weight_sum = 0.0, x_sum = 0.0, y_sum = 0.0;
  double pixel_x = 0.0, pixel_y = 0.0;
  for_pixels(kWeighedMargin_px, [&](int x, int y, std::int32_t owner, double value) {
    if (owner == label) {
      pixel_x += x;
      pixel_y += y;
    } else if (owner != 0) {
      return;
    }
    const double background = plane[0] + plane[1] * (x - middle_x) + plane[2] * (y - middle_y);
    if (!has_background || (is_dark && !(background >= 1.0))) return;
    const double weight = is_dark ? 1.0 - value / background : value - background;  // of either sign: noise has no mean
    weight_sum += weight;
    x_sum += weight * x;
    y_sum += weight * y;
  });
  // A blob amid other markers' pixels has no background: its pixels count alike.
  if (!(weight_sum > 0.0)) {
    weight_sum = blob.area_px;
    x_sum = pixel_x;
    y_sum = pixel_y;
  }
  return {x_sum / weight_sum + 0.5, y_sum / weight_sum + 0.5};
}

}  // namespace touchstone::sensors
