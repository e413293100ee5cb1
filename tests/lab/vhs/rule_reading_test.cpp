// Reading a rule's divisions, and how much of their contrast a pinhole leaves.

#include "lab/vhs/rule_reading.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/random.h"
#include "core/units.h"
#include "lab/vhs/pinhole_transfer.h"
#include "lab/vhs/vhs_pictures.h"

namespace touchstone::lab {
namespace {

/// A sine whose dark places are the multiples of the pitch, on uneven light, with noise.
RuleProfile sine(double pitch, double contrast, double noise) {
  RuleProfile profile{-6.0, 0.02, {}};
  RandomStream random(1, 0, Purpose::kTest);
  const int count = static_cast<int>(std::llround(std::floor(12.0 / pitch) * pitch / profile.step_mm));
  for (int i = 0; i < count; ++i) {
    const double x = profile.from_mm + profile.step_mm * i;
    const double light = 100.0 * (1.0 - 0.01 * x * x + 0.02 * x);
    profile.values.push_back(light * (1.0 - contrast * std::cos(2.0 * kPi * x / pitch) + noise * random.normal()));
  }
  return profile;
}

TEST(RuleReading, FindsPitchContrastAndPlace) {
  for (const double pitch : {1.0, 0.5, 0.37}) {
    const RuleProfile profile = sine(pitch, 0.2, 0.0);
    const RuleReading reading = read_rule(profile, 0.7, 5.0);
    EXPECT_NEAR(reading.lines_per_mm, 1.0 / pitch, 0.25 / profile.length_mm());
    EXPECT_NEAR(reading.contrast, 0.2, 0.01);
    EXPECT_NEAR(std::remainder(reading.dark_mm, pitch), 0.0, 0.1 * pitch);
    EXPECT_NEAR(contrast_at(profile, 1.0 / pitch, 0.0), 0.2, 0.005);
    EXPECT_NEAR(contrast_at(profile, 1.0 / pitch, 0.5 * pitch), -0.2, 0.005);
    EXPECT_TRUE(reads(reading, profile, pitch, 0.0));
    EXPECT_FALSE(reads(reading, profile, pitch, 0.5 * pitch)) << "light where lines are: false resolution";
    EXPECT_FALSE(reads(reading, profile, 0.9 * pitch, 0.0)) << "another number of lines";
  }
}

TEST(RuleReading, NoiseAloneIsntRead) {
  int read = 0;
  for (int k = 0; k < 100; ++k) {
    RuleProfile profile = sine(0.5, 0.0, 0.0);
    RandomStream random(static_cast<std::uint64_t>(k), 1, Purpose::kTest);
    for (double& value : profile.values) value += random.normal();
    const RuleReading reading = read_rule(profile, 0.7, 5.0);
    read += reading.contrast > kClearWave * reading.noise ? 1 : 0;
  }
  EXPECT_LE(read, 2);
}

TEST(RuleReading, AFaintWaveAboveTheNoiseIsRead) {
  // 600 values: a wave of one tenth of a value's noise stands sqrt(600 / 4) / 10 noises of a wave above it.
  const RuleProfile clear = sine(0.5, 0.05, 0.1);
  EXPECT_TRUE(reads(read_rule(clear, 0.7, 5.0), clear, 0.5, 0.0));
  const RuleProfile lost = sine(0.5, 0.001, 0.1);
  EXPECT_FALSE(reads(read_rule(lost, 0.7, 5.0), lost, 0.5, 0.0));
}

constexpr PinholeOptics kOptics{0.1, 5.0, 20.0, 0.0};

TEST(PinholeTransfer, OfADiscVanishesAtBesselsFirstZero) {
  // The disc is 0.1 mm (1 + 20 / 5) wide on the object; J1's first zero is 3.8317.
  const double zero = 3.831706 / (kPi * 0.5);
  EXPECT_GT(transfer_of_disc(kOptics, zero - 1e-6), 0.0);
  EXPECT_LT(transfer_of_disc(kOptics, zero + 1e-6), 0.0);
  EXPECT_NEAR(transfer_of_disc(kOptics, 0.0), 1.0, 1e-12);
  EXPECT_LT(transfer_of_disc(kOptics, 3.0), 0.0);
}

TEST(PinholeTransfer, OfShortWavesIsTheDiscs) {
  for (const double frequency : {0.2, 0.7, 1.3, 2.0, 3.0}) {
    EXPECT_NEAR(transfer_with_diffraction(kOptics, frequency, 0.01), transfer_of_disc(kOptics, frequency), 1e-3);
  }
}

// In focus (the object as far behind as the sensor before, no phase left) it is the diffraction limit of a round
// aperture: (2/pi) (acos s - s sqrt(1 - s^2)). A pinhole is never in focus; a far object at long waves comes near it.
TEST(PinholeTransfer, OfLongWavesIsTheApertures) {
  const PinholeOptics far{0.1, 1e4, 1e4, 0.0};
  const double wavelength_nm = 500.0;
  const double cut_off = 0.1 / (wavelength_nm * 1e-6 * 1e4);
  for (const double s : {0.1, 0.5, 0.9}) {
    EXPECT_NEAR(transfer_with_diffraction(far, s * cut_off, wavelength_nm),
                2.0 / kPi * (std::acos(s) - s * std::sqrt(1.0 - s * s)), 1e-3);
  }
  EXPECT_EQ(transfer_with_diffraction(far, 1.01 * cut_off, wavelength_nm), 0.0);
}

TEST(PinholeTransfer, PixelsTakeTheirSinc) {
  PinholeOptics wide = kOptics;
  wide.pixel_mm = 0.05;
  const double x = kPi * 0.05 * 1.5 * 20.0 / 5.0;
  EXPECT_NEAR(transfer_of_disc(wide, 1.5), transfer_of_disc(kOptics, 1.5) * std::sin(x) / x, 1e-12);
}

const std::filesystem::path kScenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";

TEST(VhsView, LooksStraightAtTheMiddleAndAsThePublishedScaleSays) {
  const sim::DeviceSpec device = sim::read_scene(kScenes / "vhs/steel-rule.yaml").device;
  const VhsView view(device, 0.0);
  EXPECT_NEAR((view.pixel_of({0, 0}) - Eigen::Vector2d(320, 240)).norm(), 0.0, 1e-6);
  // Near the axis a pixel's pitch times depth / distance: 36 px a mm.
  const PinholeOptics optics = optics_of(device);
  const double per_mm = optics.to_sensor_mm / optics.to_object_mm / optics.pixel_mm;
  EXPECT_NEAR((view.pixel_of({0.1, 0}) - view.pixel_of({-0.1, 0})).x(), 0.2 * per_mm, 1e-3 * per_mm);
  EXPECT_NEAR(cv::countNonZero(view.disc_mask({1, 1}, 0.5)), kPi * 0.25 * per_mm * per_mm,
              0.02 * kPi * 0.25 * per_mm * per_mm);
  // A picture of its own columns gives back where they are.
  cv::Mat columns(480, 640, CV_32FC1);
  for (int column = 0; column < columns.cols; ++column) columns.col(column) = cv::Scalar(column + 0.5);
  const RuleProfile profile = profile_along_x(columns, view, -2.0, 2.0, 3.0, 0.5);
  ASSERT_EQ(profile.values.size(), 400u);
  for (std::size_t k = 0; k < profile.values.size(); k += 50) {
    const double x = profile.from_mm + profile.step_mm * static_cast<double>(k);
    EXPECT_NEAR(profile.values[k], view.pixel_of({x, 3.0}).x(), 0.05);
  }
}

TEST(PinholeTransfer, OnTheAxisOfAThinFoilIsTheDiscs) {
  sim::DeviceSpec device = sim::read_scene(kScenes / "vhs/steel-rule.yaml").device;
  auto& pinhole = std::get<sim::PinholeSpec>(device.camera->optics);
  pinhole.foil_thickness_um = 1e-3;
  const VhsView view(device, 0.0);
  PinholeOptics optics = optics_of(device);
  optics.pixel_mm = 0.0;
  for (const double per_mm : {0.5, 1.0, 1.8, 2.4, 3.0}) {
    EXPECT_NEAR(transfer_at(device, view, {0, 0}, per_mm), transfer_of_disc(optics, per_mm), 5e-3) << per_mm;
  }
  // A foil narrows the hole off the axis along that direction, and fine lines across it are seen better.
  pinhole.foil_thickness_um = 50.0;
  EXPECT_GT(transfer_at(device, view, {6, 0}, 1.8), transfer_at(device, view, {0, 0}, 1.8) + 0.05);
}

}  // namespace
}  // namespace touchstone::lab
