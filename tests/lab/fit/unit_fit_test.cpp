#include "lab/fit/unit_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/whole_file.h"
#include "lab/fit/recorded_balls.h"
#include "lab/fit/unit_fit_experiment.h"
#include "sim/files/image_file.h"
#include "sim/scene/device_imager.h"
#include "sim/sensor/virtual_sensor.h"
#include "tests/support/message_of.h"
#include "tests/support/recordings.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

/// From above the pad to 1.1 mm.
sim::MotionSpec straight_down() {
  sim::MotionSpec press;
  press.start_mm = {0, 0, 1.6};
  sim::MotionKey down;
  down.z = sim::AxisKey{1.1, std::nullopt};
  press.keys = {down};
  return press;
}

/// A coated pad lit from three sides through its plate, red, green and blue; nothing is white.
constexpr const char* kDevice = R"(name: small-lit
gel: {size_x_mm: 8, size_y_mm: 8, thickness_mm: 3, youngs_modulus_MPa: 0.15, poisson_ratio: 0.49, refractive_index: 1.41}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [2.5, 2.5], fine_depth_mm: 1}
plate: {thickness_mm: 3, refractive_index: 1.49}
coating: {type: matt, albedo: 0.4}
lamps:
  - {type: led, position_mm: [-7, -5, -12], target_mm: [0, 0, 0], viewing_angle_deg: 60, power_W: [0.02, 0.001, 0.001]}
  - {type: led, position_mm: [7, -5, -12], target_mm: [0, 0, 0], viewing_angle_deg: 60, power_W: [0.001, 0.02, 0.001]}
  - {type: led, position_mm: [0, 8, -12], target_mm: [0, 0, 0], viewing_angle_deg: 60, power_W: [0.001, 0.001, 0.02]}
camera:
  type: lens
  width: 40
  height: 30
  pixel_pitch_um: 44
  focal_length_mm: 3
  f_number: 4
  focus_distance_mm: 17
  lens_position_mm: [0, 0, -19]
  look_at_mm: [0, 0, 0]
  exposure_us: 16
  full_well_e: 12000
  read_noise_e: 8
  bayer: binned
  white_balance: [1, 1, 1]
)";

/// A folder with a small coated device with a colour camera, a ball, and the cache of its gel: made once.
const test::TemporaryFolder& folder() {
  static const test::TemporaryFolder one;
  static const bool written = [] {
    one.write("device.yaml", kDevice);
    one.write("lit-room.yaml", std::string(kDevice) + "room_radiance: [6, 5, 5.5]\n");
    one.write("ball.yaml", "name: ball\nshape: {type: sphere, radius_mm: 1.5}\nalbedo: 0.5\nfriction: 0.5\n");
    return true;
  }();
  static_cast<void>(written);
  return one;
}

std::filesystem::path cache() {
  return folder().path() / "cache";
}

UnitFitSpec small_fit() {
  UnitFitSpec spec;
  spec.name = "small";
  spec.device = folder().path() / "device.yaml";
  spec.coarse_px = 1;
  spec.membrane_um = 120.0;
  spec.deepest_mm = 0.6;
  for (const Eigen::Vector2d& place : {Eigen::Vector2d(0, 0), Eigen::Vector2d(-1.0, 0.8), Eigen::Vector2d(1.0, -0.9)}) {
    RecordedPress press;
    press.object = folder().path() / "ball.yaml";
    press.place_mm = place;
    press.depth_mm = 0.4;
    press.force_N = 0.1;
    press.force_sd_N = 0.001;
    spec.presses.push_back(press);
  }
  return spec;
}

Eigen::VectorXd vector(std::initializer_list<double> values) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), out.begin());
  return out;
}

TEST(UnitSimulation, LampsOneByOneAddUpToAllOfThem) {
  UnitFitSpec spec = small_fit();
  add_unknown(spec, "lamps[*].power_W", UnknownHow::times, 0.5, 2.0);
  add_unknown(spec, "gel.youngs_modulus_MPa", UnknownHow::times, 0.5, 2.0);
  const PreparedFit fit = prepare_fit(spec);
  ASSERT_EQ(fit.unknowns.size(), 4U);
  EXPECT_EQ(fit.unknowns[1].name, "lamps[1].power_W");
  const Eigen::VectorXd x = vector({std::log(1.2), std::log(0.7), 0.0, std::log(1.3)});
  UnitSimulation simulation(fit, cache());
  const SimulatedUnit shown = simulation.show(x, {{{0, 0}, 0.4}, {{-1.0, 0.8}, 0.4}, {{1.0, -0.9}, 0.4}});
  // All at once, with paths of another seed.
  sim::VirtualSensorSettings settings;
  settings.seed = 77;
  settings.deepest_mm = 0.6;
  settings.membrane_um = 120.0;
  settings.always_friction = true;
  const sim::VirtualSensor sensor(with_block_camera(device_at(fit, x), spec.coarse_px), cache(), settings);
  const cv::Mat whole = mean_numbers(sensor.background_light(), simulation.imager(x));
  EXPECT_LT(cv::norm(shown.background, whole, cv::NORM_L2) / cv::norm(whole, cv::NORM_L2), 0.02);
  EXPECT_NEAR(cv::mean(shown.background)[1], cv::mean(whole)[1], 0.01 * cv::mean(whole)[1]);
  const sim::TouchObject ball = sensor.object(fit.objects[0]);
  EXPECT_NEAR(shown.force_N[0], sensor.play(ball, straight_down()).back().press.wrench[2], 1e-6 * shown.force_N[0]);
}

