#include "lab/bench/device_bench.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <stdexcept>

#include "core/error.h"
#include "core/random.h"
#include "core/yaml_reader.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/device_bench_parts.h"
#include "tests/support/message_of.h"
#include "tests/support/small_scene.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

render::Imager grey_imager() {
  render::Imager imager;
  imager.active_area_um2 = 10.0;
  imager.exposure_s = 1e-3;
  imager.quantum_efficiency = render::QuantumEfficiency::Constant(1, 1, 0.5);
  imager.wavelengths_nm = render::Spectrum::Constant(1, 550.0);
  imager.full_well_e = 10000.0;
  imager.read_noise_e = 3.0;
  imager.gain_DN_per_e = 255.0 / 10000.0;
  return imager;
}

/// A million pixels of this many electrons, with a spread that differs from seed to seed.
std::vector<cv::Mat> even(double electrons, double spread, std::uint64_t seed) {
  cv::Mat picture(1000, 1000, CV_32FC1);
  RandomStream random(seed, 0, Purpose::kTest);
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      picture.at<float>(row, column) = static_cast<float>(electrons + spread * random.normal());
    }
  }
  return {picture};
}

/// A bias of 20 electrons beside some 33 of noise is 0.6, whatever the paths' own noise is; a single picture's own
/// noise counts: sqrt(20^2 + 50^2).
TEST(PixelError, IsFreeOfTheReferencesNoise) {
  const render::Imager imager = grey_imager();
  const double noise = render::noise_e(render::response_of(imager), 1000.0);
  const auto one = even(1020.0, 50.0, 1);
  const auto other = even(1020.0, 50.0, 2);
  const auto true_one = even(1000.0, 40.0, 3);
  const auto true_other = even(1000.0, 40.0, 4);
  EXPECT_NEAR(pixel_error(one, other, true_one, true_other, imager), 20.0 / noise, 0.01);
  EXPECT_NEAR(pixel_error(one, one, true_one, true_other, imager), std::hypot(20.0, 50.0) / noise, 0.01);
  EXPECT_EQ(pixel_error(one, one, one, one, imager), 0.0);
}

TEST(PixelError, SeesNothingBeyondTheFullWell) {
  EXPECT_EQ(pixel_error(even(1000.0, 0.0, 1), even(1000.0, 0.0, 1), even(50000.0, 0.0, 1), even(50000.0, 0.0, 1),
                        grey_imager()),
            0.0);
}

TEST(BenchPresses, LieWithinAnEdgeAndAFifthOfTheDepth) {
  const std::vector<sim::PressSpec> specs = bench_presses(50, 0.5, 0.4, 7);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const sim::PressSpec& spec : specs) {
    EXPECT_LE(spec.place_mm.cwiseAbs().maxCoeff(), 0.25);
    EXPECT_NEAR(*spec.depth_mm, 0.4, 0.2 * 0.4);
    EXPECT_NEAR(spec.drag_mm.norm(), 0.4 / 3.0, 1e-12);
    sum += spec.drag_mm;
  }
  EXPECT_LT(sum.norm(), 0.1) << "into all directions";
  EXPECT_EQ(bench_presses(50, 0.5, 0.4, 7)[17].place_mm, specs[17].place_mm);
  EXPECT_NE(bench_presses(50, 0.5, 0.4, 8)[17].place_mm, specs[17].place_mm);
}

