#include "sensors/colour/colour_levelling.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

/// White between two markers is a third of the spacing wide: four reduced pixels, so whole ones lie in it. Each is a
/// mean, as the closing takes the largest values, which noise would raise.
constexpr double kReducedSpacing_px = 12.0;
constexpr double kElementSpacings = 1.5;
constexpr double kSmoothingSpacings = 0.5;
constexpr float kLeastWhite = 1.0F;  ///< grey levels: keeps the gain finite

int odd(double value) {
  return 2 * static_cast<int>(std::lround(0.5 * (value - 1.0))) + 1;
}

/// Where a coordinate (px, pixel centres whole) of `size` pixels falls among `reduced` ones: the pixel before it, which
/// has one after it if there are two, and the fraction of the distance to that one, from 0 to 1.
std::pair<int, float> place_among(int pixel, int size, int reduced) {
  const double at = (pixel + 0.5) * reduced / size - 0.5;
  const int before = std::clamp(static_cast<int>(std::floor(at)), 0, std::max(reduced - 2, 0));
  return {before, static_cast<float>(std::clamp(at - before, 0.0, 1.0))};
}

}  // namespace

ColourLevelling::ColourLevelling(double spacing_px) : spacing_px_(spacing_px) {
  if (!(spacing_px >= 4.0 && spacing_px <= 4096.0)) {
    fail("colour levelling: the spacing is {} px, it must be from 4 to 4096", spacing_px);
  }
}

const cv::Mat& ColourLevelling::level(const cv::Mat& image) {
  if (image.type() != CV_8UC3) {
    fail("colour levelling: the picture has {} channels of depth {}, 8 bit BGR is needed", image.channels(),
         image.depth());
  }
  if (image.cols < spacing_px_ || image.rows < spacing_px_) {
    fail("colour levelling: the picture is {} x {} px, smaller than the markers' spacing of {} px", image.cols,
         image.rows, spacing_px_);
  }
  find_white(image);
  multiply_rows(image);
  return levelled_;
}

void ColourLevelling::find_white(const cv::Mat& image) {
  const double factor = std::max(1.0, std::floor(spacing_px_ / kReducedSpacing_px));
  const cv::Size small_size(std::max(2, static_cast<int>(std::ceil(image.cols / factor))),
                            std::max(2, static_cast<int>(std::ceil(image.rows / factor))));
  cv::resize(image, small_bytes_, small_size, 0, 0, factor > 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
  small_bytes_.convertTo(small_, CV_32FC3);
  const double spacing = spacing_px_ / factor;
  const int side = odd(kElementSpacings * spacing);
  cv::morphologyEx(small_, white_, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {side, side}));
  const int reach = odd(kSmoothingSpacings * spacing);
  cv::blur(white_, white_, {reach, reach}, {-1, -1}, cv::BORDER_REPLICATE);
  cv::max(white_, cv::Scalar::all(kLeastWhite), white_);
  cv::divide(static_cast<double>(kWhite), white_, gain_);
}

void ColourLevelling::multiply_rows(const cv::Mat& image) {
  if (image.size() != size_) {
    size_ = image.size();
    left_.resize(static_cast<std::size_t>(size_.width));
    towards_right_.resize(static_cast<std::size_t>(size_.width));
    for (int x = 0; x < size_.width; ++x) {
      const auto [before, part] = place_among(x, size_.width, gain_.cols);
      left_[static_cast<std::size_t>(x)] = 3 * before;
      towards_right_[static_cast<std::size_t>(x)] = part;
    }
    row_gain_.resize(3 * static_cast<std::size_t>(gain_.cols));
    levelled_.create(size_, CV_8UC3);
  }
  for (int y = 0; y < size_.height; ++y) {
    const auto [above, down] = place_among(y, size_.height, gain_.rows);
    const float* upper = gain_.ptr<float>(above);
    const float* lower = gain_.ptr<float>(std::min(above + 1, gain_.rows - 1));
    for (std::size_t i = 0; i < row_gain_.size(); ++i) row_gain_[i] = upper[i] + down * (lower[i] - upper[i]);
    const std::uint8_t* in = image.ptr<std::uint8_t>(y);
    std::uint8_t* out = levelled_.ptr<std::uint8_t>(y);
    for (int x = 0; x < size_.width; ++x, in += 3, out += 3) {
      const float* gain = row_gain_.data() + left_[static_cast<std::size_t>(x)];
      const float part = towards_right_[static_cast<std::size_t>(x)];
      for (int channel = 0; channel < 3; ++channel) {
        const float here = gain[channel] + part * (gain[channel + 3] - gain[channel]);
        out[channel] = static_cast<std::uint8_t>(std::min(static_cast<float>(in[channel]) * here + 0.5F, 255.0F));
      }
    }
  }
}

Eigen::Vector3d ColourLevelling::white_at(const Eigen::Vector2d& place) const {
  const auto pixel = [](double at, int size, int reduced) {
    return std::clamp(static_cast<int>(at * reduced / size), 0, reduced - 1);
  };
  const auto& white =
      white_.at<cv::Vec3f>(pixel(place.y(), size_.height, white_.rows), pixel(place.x(), size_.width, white_.cols));
  return {white[0], white[1], white[2]};
}

}  // namespace touchstone::sensors