TEST(UnitSimulation, TheRoomsLightIsAddedToTheLamps) {
  UnitFitSpec spec = small_fit();
  spec.device = folder().path() / "lit-room.yaml";
  add_unknown(spec, "room_radiance", UnknownHow::times, 0.5, 2.0);
  const PreparedFit fit = prepare_fit(spec);
  const Eigen::VectorXd x = vector({std::log(1.5)});
  UnitSimulation simulation(fit, cache());
  const std::vector<PressPose> poses = {{{0, 0}, 0.4}, {{-1.0, 0.8}, 0.4}, {{1.0, -0.9}, 0.4}};
  const SimulatedUnit shown = simulation.show(x, poses);
  EXPECT_EQ(simulation.lamp_setups(), 4);
  sim::VirtualSensorSettings settings;
  settings.seed = 77;
  settings.deepest_mm = 0.6;
  settings.membrane_um = 120.0;
  settings.always_friction = true;
  const sim::VirtualSensor sensor(with_block_camera(device_at(fit, x), spec.coarse_px), cache(), settings);
  const cv::Mat whole = mean_numbers(sensor.background_light(), simulation.imager(x));
  EXPECT_LT(cv::norm(shown.background, whole, cv::NORM_L2) / cv::norm(whole, cv::NORM_L2), 0.02);
  UnitFitSpec dark_spec = small_fit();
  add_unknown(dark_spec, "lamps[*].power_W", UnknownHow::times, 0.5, 2.0, true);
  const PreparedFit dark_fit = prepare_fit(dark_spec);
  const cv::Mat dark = UnitSimulation(dark_fit, cache()).show(vector({0.0}), poses).background;
  EXPECT_GT(cv::mean(shown.background - dark)[2], 0.05 * cv::mean(dark)[2]) << "the room is seen";
}

TEST(UnitPictures, MeanAndNoiseOfExposuresAreAsTheImagerHasThem) {
  UnitFitSpec spec = small_fit();
  add_unknown(spec, "camera.exposure_us", UnknownHow::times, 0.5, 2.0);
  const PreparedFit fit = prepare_fit(spec);
  const render::Imager imager = UnitSimulation(fit, cache()).imager(vector({0.0}));
  cv::Mat light(60, 80, CV_32FC3);
  for (int v = 0; v < light.rows; ++v) {
    for (int u = 0; u < light.cols; ++u) {  // slopes, so that rounding behind the white balance averages out
      const float slope = 0.8F + 0.005F * static_cast<float>(u);
      light.at<cv::Vec3f>(v, u) = cv::Vec3f(0.9F, 0.7F, 0.6F) * slope;
    }
  }
  light *= 120.0 / cv::mean(mean_numbers(light, imager))[1];
  const cv::Mat numbers = mean_numbers(light, imager);
  sim::CameraSpec camera = *fit.device.camera;
  camera.width = 80;
  camera.height = 60;
  constexpr int kUnits = 12;
  double squares = 0.0, sum = 0.0;
  int count = 0;
  for (int unit = 0; unit < kUnits; ++unit) {
    const cv::Mat frame = render::develop(render::expose(light, imager, static_cast<std::uint64_t>(unit), 0), imager);
    const BlockPicture seen = block_picture(frame, "frame", camera, 4, {});
    cv::Mat wanted = cv::Mat::zeros(seen.mean.size(), CV_64FC3);
    for (int v = 0; v < 60; ++v) {
      for (int u = 0; u < 80; ++u) wanted.at<cv::Vec3d>(v / 4, u / 4) += numbers.at<cv::Vec3d>(v, u) / 16.0;
    }
    const cv::Mat noise = block_noise(wanted, imager, 4, 1);
    for (int i = 0; i < 3 * 15 * 20; ++i) {
      ASSERT_GT(wanted.ptr<double>()[i], 5.0);
      ASSERT_LT(wanted.ptr<double>()[i], 240.0);
      const double off = (seen.mean.ptr<double>()[i] - wanted.ptr<double>()[i]) / noise.ptr<double>()[i];
      squares += off * off;
      sum += off;
      ++count;
    }
  }
  EXPECT_NEAR(squares / count, 1.0, 0.08);
  EXPECT_NEAR(sum / count, 0.0, 0.05);
}