TEST(MiddleOf, KeepsTheAxisAndTheMosaic) {
  sim::DeviceSpec device;
  sim::CameraSpec& camera = device.camera.emplace();
  camera.width = 1456;
  camera.height = 1088;
  camera.optics.emplace<sim::LensSpec>().camera_matrix = Eigen::Vector4d(2000, 2000, 731.5, 541.5);
  const sim::CameraSpec middle = *middle_of(device, 320 * 240).camera;
  const Eigen::Vector4d matrix = std::get<sim::LensSpec>(middle.optics).camera_matrix.value();
  EXPECT_LE(middle.width * middle.height, 320 * 240);
  EXPECT_GT(middle.width * middle.height, 310 * 232);
  EXPECT_EQ((camera.width - middle.width) % 4, 0) << "whole blocks of the mosaic on either side";
  EXPECT_EQ((camera.height - middle.height) % 4, 0);
  EXPECT_EQ(matrix[2] - 0.5 * middle.width, 731.5 - 0.5 * camera.width);
  EXPECT_EQ(matrix[3] - 0.5 * middle.height, 541.5 - 0.5 * camera.height);
  EXPECT_EQ(middle_of(middle_of(device, 320 * 240), 320 * 240).camera->width, middle.width);
}

TEST(MiddleOf, HasItsPartOfTheBackground) {
  sim::DeviceSpec device;
  device.camera.emplace().width = 64;
  device.camera->height = 48;
  device.background = cv::Mat(48, 64, CV_8UC3);
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      device.background.at<cv::Vec3b>(v, u) = {static_cast<unsigned char>(u), static_cast<unsigned char>(v), 0};
    }
  }
  const sim::DeviceSpec middle = middle_of(device, 32 * 24);
  ASSERT_EQ(middle.background.size(), cv::Size(middle.camera->width, middle.camera->height));
  EXPECT_EQ(middle.background.at<cv::Vec3b>(0, 0),
            cv::Vec3b(static_cast<unsigned char>((64 - middle.camera->width) / 2),
                      static_cast<unsigned char>((48 - middle.camera->height) / 2), 0));
}

const BenchCurve& curve(const DeviceBench& bench, const std::string& name) {
  const auto found =
      std::find_if(bench.curves.begin(), bench.curves.end(), [&](const auto& c) { return c.name == name; });
  if (found == bench.curves.end()) throw std::runtime_error("no curve '" + name + "'; pictures: " + bench.pictures);
  return *found;
}

const BenchPoint& point(const BenchCurve& curve, const std::string& setting) {
  const auto found = std::find_if(curve.points.begin(), curve.points.end(),
                                  [&](const auto& p) { return p.setting.find(setting) != std::string::npos; });
  if (found == curve.points.end()) throw std::runtime_error("no point '" + setting + "' of " + curve.name);
  return *found;
}

/// What device_bench_estimator_test.cpp is about takes longer than all else here.
BenchSettings without_estimator() {
  BenchSettings settings;
  settings.estimator.on = false;
  return settings;
}

constexpr int kFewTetrahedra = 12000;  // a reference in a few seconds

/// Short of light, as cameras behind a hole are: their noise is some 4 % of what they see.
sim::DeviceSpec dim_device() {
  sim::DeviceSpec device = test::small_device();
  device.camera->width = 64;
  device.camera->height = 48;
  device.camera->pixel_pitch_um = 45;
  device.camera->exposure_us = 2;
  device.camera->full_well_e = 1000;
  return device;
}

const DeviceBench& clear_bench() {
  static const DeviceBench bench = [] {
    BenchSettings settings = without_estimator();
    settings.force_error = 0.03;
    settings.pixel_error = 1.0;
    settings.most_tetrahedra = kFewTetrahedra;
    return bench_device(dim_device(), settings);
  }();
  return bench;
}

TEST(DeviceBench, FinerMeshesCostMoreAndErrLess) {
  const BenchCurve& mesh = curve(clear_bench(), "mesh");
  ASSERT_EQ(mesh.points.size(), 6u);
  const BenchPoint& coarsest = mesh.points.front();
  const BenchPoint& finest = mesh.points.back();
  EXPECT_LT(finest.force_error, 0.5 * coarsest.force_error);
  EXPECT_LT(finest.beads_um, coarsest.beads_um);
  EXPECT_GT(finest.work, 10.0 * coarsest.work);
  EXPECT_EQ(std::count_if(mesh.points.begin(), mesh.points.end(), [](const auto& p) { return p.as_is; }), 1);
}

