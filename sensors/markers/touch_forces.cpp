#include "sensors/markers/touch_forces.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

/// Of the largest force: with less shear than that in all samples, what there is comes from the presses' tilt.
constexpr double kSheared = 0.1;

/// How far two sizes of a pixel may differ to be of the same pictures.
constexpr double kSameScale = 0.01;

/// The lines of some of the samples.
struct Lines {
  std::optional<LinearForce> normal, shear;
};

template <typename Wanted>
Lines fit_lines(std::span<const TouchForceSample> samples, bool normal, bool shear, const Wanted& wanted) {
  std::vector<double> sums, normal_N;
  std::vector<Eigen::Vector2d> moved, shear_N;
  for (const TouchForceSample& sample : samples) {
    if (!wanted(sample)) continue;
    if (normal) sums.push_back(*sample.height_sum_mm3);
    normal_N.push_back(sample.force_N.z());
    moved.push_back(sample.moved_mm);
    shear_N.emplace_back(-sample.force_N.head<2>());  // on the gel, which goes along with it
  }
  Lines lines;
  if (normal) lines.normal = fit_linear_force(sums, normal_N, FitLine::kFree);
  if (shear) lines.shear = fit_shear_force(moved, shear_N);
  return lines;
}

/// What the lines of the other series are off by on each sample, squared and summed. None if a series can't be left
/// out.
std::optional<Eigen::Vector3d> left_out_squares(std::span<const TouchForceSample> samples, bool normal, bool shear) {
  std::set<int> series;
  for (const TouchForceSample& sample : samples) series.insert(sample.series);
  if (series.size() < 2) return std::nullopt;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (const int one : series) {
    Lines lines;
    try {
      lines = fit_lines(samples, normal, shear, [&](const TouchForceSample& sample) { return sample.series != one; });
    } catch (const Error&) {
      return std::nullopt;  // the others alone don't determine a line
    }
    for (const TouchForceSample& sample : samples) {
      if (sample.series != one) continue;
      Eigen::Vector3d error = -sample.force_N;
      if (lines.shear) error.head<2>() -= shear_force_N(*lines.shear, sample.moved_mm);
      if (lines.normal) error.z() += lines.normal->force_N(*sample.height_sum_mm3);
      squares += error.cwiseAbs2();
    }
  }
  return squares;
}

}  // namespace

std::optional<TouchForceSample> force_sample(const TouchReading& touch, const Eigen::Vector3d& force_N,
                                             double mm_per_px, int series) {
  if (!touch.trusted || !touch.patch || touch.moved.markers == 0) return std::nullopt;
  return TouchForceSample{touch.height_sum_mm3, mm_per_px * touch.moved.px, force_N, series};
}

void use_forces(TouchCalibration& parts, const GelForceModel& model, const std::string& indenter) {
  const double given = parts.mm_per_px == 0.0 && parts.height ? parts.height->mm_per_px : parts.mm_per_px;
  if (given > 0.0 && std::abs(given / model.mm_per_px - 1.0) > kSameScale) {
    fail("force model of {}: it was fitted at {} mm a pixel, these pictures have {}", model.gel, model.mm_per_px,
         given);
  }
  parts.mm_per_px = model.mm_per_px;
  parts.shear = model.shear;
  parts.normal.reset();
  if (!indenter.empty()) {
    if (!parts.height) fail("force model of {}: the normal force of '{}' needs a height model", model.gel, indenter);
    parts.normal = normal_line(model, indenter);
  } else if (parts.height && !model.normal.empty()) {
    if (model.normal.size() > 1) {
      std::vector<std::string> known;
      for (const GelForceModel::Normal& one : model.normal) known.push_back(one.indenter);
      fail("force model of {}: it has several indenters, one must be named: {}", model.gel, fmt::join(known, ", "));
    }
    parts.normal = model.normal.front().line;
  }
  if (!parts.normal && !parts.shear) {
    fail("force model of {}: it has {}, so no force can be read{}", model.gel,
         model.normal.empty() ? "no line for shear" : "no line for shear, and normal force is read from heights",
         parts.height ? "" : " without a height model");
  }
}

GelForceFit fit_gel_forces(std::span<const TouchForceSample> samples, double mm_per_px, const std::string& gel,
                           const std::string& indenter) {
  if (samples.empty()) fail("force fit: there is no frame in which something touches");
  const bool normal = samples.front().height_sum_mm3.has_value();
  double largest_N = 0.0, largest_shear_N = 0.0;
  for (const TouchForceSample& sample : samples) {
    if (sample.height_sum_mm3.has_value() != normal) fail("force fit: some samples have heights and some don't");
    largest_N = std::max(largest_N, sample.force_N.cwiseAbs().maxCoeff());
    largest_shear_N = std::max(largest_shear_N, sample.force_N.head<2>().norm());
  }
  const bool shear = largest_shear_N >= kSheared * largest_N && largest_shear_N > 0.0;
  if (!normal && !shear) {
    fail(
        "force fit: without a height model only shear can be read, and the largest shear force is {:.3g} N of {:.3g} "
        "N; at least {} of it is needed",
        largest_shear_N, largest_N, kSheared);
  }
  const Lines lines = fit_lines(samples, normal, shear, [](const TouchForceSample&) { return true; });
  GelForceFit fit;
  fit.model.gel = gel;
  fit.model.mm_per_px = mm_per_px;
  if (lines.normal) fit.model.normal.push_back({indenter, *lines.normal});
  fit.model.shear = lines.shear;
  if (const std::string fault = fault_of(fit.model); !fault.empty()) fail("force fit: the model {}", fault);
  if (const auto squares = left_out_squares(samples, normal, shear)) {
    const Eigen::Vector3d rms = (*squares / static_cast<double>(samples.size())).cwiseSqrt();
    if (shear) fit.left_out_N[0] = rms.x(), fit.left_out_N[1] = rms.y();
    if (normal) fit.left_out_N[2] = rms.z();
  }
  return fit;
}

}  // namespace touchstone::sensors