TEST(UnitFit, FindsHiddenNumbersWithinItsIntervals) {
  UnitFitSpec spec = small_fit();
  add_unknown(spec, "gel.youngs_modulus_MPa", UnknownHow::times, 0.4, 2.5);
  add_unknown(spec, "lamps[*].power_W", UnknownHow::times, 0.5, 2.0);
  int covered = 0, intervals = 0;
  constexpr int kUnits = 6;
  for (std::uint64_t seed = 1; seed <= kUnits; ++seed) {
    spec.seed = 10 * seed;  // light whose own noise is another each time
    const PreparedFit fit = prepare_fit(spec);
    const Eigen::VectorXd hidden = hidden_unknowns(fit, 0.5, seed);
    const RecordedUnit unit = record_unit(fit, hidden, 3, seed, cache());
    const UnitFit found = fit_unit(unit.fit, unit.recording, cache());
    EXPECT_TRUE(found.converged);
    EXPECT_TRUE(found.unidentified.empty());
    EXPECT_LT(found.misfit_after, found.misfit_before);
    for (std::size_t k = 0; k < found.unknowns.size(); ++k) {
      const FittedUnknown& one = found.unknowns[k];
      const double truth = hidden_value(fit, hidden, k);
      EXPECT_TRUE(one.identified);
      EXPECT_NEAR(one.value, truth, 0.08 * truth) << one.name;
      // Hidden units share the mesh, whose error is the larger part of a coarse gel's interval: it's left out here.
      const double deviation = std::hypot(std::max(one.by_noise, one.by_model), one.by_light);
      EXPECT_LT(deviation, 0.05) << one.name << ": an interval that says something";
      EXPECT_GE(one.deviation, deviation);
      EXPECT_TRUE(one.low95 < one.value && one.value < one.high95);
      ++intervals;
      if (std::abs(std::log(one.value / truth)) <= 1.96 * deviation) ++covered;
    }
  }
  EXPECT_EQ(intervals, 4 * kUnits);
  // Of 24 intervals of 95 % fewer than 20 hold their number by chance once in 400 times, were they independent.
  EXPECT_GE(covered, 20);
}

/// The small device with a tone curve and fixed gains.
std::filesystem::path toned_device() {
  std::string text = kDevice;
  const std::string gains = "  white_balance: [1, 1, 1]\n";
  text.replace(text.find(gains), gains.size(),
               "  bits: 12\n  white_balance: [1.1, 1, 0.9]\n  tone_curve: {type: gamma, gamma: 2}\n");
  return folder().write("toned.yaml", text);
}

// Numbers of 0 to 255 behind a gamma: its mean and noise are those of many exposures, also where the curve is steep.
TEST(UnitPictures, MeanAndNoiseBehindAToneCurveAreAsTheImagerHasThem) {
  sim::DeviceSpec device = sim::read_device(toned_device());
  sim::SceneBands bands;
  bands.centres_nm = Eigen::Array3d(610, 540, 455);
  render::Imager imager = sim::imager(device, bands, true);
  imager.prnu = 0.01;
  for (const float level : {0.02F, 0.2F, 0.6F}) {
    cv::Mat light(32, 32, CV_32FC3, cv::Scalar::all(0.01));
    const double full = 255.0 * render::linear_of(imager.tone_curve, cv::mean(mean_numbers(light, imager))[1] / 255.0);
    light *= level * 255.0 / full;
    const cv::Mat numbers = mean_numbers(light, imager);
    const cv::Mat noise = block_noise(numbers, imager, 1, 1);
    for (int c = 0; c < 3; ++c) {
      double sum = 0.0, squares = 0.0;
      int count = 0;
      for (std::uint64_t unit = 0; unit < 8; ++unit) {
        const cv::Mat frame = render::develop(render::expose(light, imager, unit, 0), imager);
        for (int v = 0; v < frame.rows; ++v) {
          for (int u = 0; u < frame.cols; ++u, ++count) {
            const double off = frame.at<cv::Vec3b>(v, u)[c] - numbers.at<cv::Vec3d>(v, u)[c];
            sum += off;
            squares += off * off;
          }
        }
      }
      const double wanted = noise.at<cv::Vec3d>(0, 0)[c];
      EXPECT_NEAR(sum / count, 0.0, 0.1 * wanted) << level;
      EXPECT_NEAR(std::sqrt(squares / count), wanted, 0.08 * wanted) << level;
    }
  }
}

// Gamma from the shape of the pictures' histogram, gains of red and blue from their colours: with lamps and exposure
// known all three are identified.
TEST(UnitFit, FindsGammaAndGainsAgain) {
  UnitFitSpec spec = small_fit();
  spec.device = toned_device();
  spec.presses.resize(2);
  add_unknown(spec, "camera.tone_curve.gamma", UnknownHow::times, 0.6, 1.6);
  add_unknown(spec, "camera.white_balance[0]", UnknownHow::times, 0.5, 2.0);
  add_unknown(spec, "camera.white_balance[2]", UnknownHow::times, 0.5, 2.0);
  const PreparedFit fit = prepare_fit(spec);
  ASSERT_EQ(fit.unknowns.size(), 3U);
  for (const FitUnknown& unknown : fit.unknowns) {
    EXPECT_EQ(unknown.numbers.front().acts, NumberActs::on_imager) << unknown.name << ": no light is made anew";
  }
  const Eigen::VectorXd hidden = vector({std::log(1.2), std::log(0.8), std::log(1.3)});  // gamma 2.4, gains 0.88, 1.17
  const RecordedUnit unit = record_unit(fit, hidden, 3, 8, cache());
  const UnitFit found = fit_unit(unit.fit, unit.recording, cache());
  EXPECT_TRUE(found.converged);
  EXPECT_TRUE(found.unidentified.empty());
  for (std::size_t k = 0; k < found.unknowns.size(); ++k) {
    const FittedUnknown& one = found.unknowns[k];
    const double truth = hidden_value(fit, hidden, k);
    EXPECT_TRUE(one.identified) << one.name;
    EXPECT_NEAR(one.value, truth, 0.02 * truth) << one.name;
    EXPECT_TRUE(one.low95 <= truth && truth <= one.high95)
        << one.name << ": " << truth << " isn't in " << one.low95 << " to " << one.high95;
  }
}

