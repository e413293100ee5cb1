#include "sensors/texture/texture_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <opencv2/core.hpp>

#include "core/random.h"
#include "core/whole_file.h"
#include "sensors/texture/texture_model_file.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using touchstone::test::message_of;

/// Waves of a given length along x, mm, with a little noise.
cv::Mat waves(double length_mm, std::uint64_t seed) {
  RandomStream random(seed, 0, Purpose::kTest);
  const double phase = 6.28 * random.uniform();
  cv::Mat heights(100, 100, CV_32FC1);
  for (int j = 0; j < heights.rows; ++j) {
    for (int i = 0; i < heights.cols; ++i) {
      const double wave = 0.05 * std::sin(2.0 * CV_PI * 0.03 * i / length_mm + phase);
      heights.at<float>(j, i) = static_cast<float>(wave + 0.001 * random.normal());
    }
  }
  return heights;
}

/// Features of two numbers (P = 4 on one level has six) at given angles: distances are easily seen.
TextureModel model_at(const std::vector<std::pair<double, int>>& samples) {
  TextureModel model;
  model.op = {{4, 1.0}, 1};
  model.classes = {"a", "b", "c"};
  model.features = TextureModel::Features::Zero(static_cast<Eigen::Index>(samples.size()), 6);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    model.features(static_cast<Eigen::Index>(i), 0) = static_cast<float>(std::cos(samples[i].first));
    model.features(static_cast<Eigen::Index>(i), 1) = static_cast<float>(std::sin(samples[i].first));
    model.labels.push_back(samples[i].second);
  }
  return model;
}

Eigen::VectorXf feature_at(double angle) {
  Eigen::VectorXf feature = Eigen::VectorXf::Zero(6);
  feature[0] = static_cast<float>(std::cos(angle));
  feature[1] = static_cast<float>(std::sin(angle));
  return feature;
}

TEST(TextureModel, TwoOfTheThreeNearestDecide) {
  const TextureMatch match = classify(model_at({{0.5, 0}, {0.6, 1}, {0.7, 1}, {1.5, 0}, {1.4, 0}}), feature_at(0.4));
  EXPECT_EQ(match.label, 1);
  EXPECT_EQ(match.votes, 2);
  const double chord = 2.0 * std::sin(0.05);  // to the nearest sample, which is of the other class
  EXPECT_NEAR(match.distance, chord / std::sqrt(2.0), 1e-6);
}

TEST(TextureModel, ThreeClassesAmongThreeMeanTheNearest) {
  const TextureMatch match = classify(model_at({{0.7, 0}, {0.5, 2}, {0.6, 1}, {1.5, 0}, {1.4, 0}}), feature_at(0.4));
  EXPECT_EQ(match.label, 2);
  EXPECT_EQ(match.votes, 1);
}

TEST(TextureModel, ThreeOfAKind) {
  EXPECT_EQ(classify(model_at({{0.1, 2}, {0.2, 2}, {0.3, 2}, {1.5, 0}}), feature_at(0.2)).votes, 3);
}

TEST(TextureModel, FewerThanThreeSamplesMeanTheNearest) {
  EXPECT_EQ(classify(model_at({{0.5, 1}}), feature_at(1.4)).label, 1);
  EXPECT_EQ(classify(model_at({{0.5, 1}, {1.2, 0}}), feature_at(1.4)).label, 0);
  EXPECT_EQ(classify(model_at({{0.5, 1}, {1.2, 0}}), feature_at(0.4)).label, 1);
}

TEST(TextureModel, OfEqualDistancesTheFirstIsNearer) {
  EXPECT_EQ(classify(model_at({{0.5, 2}, {0.5, 1}, {0.5, 0}}), feature_at(0.5)).label, 2);
  EXPECT_EQ(classify(model_at({{0.5, 0}, {0.5, 1}, {0.5, 2}, {0.5, 1}}), feature_at(0.5)).label, 0);
}

