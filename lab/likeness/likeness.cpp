#include "lab/likeness/likeness.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/units.h"
#include "lab/gelsight/ball_press_table.h"
#include "lab/likeness/contact_depth.h"
#include "lab/likeness/slope_colours.h"
#include "sim/sensor/colour_numbers.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr double kDeepestOfGel = 0.6;     // of its thickness
constexpr double kScaleTolerance = 0.01;  // of mm/px
constexpr double kLeastAlike = 0.4;       // of a frame's pixels with its rest; frames of other sensors have 0.35
constexpr double kTurnedMargin = 0.2;     // of correlation
constexpr double kNearlyWhite = 249;

cv::Mat as_float(const cv::Mat& picture) {
  cv::Mat out;
  picture.convertTo(out, CV_32F);
  return out;
}

/// The device's frame as its camera gives it with a recorded frame's gain, which is then taken out of it as of that:
/// full scale is where the recorded one's is.
cv::Mat balanced_frame(const sim::VirtualSensor& sensor, const sim::TouchObject& ball, const sim::Touch& touch,
                       const cv::Vec3d& gain) {
  cv::Mat out = as_float(sensor.ideal(ball, touch, gain));
  cv::divide(out, cv::Scalar(gain[0], gain[1], gain[2]), out);
  return out;
}

/// The frame's gain and, where it isn't given, the circle. @throws Error if it isn't one ball's press on this sensor
sensors::FrameGain see(sensors::BallPress& press, const BallRecording& recording, sensors::GainFinder& finder) {
  const std::string fault = sensors::frame_fault(press.frame, recording.rest.mean.size());
  if (!fault.empty()) fail("{}: doesn't go with the rest frame: {}", press.name, fault);
  const sensors::FrameGain gain = finder.find(press.frame);
  if (gain.alike < kLeastAlike) {
    fail(
        "{}: isn't of the same sensor as the rest frame, or is turned: of its pixels {:.0f} % are like those of rest, "
        "{:.0f} % must be",
        press.name, 100 * gain.alike, 100 * kLeastAlike);
  }
  press.circle = sensors::see_press(press, recording.rest, gain.gain, {.mm_per_px = recording.mm_per_px}).circle;
  return gain;
}

PictureLikeness likeness_of(const cv::Mat& recorded, const cv::Mat& other, const sensors::ContactCircle& circle) {
  return {psnr(recorded, other), ssim(recorded, other), region_difference(recorded, other, circle)};
}

/// Sums for the correlation of recorded and simulated differences about the contact, with the recording as it is,
/// turned by 180 degrees, mirrored left to right, and top to bottom.
struct Orientation {
  static constexpr std::array<const char*, 4> kNames = {"as it is", "turned by 180 degrees", "mirrored left to right",
                                                        "mirrored top to bottom"};
  static constexpr std::array<int, 4> kFlips = {2, -1, 1, 0};  // cv::flip's codes; the first isn't one
  std::array<double, 4> together{}, recorded{}, simulated{};

  void add(const cv::Mat& of_recording, const cv::Mat& of_device, const sensors::ContactCircle& circle) {
    const int u = static_cast<int>(circle.centre.x()), v = static_cast<int>(circle.centre.y());
    const int half =
        std::min({static_cast<int>(2 * circle.radius), u, v, of_recording.cols - 1 - u, of_recording.rows - 1 - v});
    if (half < 1) return;
    const cv::Rect window(u - half, v - half, 2 * half + 1, 2 * half + 1);
    for (std::size_t k = 0; k < kFlips.size(); ++k) {
      cv::Mat turned = of_recording(window).clone();
      if (k > 0) cv::flip(turned, turned, kFlips[k]);
      together[k] += turned.dot(of_device(window));
      recorded[k] += turned.dot(turned);
      simulated[k] += of_device(window).dot(of_device(window));
    }
  }
  double correlation(std::size_t k) const {
    const double norm = std::sqrt(recorded[k] * simulated[k]);
    return norm > 0.0 ? together[k] / norm : 0.0;
  }
  void check(const std::string& device) const {
    for (std::size_t k = 1; k < kFlips.size(); ++k) {
      if (correlation(k) < correlation(0) + kTurnedMargin) continue;
      fail(
          "the recording looks {}: so its difference pictures correlate with those of {} by {:.2f}, as they are by "
          "{:.2f}; turn the recording, or see where the device's lamps stand",
          kNames[k], device, correlation(k), correlation(0));
    }
  }
};