TEST(DeviceBench, LinearElementsErrFarMoreOnTheSameMesh) {
  const BenchCurve& element = curve(clear_bench(), "element");
  const double edge = 1.2;  // mm, 1.5 times the device's
  EXPECT_GT(point(element, fmt::format("linear (P1), fine_mm {}", edge)).force_error,
            5.0 * point(element, fmt::format("Taylor-Hood (P2/P1), fine_mm {}", edge)).force_error);
}

TEST(DeviceBench, TighterContactErrsLess) {
  const BenchCurve& contact = curve(clear_bench(), "contact");
  EXPECT_LE(point(contact, "traction to 1e-10").force_error, point(contact, "traction to 1e-02").force_error);
  EXPECT_LT(point(contact, "traction to 1e-10").force_error, 1e-6);
}

/// Four times the paths halve the noise, as they do if they are drawn by chance. They are stratified, so that it falls
/// somewhat faster, but not as one over their number: edges and bright rare paths are left to chance.
TEST(DeviceBench, NoiseFallsAtLeastAsTheRootOfThePaths) {
  const std::vector<BenchPoint>& samples = curve(clear_bench(), "samples").points;
  ASSERT_GE(samples.size(), 3u);
  EXPECT_EQ(samples.front().work, samples.front().value);
  for (std::size_t k = 1; k < 3; ++k) {
    EXPECT_EQ(samples[k].work, 4.0 * samples[k - 1].work);
    const double falls = samples[k - 1].pixel_error / samples[k].pixel_error;
    EXPECT_GT(falls, 1.9) << samples[k].setting;
    EXPECT_LT(falls, 3.9) << samples[k].setting;
  }
}

TEST(DeviceBench, CurvesOfPathsEndWhereTheyAreGoodEnough) {
  std::vector<double> errors;
  bool left_out = false;  // as a slow machine would take too long for it
  for (const BenchPoint& one : curve(clear_bench(), "light").points) {
    if (!one.setting.starts_with("paths to")) continue;
    left_out = one.note.starts_with("left out");
    if (!left_out) errors.push_back(one.pixel_error);
  }
  ASSERT_FALSE(errors.empty());
  if (!left_out) {
    EXPECT_LT(errors.back(), 0.7) << "of the wanted 1";
    errors.pop_back();
  }
  for (const double error : errors) EXPECT_GE(error, 0.7);
}

TEST(DeviceBench, ItsChoiceHoldsOnOtherPresses) {
  const BenchChoice& choice = clear_bench().choice;
  EXPECT_TRUE(choice.holds) << choice.remark << choice.verified_force << " " << choice.verified_pixel;
  EXPECT_LE(choice.verified_force, 0.03);
  EXPECT_LE(choice.verified_pixel, 1.0);
  EXPECT_GT(choice.verified_force, 0.0);
  EXPECT_NEAR(choice.fine_mm, 0.8 * choice.edges, 1e-12);
  EXPECT_GT(choice.frame_s, 0.0);
  EXPECT_FALSE(choice.light_words.empty());
}

TEST(DeviceBench, TellsWhatEachEffectBuys) {
  const std::vector<EffectShare>& effects = clear_bench().effects;
  const auto share = [&](const std::string& name) {
    const auto found = std::find_if(effects.begin(), effects.end(), [&](const auto& e) { return e.name == name; });
    if (found == effects.end()) throw std::runtime_error("no effect '" + name + "'");
    return *found;
  };
  EXPECT_TRUE(share("friction").planned);
  EXPECT_GT(share("friction").force_change, 0.01) << "without it nothing is dragged along";
  EXPECT_TRUE(share("refraction").planned);
  EXPECT_GT(share("refraction").pixel_change, 1.0);
  EXPECT_EQ(share("refraction").force_change, 0.0);
  EXPECT_LT(share("sensor noise").pixel_change, 1e-6) << "the light is the same";
  EXPECT_GT(share("sensor noise").number_change, 0.1);
  EXPECT_FALSE(share("finite strain (neo-Hookean)").planned);
  EXPECT_GT(share("finite strain (neo-Hookean)").force_change, 0.0);
}

