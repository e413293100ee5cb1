#include "lab/gelsight/gelsight_dome_experiment.h"

#include <cmath>

#include "closed_forms/contact_closed_forms.h"
#include "core/error.h"
#include "core/units.h"

namespace touchstone::lab {
namespace {

constexpr double kPlateThickness_mm = 2.0;
constexpr double kClearance_mm = 0.1;

sim::ObjectSpec plate() {
  sim::ObjectSpec object;
  object.name = "plate";
  object.shape.type = sim::ShapeKind::box;
  object.shape.size_mm = {60.0, 60.0, kPlateThickness_mm};
  return object;
}

/// The pixels that see contact, and their middle.
struct TouchedPixels {
  double count = 0.0;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
};

TouchedPixels touched_pixels(const sim::Touch& touch) {
  TouchedPixels touched;
  for (int row = 0; row < touch.contact.rows; ++row) {
    for (int column = 0; column < touch.contact.cols; ++column) {
      if (touch.contact.at<unsigned char>(row, column) == 0) continue;
      touched.middle += Eigen::Vector2d(column + 0.5, row + 0.5);
      touched.count += 1.0;
    }
  }
  if (touched.count > 0.0) touched.middle /= touched.count;
  return touched;
}

/// How large a pixel is in the plane `z`, relative to that at the apex: by the reduced distance from the lens, which
/// refraction at the flat faces leaves alone for rays near the axis.
double pixel_scale(const sim::DeviceSpec& device, double z) {
  const double air = -device.camera->position_mm.z() - device.gel.thickness_mm - device.plate.thickness_mm;
  const double reduced = air + device.plate.thickness_mm / device.plate.refractive_index +
                         device.gel.thickness_mm / device.gel.refractive_index;
  return 1.0 + z / (device.gel.refractive_index * reduced);
}

}  // namespace

PlateContact press_plate(const sim::VirtualSensor& sensor, double depth_mm, double tilt, std::uint64_t noise_seed) {
  const sim::DomeSpec* dome = sensor.device().gel.dome();
  TS_ASSERT(dome != nullptr);
  const double sphere = dome->sphere_radius_mm;
  // The plate's lower face is `sphere - depth` from the sphere's centre, along its own normal.
  const auto height_at = [&](double depth) {
    return (sphere - depth + 0.5 * kPlateThickness_mm) / std::cos(tilt) - sphere;
  };
  sim::MotionSpec motion;
  motion.start_mm = {0, 0, height_at(-kClearance_mm)};
  motion.start_angles_deg = Eigen::Vector3d(0, tilt / kRadiansPerDegree, 0);
  sim::MotionKey key;
  key.z = sim::AxisKey{height_at(depth_mm), std::nullopt};
  motion.keys = {key};

  const sim::TouchObject object = sensor.object(plate());
  const fem::PressState press = sensor.play(object, motion).back().press;
  const sim::Touch touch = sensor.capture(object, press, noise_seed);
  const TouchedPixels touched = touched_pixels(touch);
  PlateContact contact;
  contact.depth_mm = depth_mm;
  contact.force_N = press.wrench[2];
  const double touched_z = (sphere - depth_mm) * std::cos(tilt) - sphere;
  contact.expected_mm = {(sphere - depth_mm) * std::sin(tilt), 0.0};
  if (touched.count == 0.0) return contact;
  const double scale = pixel_scale(sensor.device(), touched_z);
  contact.radius_mm = scale * sensor.mm_per_px() * std::sqrt(touched.count / kPi);
  contact.centre_mm = scale * sensor.gel_from_pixel(touched.middle);
  return contact;
}

double plate_radius_on_layer(const sim::GelSpec& gel, double force) {
  const double sphere = std::get<sim::DomeSpec>(gel.shape).sphere_radius_mm;
  const auto at = [&](double depth) {
    return closed_forms::sphere_on_layer(gel.youngs_modulus_MPa, gel.poisson_ratio, gel.thickness_mm, sphere, depth);
  };
  // From Hertz's depth on: force goes about as depth to 1.5, and each look at the layer takes its time.
  const double hertz = plate_radius_by_hertz(gel, force);
  double depth = hertz * hertz / sphere;
  closed_forms::LayerContact contact;
  constexpr int kMostSteps = 12;
  constexpr double kGood = 1e-3;  // of the force; a third of that of the radius
  for (int step = 0; step < kMostSteps; ++step) {
    if (depth > 0.25 * gel.thickness_mm) {
      fail("a force of {} N presses the dome by more than a quarter of its thickness", force);
    }
    contact = at(depth);
    if (std::abs(contact.force / force - 1.0) < kGood) break;
    depth *= std::pow(force / contact.force, 2.0 / 3.0);
  }
  return contact.contact_radius;
}

double plate_radius_by_hertz(const sim::GelSpec& gel, double force) {
  const double modulus = gel.youngs_modulus_MPa / (1.0 - gel.poisson_ratio * gel.poisson_ratio);
  return std::cbrt(0.75 * force * std::get<sim::DomeSpec>(gel.shape).sphere_radius_mm / modulus);
}

DomeHeights measure_dome_heights(const sim::VirtualSensor& sensor, const CalibrationPresses& presses,
                                 sensors::LightCorrection correction, std::uint64_t seed) {
  CalibrationPresses exact = presses;  // the dome's circles are the truth's: the finder can't be held against it
  exact.annotation_px = 0.0;
  sensors::HeightEstimator estimator(calibrate_heights(sensor, exact, correction, seed).calibration.model);
  DomeHeights heights;
  constexpr std::uint64_t kTestNoise = 1'000'000;  // seeds that calibration never saw
  constexpr double kBall_mm = 4.0;
  constexpr double kBallDepth_mm = 0.4;
  constexpr double kPlateDepth_mm = 0.3;
  const sim::TouchObject ball = sensor.object(ball_of(kBall_mm));
  std::uint64_t noise = seed + kTestNoise;
  for (const Eigen::Vector2d& place : {Eigen::Vector2d(0, 0), {2.7, -1.9}, {-4.3, 2.2}}) {
    const sim::Touch touch =
        sensor.press(ball, {.place_mm = place, .depth_mm = kBallDepth_mm}, {.noise_seed = ++noise});
    heights.balls.push_back(height_error(estimator.estimate(touch.frame), touch, sensor.mm_per_px()));
  }
  const sim::TouchObject flat = sensor.object(plate());
  const sim::Touch touch = sensor.press(flat, {.depth_mm = kPlateDepth_mm}, {.noise_seed = ++noise});
  heights.plate = height_error(estimator.estimate(touch.frame), touch, sensor.mm_per_px());
  return heights;
}

}  // namespace touchstone::lab
