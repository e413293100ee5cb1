#include "sensors/heights/height_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/wide_clones.h"

namespace touchstone::sensors {
namespace {

// Colours are fixed point numbers of 16 bits: differences to the background in 128ths; coefficients so scaled that the
// upper half of their product counts 16ths of a table's cell.
constexpr int kColourBits = 7;
constexpr int kCellBits = 4;
constexpr int kCoefficientBits = 16 - kColourBits + kCellBits;
constexpr int kBandRows = 4;
// Cells a digital number: one coefficient, and what a row of them adds up to for colours of 255.
static_assert(ColourCorrection::kLargestGain / static_cast<double>(kFinestStep_DN) <=
              std::min(32767.0 / (1 << kCoefficientBits), 32767.0 / (1 << kCellBits) / 256.0));
constexpr float kClearly_DN = 12.0F;  // summed over the channels
constexpr int kGainBits = 15;

/// Is every pixel the first one's like? A frame of a gel differs from it in its first few.
bool is_flat(const cv::Mat& frame) {
  const auto first = frame.at<cv::Vec3b>(0, 0);
  for (int v = 0; v < frame.rows; ++v) {
    const auto* const row = frame.ptr<cv::Vec3b>(v);
    if (!std::all_of(row, row + frame.cols, [&](const cv::Vec3b& pixel) { return pixel == first; })) return false;
  }
  return true;
}

inline std::int16_t upper_half(std::int16_t a, std::int16_t b) {
  return static_cast<std::int16_t>((static_cast<std::int32_t>(a) * b) >> 16);
}

/// The table's cell along one channel for a row of differences.
struct ChannelCells {
  const std::int16_t* from_blue;
  const std::int16_t* from_green;
  const std::int16_t* from_red;
  std::int16_t offset;
  std::int16_t last;
};

inline std::int16_t cell_along(const ChannelCells& channel, int u, std::int16_t blue, std::int16_t green,
                               std::int16_t red) {
  const auto sum =
      static_cast<std::int16_t>(upper_half(blue, channel.from_blue[u]) + upper_half(green, channel.from_green[u]) +
                                upper_half(red, channel.from_red[u]) + channel.offset);
  const auto cell = static_cast<std::int16_t>(sum >> kCellBits);
  const std::int16_t above = cell < 0 ? std::int16_t{0} : cell;
  return above > channel.last ? channel.last : above;
}

/// A row's colours, and what stands for rest and the table.
struct CellRow {
  const unsigned char* const* planes;
  const std::int16_t* const* rest;
  const ChannelCells* channels;
  const int* sides;
  const std::int32_t* shares;  ///< by the channels' gains, in units of 2^-kGainBits; read if they are scaled
};

template <bool kScaled>
inline __attribute__((always_inline)) void find_cells_of(const CellRow& row, int count, std::int32_t* cells) {
  const unsigned char* const blue = row.planes[0];
  const unsigned char* const green = row.planes[1];
  const unsigned char* const red = row.planes[2];
  const std::int16_t* const rest_blue = row.rest[0];
  const std::int16_t* const rest_green = row.rest[1];
  const std::int16_t* const rest_red = row.rest[2];
  const ChannelCells along_blue = row.channels[0];
  const ChannelCells along_green = row.channels[1];
  const ChannelCells along_red = row.channels[2];
  const std::int32_t side_green = row.sides[1];
  const std::int32_t side_red = row.sides[2];
  const auto fixed = [&](unsigned char value, int channel) -> std::int16_t {
    if constexpr (!kScaled) return static_cast<std::int16_t>(value << kColourBits);
    const std::int32_t scaled = (value * row.shares[channel]) >> (kGainBits - kColourBits);
    return static_cast<std::int16_t>(scaled > 32767 ? 32767 : scaled);
  };
#pragma GCC ivdep
  for (int u = 0; u < count; ++u) {
    const auto b = static_cast<std::int16_t>(fixed(blue[u], 0) - rest_blue[u]);
    const auto g = static_cast<std::int16_t>(fixed(green[u], 1) - rest_green[u]);
    const auto r = static_cast<std::int16_t>(fixed(red[u], 2) - rest_red[u]);
    const std::int32_t cell_b = cell_along(along_blue, u, b, g, r);
    const std::int32_t cell_g = cell_along(along_green, u, b, g, r);
    const std::int32_t cell_r = cell_along(along_red, u, b, g, r);
    cells[u] = (cell_b * side_green + cell_g) * side_red + cell_r;
  }
}

TS_WIDE_CLONES void find_cells(const CellRow& row, int count, std::int32_t* cells) {
  find_cells_of<false>(row, count, cells);
}
TS_WIDE_CLONES void find_scaled_cells(const CellRow& row, int count, std::int32_t* cells) {
  find_cells_of<true>(row, count, cells);
}

void fetch_slopes(const Eigen::Vector2f* table, const std::int32_t* cells, int count, float* slope_u, float* slope_v) {
  for (int u = 0; u < count; ++u) {
    const Eigen::Vector2f& slope = table[cells[u]];
    slope_u[u] = slope.x();
    slope_v[u] = slope.y();
  }
}

struct Extremes {
  int saturated = 0;
  int lost = 0;
  int dark = 0;
};

TS_WIDE_CLONES Extremes count_extremes(const unsigned char* blue, const unsigned char* green, const unsigned char* red,
                                       int count) {
  int saturated = 0;
  int lost = 0;
  int dark = 0;
  for (int u = 0; u < count; ++u) {
    const int cut = (blue[u] == 255 ? 1 : 0) + (green[u] == 255 ? 1 : 0) + (red[u] == 255 ? 1 : 0);
    saturated += cut > 0 ? 1 : 0;
    lost += cut > 1 ? 1 : 0;
    dark += (blue[u] | green[u] | red[u]) == 0 ? 1 : 0;
  }
  return {saturated, lost, dark};
}

const HeightModel& checked(const HeightModel& model) {
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("height model: {}", fault);
  return model;
}

}  // namespace

HeightEstimator::HeightEstimator(const HeightModel& model, const HeightSettings& settings)
    : model_(checked(model)),
      settings_(settings),
      poisson_(model.background.mean.cols, model.background.mean.rows, settings.border),
      follower_(model.background.mean, model.mm_per_px, settings.follow) {
  model_.background.mean = model.background.mean.clone();  // which may be moved
  const cv::Mat& mean = model_.background.mean;
  if (model_.white_balance) gains_.emplace(model_.background);
  if (model_.network) reader_.emplace(*model_.network, mean.size(), model_.mm_per_px);
  const int width = mean.cols;
  const int height = mean.rows;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  rest_.resize(3 * pixels);
  take_background();
  const ColourCorrection correction = correction_of(model_);
  const int bands = (height + kBandRows - 1) / kBandRows;
  matrix_.resize(static_cast<std::size_t>(bands) * 9 * static_cast<std::size_t>(width));
  for (int band = 0; band < bands; ++band) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector2d place(u + 0.5, std::min(band * kBandRows + 0.5 * kBandRows, height - 0.5));
      const Eigen::Matrix3d cells_a_number = correction.at(place) / static_cast<double>(model_.table.step);
      for (int i = 0; i < 9; ++i) {
        matrix_[static_cast<std::size_t>((band * 9 + i) * width + u)] =
            static_cast<std::int16_t>(std::lround(cells_a_number(i / 3, i % 3) * (1 << kCoefficientBits)));
      }
    }
  }
  for (int c = 0; c < 3; ++c) {
    // Half a cell to round, and three times half a unit that the upper halves have lost.
    const double zero = -static_cast<double>(model_.table.lowest[c] / model_.table.step);
    offset_[c] = static_cast<std::int16_t>(std::lround(zero * (1 << kCellBits) + (1 << (kCellBits - 1)) + 1.5));
  }
  cell_.resize(static_cast<std::size_t>(width));
  for (cv::Mat& plane : planes_) plane.create(height, width, CV_8UC1);
  result_.slope_u.create(height, width, CV_32FC1);
  result_.slope_v.create(height, width, CV_32FC1);
  result_.height_mm.create(height, width, CV_32FC1);
  result_.contact.create(height, width, CV_8UC1);
}

