#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "core/units.h"
#include "render/cameras/camera_footprint.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

struct Moments {
  double whole = 0.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Vector2d variance = Eigen::Vector2d::Zero();
};

/// Of what a block's pixels see, relative to the pixel's middle, mean over its phases; pixels.
Moments moments_of(const CameraFootprint& footprint, int block) {
  Moments moments;
  const int side = footprint.spacing;
  const int phases = side * side;
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  for (int phase = 0; phase < phases; ++phase) {
    for (const auto& tap : footprint.kernels[block * phases + phase].taps) {
      const Eigen::Vector2d away((tap.column + 0.5) * side - (phase % side + 0.5),
                                 (tap.row + 0.5) * side - (phase / side + 0.5));
      const double weight = double(tap.weight) / phases;
      moments.whole += weight;
      moments.mean += weight * away;
      squares += weight * away.cwiseAbs2();
    }
  }
  moments.variance = squares - moments.mean.cwiseAbs2();
  return moments;
}

std::vector<double> level(const ReadyCamera& camera, int block, double z) {
  return std::vector<double>(footprint_blocks(camera, block).size(), z);
}

TEST(CameraFootprint, OfAPinholeIsADiscsWidth) {
  const Scene air = empty_scene(0.0);
  PinholeCamera pinhole = small_camera(320, 240);
  pinhole.foil_thickness_um = 0.0;
  const ReadyCamera camera = make_ready(pinhole);
  for (const double rays_across : {64.0, 4.0, 2.0}) {
    const CameraFootprint footprint = make_footprint(air, camera, 0, level(camera, 16, 0.0), 16, rays_across);
    // The hole seen on the sensor from a point at 27 mm: wider by 3 / 27.
    const double diameter = 0.1 * (1.0 + 3.0 / 27.0) / (pinhole.pixel_pitch_um * 1e-3);
    EXPECT_GE(diameter / footprint.spacing, rays_across > diameter ? 1.0 : rays_across);
    for (const int block : {0, 7, 150, 299}) {
      const Moments moments = moments_of(footprint, block);
      EXPECT_NEAR(moments.whole, 1.0, 1e-5);
      // Light weighs as cos^4, more on the side of the hole that is nearer to the axis: d ln(cos^4) per mm of hole.
      const Eigen::Vector2d from_axis =
          (footprint_blocks(camera, 16)[block] - Eigen::Vector2d(160, 120)) * (pinhole.pixel_pitch_um * 1e-3);
      const double slope = 4.0 * from_axis.norm() / (9.0 + from_axis.squaredNorm());
      const double pull = slope * diameter * diameter / 16.0 * (pinhole.pixel_pitch_um * 1e-3);
      EXPECT_NEAR(moments.mean.norm(), pull, 0.1 * pull + 2e-3);
      for (int axis = 0; axis < 2; ++axis) {
        EXPECT_NEAR(moments.variance[axis] / (diameter * diameter / 16.0 + 1.0 / 12.0), 1.0, 0.02) << rays_across;
      }
    }
  }
}

/// Of 4 mm, 27 mm before the face at z = 0.
LensCamera lens_at_27_mm(int width, int height, double pitch_um, double focus_mm) {
  LensCamera lens;
  lens.width = width;
  lens.height = height;
  lens.pixel_pitch_um = pitch_um;
  lens.focus_distance_mm = focus_mm;
  lens.matrix = matrix_of_lens(4.0, focus_mm, pitch_um, width, height);
  lens.gel_from_camera = look_at({0, 0, -27}, {0, 0, 0}, {0, 1, 0});
  return lens;
}

TEST(CameraFootprint, OfALensIsItsBlurCircle) {
  const Scene air = empty_scene(0.0);
  LensCamera lens = lens_at_27_mm(320, 240, 5.6, 24.0);
  lens.aperture_mm = 1.2;
  const ReadyCamera camera = make_ready(lens);
  const CameraFootprint footprint = make_footprint(air, camera, 0, level(camera, 16, 0.0), 16, 64.0);
  const double diameter = blur_circle_mm(lens, 27.0) / (lens.pixel_pitch_um * 1e-3);
  ASSERT_GT(diameter, 4.0);
  const Moments moments = moments_of(footprint, 7 * 20 + 10);
  EXPECT_NEAR(moments.whole, 1.0, 1e-5);
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_NEAR(moments.variance[axis] / (diameter * diameter / 16.0 + 1.0 / 12.0), 1.0, 0.02);
  }
}

