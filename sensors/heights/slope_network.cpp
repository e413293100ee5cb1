#include "sensors/heights/slope_network.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/numerics/wide_clones.h"

namespace touchstone::sensors {
namespace {

constexpr double kFinestSigma = 1.4;  // px of a shrunk picture: enough for a smooth mean
constexpr int kPerUnit = SlopeNetwork::kInputs + 3;

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
  const float* inputs;  ///< input i of pixel u at i * stride + u
  int stride;
  const float* weights;  ///< kPerUnit a unit
  int units;
  const float* bias;  ///< of both slopes
};

inline __attribute__((always_inline)) void read_pixels(const NetworkRow& row, int first, int count, float* slope_u,
                                                       float* slope_v) {
  constexpr int kInputs = SlopeNetwork::kInputs;
  float out_u[kChunk];
  float out_v[kChunk];
  for (int j = 0; j < count; ++j) out_u[j] = row.bias[0];
  for (int j = 0; j < count; ++j) out_v[j] = row.bias[1];
  for (int k = 0; k < row.units; ++k) {
    const float* const unit = row.weights + static_cast<std::ptrdiff_t>(k) * kPerUnit;
    float sum[kChunk];
    for (int j = 0; j < count; ++j) sum[j] = unit[kInputs];
    for (int i = 0; i < kInputs; ++i) {
      const float weight = unit[i];
      const float* const input = row.inputs + static_cast<std::ptrdiff_t>(i) * row.stride + first;
      for (int j = 0; j < count; ++j) sum[j] += weight * input[j];
    }
    const float to_u = unit[kInputs + 1];
    const float to_v = unit[kInputs + 2];
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
  for (const double size : network.neighbourhoods_mm) {
    if (!(size > 0.0) || !(size < 1000.0)) return fmt::format("a neighbourhood of {} mm; it must be above 0", size);
  }
  return {};
}

Neighbourhoods::Neighbourhoods(const cv::Size& size, double mm_per_px, const std::array<double, 3>& neighbourhoods_mm)
    : size_(size) {
  TS_ASSERT(mm_per_px > 0.0 && !size.empty());
  for (std::size_t i = 0; i < 3; ++i) {
    // Wider than the picture is the picture's mean, nearly.
    const double sigma = std::min(neighbourhoods_mm[i] / mm_per_px, 1.0 * std::max(size.width, size.height));
    const double shrink = std::max(1.0, std::floor(sigma / kFinestSigma));
    Scale& scale = scales_[i];
    scale.small = {std::max(1, static_cast<int>(std::lround(size.width / shrink))),
                   std::max(1, static_cast<int>(std::lround(size.height / shrink)))};
    // Shrinking takes means over a pixel (variance 1/12), and the way back is linear (1/6).
    const double spread = sigma / shrink;
    scale.sigma = shrink > 1.0 ? std::sqrt(spread * spread - 0.25) : spread;
  }
}

void Neighbourhoods::take(const cv::Mat& difference) {
  TS_ASSERT(difference.type() == CV_32FC3 && difference.size() == size_);
  for (Scale& scale : scales_) {
    cv::resize(difference, scale.shrunk, scale.small, 0.0, 0.0, cv::INTER_AREA);
    cv::GaussianBlur(scale.shrunk, scale.blurred, {}, scale.sigma, scale.sigma, cv::BORDER_REPLICATE);
    cv::resize(scale.blurred, scale.mean, size_, 0.0, 0.0, cv::INTER_LINEAR);
  }
}

void Neighbourhoods::inputs_of_row(const cv::Mat& difference, int v, float* inputs) const {
  constexpr auto kUnit = static_cast<float>(1.0 / SlopeNetwork::kColourUnit_DN);
  const int width = size_.width;
  const float* const rows[] = {difference.ptr<float>(v), scales_[0].mean.ptr<float>(v), scales_[1].mean.ptr<float>(v),
                               scales_[2].mean.ptr<float>(v)};
  float* out = inputs;
  for (const float* row : rows) {
    for (int c = 0; c < 3; ++c, out += width) {
      for (int u = 0; u < width; ++u) out[u] = kUnit * row[3 * u + c];
    }
  }
  const float down = 2.0F * (static_cast<float>(v) + 0.5F) / static_cast<float>(size_.height) - 1.0F;
  for (int u = 0; u < width; ++u) {
    out[u] = 2.0F * (static_cast<float>(u) + 0.5F) / static_cast<float>(width) - 1.0F;
    out[width + u] = down;
  }
}

SlopeReader::SlopeReader(const SlopeNetwork& network, const cv::Size& size, double mm_per_px)
    : size_(size), neighbourhoods_(size, mm_per_px, network.neighbourhoods_mm) {
  const std::string fault = fault_of(network);
  if (!fault.empty()) fail("slope network: {}", fault);
  const auto& weights = network.network.weights;
  units_ = static_cast<int>(weights[0].rows());
  for (int k = 0; k < units_; ++k) {
    for (int i = 0; i < SlopeNetwork::kInputs; ++i) weights_.push_back(static_cast<float>(weights[0](k, i)));
    weights_.push_back(static_cast<float>(network.network.biases[0][k]));
    for (int slope = 0; slope < 2; ++slope) weights_.push_back(static_cast<float>(weights[1](slope, k)));
  }
  for (int slope = 0; slope < 2; ++slope) {
    bias_[static_cast<std::size_t>(slope)] = static_cast<float>(network.network.biases[1][slope]);
  }
  inputs_.resize(static_cast<std::size_t>(SlopeNetwork::kInputs) * static_cast<std::size_t>(size.width));
}

void SlopeReader::read(const cv::Mat& difference, cv::Mat& slope_u, cv::Mat& slope_v) {
  neighbourhoods_.take(difference);
  slope_u.create(size_, CV_32FC1);
  slope_v.create(size_, CV_32FC1);
  for (int v = 0; v < size_.height; ++v) {
    neighbourhoods_.inputs_of_row(difference, v, inputs_.data());
    auto* const row_u = slope_u.ptr<float>(v);
    auto* const row_v = slope_v.ptr<float>(v);
    read_row({inputs_.data(), size_.width, weights_.data(), units_, bias_.data()}, size_.width, row_u, row_v);
  }
}

}  // namespace touchstone::sensors
