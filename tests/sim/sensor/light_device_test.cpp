// Devices that say more of their light than red, green and blue: spectra and bands, coatings with print, films, milky
// gels.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "render/spectra/spectral_bands.h"
#include "sim/plan/plan.h"
#include "sim/plan/scene_bands.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/view/pixel_truth.h"
#include "sim/view/visible_scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

/// Where the shipped spectra are found from.
const std::string kDevice = std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/devices/test.yaml";

/// A pad of 12 x 12 x 3 mm under a thin lens of 64 x 64 pixels, lit by one small lamp beside it.
DeviceSpec device(const std::string& light, const std::string& gel = "", const std::string& name = kDevice) {
  return parse_yaml<DeviceSpec>(fmt::format(R"(name: test
gel: {{size_x_mm: 12, size_y_mm: 12, thickness_mm: 3, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, refractive_index: 1.41{}}}
mesh: {{fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [3, 3], fine_depth_mm: 1}}
plate: {{thickness_mm: 1, refractive_index: 1.5}}
{}
)",
                                            gel, light),
                                name);
}

const std::string kCamera = R"(camera:
  type: lens
  width: 64
  height: 64
  pixel_pitch_um: 40
  focal_length_mm: 8
  f_number: 8
  focus_distance_mm: 40
  lens_position_mm: [0, 0, -40]
  look_at_mm: [0, 0, 0]
  exposure_us: 100
  full_well_e: 100000
)";

const std::string kSpectra = R"(
  bayer: rggb
  quantum_efficiency_red: ../spectra/qe-imx273-red.csv
  quantum_efficiency_green: ../spectra/qe-imx273-green.csv
  quantum_efficiency_blue: ../spectra/qe-imx273-blue.csv
bands: {from_nm: 400, to_nm: 720}
lamps:
  - {position_mm: [4, 0, -38], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 30, power_W: 1,
     spectrum: ../spectra/led-white-4000K.csv}
)";

const std::string kPrinted = R"(coating:
  type: matt
  albedo: ../spectra/silicone-white.csv
  print: {grid: [3, 3], spacing_mm: [3, 3], diameter_mm: 2, colour: ../spectra/pigment-magenta.csv}
)";

SceneSpec scene_of(DeviceSpec device, const std::string& z = "2.5") {
  SceneSpec scene;
  scene.device = std::move(device);
  scene.object = parse_yaml<ObjectSpec>("{name: ball, shape: {type: sphere, radius_mm: 3}, albedo: 0.4}", "ball.yaml");
  scene.motion = parse_yaml<MotionSpec>("start_mm: [0, 0, 3.2]\nkeys:\n  - {frames: 1, z: {position_mm: " + z + "}}\n",
                                        "motion.yaml");
  scene.light.min_samples = 16;
  scene.light.max_samples = 64;
  return scene;
}

