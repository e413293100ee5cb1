#pragma once
// Presses at finite strain along given paths, kept state by state: what takes seconds a state is done once and kept on
// disk, and pictures of any moment are made of what lies between two states.

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/progress.h"
#include "fem/contact/press.h"
#include "fem/finite_strain/finite_gel.h"
#include "fem/shapes/contact_shape.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// Raised with each change of the file's layout, or of what fem::FinitePress answers.
inline constexpr int kPressPathFormat = 2;

/// A state that is wanted on the path.
struct PathPoint {
  double at = 0.0;                                     ///< the motion's own parameter: a depth, a travel, a time
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();  ///< gel frame, from where the object touches: z < 0 is into it
};

/// One rigid object's path, without a turn. It begins out of touch or from straight above the first point.
struct PressPath {
  std::variant<fem::SphereShape, fem::RoundedCylinder, fem::BoxShape> shape;
  double friction = 0.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< gel from object
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();      ///< of the object's origin where it touches, gel frame
  std::vector<PathPoint> points;                           ///< at least one, `at` rising
};

/// The body that presses, as fem takes it.
fem::ContactShape shape_of(const PressPath& path);

/// What came of a path.
struct PlayedPath {
  std::vector<double> at;               ///< of the states
  std::vector<fem::PressState> states;  ///< one a point, as far as they could be had
  std::string stopped;                  ///< why there are no more, with the point; empty if all could be had
  std::string note;                     ///< of the cache; empty if there is nothing to say

  /// The state at a place of the path, straight between two (state_between). @throws Error beyond the first or last
  fem::PressState state(double place) const;
};

/// Plays the path, point by point; `stopped` tells of a point that can't be reached.
/// @throws Error for a path without points, or whose points don't rise or aren't finite; for a shape, a friction or a
/// rotation that isn't allowed; and if the object isn't over the gel where it should touch
PlayedPath play_path(const fem::FiniteGel& gel, const PressPath& path, const Progress& progress = {});

/// Plays paths on one device's gel, or takes them from the cache. Not for several threads at once.
class PathPlayer {
 public:
  /// @throws Error for a device whose mesh isn't given by fine_mm. An empty folder keeps nothing
  PathPlayer(const DeviceSpec& device, std::filesystem::path cache_folder);

  /// play_path, from the cache if a sound file of this gel and path is there, else played and kept
  /// (`press-path-<SHA-256>.bin`). What is read is bit for bit what was played. A file that is cut short, changed or of
  /// another path is never used: PlayedPath::note says why.
  /// @throws Error as play_path
  PlayedPath play(const PressPath& path, const Progress& progress = {});

  /// Where the path is kept.
  std::filesystem::path file_of(const PressPath& path) const;
  /// How many paths weren't in the cache.
  int played() const { return played_; }

 private:
  DeviceSpec device_;
  std::filesystem::path folder_;
  std::string gel_key_;
  std::shared_ptr<const fem::FiniteGel> gel_;  ///< made when first needed
  int played_ = 0;
};

}  // namespace touchstone::sim
