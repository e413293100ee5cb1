#pragma once
// How much a device looks like a real sensor: the recorded presses of a ball are pressed into the device at their
// annotated places, and what the two show is compared as difference pictures, frame less rest. Whole frames would
// flatter: most of a frame is the untouched sensor.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "lab/likeness/picture_measures.h"
#include "lab/likeness/residual_fit.h"
#include "sensors/heights/background.h"
#include "sensors/heights/ball_press.h"
#include "sensors/heights/frame_gain.h"
#include "sim/scene/device.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// Where a recording lies and how it is compared.
struct LikenessSpec {
  std::filesystem::path recording;          ///< a folder with presses.csv, or such a table (ball_press_table.h)
  std::vector<std::filesystem::path> rest;  ///< pictures of the untouched sensor; relative to the table's folder
  double mm_per_px = 0.0;                   ///< of the recording
  std::vector<std::string> learn;           ///< `file` of presses that the device was fitted to
  std::optional<double> deepest_mm;         ///< how deep a press may be; absent: 0.6 of the gel's thickness
  std::uint64_t seed = 1;                   ///< of the simulated light
  bool residual = false;                    ///< a residual map is made of the learned presses
};

/// A recording, read and checked by itself.
struct BallRecording {
  sensors::Background rest;
  std::vector<sensors::BallPress> presses;  ///< each with its circle, given or found
  std::vector<bool> learned;                ///< a press each
  std::vector<sensors::FrameGain> gains;    ///< a press each, against rest
  double mm_per_px = 0.0;
};

/// @throws Error with file and line for a bad table; naming the picture for one of another size, one that isn't of the
/// same sensor as the rest frame, and one in whose circle nothing is pressed; naming a `learn` that no press has
BallRecording read_ball_recording(const LikenessSpec& spec);

/// @throws Error if the device has no coating, or its camera another picture than the recording's
void check_recorded_by(const sim::DeviceSpec& device, const BallRecording& recording);
/// @throws Error if a pixel of the device's camera isn't as wide on the gel as one of the recording, to 1 %
void check_scale(const sim::VirtualSensor& sensor, const BallRecording& recording);
/// Of a sensor that recorded presses are pressed into. `deepest_mm`: absent for 0.6 of the gel's thickness
sim::VirtualSensorSettings settings_for_recordings(const sim::DeviceSpec& device, std::uint64_t seed,
                                                   std::optional<double> deepest_mm);
/// A press's frame as a fit takes it: its colours balanced to those of rest, CV_8UC3, and 255 where the recorded number
/// was 250 or more.
cv::Mat frame_for_fit(const BallRecording& recording, std::size_t press);

/// How far one way to make a press's difference picture is from the recorded one.
struct PictureLikeness {
  double psnr = 0.0;  ///< dB
  double ssim = 0.0;
  RegionDifference off;  ///< mean absolute difference, numbers of 255
};

/// One press.
struct PressLikeness {
  std::string name;
  bool learned = false;
  double radius_px = 0.0;                              ///< annotated
  double simulated_radius_px = 0.0;                    ///< of the simulated contact
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();  ///< of the ball's middle, gel frame
  double depth_mm = 0.0;
  bool shallow = false;  ///< the annotated radius is beyond what deepest_mm gives: pressed to that
  cv::Vec3d gain;        ///< B, G, R
  // Each against the recorded difference with its colours balanced, but for `raw`.
  PictureLikeness device, raw, rest;
  std::optional<PictureLikeness> residual;  ///< where there is a residual map: the device with it
  std::optional<PictureLikeness> table;     ///< where presses were learned
  cv::Mat recorded, simulated;              ///< difference pictures, CV_32FC3, balanced
  cv::Mat corrected;                        ///< as `simulated`, with the residual map; empty without
  cv::Mat frame, simulated_frame;           ///< CV_8UC3, the recorded one balanced
  cv::Mat fit_frame;                        ///< as `frame`, but 255 where the recorded number was 250 or more
};

/// All presses.
struct Likeness {
  std::string device;
  std::vector<PressLikeness> presses;
  double seconds_a_press = 0.0;              ///< mechanics and light, median
  std::string light;                         ///< how pictures were lit
  std::optional<ResidualFit> made_residual;  ///< where one was asked for
  std::string residual;                      ///< what residual map was used, for people; empty for none
};

/// Presses and compares. The simulated frames are without noise. A device's own residual map is left out of `device`
/// and taken for `residual`, but where a new one is made.
/// @throws Error for a device whose camera has another size, another kind of picture, or more than 1 % other mm/px than
/// the recording; for a press whose circle's middle isn't over the device's gel; where the recording turned by 180
/// degrees or mirrored is more like the device; for a residual map of fewer than kFewestResidualPresses presses
Likeness compare_likeness(const sim::DeviceSpec& device, const BallRecording& recording, const LikenessSpec& spec,
                          const std::filesystem::path& cache_folder, const Progress& progress = {});

/// Mean and range over presses that weren't learned (over all, if all were).
struct LikenessSummary {
  /// Of one measure.
  struct Range {
    double mean = 0.0, low = 0.0, high = 0.0;
  };
  /// Of one way to make the pictures.
  struct Of {
    std::string what;  ///< "device", "device with residual", "device, raw", "rest alone", "table of slopes"
    Range psnr, ssim, inside, ring;
  };
  int presses = 0;
  std::vector<Of> rows;
};
/// @pre there is a press
LikenessSummary summary_of(const Likeness& likeness);

/// The summary as a table for people.
std::string to_text(const LikenessSummary& summary);
/// A row a press and way, then mean, low and high of each way.
std::string to_csv(const Likeness& likeness);
/// A row a press: frame, simulated frame, both differences on grey, and simulated less recorded, tenfold.
cv::Mat likeness_sheet(const Likeness& likeness);

/// Writes likeness.csv and likeness.png, and of each press PressLikeness::fit_frame (NAME-balanced.png), which a fit
/// takes. @throws Error if the folder can't be written to
void write_likeness(const Likeness& likeness, const std::filesystem::path& folder);

}  // namespace touchstone::lab