void HeightEstimator::take_background() {
  const cv::Mat& mean = model_.background.mean;
  const std::size_t pixels = mean.total();
  for (int v = 0; v < mean.rows; ++v) {
    const auto* const row = mean.ptr<float>(v);
    for (std::size_t c = 0; c < 3; ++c) {
      std::int16_t* const rest = rest_.data() + c * pixels + static_cast<std::size_t>(v) * mean.cols;
      for (int u = 0; u < mean.cols; ++u) {
        rest[u] = static_cast<std::int16_t>(std::lround(row[3 * u + static_cast<int>(c)] * (1 << kColourBits)));
      }
    }
  }
}

void HeightEstimator::set_rest(std::span<const cv::Mat> frames) {
  for (const cv::Mat& frame : frames) {
    const std::string fault = frame_fault(frame, model_.background.mean.size());
    if (!fault.empty()) fail("the frame {}", fault);
  }
  model_.background = mean_background(frames);
  take_background();
  follower_.take(model_.background.mean);
  if (gains_) gains_.emplace(model_.background);
}

void HeightEstimator::look_up_slopes(const cv::Mat& frame) {
  const int width = frame.cols;
  const auto pixels = static_cast<long>(frame.total());
  std::int32_t shares[3];
  for (int c = 0; c < 3; ++c) {
    shares[c] = static_cast<std::int32_t>(std::lround((1 << kGainBits) / result_.gain[c]));
  }
  for (int v = 0; v < frame.rows; ++v) {
    const unsigned char* const planes[] = {planes_[0].ptr(v), planes_[1].ptr(v), planes_[2].ptr(v)};
    const long row = static_cast<long>(v) * width;
    const std::int16_t* const rest[] = {rest_.data() + row, rest_.data() + pixels + row,
                                        rest_.data() + 2 * pixels + row};
    const std::int16_t* const coefficients = matrix_.data() + static_cast<long>(v / kBandRows) * 9 * width;
    ChannelCells channels[3];
    for (int c = 0; c < 3; ++c) {
      const std::int16_t* const mine = coefficients + 3L * c * width;
      channels[c] = {mine, mine + width, mine + 2L * width, offset_[c],
                     static_cast<std::int16_t>(model_.table.cells[static_cast<std::size_t>(c)] - 1)};
    }
    const CellRow cells{planes, rest, channels, model_.table.cells.data(), shares};
    (model_.white_balance ? find_scaled_cells : find_cells)(cells, width, cell_.data());
    fetch_slopes(model_.table.slopes.data(), cell_.data(), width, result_.slope_u.ptr<float>(v),
                 result_.slope_v.ptr<float>(v));
  }
}