TEST(TextureModel, LearnsAndTellsApart) {
  TextureModel model;
  model.mm_per_px = 0.03;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    learn_texture(model, "fine", waves(0.3, seed));
    learn_texture(model, "coarse", waves(0.5, seed));
  }
  EXPECT_EQ(fault_of(model), "");
  EXPECT_THAT(model.classes, testing::ElementsAre("fine", "coarse"));
  EXPECT_THAT(model.labels, testing::ElementsAre(0, 1, 0, 1, 0, 1, 0, 1));
  for (std::uint64_t seed = 10; seed < 20; ++seed) {
    EXPECT_EQ(classify_texture(model, waves(0.3, seed), 0.03).label, 0);
    EXPECT_EQ(classify_texture(model, waves(0.5, seed), 0.0301).label, 1);
  }
  // What isn't known is further away than what is.
  const double known = classify_texture(model, waves(0.3, 30), 0.03).distance;
  EXPECT_GT(classify_texture(model, waves(0.12, 30), 0.03).distance, 3.0 * known);
}

TEST(TextureModel, RefusesWhatItCannotCompare) {
  TextureModel model;
  const cv::Mat heights = waves(0.3, 1);
  EXPECT_THAT(message_of([&] { classify_texture(model, heights, 0.0); }), HasSubstr("no sample"));
  EXPECT_THAT(message_of([&] { learn_texture(model, "", heights); }), HasSubstr("no name"));
  EXPECT_THAT(message_of([&] { learn_texture(model, "a", heights(cv::Rect(0, 0, 32, 99))); }),
              HasSubstr("at least 33 x 33"));
  EXPECT_TRUE(model.classes.empty() && model.labels.empty());
  model.mm_per_px = 0.03;
  learn_texture(model, "a", heights);
  EXPECT_THAT(message_of([&] { classify_texture(model, heights, 0.04); }), HasSubstr("trained on 0.03"));
  EXPECT_THAT(message_of([&] { classify_texture(model, heights, -1.0); }), HasSubstr("-1 mm a pixel"));
  EXPECT_EQ(classify_texture(model, heights, 0.0).label, 0);
  EXPECT_THAT(message_of([&] { classify(model, Eigen::VectorXf::Zero(40)); }), HasSubstr("40 numbers"));
}

TextureModel trained() {
  TextureModel model;
  model.op.circle = {8, 1.0};
  model.gray_step_mm = 0.1 / 3.0;
  model.mm_per_px = 0.0271;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    learn_texture(model, "a \"quoted\" name", waves(0.3, seed));
    learn_texture(model, "wood, oak", waves(0.5, seed));
  }
  return model;
}

TEST(TextureModelFile, WhatIsReadIsWhatWasWrittenBitForBit) {
  const TextureModel model = trained();
  const auto path = std::filesystem::path(testing::TempDir()) / "textures.model";
  save(model, path);
  const TextureModel read = load_texture_model(path);
  EXPECT_EQ(read.op, model.op);
  EXPECT_EQ(read.gray_step_mm, model.gray_step_mm);
  EXPECT_EQ(read.mm_per_px, model.mm_per_px);
  EXPECT_EQ(read.classes, model.classes);
  EXPECT_EQ(read.labels, model.labels);
  ASSERT_EQ(read.features.size(), model.features.size());
  EXPECT_EQ(std::memcmp(read.features.data(), model.features.data(), sizeof(float) * model.features.size()), 0);
  EXPECT_EQ(to_bytes(read), to_bytes(model));
}

TEST(TextureModelFile, AnEmptyModelCanBeKept) {
  const TextureModel read = texture_model_from_bytes(to_bytes(TextureModel{}), "empty");
  EXPECT_TRUE(read.classes.empty());
  EXPECT_EQ(read.op, TextureOperator{});
}

