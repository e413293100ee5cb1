#include "sensors/skin/softness_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/sensors/skin/invented_presses.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using fixtures::invented_press;
using ::testing::HasSubstr;
using touchstone::test::message_of;

constexpr double kRate_Hz = 250.0;
const char* const kLevels[] = {"soft", "firm", "hard"};

std::vector<KnownSoftness> known_presses(int of_each) {
  std::vector<KnownSoftness> presses;
  for (int number = 0; number < of_each; ++number) {
    for (int level = 0; level < 3; ++level)
      presses.push_back({invented_press(level, number, kRate_Hz), kLevels[level]});
  }
  return presses;
}

SoftnessTraining quick_training() {
  SoftnessTraining training = usual_softness_training();
  training.networks = 2;
  training.highest_Hz = 60.0;
  return training;
}

const SoftnessCalibration& calibration() {
  static const SoftnessCalibration kMade = calibrate_softness(known_presses(8), kRate_Hz, quick_training(), 1);
  return kMade;
}

TEST(SoftnessModel, KnownPressesNameOthers) {
  EXPECT_GE(calibration().right, 22) << "of 24 that were left out in turn";
  int right = 0;
  for (int number = 100; number < 110; ++number) {
    for (int level = 0; level < 3; ++level) {
      const MaterialGuess guess = classify(calibration().model, invented_press(level, number, kRate_Hz));
      EXPECT_NEAR(guess.probabilities.sum(), 1.0, 1e-9);
      right += guess.label == level ? 1 : 0;
    }
  }
  EXPECT_GE(right, 27) << "of 30";
}

TEST(SoftnessModel, IsTheSameForAnyNumberOfThreadsAndKeptToTheBit) {
  const SoftnessModel& model = calibration().model;
  EXPECT_EQ(to_json(calibrate_softness(known_presses(8), kRate_Hz, quick_training(), 2).model), to_json(model));
  const std::string text = to_json(model);
  EXPECT_EQ(to_json(softness_model_from_json(text, "a.json")), text);
  std::string changed = text;
  changed.replace(changed.find("\"rate_Hz\": 250"), 14, "\"rate_Hz\": 251");
  EXPECT_THAT(message_of([&] { softness_model_from_json(changed, "a.json"); }), HasSubstr("checksum"));
  EXPECT_THAT(message_of([&] { softness_model_from_json("{}", "a.json"); }), HasSubstr("a.json: 'format' is missing"));
  SoftnessModel bad = model;
  bad.networks.clear();
  EXPECT_THAT(message_of([&] { to_json(bad); }), HasSubstr("0 networks"));
  bad = model;
  bad.networks[1].materials[0] = "other";
  EXPECT_THAT(message_of([&] { to_json(bad); }), HasSubstr("different levels"));
}

TEST(SoftnessModel, WhatMakesNoSenseIsNamed) {
  const auto message = [](std::vector<KnownSoftness> presses, SoftnessTraining training = quick_training()) {
    return message_of([&] { calibrate_softness(presses, kRate_Hz, training, 1); });
  };
  EXPECT_THAT(message(known_presses(2)), HasSubstr("2 presses of 'soft'; at least 3"));
  std::vector<KnownSoftness> alike = known_presses(3);
  for (KnownSoftness& press : alike) press.softness = "soft";
  EXPECT_THAT(message(alike), HasSubstr("there is 1"));
  SoftnessTraining training = quick_training();
  training.networks = 0;
  EXPECT_THAT(message(known_presses(3), training), HasSubstr("0 networks"));
  training = quick_training();
  training.lowest_Hz = 200.0;
  training.highest_Hz = 210.0;
  EXPECT_THAT(message(known_presses(3), training), HasSubstr("no frequency lies from 200 to 210 Hz"));
  const std::vector<double> still(300, 0.0);
  EXPECT_THAT(message_of([&] { classify(calibration().model, still); }), HasSubstr("nothing was touched"));
}

}  // namespace
}  // namespace touchstone::sensors