void HeightEstimator::count_shares(const cv::Mat& frame) {
  cv::split(frame, planes_);
  Extremes extremes;
  for (int v = 0; v < frame.rows; ++v) {
    const Extremes here = count_extremes(planes_[0].ptr(v), planes_[1].ptr(v), planes_[2].ptr(v), frame.cols);
    extremes.saturated += here.saturated;
    extremes.lost += here.lost;
    extremes.dark += here.dark;
  }
  const auto pixels = static_cast<double>(frame.total());
  result_.saturated_share = extremes.saturated / pixels;
  result_.lost_share = extremes.lost / pixels;
  result_.dark_share = extremes.dark / pixels;
}

void HeightEstimator::find_slopes(const cv::Mat& frame) {
  const std::string fault = frame_fault(frame, model_.background.mean.size());
  if (!fault.empty()) fail("the frame {}", fault);
  if (gains_) result_.gain = gains_->find(frame).gain;
  count_shares(frame);
  if (!reader_) {
    look_up_slopes(frame);
    return;
  }
  const double ceiling = gains_ ? SlopeNetwork::kCeiling_DN : std::numeric_limits<double>::infinity();
  reader_->read(difference_to(model_.background, frame, result_.gain, ceiling), result_.slope_u, result_.slope_v);
}

