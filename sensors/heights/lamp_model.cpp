#include "sensors/heights/lamp_model.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/heights/height_map.h"

namespace touchstone::sensors {
namespace {

constexpr double kDarkest_DN = 4.0;  // a background below isn't divided by
constexpr int kLeastSamples = 30;
constexpr int kBins = 40;  // along the picture's width: as one place in the fit

/// n - n_rest.
Eigen::Vector3d tilt(const Eigen::Vector2d& slope) {
  return normal_of(slope) - Eigen::Vector3d::UnitZ();
}

/// The tilt's derivative by the slope.
Eigen::Matrix<double, 3, 2> tilt_derivative(const Eigen::Vector2d& slope) {
  const double length = std::sqrt(1.0 + slope.squaredNorm());
  const Eigen::Vector3d raw(-slope.x(), -slope.y(), 1.0);
  Eigen::Matrix<double, 3, 2> derivative = -raw * slope.transpose() / (length * length * length);
  derivative(0, 0) -= 1.0 / length;
  derivative(1, 1) -= 1.0 / length;
  return derivative;
}

/// What the middle would most likely have shown where the lamps `here` show a colour: the linear estimate of least mean
/// square error for tilts of the usual size and colours that matt shading misses by some digital numbers. It is
/// middle * here^-1 where that is well determined, and fades out along what the lamps don't determine.
Eigen::Matrix3d likeliest_map(const Eigen::Matrix3d& middle, const Eigen::Matrix3d& here) {
  const Eigen::Vector3d usual_tilt(0.1, 0.1, 0.02);  // variances of the normals of a press
  constexpr double kMisfit_DN = 3.0;
  const Eigen::Matrix3d spread = usual_tilt.asDiagonal() * here.transpose();
  const Eigen::Matrix3d seen = here * spread + kMisfit_DN * kMisfit_DN * Eigen::Matrix3d::Identity();
  return middle * spread * seen.inverse();
}

/// Of the least squares fit of lamps to some samples.
struct Sums {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d right = Eigen::Matrix3d::Zero();
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double count = 0.0;

