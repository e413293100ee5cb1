#include "lab/likeness/likeness.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/units.h"
#include "core/whole_file.h"
#include "lab/likeness/contact_depth.h"
#include "lab/likeness/slope_colours.h"
#include "sim/files/image_file.h"
#include "sim/sensor/virtual_sensor.h"
#include "tests/support/message_of.h"
#include "tests/support/recordings.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;
using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kDeepest_mm = 0.9;
constexpr double kBallRadius_mm = 2.0;

/// A coated pad lit from three sides.
constexpr const char* kDevice = R"(name: small-lit
gel: {size_x_mm: 12, size_y_mm: 12, thickness_mm: 3, youngs_modulus_MPa: 0.5, poisson_ratio: 0.49, refractive_index: 1.41}
mesh: {fine_mm: 0.5, coarse_mm: 2, fine_half_extent_mm: [3, 2.5], fine_depth_mm: 1}
plate: {thickness_mm: 3, refractive_index: 1.49}
coating: {type: matt, albedo: 0.4}
lamps:
  - {type: led, position_mm: [-8, -7, -5.8], target_mm: [0, 0, 0], viewing_angle_deg: 120, power_W: [0.02, 0, 0]}
  - {type: led, position_mm: [8, -7, -5.8], target_mm: [0, 0, 0], viewing_angle_deg: 120, power_W: [0, 0.02, 0]}
  - {type: led, position_mm: [0, 9, -5.8], target_mm: [0, 0, 0], viewing_angle_deg: 120, power_W: [0, 0, 0.02]}
camera:
  type: lens
  width: 80
  height: 60
  pixel_pitch_um: 22
  focal_length_mm: 3
  f_number: 4
  focus_distance_mm: 17
  lens_position_mm: [0, 0, -19]
  look_at_mm: [0, 0, 0]
  exposure_us: 83
  full_well_e: 20000
  read_noise_e: 8
  bayer: binned
  white_balance: [1, 1, 1]
)";

cv::Mat as_float(const cv::Mat& picture) {
  cv::Mat out;
  picture.convertTo(out, CV_32F);
  return out;
}

/// A recording of the device above by itself, with the noise of its imager, made once.
struct OwnRecording {
  OwnRecording() {
    folder.write("device.yaml", kDevice);
    device = sim::read_device(folder.path() / "device.yaml");
    sim::VirtualSensorSettings settings;
    settings.deepest_mm = kDeepest_mm;
    settings.always_friction = true;
    const sim::VirtualSensor sensor(device, folder.path() / "cache", settings);
    mm_per_px = sensor.mm_per_px();
    sim::ObjectSpec spec;
    spec.name = "ball";
    spec.shape.radius_mm = kBallRadius_mm;
    spec.friction = 0.5;
    const sim::TouchObject ball = sensor.object(spec);
    rest = sensor.background(1000);
    sim::write_png(folder.path() / "rest.png", rest);
    sim::Touch untouched;
    untouched.light = sensor.background_light();
    const cv::Mat ideal_rest = as_float(sensor.ideal(ball, untouched));
    std::string table = kHeader;
    int number = 0;
    for (const Eigen::Vector2d& place :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(-0.9, 0.6), Eigen::Vector2d(0.8, -0.5)}) {
      sim::PressSpec press;
      press.place_mm = place;
      press.depth_mm = 0.5 + 0.1 * number;
      sim::TouchOptions options;
      options.noise_seed = 50 + static_cast<std::uint64_t>(number);
      const sim::Touch touch = sensor.press(ball, press, options);
      const std::string name = "press-" + std::to_string(number) + ".png";
      sim::write_png(folder.path() / name, touch.frame);
      frames.push_back(touch.frame);
      circles.push_back({sensor.pixel_from_gel(place), std::sqrt(cv::countNonZero(touch.contact) / kPi)});
      depths_mm.push_back(*press.depth_mm);
      limits_dB.push_back(
          psnr(as_float(touch.frame) - as_float(rest), as_float(sensor.ideal(ball, touch)) - ideal_rest));
      table += row(name, circles.back());
      ++number;
    }
    folder.write("presses.csv", table);
  }

  static std::string row(const std::string& name, const sensors::ContactCircle& circle) {
    return fmt::format("{},{},{},{},{}\n", name, circle.centre.x(), circle.centre.y(), circle.radius,
                       2 * kBallRadius_mm);
  }
  LikenessSpec spec(const std::string& table = "presses.csv") const {
    LikenessSpec out;
    out.recording = folder.path() / table;
    out.rest = {"rest.png"};
    out.mm_per_px = mm_per_px;
    out.deepest_mm = kDeepest_mm;
    return out;
  }
  /// A table of one press, which it writes.
  LikenessSpec spec_of(const std::string& name, const cv::Mat& frame, const sensors::ContactCircle& circle) const {
    sim::write_png(folder.path() / (name + ".png"), frame);
    folder.write(name + ".csv", kHeader + row(name + ".png", circle));
    return spec(name + ".csv");
  }
  Likeness compare(const LikenessSpec& how) const {
    return compare_likeness(device, read_ball_recording(how), how, folder.path() / "cache");
  }

  static constexpr const char* kHeader = "file,u_px,v_px,radius_px,ball_diameter_mm\n";
  test::TemporaryFolder folder;
  sim::DeviceSpec device;
  double mm_per_px = 0.0;
  cv::Mat rest;
  std::vector<cv::Mat> frames;
  std::vector<sensors::ContactCircle> circles;
  std::vector<double> depths_mm, limits_dB;
};

