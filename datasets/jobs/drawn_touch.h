#pragma once
// From a job that draws and a sample's number to what is done in that sample: pure functions of both.

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "datasets/jobs/draw.h"
#include "datasets/jobs/input_files.h"
#include "sim/press/press_spec.h"
#include "sim/scene/device.h"
#include "sim/scene/object.h"
#include "sim/scene/scene.h"

namespace touchstone::datasets {

/// Samples of one unit that lie in one file.
struct DrawnBlock {
  int number = 0;  ///< of the file
  int unit = 0;
  std::int64_t first_sample = 0;
  std::int64_t samples = 0;
};

/// A job ready to be drawn from. Every unit's device has been read and found sound, and so have the first pieces of
/// each object.
struct PreparedDraw {
  DrawJob job;
  std::filesystem::path file;
  std::string text;  ///< the job file as it is
  std::vector<InputFile> inputs;
  std::string device_text;
  std::vector<std::string> object_texts;
  std::vector<DrawnBlock> blocks;  ///< of all samples, in their order
  std::vector<Split> unit_splits;  ///< for SplitBy::unit
  double deepest_mm = 0.0;         ///< that the gel will be pressed in
  double widest_mm = 0.0;          ///< and moved along itself
  sim::EffectSwitches effects;     ///< of all its sensors: the job's, and what an accuracy decides (sets/drawn_needs.h)
};

/// @throws Error with file and line
PreparedDraw prepare_draw(const std::filesystem::path& file);

/// One number of a file as it was drawn.
using DrawnNumber = std::pair<std::string, double>;

/// One sensor of the design. The job's accuracy counts more than its file's.
struct DrawnUnit {
  int number = 0;
  std::uint64_t seed = 0;  ///< of its imager's fixed pattern
  std::string text;        ///< its device file
  sim::DeviceSpec device;
  std::vector<DrawnNumber> drawn;
};

/// @throws Error that names unit, place and value if the device doesn't allow what was drawn
DrawnUnit drawn_unit(const PreparedDraw& prepared, int unit);

/// One object as it was drawn. @throws Error likewise
sim::ObjectSpec drawn_object(const PreparedDraw& prepared, int object, std::int64_t piece);

/// One sample.
struct DrawnTouch {
  std::int64_t sample = 0;
  int attempt = 0;  ///< how many draws before this one couldn't be pressed
  int unit = 0;
  int object = 0;          ///< number in the job's list
  std::int64_t piece = 0;  ///< of that object
  Split split = Split::train;
  std::uint64_t seed = 0;  ///< of the imager's noise
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();
  double turn_deg = 0.0, tilt_deg = 0.0, tilt_axis_deg = 0.0;
  double force_N = 0.0;   ///< asked for; NaN where the depth is
  double depth_mm = 0.0;  ///< asked for; NaN where the force is
  double drag_mm = 0.0, drag_toward_deg = 0.0;
};

/// `attempt` counts from 0: the same sample drawn again.
DrawnTouch drawn_touch(const PreparedDraw& prepared, std::int64_t sample, int attempt = 0);

/// The rotation of a touch: its turn about z, then its tilt.
Eigen::Matrix3d rotation_of(const DrawnTouch& touch);

/// What a sensor is asked for.
sim::PressSpec press_of(const DrawnTouch& touch);

}  // namespace touchstone::datasets
