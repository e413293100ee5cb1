#include "lab/bench/device_bench_estimator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "lab/bench/device_bench.h"
#include "lab/bench/device_bench_parts.h"
#include "lab/bench/estimator_frames.h"
#include "tests/support/message_of.h"
#include "tests/support/small_scene.h"

namespace touchstone::lab {
namespace {

using ::testing::Each;
using ::testing::Gt;
using ::testing::HasSubstr;

EstimatorSettings few_frames() {
  EstimatorSettings settings;
  settings.training_frames = 6;
  settings.training_sets = 2;
  settings.test_frames = 4;
  return settings;
}

DeviceBench estimator_alone(const sim::DeviceSpec& device, const std::vector<std::string>& rows = {},
                            const std::optional<sim::ObjectSpec>& object = {}) {
  BenchSettings settings;
  settings.object = object;
  settings.estimator = few_frames();
  settings.estimator.rows = rows;
  settings.estimator.alone = true;
  settings.depth_mm = 0.3;
  return bench_device(device, settings);
}

/// With colours, from which heights are read.
sim::DeviceSpec coloured_device() {
  sim::DeviceSpec device = test::small_coated_device();
  device.camera->bayer = render::BayerPattern::binned;
  return device;
}

/// With black beads of some ten pixels.
sim::DeviceSpec beaded_device() {
  sim::DeviceSpec device = test::small_device({.width = 128, .height = 96, .pixel_pitch_um = 22});
  device.beads->reflectance = 0.02;
  device.gel.frame_albedo = 0.8;
  return device;
}

/// As bright all round as a light panel: beads are dark before it wherever they are.
sim::ObjectSpec luminous_ball() {
  constexpr double kRadiance = 150.0;
  sim::ObjectSpec ball = bench_ball(4.0);
  ball.radiance = kRadiance;
  ball.screen = sim::ScreenSpec{.radius_mm = 12.0, .behind_mm = -3.0, .radiance = kRadiance};
  return ball;
}

const std::vector<std::string> kHeightRows = {"edges x 2", "paths to 16 of the imager's noise"};

const DeviceBench& coated_bench() {
  static const DeviceBench bench = estimator_alone(coloured_device(), kHeightRows);
  return bench;
}

const EstimatorRow& row(const EstimatorBench& bench, const std::string& name) {
  const auto found = std::find_if(bench.rows.begin(), bench.rows.end(), [&](const auto& r) { return r.name == name; });
  if (found == bench.rows.end()) throw std::runtime_error("no row '" + name + "'");
  return *found;
}

TEST(EstimatorBench, HeightsOfACoatedGelHaveTheirColumns) {
  const EstimatorBench& bench = coated_bench().estimator.value();
  EXPECT_EQ(bench.unit, "um");
  ASSERT_EQ(bench.reference.errors.size(), 2u);
  EXPECT_THAT(bench.reference.errors, Each(Gt(0.0)));
  EXPECT_LT(bench.reference.errors.front(), bench.typical) << "better than a flat membrane";
  EXPECT_GT(bench.reference.each_s, 0.0);
  ASSERT_EQ(bench.counts.size(), 4u);
  EXPECT_EQ(bench.counts.back().frames, 12);
  const StudyResult result = report(coated_bench(), "name: small-coated\n");
  ASSERT_EQ(result.files.size(), 4u);
  EXPECT_THAT(result.files.front().text, HasSubstr("## What the estimator feels"));
  EXPECT_THAT(result.files.front().text, HasSubstr("Edges x 2: heights err"));
  EXPECT_THAT(result.files.front().text, HasSubstr("a thousand frames cost"));
  const std::string csv = result.files.back().text;
  EXPECT_THAT(csv, HasSubstr("estimator_error,estimator_least,estimator_most,estimator_unit"));
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')), 1 + 1 + bench.rows.size() + 4);
  EXPECT_THAT(more_errors(row(bench, "paths to 16 of the imager's noise"), bench.reference), Each(Gt(0.0)));
  for (const char* file : {"small-coated-estimator.svg", "small-coated-estimator-frames.svg"}) {
    EXPECT_TRUE(std::any_of(result.files.begin(), result.files.end(), [&](const auto& f) { return f.name == file; }));
  }
}

const EstimatorBench& beaded_bench() {
  static const DeviceBench bench = estimator_alone(beaded_device(), {"without friction"}, luminous_ball());
  return bench.estimator.value();
}

TEST(EstimatorBench, ForcesTrainedWithoutFrictionErrMore) {
  const EstimatorBench& bench = beaded_bench();
  EXPECT_EQ(bench.unit, "N");
  ASSERT_EQ(bench.rows.size(), 1u);
  EXPECT_THAT(more_errors(bench.rows.front(), bench.reference), Each(Gt(0.0)));
  EXPECT_THAT(bench.test, HasSubstr("everything on"));
  std::vector<StudyFile> files;
  EXPECT_THAT(estimator_page(bench, "none", files), HasSubstr("Without friction: forces err by "));
  EXPECT_THAT(files.front().text, HasSubstr(">without friction</text>")) << "beside its point";
}

TEST(EstimatorBench, TheSameSeedsGiveTheSameErrors) {
  const DeviceBench again = estimator_alone(beaded_device(), {"without friction"}, luminous_ball());
  EXPECT_EQ(again.estimator->reference.errors, beaded_bench().reference.errors);
  EXPECT_EQ(again.estimator->rows.front().errors, beaded_bench().rows.front().errors);
}

TEST(EstimatorBench, SaysThatBeadsAreNotSeen) {
  const DeviceBench bench = estimator_alone(beaded_device());
  EXPECT_THAT(bench.estimator->none, HasSubstr("before a ball of 8 mm its tracker finds"));
}

TEST(EstimatorBench, SaysWhyThereIsNone) {
  sim::DeviceSpec device = test::small_device();
  device.beads.reset();
  const DeviceBench bench = estimator_alone(device);
  EXPECT_THAT(bench.estimator.value().none, HasSubstr("neither beads nor a coating"));
  EXPECT_THAT(report(bench, "").files.front().text,
              HasSubstr("No estimator is measured for this device: it has neither beads nor a coating."));
}

TEST(EstimatorBench, NamesTheRowsThatThereAre) {
  EXPECT_THAT(test::message_of([] { estimator_alone(coloured_device(), {"edges x 3"}); }),
              HasSubstr("estimator: rows has 'edges x 3'; this device has 'with friction', "));
}

TEST(EstimatorBench, RefusesWhatMakesNoSense) {
  const auto message = [](const auto& change) {
    const sim::DeviceSpec device = test::small_device();
    EstimatorSettings settings = few_frames();
    change(settings);
    return test::message_of([&] { bench_estimator({device, {}, 0.0, {}, 0.2, 1}, settings); });
  };
  EXPECT_THAT(message([](auto& s) { s.training_frames = 5; }), HasSubstr("training frames are 5; allowed are even"));
  EXPECT_THAT(message([](auto& s) { s.test_frames = 0; }), HasSubstr("test frames are 0"));
  EXPECT_THAT(message([](auto& s) { s.training_sets = 1; }), HasSubstr("training sets are 1; allowed are at least 2"));
}

/// Sets are the first ones of larger sets, so that rows of other numbers of frames share them.
TEST(DrawnPresses, AreTheFirstOnesOfMore) {
  const Eigen::Vector2d reach(1.2, 0.8);
  const std::vector<sim::PressSpec> few = drawn_presses(3, reach, 0.3, true, 5);
  const std::vector<sim::PressSpec> more = drawn_presses(40, reach, 0.3, true, 5);
  for (std::size_t k = 0; k < few.size(); ++k) EXPECT_EQ(few[k].place_mm, more[k].place_mm);
  for (const sim::PressSpec& press : more) {
    EXPECT_GE(*press.depth_mm, 0.15);
    EXPECT_LE(*press.depth_mm, 0.6);
    EXPECT_NEAR(press.drag_mm.norm(), *press.depth_mm / 3.0, 1e-12);
    EXPECT_TRUE((press.place_mm.cwiseAbs().array() <= reach.array()).all());
  }
  EXPECT_EQ(drawn_presses(1, reach, 0.3, false, 5).front().drag_mm.norm(), 0.0);
}

}  // namespace
}  // namespace touchstone::lab