TEST(UnitFit, RefusesACameraThatSetsItself) {
  UnitFitSpec spec = small_fit();
  spec.device = folder().write("automatic.yaml",
                               std::string(kDevice) + "  auto_exposure: {time_constant_s: 1, mean_level: 0.2}\n");
  add_unknown(spec, "lamps[*].power_W", UnknownHow::times, 0.5, 2.0);
  EXPECT_THAT(message_of([&] { prepare_fit(spec); }), AllOf(HasSubstr("automatic.yaml"), HasSubstr("exposure")));
}

TEST(UnitFit, FindsLampsAndRoomByDifferencesToRest) {
  UnitFitSpec spec = small_fit();
  spec.device = folder().path() / "lit-room.yaml";
  spec.differences = true;
  add_unknown(spec, "lamps[*].power_W", UnknownHow::times, 0.5, 2.0);
  add_unknown(spec, "room_radiance", UnknownHow::times, 0.3, 3.0);
  const PreparedFit fit = prepare_fit(spec);
  const Eigen::VectorXd hidden = hidden_unknowns(fit, 0.5, 3);
  const RecordedUnit unit = record_unit(fit, hidden, 3, 3, cache());
  const UnitFit found = fit_unit(unit.fit, unit.recording, cache());
  EXPECT_TRUE(found.converged);
  for (std::size_t k = 0; k < found.unknowns.size(); ++k) {
    const double truth = hidden_value(fit, hidden, k);
    EXPECT_NEAR(found.unknowns[k].value, truth, 0.1 * truth) << found.unknowns[k].name;
  }
  // A background's shape isn't looked at: a shade over it and the presses alike changes next to nothing.
  RecordedUnit shaded = unit;
  const auto shade = [](cv::Mat& mean) {
    mean = mean.clone();
    for (int v = 0; v < mean.rows; ++v) {
      for (int u = 0; u < mean.cols; ++u) mean.at<cv::Vec3d>(v, u) += cv::Vec3d::all(u < mean.cols / 2 ? 8.0 : -8.0);
    }
  };
  shade(shaded.recording.background.mean);
  for (BlockPicture& press : shaded.recording.presses) shade(press.mean);
  const UnitFit again = fit_unit(shaded.fit, shaded.recording, cache());
  for (std::size_t k = 0; k < found.unknowns.size(); ++k) {
    EXPECT_NEAR(again.unknowns[k].value, found.unknowns[k].value, 0.02 * found.unknowns[k].value);
  }
}

TEST(UnitFit, SaysThatPowerAndExposureAreIdentifiedAsAProductOnly) {
  UnitFitSpec spec = small_fit();
  add_unknown(spec, "lamps[*].power_W", UnknownHow::times, 0.5, 2.0, true);
  add_unknown(spec, "camera.exposure_us", UnknownHow::times, 0.5, 2.0);
  const PreparedFit fit = prepare_fit(spec);
  const Eigen::VectorXd hidden = vector({std::log(1.2), std::log(0.9)});
  const RecordedUnit unit = record_unit(fit, hidden, 3, 5, cache());
  const UnitFit found = fit_unit(unit.fit, unit.recording, cache());
  ASSERT_EQ(found.unidentified.size(), 1U);
  EXPECT_THAT(found.unidentified[0].words,
              AllOf(HasSubstr("lamps[*].power_W"), HasSubstr("camera.exposure_us"), HasSubstr("product")));
  for (const FittedUnknown& one : found.unknowns) {
    EXPECT_FALSE(one.identified);
    EXPECT_TRUE(std::isinf(one.high95));
  }
  const double product = found.unknowns[0].value * found.unknowns[1].value;
  EXPECT_NEAR(product, hidden_value(fit, hidden, 0) * hidden_value(fit, hidden, 1), 0.02 * product);
}

TEST(UnitFit, AlbedoPowerAndExposureAllFreeAreReportedAsUnidentified) {
  UnitFitSpec spec = small_fit();
  spec.presses.resize(1);
  add_unknown(spec, "lamps[*].power_W", UnknownHow::times, 0.5, 2.0, true);
  add_unknown(spec, "camera.exposure_us", UnknownHow::times, 0.5, 2.0);
  add_unknown(spec, "coating.albedo", UnknownHow::times, 0.6, 1.6);
  const PreparedFit fit = prepare_fit(spec);
  const RecordedUnit unit = record_unit(fit, vector({0.1, -0.1, 0.1}), 3, 6, cache());
  const UnitFit found = fit_unit(unit.fit, unit.recording, cache());
  ASSERT_FALSE(found.unidentified.empty());
  EXPECT_FALSE(found.unknowns[0].identified);
  EXPECT_FALSE(found.unknowns[1].identified);
  const double truth = hidden_value(fit, vector({0.1, -0.1, 0.1}), 2);
  EXPECT_TRUE(found.unknowns[2].low95 <= truth && truth <= found.unknowns[2].high95);
}

