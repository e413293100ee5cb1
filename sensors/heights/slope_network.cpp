#include "sensors/heights/slope_network.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/wide_clones.h"

namespace touchstone::sensors {
namespace {

constexpr double kFinestSigma = 1.4;  // px of a shrunk picture: enough for a smooth mean
constexpr int kPerUnit = SlopeNetwork::kNear + 2;
constexpr auto kContexts = static_cast<int>(SlopeNetwork::kContext.size());
constexpr auto kColourUnit = static_cast<float>(1.0 / SlopeNetwork::kColourUnit_DN);

/// tanh by Lambert's continued fraction, cut off where that reaches 1: off by 1e-4 at most.
inline float quick_tanh(float x) {
  const float bounded = std::min(std::max(x, -4.97F), 4.97F);
  const float s = bounded * bounded;
  const float above = bounded * (135135.0F + s * (17325.0F + s * (378.0F + s)));
  const float below = 135135.0F + s * (62370.0F + s * (3150.0F + s * 28.0F));
  return above / below;
}

/// Pixels that are read at once: their sums stay in registers.
constexpr int kChunk = 64;

/// A row's inputs, and what all hidden units weigh them with.
struct NetworkRow {
  const float* inputs;  ///< near input i of pixel u at i * stride + u
  const float* above;   ///< what unit k's context and bias add up to at pixel u of the grid's row above: k * stride + u
  const float* below;   ///< likewise
  float share;          ///< of the row below
  int stride;
  const float* weights;  ///< kPerUnit a unit
  int units;
  const float* bias;  ///< of both slopes
};

inline __attribute__((always_inline)) void read_pixels(const NetworkRow& row, int first, int count, float* slope_u,
                                                       float* slope_v) {
  constexpr int kNear = SlopeNetwork::kNear;
  float out_u[kChunk];
  float out_v[kChunk];
  for (int j = 0; j < count; ++j) out_u[j] = row.bias[0];
  for (int j = 0; j < count; ++j) out_v[j] = row.bias[1];
  for (int k = 0; k < row.units; ++k) {
    const float* const unit = row.weights + static_cast<std::ptrdiff_t>(k) * kPerUnit;
    const float* const above = row.above + static_cast<std::ptrdiff_t>(k) * row.stride + first;
    const float* const below = row.below + static_cast<std::ptrdiff_t>(k) * row.stride + first;
    float sum[kChunk];
    for (int j = 0; j < count; ++j) sum[j] = above[j] + row.share * (below[j] - above[j]);
    for (int i = 0; i < kNear; ++i) {
      const float weight = unit[i];
      const float* const input = row.inputs + static_cast<std::ptrdiff_t>(i) * row.stride + first;
      for (int j = 0; j < count; ++j) sum[j] += weight * input[j];
    }
    const float to_u = unit[kNear];
    const float to_v = unit[kNear + 1];
    for (int j = 0; j < count; ++j) {
      const float value = quick_tanh(sum[j]);
      out_u[j] += to_u * value;
      out_v[j] += to_v * value;
    }
  }
  for (int j = 0; j < count; ++j) slope_u[first + j] = out_u[j];
  for (int j = 0; j < count; ++j) slope_v[first + j] = out_v[j];
}

TS_WIDE_CLONES void read_row(const NetworkRow& row, int count, float* slope_u, float* slope_v) {
  if (count < kChunk) {
    read_pixels(row, 0, count, slope_u, slope_v);
    return;
  }
  for (int first = 0; first < count; first += kChunk) {
    read_pixels(row, std::min(first, count - kChunk), kChunk, slope_u, slope_v);  // the last chunk may read some twice
  }
}

/// Each of `count` columns or rows of a picture between those of a grid of `points`.
std::vector<Neighbourhoods::Between> places_between(int count, int points) {
  std::vector<Neighbourhoods::Between> places;
  for (int i = 0; i < count; ++i) {
    const double at = std::clamp((i + 0.5) * points / count - 0.5, 0.0, points - 1.0);
    const int low = static_cast<int>(at);
    places.push_back({low, std::min(low + 1, points - 1), static_cast<float>(at - low)});
  }
  return places;
}

/// By what a picture may be shrunk before a mean of this width (px) is taken.
double shrink_for(double sigma) {
  return std::max(1.0, std::floor(sigma / kFinestSigma));
}

cv::Size shrunk_size(const cv::Size& size, double shrink) {
  return {std::max(1, static_cast<int>(std::lround(size.width / shrink))),
          std::max(1, static_cast<int>(std::lround(size.height / shrink)))};
}

/// The width that is left to blur by: shrinking takes means over a pixel (variance 1/12), and the way back is linear
/// (1/6).
double sigma_left(double sigma, double shrink) {
  const double spread = sigma / shrink;
  return shrink > 1.0 ? std::sqrt(spread * spread - 0.25) : spread;
}

}  // namespace

std::string fault_of(const SlopeNetwork& network) {
  if (std::string fault = fault_of(network.network); !fault.empty()) return fault;
  if (network.network.sigmoid != Sigmoid::kTanh || network.network.weights.size() != 2) {
    return "it isn't of one hidden layer of tanh";
  }
  if (network.network.inputs() != SlopeNetwork::kInputs || network.network.outputs() != 2) {
    return fmt::format("it has {} inputs and {} outputs; {} and 2 are needed", network.network.inputs(),
                       network.network.outputs(), SlopeNetwork::kInputs);
  }
  return {};
}

Neighbourhoods::Neighbourhoods(const cv::Size& size, double mm_per_px) : size_(size) {
  TS_ASSERT(mm_per_px > 0.0 && !size.empty());
  // Wider than the picture is the picture's mean, nearly.
  const double widest = std::max(size.width, size.height);
  const auto pixels = [&](double width_mm) { return std::min(width_mm / mm_per_px, widest); };
  const double fine = pixels(SlopeNetwork::kFine_mm);
  fine_size_ = shrunk_size(size, shrink_for(fine));
  fine_sigma_ = sigma_left(fine, shrink_for(fine));
  double finest = widest;
  for (const SlopeNetwork::Mean& mean : SlopeNetwork::kContext) finest = std::min(finest, pixels(mean.width_mm));
  const double shrink = shrink_for(finest);
  grid_ = shrunk_size(size, shrink);
  columns_ = places_between(size.width, grid_.width);
  rows_ = places_between(size.height, grid_.height);
  right_px_ = grid_.width / (mm_per_px * size.width);
  down_px_ = grid_.height / (mm_per_px * size.height);
  for (std::size_t i = 0; i < context_.size(); ++i) {
    context_[i].sigma = sigma_left(pixels(SlopeNetwork::kContext[i].width_mm), shrink);
  }
}

void Neighbourhoods::take(const cv::Mat& difference) {
  TS_ASSERT(difference.type() == CV_32FC3 && difference.size() == size_);
  const auto blur = [](const cv::Mat& from, double sigma, cv::Mat& to) {
    cv::GaussianBlur(from, to, {}, sigma, sigma, cv::BORDER_REPLICATE);
  };
  cv::resize(difference, shrunk_, fine_size_, 0.0, 0.0, cv::INTER_AREA);
  blur(shrunk_, fine_sigma_, blurred_);
  cv::resize(blurred_, fine_, size_, 0.0, 0.0, cv::INTER_LINEAR);
  cv::resize(difference, coarse_, grid_, 0.0, 0.0, cv::INTER_AREA);
  for (std::size_t i = 0; i < context_.size(); ++i) {
    const SlopeNetwork::Mean& mean = SlopeNetwork::kContext[i];
    // Means of one width follow each other, and are blurred once.
    const bool again = i > 0 && mean.width_mm == SlopeNetwork::kContext[i - 1].width_mm;
    if (again) {
      context_[i].blurred = context_[i - 1].blurred;
    } else {
      blur(coarse_, context_[i].sigma, context_[i].blurred);
    }
    const cv::Matx23d from(1.0, 0.0, right_px_ * mean.right_mm, 0.0, 1.0, down_px_ * mean.down_mm);
    cv::warpAffine(context_[i].blurred, context_[i].mean, from, grid_, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                   cv::BORDER_REPLICATE);
  }
}

void Neighbourhoods::near_inputs_of_row(const cv::Mat& difference, int v, float* inputs) const {
  const int width = size_.width;
  float* out = inputs;
  for (const float* row : {difference.ptr<float>(v), fine_.ptr<float>(v)}) {
    for (int c = 0; c < 3; ++c, out += width) {
      for (int u = 0; u < width; ++u) out[u] = kColourUnit * row[3 * u + c];
    }
  }
  const float down = 2.0F * (static_cast<float>(v) + 0.5F) / static_cast<float>(size_.height) - 1.0F;
  for (int u = 0; u < width; ++u) {
    out[u] = 2.0F * (static_cast<float>(u) + 0.5F) / static_cast<float>(width) - 1.0F;
    out[width + u] = down;
  }
}

void Neighbourhoods::inputs_of_row(const cv::Mat& difference, int v, float* inputs) const {
  near_inputs_of_row(difference, v, inputs);
  const Between& row = rows_[static_cast<std::size_t>(v)];
  float* out = inputs + static_cast<std::ptrdiff_t>(SlopeNetwork::kNear) * size_.width;
  for (const Context& context : context_) {
    const auto* const above = context.mean.ptr<float>(row.low);
    const auto* const below = context.mean.ptr<float>(row.high);
    for (int c = 0; c < 3; ++c, out += size_.width) {
      for (int u = 0; u < size_.width; ++u) {
        const Between& column = columns_[static_cast<std::size_t>(u)];
        const auto at = [&](int x) { return above[3 * x + c] + row.share * (below[3 * x + c] - above[3 * x + c]); };
        out[u] = kColourUnit * (at(column.low) + column.share * (at(column.high) - at(column.low)));
      }
    }
  }
}

SlopeReader::SlopeReader(const SlopeNetwork& network, const cv::Size& size, double mm_per_px)
    : size_(size), neighbourhoods_(size, mm_per_px) {
  const std::string fault = fault_of(network);
  if (!fault.empty()) fail("slope network: {}", fault);
  const auto& weights = network.network.weights;
  units_ = static_cast<int>(weights[0].rows());
  for (int k = 0; k < units_; ++k) {
    for (int i = 0; i < SlopeNetwork::kNear; ++i) weights_.push_back(static_cast<float>(weights[0](k, i)));
    for (int slope = 0; slope < 2; ++slope) weights_.push_back(static_cast<float>(weights[1](slope, k)));
    context_weights_.push_back(static_cast<float>(network.network.biases[0][k]));
    for (int i = SlopeNetwork::kNear; i < SlopeNetwork::kInputs; ++i) {
      context_weights_.push_back(kColourUnit * static_cast<float>(weights[0](k, i)));
    }
  }
  for (int slope = 0; slope < 2; ++slope) {
    bias_[static_cast<std::size_t>(slope)] = static_cast<float>(network.network.biases[1][slope]);
  }
  const auto width = static_cast<std::size_t>(size.width);
  inputs_.resize(SlopeNetwork::kNear * width);
  at_grid_.resize(static_cast<std::size_t>(neighbourhoods_.grid().width));
  for (std::vector<float>& sums : sums_) sums.resize(static_cast<std::size_t>(units_) * width);
}

/// What each unit's context and bias add up to along a row of the grid, at all columns of the picture. A unit's sum is
/// linear in its inputs, so it may be interpolated in place of them, which is less work.
void SlopeReader::sum_context(int row, float* sums) {
  const int grid_width = neighbourhoods_.grid().width;
  const std::vector<Neighbourhoods::Between>& columns = neighbourhoods_.columns();
  for (int k = 0; k < units_; ++k) {
    const float* weights = context_weights_.data() + static_cast<std::ptrdiff_t>(k) * (1 + 3 * kContexts);
    std::fill(at_grid_.begin(), at_grid_.end(), *weights++);
    for (std::size_t i = 0; i < SlopeNetwork::kContext.size(); ++i, weights += 3) {
      const auto* const colours = neighbourhoods_.context(i).ptr<float>(row);
      for (int x = 0; x < grid_width; ++x) {
        at_grid_[static_cast<std::size_t>(x)] +=
            weights[0] * colours[3 * x] + weights[1] * colours[3 * x + 1] + weights[2] * colours[3 * x + 2];
      }
    }
    float* const out = sums + static_cast<std::ptrdiff_t>(k) * size_.width;
    for (int u = 0; u < size_.width; ++u) {
      const Neighbourhoods::Between& column = columns[static_cast<std::size_t>(u)];
      const float low = at_grid_[static_cast<std::size_t>(column.low)];
      out[u] = low + column.share * (at_grid_[static_cast<std::size_t>(column.high)] - low);
    }
  }
}

void SlopeReader::read(const cv::Mat& difference, cv::Mat& slope_u, cv::Mat& slope_v) {
  neighbourhoods_.take(difference);
  slope_u.create(size_, CV_32FC1);
  slope_v.create(size_, CV_32FC1);
  std::array<int, 2> held = {-1, -1};  // rows of the grid
  const auto sums_of = [&](int row) {
    const auto slot = static_cast<std::size_t>(row % 2);
    if (held[slot] != row) sum_context(row, sums_[slot].data());
    held[slot] = row;
    return sums_[slot].data();
  };
  for (int v = 0; v < size_.height; ++v) {
    const Neighbourhoods::Between& between = neighbourhoods_.rows()[static_cast<std::size_t>(v)];
    const float* const above = sums_of(between.low);
    const float* const below = sums_of(between.high);
    neighbourhoods_.near_inputs_of_row(difference, v, inputs_.data());
    const NetworkRow row{inputs_.data(), above,           below,  between.share,
                         size_.width,    weights_.data(), units_, bias_.data()};
    read_row(row, size_.width, slope_u.ptr<float>(v), slope_v.ptr<float>(v));
  }
}

}  // namespace touchstone::sensors