TEST(DeviceBench, SaysWhatItsPlansHold) {
  BenchSettings settings = without_estimator();
  settings.planned_alone = true;
  settings.most_tetrahedra = kFewTetrahedra;
  const PlannedBench planned = bench_device(dim_device(), settings).planned;
  ASSERT_EQ(planned.ways.size(), 2u);
  EXPECT_GT(planned.force_error, 0.0);
  EXPECT_LT(planned.force_error, 0.2);
  for (const PlannedWay& way : planned.ways) {
    EXPECT_TRUE(std::isfinite(way.pixel_error)) << way.name << ": " << way.note;
    EXPECT_GT(way.frame_s, 0.0);
  }
  EXPECT_LE(planned.ways[1].pixel_error, std::max(1.0, planned.ways[0].pixel_error)) << "by need it is no worse";
  EXPECT_THAT(planned.needs, HasSubstr("interreflection pixels by"));
}

TEST(DeviceBench, ReportsAPageATableAndADeviceThatCanBeRead) {
  const std::string text =
      "name: small\nmesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [3, 3], fine_depth_mm: 1}\n";
  const StudyResult result = report(clear_bench(), text);
  const auto file = [&](const std::string& name) {
    const auto found =
        std::find_if(result.files.begin(), result.files.end(), [&](const auto& f) { return f.name == name; });
    if (found == result.files.end()) throw std::runtime_error("no file '" + name + "'");
    return found->text;
  };
  EXPECT_THAT(file("bench.md"), HasSubstr("# What accuracy costs: small"));
  EXPECT_THAT(file("bench.md"), HasSubstr("It holds on them"));
  EXPECT_THAT(file("bench.md"), HasSubstr("## As planned"));
  EXPECT_THAT(file("small-mesh.svg"), HasSubstr("<svg"));
  EXPECT_THAT(file("small.yaml"),
              HasSubstr(fmt::format("fine_mm: {:.4g}", std::round(1e4 * clear_bench().choice.fine_mm) / 1e4)));
  const std::string csv = file("bench.csv");
  std::size_t points = 0;
  for (const BenchCurve& one : clear_bench().curves) points += one.points.size();
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')), points + 1);
}

/// Edges of 0.4 mm couldn't be had; from 0.8 mm on forces hold, from 0.6 mm on pictures, too.
TEST(CoarsestHolding, LeavesOutWhatCouldNotBeHad) {
  BenchCurve mesh;
  const auto add = [&](double edge, double force, double pixel) {
    BenchPoint point;
    point.value = edge;
    point.force_error = force;
    point.pixel_error = pixel;
    mesh.points.push_back(point);
  };
  add(1.0, 0.02, 0.9);
  add(0.8, 0.009, 0.8);
  add(0.6, 0.003, 0.6);
  add(0.5, 0.001, 0.5);
  add(0.4, kUnknown, kUnknown);
  const HoldingMesh forces = coarsest_holding(mesh, 0.01, 1.0);
  ASSERT_NE(forces.holds, nullptr);
  EXPECT_EQ(forces.holds->value, 0.8);
  EXPECT_EQ(forces.coarser->value, 1.0);
  EXPECT_EQ(coarsest_holding(mesh, 0.01, 0.7).holds->value, 0.6);
  EXPECT_EQ(coarsest_holding(mesh, 1e-4, 1.0).holds, nullptr);
  EXPECT_EQ(coarsest_holding(mesh, 1.0, 1.0).coarser, nullptr);
}