TEST(UnitFit, DepthsThatWereNotReadAreFoundInThePictures) {
  UnitFitSpec spec = small_fit();
  // On a membrane of 120 um the pictures change in jumps with depth: depths came out 3 um too deep (2.9 to 3.2 of the
  // deviations that derivatives over 5 um gave), with 60 um 1 um off.
  spec.membrane_um = 60.0;
  add_unknown(spec, "gel.youngs_modulus_MPa", UnknownHow::times, 0.4, 2.5);
  const PreparedFit fit = prepare_fit(spec);
  const Eigen::VectorXd hidden = vector({std::log(1.4)});
  RecordedUnit unit = record_unit(fit, hidden, 3, 7, cache());
  for (RecordedPress& press : unit.fit.spec.presses) press.depth_mm.reset();
  const UnitFit found = fit_unit(unit.fit, unit.recording, cache());
  for (const FittedPress& press : found.presses) {
    EXPECT_GT(press.depth_deviation_mm, 0.0);
    EXPECT_NEAR(press.depth_mm, 0.4, 0.02);
    EXPECT_NEAR(press.depth_mm, 0.4, 3.0 * press.depth_deviation_mm);
  }
  const FittedUnknown& modulus = found.unknowns[0];
  EXPECT_TRUE(modulus.identified);
  const double truth = hidden_value(fit, hidden, 0);
  EXPECT_TRUE(modulus.low95 <= truth && truth <= modulus.high95)
      << truth << " isn't in " << modulus.low95 << " to " << modulus.high95;
}

/// Writes the fit's file and pictures of a unit. Returns the file.
std::filesystem::path written_fit(const test::TemporaryFolder& out, const std::string& unknowns,
                                  const std::string& more = "") {
  UnitFitSpec spec = small_fit();
  add_unknown(spec, "gel.youngs_modulus_MPa", UnknownHow::times, 0.4, 2.5);
  const PreparedFit fit = prepare_fit(spec);
  for (const char* name : {"device.yaml", "ball.yaml"}) out.write(name, read_whole_file(folder().path() / name));
  sim::VirtualSensorSettings settings;
  settings.seed = 9;
  settings.deepest_mm = 0.6;
  settings.membrane_um = 120.0;
  static const sim::VirtualSensor sensor(fit.device, cache(), settings);
  sim::write_png(out.path() / "rest.png", sensor.background(1));
  const sim::TouchObject ball = sensor.object(fit.objects[0]);
  sim::write_png(out.path() / "press.png",
                 sensor.capture(ball, sensor.play(ball, straight_down()).back().press, 1, 1, false).frame);
  return out.write("fit.yaml",
                   fmt::format("name: mine\ndevice: device.yaml\ncoarse_px: 2\nmembrane_um: 120\ndeepest_mm: 0.6\n"
                               "backgrounds: [rest.png]\nunknowns:\n{}\npresses:\n  - {{picture: press.png, "
                               "object: ball.yaml, place_mm: [0, 0], depth_mm: 0.4{}}}\n",
                               unknowns, more));
}

TEST(UnitFitFiles, AreTheSameBytesOnOneThreadAndOnMany) {
  const test::TemporaryFolder in, out;
  const auto file = written_fit(in,
                                "  - {path: 'lamps[*].power_W', times: [0.5, 2]}\n"
                                "  - {path: 'lamps[1].position_mm[2]', plus: [-0.4, 0.4]}");
  const UnitFit many = run_unit_fit(file, out.path() / "many", cache()).fit;
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    run_unit_fit(file, out.path() / "one", cache());
  }
  for (const char* name : {"mine.md", "mine.json", "mine.yaml", "mine.png"}) {
    EXPECT_EQ(read_whole_file(out.path() / "many" / name), read_whole_file(out.path() / "one" / name)) << name;
  }
  const sim::DeviceSpec fitted = sim::read_device(out.path() / "many" / "mine.yaml");
  EXPECT_NEAR(fitted.lamps[0].power_W.numbers[0], many.unknowns[0].value, 1e-12);
  EXPECT_NEAR(fitted.lamps[1].position_mm.z(), -12.0, 0.1) << "nothing was hidden";
}

