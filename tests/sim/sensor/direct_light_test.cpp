// Direct light in place of path tracing: where a device's coating allows it, as measured, and nowhere else.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/whole_file.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/light_limits.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_camera.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kMatt = "coating: {type: matt, albedo: 0.5}\n";
const std::string kPrinted =
    "coating: {type: matt, albedo: 0.5, print: {grid: [3, 3], spacing_mm: [3, 3], diameter_mm: 1}}\n";
const std::string kClear = "";
const std::string kSpots = R"(
  - {position_mm: [-9, 0, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 40, power_W: [3, 1, 1]}
  - {position_mm: [9, 0, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 40, power_W: [1, 3, 1]}
  - {position_mm: [0, 9, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 40, power_W: [1, 1, 3]}
)";
const std::string kVisibleLed =
    "\n  - {type: led, position_mm: [9, 0, -14], target_mm: [0, 0, 0], chip_radius_mm: 0.5, visible: true, power_W: "
    "[1, 1, 1]}\n";

const test::TemporaryFolder& folder() {
  static const test::TemporaryFolder made;
  return made;
}

/// A ball pressed into a pad of 12 x 12 x 3 mm, with the lamps beside a lens of 24 x 24 pixels. `keys` are further
/// lines of the scene file, from its fifth line on.
SceneSpec scene_of(const std::string& coating, const std::string& keys = "", const std::string& lamps = kSpots,
                   const std::string& gel = "") {
  const auto& at = folder().path();
  const auto write = [&](const char* name, const std::string& text) {
    write_whole_file(at / name, [&](const std::filesystem::path& file) { std::ofstream(file) << text; });
  };
  write("device.yaml", R"(name: coated
gel: {size_x_mm: 12, size_y_mm: 12, thickness_mm: 3, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, refractive_index: 1.41)" +
                           gel +
                           R"(}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [3, 3], fine_depth_mm: 1}
plate: {thickness_mm: 1, refractive_index: 1.5}
camera: {type: lens, width: 24, height: 24, pixel_pitch_um: 107, focal_length_mm: 6, f_number: 8, focus_distance_mm: 27,
  lens_position_mm: [0, 0, -28], look_at_mm: [0, 0, 0], exposure_us: 100, full_well_e: 100000}
)" + coating + "lamps:" + lamps);
  write("ball.yaml", "{name: ball, shape: {type: sphere, radius_mm: 3}, albedo: 0.4}");
  write("press.yaml", "start_mm: [0, 0, 3.2]\nkeys:\n  - {frames: 2, z: {position_mm: 2.6}}\n");
  write("scene.yaml",
        "\n\ndevice: device.yaml\nobject: ball.yaml\nmotion: press.yaml\noutputs: {radiance: true}\n" + keys);
  return read_scene(at / "scene.yaml");
}

struct Seen {
  SceneSpec scene;
  Plan plan;
  std::shared_ptr<const fem::Compliance> gel;
  std::vector<Truth> truths;
  std::unique_ptr<const VirtualCamera> camera;

  Capture last() const { return camera->capture(truths.back()); }
};

Seen see(SceneSpec scene) {
  Seen seen;
  seen.scene = std::move(scene);
  seen.plan = make_plan(seen.scene);
  seen.gel = set_up_gel(seen.scene.device, folder().path());
  seen.truths = play_motion(seen.scene, seen.plan, *seen.gel);
  seen.camera = std::make_unique<const VirtualCamera>(seen.scene, seen.plan, *seen.gel, seen.truths);
  return seen;
}

bool same_bytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a.reshape(1), b.reshape(1), cv::NORM_INF) == 0.0;
}

const Effect& row_of(const Plan& plan) {
  return *std::find_if(plan.effects.begin(), plan.effects.end(),
                       [](const Effect& effect) { return effect.name == "direct light"; });
}

/// Root mean square difference from path tracing over the root mean square of that, without the paths' noise: from
/// products of the differences to two independent renderings.
double off_paths(const cv::Mat& picture, const std::array<cv::Mat, 2>& traced) {
  const cv::Mat a = picture - traced[0];
  const cv::Mat b = picture - traced[1];
  return std::sqrt(std::max(0.0, a.reshape(1).dot(b.reshape(1))) / traced[0].reshape(1).dot(traced[1].reshape(1)));
}

std::array<cv::Mat, 2> traced_twice(SceneSpec scene, std::size_t frame) {
  scene.effects.direct_light = Switch::off;
  scene.light.noise_fraction = 1e-6;
  scene.light.min_samples = scene.light.max_samples = 96;
  std::array<cv::Mat, 2> traced;
  for (cv::Mat& one : traced) {
    ++scene.seed;
    const Seen seen = see(scene);
    one = seen.camera->capture_whole(seen.truths[frame]).radiance;
  }
  return traced;
}