const OwnRecording& own() {
  static const OwnRecording one;
  return one;
}

TEST(Likeness, ADeviceIsAsLikeItsOwnRecordingAsNoiseLets) {
  LikenessSpec spec = own().spec();
  spec.learn = {"press-1.png"};
  const Likeness likeness = own().compare(spec);
  ASSERT_EQ(likeness.presses.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const PressLikeness& press = likeness.presses[i];
    EXPECT_NEAR(press.depth_mm, own().depths_mm[i], 0.03) << press.name;
    EXPECT_NEAR(press.device.psnr, own().limits_dB[i], 0.7) << press.name;
    EXPECT_GT(press.device.psnr, press.rest.psnr + 10) << press.name;
    EXPECT_GT(press.device.ssim, press.rest.ssim) << press.name;
    EXPECT_LT(press.device.off.inside, 0.2 * press.rest.off.inside) << press.name;
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(press.gain[c], 1.0, 0.01) << press.name;
    ASSERT_TRUE(press.table) << press.name;
    EXPECT_GT(press.table->psnr, press.rest.psnr) << press.name;
    EXPECT_EQ(press.learned, i == 1);
  }
  EXPECT_EQ(summary_of(likeness).presses, 2);
  write_likeness(likeness, own().folder.path());
  EXPECT_THAT(read_whole_file(own().folder.path() / "likeness.csv"),
              AllOf(HasSubstr("press-1.png,yes,\"device\""), HasSubstr("mean of 2,no,\"rest alone\"")));
  EXPECT_EQ(sim::read_image(own().folder.path() / "press-0-balanced.png").size(), own().rest.size());
}

TEST(Likeness, AResidualMapIsComparedBesideTheDeviceAndLeavesItAlone) {
  LikenessSpec spec = own().spec();
  const Likeness plain = own().compare(spec);
  spec.learn = {"press-0.png", "press-1.png", "press-2.png"};
  spec.residual = true;
  const Likeness made = own().compare(spec);
  ASSERT_TRUE(made.made_residual);
  ASSERT_EQ(made.made_residual->left_out.size(), 3U);
  EXPECT_THAT(made.residual, HasSubstr("press-0.png, press-1.png, press-2.png"));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(made.presses[i].device.psnr, plain.presses[i].device.psnr);
    EXPECT_FALSE(plain.presses[i].residual);
    // Its own recording is missing nothing but noise.
    ASSERT_TRUE(made.presses[i].residual);
    EXPECT_GT(made.presses[i].residual->psnr, made.presses[i].device.psnr - 0.3);
  }
  // A device that has the map already: the same figures.
  sim::DeviceSpec device = own().device;
  sim::set_residual(device, std::make_shared<const sim::ResidualMap>(made.made_residual->map));
  spec.residual = false;
  const Likeness given = compare_likeness(device, read_ball_recording(spec), spec, own().folder.path() / "cache");
  EXPECT_FALSE(given.made_residual);
  EXPECT_EQ(given.presses[1].device.psnr, made.presses[1].device.psnr);
  EXPECT_EQ(given.presses[1].residual->psnr, made.presses[1].residual->psnr);
  write_likeness(given, own().folder.path());
  EXPECT_THAT(read_whole_file(own().folder.path() / "likeness.csv"), HasSubstr("\"device with residual\""));
  spec.learn = {"press-0.png"};
  spec.residual = true;
  EXPECT_THAT(message_of([&] { own().compare(spec); }), HasSubstr("--residual: 1 presses by --learn"));
}

