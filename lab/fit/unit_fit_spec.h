#pragma once
// A unit's fit: from presses that were recorded with a real sensor to the numbers of its device file. One file
// describes it (docs/calibration.md).

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/edited_yaml.h"
#include "core/yaml_reader.h"
#include "sim/scene/device.h"
#include "sim/scene/object.h"

namespace touchstone::lab {

/// How an unknown changes the numbers that it stands for.
enum class UnknownHow : std::uint8_t {
  times,  ///< each is multiplied by one factor
  plus    ///< one amount is added to each
};

/// Numbers of the device's file that aren't known. Each place that the path leads to is an unknown of its own
/// (core/edited_yaml.h), unless they go `together`; numbers of one list always go together.
struct UnknownSpec {
  std::string path;                ///< of `paths` all, with commas between them
  std::vector<std::string> paths;  ///< `path` alone, or several whose numbers all change together
  UnknownHow how = UnknownHow::times;
  double low = 0.0, high = 0.0;  ///< the factors, or what is added, that are allowed
  bool together = false;
  SourceLocation where;
};

/// One recorded press.
struct RecordedPress {
  std::filesystem::path picture;                         ///< of a RecordingSpec's presses the name alone
  std::filesystem::path object;                          ///< empty where `body` says what is pressed
  cv::Mat frame;                                         ///< in place of the picture's file; empty: that is read
  std::optional<sim::ObjectSpec> body;                   ///< in place of the file `object`
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();    ///< of the object's origin, gel frame
  Eigen::Vector3d angles_deg = Eigen::Vector3d::Zero();  ///< about the fixed axes x, then y, then z
  double place_sd_mm = 0.0;                              ///< of each coordinate; 0: it's known
  std::optional<double> depth_mm;                        ///< beyond its first touch; none: found from the picture
  double depth_sd_mm = 0.0;                              ///< 0: it's known
  std::optional<double> force_N;                         ///< normal
  double force_sd_N = 0.0;                               ///< above 0 with a force
  SourceLocation where;
};

/// Presses of balls as `touchstone compare` reads them: a table of pictures and contacts' circles. Places come of the
/// circles' middles, depths of their radii by the device's own mechanics, each frame's own white balance is taken out.
struct RecordingSpec {
  std::filesystem::path folder;      ///< with presses.csv (lab/gelsight/ball_press_table.h)
  std::vector<std::string> rest;     ///< pictures in it of the untouched sensor
  double mm_per_px = 0.0;            ///< on the gel
  std::vector<std::string> presses;  ///< `file` of those that are taken; empty: all
  double radius_sd_px = 0.0;         ///< one standard deviation of a circle's radius; 0: depths are taken as known
  SourceLocation where;
};

/// All of a fit's file, checked.
struct UnitFitSpec {
  std::string name;  ///< of its files; letters, digits, - and _
  std::filesystem::path device;
  std::vector<UnknownSpec> unknowns;
  std::vector<std::filesystem::path> backgrounds;  ///< of the untouched sensor; their mean is taken
  std::vector<RecordedPress> presses;
  std::optional<RecordingSpec> recording;  ///< in place of backgrounds and presses, see with_recording
  std::vector<std::string> doubts;         ///< what with_recording found to doubt, sentences for people
  /// Presses are compared less the background, and of the background the mean of each colour alone: for devices that
  /// can't show all of what a real sensor's rest shows.
  bool differences = false;
  int coarse_px = 4;  ///< pixels along a side that are compared, and simulated, as one
  std::optional<double> deepest_mm;
  std::uint64_t seed = 1;  ///< of the simulated light
  /// Of the light field (sim::VirtualSensorSettings::field_accuracy), one after the other: where the fit by one has
  /// ended, that by the next begins. Each is less than the one before.
  std::vector<double> field_accuracy = {0.0075};
  double membrane_um = 40.0;  ///< sim::VirtualSensorSettings::membrane_um
  SourceLocation where;
};

void fields(YamlReader& in, UnknownSpec& unknown);
void fields(YamlReader& in, RecordedPress& press);
void fields(YamlReader& in, RecordingSpec& recording);
void fields(YamlReader& in, UnitFitSpec& fit);

/// On what a number of a device's file acts, and so what has to be simulated anew when it changes.
enum class NumberActs : std::uint8_t {
  on_imager,      ///< what becomes of the light
  on_force,       ///< the modulus of a gel of one material: forces are in proportion, shapes stay
  on_lamp_power,  ///< light is in proportion: a lamp's, or the room's
  on_lamp,        ///< the light of one lamp
  on_scene        ///< all light, maybe the mechanics
};

/// One number of the device's file, and what of the simulation it changes.
struct FittedNumber {
  YamlNumber number;
  NumberActs acts = NumberActs::on_scene;
  int lamp = -1;  ///< where it belongs to one
};

/// One unknown: a variable of the fit.
struct FitUnknown {
  std::string name;  ///< "lamps[2].power_W", or the path with [*] where places go together
  std::string path;  ///< as the file has it
  UnknownHow how = UnknownHow::times;
  double low = 0.0, high = 0.0;
  std::vector<FittedNumber> numbers;
};

/// The number as the variable x makes it: x is the logarithm of the factor, or what is added.
double number_at(const FitUnknown& unknown, const YamlNumber& number, double x);

/// A fit with its files read and found sound.
struct PreparedFit {
  UnitFitSpec spec;
  std::string device_text;
  sim::DeviceSpec device;  ///< as its file says
  std::vector<FitUnknown> unknowns;
  std::vector<sim::ObjectSpec> objects;  ///< by press
  double deepest_mm = 0.0;
};

/// The device's text with x of all unknowns. @pre x has one entry an unknown
std::string text_at(const PreparedFit& fit, const Eigen::VectorXd& x);
/// @throws Error that names the unknown's values if the device's file doesn't allow them
sim::DeviceSpec device_at(const PreparedFit& fit, const Eigen::VectorXd& x);

/// Checks everything but the pictures. @throws Error with file, line, field, value and what is allowed
PreparedFit prepare_fit(const UnitFitSpec& spec);

/// Reads and prepares. @throws Error as prepare_fit
PreparedFit prepare_fit(const std::filesystem::path& file);

}  // namespace touchstone::lab
