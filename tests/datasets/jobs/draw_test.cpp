#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/transform.h"
#include "datasets/jobs/draw.h"
#include "datasets/jobs/drawn_touch.h"
#include "tests/support/message_of.h"
#include "tests/support/small_draw.h"

namespace touchstone::datasets {
namespace {

using test::message_of;
using ::testing::HasSubstr;

struct OneSpread {
  Spread spread;
};
void fields(YamlReader& in, OneSpread& one) {
  in.required("spread", one.spread, Allowed::above(0.0));
}

Spread spread_of(const std::string& text) {
  return parse_yaml<OneSpread>("spread: " + text + "\n", "job.yaml").spread;
}

struct Moments {
  double mean = 0.0, deviation = 0.0, least = INFINITY, most = -INFINITY;
};

Moments moments_of(const Spread& spread, int draws = 20000) {
  RandomStream random(5, 0, Purpose::kTest);
  Moments moments;
  double square = 0.0;
  for (int i = 0; i < draws; ++i) {
    const double value = spread.draw(random);
    moments.mean += value / draws;
    square += value * value / draws;
    moments.least = std::min(moments.least, value);
    moments.most = std::max(moments.most, value);
  }
  moments.deviation = std::sqrt(square - moments.mean * moments.mean);
  return moments;
}

TEST(Spread, DrawsHaveTheMomentsOfTheirDistribution) {
  const Moments even = moments_of(spread_of("{uniform: [2, 5]}"));
  EXPECT_NEAR(even.mean, 3.5, 0.03);
  EXPECT_NEAR(even.deviation, 3.0 / std::sqrt(12.0), 0.02);
  const Moments log = moments_of(spread_of("{log_uniform: [0.1, 10]}"));
  EXPECT_NEAR(log.mean, (10 - 0.1) / std::log(100.0), 0.08);
  EXPECT_GE(log.least, 0.1);
  EXPECT_LE(log.most, 10.0);
  const Moments normal = moments_of(spread_of("{normal: {mean: 4, deviation: 0.5}}"));
  EXPECT_NEAR(normal.mean, 4.0, 0.015);
  EXPECT_NEAR(normal.deviation, 0.5 * std::sqrt(1 - 6 * std::exp(-4.5) / std::sqrt(2 * M_PI) / 0.9973), 0.01);
  EXPECT_GE(normal.least, 2.5);
  EXPECT_LE(normal.most, 5.5);
  const Moments cut = moments_of(spread_of("{normal: {mean: 4, deviation: 0.5, within: [4, 9]}}"));
  EXPECT_NEAR(cut.mean, 4 + 0.5 * std::sqrt(2 / M_PI), 0.01);
  const Moments dice = moments_of(spread_of("{whole: [1, 6]}"));
  EXPECT_NEAR(dice.mean, 3.5, 0.05);
  EXPECT_NEAR(dice.deviation, std::sqrt(35.0 / 12.0), 0.03);
  const Moments some = moments_of(spread_of("{one_of: [1, 1, 4]}"));
  EXPECT_NEAR(some.mean, 2.0, 0.04);
  EXPECT_EQ(moments_of(spread_of("2.5"), 3).mean, 2.5);
}

TEST(Spread, MistakesAreReportedWithTheirPlace) {
  const auto error_of = [](const std::string& text) { return message_of([&] { spread_of(text); }); };
  EXPECT_THAT(error_of("{uniform: [5, 2]}"), HasSubstr("job.yaml:1: spread.uniform: from 5 to 2"));
  EXPECT_THAT(error_of("{uniform: [1]}"), HasSubstr("has 1 numbers, 2 are needed"));
  EXPECT_THAT(error_of("{uniform: [-1, 2]}"), HasSubstr("draws go from -1 to 2; allowed is above 0"));
  EXPECT_THAT(error_of("{log_uniform: [0, 2]}"), HasSubstr("0 is not allowed"));
  EXPECT_THAT(error_of("{unifrom: [1, 2]}"), HasSubstr("did you mean 'uniform'?"));
  EXPECT_THAT(error_of("{uniform: [1, 2], whole: [1, 2]}"), HasSubstr("uniform and whole stand here together"));
  EXPECT_THAT(error_of("{whole: [1, 2.5]}"), HasSubstr("both must be whole numbers"));
  EXPECT_THAT(error_of("{one_of: []}"), HasSubstr("at least one is needed"));
  EXPECT_THAT(error_of("{normal: {mean: 1, deviation: 0.1, within: [2, 3]}}"),
              HasSubstr("of the draws would fall within"));
  EXPECT_THAT(error_of("{}"), HasSubstr("none of uniform, log_uniform, whole, normal, one_of stands here"));
  EXPECT_THAT(error_of("wide"), HasSubstr("isn't a finite number"));
}

TEST(Splits, UnitsAreDealtOutByTheirShares) {
  SplitSpec spec;
  spec.share = {0.8, 0.1, 0.1};
  for (const auto& [units, train] : {std::pair{10, 8}, {20, 16}, {3, 1}, {4, 2}, {1000, 800}}) {
    const auto splits = splits_of_units(spec, 9, units);
    EXPECT_EQ(std::count(splits.begin(), splits.end(), Split::train), train) << units;
    EXPECT_EQ(std::count(splits.begin(), splits.end(), Split::test), (units - train) / 2) << units;
  }
  EXPECT_NE(splits_of_units(spec, 9, 1000), splits_of_units(spec, 10, 1000));
  spec.where = {"job.yaml", 3};
  EXPECT_THAT(message_of([&] { splits_of_units(spec, 9, 2); }), HasSubstr("job.yaml:3: splits: by unit"));
}

TEST(Splits, SamplesMeetTheirSharesAsCloselyAsChanceHasIt) {
  SplitSpec spec;
  spec.share = {0.7, 0.0, 0.3};
  int train = 0;
  for (int i = 0; i < 10000; ++i) {
    const Split split = split_of_sample(spec, 4, i);
    EXPECT_NE(split, Split::validate);
    train += split == Split::train ? 1 : 0;
  }
  EXPECT_NEAR(train, 7000, 4 * std::sqrt(10000 * 0.21));
}

class Draw : public ::testing::Test {
 protected:
  std::filesystem::path job() { return test::write_small_draw(folder_); }
  std::string error_of(const std::string& from, const std::string& to) {
    std::string text = test::kSmallDraw;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    job();
    folder_.write("job.yaml", text);
    return message_of([&] { prepare_draw(folder_.path() / "job.yaml"); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(Draw, ATouchIsAFunctionOfJobAndIndexWithinItsRanges) {
  const PreparedDraw prepared = prepare_draw(job());
  const PreparedDraw again = prepare_draw(job());
  std::int64_t next = 0;
  for (const DrawnBlock& block : prepared.blocks) {
    EXPECT_EQ(block.first_sample, next);
    next += block.samples;
    EXPECT_LE(block.samples, prepared.job.samples_per_file);
    for (std::int64_t i = block.first_sample; i < next; ++i) EXPECT_EQ(drawn_touch(prepared, i).unit, block.unit);
  }
  EXPECT_EQ(next, prepared.job.samples);
  std::set<std::uint64_t> seeds;
  for (std::int64_t i = prepared.job.samples; i-- > 0;) {
    const DrawnTouch touch = drawn_touch(prepared, i);
    const DrawnTouch same = drawn_touch(again, i);
    EXPECT_EQ(touch.seed, same.seed);
    EXPECT_EQ(touch.place_mm, same.place_mm);
    EXPECT_EQ(touch.force_N, same.force_N);
    EXPECT_TRUE(std::isnan(touch.depth_mm));
    EXPECT_GE(touch.force_N, 0.05);
    EXPECT_LE(touch.force_N, 0.3);
    EXPECT_LE(std::abs(touch.place_mm.x()), 1.5);
    EXPECT_LE(touch.tilt_deg, 5.0);
    seeds.insert(touch.seed);
    const DrawnTouch second = drawn_touch(prepared, i, 1);
    EXPECT_NE(second.seed, touch.seed);
    EXPECT_EQ(second.attempt, 1);
  }
  EXPECT_EQ(seeds.size(), static_cast<std::size_t>(prepared.job.samples));
}

TEST_F(Draw, UnitsDifferAsTheJobSaysAndInNothingElse) {
  const PreparedDraw prepared = prepare_draw(job());
  const sim::DeviceSpec design = sim::read_device(prepared.job.draw.device);
  const DrawnUnit one = drawn_unit(prepared, 0);
  const DrawnUnit other = drawn_unit(prepared, 1);
  EXPECT_NE(one.seed, other.seed);
  EXPECT_NE(one.device.gel.youngs_modulus_MPa, other.device.gel.youngs_modulus_MPa);
  EXPECT_EQ(one.device.gel.thickness_mm, design.gel.thickness_mm);
  EXPECT_NEAR(one.device.gel.youngs_modulus_MPa / design.gel.youngs_modulus_MPa, 1.0, 0.2);
  ASSERT_EQ(one.drawn.size(), 1u + 9u);
  EXPECT_EQ(one.drawn[0].first, "gel.youngs_modulus_MPa");
  EXPECT_EQ(one.drawn[0].second, one.device.gel.youngs_modulus_MPa);
}

TEST_F(Draw, PiecesKeepTheirAppearanceAndRotationsAreTurnThenTilt) {
  const PreparedDraw prepared = prepare_draw(job());
  EXPECT_EQ(drawn_object(prepared, 0, 7).shape.radius_mm, drawn_object(prepared, 0, 7).shape.radius_mm);
  EXPECT_NE(drawn_object(prepared, 0, 7).shape.radius_mm, drawn_object(prepared, 0, 8).shape.radius_mm);
  for (int i = 0; i < 5; ++i) {
    const DrawnTouch touch = drawn_touch(prepared, i);
    const Eigen::Matrix3d wanted = rotation_of(touch);
    EXPECT_NEAR(wanted(2, 2), std::cos(touch.tilt_deg * M_PI / 180), 1e-12);
    EXPECT_TRUE(rotation_from_xyz(press_of(touch).angles_deg * M_PI / 180).isApprox(wanted, 1e-12));
  }
}

TEST_F(Draw, MistakesAreReportedBeforeAnythingIsWritten) {
  EXPECT_THAT(error_of("samples: 10", "samples: 1"), HasSubstr("each unit needs one at least"));
  EXPECT_THAT(error_of("gel.youngs_modulus_MPa", "gel.youngs_modulus"),
              HasSubstr("did you mean 'youngs_modulus_MPa'?"));
  EXPECT_THAT(error_of("times: {uniform: [0.8, 1.2]}", "times: {uniform: [-2, -1]}"), HasSubstr("unit 0, as drawn: "));
  EXPECT_THAT(error_of("times: {uniform: [0.8, 1.2]}", "times: 1, plus: 2"),
              HasSubstr("times and plus stand here together"));
  EXPECT_THAT(error_of("force_N: {log_uniform: [0.05, 0.3]}", "force_N: 1\n  depth_mm: 1"),
              HasSubstr("force_N and depth_mm stand here together"));
  EXPECT_THAT(error_of("  force_N: {log_uniform: [0.05, 0.3]}\n", ""),
              HasSubstr("none of force_N, depth_mm stands here"));
  EXPECT_THAT(error_of("force_N: {log_uniform: [0.05, 0.3]}", "depth_mm: 5"), HasSubstr("is 3 mm thick"));
  EXPECT_THAT(error_of("train: 0.5", "train: 0.6"), HasSubstr("add up to 1.1"));
  EXPECT_THAT(error_of("outputs: [frame, height, contact]", "outputs: [frame, hight]"),
              HasSubstr("did you mean 'height'?"));
  EXPECT_THAT(error_of("outputs: [frame, height, contact]", "outputs: [frame, frame]"), HasSubstr("second time"));
  EXPECT_THAT(error_of("ball.yaml", "bull.yaml"), HasSubstr("there is no file"));
  EXPECT_THAT(error_of("weight: 2", "wieght: 2"), HasSubstr("did you mean 'weight'?"));
  EXPECT_THAT(error_of("set: {uniform: [1, 2]}", "set: {uniform: [-2, -1]}"),
              HasSubstr("piece 0 of object 0, as drawn: "));
  EXPECT_THAT(error_of("device: device.yaml", "device: bare.yaml"), HasSubstr("has no coating"));
}

}  // namespace
}  // namespace touchstone::datasets