TEST(DirectLight, ACoatedGelsPicturesAreWithinTheTolerance) {
  const SceneSpec scene = scene_of(kMatt);
  const Seen seen = see(scene);
  EXPECT_TRUE(seen.plan.direct_light);
  const LightChoice& choice = seen.camera->light_choice();
  ASSERT_TRUE(choice.direct) << choice.reason;
  ASSERT_TRUE(choice.error);
  EXPECT_THAT(choice.reason, HasSubstr("direct light"));
  EXPECT_LE(largest_rms(*choice.error), LightLimits{}.direct_tolerance);
  const Capture last = seen.last();
  EXPECT_TRUE(last.direct);
  const std::array<cv::Mat, 2> traced = traced_twice(scene, 2);
  EXPECT_LT(off_paths(last.radiance, traced), LightLimits{}.direct_tolerance);
  EXPECT_GT(off_paths(seen.camera->capture(seen.truths.front()).radiance, traced), LightLimits{}.direct_tolerance)
      << "the press is seen";
}

const std::string kTranslucent = "coating: {type: matt, albedo: 0.4, transmittance: 0.3}\n";

SceneSpec with_ball(SceneSpec scene, double albedo) {
  scene.object.albedo = albedo;
  return scene;
}

// Behind the touched coat lies the ball in place of the gel's face to air (0.536): 0.4 + 0.09 b / (1 - 0.4 b).
TEST(DirectLight, ATranslucentCoatShowsWhetherABrightOrADarkBallTouchesIt) {
  const Seen dark = see(with_ball(scene_of(kTranslucent), 0.0));
  const Seen bright = see(with_ball(scene_of(kTranslucent), 0.9));
  ASSERT_TRUE(dark.plan.translucent_coating && bright.plan.translucent_coating);
  ASSERT_TRUE(dark.camera->light_choice().direct) << dark.camera->light_choice().reason;
  const auto ratio = [](const cv::Mat& above, const cv::Mat& below, int row, int column, int band) {
    return above.at<cv::Vec3f>(row, column)[band] / below.at<cv::Vec3f>(row, column)[band];
  };
  const cv::Mat of_dark = dark.last().radiance;
  const cv::Mat of_bright = bright.last().radiance;
  const cv::Mat at_rest = dark.camera->capture(dark.truths.front()).radiance;
  for (int band = 0; band < 3; ++band) {
    EXPECT_NEAR(ratio(of_bright, of_dark, 12, 12, band), 1.0 + 0.09 * 0.9 / (1.0 - 0.36) / 0.4, 2e-3);
    EXPECT_NEAR(ratio(of_bright, of_dark, 1, 1, band), 1.0, 2e-3);
    const double free = 0.4 + 0.09 * 0.536 / (1.0 - 0.4 * 0.536);
    EXPECT_NEAR(ratio(of_dark, at_rest, 12, 12, band), 0.4 / free, 0.1) << "the ball's middle lies deeper";
  }
  const std::array<cv::Mat, 2> traced = traced_twice(dark.scene, 2);
  EXPECT_LT(off_paths(of_dark, traced), LightLimits{}.direct_tolerance);
  EXPECT_GT(off_paths(of_bright, traced), off_paths(of_dark, traced));
}

TEST(DirectLight, ACoatIsTranslucentWhereThatIsSeen) {
  const auto change_of = [](const std::string& coating, double albedo, const std::string& keys = "") {
    return make_plan(with_ball(scene_of(coating, keys), albedo)).translucent_coating;
  };
  EXPECT_TRUE(change_of(kTranslucent, 0.4));
  EXPECT_FALSE(change_of(kTranslucent, 0.535)) << "as bright as the gel's own face";
  EXPECT_FALSE(change_of("coating: {type: matt, albedo: 0.4, transmittance: 0.02}\n", 0.9));
  EXPECT_FALSE(change_of(kMatt, 0.9));
  EXPECT_FALSE(change_of(kTranslucent, 0.0, "effects: {translucent_coating: off}\n"));
  EXPECT_THROW(change_of("coating: {type: metal, reflectance: 0.4, transmittance: 0.2}\n", 0.4), Error);
  EXPECT_THAT(test::message_of([&] { change_of("coating: {type: matt, albedo: 0.8, transmittance: 0.3}\n", 0.4); }),
              AllOf(HasSubstr("device.yaml:7"), HasSubstr("coating.transmittance: with albedo it is 1.1")));
  SceneSpec luminous = scene_of(kTranslucent);
  luminous.object.radiance = 1.0;
  EXPECT_THAT(test::message_of([&] { make_plan(luminous); }), HasSubstr("a luminous object isn't simulated behind"));
  luminous.effects.translucent_coating = Switch::off;
  EXPECT_FALSE(make_plan(luminous).translucent_coating);
}

