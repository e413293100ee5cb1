#include "sensors/reflex/reflex_training.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "sensors/reflex/explore_training.h"

namespace touchstone::sensors {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// A press to `peak_N` and back, with shear of 0.01 N a count along an axis.
ReflexRecording recording(double peak_N, int axis) {
  ReflexRecording frames;
  int sum = 0;
  for (int k = 0; k < 300; ++k) {
    const double part = (k - 50) / 200.0;
    const double force_N = part > 0.0 && part < 1.0 ? peak_N * std::sin(M_PI * part) : 0.0;
    ReflexSample sample;
    sample.statistics = {.maximum = 36 + static_cast<int>(std::lround(2.0 * force_N)),
                         .minimum = 6,
                         .squal = 90,
                         .average = 15.0 + 1.5 * force_N};
    if (part > 0.3 && part < 0.6) {
      (axis == 0 ? sample.statistics.dx : sample.statistics.dy) = 1;
      ++sum;
    }
    Eigen::Vector2d shear = Eigen::Vector2d::Zero();
    if (part > 0.0 && part < 1.0) shear[axis] = (0.01 + 0.001 * force_N) * sum;
    sample.contact = force_N > 0.0;
    sample.normal_N = force_N;
    sample.shear_N = shear;
    frames.push_back(sample);
  }
  return frames;
}

TEST(ReflexTraining, LawsOfRecordingsAreFoundAndTestedOnThoseLeftOut) {
  const std::vector<ReflexRecording> recordings = {recording(2.0, 0), recording(3.0, 1), recording(4.0, 0),
                                                   recording(5.0, 1)};
  const TrainedReflex made = train_reflex(recordings);
  EXPECT_EQ(made.no_shear, "");
  EXPECT_EQ(made.samples, 1200);
  EXPECT_EQ(made.contacts, 4 * 199);
  const ReflexErrors errors = test_reflex(made.model, recordings);
  EXPECT_EQ(errors.samples, 1200);
  EXPECT_LT(errors.wrong_percent(), 2.0);
  EXPECT_LT(errors.rms_N, 0.02);
  EXPECT_LT(errors.shear_rms_N.value(), 0.02);
  const auto left_out = cross_validate_reflex(recordings);
  ASSERT_TRUE(left_out);
  EXPECT_EQ(left_out->samples, 1200);
  EXPECT_LT(left_out->rms_N, 0.02);
  EXPECT_FALSE(cross_validate_reflex(std::span(recordings).first(1)));
}

TEST(ReflexTraining, WhatCantBeBelievedHasNoSay) {
  std::vector<ReflexRecording> recordings = {recording(2.0, 0), recording(3.0, 1)};
  const ReflexModel model = train_reflex(recordings).model;
  for (ReflexRecording& one : recordings) {
    ReflexSample dark = one[150];
    dark.statistics = {};
    one.insert(one.begin() + 150, 5, dark);
  }
  const TrainedReflex again = train_reflex(recordings);
  EXPECT_EQ(again.samples, 600);
  EXPECT_EQ(again.model.force.coefficients, model.force.coefficients);
  EXPECT_EQ(test_reflex(model, recordings).samples, 600);
}

TEST(ReflexTraining, ShearThatIsntThereIsSaid) {
  std::vector<ReflexRecording> recordings = {recording(2.0, 0), recording(3.0, 0)};
  EXPECT_THAT(train_reflex(recordings).no_shear, HasSubstr("shear law"));
  EXPECT_FALSE(train_reflex(recordings).model.shear);
  recordings[1][7].shear_N.reset();
  EXPECT_THAT(train_reflex(recordings).no_shear, HasSubstr("not every frame's shear is known"));
  for (ReflexSample& sample : recordings[0]) sample.contact = false;
  EXPECT_THAT([&] { train_reflex(std::span(recordings).first(1)); }, ThrowsMessage<Error>(HasSubstr("")));
  ReflexTraining training;
  training.shear_every = 0;
  EXPECT_THAT([&] { train_reflex(recordings, training); }, ThrowsMessage<Error>(HasSubstr("shear_every")));
}

TEST(ExploreTraining, LawsOfPressesAreFoundAndTestedOnThoseLeftOut) {
  RandomStream random(1, 0, Purpose::kTest);
  std::vector<std::vector<ExploreSample>> sequences(3);
  std::vector<ExploreSample> all;
  for (auto& sequence : sequences) {
    for (int i = 0; i < 40; ++i) {
      ExploreSample sample;
      sample.press_mm = 4.0 * random.uniform() - 0.5;
      const double press_mm = std::max(sample.press_mm, 0.0);
      const double dilation = 16.0 / (16.0 - press_mm);
      if (press_mm > 0.0) sample.lateral_mm = Eigen::Vector2d(random.normal(), random.normal());
      const Eigen::Vector2d lateral = sample.lateral_mm.value_or(Eigen::Vector2d::Zero());
      sample.motion = {dilation, dilation * lateral / 0.5};
      sample.normal_N = 1.2 * std::expm1(0.4 * press_mm);
      if (press_mm > 0.0) sample.shear_N = (0.3 + 0.02 * sample.normal_N) * lateral;
      sequence.push_back(sample);
      all.push_back(sample);
    }
  }
  const TrainedExplore made = train_explore(all, 1);
  EXPECT_EQ(made.no_shear, "");
  EXPECT_NEAR(made.model.press.mm[0], 16.0, 1e-9);
  EXPECT_NEAR(made.model.force.rate_per_mm, 0.4, 1e-4);
  EXPECT_TRUE(made.model.lateral_mm_per_px.isApprox(0.5 * Eigen::Matrix2d::Identity(), 1e-9));
  for (const auto& errors : {std::optional(test_explore(made.model, all)), cross_validate_explore(sequences, 1)}) {
    ASSERT_TRUE(errors);
    EXPECT_EQ(errors->samples, 120);
    EXPECT_LT(errors->press_rms_mm, 1e-9);
    EXPECT_LT(errors->normal_rms_N, 1e-3);
    EXPECT_LT(errors->shear_rms_N.value(), 1e-3);
  }
  for (ExploreSample& sample : all) sample.lateral_mm.reset();
  EXPECT_THAT(train_explore(all, 1).no_shear, HasSubstr("not every contact's"));
  EXPECT_FALSE(train_explore(all, 1).model.shear);
  EXPECT_FALSE(cross_validate_explore(std::span(sequences).first(1), 1));
  EXPECT_THAT([&] { train_explore(std::span(all).first(2), 1); }, ThrowsMessage<Error>(HasSubstr("2 samples")));
}

}  // namespace
}  // namespace touchstone::sensors
