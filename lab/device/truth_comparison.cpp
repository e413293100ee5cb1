#include "lab/device/truth_comparison.h"

#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::lab {
namespace {

constexpr double kLargeStrain = 0.2;  // above it linear elasticity's percents aren't to be trusted (fem::PressState)

void check(const Tolerance& tolerance) {
  for (const double part : {tolerance.absolute, tolerance.relative, tolerance.standard_errors}) {
    if (!(part >= 0.0) || !std::isfinite(part)) {
      fail("a tolerance has absolute {}, relative {} and standard_errors {}; allowed are numbers from 0",
           tolerance.absolute, tolerance.relative, tolerance.standard_errors);
    }
  }
}

double allowed(const Tolerance& tolerance, double size, double standard_error) {
  return tolerance.absolute + tolerance.relative * size + tolerance.standard_errors * standard_error;
}

std::string allowance(const Tolerance& tolerance, double size, double standard_error, const char* unit) {
  std::string parts;
  const auto add = [&](const std::string& part) { parts += (parts.empty() ? "" : " + ") + part; };
  if (tolerance.absolute > 0.0) add(fmt::format("{:.3g}", tolerance.absolute));
  if (tolerance.relative > 0.0) add(fmt::format("{:g} x {:.3g}", tolerance.relative, size));
  add(fmt::format("{:g} x {:.2g} standard error of the truth", tolerance.standard_errors, standard_error));
  return fmt::format("{:.3g} {} ({})", allowed(tolerance, size, standard_error), unit, parts);
}

/// What else a reader should know of the truth.
std::string doubts(const sim::Touch& truth) {
  std::string words;
  if (truth.press.under_resolved) words += "; few of the mesh's vertices touch, so the truth may be percents off";
  if (truth.press.largest_strain > kLargeStrain) {
    words += fmt::format("; the gel's strain reaches {:.2f}, so linear elasticity may be percents off",
                         truth.press.largest_strain);
  }
  return words;
}

std::string in_words(const Eigen::Vector3d& v, const char* unit) {
  return fmt::format("({:.3f}, {:.3f}, {:.3f}) {}", v.x(), v.y(), v.z(), unit);
}

void check_picture(const cv::Mat& estimate, const cv::Mat& truth, const char* what) {
  if (estimate.size() == truth.size()) return;
  fail("{} has {} x {} pixels; the device's pictures have {} x {}", what, estimate.cols, estimate.rows, truth.cols,
       truth.rows);
}

}  // namespace

Comparison compare_force(const Eigen::Vector3d& estimate, const sim::Touch& truth, const Tolerance& tolerance) {
  check(tolerance);
  const double size = truth.force_N().norm();
  const Eigen::Vector3d off = estimate - truth.force_N();
  Comparison comparison{true, {}};
  int worst = 0;
  double most = -1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double limit = allowed(tolerance, size, truth.error.force[axis]);
    if (!(std::abs(off[axis]) <= limit)) comparison.within = false;
    const double beyond = std::isfinite(off[axis]) ? std::abs(off[axis]) - limit : HUGE_VAL;
    if (axis == 0 || beyond > most) {
      most = beyond;
      worst = axis;
    }
  }
  comparison.message =
      fmt::format("force {} against {} of {}: {} is off by {:+.3f} N, allowed are {}{}", in_words(estimate, "N"),
                  in_words(truth.force_N(), "N"), truth.what, "xyz"[worst], off[worst],
                  allowance(tolerance, size, truth.error.force[worst], "N"), doubts(truth));
  return comparison;
}

Comparison compare_normal_force(double estimate, const sim::Touch& truth, const Tolerance& tolerance) {
  check(tolerance);
  const double z = truth.force_N().z();
  const double off = estimate - z;
  return {std::abs(off) <= allowed(tolerance, std::abs(z), truth.error.force.z()),
          fmt::format("normal force {:.3f} N against {:.3f} N of {}: off by {:+.3f} N, allowed are {}{}", estimate, z,
                      truth.what, off, allowance(tolerance, std::abs(z), truth.error.force.z(), "N"), doubts(truth))};
}

