// Grasps as the event camera tells of them, on a membrane of a coarser mesh.

#include "lab/dvs/dvs_recordings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/units.h"
#include "core/whole_file.h"
#include "lab/dvs/dvs_light.h"
#include "lab/dvs/event_clip.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

using sensors::EventCounts;
using ::testing::HasSubstr;

const std::filesystem::path kScenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
constexpr int kSteel = 3;

/// The device with edges twice as long, and its pieces.
const DvsGraspSetup& setup() {
  static const test::TemporaryFolder folder;
  static const DvsGraspSetup made = [] {
    std::filesystem::copy(kScenes, folder.path() / "scenes", std::filesystem::copy_options::recursive);
    std::string device = read_whole_file(kScenes / "devices/dvs-grasp.yaml");
    for (const auto& [from, to] : {std::pair("fine_mm: 0.5", "fine_mm: 0.8"), {"coarse_mm: 1.5", "coarse_mm: 4"}}) {
      const std::size_t at = device.find(from);
      EXPECT_NE(at, std::string::npos);
      device.replace(at, std::string(from).size(), to);
    }
    folder.write("scenes/devices/dvs-grasp.yaml", device);
    for (const char* soft : {"foam", "rubber", "silicone"}) {
      const std::string file = std::string("objects/hexagon-") + soft + ".yaml";
      std::string piece = read_whole_file(kScenes / file);
      const std::string from = "mesh_mm: 1.2";
      const std::size_t at = piece.find(from);
      EXPECT_NE(at, std::string::npos) << file;
      piece.replace(at, from.size(), "mesh_mm: 2.4");
      folder.write("scenes/" + file, piece);
    }
    return DvsGraspSetup(folder.path() / "scenes", folder.path());
  }();
  return made;
}

const sim::MembraneCamera& camera() {
  static const sim::MembraneCamera made(setup().device(), {.cell_mm = 0.5, .walks = 1 << 16});
  return made;
}

/// A short grasp: some 0.4 s.
DvsGraspParameters short_grasp(int material) {
  DvsGraspParameters p = draw_dvs_grasp(material, setup().piece(material), 5, 0);
  p.motion.target_force_N = 2.0;
  p.motion.clearance_mm = 1.0;
  p.motion.hold_s = 0.15;
  p.motion.apart_s = 0.1;
  return p;
}

render::EventPixelSettings without_noise() {
  render::EventPixelSettings pixels = setup().device().camera->events->pixels;
  pixels.threshold_spread = pixels.leak_rate_hz = pixels.shot_rate_hz = pixels.bandwidth_hz = 0.0;
  pixels.refractory_us = 0;
  return pixels;
}

EventCounts sum(const std::vector<EventCounts>& counts, double from_s = 0.0, double to_s = 1e9) {
  EventCounts all;
  for (std::size_t ms = 0; ms < counts.size(); ++ms) {
    const double begin = 1e-3 * static_cast<double>(ms);
    if (begin < from_s || begin + 1e-3 > to_s) continue;
    all.on += counts[ms].on;
    all.off += counts[ms].off;
  }
  return all;
}

TEST(DvsRecordings, AreTheSameForAnyNumberOfThreads) {
  const std::vector<DvsGraspParameters> grasps = {short_grasp(kSteel), short_grasp(0)};
  const DvsRecordSettings settings = own_pixels(setup().device());
  std::vector<DvsRecording> one, four;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = record_dvs_grasps(setup(), camera(), grasps, settings);
  }
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 4);
    four = record_dvs_grasps(setup(), camera(), grasps, settings);
  }
  ASSERT_EQ(one.size(), 2u);
  ASSERT_EQ(four.size(), 2u);
  for (std::size_t k = 0; k < one.size(); ++k) {
    EXPECT_EQ(one[k].parameters.material, grasps[k].material);
    EXPECT_EQ(one[k].by_pixels[0].counts, four[k].by_pixels[0].counts);
    EXPECT_EQ(one[k].pictures, four[k].pictures);
    EXPECT_EQ(one[k].steps, four[k].steps);
    EXPECT_GT(one[k].by_pixels[0].events, 1000);
  }
  EXPECT_NE(one[0].by_pixels[0].counts, one[1].by_pixels[0].counts);
}

