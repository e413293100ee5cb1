#pragma once
// The presses that a device's settings are judged by, and a scene of one of them played, timed and held beside another.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "fem/contact/press.h"
#include "render/imager/imager.h"
#include "sim/need/picture_needs.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

inline constexpr double kUnknown =
    std::numeric_limits<double>::quiet_NaN();  ///< a figure that wasn't or couldn't be measured

/// An object held against a device in several poses, each pressed down and then dragged.
struct BenchPresses {
  sim::ObjectSpec object;
  double touch_mm = 0.0;  ///< see sim::first_touch(), over the middle
  std::vector<sim::PressSpec> specs;
};

/// `count` presses near the gel's middle: places within an edge of the mesh, so that no place is luckier than another,
/// depths within a fifth of `depth_mm`, dragged by a third of that into all directions. A pure function of its
/// arguments.
std::vector<sim::PressSpec> bench_presses(int count, double edge_mm, double depth_mm, std::uint64_t seed);

/// What the presses gave: forces on the object, pressed and dragged, one after the other for each press.
struct PressForces {
  std::vector<Eigen::Vector3d> force_N;
  Eigen::MatrixX3d beads_mm;  ///< all beads of all states, one after the other
  double reach_mm = 0.0;      ///< from the gel's middle to the farthest vertex that was touched
  double seconds = 0.0;       ///< a state
  std::int64_t solves = 0;    ///< linear systems, in all
};

/// Presses without pictures, each from a fresh start. `edge_mm` is what a relief is blurred by
/// (sim::coarse_contact_shape).
/// @throws Error that says which press can't be had
PressForces solve_presses(const BenchPresses& presses, const fem::Compliance& gel, const sim::DeviceSpec& device,
                          double edge_mm, const fem::PressTolerance& tolerance = {});

/// Root mean square over the states of the force's difference, relative to the other's force.
double force_difference(const std::vector<Eigen::Vector3d>& forces, const std::vector<Eigen::Vector3d>& than);

/// The scene of one press: three frames, at rest, pressed and dragged.
sim::SceneSpec bench_scene(const sim::DeviceSpec& device, const BenchPresses& presses, const sim::PressSpec& spec,
                           std::uint64_t seed);

/// The device with a camera of at most so many pixels out of the middle of its own, and its background's part of them.
/// Without its residual map, which is of whole pictures. @pre it has a camera
sim::DeviceSpec middle_of(sim::DeviceSpec device, int most_pixels);

/// What a scene came to.
struct SceneRun {
  std::vector<Eigen::Vector3d> force_N;  ///< of each frame but the first
  double largest_strain = 0.0;
  std::vector<cv::Mat> electrons;  ///< of each frame but the first: CV_32FC(channels), without noise
  std::vector<cv::Mat> numbers;    ///< the frames as delivered
  double mechanics_seconds = 0.0;  ///< a frame
  double camera_seconds = 0.0;     ///< once a scene
  double picture_seconds = 0.0;    ///< a frame
  std::int64_t paths = 0;          ///< traced for the pictures, not for what is made once
  bool direct = false;             ///< all pictures by direct light
  std::string light;               ///< how the last picture was lit
};

/// Plays and shows a scene whose outputs are frames and radiance, or neither.
/// @param whole every pixel traced by paths, nothing kept from picture to picture
/// @throws Error as make_plan, sim::play_motion and sim::VirtualCamera
SceneRun run_scene(const sim::SceneSpec& scene, const fem::Compliance& gel, bool whole = false);

using sim::kOtherSeed;

/// The same twice, with other random numbers the second time; direct light, which has none, is shown once.
using TwoRuns = std::array<SceneRun, 2>;
/// Shows it twice; `whole` as for run_scene.
TwoRuns run_twice(sim::SceneSpec scene, const fem::Compliance& gel, bool whole = false);

/// The part of the values of a scene's pictures that the imager can measure, as they don't fill its pixels' wells.
double part_below_full_well(const TwoRuns& runs, const render::Imager& imager);

/// Root mean square over pixels and channels of how far pictures are from true ones, in units of the imager's temporal
/// noise. Of both there are two that share no random numbers: the product of `one` - `true_one` and `other` -
/// `true_other` is free of the paths' noise on the mean. Where `other` is `one`, that one's own noise counts as its
/// error. Pixels beyond the full well aren't counted.
double pixel_error(const std::vector<cv::Mat>& one, const std::vector<cv::Mat>& other,
                   const std::vector<cv::Mat>& true_one, const std::vector<cv::Mat>& true_other,
                   const render::Imager& imager);
/// Of two runs, and of a single one, whose own noise counts.
double pixel_error(const TwoRuns& shown, const TwoRuns& truth, const render::Imager& imager);
double pixel_error(const SceneRun& shown, const TwoRuns& truth, const render::Imager& imager);

/// The largest difference from the true ones' mean, of all pixels and channels but 1 % of them. The true ones' noise is
/// in it.
double worst_pixel(const std::vector<cv::Mat>& electrons, const std::vector<cv::Mat>& true_one,
                   const std::vector<cv::Mat>& true_other, const render::Imager& imager);

/// Root mean square difference of delivered numbers.
double number_difference(const std::vector<cv::Mat>& numbers, const std::vector<cv::Mat>& than);

}  // namespace touchstone::lab
