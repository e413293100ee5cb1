#pragma once
// Frames that an estimator is trained or tested on, with what is true of them and what they cost.

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "sim/press/press_spec.h"
#include "sim/scene/scene.h"

namespace touchstone::lab {

/// How frames are simulated.
struct FrameRecipe {
  sim::DeviceSpec device;
  sim::EffectSwitches effects;
  sim::LightSpec light;
};

/// An object pressed, or pressed and dragged.
struct TouchFrame {
  std::size_t press = 0;                              ///< which one of the set's
  cv::Mat frame;                                      ///< as the camera delivers it
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  ///< on the object
  // Where they're asked for, as sim::Touch has them:
  cv::Mat height;
  cv::Mat contact;
};

/// Frames of one camera.
struct FrameSet {
  std::vector<cv::Mat> rest;        ///< of the untouched device
  std::vector<TouchFrame> touches;  ///< press by press, in the order of time
  double mm_per_px = 0.0;           ///< of the undeformed surface's middle
  double once_s = 0.0;              ///< seconds of a core: the camera
  double each_s = 0.0;              ///< seconds of a core: a frame with its mechanics, without the truth of its pixels
  std::string light;                ///< how the last one was lit
};

/// What is asked for besides the recipe.
struct FrameOrder {
  sim::ObjectSpec object;
  std::vector<sim::PressSpec> presses;
  int rest_frames = 1;
  int steps_down = 1;         ///< frames of a press, the last one at its depth
  bool heights = false;       ///< height and contact of each pixel, of a coated gel
  std::uint64_t seed = 1;     ///< of the unit, its noise and the light
  double most_seconds = 0.0;  ///< of all frames, by what the first one took
};

/// Presses at places up to `reach_mm` from the gel's middle along x and y, half of `depth_mm` to twice as deep, each
/// dragged by a third of its depth in some direction, or not. A pure function of its arguments.
std::vector<sim::PressSpec> drawn_presses(std::size_t count, const Eigen::Vector2d& reach_mm, double depth_mm,
                                          bool dragged, std::uint64_t seed);

/// The scene of one press by this recipe: at rest, pressed and, if it is, dragged, 30 frames a second or as many as
/// the camera has.
sim::SceneSpec frame_scene(const FrameRecipe& recipe, const FrameOrder& order, const sim::PressSpec& press);

/// All presses seen by one camera, by the plan of the deepest one.
/// @throws Error as make_plan, sim::play_motion and sim::VirtualCamera; and where it would take too long
FrameSet make_frames(const FrameRecipe& recipe, const fem::Compliance& gel, const FrameOrder& order,
                     const Progress& progress = {});

}  // namespace touchstone::lab
