#include "fem/vibration/vibration_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/matrix_file.h"
#include "core/whole_file.h"
#include "tests/fem/mesh/box_mesh.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::fem {
namespace {

using ::testing::HasSubstr;

const ElasticMaterial kMaterial{0.33, 0.45};
const Bead kBead{{0.1, 0.0, -0.5}, 0.2};
constexpr double kDensity = 1e-9;
constexpr int kCount = 5;

struct Made {
  GelVibration vibration;
  int meshes = 0;
};

Made made(const touchstone::test::TemporaryFolder& folder, const std::string& key = "key") {
  Made result;
  const auto mesh = [&] {
    ++result.meshes;
    return fixtures::box_mesh({2, 2, 1}, 2, 2, 1);
  };
  result.vibration = cached_vibration(key, mesh, {&kMaterial, 1}, {&kBead, 1}, kDensity, kCount, folder.path());
  return result;
}

TEST(VibrationCache, WhatIsReadIsBitForBitWhatWasComputed) {
  const touchstone::test::TemporaryFolder folder;
  const Made first = made(folder);
  const Made second = made(folder);
  EXPECT_EQ(first.meshes, 1);
  EXPECT_EQ(second.meshes, 0);
  EXPECT_EQ(second.vibration.angular_frequency, first.vibration.angular_frequency);
  EXPECT_EQ(second.vibration.surface, first.vibration.surface);
  EXPECT_EQ(second.vibration.beads, first.vibration.beads);
  EXPECT_EQ(second.vibration.effective_mass, first.vibration.effective_mass);
  EXPECT_EQ(second.vibration.mass, first.vibration.mass);
  EXPECT_EQ(second.vibration.note, "");
  EXPECT_EQ(made(folder, "another gel").meshes, 1);
}

TEST(VibrationCache, AFileThatIsTruncatedOrChangedIsNeverUsed) {
  const touchstone::test::TemporaryFolder folder;
  const GelVibration sound = made(folder).vibration;
  const auto file = vibration_file(folder.path(), "key", kDensity, kCount);
  const std::string content = read_whole_file(file);
  const auto expect_made_anew = [&](const std::string& bad, const std::string& why) {
    write_whole_file(file, bad);
    const Made again = made(folder);
    EXPECT_EQ(again.meshes, 1) << why;
    EXPECT_THAT(again.vibration.note, HasSubstr(why));
    EXPECT_EQ(again.vibration.surface, sound.surface);
    EXPECT_EQ(read_whole_file(file), content) << "the file wasn't replaced";
  };
  expect_made_anew("", "ends early");
  expect_made_anew(content.substr(0, content.size() / 2), "checksum");
  std::string changed = content;
  changed[300] = static_cast<char>(changed[300] ^ 1);
  expect_made_anew(changed, "checksum");
  changed = content;
  changed[0] = 'x';
  expect_made_anew(changed, "isn't a gel's modes");
  write_whole_file(file, content);
  std::filesystem::copy_file(file, vibration_file(folder.path(), "other", kDensity, kCount));
  EXPECT_THAT(made(folder, "other").vibration.note, HasSubstr("another gel"));
}

// Whoever may write into the folder can seal a file as the program does.
TEST(VibrationCache, SoundSealOnAnotherGelsNumbersIsMadeAnew) {
  const touchstone::test::TemporaryFolder folder;
  const GelVibration sound = made(folder).vibration;
  const auto file = vibration_file(folder.path(), "key", kDensity, kCount);
  const std::string content = read_whole_file(file);
  const std::string key = content.substr(8, 64);
  const auto expect_made_anew = [&](const GelVibration& bad, const std::string& why) {
    write_whole_file(file, matrix_file("TSVIBRAT", key,
                                       {bad.angular_frequency, bad.surface, bad.beads, bad.effective_mass,
                                        Eigen::MatrixXd::Constant(1, 1, bad.mass)}));
    const Made again = made(folder);
    EXPECT_EQ(again.meshes, 1) << why;
    EXPECT_THAT(again.vibration.note, HasSubstr(why));
    EXPECT_EQ(read_whole_file(file), content) << "the file wasn't replaced";
  };
  GelVibration bad = sound;
  bad.angular_frequency[0] = std::nan("");
  expect_made_anew(bad, "aren't a vibration's");
  bad = sound;
  bad.beads = Eigen::MatrixXd::Zero(6, kCount);
  expect_made_anew(bad, "don't fit");
  bad = sound;
  bad.effective_mass = Eigen::MatrixXd::Zero(2, kCount);
  expect_made_anew(bad, "don't fit");
}

TEST(VibrationCache, WithoutAFolderNothingIsKept) {
  const GelVibration vibration = cached_vibration("key",
                                                  [] {
                                                    return fixtures::box_mesh({2, 2, 1}, 2, 2, 1);
                                                  },
                                                  {&kMaterial, 1}, {}, kDensity, kCount, {});
  EXPECT_EQ(vibration.note, "");
  EXPECT_EQ(vibration.beads.rows(), 0);
}

}  // namespace
}  // namespace touchstone::fem