TEST(UnitFitFiles, MistakesNameFileLineFieldAndWhatIsAllowed) {
  const test::TemporaryFolder in;
  const auto message = [&](const std::string& unknowns, const std::string& more = "") {
    const auto file = written_fit(in, unknowns, more);
    return message_of([&] { read_recording(prepare_fit(file)); });
  };
  const std::string power = "  - {path: 'lamps[*].power_W', times: [0.5, 2]}";
  EXPECT_EQ(message(power), "no error");
  EXPECT_THAT(message("  - {path: 'lamps[*].powr_W', times: [0.5, 2]}"),
              AllOf(HasSubstr("fit.yaml:8"), HasSubstr("power_W")));
  EXPECT_THAT(message("  - {path: coating.albedo, times: [0.5, 3]}"), AllOf(HasSubstr("albedo"), HasSubstr("1.2")));
  EXPECT_THAT(message("  - {path: coating.albedo, times: [1.5, 3]}"),
              AllOf(HasSubstr("fit.yaml:8"), HasSubstr("at most 1")));
  EXPECT_THAT(message("  - {path: gel.youngs_modulus_MPa, times: [0.5, 2]}"),
              AllOf(HasSubstr("fit.yaml:8"), HasSubstr("force_N")));
  EXPECT_EQ(message("  - {path: gel.youngs_modulus_MPa, times: [0.5, 2]}", ", force_N: 0.1, force_sd_N: 0.01"),
            "no error");
  EXPECT_THAT(message(power, ", force_N: 0.1"), AllOf(HasSubstr("fit.yaml:10"), HasSubstr("force_sd_N")));
  EXPECT_THAT(message(power + "\n" + power), HasSubstr("unknown already"));
  sim::write_png(in.path() / "small.png", cv::Mat(10, 20, CV_8UC3, cv::Scalar::all(90)));
  sim::write_png(in.path() / "white.png", cv::Mat(30, 40, CV_8UC3, cv::Scalar::all(254)));
  sim::write_png(in.path() / "grey.png", cv::Mat(30, 40, CV_8UC1, cv::Scalar::all(90)));
  const auto with_picture = [&](const std::string& name) {
    const std::string text = read_whole_file(written_fit(in, power));
    const std::size_t at = text.find("press.png");
    const auto file = in.write("other.yaml", std::string(text).replace(at, 9, name));
    return message_of([&] { read_recording(prepare_fit(file)); });
  };
  EXPECT_THAT(with_picture("small.png"), AllOf(HasSubstr("other.yaml:10"), HasSubstr("20 x 10"), HasSubstr("40 x 30")));
  EXPECT_THAT(with_picture("white.png"), AllOf(HasSubstr("white.png"), HasSubstr("expose less")));
  EXPECT_THAT(with_picture("grey.png"), AllOf(HasSubstr("grey.png"), HasSubstr("channels")));
  EXPECT_THAT(with_picture("none.png"), AllOf(HasSubstr("presses[0]: picture"), HasSubstr("there is no file")));
}

TEST(UnitFitFiles, SeveralPathsAreOneUnknown) {
  const test::TemporaryFolder in;
  const auto prepared = [&](const std::string& unknowns) { return prepare_fit(written_fit(in, unknowns)); };
  const PreparedFit fit =
      prepared("  - {paths: ['lamps[0].position_mm[2]', 'lamps[1].position_mm[2]'], plus: [-0.2, 0.2]}");
  ASSERT_EQ(fit.unknowns.size(), 1u);
  EXPECT_EQ(fit.unknowns[0].name, "lamps[0].position_mm[2], lamps[1].position_mm[2]");
  ASSERT_EQ(fit.unknowns[0].numbers.size(), 2u);
  const sim::DeviceSpec moved = device_at(fit, Eigen::VectorXd::Constant(1, 0.1));
  for (int lamp : {0, 1}) {
    EXPECT_NEAR(moved.lamps[lamp].position_mm.z() - fit.device.lamps[lamp].position_mm.z(), 0.1, 1e-9);
  }
  EXPECT_THAT(message_of([&] { prepared("  - {paths: ['lamps[0].power_W'], times: [0.5, 2]}"); }),
              AllOf(HasSubstr("fit.yaml:8"), HasSubstr("paths: has 1")));
  EXPECT_THAT(
      message_of([&] {
        prepared("  - {path: 'lamps[0].power_W', paths: ['lamps[0].power_W', 'lamps[1].power_W'], times: [0.5, 2]}");
      }),
      HasSubstr("paths"));
}

TEST(UnitFitFiles, SaysWhatStandsAtAnEnd) {
  UnitFitSpec spec = small_fit();
  add_unknown(spec, "lamps[*].power_W", UnknownHow::times, 0.99, 1.01);
  const PreparedFit fit = prepare_fit(spec);
  UnitFitSpec wide = small_fit();
  add_unknown(wide, "lamps[*].power_W", UnknownHow::times, 0.5, 2.0);
  const PreparedFit truth = prepare_fit(wide);
  Eigen::VectorXd hidden = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(truth.unknowns.size()), std::log(1.3));
  const RecordedUnit unit = record_unit(truth, hidden, 1, 3, cache());
  PreparedFit narrow = fit;
  narrow.spec.presses = unit.fit.spec.presses;
  const UnitFit found = fit_unit(narrow, unit.recording, cache());
  ASSERT_GE(found.doubts.size(), found.unknowns.size());
  EXPECT_THAT(found.doubts.front(), AllOf(HasSubstr("lamps[0].power_W"), HasSubstr("an end of its allowed range")));
}