const HeightResult& HeightEstimator::estimate(const cv::Mat& frame) {
  find_slopes(frame);
  poisson_.integrate(result_.slope_u, result_.slope_v, model_.mm_per_px, result_.height_mm);
  if (settings_.border == HeightBorder::free) level_by_border(result_.height_mm);
  result_.contact_pixels = mark_contact(result_.height_mm, settings_.contact, result_.contact);
  result_.overexposed = result_.lost_share > settings_.most_lost;
  result_.dark = result_.dark_share > settings_.most_dark;
  result_.flat = is_flat(frame);
  result_.contact_at_border = touches_border(result_.contact);
  result_.rest_share = follower_.look(planes_, result_.gain);
  result_.unlike = settings_.border == HeightBorder::zero && result_.rest_share < settings_.least_rest;
  if (settings_.follow.frames > 0.0 && result_.trusted()) {
    follower_.follow(frame, result_.gain, result_.contact, model_.background.mean);
    take_background();
    follower_.take(model_.background.mean);
  }
  return result_;
}

cv::Mat HeightEstimator::doubts(const cv::Mat& frame) {
  find_slopes(frame);
  const cv::Mat difference = difference_to(model_.background, frame, result_.gain);
  const ColourCorrection correction = correction_of(model_);
  const auto steepest = static_cast<float>(model_.steepest_calibrated);
  cv::Mat doubts(frame.size(), CV_8UC1);
  for (int v = 0; v < frame.rows; ++v) {
    for (int u = 0; u < frame.cols; ++u) {
      const auto& raw = frame.at<cv::Vec3b>(v, u);
      const auto& pixel = difference.at<cv::Vec3f>(v, u);
      const Eigen::Matrix3f matrix = correction.at({u + 0.5, v + 0.5}).cast<float>();
      const Eigen::Vector3f colour = matrix * Eigen::Vector3f(pixel[0], pixel[1], pixel[2]);
      const int cut = saturated_channels(raw);
      int bits = cut == 1 ? kSlopeOfTwo : 0;
      if (cut > 1 || (raw[0] | raw[1] | raw[2]) == 0) bits |= kSlopeLost;
      if (!model_.table.measured_near(colour)) bits |= kSlopeUnseen;
      if (std::hypot(result_.slope_u.at<float>(v, u), result_.slope_v.at<float>(v, u)) > steepest) bits |= kSlopeSteep;
      doubts.at<unsigned char>(v, u) = static_cast<unsigned char>(bits);
    }
  }
  return doubts;
}

FrameCoverage HeightEstimator::coverage(const cv::Mat& frame) {
  const cv::Mat bits = doubts(frame);
  const cv::Mat difference = difference_to(model_.background, frame, result_.gain);
  std::int64_t measured = 0;
  std::int64_t clear = 0;
  std::int64_t clear_measured = 0;
  std::int64_t steep = 0;
  for (int v = 0; v < difference.rows; ++v) {
    for (int u = 0; u < difference.cols; ++u) {
      const auto& pixel = difference.at<cv::Vec3f>(v, u);
      const int doubt = bits.at<unsigned char>(v, u);
      const bool hit = (doubt & kSlopeUnseen) == 0;
      measured += hit ? 1 : 0;
      if (std::abs(pixel[0]) + std::abs(pixel[1]) + std::abs(pixel[2]) > kClearly_DN) {
        ++clear;
        clear_measured += hit ? 1 : 0;
      }
      steep += (doubt & kSlopeSteep) != 0 ? 1 : 0;
    }
  }
  const auto share = [](std::int64_t part, std::int64_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 1.0;
  };
  const auto pixels = static_cast<std::int64_t>(difference.total());
  return {share(measured, pixels), share(clear_measured, clear), share(steep, pixels)};
}

}  // namespace touchstone::sensors
