// Pictures are those that are kept, within the noise. Where one has changed on purpose: script/golden --renew.

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "sim/files/image_file.h"
#include "tests/golden/golden_files.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::golden {
namespace {

class Golden : public ::testing::TestWithParam<std::string> {};

TEST_P(Golden, PictureIsTheStoredOneWithinTheNoise) {
  const ImageStatistics stored = read_statistics(file_of(GetParam()));
  const ImageStatistics rendered = test_rendering(golden_scene(GetParam()));
  const Comparison comparison = compare(stored, rendered);
  if (comparison.passes()) return;
  const std::filesystem::path folder = std::filesystem::path(TOUCHSTONE_BINARY_DIR) / "golden-failed";
  std::filesystem::create_directories(folder);
  write_statistics(folder / (GetParam() + ".exr"), rendered);
  sim::write_png(folder / (GetParam() + ".png"), picture_of(rendered.mean));
  std::vector<std::string> names;
  for (int i = 0; i < comparison.p_values.channels(); ++i) names.push_back(fmt::format("p.{:02}", i));
  sim::write_exr(folder / (GetParam() + "-p-values.exr"), comparison.p_values, names);
  ADD_FAILURE() << comparison.text() << "\nthe rendering is in " << folder
                << "; if it should be so, `script/golden --renew`";
}

INSTANTIATE_TEST_SUITE_P(Images, Golden, ::testing::ValuesIn(golden_names()), [](const auto& tested) {
  std::string name = tested.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

// The test of the test: changes that the eye can't see fail it, and at which level.
TEST(GoldenTest, AnAlbedoThreePercentUpFails) {
  const Comparison comparison =
      compare(read_statistics(file_of("printed-membrane")), test_rendering(printed_membrane(0.7 * 1.03, 0.0)));
  EXPECT_FALSE(comparison.passes());
  EXPECT_FALSE(comparison.levels[2].passes()) << "the picture's mean";
  EXPECT_GT(comparison.relative_change, 0.02);
}

TEST(GoldenTest, AnAlbedoHalfAPercentUpFails) {
  EXPECT_FALSE(compare(read_statistics(file_of("printed-membrane")), test_rendering(printed_membrane(0.7 * 1.005, 0.0)))
                   .passes());
}

TEST(GoldenTest, ALampMovedByAFifthOfAMillimetreFails) {
  const Comparison comparison =
      compare(read_statistics(file_of("printed-membrane")), test_rendering(printed_membrane(0.7, 0.2)));
  EXPECT_FALSE(comparison.levels[1].passes()) << comparison.text();
}

// A level that fails too often cries wolf; one that never does is no test.
TEST(GoldenTest, OtherSeedsOfTheSameSceneFailNoMoreThanTheSignificanceSays) {
  const ImageStatistics stored = read_statistics(file_of("printed-membrane"));
  const GoldenScene golden = golden_scene("printed-membrane");
  constexpr int kTimes = 8;
  constexpr double kSignificance = 0.1;
  int failed = 0;
  double low = 0.0;
  double count = 0.0;
  for (int i = 0; i < kTimes; ++i) {
    const Comparison comparison =
        compare(stored, test_rendering(golden, 5000 + 100 * static_cast<std::uint64_t>(i)), kSignificance);
    for (const LevelResult& level : comparison.levels) failed += level.passes() ? 0 : 1;
    const cv::Mat values = comparison.p_values.reshape(1);
    low += cv::countNonZero(values < 0.05);
    count += static_cast<double>(values.total());
  }
  EXPECT_LE(failed, 8) << "of 24 at 10 %: more comes once in 700 times";
  EXPECT_LT(low / count, 0.055);
  EXPECT_GT(low / count, 0.02);
}

TEST(GoldenTest, AStoredPictureIsReadAsItWasWritten) {
  const test::TemporaryFolder folder;
  ImageStatistics statistics;
  statistics.mean.create(3, 5, CV_32FC(16));
  cv::randu(statistics.mean, 0.1, 2.0);
  statistics.mean.convertTo(statistics.variance, CV_32F, 1e-4);
  statistics.batches = 17;
  statistics.paths = 170;
  write_statistics(folder.path() / "one.exr", statistics);
  const ImageStatistics back = read_statistics(folder.path() / "one.exr");
  EXPECT_EQ(back.batches, 17);
  EXPECT_EQ(back.paths, 170);
  ASSERT_EQ(back.mean.type(), statistics.mean.type());
  EXPECT_LT(cv::norm(back.mean, statistics.mean, cv::NORM_INF), 2.0 / 1024.0);
  EXPECT_LT(cv::norm(back.variance, statistics.variance, cv::NORM_INF), 2e-4 / 8.0);
}

TEST(GoldenTest, PicturesOfAnotherSizeAreRefused) {
  ImageStatistics one, other;
  one.mean = one.variance = cv::Mat::ones(4, 4, CV_32FC3);
  other.mean = other.variance = cv::Mat::ones(4, 5, CV_32FC3);
  EXPECT_THROW(compare(one, other), Error);
}

}  // namespace
}  // namespace touchstone::golden