TEST(UnitFitFiles, SaysWhereAPlaceOrADepthStandsAtAnEnd) {
  UnitFitSpec spec = small_fit();
  spec.presses.resize(2);
  add_unknown(spec, "lamps[*].power_W", UnknownHow::times, 0.5, 2.0, true);
  const RecordedUnit unit = record_unit(prepare_fit(spec), vector({0.0}), 1, 4, cache());
  PreparedFit wrong = unit.fit;  // of the recorded presses one is said to be shallower, the other to be elsewhere
  wrong.spec.presses[0].picture = "shallow.png";
  *wrong.spec.presses[0].depth_mm -= 0.05;
  wrong.spec.presses[0].depth_sd_mm = 0.005;
  wrong.spec.presses[1].picture = "beside.png";
  wrong.spec.presses[1].place_mm.x() += 0.3;
  wrong.spec.presses[1].place_sd_mm = 0.03;
  const UnitFit found = fit_unit(wrong, unit.recording, cache());
  EXPECT_TRUE(found.presses[0].depth_at_end);
  EXPECT_FALSE(found.presses[0].place_at_end);
  EXPECT_TRUE(found.presses[1].place_at_end);
  EXPECT_FALSE(found.presses[1].depth_at_end);
  EXPECT_THAT(found.doubts,
              Contains(AllOf(HasSubstr("shallow.png: its depth"), HasSubstr("an end of what its label"))));
  EXPECT_THAT(found.doubts, Contains(AllOf(HasSubstr("beside.png: its place"), HasSubstr("an end of what its label"))));
}

// Drawn light is rough within the errors of such an unknown, which once kept fits from ending where they had long
// arrived.
TEST(UnitFit, OneUnknownThatIsFoundHasConverged) {
  UnitFitSpec spec = small_fit();
  add_unknown(spec, "lamps[1].position_mm[2]", UnknownHow::plus, -1.0, 1.0);
  const PreparedFit fit = prepare_fit(spec);
  const Eigen::VectorXd hidden = vector({0.3});
  RecordedUnit unit = record_unit(fit, hidden, 3, 5, cache());
  UnitSimulation simulation(unit.fit, cache());
  const double truth = hidden_value(fit, hidden, 0);
  int told = 0;
  FitCourse course;
  course.on_step = [&](int step, double misfit, const std::string& text) {
    EXPECT_EQ(step, ++told);
    EXPECT_GT(misfit, 0.0);
    EXPECT_THAT(text, HasSubstr("position_mm"));
  };
  const UnitFit found = fit_unit(unit.fit, unit.recording, simulation, course);
  EXPECT_TRUE(found.converged);
  EXPECT_GT(found.steps, 0);
  EXPECT_EQ(found.steps, told);
  EXPECT_NEAR(found.unknowns[0].value, truth, 3.0 * found.unknowns[0].deviation);
  // Pictures without noise are met exactly: nothing is left to gain, however little the misfit is.
  std::vector<PressPose> poses;
  for (const RecordedPress& press : unit.fit.spec.presses) poses.push_back({press.place_mm, *press.depth_mm});
  const SimulatedUnit exact = simulation.show(hidden, poses);
  unit.recording.background.mean = exact.background;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    unit.recording.presses[i].mean = exact.presses[i];
    unit.fit.spec.presses[i].force_N = exact.force_N[static_cast<Eigen::Index>(i)];
  }
  const UnitFit again = fit_unit(unit.fit, unit.recording, simulation);
  EXPECT_TRUE(again.converged);
  EXPECT_NEAR(again.unknowns[0].value, truth, again.unknowns[0].deviation);
}

/// What a kill does, as far as one process can show it.
struct Killed {};

TEST(UnitFitFiles, AFitThatWasBrokenOffGoesOnToTheSameBytes) {
  const test::TemporaryFolder in, out;
  const auto file = written_fit(in,
                                "  - {path: 'lamps[*].power_W', times: [0.5, 2]}\n"
                                "  - {path: 'lamps[1].position_mm[2]', plus: [-0.4, 0.4]}\n"
                                "field_accuracy: [0.05, 0.0075]");
  const auto whole = out.path() / "whole", broken = out.path() / "broken";
  EXPECT_FALSE(run_unit_fit(file, whole, cache()).gone_on_from);
  const char* const names[] = {"mine.md", "mine.json", "mine.yaml", "mine.png"};
  // Run after run is broken off behind a few pictures more, until one ends by itself.
  int runs = 0, gone_on = 0;
  for (bool ended = false; !ended; ++runs) {
    ASSERT_LT(runs, 12);
    int left = 14 + 6 * runs;
    try {
      const UnitFitRun run =
          run_unit_fit(file, broken, cache(), [&](const std::string& stage, std::int64_t, std::int64_t) {
            if (stage.find("elasticity") == std::string::npos && --left == 0) throw Killed{};
          });
      ended = true;
      gone_on = run.gone_on_from.value_or(-1);
    } catch (const Killed&) {
    }
    if (runs == 2) {
      EXPECT_TRUE(std::filesystem::is_regular_file(broken / ".unfinished" / "mine.bin"));
      const std::string text = read_whole_file(file);
      in.write("fit.yaml", text + "seed: 7\n");
      EXPECT_THAT(message_of([&] { run_unit_fit(file, broken, cache()); }),
                  AllOf(HasSubstr("unfinished fit mine"), HasSubstr("the fit file has changed")));
      in.write("fit.yaml", text);
      const std::string ball = read_whole_file(in.path() / "ball.yaml");
      in.write("ball.yaml", ball + "# another\n");
      EXPECT_THAT(message_of([&] { run_unit_fit(file, broken, cache()); }),
                  HasSubstr("a file that the fit names has changed"));
      in.write("ball.yaml", ball);
      const auto kept = broken / ".unfinished" / "mine.bin";
      const std::string bytes = read_whole_file(kept);
      write_whole_file(kept, bytes.substr(0, bytes.size() / 2));
      EXPECT_THAT(message_of([&] { run_unit_fit(file, broken, cache()); }),
                  AllOf(HasSubstr("mine.bin"), HasSubstr("can't be gone on with")));
      write_whole_file(kept, bytes);
    }
  }
  EXPECT_GT(runs, 3);
  EXPECT_GE(gone_on, 1);
  for (const char* name : names) EXPECT_EQ(read_whole_file(whole / name), read_whole_file(broken / name)) << name;
  EXPECT_FALSE(std::filesystem::exists(broken / ".unfinished"));
  EXPECT_FALSE(std::filesystem::exists(broken / "mine.so-far.yaml"));
  EXPECT_TRUE(run_unit_fit(file, broken, cache()).was_finished);
  const std::string sound = read_whole_file(file);
  const auto faulty = written_fit(in, "  - {path: 'lamps[*].powr_W', times: [0.5, 2]}");
  EXPECT_THAT(message_of([&] { run_unit_fit(faulty, out.path() / "faulty", cache()); }), HasSubstr("powr_W"));
  EXPECT_FALSE(std::filesystem::exists(out.path() / "faulty")) << "nothing is worth keeping";
  in.write("fit.yaml", sound + "seed: 7\n");
  EXPECT_THAT(message_of([&] { run_unit_fit(file, broken, cache()); }),
              AllOf(HasSubstr("finished fit mine"), HasSubstr("the fit file has changed")));
}

