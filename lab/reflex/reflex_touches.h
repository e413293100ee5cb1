#pragma once
// Touches of the reflex fingertip, ready to be shown to its chip: what presses at finite strain gave, and the light of
// any place on their paths.

#include <Eigen/Core>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/progress.h"
#include "lab/reflex/reflex_light.h"
#include "lab/reflex/reflex_presses.h"
#include "lab/reflex/reflex_record.h"
#include "render/imager/motion_chip.h"
#include "sim/press/press_path.h"

namespace touchstone::lab {

/// What is true at a place of a touch's path.
struct ReflexTruth {
  bool contact = false;
  double press_mm = 0.0;  ///< from where the object touches; the gap, negative, where it doesn't
  Eigen::Vector2d lateral_mm = Eigen::Vector2d::Zero();  ///< of the object
  double normal_N = 0.0;                                 ///< along z, positive into the fingertip
  Eigen::Vector2d shear_N = Eigen::Vector2d::Zero();     ///< of the object on the fingertip, along its motion
};

/// A touch that was played and can be looked at. Places are those of its path, depths or travels in mm; negative ones
/// are gaps over the touch.
struct ReflexTouch {
  std::string name;
  std::vector<double> at;           ///< of its states, rising from 0
  std::vector<ReflexTruth> states;  ///< as many
  ReflexPathLight path_light;
  std::string stopped;  ///< why the path could be played no further; empty if it could

  double end() const { return at.back(); }
  /// Straight between two states, the last one beyond them. In contact is what is beyond 0.
  ReflexTruth truth(double place) const;
};

/// A press by its name.
struct ReflexTouchSpec {
  std::string name;
  sim::PressPath path;
};

/// The touches of the rows. In full: a plate straight down to 5 mm ("plate"), held-out loads to 4 mm ("tilt", 10
/// degrees; "ball"; "cylinder"), and shear of 1.5 mm to and fro ("shear-x-2", "shear-x-4", "shear-y-2", "shear-y-4"
/// and, to be tested on, "shear-45-3": direction and depth in mm). In the quick form the plate alone, in larger steps.
std::vector<ReflexTouchSpec> reflex_row_touches(bool quick);

/// The device, its chip and its touches. Immutable.
struct ReflexSetup {
  sim::DeviceSpec device;
  render::MotionChipSettings chip;
  render::DirectError light_error;  ///< against path tracing (ReflexLight::error)
  std::vector<ReflexTouch> touches;
  std::vector<std::string> notes;  ///< of caches

  const ReflexTouch& touch(const std::string& name) const;  ///< @pre it's one of them
  /// A chip that begins to record: of this unit, with noise of its own.
  render::MotionChip start_chip(std::uint64_t noise_seed) const { return {chip, 1, noise_seed}; }
};

/// Plays all paths (or takes them from the cache) and makes their light.
/// @throws Error as its parts, for a path that doesn't begin with a touch at 0, and if none has two states
ReflexSetup set_up_reflex(const sim::DeviceSpec& device, const std::filesystem::path& cache_folder,
                          std::span<const ReflexTouchSpec> specs, const ReflexLightSettings& light = {},
                          const ReflexPathLightSettings& path_light = {}, const Progress& progress = {});

}  // namespace touchstone::lab