/// The device's side of one press.
sim::Touch simulate(const sim::VirtualSensor& sensor, const RecordedBall& ball, const sensors::BallPress& press,
                    double deepest_mm, PressLikeness& row) {
  const std::optional<double> depth = ball.depths.depth_of(press.circle->radius);
  row.shallow = !depth.has_value();
  row.depth_mm = depth.value_or(deepest_mm);
  sim::PressSpec how;
  how.place_mm = row.place_mm = sensor.gel_from_pixel(press.circle->centre);
  how.depth_mm = row.depth_mm;
  sim::Touch touch = sensor.press(ball.object, how);
  row.simulated_radius_px = std::sqrt(cv::countNonZero(touch.contact) / kPi);
  return touch;
}

/// What a press tells a residual map.
ResidualSample residual_sample(const sim::VirtualSensor& sensor, const sim::Touch& touch,
                               const sensors::BallPress& press, const BallRecording& recording,
                               const cv::Mat& balanced) {
  const render::ToneCurve& curve = sensor.device().camera->tone_curve;
  ResidualSample sample;
  sample.name = press.name;
  sample.height = touch.height;
  sample.missing = sim::linear_of_delivered(balanced, curve) - sim::linear_of_delivered(recording.rest.mean, curve) -
                   (sensor.linear_numbers(touch.light) - sensor.linear_numbers(sensor.background_light()));
  cv::Mat colours;
  cv::cvtColor(press.frame, colours, cv::COLOR_BGR2RGB);
  cv::threshold(colours, sample.saturated, kNearlyWhite, 255, cv::THRESH_BINARY);
  return sample;
}

/// The device with a residual map: fills in `residual` and `corrected` of all rows. `rest`: the device's ideal one.
void compare_residual(const sim::VirtualSensor& sensor, const sim::ResidualMap& map, const BallRecording& recording,
                      const std::vector<sim::Touch>& touches, const std::map<double, RecordedBall>& balls,
                      const cv::Mat& rest, Likeness& likeness) {
  likeness.residual = sim::in_words(map);
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const sensors::BallPress& press = recording.presses[i];
    sim::Touch touch = touches[i];
    touch.light = sensor.with_residual(map, touch.light, touch.height);
    PressLikeness& row = likeness.presses[i];
    row.corrected = balanced_frame(sensor, balls.at(press.ball_radius_mm).object, touch, row.gain) - rest;
    row.residual = likeness_of(row.recorded, row.corrected, *press.circle);
  }
}

/// For ResidualMap::about.
std::string about_recording(const LikenessSpec& spec, const std::string& device) {
  const fs::path folder = fs::is_directory(spec.recording) ? spec.recording : spec.recording.parent_path();
  std::string names;
  for (const std::string& name : spec.learn) names += (names.empty() ? "" : ", ") + name;
  return fmt::format("presses {} of the recording {}, pressed into {}", names,
                     fs::weakly_canonical(folder).filename().string(), device);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// The baseline by examples: fills in `table` of all rows.
void compare_table(const BallRecording& recording, const std::vector<cv::Mat>& slopes, Likeness& likeness) {
  SlopeColours table;
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    if (recording.learned[i]) table.learn(slopes[i], likeness.presses[i].recorded);
  }
  table.finish();
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    PressLikeness& row = likeness.presses[i];
    row.table = likeness_of(row.recorded, table.colours(slopes[i]), recording.presses[i].circle.value());
  }
}

}  // namespace

