#include "render/membrane/face_shadow.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/units.h"
#include "render/materials/fresnel.h"

namespace touchstone::render {
namespace {

constexpr int kAzimuths = 12;
constexpr double kStepGrowth = 4.0 / 3.0;
constexpr int kTableSize = 256;

/// Even light that enters a face, by the angle outside and the sector that it enters.
class EnteringLight {
 public:
  explicit EnteringLight(double index) {
    std::vector<double> sums(kTableSize + 1, 0.0);  // over the squared sine outside
    for (int k = 0; k < kTableSize; ++k) {
      const double cosine = std::sqrt(1.0 - (k + 0.5) / kTableSize);
      sums[k + 1] = sums[k] + 1.0 - fresnel(1.0, index, cosine).mean_reflectance();
    }
    const auto limits = sector_limits(index);
    for (int sector = 0; sector < kFaceSectors; ++sector) {
      const auto outside = [&](double squared_cosine) {
        return std::clamp(index * index * (1.0 - squared_cosine), 0.0, 1.0) * kTableSize;
      };
      const double from = outside(limits[sector + 1]);
      const double to = outside(limits[sector]);
      const auto at = [&](double place) {
        const int k = std::min(static_cast<int>(place), kTableSize - 1);
        return sums[k] + (place - k) * (sums[k + 1] - sums[k]);
      };
      const double whole = at(to) - at(from);
      if (!(whole > 1e-9 * sums.back())) continue;
      for (int k = 0; k <= kTableSize; ++k) {
        within_[sector].push_back(static_cast<float>((at(std::clamp(double(k), from, to)) - at(from)) / whole));
      }
    }
  }
  bool enters(int sector) const { return !within_[sector].empty(); }
  /// The share of a sector's light that comes more steeply than an angle, given by height over distance.
  float within(int sector, float cotangent) const {
    const float at = static_cast<float>(kTableSize) / (1.0F + cotangent * cotangent);
    const int k = std::min(static_cast<int>(at), kTableSize - 1);
    const std::vector<float>& table = within_[sector];
    return table[k] + (at - static_cast<float>(k)) * (table[k + 1] - table[k]);
  }