// One beam for all of a lamp of 14 mm ends its light at a line where it fades.
TEST(DirectLight, AWideLampsLightFadesOnAFlank) {
  const SceneSpec scene = scene_of(kMatt, "", R"(
  - {type: area, position_mm: [-9, 0, -6], target_mm: [0, 0, 0], size_mm: [14, 3], along: [0, 1, 0], power_W: [1, 0.5, 0.2]}
  - {type: area, position_mm: [0, 11, -9], target_mm: [0, 0, 0], size_mm: [8, 8], power_W: [0.2, 0.5, 1]}
)",
                                   ", frame: clear");
  const Seen seen = see(scene);
  ASSERT_TRUE(seen.camera->light_choice().direct) << seen.camera->light_choice().reason;
  EXPECT_LT(off_paths(seen.last().radiance, traced_twice(scene, 2)), 0.006) << "as one beam each: 0.0094";
}

// LEDs beside the pad, as deep as it: what is painted round it hides them.
TEST(DirectLight, LightComesInThroughClearSides) {
  const std::string leds = R"(
  - {type: led, position_mm: [-8, 0, -2.5], target_mm: [0, 0, -1], power_W: [1, 0, 0]}
  - {type: led, position_mm: [0, 8, -2.5], target_mm: [0, 0, -1], power_W: [0, 1, 0]}
)";
  EXPECT_THAT(test::message_of([&] { scene_of(kMatt, "", leds); }), HasSubstr("z = -2.5 is in the gel"));
  SceneSpec scene = scene_of(kMatt, "", leds, ", frame: clear");
  const Seen clear = see(scene);
  ASSERT_TRUE(clear.camera->light_choice().direct) << clear.camera->light_choice().reason;
  const cv::Mat lit = clear.last().radiance;
  EXPECT_GT(lit.at<cv::Vec3f>(12, 12)[0], 1e-3f);
  EXPECT_LT(off_paths(lit, traced_twice(scene, 2)), LightLimits{}.direct_tolerance);
  EXPECT_GT(lit.at<cv::Vec3f>(12, 3)[0], lit.at<cv::Vec3f>(12, 20)[0]) << "red comes from the left";
  scene.device.gel.frame = GelFrame::painted;
  EXPECT_LT(see(scene).last().radiance.at<cv::Vec3f>(12, 12)[0], 1e-6f);
}

TEST(DirectLight, SwitchedOffOrTooFarOffThePathTracersBytesStay) {
  const Seen off = see(scene_of(kMatt, "effects: {direct_light: off}\n"));
  EXPECT_FALSE(off.plan.direct_light);
  EXPECT_FALSE(off.camera->light_choice().direct);
  const Seen strict = see(scene_of(kMatt, "light: {direct_tolerance: 1.0e-3}\n"));
  EXPECT_TRUE(strict.plan.direct_light);
  EXPECT_FALSE(strict.camera->light_choice().direct);
  EXPECT_THAT(strict.camera->light_choice().reason, AllOf(HasSubstr("paths"), HasSubstr("allowed are 0.1 %")));
  const Capture one = off.last();
  const Capture other = strict.last();
  EXPECT_FALSE(other.direct);
  EXPECT_TRUE(same_bytes(one.radiance, other.radiance));
  EXPECT_TRUE(same_bytes(one.frame, other.frame));
}

TEST(DirectLight, WhereTheAccuracyCantBeHadWhatIsNearestIsTakenAndSaysSo) {
  const std::string strict = "accuracy: {pixel_noise: 0.01}\n";
  SceneSpec scene = scene_of(kMatt, strict + "light: {max_samples: 16}\n");
  scene.device.camera->exposure_us = 0.03;  // below its full well
  const Seen seen = see(scene);
  ASSERT_TRUE(seen.camera->light_choice().direct) << seen.camera->light_choice().reason;
  EXPECT_THAT(seen.camera->light_choice().reason,
              AllOf(HasSubstr("allowed are 0.0071 of the imager's noise"), HasSubstr("16 paths a pixel would leave")));
}

TEST(DirectLight, AnExposureIsTheMeanOfItsMoments) {
  SceneSpec scene = scene_of(kMatt, "effects: {motion_blur: on}\n");
  scene.device.camera->exposure_us = 20000.0;
  scene.light.motion_tolerance_px = 0.1;
  const Seen seen = see(scene);
  ASSERT_TRUE(seen.camera->light_choice().direct) << seen.camera->light_choice().reason;
  const std::size_t moving = 1;
  const Capture blurred = seen.camera->capture(seen.truths[moving]);
  EXPECT_TRUE(blurred.direct);
  EXPECT_GE(blurred.pixels_traced, 2 * 24 * 24) << "several moments";
  EXPECT_LT(off_paths(blurred.radiance, traced_twice(scene, moving)), LightLimits{}.direct_tolerance);
  scene.effects.motion_blur = Switch::off;
  const Seen sharp = see(scene);
  EXPECT_FALSE(same_bytes(blurred.radiance, sharp.camera->capture(sharp.truths[moving]).radiance));
}