TEST(UnitFitFiles, AccuraciesOfTheLightFieldFallFromOneToTheNext) {
  const test::TemporaryFolder in;
  const auto message = [&](const std::string& accuracies) {
    const auto file = written_fit(in, "  - {path: 'lamps[*].power_W', times: [0.5, 2]}\nfield_accuracy: " + accuracies);
    return message_of([&] { prepare_fit(file); });
  };
  EXPECT_EQ(message("[0.05, 0.01]"), "no error");
  EXPECT_THAT(message("[0.01, 0.05]"), AllOf(HasSubstr("fit.yaml:9"), HasSubstr("field_accuracy"), HasSubstr("less")));
  EXPECT_THAT(message("[]"), HasSubstr("field_accuracy"));
  EXPECT_THAT(message("[0.5]"), AllOf(HasSubstr("field_accuracy"), HasSubstr("0.2")));
}

/// A real recording: circles and frames that set their own white balance, in place of poses.
TEST(UnitFitFiles, ARecordingOfBallsGivesPlacesDepthsAndBalancedFrames) {
  const std::filesystem::path source = TOUCHSTONE_SOURCE_DIR;
  const std::filesystem::path recording = test::recordings_of("gelsight-mini");
  TS_NEEDS_RECORDINGS(recording);
  const test::TemporaryFolder in;
  const auto file =
      in.write("fit.yaml",
               fmt::format("name: mini\ndevice: {}/scenes/devices/gelsight-mini.yaml\nunknowns:\n"
                           "  - {{path: exposure, times: [0.5, 2]}}\nrecording:\n  folder: {}\n  mm_per_px: 0.05107\n"
                           "  presses: [press-02.png, press-09.png]\n  radius_sd_px: 1\n"
                           "differences: true\ndeepest_mm: 2.45\n",
                           source.string(), recording.string()));
  const std::filesystem::path gels = TOUCHSTONE_BINARY_DIR "/python/cache";  // the Mini's gel is there for other tests
  const UnitFitSpec spec = with_recording(read_yaml<UnitFitSpec>(file), gels);
  ASSERT_EQ(spec.presses.size(), 2u);
  ASSERT_EQ(spec.backgrounds.size(), 1u);
  const RecordedPress& press = spec.presses[0];
  EXPECT_EQ(press.picture, "press-02.png");
  EXPECT_EQ(press.frame.size(), cv::Size(240, 320));
  EXPECT_NEAR(*press.depth_mm, 2.0, 0.05);  // as `compare` has it
  EXPECT_GT(press.depth_sd_mm, 0.02);
  EXPECT_LT(press.depth_sd_mm, 0.15);
  EXPECT_EQ(*spec.presses[1].depth_mm, 2.45) << "wider than the deepest";
  EXPECT_EQ(spec.presses[1].depth_sd_mm, 0.0);
  const cv::Mat rest = sim::read_image(recording / "rest.png");
  // Far from the ball the frame is rest's, where as recorded it's some tens brighter or darker.
  const cv::Rect corner(0, 280, 240, 40);
  EXPECT_LT(cv::norm(cv::mean(press.frame(corner)) - cv::mean(rest(corner))), 4.0);
  EXPECT_THAT(message_of([&] {
                UnitFitSpec other = read_yaml<UnitFitSpec>(file);
                other.recording->presses = {"press-77.png"};
                with_recording(other, gels);
              }),
              AllOf(HasSubstr("fit.yaml:6"), HasSubstr("press-77.png")));
}

}  // namespace
}  // namespace touchstone::lab