TEST(TextureModelFile, IsCompact) {
  TextureModel model = model_at({});
  model.op = {};
  model.labels.assign(960, 1);
  model.features = TextureModel::Features::Constant(960, 72, std::sqrt(1.0F / 72.0F));
  EXPECT_LT(to_bytes(model).size(), 280'000U);
}

TEST(TextureModelFile, RefusesFaultyFiles) {
  const std::string good = to_bytes(trained());
  const auto message = [](std::string_view bytes) {
    return message_of([&] { texture_model_from_bytes(bytes, "some.model"); });
  };
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string bytes = good;
    const std::size_t at = bytes.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return bytes.replace(at, from.size(), to);
  };
  EXPECT_EQ(message(good), "no error");
  EXPECT_THAT(message(""), StartsWith("some.model: isn't a texture model"));
  EXPECT_THAT(message("{\"format\": 1}\n"), HasSubstr("isn't a texture model"));
  EXPECT_THAT(message(changed("model 1", "model 2")), HasSubstr("version '2'"));
  EXPECT_THAT(message(good.substr(0, 40)), HasSubstr("ends within its header"));
  EXPECT_THAT(message(good.substr(0, good.size() - 1)), HasSubstr("bytes of samples"));
  EXPECT_THAT(message(good + "x"), HasSubstr("bytes of samples"));
  EXPECT_THAT(message(changed("\"levels\":4", "\"levels\":9")), HasSubstr("9 pyramid levels"));
  EXPECT_THAT(message(changed("\"levels\":4", "\"levels\":-4")), HasSubstr("levels: is -4"));
  EXPECT_THAT(message(changed("\"levels\":4", "\"level\":4")), HasSubstr("header can't be read"));
  EXPECT_THAT(message(changed("{\"classes\"", "{\"more\":1,\"classes\"")), HasSubstr("8 known fields"));
  EXPECT_THAT(message(changed("\"neighbours\":8", "\"neighbours\":1e99")), HasSubstr("neighbours"));
  EXPECT_THAT(message(changed("\"samples\":6", "\"samples\":18446744073709551615")), HasSubstr("samples: is"));
  EXPECT_THAT(message(changed("{\"classes\"", "{{{")), HasSubstr("header can't be read"));
  std::string damaged = good;
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  EXPECT_THAT(message(damaged), HasSubstr("checksum"));
  EXPECT_THAT(message_of([] { load_texture_model("/nowhere/x.model"); }), HasSubstr("/nowhere/x.model"));
}

TEST(TextureModelFile, RefusesFaultyModels) {
  const auto message = [](const auto& spoil) {
    TextureModel model = trained();
    spoil(model);
    return message_of([&] { to_bytes(model); });
  };
  EXPECT_THAT(message([](TextureModel& m) { m.labels[0] = 2; }), HasSubstr("of class 2"));
  EXPECT_THAT(message([](TextureModel& m) { m.labels[0] = -1; }), HasSubstr("of class -1"));
  EXPECT_THAT(message([](TextureModel& m) { m.labels.pop_back(); }), HasSubstr("6 features have 5 labels"));
  EXPECT_THAT(message([](TextureModel& m) { m.classes[0] = m.classes[1]; }), HasSubstr("two classes"));
  EXPECT_THAT(message([](TextureModel& m) { m.classes[0].clear(); }), HasSubstr("no name"));
  EXPECT_THAT(message([](TextureModel& m) { m.features(1, 2) = 3.0F; }), HasSubstr("sample 1"));
  EXPECT_THAT(message([](TextureModel& m) { m.features(1, 2) = std::numeric_limits<float>::quiet_NaN(); }),
              HasSubstr("sample 1"));
  EXPECT_THAT(message([](TextureModel& m) { m.op.levels = 3; }), HasSubstr("numbers"));
  EXPECT_THAT(message([](TextureModel& m) { m.gray_step_mm = 0.0; }), HasSubstr("above 0"));
  EXPECT_THAT(message([](TextureModel& m) { m.mm_per_px = -1.0; }), HasSubstr("a pixel"));
}

}  // namespace
}  // namespace touchstone::sensors
