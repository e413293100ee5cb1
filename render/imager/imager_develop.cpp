#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/error.h"
#include "render/imager/imager.h"

namespace touchstone::render {
namespace {

constexpr double kFullScale = 255.0 * 257.0;  // 255 in 16 bits

int opencv_code(BayerPattern bayer, Demosaic method) {
  // OpenCV's older names (BayerBG2BGR for what everyone calls RGGB) tell the second row's second and third pixel.
  const bool aware = method == Demosaic::edge_aware;
  switch (bayer) {
    case BayerPattern::rggb:
      return aware ? cv::COLOR_BayerRGGB2BGR_EA : cv::COLOR_BayerRGGB2BGR;
    case BayerPattern::bggr:
      return aware ? cv::COLOR_BayerBGGR2BGR_EA : cv::COLOR_BayerBGGR2BGR;
    case BayerPattern::grbg:
      return aware ? cv::COLOR_BayerGRBG2BGR_EA : cv::COLOR_BayerGRBG2BGR;
    case BayerPattern::gbrg:
      return aware ? cv::COLOR_BayerGBRG2BGR_EA : cv::COLOR_BayerGBRG2BGR;
    case BayerPattern::none:
    case BayerPattern::binned:
      break;
  }
  TS_ASSERT(false && "there is no colour to fill in");
  return 0;
}

// OpenCV copies the last inner row and column to the border; a mirrored margin (which keeps the pattern's phase) lets
// it fill in the border like the rest.
cv::Mat colour_filled_in(const cv::Mat& mosaic, int code) {
  cv::Mat wide;
  cv::Mat colour;
  cv::copyMakeBorder(mosaic, wide, 2, 2, 2, 2, cv::BORDER_REFLECT_101);
  cv::demosaicing(wide, colour, code);
  return colour(cv::Rect(2, 2, mosaic.cols, mosaic.rows));
}

// Black level off, white balance on, in 16 bits.
template <typename Number>
cv::Mat balanced(const cv::Mat& raw, const Imager& imager) {
  const int count = raw.channels();
  const double scale = kFullScale / ((1 << imager.bits) - 1 - imager.black_level_DN);
  std::array<double, 3> gains{};
  for (int channel = 0; channel < 3; ++channel) gains[channel] = scale * imager.white_balance[channel];
  cv::Mat linear(raw.size(), CV_16UC(count));
  for (int row = 0; row < raw.rows; ++row) {
    const Number* number = raw.ptr<Number>(row);
    std::uint16_t* out = linear.ptr<std::uint16_t>(row);
    for (int column = 0; column < raw.cols; ++column) {
      for (int i = 0; i < count; ++i) {
        const int channel = count > 1 ? i : channel_of(imager.bayer, column, row);
        const double value = gains[channel] * (*number++ - imager.black_level_DN);
        *out++ = static_cast<std::uint16_t>(std::clamp(value + 0.5, 0.0, kFullScale));
      }
    }
  }
  return linear;
}

/// The 8 bit numbers of linear ones of 16 bits. The curve rises, so it is enough to find where each number begins.
cv::Mat toned(const cv::Mat& linear, const ToneCurve& curve) {
  constexpr int kLevels = 1 << 16;
  std::vector<std::uint8_t> number(kLevels);
  const auto number_of = [&](int level) { return std::floor(255.0 * delivered(curve, level / kFullScale) + 0.5); };
  int first = 0;
  for (int value = 0; value < 256 && first < kLevels; ++value) {
    int end = kLevels;  // of the levels that give at most `value`
    for (int low = first; low < end;) {
      const int middle = low + (end - low) / 2;
      number_of(middle) <= value ? low = middle + 1 : end = middle;
    }
    std::fill(number.begin() + first, number.begin() + end, static_cast<std::uint8_t>(value));
    first = end;
  }
  cv::Mat out(linear.size(), CV_8UC(linear.channels()));
  for (int row = 0; row < linear.rows; ++row) {
    const std::uint16_t* in = linear.ptr<std::uint16_t>(row);
    std::transform(in, in + static_cast<std::ptrdiff_t>(linear.cols) * linear.channels(), out.ptr<std::uint8_t>(row),
                   [&](std::uint16_t level) { return number[level]; });
  }
  return out;
}

}  // namespace

cv::Mat develop(const cv::Mat& raw, const Imager& imager, Demosaic method) {
  check(imager);
  if (raw.empty() || raw.type() != raw_type(imager)) {
    fail("a raw image of {} bits must have {} of {} bit numbers and not be empty", imager.bits,
         imager.bayer == BayerPattern::binned ? "three channels" : "one channel", imager.bits <= 8 ? 8 : 16);
  }
  const bool grey = imager.bayer == BayerPattern::none;
  const bool binned = imager.bayer == BayerPattern::binned;
  if (!grey && !binned && (raw.cols < 2 || raw.rows < 2)) {
    fail("a Bayer image of {}x{} pixels can't be developed; allowed is 2x2 and more", raw.cols, raw.rows);
  }
  // White balance comes before colour is filled in (edges are then judged on balanced numbers), in 16 bits, so that
  // rounding happens once at the end.
  cv::Mat linear = imager.bits <= 8 ? balanced<std::uint8_t>(raw, imager) : balanced<std::uint16_t>(raw, imager);
  if (binned) {
    cv::cvtColor(linear, linear, cv::COLOR_RGB2BGR);
  } else if (!grey) {
    linear = colour_filled_in(linear, opencv_code(imager.bayer, method));
  }
  cv::Mat developed;
  if (std::holds_alternative<LinearTone>(imager.tone_curve)) {
    linear.convertTo(developed, CV_8U, 1.0 / 257.0);
  } else {
    developed = toned(linear, imager.tone_curve);
  }
  return imager.jpeg && !imager.ideal ? through_jpeg(developed, *imager.jpeg) : developed;
}

}  // namespace touchstone::render
