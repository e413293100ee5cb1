#include "sensors/markers/linear_force.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

/// The least mean cosine, weighed by lengths, between displacements and the forces that they are to measure.
constexpr double kAlongside = 0.5;

}  // namespace

LinearForce fit_linear_force(std::span<const double> measure, std::span<const double> force_N, FitLine line) {
  if (measure.size() != force_N.size()) {
    fail("force fit: {} measures and {} forces, as many of both are needed", measure.size(), force_N.size());
  }
  if (measure.size() < 3) fail("force fit: {} samples, at least 3 are needed", measure.size());
  const auto n = static_cast<double>(measure.size());
  double measure_mean = 0.0, force_mean = 0.0;
  for (std::size_t i = 0; i < measure.size(); ++i) {
    if (!std::isfinite(measure[i]) || !std::isfinite(force_N[i])) {
      fail("force fit: sample {} is ({}, {} N), finite numbers are needed", i, measure[i], force_N[i]);
    }
    measure_mean += measure[i] / n;
    force_mean += force_N[i] / n;
  }
  const auto [low, high] = std::minmax_element(measure.begin(), measure.end());
  const auto [least_force, most_force] = std::minmax_element(force_N.begin(), force_N.end());
  // Numbers that differ by what rounding left of their sums are one number: the line through them is anything.
  const auto are_one = [](double a, double b) { return b - a <= 1e-12 * std::max(std::abs(a), std::abs(b)); };
  if (are_one(*low, *high)) fail("force fit: all measures are {}, a line needs two", *low);
  if (are_one(*least_force, *most_force)) fail("force fit: all forces are {} N, a line needs two", *least_force);

  const double x0 = line == FitLine::kFree ? measure_mean : 0.0;
  const double y0 = line == FitLine::kFree ? force_mean : 0.0;
  double xx = 0.0, xy = 0.0;
  for (std::size_t i = 0; i < measure.size(); ++i) {
    xx += (measure[i] - x0) * (measure[i] - x0);
    xy += (measure[i] - x0) * (force_N[i] - y0);
  }
  LinearForce fit;
  fit.newton_per_unit = xy / xx;
  fit.offset_N = y0 - fit.newton_per_unit * x0;
  double residuals = 0.0, about_mean = 0.0;
  for (std::size_t i = 0; i < measure.size(); ++i) {
    const double residual = force_N[i] - fit.force_N(measure[i]);
    residuals += residual * residual;
    about_mean += (force_N[i] - force_mean) * (force_N[i] - force_mean);
    fit.largest_residual_N = std::max(fit.largest_residual_N, std::abs(residual));
  }
  fit.r2 = 1.0 - residuals / about_mean;
  fit.rms_residual_N = std::sqrt(residuals / n);
  fit.lowest_seen = *low;
  fit.highest_seen = *high;
  fit.samples = static_cast<int>(measure.size());
  return fit;
}

LinearForce fit_shear_force(std::span<const Eigen::Vector2d> displacement_mm,
                            std::span<const Eigen::Vector2d> force_N) {
  std::vector<double> lengths_mm, lengths_N;
  for (const Eigen::Vector2d& one : displacement_mm) lengths_mm.push_back(one.norm());
  for (const Eigen::Vector2d& one : force_N) lengths_N.push_back(one.norm());
  LinearForce fit = fit_linear_force(lengths_mm, lengths_N, FitLine::kThroughOrigin);
  double along = 0.0, lengths = 0.0, moved = 0.0, about_mean = 0.0, residuals = 0.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < force_N.size(); ++i) {
    along += force_N[i].dot(displacement_mm[i]);
    lengths += lengths_N[i] * lengths_mm[i];
    moved += displacement_mm[i].squaredNorm();
    mean += force_N[i] / static_cast<double>(force_N.size());
  }
  if (!(along >= kAlongside * lengths)) {
    fail(
        "shear fit: markers don't go against the forces on the object, whose x must point to the picture's right and y "
        "down: the mean cosine of displacements and forces on the gel is {:.2f}, at least {} is needed",
        along / lengths, kAlongside);
  }
  fit.newton_per_unit = along / moved;
  fit.largest_residual_N = 0.0;
  for (std::size_t i = 0; i < force_N.size(); ++i) {
    const Eigen::Vector2d residual = force_N[i] - fit.newton_per_unit * displacement_mm[i];
    residuals += residual.squaredNorm();
    about_mean += (force_N[i] - mean).squaredNorm();
    fit.largest_residual_N = std::max(fit.largest_residual_N, residual.cwiseAbs().maxCoeff());
  }
  fit.r2 = 1.0 - residuals / about_mean;
  fit.rms_residual_N = std::sqrt(0.5 * residuals / static_cast<double>(force_N.size()));
  return fit;
}

Eigen::Vector2d shear_force_N(const LinearForce& line, const Eigen::Vector2d& displacement_mm) {
  const double length = displacement_mm.norm();
  if (!(length > 0.0)) return Eigen::Vector2d::Zero();
  return std::max(line.force_N(length), 0.0) / length * displacement_mm;
}

double height_sum_mm3(const cv::Mat& height_mm, double mm_per_px) {
  if (height_mm.empty() || height_mm.type() != CV_32FC1) fail("height sum: a height map of type CV_32FC1 is needed");
  if (!(mm_per_px > 0.0) || !std::isfinite(mm_per_px))
    fail("height sum: a pixel of {} mm, above 0 is needed", mm_per_px);
  double sum = 0.0;
  for (int y = 0; y < height_mm.rows; ++y) {
    const float* row = height_mm.ptr<float>(y);
    for (int x = 0; x < height_mm.cols; ++x) sum += static_cast<double>(row[x]);
  }
  if (!std::isfinite(sum)) fail("height sum: the height map has values that aren't finite");
  return sum * mm_per_px * mm_per_px;
}

std::size_t samples_before_slip(std::span<const double> force_N, double part) {
  TS_ASSERT(part > 0.0 && part <= 1.0);
  if (force_N.empty()) return 0;
  const double largest = *std::max_element(force_N.begin(), force_N.end());
  const auto reached =
      std::find_if(force_N.begin(), force_N.end(), [&](double force) { return force >= part * largest; });
  return static_cast<std::size_t>(reached - force_N.begin());
}

}  // namespace touchstone::sensors