// With the noise off: nothing before anything moves, OFF events as the piece comes, no change of note while it is held,
// ON events as it leaves; then nothing.
TEST(DvsRecordings, TellOfTheTouchAndTheRelease) {
  DvsGraspParameters p = short_grasp(kSteel);
  p.motion.hold_s = 0.4;
  p.motion.apart_s = 0.3;
  p.finger.damping = 0.15;
  p.finger.ring_Hz = 32.0;
  DvsRecordSettings settings;
  settings.pixels = {without_noise(), without_noise()};
  settings.pixels[1].on_threshold *= 0.2;
  settings.pixels[1].off_threshold *= 0.2;
  const DvsRecording r = record_dvs_grasp(setup(), camera(), p, settings);
  const std::vector<EventCounts>& counts = r.by_pixels[0].counts;
  EXPECT_EQ(sum(counts, 0.0, p.motion.rest_s), EventCounts());
  const EventCounts held = sum(counts, r.release_s - 0.1, r.release_s);
  EXPECT_LE(held.on + held.off, 10) << "a pixel that waits just at its threshold sees the ring's last micrometre";
  EXPECT_EQ(sum(counts, r.apart_s + 0.2), EventCounts());
  const EventCounts closing = sum(counts, 0.0, r.release_s);
  const EventCounts opening = sum(counts, r.release_s);
  EXPECT_GT(closing.off, 1000);
  // What gets darker gets bright again, so OFF and ON events say as much of the light, each times its threshold; but
  // for less than a threshold up and one down of each pixel, of some fifteen.
  const EventCounts fine = sum(r.by_pixels[1].counts, 0.0);
  const double down = settings.pixels[1].off_threshold * static_cast<double>(fine.off);
  const double up = settings.pixels[1].on_threshold * static_cast<double>(fine.on);
  EXPECT_NEAR(up / down, 1.0, 0.1);
  EXPECT_LT(closing.on, closing.off / 5) << "the finger rings back after a step, but doesn't leave";
  EXPECT_LT(opening.off, opening.on / 10) << "the finger rings once it's free";
  // The shadow before the touch isn't worth a threshold here, and the servo's next step after the touch presses: it
  // comes within 0.36 mm / 13 mm/s = 28 ms.
  const auto burst = std::find_if(counts.begin(), counts.end(), [](const EventCounts& c) { return c.off >= 20; });
  ASSERT_NE(burst, counts.end());
  const double burst_s = 1e-3 * static_cast<double>(burst - counts.begin());
  EXPECT_GT(burst_s, r.touch_s - 0.002);
  EXPECT_LT(burst_s, r.touch_s + 0.028);
  EXPECT_GT(sum(counts, r.release_s, r.apart_s + 0.05).on, 9 * opening.on / 10);
  ASSERT_FALSE(r.readings.empty());
  EXPECT_NEAR(r.readings.front().seconds, r.touch_s + settings.force_sensor.window_s, 1e-9);
  EXPECT_GT(r.apart_s, r.release_s);
}

TEST(DvsRecordings, KindsOfPixelsSeeTheSameLight) {
  const render::EventPixelSettings own = setup().device().camera->events->pixels;
  render::EventPixelSettings keener = own;
  keener.on_threshold = 0.1;
  keener.off_threshold = 0.1;
  DvsRecordSettings settings = own_pixels(setup().device());
  settings.tolerance *= own.on_threshold / keener.on_threshold;  // as without the third kind
  settings.pixels = {own, own, keener};
  std::int64_t sunk = 0;
  std::int64_t last_us = 0;
  const DvsRecording r =
      record_dvs_grasp(setup(), camera(), short_grasp(kSteel), settings, [&](std::span<const Event> events) {
        sunk += static_cast<std::int64_t>(events.size());
        EXPECT_GE(events.front().t_us, last_us);
        last_us = events.back().t_us;
      });
  ASSERT_EQ(r.by_pixels.size(), 3u);
  EXPECT_EQ(r.by_pixels[0].counts, r.by_pixels[1].counts);
  EXPECT_GT(sum(r.by_pixels[2].counts).off, 2 * sum(r.by_pixels[0].counts).off);
  EXPECT_EQ(sunk, r.by_pixels[0].events);
  const DvsRecording alone = record_dvs_grasp(setup(), camera(), short_grasp(kSteel), own_pixels(setup().device()));
  EXPECT_EQ(alone.by_pixels[0].counts, r.by_pixels[0].counts);
  const EventCounts all = sum(alone.by_pixels[0].counts);
  EXPECT_LE(all.on + all.off, alone.by_pixels[0].events);
  EXPECT_GE(all.on + all.off, alone.by_pixels[0].events - 20) << "the last, part millisecond";
}

// Ten times as fine a table of light and as small changes seen give the same events but for pixels on the verge.
TEST(DvsRecordings, ToleranceHardlyMatters) {
  DvsRecordSettings settings;
  settings.pixels = {without_noise()};
  const DvsRecording usual = record_dvs_grasp(setup(), camera(), short_grasp(kSteel), settings);
  settings.tolerance = 0.005;
  const DvsRecording fine = record_dvs_grasp(setup(), camera(), short_grasp(kSteel), settings);
  EXPECT_GT(fine.steps, usual.steps);
  const auto close = [](std::int64_t a, std::int64_t b) { return 100 * std::abs(a - b) <= b; };
  EXPECT_TRUE(close(sum(usual.by_pixels[0].counts).off, sum(fine.by_pixels[0].counts).off));
  EXPECT_TRUE(close(sum(usual.by_pixels[0].counts).on, sum(fine.by_pixels[0].counts).on));
}