 private:
  std::array<std::vector<float>, kFaceSectors> within_;
};

/// The least gap in blocks of factor x factor cells.
cv::Mat least_gap(const cv::Mat& gap, int factor) {
  cv::Mat out((gap.rows + factor - 1) / factor, (gap.cols + factor - 1) / factor, CV_32FC1,
              cv::Scalar(std::numeric_limits<float>::infinity()));
  for (int row = 0; row < gap.rows; ++row) {
    const auto* in = gap.ptr<float>(row);
    auto* least = out.ptr<float>(row / factor);
    for (int column = 0; column < gap.cols; ++column)
      least[column / factor] = std::min(least[column / factor], in[column]);
  }
  return out;
}

/// A march over the grid along one azimuth.
struct Step {
  int columns, rows;
  // 1 / distance of where a body that is met here ends and begins: the geometric middle to the next step and to the
  // last.
  float per_mm_end, per_mm_begin;
};
struct March {
  float cosine, sine;
  std::vector<Step> steps;
};

}  // namespace

BodyShadow shadow_of_body(const FaceGrid& grid, const FaceState& state, double index, int factor) {
  const cv::Mat gap = least_gap(state.gap_mm, factor);
  const double spacing = grid.spacing_mm * factor;
  const EnteringLight light(index);
  const double reach = std::hypot(gap.cols, gap.rows) * spacing;
  std::vector<March> marches(kAzimuths);
  for (int k = 0; k < kAzimuths; ++k) {
    const double azimuth = 2.0 * kPi * (k + 0.5) / kAzimuths;
    marches[k].cosine = static_cast<float>(std::cos(azimuth));
    marches[k].sine = static_cast<float>(std::sin(azimuth));
    double last = 0.25 * spacing;
    for (double distance = spacing; distance < reach;) {
      const double next = std::max(distance + spacing, distance * kStepGrowth);
      const int columns = static_cast<int>(std::lround(distance * std::cos(azimuth) / spacing));
      const int rows = static_cast<int>(std::lround(distance * std::sin(azimuth) / spacing));
      marches[k].steps.push_back({columns, rows, static_cast<float>(1.0 / std::sqrt(distance * next)),
                                  static_cast<float>(1.0 / std::sqrt(distance * last))});
      last = distance;
      distance = next;
    }
  }
  const auto top = static_cast<float>(std::min(state.height_mm, 1e6));
  constexpr float kNone = std::numeric_limits<float>::infinity();
  BodyShadow shadow;
  for (ShadowMoments* moments : {&shadow.under, &shadow.beside}) {
    for (int sector = 0; sector < kFaceSectors; ++sector) {
      if (!light.enters(sector)) continue;
      for (cv::Mat& moment : (*moments)[sector]) moment.create(gap.size(), CV_32FC1);
    }
  }
  using Sums = std::array<std::array<float, 3>, kFaceSectors>;
  const auto add = [](std::array<float, 3>& sum, const March& march, float share) {
    sum[0] += share;
    sum[1] += share * march.cosine;
    sum[2] += share * march.sine;
  };
  // What isn't there is infinitely high, and begins nowhere.
  cv::Mat low(gap.size(), CV_32FC1);
  cv::Mat high(gap.size(), CV_32FC1);
  for (int row = 0; row < gap.rows; ++row) {
    for (int column = 0; column < gap.cols; ++column) {
      const bool is_there = gap.at<float>(row, column) < top;
      low.at<float>(row, column) = is_there ? gap.at<float>(row, column) : kNone;
      high.at<float>(row, column) = is_there ? top : 0.0F;
    }
  }
  const auto cells = static_cast<std::size_t>(gap.cols);
  std::vector<float> lowest(cells);
  std::vector<float> highest(cells);
  std::vector<Sums> under(cells);
  std::vector<Sums> beside(cells);
  for (int row = 0; row < gap.rows; ++row) {
    std::fill(under.begin(), under.end(), Sums{});
    std::fill(beside.begin(), beside.end(), Sums{});
    const auto* own = low.ptr<float>(row);
    for (const March& march : marches) {
      // Rays that rise between these slopes meet the body; under it all that are steeper, too.
      std::fill(lowest.begin(), lowest.end(), kNone);
      std::fill(highest.begin(), highest.end(), 0.0F);
      for (const Step& step : march.steps) {
        const int y = row + step.rows;
        if (y < 0 || y >= gap.rows) break;
        const auto* below = low.ptr<float>(y);
        const auto* above = high.ptr<float>(y);
        const int end = std::min(gap.cols, gap.cols - step.columns);
        for (int column = std::max(0, -step.columns); column < end; ++column) {
          lowest[column] = std::min(lowest[column], below[column + step.columns] * step.per_mm_end);
          highest[column] = std::max(highest[column], above[column + step.columns] * step.per_mm_begin);
        }
      }
      for (int column = 0; column < gap.cols; ++column) {
        const float from = std::min(lowest[column], own[column] / static_cast<float>(0.5 * spacing));
        if (!(from < kNone)) continue;
        for (int sector = 0; sector < kFaceSectors; ++sector) {
          if (!light.enters(sector)) continue;
          add(under[column][sector], march, light.within(sector, from));
          if (highest[column] > lowest[column]) {
            add(beside[column][sector], march,
                light.within(sector, lowest[column]) - light.within(sector, highest[column]));
          }
        }
      }
    }
    for (int sector = 0; sector < kFaceSectors; ++sector) {
      if (!light.enters(sector)) continue;
      for (int k = 0; k < 3; ++k) {
        for (int column = 0; column < gap.cols; ++column) {
          shadow.under[sector][k].at<float>(row, column) = under[column][sector][k] / kAzimuths;
          shadow.beside[sector][k].at<float>(row, column) = beside[column][sector][k] / kAzimuths;
        }
      }
    }
  }
  return shadow;
}

ShadowMoments mean_shadow(const BodyShadow& shadow, const cv::Mat& under) {
  ShadowMoments mean;
  for (std::size_t sector = 0; sector < mean.size(); ++sector) {
    for (std::size_t k = 0; k < mean[sector].size(); ++k) {
      if (shadow.under[sector][k].empty()) continue;
      cv::Mat below;
      cv::Mat beside;
      cv::resize(shadow.under[sector][k], below, under.size(), 0, 0, cv::INTER_LINEAR);
      cv::resize(shadow.beside[sector][k], beside, under.size(), 0, 0, cv::INTER_LINEAR);
      mean[sector][k] = beside + under.mul(below - beside);
    }
  }
  return mean;
}

}  // namespace touchstone::render
