#include "sensors/touch_map/height_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace touchstone::sensors {
namespace {

constexpr double kTukey = 4.685;           // of the residuals' sigma: 95 % efficient for normal residuals
constexpr double kSigmaOfMedian = 1.4826;  // of normal residuals' median absolute value
constexpr std::size_t kLeastOverlapPixels = 50;
constexpr double kRounding_mm = 1e-6;  // detail below is what single precision leaves of a plane
constexpr double kWorse = 0.02;        // correlation lost by the alignment: robust weights may cost a little of it

/// A pixel of `from` that is looked up in `to`.
struct Sample {
  Eigen::Vector2d point;
  double value, weight;
};

std::vector<Sample> samples_of(const ReliefDetail& from, std::size_t most) {
  std::size_t touched = 0;
  for (int v = 0; v < from.weight.rows; ++v) {
    for (int u = 0; u < from.weight.cols; ++u) touched += from.weight.at<float>(v, u) > 0.0F;
  }
  const int stride =
      std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(touched) / static_cast<double>(most)))));
  std::vector<Sample> samples;
  for (int v = stride / 2; v < from.weight.rows; v += stride) {
    for (int u = stride / 2; u < from.weight.cols; u += stride) {
      const double weight = from.weight.at<float>(v, u);
      if (weight > 0.0) samples.push_back({from.frame.point_of({u, v}), from.detail_mm.at<float>(v, u), weight});
    }
  }
  return samples;
}

/// `to` under one sample: detail, its gradient along the axes (mm per mm) and the weight of both.
struct Lookup {
  double value = 0.0, weight = 0.0;
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
};

Lookup look_up(const ReliefDetail& to, const Sample& sample, const PlanarPose& pose) {
  const Eigen::Vector2d pixel = to.frame.pixel_of(pose * sample.point);
  const int u = static_cast<int>(std::floor(pixel.x())), v = static_cast<int>(std::floor(pixel.y()));
  if (!(u >= 0 && v >= 0 && u + 1 < to.weight.cols && v + 1 < to.weight.rows)) return {};
  const double s = pixel.x() - u, t = pixel.y() - v;
  const auto corners = [&](const cv::Mat& image) {
    return Eigen::Vector4d(image.at<float>(v, u), image.at<float>(v, u + 1), image.at<float>(v + 1, u),
                           image.at<float>(v + 1, u + 1));
  };
  const Eigen::Vector4d weights = corners(to.weight);
  if (!(weights.minCoeff() > 0.0)) return {};
  const Eigen::Vector4d shares((1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t);
  const Eigen::Vector4d d = corners(to.detail_mm);
  return {
      d.dot(shares), sample.weight * weights.dot(shares),
      Eigen::Vector2d((1.0 - t) * (d[1] - d[0]) + t * (d[3] - d[2]), (1.0 - s) * (d[2] - d[0]) + s * (d[3] - d[1])) /
          to.frame.mm_per_px};
}

/// Weighted straight-line fit to = gain * from + offset, and how well it does.
struct LineFit {
  double gain = 1.0, offset = 0.0, correlation = 0.0, overlap = 0.0;
  std::size_t pixels = 0;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
};

LineFit fit_line(const std::vector<Sample>& samples, const std::vector<Lookup>& lookups) {
  double w = 0.0, x = 0.0, y = 0.0, all = 0.0;
  LineFit fit;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double weight = lookups[i].weight;
    all += samples[i].weight;
    if (!(weight > 0.0)) continue;
    ++fit.pixels;
    fit.overlap += samples[i].weight;
    w += weight, x += weight * samples[i].value, y += weight * lookups[i].value;
    fit.middle += weight * samples[i].point;
  }
  if (!(w > 0.0)) return {};
  fit.overlap /= all;
  fit.middle /= w;
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double a = samples[i].value - x / w, b = lookups[i].value - y / w;
    xx += lookups[i].weight * a * a, xy += lookups[i].weight * a * b, yy += lookups[i].weight * b * b;
  }
  if (!(xx > 0.0) || !(yy > 0.0)) return fit;
  fit.correlation = xy / std::sqrt(xx * yy);
  fit.gain = xy / xx;
  fit.offset = y / w - fit.gain * x / w;
  return fit;
}

std::vector<Lookup> look_up_all(const ReliefDetail& to, const std::vector<Sample>& samples, const PlanarPose& pose) {
  std::vector<Lookup> lookups;
  lookups.reserve(samples.size());
  for (const Sample& sample : samples) lookups.push_back(look_up(to, sample, pose));
  return lookups;
}