  void add(const Sums& other, double weight) {
    normal += weight * other.normal;
    right += weight * other.right;
    place += weight * other.place;
    count += weight * other.count;
  }
};

/// The lamps at a place: a plane through those of the samples around it.
Eigen::Matrix3d lamps_near(const Eigen::Vector2d& place, const std::vector<Sums>& bins, const Sums& all,
                           const LampFit& how, int width) {
  double nearest = INFINITY;
  for (const Sums& bin : bins) nearest = std::min(nearest, (bin.place - place).squaredNorm());
  const double reach_px = how.reach * width;
  // Unknowns: the lamps here, and how they change along u and v in a reach.
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  Eigen::Matrix<double, 9, 3> right = Eigen::Matrix<double, 9, 3>::Zero();
  for (int i = 0; i < 3; ++i) normal.block<3, 3>(3 * i, 3 * i) = how.prior * all.normal;
  right.topRows<3>() = how.prior * all.right;
  for (const Sums& bin : bins) {
    const Eigen::Vector2d offset = (bin.place - place) / reach_px;
    const double weight = std::exp(-0.5 * (offset.squaredNorm() - nearest / (reach_px * reach_px)));
    const Eigen::Vector3d along(1.0, offset.x(), offset.y());
    for (int i = 0; i < 3; ++i) {
      right.middleRows<3>(3 * i) += weight * along[i] * bin.right;
      for (int j = 0; j < 3; ++j) normal.block<3, 3>(3 * i, 3 * j) += weight * along[i] * along[j] * bin.normal;
    }
  }
  return normal.ldlt().solve(right).topRows<3>().transpose();
}

}  // namespace

const char* name_of(LightCorrection correction) {
  switch (correction) {
    case LightCorrection::none:
      return "none";
    case LightCorrection::background:
      return "background";
    case LightCorrection::fitted:
      break;
  }
  return "fitted";
}

Eigen::Matrix3d LampModel::at(const Eigen::Vector2d& place) const {
  const double x = std::clamp(place.x() / width * columns - 0.5, 0.0, columns - 1.0);
  const double y = std::clamp(place.y() / height * rows - 0.5, 0.0, rows - 1.0);
  const int i = std::min(static_cast<int>(x), std::max(columns - 2, 0));
  const int j = std::min(static_cast<int>(y), std::max(rows - 2, 0));
  const auto node = [&](int column, int row) -> const Eigen::Matrix3d& {
    return nodes[static_cast<std::size_t>(std::min(row, rows - 1) * columns + std::min(column, columns - 1))];
  };
  const double s = x - i;
  const double t = y - j;
  return (1.0 - t) * ((1.0 - s) * node(i, j) + s * node(i + 1, j)) +
         t * ((1.0 - s) * node(i, j + 1) + s * node(i + 1, j + 1));
}

LampModel fit_lamps(std::span<const ColourSample> samples, const cv::Size& size, const LampFit& how) {
  if (how.columns < 1 || how.rows < 1 || !(how.reach > 0.0) || !(how.prior > 0.0)) {
    fail("lamps at {} x {} nodes, reach {}, prior {}: all must be above 0", how.columns, how.rows, how.reach,
         how.prior);
  }
  const double bin_px = static_cast<double>(size.width) / kBins;
  const int bins_down = static_cast<int>(size.height / bin_px) + 1;
  std::vector<Sums> bins(static_cast<std::size_t>(kBins * bins_down));
  Sums all;
  for (const ColourSample& sample : samples) {
    if (sample.saturated || static_cast<double>(sample.slope.norm()) > how.steepest) continue;
    const Eigen::Vector2d place = sample.place.cast<double>();
    const int i = std::clamp(static_cast<int>(place.x() / bin_px), 0, kBins - 1);
    const int j = std::clamp(static_cast<int>(place.y() / bin_px), 0, bins_down - 1);
    Sums one;
    const Eigen::Vector3d t = tilt(sample.slope.cast<double>());
    one.normal = t * t.transpose();
    one.right = t * sample.colour.cast<double>().transpose();
    one.place = place;
    one.count = 1.0;
    bins[static_cast<std::size_t>(j * kBins + i)].add(one, 1.0);
    all.add(one, 1.0);
  }
  if (all.count < kLeastSamples) {
    fail("{} calibration pixels with slopes up to {}; {} are needed to find the lamps", all.count, how.steepest,
         kLeastSamples);
  }
  std::erase_if(bins, [](const Sums& bin) { return bin.count <= 0.0; });
  for (Sums& bin : bins) bin.place /= bin.count;

  Eigen::Vector2d low = bins.front().place;
  Eigen::Vector2d high = low;
  for (const Sums& bin : bins) {
    low = low.cwiseMin(bin.place);
    high = high.cwiseMax(bin.place);
  }
  const Eigen::LDLT<Eigen::Matrix3d> factor(all.normal);
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 1e-9 * all.normal.trace())) {
    fail("the presses' slopes don't determine the lamps: they have to point in all directions");
  }
  const Eigen::Matrix3d mean = factor.solve(all.right).transpose();
  LampModel model{size.width, size.height, how.columns, how.rows, {}};
  for (int row = 0; row < how.rows; ++row) {
    for (int column = 0; column < how.columns; ++column) {
      const Eigen::Vector2d node((column + 0.5) * size.width / how.columns, (row + 0.5) * size.height / how.rows);
      const bool even = how.columns == 1 && how.rows == 1;
      model.nodes.push_back(even ? mean : lamps_near(node.cwiseMax(low).cwiseMin(high), bins, all, how, size.width));
    }
  }
  return model;
}

