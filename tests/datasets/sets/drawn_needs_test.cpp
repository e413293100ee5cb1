#include "datasets/sets/drawn_needs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/hdf5_file.h"
#include "datasets/jobs/drawn_touch.h"
#include "datasets/sets/block_record.h"
#include "datasets/sets/generate.h"
#include "tests/support/message_of.h"
#include "tests/support/small_draw.h"
#include "tests/support/small_job.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::datasets {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Two samples of a unit, a ball of 1.5 mm pressed up to 0.35 mm into 3 mm; what is asked for is set by `more`.
constexpr const char* kJob = R"(name: needs
seed: 3
samples: 2
samples_per_file: 1
membrane_um: 120
draw:
  device: device.yaml
  objects: [{file: ball.yaml}]
  place_mm: {x: {uniform: [-0.5, 0.5]}, y: {uniform: [-0.5, 0.5]}}
  depth_mm: {uniform: [0.15, 0.35]}
outputs: [frame]
)";

class DrawnNeeds : public ::testing::Test {
 protected:
  PreparedDraw prepared(const std::string& more) { return prepare_draw(test::write_small_draw(folder_, kJob + more)); }
  std::filesystem::path cache() const { return folder_.path() / "cache"; }

  /// The forces of both samples, N, and where the set's files lie.
  std::vector<double> forces(const std::string& out, const std::string& more, Shard shard = {}) {
    const auto job = test::write_small_draw(folder_, kJob + more);
    GenerateOptions options = simulated(cache());
    options.shard = shard;
    touchstone::datasets::generate(job, folder_.path() / out, options);
    if (shard.count > 1) return {};
    std::vector<double> all;
    for (const char* block : {"blocks/000000.h5", "blocks/000001.h5"}) {
      all.push_back(Hdf5Reader(folder_.path() / out / block).read<double>("/wrench").values[2]);
    }
    return all;
  }

  test::TemporaryFolder folder_;
};

TEST_F(DrawnNeeds, WithoutAnAccuracyNothingIsMeasured) {
  PreparedDraw draw = prepared("");
  EXPECT_TRUE(plan_by_need(draw, cache()).empty());
  EXPECT_EQ(draw.effects.elasticity, sim::Elasticity::automatic);
  EXPECT_FALSE(std::filesystem::exists(cache()));
}

TEST_F(DrawnNeeds, ThePlanIsOfTheHardestSampleAndOneCalledForIsEnough) {
  PreparedDraw draw = prepared("accuracy: {}\n");
  const std::vector<NeededDraw> needed = plan_by_need(draw, cache());
  ASSERT_EQ(needed.size(), 1u);
  const auto depth = [&](std::int64_t sample) { return drawn_touch(draw, sample).depth_mm; };
  EXPECT_EQ(depth(needed[0].draw.sample), std::max(depth(0), depth(1)));
  EXPECT_TRUE(needed[0].plan.finite_strain);
  EXPECT_EQ(draw.effects.elasticity, sim::Elasticity::neo_hookean);
  EXPECT_EQ(draw.effects.fine_relief, sim::Switch::on);
  EXPECT_THAT(in_words(draw.effects), AllOf(HasSubstr("finite strain on"), HasSubstr("fine relief on")));
}

TEST_F(DrawnNeeds, WhatMayBeLeftOutIs) {
  PreparedDraw draw = prepared("accuracy: {force_percent: 90, pixel_noise: 1000, marker_px: 90, height_um: 2000}\n");
  plan_by_need(draw, cache());
  EXPECT_EQ(draw.effects.elasticity, sim::Elasticity::linear);
  EXPECT_EQ(draw.effects.fine_relief, sim::Switch::off);
  EXPECT_EQ(draw.effects.interreflection, sim::Switch::off);
}

TEST_F(DrawnNeeds, TheJobsOwnSwitchesCountMore) {
  PreparedDraw draw = prepared("accuracy: {height_um: 1}\neffects: {elasticity: linear, interreflection: off}\n");
  const std::vector<NeededDraw> needed = plan_by_need(draw, cache());
  EXPECT_FALSE(needed.at(0).plan.finite_strain);
  EXPECT_EQ(draw.effects.elasticity, sim::Elasticity::linear);
  EXPECT_EQ(draw.effects.interreflection, sim::Switch::off);
  EXPECT_EQ(draw.effects.fine_relief, sim::Switch::on);
  PreparedDraw unmeasured = prepared("effects: {elasticity: neo_hookean}\n");
  EXPECT_TRUE(plan_by_need(unmeasured, cache()).empty());
  EXPECT_EQ(unmeasured.effects.elasticity, sim::Elasticity::neo_hookean);
  EXPECT_THAT(test::message_of([&] { prepared("effects: {friction: off}\n"); }),
              AllOf(HasSubstr("job.yaml:12"), HasSubstr("friction")));
}

TEST_F(DrawnNeeds, TheDevicesOwnAccuracyCounts) {
  const auto job = test::write_small_draw(folder_, kJob);
  folder_.write("device.yaml", std::string(test::kDrawDevice) + "accuracy: {force_percent: 0.5}\n");
  PreparedDraw draw = prepare_draw(job);
  EXPECT_EQ(plan_by_need(draw, cache()).size(), 1u);
}

TEST_F(DrawnNeeds, ASetIsMadeByThemTheSameInShards) {
  const std::string exact = "accuracy: {height_um: 1}\n";
  const std::vector<double> fixed = forces("fixed", "");
  const std::vector<double> needed = forces("needed", exact);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NE(needed[k], fixed[k]) << "at finite strain a depth takes another force";
    EXPECT_NEAR(needed[k], fixed[k], 0.2 * fixed[k]);
  }
  forces("parts", exact, {2, 2});
  forces("parts", exact, {1, 2});
  merge(folder_.path() / "job.yaml", folder_.path() / "parts");
  EXPECT_EQ(test::contents_of(folder_.path() / "parts"), test::contents_of(folder_.path() / "needed"));
}

TEST_F(DrawnNeeds, RefusesWhatIsNoAccuracy) {
  EXPECT_THAT(test::message_of([&] { prepared("accuracy: {pixel_noise: -1}\n"); }),
              AllOf(HasSubstr("job.yaml:12"), HasSubstr("accuracy.pixel_noise")));
}

}  // namespace
}  // namespace touchstone::datasets