TEST(DvsRecordings, WrongSettingsAreRefused) {
  const auto refusal = [](const DvsRecordSettings& settings) {
    try {
      record_dvs_grasp(setup(), camera(), short_grasp(kSteel), settings);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  DvsRecordSettings settings;
  EXPECT_THAT(refusal(settings), HasSubstr("no event pixels"));
  settings = own_pixels(setup().device());
  settings.tolerance = 0.0;
  EXPECT_THAT(refusal(settings), HasSubstr("tolerance is 0"));
  settings = own_pixels(setup().device());
  settings.pixels.front().on_threshold = -1.0;
  EXPECT_THAT(refusal(settings), HasSubstr("on_threshold"));
  sim::DeviceSpec blind = setup().device();
  blind.camera->events.reset();
  EXPECT_THROW(own_pixels(blind), Error);
}

// Pictures are made where they're wanted: between two of them the light is a straight line, and that's near to a
// picture.
TEST(DvsTravelLight, IsNearToPicturesBetween) {
  const DvsGrasp grasp = setup().play(short_grasp(kSteel));
  const render::EventPixelSettings pixels = without_noise();
  constexpr double kAllowed = 0.01;
  const DvsTravelLight light(setup(), camera(), grasp, pixels, kAllowed);
  const std::vector<double>& travels = light.travels_mm();
  ASSERT_GE(travels.size(), 20u);
  EXPECT_TRUE(std::is_sorted(travels.begin(), travels.end()));
  const auto picture = [&](double travel) {
    const cv::Mat electrons = camera().photocurrent(dvs_face(setup(), camera(), grasp, travel));
    return render::log_intensity(electrons * grasp.parameters.light_level, pixels);
  };
  EXPECT_LT(cv::norm(picture(travels[3]), light.log_at(travels[3]), cv::NORM_INF), 1e-5);
  for (std::size_t k = 0; k + 1 < travels.size(); k += 3) {
    const double between = travels[k] + 0.37 * (travels[k + 1] - travels[k]);
    EXPECT_LT(cv::norm(picture(between), light.log_at(between), cv::NORM_INF), kAllowed) << between;
    EXPECT_GE(light.path_at(travels[k + 1]) - light.path_at(travels[k]),
              0.999 * cv::norm(light.log_at(travels[k + 1]), light.log_at(travels[k]), cv::NORM_INF));
  }
  cv::Mat log;
  cv::log(light.photocurrent_at(travels[2]) + pixels.dark_intensity, log);
  EXPECT_LT(cv::norm(log, light.log_at(travels[2]), cv::NORM_INF), 1e-5);
}

TEST(WindowsOf, AddUpMilliseconds) {
  DvsEvents events;
  for (int ms = 0; ms < 20; ++ms) events.counts.push_back({ms, 100 * ms});
  const std::vector<EventCounts> windows = windows_of(events, 3, 7);
  ASSERT_EQ(windows.size(), 2u) << "the last three milliseconds are no whole window";
  EXPECT_EQ(windows[0], (EventCounts{3 + 4 + 5 + 6 + 7 + 8 + 9, 4200}));
  EXPECT_EQ(windows[1], (EventCounts{10 + 11 + 12 + 13 + 14 + 15 + 16, 9100}));
  EXPECT_EQ(windows_of(events, 0, 1), events.counts);
  EXPECT_TRUE(windows_of(events, 20, 1).empty());
  EXPECT_TRUE(windows_of(events, 0, 21).empty());
  EXPECT_THROW(windows_of(events, -1, 7), Error);
  EXPECT_THROW(windows_of(events, 0, 0), Error);
}

// Ideal pixels see as many whole thresholds as the clip's sinusoid has between its turns.
TEST(EventClip, IdealPixelsGiveItsClosedForm) {
  const std::vector<cv::Mat> clip = event_clip();
  const render::EventPixelSettings settings = event_clip_ideal();
  render::EventPixels pixels(settings, {kEventClipWidth, kEventClipHeight}, 1, 1);
  std::vector<Event> events;
  constexpr std::int64_t kLast = 130;
  for (std::int64_t frame = 0; frame <= kLast; ++frame) {
    pixels.advance(clip[static_cast<std::size_t>(frame) % clip.size()], frame * kEventClipInterval_us, events);
  }
  const double count = event_clip_count(kLast, settings.on_threshold);
  EXPECT_NEAR(static_cast<double>(events.size()), count, 1e-3 * count);
}

}  // namespace
}  // namespace touchstone::lab
