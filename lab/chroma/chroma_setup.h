#pragma once
// A chroma device in an experimental setup: objects press its markers, its camera's pictures are read, and the truth of
// each marker is kept beside the reading.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "lab/press/marker_compliance_export.h"
#include "sensors/colour/colour_marker_finder.h"
#include "sensors/colour/hue_calibration.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// One picture, read, and what is true of it.
struct ChromaRecord {
  sensors::ColourMarkerReading reading;
  std::vector<Eigen::Vector3d> truth;  ///< mm, of each marker: mean displacement over its square
  sim::Truth state;
};

/// How far a chroma experiment presses and shears, for a sensor's light.
sim::VirtualSensorSettings chroma_sensor_settings(std::uint64_t seed);

/// Apparent distance from the camera to the markers at rest and where its axis meets them, as the device's drawing
/// says.
/// @throws Error for a device without a camera
sensors::ViewParallax parallax_of(const sim::DeviceSpec& device);

/// A chroma device with a reader of its markers.
class ChromaSetup {
 public:
  /// Reads the picture at rest. Keeps a reference to the sensor.
  /// @throws Error for a device without printed markers, or as ColourMarkerFinder::find_rest
  ChromaSetup(const sim::VirtualSensor& sensor, std::uint64_t seed);

  /// Plays a motion and reads each of its frames: made side by side, read one after the other. Frame i has the noise of
  /// (noise_seed, i).
  std::vector<ChromaRecord> play(const sim::ObjectSpec& object, const sim::MotionSpec& motion,
                                 std::uint64_t noise_seed) const;
  /// The same for states that are there already.
  std::vector<ChromaRecord> record(const sim::ObjectSpec& object, std::span<const sim::Truth> states,
                                   std::uint64_t noise_seed) const;
  /// The two halves of that, for who wants the pictures too. @pre as many pictures as states
  std::vector<cv::Mat> pictures(const sim::TouchObject& object, std::span<const sim::Truth> states,
                                std::uint64_t noise_seed) const;
  /// Reads them as frames that follow each other from rest.
  std::vector<ChromaRecord> read(std::span<const cv::Mat> frames, std::span<const sim::Truth> states) const;

  const sim::VirtualSensor& sensor() const { return sensor_; }
  const sensors::ColourMarkerReading& rest() const { return rest_; }
  /// As it is after the picture at rest; to be copied.
  const sensors::ColourMarkerFinder& finder() const { return finder_; }
  const SurfaceMarkers& markers() const { return markers_; }
  double spacing_mm() const { return spacing_mm_; }
  /// The marker next to a place of the gel.
  std::size_t marker_at(const Eigen::Vector2d& place_mm) const;

 private:
  const sim::VirtualSensor& sensor_;
  SurfaceMarkers markers_;
  MarkerMeans means_;
  double spacing_mm_;
  sensors::ColourMarkerFinder finder_;
  sensors::ColourMarkerReading rest_;
};

/// Samples of one marker, those pictures in which it is sound; all are of series `series`.
std::vector<sensors::HueSample> samples_of(const std::vector<ChromaRecord>& records, std::size_t marker, int series);

/// Samples of all markers that have moved by at least `least_mm`.
std::vector<sensors::HueSample> samples_of_moved(const std::vector<ChromaRecord>& records, double least_mm, int series);

/// What calibrate_hue is given of the setup; the form is its default.
sensors::HueCalibrationSettings hue_settings_of(const ChromaSetup& setup);

/// What a model is to be good at: displacements, or the lateral ones, which mechanics then makes fields of.
enum class HueAim { displacement, lateral };

/// The model of that form among `forms` that errs least on series left out (sensors::rank_hue_forms).
sensors::HueModel best_hue_model(const ChromaSetup& setup, const std::vector<sensors::HueSample>& samples,
                                 const std::vector<sensors::HueModelForm>& forms, HueAim aim);

}  // namespace touchstone::lab
