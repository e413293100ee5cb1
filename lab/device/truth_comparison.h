#pragma once
// An estimate held against a virtual device's truth: within the tolerance and the truth's own error bar, or how far
// out.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <string>

#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// How far an estimate may be off: absolute + relative x |truth| + standard_errors x the truth's standard error.
struct Tolerance {
  double absolute = 0.0;         ///< in the unit of what is compared
  double relative = 0.0;         ///< of a vector: of its length
  double standard_errors = 2.0;  ///< of the truth: what the simulator's mesh makes of it (fem::PressError)
};

/// The verdict, and a line that says why.
struct Comparison {
  bool within = false;
  std::string message;  ///< one line: estimate, truth, the worst part's error and what is allowed, and where that comes
                        ///< from; also for an estimate that is within
};

/// Each component of a force on the object, N.
/// @throws Error for a tolerance that is negative or isn't finite, as all of these
Comparison compare_force(const Eigen::Vector3d& estimate_N, const sim::Touch& truth, const Tolerance& tolerance);
/// Its component along z alone.
Comparison compare_normal_force(double estimate_N, const sim::Touch& truth, const Tolerance& tolerance);
/// The mean absolute error of a height map (CV_32FC1 or CV_64FC1, mm, in the camera's pixels) over the pixels that see
/// membrane; `relative` is of the deepest height. An estimate that isn't finite in one of those pixels isn't within.
/// @throws Error also if the truth has no height, or the map has another type or size
Comparison compare_heights(const cv::Mat& estimate_mm, const sim::Touch& truth, const Tolerance& tolerance);
/// Pixels of both contacts over pixels of either, 0 to 1; two empty ones are 1. The mesh has no error bar for it.
/// @param estimate CV_8UC1, not 0 where the gel lies on the object @throws Error also for a mask of another type or
/// size
Comparison compare_contact(const cv::Mat& estimate, const sim::Touch& truth, double least_overlap);
/// Each component of each bead's displacement, m x 3, mm; `relative` is of the largest bead's displacement.
/// @throws Error also if the device has no beads, or not as many as there are rows
Comparison compare_beads(const Eigen::MatrixX3d& estimate_mm, const sim::Touch& truth, const Tolerance& tolerance);

}  // namespace touchstone::lab