std::string error_of(const std::string& light, const std::string& name = "bad.yaml", const std::string& gel = "") {
  try {
    make_plan(scene_of(device(light, gel, name)));
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

struct Seen {
  SceneSpec scene;
  Plan plan;
  std::shared_ptr<const fem::Compliance> gel;
  std::vector<Truth> truths;
  std::unique_ptr<VirtualCamera> camera;
};

Seen see(SceneSpec scene) {
  static const test::TemporaryFolder cache;
  Seen seen;
  seen.scene = std::move(scene);
  seen.plan = make_plan(seen.scene);
  seen.gel = set_up_gel(seen.scene.device, cache.path());
  seen.truths = play_motion(seen.scene, seen.plan, *seen.gel);
  seen.camera = std::make_unique<VirtualCamera>(seen.scene, seen.plan, *seen.gel, seen.truths.front());
  return seen;
}

/// Mean of each band over a square of `side` mm about a point of the coating, by the pixels' first hits.
render::Spectrum mean_near(const cv::Mat& light, double x, double y, double half_mm) {
  const int bands = light.channels();
  render::Spectrum sum = render::flat_spectrum(bands, 0.0);
  int count = 0;
  // The lens at 40 mm with f = 8 sharp there: a pixel is 40 um * (40 - 8) / 8 = 0.16 mm at 40 mm of air; glass and gel
  // bring the coating nearer, which shrinks the picture's scale by some per cent only.
  const double mm_per_pixel =
      64.0 / light.cols * 0.04 * 32.0 / 8.0 * (40.0 - 3.0 * (1 - 1 / 1.41) - 1.0 * (1 - 1 / 1.5)) / 40.0;
  for (int row = 0; row < light.rows; ++row) {
    for (int column = 0; column < light.cols; ++column) {
      const double px = (column + 0.5 - 0.5 * light.cols) * mm_per_pixel;
      const double py = (row + 0.5 - 0.5 * light.rows) * mm_per_pixel;
      if (std::abs(px - x) > half_mm || std::abs(py - y) > half_mm) continue;
      for (int band = 0; band < bands; ++band) sum[band] += light.ptr<float>(row)[bands * column + band];
      ++count;
    }
  }
  EXPECT_GT(count, 0);
  return sum / count;
}

TEST(LightDevice, BandsAreAsManyAsTheColoursNeed) {
  const std::string films =
      "films: {grid: [3, 3], spacing_mm: [3, 3], side_mm: 2, transmittance: ../spectra/film-yellow-500.csv}\n";
  const SceneSpec chroma = scene_of(device(kCamera + kSpectra + kPrinted + films));
  EXPECT_EQ(make_plan(chroma).bands.count(), 16);
  EXPECT_LT(band_error(chroma, make_plan(chroma).bands), 0.02);
  // Grey things under a lamp with a spectrum, seen in grey: one band is exact.
  const std::string grey = kCamera + R"(
bands: {}
coating: {type: metal, reflectance: 0.7}
lamps:
  - {position_mm: [4, 0, -38], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 30, power_W: 1,
     spectrum: ../spectra/led-red-625.csv}
)";
  const Plan plan = make_plan(scene_of(device(grey)));
  EXPECT_EQ(plan.bands.count(), 1);
  EXPECT_NEAR(plan.bands.centres_nm[0], 625.0, 5.0);
  // As the file wants them.
  EXPECT_EQ(make_plan(scene_of(device(kCamera + "bands: {count: 8}\n"))).bands.count(), 8);
  EXPECT_EQ(make_plan(scene_of(device(kCamera + "band_wavelengths_nm: [550]\n"))).bands.count(), 1);
}

// Objects are described once for all devices: what a coating hides needs no colour in a device's own bands.
TEST(LightDevice, AnObjectOfThreeColoursUnderACoatingFitsAnyBands) {
  SceneSpec coated = scene_of(device(kCamera + kSpectra + kPrinted));
  coated.object =
      parse_yaml<ObjectSpec>("{name: ball, shape: {type: sphere, radius_mm: 3}, albedo: [0.6, 0.5, 0.4]}", "ball.yaml");
  EXPECT_EQ(make_plan(coated).bands.count(), 16);
  coated.outputs.radiance = true;
  const Seen seen = see(coated);
  EXPECT_EQ(seen.camera->capture(seen.truths.back()).radiance.channels(), 16);
  // Bare, its colour is seen.
  SceneSpec bare = scene_of(device(kCamera + kSpectra));
  bare.object = coated.object;
  EXPECT_THROW(make_plan(bare), Error);
}

// Light that passes a film of dye transmittance t twice, straight on: what is white behind it keeps t^2 of its light in
// each band.
TEST(LightDevice, FilmBeforeWhiteTakesItsTransmittanceTwice) {
  const std::string white = kCamera + R"(
bands: {from_nm: 400, to_nm: 720, count: 8}
coating: {type: matt, albedo: 0.9}
lamps:
  - {position_mm: [0.5, 0, -38], target_mm: [0, 0, 0], lens_radius_mm: 0.4, half_angle_deg: 30, power_W: 1}
)";
  const std::string film =
      "films: {grid: [1, 1], spacing_mm: [6, 6], side_mm: 4, transmittance: ../spectra/film-yellow-500.csv}\n";
  const auto centre = [](const std::string& light, const Plan*& plan_out) {
    static std::vector<Seen> kept;
    kept.reserve(4);
    SceneSpec scene = scene_of(device(light), "3.1");
    scene.outputs = {.frames = false, .radiance = true};
    scene.effects.interreflection = Switch::off;
    kept.push_back(see(scene));
    plan_out = &kept.back().plan;
    return mean_near(kept.back().camera->capture_whole(kept.back().truths.front()).radiance, 0, 0, 0.5);
  };
  const Plan* plan = nullptr;
  const render::Spectrum bare = centre(white, plan);
  const render::Spectrum filmed = centre(white + film, plan);
  const auto curve = render::read_spectral_curve(
      std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/spectra/film-yellow-500.csv", render::CurveKind::share);
  const render::Spectrum t = render::band_means(curve, *plan->bands.ranges);
  for (int band = 0; band < 8; ++band) EXPECT_NEAR(filmed[band] / bare[band], t[band] * t[band], 0.01) << band;
}

TEST(LightDevice, CoatingHidesTheObjectAndPrintMovesWithTheGel) {
  SceneSpec scene = scene_of(device(kCamera + kSpectra + kPrinted));
  scene.outputs = {.frames = false, .radiance = true};
  const Seen pressed = see(scene);
  const cv::Mat light = pressed.camera->capture_whole(pressed.truths.back()).radiance;
  scene.object.albedo = 0.0;
  const Seen dark = see(scene);
  EXPECT_EQ(cv::norm(light, dark.camera->capture_whole(dark.truths.back()).radiance, cv::NORM_INF), 0.0);

  // A marker beside the contact is pushed outwards, and the picture's markers are where their material is.
  const GelSheet sheet =
      VisibleGel(*pressed.gel)
          .sheet(pressed.truths.back().press, placed_shapes(visible_objects(scene), pressed.truths.back().press));
  const render::Surface coat = coated_surface(scene, pressed.plan, sheet);
  ASSERT_TRUE(coat.print);
  ASSERT_EQ(coat.print->marks.size(), 9u);
  EXPECT_EQ(coat.print->marks[5].centre, Eigen::Vector2d(3, 0));
  double outwards = 0.0;
  int inside = 0;
  for (std::size_t i = 0; i < sheet.rest.size(); ++i) {
    if ((sheet.rest[i].head<2>() - Eigen::Vector2d(3, 0)).norm() > 1.0) continue;
    outwards += sheet.mesh.vertices[i].x() - sheet.rest[i].x();
    ++inside;
  }
  EXPECT_GT(outwards / inside, 0.005);
  EXPECT_LT(outwards / inside, 0.2);
}

TEST(LightDevice, PrintedMarkersHaveIdsOfTheirOwn) {
  const std::string pinhole = R"(camera: {width: 64, height: 64, pixel_pitch_um: 60, hole_diameter_um: 100,
  hole_to_sensor_mm: 6, hole_position_mm: [0, 0, -16], look_at_mm: [0, 0, 0], exposure_us: 100, full_well_e: 10000}
)";
  const std::string print =
      "coating: {type: matt, albedo: 0.9, print: {grid: [3, 3], spacing_mm: [3, 3], diameter_mm: 2}}\n";
  for (const std::string& camera : {pinhole, kCamera + "  distortion: [-0.3, 0, 0, 0]\n"}) {
    SceneSpec scene = scene_of(device(camera + print));
    scene.outputs = parse_yaml<OutputSpec>("{frames: false, ids: true, contact: true}", "outputs.yaml");
    const Seen seen = see(scene);
    const Capture capture = seen.camera->capture(seen.truths.back());
    std::map<int, int> pixels;
    bool middle_in_contact = false;
    for (int row = 0; row < 64; ++row) {
      for (int column = 0; column < 64; ++column) {
        const auto at = capture.pixel_truth.image.ptr<cv::Vec2f>(row)[column];
        ++pixels[static_cast<int>(at[0])];
        if (row == 32 && column == 32) middle_in_contact = at[1] == 1.0f;
      }
    }
    EXPECT_TRUE(middle_in_contact);  // the marker's id stands even where the gel lies on the ball
    for (int marker = 0; marker < 9; ++marker) {
      EXPECT_GT(pixels[PixelId::kFirstMarker + marker], 50) << marker;  // pi r^2 is some 70 pixels, or 130
    }
    EXPECT_GT(pixels[PixelId::kGel], 500);
  }
}

