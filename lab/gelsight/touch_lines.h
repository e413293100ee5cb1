#pragma once
// What a gel with markers reads in each frame, as the table touch.csv (docs/file-formats.md, "Recorded frames").

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "datasets/sources/frame_sequence.h"
#include "sensors/markers/touch_reader.h"

namespace touchstone::lab {

/// The table's first line.
std::string touch_header();

/// A frame's line. @param start what it begins with: sequence, frame, file and time, with a comma at the end
/// @param true_force_N on the object, x along u, y along v, where it's known
std::string touch_line(const std::string& start, const sensors::TouchReading& touch,
                       const std::optional<Eigen::Vector3d>& true_force_N);

/// The line of a frame that can't be used, which says why.
std::string touch_fault_line(const std::string& start, const std::string& fault);

/// Frames of a sequence by what they showed, and how far forces are off where they are known.
struct TouchCount {
  std::int64_t touched = 0;
  std::int64_t slips = 0;   ///< by either detector
  std::int64_t beyond = 0;  ///< beyond what the force model was fitted to
  /// Of x, y and z, over frames with a known force and an estimate.
  struct Errors {
    std::int64_t frames = 0;
    double squares_N2 = 0.0;
    double largest_N = 0.0;
    std::int64_t within_two = 0;  ///< frames off by at most two of their standard errors
  };
  std::array<Errors, 3> errors;

  /// Adds a frame. Untrusted ones have no say in the errors.
  void add(const sensors::TouchReading& touch, const std::optional<Eigen::Vector3d>& true_force_N);
};

}  // namespace touchstone::lab