void check_recorded_by(const sim::DeviceSpec& device, const BallRecording& recording) {
  if (!device.camera) fail("device {}: has no camera", device.name);
  if (!device.coating) fail("device {}: has no coating; likeness is compared of coated gels", device.name);
  const cv::Size size = recording.rest.mean.size();
  const sim::CameraSpec& camera = *device.camera;
  if (camera.width != size.width || camera.height != size.height) {
    fail("device {}: its camera has {} x {} pixels, the recording {} x {}; give the device the recording's picture",
         device.name, camera.width, camera.height, size.width, size.height);
  }
  if (camera.bayer == render::BayerPattern::none) {
    fail("device {}: its camera is grey, the recording has colours; camera.bayer must be set", device.name);
  }
}

void check_scale(const sim::VirtualSensor& sensor, const BallRecording& recording) {
  const double off = sensor.mm_per_px() / recording.mm_per_px - 1.0;
  if (std::abs(off) <= kScaleTolerance) return;
  fail("device {}: a pixel of its camera is {:.5f} mm on the gel, one of the recording {:.5f} mm; {:.0f} % are allowed",
       sensor.device().name, sensor.mm_per_px(), recording.mm_per_px, 100 * kScaleTolerance);
}

sim::VirtualSensorSettings settings_for_recordings(const sim::DeviceSpec& device, std::uint64_t seed,
                                                   std::optional<double> deepest_mm) {
  sim::VirtualSensorSettings settings;
  settings.seed = seed;
  settings.deepest_mm = deepest_mm.value_or(kDeepestOfGel * device.gel.thickness_mm);
  settings.always_friction = true;
  return settings;
}

cv::Mat frame_for_fit(const BallRecording& recording, std::size_t press) {
  const cv::Mat& recorded = recording.presses[press].frame;
  const cv::Mat balanced =
      sensors::difference_to(recording.rest, recorded, recording.gains[press].gain) + recording.rest.mean;
  cv::Mat frame, white;
  balanced.convertTo(frame, CV_8U);
  cv::threshold(recorded, white, kNearlyWhite, 255, cv::THRESH_BINARY);
  cv::max(frame, white, frame);
  return frame;
}

BallRecording read_ball_recording(const LikenessSpec& spec) {
  if (!(spec.mm_per_px > 0.0)) fail("mm/px: {} must be above 0", spec.mm_per_px);
  const bool is_folder = fs::is_directory(spec.recording);
  const fs::path csv = is_folder ? spec.recording / "presses.csv" : spec.recording;
  const fs::path folder = csv.has_parent_path() ? csv.parent_path() : ".";
  datasets::TableFrames frames(folder);
  const std::vector<AnnotatedPress> table = read_ball_press_table(frames, csv);
  BallRecording recording;
  recording.mm_per_px = spec.mm_per_px;
  recording.rest = read_background(frames, rest_files(frames, spec.rest));
  recording.presses = read_ball_presses(frames, table);
  sensors::GainFinder finder(recording.rest);
  for (std::size_t i = 0; i < recording.presses.size(); ++i) {
    try {
      recording.gains.push_back(see(recording.presses[i], recording, finder));
    } catch (const Error& error) {
      fail_at(table[i].where, "{}", error.what());
    }
    const std::string& name = recording.presses[i].name;
    recording.learned.push_back(std::find(spec.learn.begin(), spec.learn.end(), name) != spec.learn.end());
  }
  for (const std::string& name : spec.learn) {
    const auto has_name = [&](const sensors::BallPress& press) { return press.name == name; };
    if (std::none_of(recording.presses.begin(), recording.presses.end(), has_name)) {
      fail("--learn: {} isn't a file of {}", name, csv.string());
    }
  }
  return recording;
}

