#include "sim/plan/size_doubt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "sim/plan/plan.h"

namespace touchstone::sim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// A pad of 20 x 20 x 4 mm, meshed with 0.5 mm.
DeviceSpec device() {
  DeviceSpec made;
  made.gel.shape = SlabSpec{.size_x_mm = 20.0, .size_y_mm = 16.0};
  made.gel.thickness_mm = 4.0;
  return made;
}

ObjectSpec ball(double radius_mm) {
  ObjectSpec object;
  object.name = "ball";
  object.shape.radius_mm = radius_mm;
  return object;
}

/// A box of 6 x 8 x 10 units.
ObjectSpec box_file(const std::string& unit) {
  return parse_yaml<ObjectSpec>("name: part\nshape: {type: mesh, file: meshio-binary.stl" + unit + "}\n",
                                std::string(TOUCHSTONE_SOURCE_DIR) + "/tests/fuzz/corpus/plain_mesh/object.yaml");
}

TEST(SizeDoubt, MetresInPlaceOfMillimetresAreNamed) {
  EXPECT_EQ(size_doubt(device(), box_file("")), "");
  EXPECT_EQ(
      size_doubt(device(), box_file(", mm_per_unit: 1000")),
      "object part: it is 6000 x 8000 x 10000 mm, more than 10 times as long as the gel, 20 mm; meshio-binary.stl "
      "is 6 x 8 x 10 of its own units, each of which is taken for 1000 mm (shape.mm_per_unit)");
  EXPECT_EQ(
      size_doubt(device(), box_file(", mm_per_unit: 0.001")),
      "object part: it is 0.006 x 0.008 x 0.01 mm, less than one edge of the gel's mesh, 0.5 mm; meshio-binary.stl "
      "is 6 x 8 x 10 of its own units, each of which is taken for 0.001 mm (shape.mm_per_unit)");
}

TEST(SizeDoubt, StartsAtTenGelsAndAtOneEdge) {
  EXPECT_EQ(size_doubt(device(), ball(99.9)), "");
  EXPECT_THAT(size_doubt(device(), ball(100.1)),
              AllOf(HasSubstr("10 times as long as the gel, 20 mm"), HasSubstr("in mm?")));
  EXPECT_EQ(size_doubt(device(), ball(0.251)), "");
  EXPECT_THAT(size_doubt(device(), ball(0.249)), HasSubstr("one edge of the gel's mesh, 0.5 mm"));
  DeviceSpec by_error = device();
  by_error.mesh.force_error = 0.01;  // its edges aren't known before set-up
  EXPECT_EQ(size_doubt(by_error, ball(0.249)), "");
}

TEST(SizeDoubt, AnyGelHasALongestSide) {
  DeviceSpec made = device();
  made.gel.shape = DomeSpec{.sphere_radius_mm = 20.0, .base_radius_mm = 8.0};
  EXPECT_THAT(size_doubt(made, ball(100)), HasSubstr("the gel, 16 mm"));
  made.gel.shape = FingertipSpec{.radius_mm = 5.0, .length_mm = 12.0, .sleeve_mm = 0.0};
  EXPECT_THAT(size_doubt(made, ball(100)), HasSubstr("the gel, 17 mm"));
}

TEST(SizeDoubt, ThePlanWarnsOfEachObjectOnce) {
  const std::filesystem::path scenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
  SceneSpec scene = read_scene(scenes / "vhs/ball-press.yaml");
  EXPECT_TRUE(make_plan(scene).warnings.empty());
  scene.object = box_file(", mm_per_unit: 1000");
  ASSERT_EQ(make_plan(scene).warnings.size(), 1u);
  EXPECT_EQ(make_plan(scene).warnings.front(), size_doubt(scene.device, scene.object));
}

// None of what is shipped is warned of, whatever it is pressed on.
TEST(SizeDoubt, NoShippedObjectIsDoubtedOnAnyShippedDevice) {
  const std::filesystem::path scenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
  for (const auto& device_file : std::filesystem::directory_iterator(scenes / "devices")) {
    if (device_file.path().extension() != ".yaml") continue;
    const auto made = read_yaml<DeviceSpec>(device_file.path());
    for (const auto& object_file : std::filesystem::directory_iterator(scenes / "objects")) {
      if (object_file.path().extension() != ".yaml") continue;
      EXPECT_EQ(size_doubt(made, read_object(object_file.path())), "") << device_file.path() << object_file.path();
    }
  }
}

}  // namespace
}  // namespace touchstone::sim
