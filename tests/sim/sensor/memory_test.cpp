// What a sequence of frames takes of memory: as much after a hundred frames as after three, and what issue 4 allows a
// frame of full size. Counts of bytes, on Linux with glibc; never of time.

#include <gtest/gtest.h>
#include <malloc.h>
#include <tbb/global_control.h>

#include <fstream>
#include <string>

#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_camera.h"
#include "tests/support/small_scene.h"
#include "tests/support/temporary_folder.h"

#ifdef __SANITIZE_ADDRESS__  // glibc knows nothing of its allocator; Debian's g++ has no header for this
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();
#endif

namespace touchstone::sim {
namespace {

/// A pad of 12 x 12 x 4 mm with 2 x 2 beads and a flat probe of 3 mm.
SceneSpec small_scene(int width, int height) {
  SceneSpec scene;
  scene.device = test::small_device({.width = width, .height = height, .pixel_pitch_um = 30.0 * 96.0 / width});
  scene.device.room_radiance = 0.0;
  scene.object = parse_yaml<ObjectSpec>(
      "name: probe\nshape: {type: rounded_cylinder, radius_mm: 1.5, edge_radius_mm: 0.3, height_mm: 4}\n"
      "friction: 0.7\n",
      "probe.yaml");
  scene.motion = parse_yaml<MotionSpec>(
      "start_mm: [0, 0, 0.5]\nkeys:\n  - {frames: 1, z: {force_N: 1}}\n  - {frames: 1, z: {force_N: 2}}\n",
      "motion.yaml");
  scene.outputs.ideal = scene.outputs.radiance = scene.outputs.height = true;
  scene.outputs.depth = scene.outputs.normals = scene.outputs.ids = true;
  scene.outputs.contact = scene.outputs.flow = scene.outputs.error = true;
  scene.light.min_samples = 2;
  scene.light.max_samples = 4;
  return scene;
}

/// The whole process's largest resident memory, in bytes, since the last forget_peak.
std::size_t peak_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::stoul(line.substr(6)) * 1024;
  }
  return 0;
}
/// False where the system doesn't let us.
bool forget_peak() {
  malloc_trim(0);
  std::ofstream file("/proc/self/clear_refs");
  file << "5" << std::flush;
  return file.good();
}

std::size_t bytes_in_use() {
#ifdef __SANITIZE_ADDRESS__
  return __sanitizer_get_current_allocated_bytes();
#else
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
#endif
}

class Memory : public ::testing::Test {
 protected:
  explicit Memory(int width = 96, int height = 72)
      : scene(small_scene(width, height)),
        plan(make_plan(scene)),
        gel(set_up_gel(scene.device, cache.path())),
        truths(play_motion(scene, plan, *gel)),
        camera(scene, plan, *gel, truths.front()) {}

  /// The three frames of the motion, so many times over.
  void capture(int rounds) const {
    for (int round = 0; round < rounds; ++round) {
      for (const Truth& truth : truths) {
        const Capture one = camera.capture(truth);
        ASSERT_FALSE(one.frame.empty());
        ASSERT_FALSE(one.pixel_truth.image.empty());
      }
    }
  }

  tbb::global_control one_thread{tbb::global_control::max_allowed_parallelism, 1};  // mallinfo2 sees its arena only
  test::TemporaryFolder cache;
  SceneSpec scene;
  Plan plan;
  std::shared_ptr<const fem::Compliance> gel;
  std::vector<Truth> truths;
  VirtualCamera camera;
};

class MemoryOfAFullFrame : public Memory {
 protected:
  MemoryOfAFullFrame() : Memory(640, 480) {}
};

TEST_F(Memory, FramesLeaveNothingBehind) {
  capture(1);
  const std::size_t after_three = bytes_in_use();
  capture(10);
  const std::size_t after_thirty_more = bytes_in_use();
  // A frame's light alone is 83 kB; thirty that stayed would be 2.5 MB.
  EXPECT_LT(after_thirty_more, after_three + 50000);
}

TEST_F(Memory, ThePeakOfALongSequenceIsThatOfAShortOne) {
  if (!forget_peak()) GTEST_SKIP() << "no /proc/self/clear_refs";
  capture(1);
  const std::size_t three = peak_bytes();
  capture(33);
  EXPECT_LT(peak_bytes(), three + (std::size_t{4} << 20)) << "a hundred frames more";
}

TEST_F(MemoryOfAFullFrame, WithAllItsOutputsIsUnder500MB) {
  if (!forget_peak()) GTEST_SKIP() << "no /proc/self/clear_refs";
  const Capture capture = camera.capture_whole(truths.back());
  EXPECT_EQ(capture.radiance.size(), cv::Size(640, 480));
  EXPECT_GE(capture.pixel_truth.channel_names.size(), 9u);
  EXPECT_LT(peak_bytes(), 500000000u);
  RecordProperty("peak_MB", static_cast<int>(peak_bytes() / 1000000));
}

}  // namespace
}  // namespace touchstone::sim