Likeness compare_likeness(const sim::DeviceSpec& given, const BallRecording& recording, const LikenessSpec& spec,
                          const fs::path& cache_folder, const Progress& progress) {
  check_recorded_by(given, recording);
  if (spec.residual && static_cast<int>(spec.learn.size()) < kFewestResidualPresses) {
    fail("--residual: {} presses by --learn; a residual map takes at least {}", spec.learn.size(),
         kFewestResidualPresses);
  }
  sim::DeviceSpec device = given;
  device.residual = nullptr;  // its light is added afterwards, so that both can be compared
  const sim::VirtualSensorSettings settings = settings_for_recordings(device, spec.seed, spec.deepest_mm);
  const sim::VirtualSensor sensor(device, cache_folder, settings, progress);
  check_scale(sensor, recording);

  std::map<double, RecordedBall> balls;
  Likeness likeness;
  likeness.device = device.name;
  likeness.light = sensor.light().reason;
  std::vector<double> seconds;
  std::vector<cv::Mat> slopes;
  std::vector<sim::Touch> touches;
  std::vector<ResidualSample> samples;
  const bool corrects = spec.residual || given.residual;
  Orientation orientation;
  cv::Mat rest;
  for (std::size_t i = 0; i < recording.presses.size(); ++i) {
    const sensors::BallPress& press = recording.presses[i];
    const RecordedBall& known = recorded_ball(balls, sensor, press.ball_radius_mm, settings.deepest_mm, progress);
    if (rest.empty()) {
      sim::Touch untouched;
      untouched.light = sensor.background_light();
      rest = as_float(sensor.ideal(known.object, untouched));
    }
    PressLikeness row;
    row.name = press.name;
    row.learned = recording.learned[i];
    row.radius_px = press.circle->radius;
    row.gain = recording.gains[i].gain;
    const auto start = std::chrono::steady_clock::now();
    const sim::Touch touch = simulate(sensor, known, press, settings.deepest_mm, row);
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    row.recorded = sensors::difference_to(recording.rest, press.frame, row.gain);
    const cv::Mat frame = row.recorded + recording.rest.mean;
    frame.convertTo(row.frame, CV_8U);
    row.fit_frame = frame_for_fit(recording, i);
    const cv::Mat seen = balanced_frame(sensor, known.object, touch, row.gain);
    seen.convertTo(row.simulated_frame, CV_8U);
    row.simulated = seen - rest;
    row.device = likeness_of(row.recorded, row.simulated, *press.circle);
    row.raw = likeness_of(as_float(press.frame) - recording.rest.mean,
                          as_float(sensor.ideal(known.object, touch)) - rest, *press.circle);
    row.rest = likeness_of(row.recorded, cv::Mat::zeros(row.recorded.size(), CV_32FC3), *press.circle);
    orientation.add(row.recorded, row.simulated, *press.circle);
    slopes.push_back(slopes_of(touch.height, recording.mm_per_px));
    if (spec.residual && row.learned) {
      samples.push_back(residual_sample(sensor, touch, press, recording, row.recorded + recording.rest.mean));
    }
    if (corrects) touches.push_back(touch);
    likeness.presses.push_back(std::move(row));
    if (progress)
      progress("presses", static_cast<std::int64_t>(i + 1), static_cast<std::int64_t>(recording.presses.size()));
  }
  orientation.check(device.name);
  if (!spec.learn.empty()) compare_table(recording, slopes, likeness);
  if (spec.residual) {
    likeness.made_residual = fit_residual(samples, recording.mm_per_px, about_recording(spec, device.name));
  }
  if (corrects) {
    const sim::ResidualMap& map = spec.residual ? likeness.made_residual->map : *given.residual;
    compare_residual(sensor, map, recording, touches, balls, rest, likeness);
  }
  likeness.seconds_a_press = median(seconds);
  return likeness;
}

}  // namespace touchstone::lab
