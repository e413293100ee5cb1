#include "sim/press/gel_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/whole_file.h"
#include "fem/elements/compliance.h"
#include "sim/press/gel_setup.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

DeviceSpec device(const std::string& mesh) {
  return parse_yaml<DeviceSpec>(
      "name: small\n"
      "gel: {size_x_mm: 8, size_y_mm: 8, thickness_mm: 3, youngs_modulus_MPa: 0.3}\n"
      "plate: {thickness_mm: 1, refractive_index: 1.5}\n"
      "mesh: " +
          mesh + "\n",
      "device.yaml");
}

const char* const kMesh = "{fine_mm: 0.6, coarse_mm: 1.5, fine_half_extent_mm: [2, 2], fine_depth_mm: 0.8}";

TEST(GelPlan, ForetellsWhatSetUpWillMake) {
  const test::TemporaryFolder cache;
  const DeviceSpec small = device(kMesh);
  const GelPlan before = plan_gel(small, cache.path());
  EXPECT_FALSE(before.ready);
  EXPECT_THAT(describe(before), HasSubstr("will be set up once"));
  EXPECT_TRUE(std::filesystem::is_empty(cache.path())) << "a plan sets nothing up";
  const auto gel = set_up_gel(small, cache.path());
  const GelPlan after = plan_gel(small, cache.path());
  EXPECT_TRUE(after.ready);
  EXPECT_EQ(after.file, before.file);
  EXPECT_EQ(after.surface_vertices, static_cast<double>(gel->vertices.size()));
  EXPECT_EQ(after.file_mb, static_cast<double>(std::filesystem::file_size(after.file)) / 1e6);
  EXPECT_EQ(after.press_mb, before.press_mb);
  EXPECT_NEAR(before.surface_vertices, after.surface_vertices, 0.3 * after.surface_vertices);
  EXPECT_NEAR(before.file_mb, after.file_mb, 0.6 * after.file_mb);
  EXPECT_GT(after.smooth_error, 0.0);
  EXPECT_GT(after.sharp_error, after.smooth_error);
  EXPECT_THAT(describe(after), HasSubstr("is set up"));
  EXPECT_THAT(describe(after), HasSubstr(after.file.string()));
}

TEST(GelPlan, AnUnsoundFileIsNotReady) {
  const test::TemporaryFolder cache;
  const DeviceSpec small = device(kMesh);
  write_whole_file(plan_gel(small, cache.path()).file, "not a compliance");
  EXPECT_FALSE(plan_gel(small, cache.path()).ready);
}

TEST(GelPlan, AMeshFoundByItsErrorIsSizedAtSetUp) {
  const test::TemporaryFolder cache;
  const DeviceSpec goal = device("{force_error: 0.1, contact_radius_mm: 1.5, fine_half_extent_mm: [2, 2]}");
  const GelPlan before = plan_gel(goal, cache.path());
  EXPECT_FALSE(before.sized);
  EXPECT_THAT(describe(before), HasSubstr("isn't known before"));
  const auto gel = set_up_gel(goal, cache.path());
  EXPECT_GT(gel->report.fine_edge, 0.0);
  const GelPlan after = plan_gel(goal, cache.path());
  EXPECT_TRUE(after.ready && after.sized);
  EXPECT_EQ(after.surface_vertices, static_cast<double>(gel->vertices.size()));
}

}  // namespace
}  // namespace touchstone::sim
