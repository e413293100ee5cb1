#include "lab/gelsight/gelsight_touches.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "core/error.h"
#include "core/units.h"
#include "lab/gelsight/gelsight_height_experiment.h"
#include "sensors/heights/height_estimator.h"

namespace touchstone::lab {
namespace {

constexpr int kMarkColumns = 15, kMarkRows = 11;
constexpr double kMarkedShare = 0.96;  // of the picture that the marks cover

/// `origin_mm`: the height at which the untilted object first touches.
sim::PressSpec press_of(const Grip& grip, double origin_mm) {
  sim::PressSpec press;
  press.place_mm = grip.place_mm;
  press.angles_deg = Eigen::Vector3d(grip.tilt.x(), grip.tilt.y(), grip.angle) / kRadiansPerDegree;
  press.height_mm = origin_mm - grip.depth_mm;
  return press;
}

/// The pose in the plane of the object's touched face, `origin_mm` under its origin.
sensors::PlanarPose planar(const RigidTransform& gel_from_object, double origin_mm) {
  const Eigen::Vector3d face = gel_from_object * Eigen::Vector3d(0, 0, -origin_mm);
  const Eigen::Vector3d along = gel_from_object.turn(Eigen::Vector3d::UnitX());
  return {std::atan2(along.y(), along.x()), face.head<2>()};
}

sensors::PlaceMap fitted_places(const sim::VirtualSensor& sensor) {
  const int width = sensor.device().camera->width, height = sensor.device().camera->height;
  std::vector<Eigen::Vector2d> pixels, places;
  for (int j = 0; j < kMarkRows; ++j) {
    for (int i = 0; i < kMarkColumns; ++i) {
      const Eigen::Vector2d share(2.0 * i / (kMarkColumns - 1) - 1.0, 2.0 * j / (kMarkRows - 1) - 1.0);
      const Eigen::Vector2d pixel =
          0.5 * Eigen::Vector2d(width, height).cwiseProduct(Eigen::Vector2d::Ones() + kMarkedShare * share);
      places.push_back(sensor.gel_from_pixel(pixel));
      pixels.push_back(pixel - Eigen::Vector2d::Constant(0.5));  // continuous indices
    }
  }
  return sensors::fit_place_map(pixels, places, {width, height});
}

}  // namespace

TouchSetup::TouchSetup(const sim::VirtualSensor& sensor, HeightReader heights)
    : sensor_(sensor), heights_(std::move(heights)), places_(fitted_places(sensor)) {}

std::vector<TouchSample> TouchSetup::touches(const sim::TouchObject& object, std::span<const Grip> grips,
                                             std::uint64_t seed) const {
  const double origin = sim::first_touch({}, object.spec(), sensor_.device().gel);
  std::vector<sim::Touch> seen(grips.size());
  std::vector<TouchSample> touches(grips.size());
  tbb::parallel_for(std::size_t{0}, grips.size(), [&](std::size_t i) {
    seen[i] = sensor_.press(object, press_of(grips[i], origin), {.noise_seed = seed + i});
    touches[i].touch_from_object = planar(seen[i].press.gel_from_object, origin);
    touches[i].force_N = seen[i].force_N().z();
  });
  for (std::size_t i = 0; i < grips.size(); ++i) {
    const cv::Mat heights = heights_(seen[i]);
    const cv::Mat contact = sensors::higher_part(heights);
    touches[i].image = sensors::rectified(heights, contact, places_);
  }
  return touches;
}

HeightReader estimated_heights(const sim::VirtualSensor& sensor, std::uint64_t seed) {
  const HeightCalibrationResult calibrated = calibrate_heights(sensor, {}, {}, seed);
  sensors::HeightSettings settings;
  settings.border = sensors::HeightBorder::free;
  const auto estimator = std::make_shared<sensors::HeightEstimator>(calibrated.calibration.model, settings);
  return [estimator](const sim::Touch& touch) { return estimator->estimate(touch.frame).height_mm.clone(); };
}

}  // namespace touchstone::lab