TEST(CameraFootprint, OfASharpCameraIsOnePixel) {
  const Scene air = empty_scene(0.0);
  PinholeCamera pinhole = small_camera(40, 30);
  pinhole.hole_diameter_um = 1e-3;
  pinhole.foil_thickness_um = 0.0;
  const ReadyCamera camera = make_ready(pinhole);
  const CameraFootprint footprint = make_footprint(air, camera, 0, level(camera, 8, 0.0), 8, 3.0);
  EXPECT_EQ(footprint.spacing, 1);
  std::vector<float> picture(static_cast<std::size_t>(footprint.grid.columns) * footprint.grid.rows);
  for (std::size_t k = 0; k < picture.size(); ++k) picture[k] = static_cast<float>(k % 97);
  float out[8];
  footprint.spread(picture.data(), 11, 16, 8, out);
  for (int k = 0; k < 8; ++k) {
    const std::size_t point =
        static_cast<std::size_t>(footprint.margin + 11) * footprint.grid.columns + footprint.margin + 16 + k;
    EXPECT_NEAR(out[k], picture[point], 0.05f);
  }
}

// Of a sharp lens of f/22 at 620 nm a wave of period P keeps (2/pi) (acos s - s sqrt(1 - s^2)), s = 620 nm * 22 / P,
// and the sinc of a pixel: 39 % for four pixels.
TEST(CameraFootprint, OfASmallStopHasTheDiffractionLimit) {
  const Scene air = empty_scene(0.0);
  constexpr double kFNumber = 22.0;
  constexpr int kPeriod_px = 4;
  LensCamera lens = lens_at_27_mm(64, 48, 6.0, 27.0);
  const double sensor = sensor_distance_mm(lens);
  lens.aperture_mm = sensor / kFNumber;
  Spectrum wavelengths(1);
  wavelengths << 620.0;
  lens.diffraction = std::make_shared<const DiffractionSpread>(DiffractingAperture{.diameter_mm = lens.aperture_mm,
                                                                                   .foil_mm = 0.0,
                                                                                   .to_sensor_mm = sensor,
                                                                                   .per_object_mm = 1.0 / 27.0,
                                                                                   .in_focus = true,
                                                                                   .farthest_mm = 0.24,
                                                                                   .wavelengths_nm = wavelengths});
  const ReadyCamera camera = make_ready(lens);
  const CameraFootprint footprint = make_footprint(air, camera, 0, level(camera, 16, 0.0), 16, 3.0);
  ASSERT_EQ(footprint.spacing, 1);
  double whole = 0.0;
  double wave = 0.0;
  for (const CameraFootprint::Tap& tap : footprint.kernel_at(24, 32).taps) {
    whole += tap.weight;
    wave += tap.weight * std::cos(2.0 * kPi * tap.column / kPeriod_px);
  }
  const double s = 620e-6 * kFNumber / (kPeriod_px * 1e-3 * lens.pixel_pitch_um);
  const double limit = 2.0 / kPi * (std::acos(s) - s * std::sqrt(1.0 - s * s));
  const double x = kPi / kPeriod_px;
  EXPECT_NEAR(whole, 1.0, 1e-5);
  EXPECT_NEAR(wave, limit * std::sin(x) / x, 0.02);
}

TEST(CameraFootprint, WidensBehindGlass) {
  // The same hole over less apparent depth: the footprint on the sensor is wider by the parallax, 0.1 mm * 3 / depth.
  const ReadyCamera camera = make_ready(small_camera(320, 240));
  const CameraFootprint air = make_footprint(empty_scene(0.0), camera, 0, level(camera, 16, 0.0), 16, 64.0);
  const CameraFootprint stack = make_footprint(sensor_stack(0.0), camera, 2, level(camera, 16, 0.0), 16, 64.0);
  const int middle = 7 * 20 + 10;
  const double ratio = std::sqrt((moments_of(stack, middle).variance.x() - 1.0 / 12.0) /
                                 (moments_of(air, middle).variance.x() - 1.0 / 12.0));
  const double apparent = 20.0 + 2.0 / 1.52 + 5.0 / 1.41;
  EXPECT_NEAR(ratio, (1.0 + 3.0 / apparent) / (1.0 + 3.0 / 27.0), 2e-3);
}

}  // namespace
}  // namespace touchstone::render