TEST(DirectLight, OnTakesItWhateverItsError) {
  const Seen forced = see(scene_of(kMatt, "effects: {direct_light: on}\nlight: {direct_tolerance: 1.0e-3}\n"));
  EXPECT_TRUE(forced.camera->light_choice().direct);
  EXPECT_TRUE(forced.last().direct);
}

std::string error_of(const std::string& coating, const std::string& keys, const std::string& lamps = kSpots) {
  try {
    see(scene_of(coating, keys, lamps));
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(DirectLight, OnForAnUnfitSceneNamesThePlaceAndTheReason) {
  const std::string on = "effects: {direct_light: on}\n";
  EXPECT_THAT(error_of(kClear, on), AllOf(HasSubstr("scene.yaml:3"), HasSubstr("no coating")));
  EXPECT_THAT(error_of(kMatt, on, kVisibleLed), AllOf(HasSubstr("scene.yaml:3"), HasSubstr("seen")));
  const std::string sharp_rim =
      "\n  - {position_mm: [0, 0, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.001, half_angle_deg: 9, "
      "soft_angle_deg: 0, "
      "power_W: [1, 1, 1]}\n";
  EXPECT_THAT(error_of(kMatt, on, sharp_rim), AllOf(HasSubstr("scene.yaml:3"), HasSubstr("light field")));
  EXPECT_THAT(error_of(kMatt, "effects: {direct_light: maybe}\n"), HasSubstr("scene.yaml:7"));
  EXPECT_THAT(error_of(kMatt, "light: {direct_tolerance: 0}\n"), HasSubstr("scene.yaml:7"));
}

TEST(DirectLight, AnUnfitSceneKeepsItsPathsAndThePlanSaysWhy) {
  const Seen seen = see(scene_of(kClear));
  EXPECT_FALSE(seen.plan.direct_light);
  EXPECT_THAT(row_of(seen.plan).why, HasSubstr("no coating"));
  const Capture last = seen.last();
  EXPECT_FALSE(last.direct);
  const Seen off = see(scene_of(kClear, "effects: {direct_light: off}\n"));
  EXPECT_TRUE(same_bytes(last.radiance, off.last().radiance));
  SceneSpec scene = scene_of(kMatt);
  scene.outputs.error = true;
  EXPECT_THAT(row_of(make_plan(scene)).why, HasSubstr("standard error"));
}

TEST(DirectLight, APrintedCoatingIsFit) {
  const Seen seen = see(scene_of(kPrinted, "effects: {direct_light: on}\n"));
  EXPECT_TRUE(seen.plan.direct_light);
  EXPECT_TRUE(seen.last().direct);
  EXPECT_FALSE(same_bytes(seen.last().radiance, see(scene_of(kMatt, "effects: {direct_light: on}\n")).last().radiance));
}

TEST(DirectLight, AGelBeyondTheFieldIsPathTraced) {
  const Seen seen = see(scene_of(kMatt, "effects: {direct_light: on}\n"));
  const VirtualCamera shallow(seen.scene, seen.plan, *seen.gel, seen.truths.front());
  ASSERT_TRUE(shallow.light_choice().direct);
  EXPECT_TRUE(shallow.capture(seen.truths.front()).direct);
  const Capture beyond = shallow.capture(seen.truths.back());
  EXPECT_FALSE(beyond.direct);
  const Seen off = see(scene_of(kMatt, "effects: {direct_light: off}\n"));
  EXPECT_TRUE(same_bytes(beyond.radiance, off.camera->capture_whole(off.truths.back()).radiance));
}

TEST(DirectLight, TheBytesDependOnNoThreadsAndNoOrder) {
  const Seen seen = see(scene_of(kMatt));
  std::vector<Capture> alone(seen.truths.size());
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const VirtualCamera camera(seen.scene, seen.plan, *seen.gel, seen.truths);
    for (std::size_t i = alone.size(); i-- > 0;) alone[i] = camera.capture(seen.truths[i]);
  }
  std::vector<Capture> together(4 * alone.size());
  tbb::parallel_for(std::size_t{0}, together.size(),
                    [&](std::size_t i) { together[i] = seen.camera->capture(seen.truths[i % alone.size()]); });
  for (std::size_t i = 0; i < together.size(); ++i) {
    EXPECT_TRUE(together[i].direct);
    EXPECT_TRUE(same_bytes(together[i].radiance, alone[i % alone.size()].radiance)) << i;
    EXPECT_TRUE(same_bytes(together[i].frame, alone[i % alone.size()].frame)) << i;
  }
}

}  // namespace
}  // namespace touchstone::sim