TEST(Likeness, AnotherExposureAndWhiteBalanceAreTakenOut) {
  cv::Mat frame;
  cv::multiply(own().frames[0], cv::Scalar(0.8, 0.9, 0.95), frame);
  const LikenessSpec spec = own().spec_of("dimmed", frame, own().circles[0]);
  const PressLikeness press = own().compare(spec).presses.front();
  EXPECT_NEAR(press.gain[0], 0.8, 0.01);
  EXPECT_NEAR(press.gain[2], 0.95, 0.01);
  EXPECT_GT(press.device.psnr, press.raw.psnr + 3);
  EXPECT_NEAR(press.device.psnr, own().limits_dB[0], 1.5);
}

TEST(Likeness, ARecordingThatIsNoneIsNamed) {
  const auto refused = [](const LikenessSpec& spec) { return message_of([&] { read_ball_recording(spec); }); };
  const sensors::ContactCircle& circle = own().circles[0];
  EXPECT_THAT(refused(own().spec_of("untouched", own().rest, circle)),
              AllOf(HasSubstr("untouched.csv:2: "), HasSubstr("nothing is pressed at")));
  EXPECT_THAT(refused(own().spec_of("small", own().frames[0](cv::Rect(0, 0, 70, 60)), circle)),
              AllOf(HasSubstr("small.png"), HasSubstr("rest frame")));
  cv::Mat turned;
  cv::rotate(own().frames[0], turned, cv::ROTATE_180);
  EXPECT_THAT(refused(own().spec_of("turned", turned, circle)),
              AllOf(HasSubstr("turned.png"), HasSubstr("isn't of the same sensor as the rest frame, or is turned")));
  EXPECT_THAT(refused(own().spec_of("beside", own().frames[0], {{-3, 20}, 10})),
              HasSubstr("reaches over the edge of the picture"));
  LikenessSpec unknown = own().spec();
  unknown.learn = {"press-9.png"};
  EXPECT_THAT(refused(unknown), HasSubstr("--learn: press-9.png isn't a file of"));
  EXPECT_THAT(refused(own().spec("none.csv")), HasSubstr("none.csv"));
}

TEST(Likeness, ADeviceWithAnotherPictureIsNamed) {
  LikenessSpec spec = own().spec();
  spec.mm_per_px *= 1.05;
  EXPECT_THAT(message_of([&] { own().compare(spec); }), HasSubstr("mm on the gel, one of the recording"));
  sim::DeviceSpec wide = own().device;
  wide.camera->width = 90;
  EXPECT_THAT(message_of([&] {
                compare_likeness(wide, read_ball_recording(own().spec()), own().spec(), own().folder.path() / "cache");
              }),
              HasSubstr("90 x 60 pixels, the recording 80 x 60"));
}

TEST(Likeness, ARecordingUpsideDownIsNamed) {
  cv::Mat rest, frame;
  cv::rotate(own().rest, rest, cv::ROTATE_180);
  cv::rotate(own().frames[1], frame, cv::ROTATE_180);
  sensors::ContactCircle circle = own().circles[1];
  circle.centre = Eigen::Vector2d(rest.cols, rest.rows) - circle.centre;
  LikenessSpec spec = own().spec_of("upside-down", frame, circle);
  sim::write_png(own().folder.path() / "turned-rest.png", rest);
  spec.rest = {"turned-rest.png"};
  EXPECT_THAT(message_of([&] { own().compare(spec); }), HasSubstr("looks turned by 180 degrees"));
}

