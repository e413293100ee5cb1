#include "sim/press/linear_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

SceneSpec scene_with(const std::string& mesh) {
  SceneSpec scene;
  scene.device = parse_yaml<DeviceSpec>(
      "name: pad\ngel: {size_x_mm: 10, size_y_mm: 10, thickness_mm: 3, "
      "youngs_modulus_MPa: 0.3, poisson_ratio: 0.49}\nplate: {thickness_mm: 1, refractive_index: 1.5}\nmesh: {" +
          mesh + "}\n",
      "pad.yaml");
  scene.object = parse_yaml<ObjectSpec>("name: ball\nshape: {type: sphere, radius_mm: 4}\n", "ball.yaml");
  return scene;
}

TEST(LinearRange, TheoriesMeetInShallowPressesAndPartInDeepOnes) {
  const test::TemporaryFolder cache;
  const SceneSpec scene =
      scene_with("fine_mm: 0.9, coarse_mm: 2.5, fine_half_extent_mm: [2.5, 2.5], fine_depth_mm: 0.9");
  const auto rows = measure_linear_range(scene, cache.path());
  ASSERT_EQ(rows.size(), std::size(fem::kRangeDepths));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    EXPECT_DOUBLE_EQ(rows[k].depth, 3.0 * fem::kRangeDepths[k]);
    EXPECT_GT(rows[k].linear_force, 0.0);
    EXPECT_LT(std::abs(rows[k].difference()), 0.5 * rows[k].largest_strain);
    EXPECT_GT(rows[k].finite_seconds, rows[k].linear_seconds);
    if (k > 0) {
      EXPECT_GT(rows[k].largest_strain, rows[k - 1].largest_strain);
    }
  }
  EXPECT_LT(std::abs(rows.front().difference()), 0.03);
}

TEST(LinearRange, MeshFoundByItsErrorIsRefused) {
  const test::TemporaryFolder cache;
  const SceneSpec scene =
      scene_with("force_error: 0.05, contact_radius_mm: 1, fine_half_extent_mm: [2.5, 2.5], fine_depth_mm: 0.9");
  try {
    measure_linear_range(scene, cache.path());
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("fine_mm"));
  }
}

}  // namespace
}  // namespace touchstone::sim
