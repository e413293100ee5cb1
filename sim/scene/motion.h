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

/// An axis of the gel frame.
enum class Axis { x, y, z };
EnumNames<Axis> enum_names(Axis);

/// A steady vibration over a key's frames: amplitude_mm * sin(2 pi frequency_Hz t), t counted from the key's start, is
/// added to the position along `axis`. Its mean is led as the key says; an axis that had a force is held where it was.
struct VibrationSpec {
  Axis axis = Axis::z;
  double amplitude_mm = 0.0;
  double frequency_Hz = 0.0;
};

/// The object is free to turn about an axis of the gel frame, until the torque on it is this one.
struct TurnKey {
  double torque_Nmm = 0.0;  ///< on the object, about its origin
};

/// What holds at the end of `frames` more frames. An axis that isn't named keeps what it had.
struct MotionKey {
  int frames = 1;
  std::optional<AxisKey> x, y, z;
  std::optional<Eigen::Vector3d> angles_deg;      ///< about x, then y, then z; ends all torques
  std::optional<TurnKey> turn_x, turn_y, turn_z;  ///< not beside angles_deg
  std::optional<VibrationSpec> vibration;
  SourceLocation where;
};

/// The first frame shows the start; each key adds its frames. A ramp of force or torque starts at what was there.
struct MotionSpec {
  Eigen::Vector3d start_mm = {0, 0, 1};
  Eigen::Vector3d start_angles_deg = Eigen::Vector3d::Zero();
  double frame_rate_Hz = 30.0;
  std::vector<MotionKey> keys;

  /// The frame of the start and those of all keys.
  int frame_count() const;
  /// Whether any key leads it by torques.
  bool is_turned() const;
  /// Tangential motion, tilt, torque or shear force anywhere in it: what calls for friction.
  bool is_tangential() const;
  /// The highest frequency at which it vibrates, 0 if it doesn't.
  double highest_vibration_Hz() const;
};

void fields(YamlReader& in, AxisKey& axis);
void fields(YamlReader& in, VibrationSpec& vibration);
void fields(YamlReader& in, TurnKey& turn);
void fields(YamlReader& in, MotionKey& key);
void fields(YamlReader& in, MotionSpec& motion);

}  // namespace touchstone::sim
