#include "lab/chroma/chroma_setup.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/error.h"

namespace touchstone::lab {
namespace {

const sim::PrintSpec& print_of(const sim::VirtualSensor& sensor) {
  const auto& coating = sensor.device().coating;
  if (!coating || !coating->print) fail("device {}: has no printed markers", sensor.device().name);
  return *coating->print;
}

sensors::ColourMarkerAppearance appearance_of(const sim::VirtualSensor& sensor) {
  sensors::ColourMarkerAppearance record;
  record.grid = print_of(sensor).grid;
  // [Lin2019] counts pixels of more than half saturation in pictures of enhanced contrast. In a levelled one the
  // filter's yellow has some 0.47, as blue pixels see light of 500 to 540 nm; ink and filtered ink have 0.65 and more,
  // white 0.1.
  record.least_saturation = 0.3;
  return record;
}

}  // namespace

sim::VirtualSensorSettings chroma_sensor_settings(std::uint64_t seed) {
  sim::VirtualSensorSettings settings;
  settings.seed = seed;
  settings.deepest_mm = 3.3;    // the paper presses by 3 mm
  settings.widest_mm = 1.3;     // and shears by 1 mm
  settings.membrane_um = 80.0;  // balls of 4 mm and larger are smooth on it
  settings.always_friction = true;
  settings.edge_side = 2;  // a marker's rim is some hundred pixels: their mean is what counts
  return settings;
}

sensors::ViewParallax parallax_of(const sim::DeviceSpec& device) {
  if (!device.camera) fail("device {}: has no camera", device.name);
  const sim::CameraSpec& camera = *device.camera;
  const double air = -camera.position_mm.z() - device.plate.thickness_mm - device.gel.thickness_mm;
  sensors::ViewParallax parallax;
  parallax.viewing_distance_mm =
      device.gel.refractive_index * (air + device.plate.thickness_mm / device.plate.refractive_index +
                                     device.gel.thickness_mm / device.gel.refractive_index);
  parallax.axis_mm = camera.look_at_mm.head<2>();
  return parallax;
}

ChromaSetup::ChromaSetup(const sim::VirtualSensor& sensor, std::uint64_t seed)
    : sensor_(sensor),
      markers_(printed_markers(sensor.device())),
      means_(sensor.gel(), markers_),
      spacing_mm_(print_of(sensor).spacing_mm.x()),
      finder_(appearance_of(sensor)),
      rest_(finder_.find_rest(sensor.background(seed))) {}

std::vector<ChromaRecord> ChromaSetup::play(const sim::ObjectSpec& object, const sim::MotionSpec& motion,
                                            std::uint64_t noise_seed) const {
  const sim::TouchObject touched = sensor_.object(object);
  const std::vector<sim::Truth> states = sensor_.play(touched, motion);
  return read(pictures(touched, states, noise_seed), states);
}

std::vector<ChromaRecord> ChromaSetup::record(const sim::ObjectSpec& object, std::span<const sim::Truth> states,
                                              std::uint64_t noise_seed) const {
  return read(pictures(sensor_.object(object), states, noise_seed), states);
}

std::vector<cv::Mat> ChromaSetup::pictures(const sim::TouchObject& object, std::span<const sim::Truth> states,
                                           std::uint64_t noise_seed) const {
  std::vector<cv::Mat> made(states.size());
  tbb::parallel_for(std::size_t{0}, states.size(), [&](std::size_t i) {
    made[i] = sensor_.capture(object, states[i].press, noise_seed, static_cast<int>(i), false).frame;
  });
  return made;
}

std::vector<ChromaRecord> ChromaSetup::read(std::span<const cv::Mat> frames, std::span<const sim::Truth> states) const {
  TS_ASSERT(frames.size() == states.size());
  sensors::ColourMarkerFinder finder = finder_;
  std::vector<ChromaRecord> records(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    records[i].reading = finder.find(frames[i]);
    records[i].truth = means_.of(states[i].press.surface_displacement);
    records[i].state = states[i];
  }
  return records;
}

std::size_t ChromaSetup::marker_at(const Eigen::Vector2d& place_mm) const {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < markers_.markers.size(); ++i) {
    if ((markers_.markers[i].centre - place_mm).norm() < (markers_.markers[nearest].centre - place_mm).norm()) {
      nearest = i;
    }
  }
  return nearest;
}

std::vector<sensors::HueSample> samples_of(const std::vector<ChromaRecord>& records, std::size_t marker, int series) {
  std::vector<sensors::HueSample> samples;
  for (const ChromaRecord& record : records) {
    const sensors::ColourMarker& seen = record.reading.markers[marker];
    if (seen.flaw == sensors::MarkerFlaw::kNone) samples.push_back({marker, seen, record.truth[marker], series});
  }
  return samples;
}

std::vector<sensors::HueSample> samples_of_moved(const std::vector<ChromaRecord>& records, double least_mm,
                                                 int series) {
  std::vector<sensors::HueSample> samples;
  for (const ChromaRecord& record : records) {
    for (std::size_t marker = 0; marker < record.truth.size(); ++marker) {
      const sensors::ColourMarker& seen = record.reading.markers[marker];
      if (seen.flaw == sensors::MarkerFlaw::kNone && record.truth[marker].norm() >= least_mm) {
        samples.push_back({marker, seen, record.truth[marker], series});
      }
    }
  }
  return samples;
}

sensors::HueCalibrationSettings hue_settings_of(const ChromaSetup& setup) {
  sensors::HueCalibrationSettings settings;
  settings.spacing_mm = setup.spacing_mm();
  settings.parallax = parallax_of(setup.sensor().device());
  return settings;
}

sensors::HueModel best_hue_model(const ChromaSetup& setup, const std::vector<sensors::HueSample>& samples,
                                 const std::vector<sensors::HueModelForm>& forms, HueAim aim) {
  sensors::HueCalibrationSettings settings = hue_settings_of(setup);
  const auto scores = sensors::rank_hue_forms(setup.rest(), samples, settings, forms);
  const auto error = [&](const sensors::HueFormScore& score) {
    return aim == HueAim::lateral ? score.errors.rms_lateral_mm : score.errors.rms_of_all_mm();
  };
  settings.form = std::ranges::min_element(scores, {}, error)->form;
  return sensors::calibrate_hue(setup.rest(), samples, settings);
}

}  // namespace touchstone::lab