Comparison compare_heights(const cv::Mat& estimate_mm, const sim::Touch& truth, const Tolerance& tolerance) {
  check(tolerance);
  if (truth.height.empty()) fail("{}: has no height to compare with", truth.what);
  if (estimate_mm.type() != CV_32F && estimate_mm.type() != CV_64F) {
    fail("a height map must have one channel of floats or doubles (CV_32FC1 or CV_64FC1)");
  }
  check_picture(estimate_mm, truth.height, "the height map");
  cv::Mat estimate;
  estimate_mm.convertTo(estimate, CV_64F);
  double sum = 0.0, worst = -1.0, deepest = 0.0;
  cv::Point where;
  int pixels = 0, missing = 0;
  for (int row = 0; row < estimate.rows; ++row) {
    for (int column = 0; column < estimate.cols; ++column) {
      const double height = truth.height.at<float>(row, column);
      if (std::isnan(height)) continue;
      ++pixels;
      deepest = std::max(deepest, std::abs(height));
      const double off = std::abs(estimate.at<double>(row, column) - height);
      if (!std::isfinite(off)) {
        ++missing;
        continue;
      }
      sum += off;
      if (off > worst) {
        worst = off;
        where = {column, row};
      }
    }
  }
  if (pixels == missing) {
    return {false, fmt::format("the height map has no finite height where {} has membrane", truth.what)};
  }
  const double mean = sum / (pixels - missing);
  Comparison comparison;
  comparison.within = missing == 0 && mean <= allowed(tolerance, deepest, truth.error.displacement);
  comparison.message = fmt::format(
      "heights of {} (deepest {:.3f} mm): off by {:.4f} mm in the mean, allowed are {}; most at pixel ({}, {}), {:.3f} "
      "mm "
      "against {:.3f} mm{}{}",
      truth.what, deepest, mean, allowance(tolerance, deepest, truth.error.displacement, "mm"), where.x, where.y,
      estimate.at<double>(where), truth.height.at<float>(where),
      missing == 0 ? "" : fmt::format("; {} of {} pixels aren't finite", missing, pixels), doubts(truth));
  return comparison;
}

Comparison compare_contact(const cv::Mat& estimate, const sim::Touch& truth, double least_overlap) {
  if (!(least_overlap >= 0.0 && least_overlap <= 1.0)) fail("least overlap {}; allowed is 0 to 1", least_overlap);
  if (estimate.type() != CV_8U) fail("a contact mask must have one channel of 8 bits (CV_8UC1)");
  check_picture(estimate, truth.contact, "the contact mask");
  const cv::Mat touched = estimate != 0;
  const int both = cv::countNonZero(touched & truth.contact);
  const int either = cv::countNonZero(touched | truth.contact);
  const double overlap = either == 0 ? 1.0 : static_cast<double>(both) / either;
  return {overlap >= least_overlap,
          fmt::format("contact of {}: {} pixels against {}, they overlap by {:.3f}, wanted is {:g} or more", truth.what,
                      cv::countNonZero(touched), cv::countNonZero(truth.contact), overlap, least_overlap)};
}

Comparison compare_beads(const Eigen::MatrixX3d& estimate, const sim::Touch& truth, const Tolerance& tolerance) {
  check(tolerance);
  const Eigen::MatrixX3d& beads = truth.press.bead_displacement;
  if (beads.rows() == 0) fail("{}: the device has no beads", truth.what);
  if (estimate.rows() != beads.rows()) {
    fail("displacements of {} beads are given; the device has {}", estimate.rows(), beads.rows());
  }
  const double size = beads.rowwise().norm().maxCoeff();
  const double limit = allowed(tolerance, size, truth.error.beads);
  Eigen::Index bead = 0, axis = 0;
  const Eigen::ArrayX3d off =
      (estimate - beads).array().unaryExpr([](double x) { return std::isfinite(x) ? std::abs(x) : HUGE_VAL; });
  const double worst = off.maxCoeff(&bead, &axis);
  return {worst <= limit,
          fmt::format("beads of {}: bead {} went {}, the truth is {}; its {} is off by {:.4f} mm, allowed are {}{}",
                      truth.what, bead, in_words(estimate.row(bead).transpose(), "mm"),
                      in_words(beads.row(bead).transpose(), "mm"), "xyz"[axis], worst,
                      allowance(tolerance, size, truth.error.beads, "mm"), doubts(truth))};
}

}  // namespace touchstone::lab
