#include "touchstone/testing.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <tuple>
#include <vector>

#include "core/error.h"
#include "core/locked_work.h"
#include "core/nearest_name.h"
#include "datasets/jobs/scenes_folder.h"
#include "sim/files/image_file.h"
#include "sim/press/gel_setup.h"

namespace touchstone::testing {
namespace {

namespace fs = std::filesystem;

/// A file, or the shipped one of that name below `folder`.
fs::path file_of(const std::string& name, const char* what, const char* folder) {
  if (fs::is_regular_file(name)) return fs::absolute(name).lexically_normal();
  const fs::path shipped = datasets::scenes_folder() / folder;
  if (fs::is_regular_file(shipped / (name + ".yaml"))) return shipped / (name + ".yaml");
  std::vector<std::string> known;
  for (const auto& entry : fs::directory_iterator(shipped)) {
    if (entry.path().extension() == ".yaml") known.push_back(entry.path().stem().string());
  }
  std::sort(known.begin(), known.end());
  fail("{} '{}': there is no such file, nor is it shipped{}; there are: {}", what, name, did_you_mean(name, known),
       fmt::join(known, ", "));
}

/// Equal settings make one device.
auto key_of(const fs::path& file, const VirtualSensorSettings& s) {
  return std::tuple(file, s.seed, s.deepest_mm, s.widest_mm, s.membrane_um);
}

}  // namespace

const VirtualSensor& device(const std::string& name_or_file, const VirtualSensorSettings& settings) {
  static std::mutex making;
  static std::map<decltype(key_of({}, {})), std::unique_ptr<const VirtualSensor>> made;
  const fs::path file = file_of(name_or_file, "device", "devices");
  return *locked_work(making, [&] {
    auto& kept = made[key_of(file, settings)];
    if (!kept) {
      kept = std::make_unique<const VirtualSensor>(sim::read_device(file), sim::default_cache_folder(), settings);
    }
    return kept.get();
  });
}

sim::ObjectSpec object(const std::string& name_or_file) {
  return sim::read_object(file_of(name_or_file, "object", "objects"));
}

sim::ObjectSpec ball(double diameter_mm, double friction) {
  if (!(diameter_mm > 0.0)) fail("a ball's diameter is {} mm; allowed are numbers above 0", diameter_mm);
  sim::ObjectSpec ball;
  ball.name = fmt::format("ball of {:g} mm", diameter_mm);
  ball.shape.radius_mm = 0.5 * diameter_mm;
  ball.friction = friction;
  return ball;
}

std::string keep_frames(const Touch& held) {
  const char* folder = std::getenv("TOUCHSTONE_FAILED_FRAMES");
  if (folder == nullptr || *folder == '\0' || held.frame.empty()) return "";
  static std::map<std::string, int> kept;
  static std::mutex counting;
  const ::testing::TestInfo* test = ::testing::UnitTest::GetInstance()->current_test_info();
  std::string name = test == nullptr ? "frame" : fmt::format("{}.{}", test->test_suite_name(), test->name());
  std::replace(name.begin(), name.end(), '/', '-');
  int number = 0;
  {
    const std::lock_guard<std::mutex> lock(counting);
    number = ++kept[name];
  }
  try {
    fs::create_directories(folder);
    const fs::path file = fs::path(folder) / fmt::format("{}-{}.png", name, number);
    sim::write_png(file, held.frame);
    sim::write_png(fs::path(folder) / fmt::format("{}-{}-background.png", name, number), held.background);
    return fmt::format("; its frame is {}", file.string());
  } catch (const std::exception& error) {
    return fmt::format("; its frame couldn't be kept: {}", error.what());
  }
}

}  // namespace touchstone::testing
