// Pictures of both chroma devices, read: at rest, pressed beside the axis and sheared.

#include "lab/chroma/chroma_setup.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <memory>

#include "core/error.h"
#include "core/units.h"
#include "sensors/colour/marker_change.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

constexpr std::size_t kPressFrames = 3;

/// A device in its setup, and a ball of 12.7 mm that has been pressed in by 1.8 mm and then pulled along x by 0.6 mm.
struct Pressed {
  sim::DeviceSpec device;
  sim::VirtualSensor sensor;
  ChromaSetup setup;
  std::vector<ChromaRecord> records;
  sensors::PictureMap map;

  static constexpr double kX = 7.5, kY = 4.5, kRadius = 6.35;

  explicit Pressed(const std::string& name)
      : device(sim::read_device(std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/devices/" + name + ".yaml")),
        sensor(device, cache(), chroma_sensor_settings(5)),
        setup(sensor, 5),
        map(sensors::map_of_rest(setup.rest(), setup.spacing_mm())) {
    const sim::ObjectSpec ball =
        sim::read_object(std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/objects/ball-12.7mm.yaml");
    sim::MotionSpec motion;
    motion.start_mm = {kX, kY, kRadius};
    sim::MotionKey press;
    press.frames = static_cast<int>(kPressFrames);
    press.z = sim::AxisKey{kRadius - 1.8, std::nullopt};
    sim::MotionKey pull;
    pull.frames = 2;
    pull.x = sim::AxisKey{kX + 0.6, std::nullopt};
    motion.keys = {press, pull};
    records = setup.play(ball, motion, 11);
  }

  /// The devices have the same gel.
  static const std::filesystem::path& cache() {
    static const test::TemporaryFolder folder;
    return folder.path();
  }
  /// Of a marker that is sound in frame `frame`.
  sensors::MarkerChange change(std::size_t frame, std::size_t marker) const {
    return sensors::change_of(records[frame].reading.markers[marker], setup.rest().markers[marker], map);
  }
  /// Markers that are sound there and pressed by at least so much.
  std::vector<std::size_t> pressed(std::size_t frame, double least_mm) const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < records[frame].truth.size(); ++i) {
      const bool sound = records[frame].reading.markers[i].flaw == sensors::MarkerFlaw::kNone;
      if (sound && -records[frame].truth[i].z() >= least_mm) found.push_back(i);
    }
    return found;
  }
};

class ChromaDevices : public testing::TestWithParam<const char*> {
 protected:
  const Pressed& on() const {
    static std::map<std::string, std::unique_ptr<const Pressed>> all;
    auto& one = all[GetParam()];
    if (!one) one = std::make_unique<Pressed>(GetParam());
    return *one;
  }
};

TEST_P(ChromaDevices, AllMarkersAreReadAtRestWhereTheyArePrinted) {
  const Pressed& p = on();
  const auto& rest = p.setup.rest();
  ASSERT_EQ(rest.markers.size(), 100u);
  EXPECT_EQ(rest.light, sensors::FrameLight::kNormal);
  for (std::size_t i = 0; i < rest.markers.size(); ++i) {
    ASSERT_EQ(rest.markers[i].flaw, sensors::MarkerFlaw::kNone) << i;
    const Eigen::Vector2d at = p.sensor.gel_from_pixel(rest.markers[i].ink_centroid_px);
    EXPECT_LT((at - p.setup.markers().markers[i].centre).norm(), 0.1) << i;
    // Red: between the film's yellow and the ink's magenta.
    EXPECT_LT(std::abs(std::remainder(rest.markers[i].hue, 2.0 * kPi)), 0.35) << i;
  }
}

TEST_P(ChromaDevices, WhiteIsBrightAndNothingIsWashedOut) {
  const Pressed& p = on();
  const auto brightest = [](const cv::Mat& frame) {
    double most = 0.0;
    cv::minMaxLoc(frame.reshape(1), nullptr, &most);
    return most;
  };
  const double white = brightest(p.sensor.background(2));
  EXPECT_GT(white, 150.0);
  EXPECT_LT(white, 195.0);
  const sim::TouchObject ball =
      p.sensor.object(sim::read_object(std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/objects/ball-12.7mm.yaml"));
  EXPECT_LT(brightest(p.sensor.capture(ball, p.records[kPressFrames].state.press, 3, 0, false).frame), 250.0);
}

TEST_P(ChromaDevices, HueFallsTowardsTheInksTheDeeperItIsPressed) {
  const Pressed& p = on();
  const auto mean_change = [&](std::size_t frame) {
    double sum = 0.0;
    const std::vector<std::size_t> markers = p.pressed(kPressFrames, 0.5);
    EXPECT_GE(markers.size(), 4u);
    for (const std::size_t i : markers) sum += p.change(frame, i).hue;
    return sum / static_cast<double>(markers.size());
  };
  EXPECT_NEAR(mean_change(0), 0.0, 0.01);
  EXPECT_LT(mean_change(kPressFrames - 1), mean_change(0));
  EXPECT_LT(mean_change(kPressFrames), mean_change(kPressFrames - 1));
  EXPECT_LT(mean_change(kPressFrames), -0.02);
}

TEST_P(ChromaDevices, InkFollowsShear) {
  const Pressed& p = on();
  const std::size_t last = p.records.size() - 1;
  int count = 0;
  for (const std::size_t i : p.pressed(last, 0.7)) {
    const double truth = p.records[last].truth[i].x() - p.records[kPressFrames].truth[i].x();
    if (p.records[kPressFrames].reading.markers[i].flaw != sensors::MarkerFlaw::kNone || truth < 0.1) continue;
    const double seen = p.change(last, i).ink_centroid_mm.x() - p.change(kPressFrames, i).ink_centroid_mm.x();
    EXPECT_NEAR(seen, truth, 0.1 + 0.1 * truth) << i;
    ++count;
  }
  EXPECT_GE(count, 2);
}

// Pressed off the axis a marker seems to move away from it; the drawing's distances tell by how much.
TEST_P(ChromaDevices, ParallaxTakenOffLeavesASmallerLateralError) {
  const Pressed& p = on();
  const sensors::ViewParallax parallax = parallax_of(p.device);
  double without = 0.0;
  double with = 0.0;
  for (const std::size_t i : p.pressed(kPressFrames, 0.4)) {
    const Eigen::Vector3d& truth = p.records[kPressFrames].truth[i];
    const Eigen::Vector2d seen = p.change(kPressFrames, i).ink_centroid_mm;
    const Eigen::Vector2d place = p.setup.markers().markers[i].centre;
    without += (seen - truth.head<2>()).squaredNorm();
    with += (parallax.true_one(seen, -truth.z(), place) - truth.head<2>()).squaredNorm();
  }
  EXPECT_LT(with, 0.3 * without);  // squares
}

INSTANTIATE_TEST_SUITE_P(Devices, ChromaDevices, testing::Values("chroma", "chroma-compact"), [](const auto& device) {
  return std::string(device.param) == "chroma" ? "Setup" : "Compact";
});

TEST(ChromaSetup, DistanceToTheMarkersIsThatOfTheDrawing) {
  sim::DeviceSpec device = sim::read_device(std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/devices/chroma-compact.yaml");
  EXPECT_NEAR(parallax_of(device).viewing_distance_mm, 1.41 * 30.0, 0.02);
  device.camera.reset();
  EXPECT_THROW(parallax_of(device), Error);
}

}  // namespace
}  // namespace touchstone::lab
