#include "lab/gelsight/gelsight_texture_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/random.h"
#include "datasets/jobs/scenes_folder.h"

namespace touchstone::lab {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr sensors::TextureOperator kSmall{{8, 1.0}, 2};

/// Waves of a length of their own for each class, 4 squares of each of 6 images; `spoiled` images show another class.
std::vector<TextureSample> wave_samples(int classes, int spoiled_image = -1) {
  std::vector<TextureSample> samples;
  RandomStream random(3, 0, Purpose::kTest);
  for (int texture = 0; texture < classes; ++texture) {
    for (int image = 0; image < 6; ++image) {
      for (int square = 0; square < 4; ++square) {
        const int shown = image == spoiled_image ? (texture + 1) % classes : texture;
        const double length = 5.0 + 4.0 * shown, phase = 6.28 * random.uniform();
        cv::Mat heights(60, 60, CV_32FC1);
        for (int j = 0; j < 60; ++j) {
          for (int i = 0; i < 60; ++i) {
            const double wave = std::sin(6.2831853 * i / length + phase) * std::sin(6.2831853 * j / length + phase);
            heights.at<float>(j, i) = static_cast<float>(0.05 * wave + 0.002 * random.normal());
          }
        }
        samples.push_back({texture, image, heights});
      }
    }
  }
  return samples;
}

TEST(TextureExperiment, TellsApartWhatDiffersAndCountsEverySample) {
  const TextureScore score = score_textures(wave_samples(3), kSmall, 0.002, 12, TextureSplit::by_sample, 5, 1);
  EXPECT_EQ(score.percent, 100.0);
  EXPECT_EQ(score.worst, 100.0);
  EXPECT_EQ(score.standard_error, 0.0);
  EXPECT_EQ(score.confusion.sum(), 5 * 3 * 12);
  EXPECT_EQ(score.confusion.trace(), 5 * 3 * 12);
}

TEST(TextureExperiment, ALabelThatTellsNothingIsRightByChanceOnly) {
  std::vector<TextureSample> samples = wave_samples(1);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i].texture = static_cast<int>(i / 4 % 2);
  const TextureScore score = score_textures(samples, kSmall, 0.002, 6, TextureSplit::by_sample, 200, 1);
  EXPECT_GT(score.percent, 20.0);
  EXPECT_LT(score.percent, 80.0);
  EXPECT_GT(score.best, score.worst);
}

TEST(TextureExperiment, AnImageOfItsOwnIsKnownOnlyIfASquareOfItTrains) {
  // One of six images of each class shows what the next class has: held out as a whole it is always mistaken.
  const std::vector<TextureSample> samples = wave_samples(3, 2);
  const TextureScore whole = score_textures(samples, kSmall, 0.002, 20, TextureSplit::by_image, 60, 1);
  // A split tests one image a class; each is the spoiled one by a chance of a sixth.
  EXPECT_NEAR(whole.percent, 100.0 * 5.0 / 6.0, 12.0);
  for (const double percent : {whole.worst, whole.best}) {
    EXPECT_NEAR(std::remainder(percent, 100.0 / 3.0), 0.0, 1e-9);  // the four squares of an image go together
  }
}

TEST(TextureExperiment, SplitsAreTheSeeds) {
  const std::vector<TextureSample> samples = wave_samples(3, 2);
  const auto percent = [&](std::uint64_t seed) {
    return score_textures(samples, kSmall, 0.002, 8, TextureSplit::by_sample, 7, seed).percent;
  };
  EXPECT_EQ(percent(1), percent(1));
  EXPECT_NE(percent(1), percent(2));
}

TEST(TextureExperiment, RefusesSplitsThatCannotBe) {
  const std::vector<TextureSample> samples = wave_samples(2);
  const auto message = [&](int training, TextureSplit split) -> std::string {
    try {
      score_textures(samples, kSmall, 0.002, training, split, 1, 1);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message(24, TextureSplit::by_sample), HasSubstr("24 training samples of 24"));
  EXPECT_THAT(message(0, TextureSplit::by_sample), HasSubstr("at least one must train"));
  EXPECT_THAT(message(10, TextureSplit::by_image), HasSubstr("don't make up 10"));
}

TEST(TextureExperiment, SquaresAreInTheMiddleAndDoNotOverlap) {
  cv::Mat image(9, 12, CV_32FC1, cv::Scalar(0));
  for (int j = 0; j < image.rows; ++j) {
    for (int i = 0; i < image.cols; ++i) image.at<float>(j, i) = static_cast<float>(100 * j + i);
  }
  const std::vector<cv::Mat> squares = middle_squares(image, 4);
  ASSERT_EQ(squares.size(), 4U);
  EXPECT_EQ(squares[0].at<float>(0, 0), 2.0F);
  EXPECT_EQ(squares[1].at<float>(0, 0), 6.0F);
  EXPECT_EQ(squares[2].at<float>(0, 0), 402.0F);
  EXPECT_EQ(squares[3].at<float>(3, 3), 709.0F);
  EXPECT_THROW(middle_squares(image, 5), Error);
}

TEST(TextureExperiment, WorstConfusionsComeFirst) {
  Eigen::MatrixXi confusion(3, 3);
  confusion << 9, 1, 0, 0, 7, 3, 0, 0, 10;
  EXPECT_THAT(worst_confusions(confusion, {"a", "b", "c"}, 5), ElementsAre("b taken for c: 3", "a taken for b: 1"));
  EXPECT_EQ(worst_confusions(confusion, {"a", "b", "c"}, 1).size(), 1U);
}

TEST(TextureExperiment, AnotherPatchChangesTheSeedOnly) {
  const std::vector<sim::ObjectSpec> objects = texture_objects(datasets::scenes_folder());
  EXPECT_EQ(objects.size(), 40U);
  sim::ObjectSpec patch = another_patch(objects.front(), 77);
  EXPECT_EQ(std::get<sim::FabricRelief>(patch.relief->kind).seed, 77U);
  patch.relief->kind = sim::WavesRelief{};
  EXPECT_THROW(another_patch(patch, 1), Error);
  patch.relief.reset();
  EXPECT_THROW(another_patch(patch, 1), Error);
}

}  // namespace
}  // namespace touchstone::lab
