#include "sim/sensor/light_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/small_light.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

const std::string kKey(64, 'a');

using test::small_light;

TEST(LightFile, WhatIsReadIsWhatWasWritten) {
  const touchstone::test::TemporaryFolder folder;
  write_light(folder.path(), kKey, small_light());
  const auto light = read_light(folder.path(), kKey);
  ASSERT_TRUE(light);
  EXPECT_EQ(light->choice.reason, "as it's wanted");
  EXPECT_EQ(light->field.lamp_of, (std::vector<int>{0, 0}));
  EXPECT_EQ(light->field.beside[0].steeper, 1);
  EXPECT_EQ(light->field.flow, small_light().field.flow);
}

// The checksum is right in all of these: whoever may write into the folder can seal a file as the program does.
TEST(LightFile, NumbersThatNoLightHasAreNotUsed) {
  const touchstone::test::TemporaryFolder folder;
  const auto expect_unused = [&](const char* what, const std::function<void(FoundLight&)>& spoil) {
    FoundLight light = small_light();
    spoil(light);
    write_light(folder.path(), kKey, light);
    EXPECT_FALSE(read_light(folder.path(), kKey)) << what;
  };
  expect_unused("a beam beside it that isn't there", [](FoundLight& light) { light.field.beside[1].left = 2; });
  expect_unused("beams in a ring", [](FoundLight& light) { light.field.beside[0].flatter = 1; });
  expect_unused("a beam steeper than itself", [](FoundLight& light) { light.field.beside[0].steeper = 0; });
  expect_unused("no lamp", [](FoundLight& light) { light.field.lamp_of[0] = -1; });
  expect_unused("one node", [](FoundLight& light) {
    light.field.nodes = {1, 2, 2};
    light.field.flow.resize(2 * 4 * 4);
  });
  expect_unused("cells of no length", [](FoundLight& light) { light.field.step[0] = 0.0; });
  expect_unused("no number", [](FoundLight& light) { light.field.flow[5] = std::nanf(""); });
  expect_unused("no rays", [](FoundLight& light) { light.rays = 0; });
}

}  // namespace
}  // namespace touchstone::sim
