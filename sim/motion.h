#pragma once
// How an object is moved: keys between which poses and forces run linearly. See docs/file-formats.md.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/yaml_reader.h"

namespace touchstone::sim {

/// One translation axis at a key: a position of the object's origin, or a force on the object, gel frame. Exactly one.
struct AxisKey {
  std::optional<double> position_mm;
  std::optional<double> force_N;
};

/// What holds at the end of `frames` more frames. An axis that isn't named keeps what it had.
struct MotionKey {
  int frames = 1;
  std::optional<AxisKey> x, y, z;
  std::optional<Eigen::Vector3d> angles_deg;  ///< about x, then y, then z
  SourceLocation where;
};

/// The first frame shows the start; each key adds its frames. A ramp of force starts at the force that was there.
struct MotionSpec {
  Eigen::Vector3d start_mm = {0, 0, 1};
  Eigen::Vector3d start_angles_deg = Eigen::Vector3d::Zero();
  double frame_rate_Hz = 30.0;
  std::vector<MotionKey> keys;

  int frame_count() const;
  /// Tangential motion, tilt or shear force anywhere in it: what calls for friction.
  bool is_tangential() const;
};

void fields(YamlReader& in, AxisKey& axis);
void fields(YamlReader& in, MotionKey& key);
void fields(YamlReader& in, MotionSpec& motion);

}  // namespace touchstone::sim