TEST(LightDevice, JitterMovesMarkersWithinItsRangeAndByTheSeedOnly) {
  PrintSpec print;
  print.grid = {20, 10};
  print.spacing_mm = {1, 2};
  print.width_mm = 0.3;
  print.jitter_mm = 0.2;
  const auto discs = printed_marks(print);
  ASSERT_EQ(discs.size(), 200u);
  double widest = 0.0;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const Eigen::Vector2d place((static_cast<double>(i % 20) - 9.5) * 1.0, (static_cast<double>(i / 20) - 4.5) * 2.0);
    widest = std::max(widest, (discs[i].centre - place).cwiseAbs().maxCoeff());
  }
  EXPECT_LE(widest, 0.2);
  EXPECT_GT(widest, 0.19);
  EXPECT_EQ(printed_marks(print)[7].centre, discs[7].centre);
  print.seed = 1;
  EXPECT_NE(printed_marks(print)[7].centre, discs[7].centre);
}

// A milky gel hides what is behind it, and shows a dark thing only where it touches: there no light comes back.
TEST(LightDevice, MilkyGelShowsADarkThingWhereItTouches) {
  const std::string light = kCamera + R"(
band_wavelengths_nm: [550]
room_radiance: 0
lamps:
  - {position_mm: [0, 6, -38], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 30, power_W: 1}
)";
  SceneSpec scene =
      scene_of(device(light, ", scattering_per_mm: 2, scattering_anisotropy: 0.5, frame_albedo: 0.5"), "2.2");
  scene.object.albedo = 0.0;
  scene.outputs = {.frames = false, .radiance = true};
  scene.device.camera->width = scene.device.camera->height = 32;
  scene.device.camera->pixel_pitch_um = 80;
  scene.light.min_samples = scene.light.max_samples = 16;
  const Seen seen = see(scene);
  EXPECT_TRUE(seen.plan.scattering);
  EXPECT_TRUE(seen.plan.interreflection);
  const Capture rest = seen.camera->capture(seen.truths.front());
  const Capture pressed = seen.camera->capture(seen.truths.back());
  EXPECT_EQ(pressed.pixels_traced, 32 * 32);  // a preview would see nothing of the scattered light
  const double before = mean_near(rest.radiance, 0, 0, 0.7)[0];
  const double after = mean_near(pressed.radiance, 0, 0, 0.7)[0];
  const double beside_before = mean_near(rest.radiance, -4, -4, 1.0)[0];
  const double beside_after = mean_near(pressed.radiance, -4, -4, 1.0)[0];
  EXPECT_LT(after, 0.9 * before);
  EXPECT_NEAR(beside_after / beside_before, 1.0, 0.1);
}