/// Five unknowns of a step: turn about `middle`, shift, gain, offset. Empty where the system is singular.
std::optional<Eigen::Matrix<double, 5, 1>> step(const std::vector<Sample>& samples, const std::vector<Lookup>& lookups,
                                                const LineFit& line, const PlanarPose& pose) {
  std::vector<double> residuals;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (lookups[i].weight > 0.0) {
      residuals.push_back(std::abs(line.gain * samples[i].value + line.offset - lookups[i].value));
    }
  }
  const auto median = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), median, residuals.end());
  const double limit = std::max(kTukey * kSigmaOfMedian * *median, 1e-12);

  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> right = Eigen::Matrix<double, 5, 1>::Zero();
  const Eigen::Matrix2d rotation = pose.rotation();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!(lookups[i].weight > 0.0)) continue;
    const double residual = line.gain * samples[i].value + line.offset - lookups[i].value;
    const double ratio = residual / limit;
    if (std::abs(ratio) >= 1.0) continue;
    const double weight = lookups[i].weight * (1.0 - ratio * ratio) * (1.0 - ratio * ratio);
    const Eigen::Vector2d arm = rotation * (samples[i].point - line.middle);
    const Eigen::Vector2d& gradient = lookups[i].gradient;
    Eigen::Matrix<double, 5, 1> row;
    row << gradient.y() * arm.x() - gradient.x() * arm.y(), gradient.x(), gradient.y(), -samples[i].value, -1.0;
    normal += weight * row * row.transpose();
    right += weight * residual * row;
  }
  const Eigen::Matrix<double, 5, 1> scale = normal.diagonal().cwiseSqrt();
  if (!(scale.minCoeff() > 0.0)) return std::nullopt;
  const Eigen::Matrix<double, 5, 5> even =
      scale.cwiseInverse().asDiagonal() * normal * scale.cwiseInverse().asDiagonal();
  const Eigen::LDLT<Eigen::Matrix<double, 5, 5>> factor(even);
  constexpr double kSingular = 1e-9;
  if (!(factor.vectorD().minCoeff() > kSingular)) return std::nullopt;
  return scale.cwiseInverse().cwiseProduct(factor.solve(scale.cwiseInverse().cwiseProduct(right)));
}

Alignment judged(const PlanarPose& pose, const LineFit& line) {
  Alignment result;
  result.to_from_from = pose;
  result.correlation = line.correlation;
  result.overlap = line.overlap;
  return result;
}

}  // namespace

Alignment compare(const ReliefDetail& from, const ReliefDetail& to, const PlanarPose& pose,
                  const AlignmentSettings& settings) {
  const std::vector<Sample> samples = samples_of(from, settings.most_pixels);
  return judged(pose, fit_line(samples, look_up_all(to, samples, pose)));
}

Alignment align(const ReliefDetail& from, const ReliefDetail& to, const PlanarPose& start,
                const AlignmentSettings& settings) {
  const std::vector<Sample> samples = samples_of(from, settings.most_pixels);
  PlanarPose pose = start;
  std::vector<Lookup> lookups = look_up_all(to, samples, pose);
  LineFit line = fit_line(samples, lookups);
  const Alignment unmoved = judged(start, line);
  if (std::min(from.rms_mm, to.rms_mm) < kRounding_mm) return unmoved;
  for (int steps = 1; steps <= settings.most_steps && line.pixels >= kLeastOverlapPixels; ++steps) {
    const auto change = step(samples, lookups, line, pose);
    if (!change) break;
    const Eigen::Vector2d middle = pose * line.middle + change->segment<2>(1);
    pose.angle = wrapped(pose.angle + (*change)[0]);
    pose.translation = middle - pose.rotation() * line.middle;
    if ((middle - start * line.middle).norm() > settings.most_moved_mm) break;
    double reach = 0.0;  // of the turn, at the farthest point
    for (const Sample& sample : samples) reach = std::max(reach, (sample.point - line.middle).norm());
    lookups = look_up_all(to, samples, pose);
    line = fit_line(samples, lookups);
    if (change->segment<2>(1).norm() + std::abs((*change)[0]) * reach > settings.least_step_mm) continue;
    if (line.correlation < unmoved.correlation - kWorse) break;
    Alignment result = judged(pose, line);
    result.steps = steps;
    result.converged = true;
    return result;
  }
  return unmoved;
}

}  // namespace touchstone::sensors
