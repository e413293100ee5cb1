#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/error.h"
#include "sim/plan/scene_bands.h"
#include "sim/scene/device_imager.h"
#include "sim/view/visible_scene.h"
#include "tests/support/message_of.h"

namespace touchstone::sim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::touchstone::test::message_of;

/// A device with a mouse's chip, whose camera has `more` fields.
DeviceSpec device_with(const std::string& more) {
  return parse_yaml<DeviceSpec>(
      "name: d\n"
      "gel: {size_x_mm: 10, size_y_mm: 10, thickness_mm: 4, youngs_modulus_MPa: 0.3}\n"
      "plate: {thickness_mm: 1, refractive_index: 1.5}\n"
      "band_wavelengths_nm: [640]\n"
      "camera: {preset: adns2620, type: lens, focal_length_mm: 2, f_number: 4, lens_position_mm: [0, 0, -20],\n"
      "         look_at_mm: [0, 0, 0], " +
          more + "}\n",
      "device.yaml");
}

render::MotionChipSettings chip_of(const DeviceSpec& device) {
  SceneSpec scene;
  scene.device = device;
  return motion_chip(device, choose_bands(scene), true);
}

TEST(MotionChipSpec, IsTheCamerasImagerWithAShutter) {
  const render::MotionChipSettings chip =
      chip_of(device_with("exposure_us: 500, motion_chip: {darkest_maximum: 30, brightest_maximum: 50}"));
  EXPECT_EQ(chip.frame_rate_Hz, 1500.0);
  EXPECT_EQ(chip.imager.exposure_s, 500e-6);
  EXPECT_EQ(chip.imager.bits, 6);
  EXPECT_FALSE(chip.imager.ideal);
  EXPECT_TRUE(chip.shutter.automatic);
  EXPECT_EQ(chip.shutter.darkest_maximum, 30);
  EXPECT_EQ(chip.shutter.brightest_maximum, 50);
  EXPECT_FALSE(chip_of(device_with("exposure_us: 500, motion_chip: {automatic_shutter: false}")).shutter.automatic);
}

TEST(MotionChipSpec, BadOnesAreRefused) {
  EXPECT_THAT(message_of([] { device_with("exposure_us: 500, width: 20, motion_chip: {}"); }), HasSubstr("18x18"));
  EXPECT_THAT(message_of([] { device_with("exposure_us: 500, motion_chip: {brightest: 3}"); }), HasSubstr("brightest"));
  EXPECT_THAT(message_of([] { chip_of(device_with("exposure_us: 500")); }), HasSubstr("has no motion_chip"));
  EXPECT_THAT(message_of([] { chip_of(device_with("exposure_us: 500, motion_chip: {brightest_maximum: 63}")); }),
              AllOf(HasSubstr("device.yaml:"), HasSubstr("camera.motion_chip")));
}

TEST(MotionChipSpec, TheShippedFingertipHasOne) {
  const DeviceSpec device = read_device(TOUCHSTONE_SOURCE_DIR "/scenes/devices/reflex.yaml");
  EXPECT_NEAR(chip_of(device).imager.exposure_s, 620e-6, 1e-12);
  EXPECT_GT(printed_marks(*device.coating->print).size(), 200U);
}

}  // namespace
}  // namespace touchstone::sim