TEST(LightDevice, BadColoursAreNamedByFileAndLine) {
  EXPECT_THAT(error_of(kCamera + "room_radiance: [1, 2]\n"), HasSubstr("bad.yaml:17: room_radiance: has 2 numbers, but "
                                                                       "the scene has 3 bands"));
  EXPECT_THAT(error_of(kCamera + "room_radiance: dark\n"), HasSubstr("'dark' isn't a finite number"));
  EXPECT_THAT(error_of(kCamera + "coating: {type: matt, albedo: ../spectra/silicone-white.csv}\n", kDevice),
              HasSubstr("coating.albedo: is a spectrum, but the device doesn't say its `bands`"));
  EXPECT_THAT(error_of(kCamera + "coating: {type: matt, albedo: nothing.csv}\n"), HasSubstr("nothing.csv"));
  EXPECT_THAT(error_of(kCamera + "coating: {type: matt, albedo: 1.2}\n"), HasSubstr("allowed is from 0 to 1"));
  EXPECT_THAT(error_of(kCamera + "coating: {type: metal, albedo: 0.2}\n"), HasSubstr("'reflectance' is missing"));
  EXPECT_THAT(error_of(kCamera + "coating: {type: shiny, albedo: 0.2}\n"), HasSubstr("'shiny' is not known"));
  EXPECT_THAT(error_of(kCamera + "bands: {count: 5}\n"), HasSubstr("allowed are 1, 3, 8 and 16"));
  EXPECT_THAT(error_of(kCamera + "bands: {}\nband_wavelengths_nm: [550]\n"), HasSubstr("can't stand beside bands"));
  EXPECT_THAT(error_of(kCamera + "band_wavelengths_nm: [450, 550]\n"), HasSubstr("2 wavelengths; allowed are 1, 3"));
  EXPECT_THAT(error_of(kCamera + "films: {grid: [2, 2], spacing_mm: [1, 1], side_mm: 2, transmittance: 1}\n"),
              HasSubstr("films.side_mm"));
  const std::string lamp =
      "lamps:\n  - {position_mm: [4, 0, -38], target_mm: [0, 0, 0], lens_radius_mm: 0.5, "
      "half_angle_deg: 30, spectrum: ../spectra/led-red-625.csv, power_W: ";
  EXPECT_THAT(error_of(kCamera + lamp + "[1, 2, 3]}\n", kDevice), HasSubstr("beside a spectrum it must be one number"));
  EXPECT_THAT(error_of(kCamera + lamp + "1}\n", kDevice), HasSubstr("the device doesn't say its `bands`"));
  EXPECT_THAT(error_of(kCamera + "bands: {from_nm: 400, to_nm: 500}\n" + lamp + "1}\n", kDevice),
              HasSubstr("see nothing of a lamp"));
}

}  // namespace
}  // namespace touchstone::sim