TEST(PictureMeasures, HaveTheirClosedForms) {
  const cv::Mat zero(20, 30, CV_32FC3, cv::Scalar::all(0));
  const cv::Mat three(20, 30, CV_32FC3, cv::Scalar::all(3));
  EXPECT_NEAR(psnr(zero, three), 20 * std::log10(255.0 / 3.0), 1e-4);
  EXPECT_EQ(psnr(three, three), std::numeric_limits<double>::infinity());
  // Flat pictures differ by their means alone.
  const double c1 = 2.55 * 2.55;
  EXPECT_NEAR(ssim(zero, three), (2 * 128.0 * 131 + c1) / (128.0 * 128 + 131.0 * 131 + c1), 1e-9);
  EXPECT_NEAR(ssim(three, three), 1.0, 1e-12);
  const sensors::ContactCircle circle{{15, 10}, 4};
  cv::Mat inside = zero.clone();
  for (int v = 0; v < 20; ++v) {
    for (int u = 0; u < 30; ++u) {
      if ((Eigen::Vector2d(u + 0.5, v + 0.5) - circle.centre).norm() <= 4) inside.at<cv::Vec3f>(v, u) = {1, 2, 6};
    }
  }
  EXPECT_NEAR(region_difference(inside, zero, circle).inside, 3.0, 1e-6);
  EXPECT_EQ(region_difference(inside, zero, circle).ring, 0.0);
}

TEST(SlopeColours, LearnAColourThatGoesWithTheSlope) {
  cv::Mat height(60, 60, CV_32F);
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 60; ++u) height.at<float>(v, u) = 0.01f * static_cast<float>((u - 30) * (u - 30) - v * u);
  }
  const cv::Mat slopes = slopes_of(height, 0.5);
  EXPECT_NEAR(slopes.at<cv::Vec2f>(20, 40)[0], 0.01 * (2 * 10 - 20) / 0.5, 1e-5);
  EXPECT_NEAR(slopes.at<cv::Vec2f>(20, 40)[1], 0.01 * -40 / 0.5, 1e-5);
  cv::Mat colours(60, 60, CV_32FC3);
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 60; ++u) {
      const cv::Vec2f slope = slopes.at<cv::Vec2f>(v, u);
      colours.at<cv::Vec3f>(v, u) = {20 * slope[0], -10 * slope[1], 5};
    }
  }
  SlopeColours table;
  table.learn(slopes, colours);
  table.finish();
  EXPECT_LT(cv::norm(table.colours(slopes), colours, cv::NORM_L1) / (3.0 * 60 * 60), 0.5);
}

TEST(DepthTable, IsLinearBetweenRowsAndEnds) {
  const DepthTable table{{0, 0.1, 0.5}, {0, 10, 20}};
  EXPECT_NEAR(*table.depth_of(5), 0.05, 1e-12);
  EXPECT_NEAR(*table.depth_of(15), 0.3, 1e-12);
  EXPECT_NEAR(*table.depth_of(20), 0.5, 1e-12);
  EXPECT_FALSE(table.depth_of(20.1));
}

/// The real sensor: twenty presses of a ball, six of which its device was fitted to.
TEST(Likeness, GelsightMiniIsLikeItsRecording) {
  const fs::path source = TOUCHSTONE_SOURCE_DIR;
  const std::filesystem::path recording = test::recordings_of("gelsight-mini");
  TS_NEEDS_RECORDINGS(recording);
  LikenessSpec spec;
  spec.recording = recording;
  spec.rest = {"rest.png"};
  spec.mm_per_px = 0.05107;
  spec.learn = {"press-01.png", "press-03.png", "press-06.png", "press-09.png", "press-12.png", "press-20.png"};
  spec.residual = true;
  const sim::DeviceSpec device = sim::read_device(source / "scenes/devices/gelsight-mini.yaml");
  const LikenessSummary summary =
      summary_of(compare_likeness(device, read_ball_recording(spec), spec, own().folder.path() / "cache"));
  ASSERT_EQ(summary.presses, 14);
  EXPECT_GT(summary.rows[0].psnr.mean, 32.0);
  EXPECT_GT(summary.rows[0].ssim.mean, 0.943);
  EXPECT_GT(summary.rows[1].psnr.mean, summary.rows[0].psnr.mean + 2.0);  // with the residual map
  EXPECT_GT(summary.rows[1].psnr.mean, summary.rows[4].psnr.mean);
  EXPECT_GT(summary.rows[1].ssim.mean, summary.rows[0].ssim.mean);
  EXPECT_NEAR(summary.rows[3].psnr.mean, 23.8, 0.1);  // rest alone
  EXPECT_GT(summary.rows[4].psnr.mean, 32.5);         // the table
}

}  // namespace
}  // namespace touchstone::lab