TEST(DeviceBench, ACoatedDeviceHasDirectLightAndItsOwnContactPixels) {
  BenchSettings settings = without_estimator();
  settings.force_error = 0.05;
  settings.pixel_error = 3.0;
  settings.most_pixels = 1000;
  settings.finite_strain = false;
  settings.most_tetrahedra = kFewTetrahedra;
  const DeviceBench bench = bench_device(test::small_coated_device(), settings);
  EXPECT_THAT(bench.pictures, Not(HasSubstr("full well")));
  EXPECT_TRUE(std::isfinite(point(curve(bench, "light"), "direct light").pixel_error));
  const BenchCurve& pixels = curve(bench, "contact pixels");
  EXPECT_GT(pixels.points.front().pixel_error, pixels.points.back().pixel_error);
  EXPECT_EQ(std::count_if(pixels.points.begin(), pixels.points.end(), [](const auto& p) { return p.as_is; }), 1);
  EXPECT_TRUE(bench.choice.holds) << bench.choice.remark;
}

TEST(DeviceBench, EventsComeNearerWithSmallerSteps) {
  sim::DeviceSpec device = dim_device();
  device.camera->events.emplace().pixels.dark_intensity = 10.0;
  BenchSettings settings = without_estimator();
  settings.force_error = 0.1;
  settings.pixel_error = 5.0;
  settings.most_pixels = 1000;
  settings.finite_strain = false;
  settings.most_tetrahedra = kFewTetrahedra;
  const DeviceBench bench = bench_device(device, settings);
  const BenchCurve& steps = curve(bench, "event step");
  ASSERT_EQ(steps.points.size(), 6u) << steps.what;
  EXPECT_GT(steps.points.front().event_error, steps.points[4].event_error);
  EXPECT_LT(steps.points.front().work, steps.points.back().work);
}

TEST(DeviceBench, SaysThatPicturesFillTheWells) {
  sim::DeviceSpec device = dim_device();
  device.camera->exposure_us *= 1e3;
  BenchSettings settings = without_estimator();
  settings.force_error = 0.2;  // coarse meshes, too, on which a ball stands on two or three vertices
  settings.finite_strain = false;
  settings.most_tetrahedra = kFewTetrahedra;
  const DeviceBench bench = bench_device(device, settings);
  EXPECT_THAT(bench.pictures, HasSubstr("full well"));
  EXPECT_TRUE(std::isnan(bench.choice.verified_pixel));
  for (const BenchCurve& one : bench.curves) EXPECT_NE(one.name, "light");
}

TEST(DeviceBench, WithoutACameraItIsAboutForces) {
  sim::DeviceSpec device = test::small_device();
  device.camera.reset();
  device.lamps.clear();
  BenchSettings settings = without_estimator();
  settings.force_error = 0.05;
  settings.finite_strain = false;
  settings.most_tetrahedra = kFewTetrahedra;
  const DeviceBench bench = bench_device(device, settings);
  EXPECT_THAT(bench.pictures, HasSubstr("no camera"));
  EXPECT_TRUE(std::isnan(bench.choice.verified_pixel));
  EXPECT_TRUE(bench.choice.holds);
  EXPECT_EQ(bench.curves.size(), 3u);
}

TEST(DeviceBench, RefusesWhatMakesNoSense) {
  const auto message = [](const auto& change) {
    sim::DeviceSpec device = test::small_device();
    BenchSettings settings;
    change(device, settings);
    return test::message_of([&] { bench_device(device, settings); });
  };
  EXPECT_THAT(message([](auto&, auto& s) { s.force_error = 0.0; }),
              HasSubstr("force error is 0; allowed are numbers above 0"));
  EXPECT_THAT(message([](auto&, auto& s) { s.pixel_error = NAN; }), HasSubstr("pixel error is nan"));
  EXPECT_THAT(message([](auto&, auto& s) { s.most_pixels = 10; }), HasSubstr("at least 1000"));
  EXPECT_THAT(message([](auto&, auto& s) { s.most_tetrahedra = 0; }), HasSubstr("at least 1"));
  EXPECT_THAT(message([](auto& d, auto&) { d.mesh.force_error = 0.01; }), HasSubstr("needs fine_mm"));
  EXPECT_THAT(message([](auto&, auto& s) { s.depth_mm = 5.0; }), HasSubstr("deep"));
}

}  // namespace
}  // namespace touchstone::lab