Eigen::Vector2d slope_by_lamps(const Eigen::Matrix3d& a, const Eigen::Vector3d& colour, double limit) {
  constexpr int kSteps = 6;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Vector3d miss = colour - a * tilt(slope);
    const Eigen::Matrix<double, 3, 2> derivative = a * tilt_derivative(slope);
    // A little damping: far out, normals hardly change with the slope.
    Eigen::Matrix2d normal = derivative.transpose() * derivative;
    normal.diagonal().array() += 1e-3 * (a.squaredNorm() + 1e-30);
    slope += normal.inverse() * (derivative.transpose() * miss);
    if (const double length = slope.norm(); length > limit) slope *= limit / length;
  }
  return slope;
}

ColourCorrection ColourCorrection::by_background(const cv::Mat& background_mean) {
  TS_ASSERT(background_mean.type() == CV_32FC3);
  ColourCorrection correction;
  cv::Mat smooth;
  const double sigma = background_mean.cols / 32.0;  // over noise, dust and markers, not over the lamps' fall-off
  cv::GaussianBlur(background_mean, smooth, {}, sigma, sigma, cv::BORDER_REPLICATE);
  const cv::Scalar mean = cv::mean(smooth);
  correction.gains_.create(smooth.size(), CV_32FC3);
  for (int v = 0; v < smooth.rows; ++v) {
    for (int u = 0; u < smooth.cols; ++u) {
      for (int c = 0; c < 3; ++c) {
        const double gain = mean[c] / std::max<double>(smooth.at<cv::Vec3f>(v, u)[c], kDarkest_DN);
        correction.gains_.at<cv::Vec3f>(v, u)[c] =
            static_cast<float>(std::clamp(gain, 1.0 / kLargestGain, kLargestGain));
      }
    }
  }
  return correction;
}

ColourCorrection ColourCorrection::by_lamps(const cv::Mat& background_mean, const LampModel& lamps) {
  TS_ASSERT(!lamps.nodes.empty());
  ColourCorrection correction = by_background(background_mean);
  correction.lamps_ = lamps;
  correction.middle_ = lamps.at({0.5 * lamps.width, 0.5 * lamps.height});
  return correction;
}

Eigen::Matrix3d ColourCorrection::unbounded_at(int u, int v) const {
  const cv::Vec3f gain = gains_.at<cv::Vec3f>(v, u);
  const Eigen::Matrix3d scale = Eigen::Vector3d(gain[0], gain[1], gain[2]).asDiagonal();
  return lamps_.nodes.empty() ? scale : likeliest_map(middle_, lamps_.at({u + 0.5, v + 0.5})) * scale;
}

Eigen::Matrix3d ColourCorrection::at(const Eigen::Vector2d& place) const {
  if (gains_.empty()) return Eigen::Matrix3d::Identity();
  const int u = std::clamp(static_cast<int>(place.x()), 0, gains_.cols - 1);
  const int v = std::clamp(static_cast<int>(place.y()), 0, gains_.rows - 1);
  Eigen::Matrix3d matrix = unbounded_at(u, v);
  for (int c = 0; c < 3; ++c) matrix.row(c) *= std::min(1.0, kLargestGain / matrix.row(c).lpNorm<1>());
  return matrix;
}

double ColourCorrection::bounded_share() const {
  if (gains_.empty()) return 0.0;
  std::int64_t bounded = 0;
  for (int v = 0; v < gains_.rows; ++v) {
    for (int u = 0; u < gains_.cols; ++u) {
      const cv::Vec3f gain = gains_.at<cv::Vec3f>(v, u);
      const double strongest = std::max<double>(
          {std::max({gain[0], gain[1], gain[2]}), unbounded_at(u, v).cwiseAbs().rowwise().sum().maxCoeff()});
      bounded += strongest >= kLargestGain ? 1 : 0;
    }
  }
  return static_cast<double>(bounded) / static_cast<double>(gains_.total());
}

}  // namespace touchstone::sensors
