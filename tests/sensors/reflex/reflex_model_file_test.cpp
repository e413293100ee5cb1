// Files of the models that the estimators of [Knoop2013] make: reflex and explore mode.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "sensors/reflex/explore_model.h"
#include "sensors/reflex/reflex_model.h"
#include "tests/sensors/models/resealed_json.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using test::resealed;
using testing::HasSubstr;
using Json = nlohmann::json;

ReflexModel some_reflex() {
  ReflexModel model;
  model.tree.nodes.resize(3);
  model.tree.nodes[0] = {ChipFeature::maximum, 37.0, 1, 2, false};
  model.tree.nodes[1].force_present = true;
  model.force.coefficients = {-10.0, 0.1, 1.0 / 3.0, 0.0, 2.0 / 3.0};
  model.force.rms_residual_N = 0.65;
  model.shear = ShearLaw{Eigen::Matrix2d::Identity() * 0.01, Eigen::Matrix2d::Constant(1.0 / 7.0), 0.1};
  return model;
}

ExploreModel some_explore() {
  ExploreModel model;
  model.press = {2, {16.03, 1.0 / 3.0, 0.0}, 0.39};
  model.force = {1.1293, 0.4677, 0.14};
  model.lateral_mm_per_px << 0.65, 0.01, -0.01, 1.9 / 3.0;
  model.shear = ShearLaw{Eigen::Matrix2d::Identity() * 0.8, Eigen::Matrix2d::Constant(1.0 / 7.0), 0.1};
  return model;
}

TEST(ReflexModelFile, WhatIsReadIsWhatWasWrittenBitForBit) {
  const auto path = std::filesystem::path(testing::TempDir()) / "reflex_model.json";
  ReflexModel model = some_reflex();
  save(model, path);
  const ReflexModel read = load_reflex_model(path);
  EXPECT_EQ(to_json(read), to_json(model));
  EXPECT_EQ(read.force.coefficients, model.force.coefficients);
  EXPECT_EQ(read.shear->stiffness, model.shear->stiffness);
  EXPECT_EQ(read.shear->per_N, model.shear->per_N);
  EXPECT_THAT(to_json(model), HasSubstr("MAX > 37"));
  model.shear.reset();
  EXPECT_FALSE(reflex_model_from_json(to_json(model), "m").shear);
}

TEST(ExploreModelFile, WhatIsReadIsWhatWasWrittenBitForBit) {
  const auto path = std::filesystem::path(testing::TempDir()) / "explore_model.json";
  ExploreModel model = some_explore();
  save(model, path);
  const ExploreModel read = load_explore_model(path);
  EXPECT_EQ(to_json(read), to_json(model));
  EXPECT_EQ(read.press.mm, model.press.mm);
  EXPECT_EQ(read.lateral_mm_per_px, model.lateral_mm_per_px);
  EXPECT_EQ(read.shear->per_N, model.shear->per_N);
  const DotsMotion motion{1.3, {0.5, -0.25}};
  EXPECT_EQ(estimate(read, motion).shear_N, estimate(model, motion).shear_N);
  model.shear.reset();
  EXPECT_FALSE(explore_model_from_json(to_json(model), "m").shear);
}

using Changes = std::vector<std::pair<std::function<void(Json&)>, std::string>>;

TEST(ReflexModelFile, WhatDoesNotFitIsNamed) {
  const std::string text = to_json(some_reflex());
  const Changes changes = {
      {[](Json& j) { j["version"] = 2; }, "version"},
      {[](Json& j) { j["format"] = "touchstone.explore_model"; }, "format"},
      {[](Json& j) { j["extra"] = 1; }, "'extra' isn't known"},
      {[](Json& j) { j["tree"] = 1; }, "tree: is a number"},
      {[](Json& j) { j["tree"] = Json::array(); }, "no node"},
      {[](Json& j) { j["tree"][0]["above"] = 0; }, "tree[0].above"},
      {[](Json& j) { j["tree"][0]["above"] = 3; }, "node 0 leads to node 3"},
      {[](Json& j) { j["tree"][0]["feature"] = "DX"; }, "tree[0].feature"},
      {[](Json& j) { j["tree"][0]["threshold"] = 37.5; }, "whole number"},
      {[](Json& j) { j["tree"][1]["force_present"] = "yes"; }, "true or false"},
      {[](Json& j) { j["force"]["degree"] = 3; }, "force.degree"},
      {[](Json& j) { j["force"]["coefficients_N"].erase(0); }, "has 14 entries"},
      {[](Json& j) { j["shear"]["rms_residual_N"] = -1; }, "shear.rms_residual_N"},
      {[](Json& j) {
         j["shear"]["N_per_count"] = Json::array({1, 2, 3});
       },
       "shear.N_per_count"},
  };
  for (const auto& [change, what] : changes) {
    EXPECT_THAT(message_of([&] { reflex_model_from_json(resealed(text, change), "m.json"); }),
                testing::AllOf(HasSubstr("m.json"), HasSubstr(what)));
  }
}

TEST(ExploreModelFile, WhatDoesNotFitIsNamed) {
  const std::string text = to_json(some_explore());
  const Changes changes = {
      {[](Json& j) { j["version"] = 2; }, "version"},
      {[](Json& j) { j.erase("press"); }, "'press' is missing"},
      {[](Json& j) {
         j["press"]["mm"] = Json::array({1, 2, 3, 4});
       },
       "has 4 entries"},
      {[](Json& j) { j["press"]["mm"] = Json::array(); }, "press.mm: is empty"},
      {[](Json& j) { j["force"]["scale_N"] = 0.0; }, "above 0"},
      {[](Json& j) { j["force"]["rate_per_mm"] = "fast"; }, "force.rate_per_mm"},
      {[](Json& j) { j["lateral_mm_per_px"][1] = Json::array({1}); }, "lateral_mm_per_px[1]"},
      {[](Json& j) { j["shear"]["per_mm"][0][0] = nullptr; }, "shear.per_mm[0]"},
  };
  for (const auto& [change, what] : changes) {
    EXPECT_THAT(message_of([&] { explore_model_from_json(resealed(text, change), "m.json"); }),
                testing::AllOf(HasSubstr("m.json"), HasSubstr(what)));
  }
}

TEST(ReflexModelFile, CutOrChangedItIsAnError) {
  for (const std::string& text : {to_json(some_reflex()), to_json(some_explore())}) {
    const auto read = [&](const std::string& bytes) {
      if (text.find("explore") != std::string::npos) {
        explore_model_from_json(bytes, "m.json");
      } else {
        reflex_model_from_json(bytes, "m.json");
      }
    };
    EXPECT_NO_THROW(read(text));
    for (std::size_t length = 0; length + 3 < text.size(); length += 17) {
      EXPECT_THROW(read(text.substr(0, length)), Error) << length;
    }
    std::string other = text;
    other.replace(other.find("0.1"), 3, "0.2");
    EXPECT_THAT(message_of([&] { read(other); }), HasSubstr("checksum"));
  }
}

TEST(ReflexModelFile, AModelWithAFaultIsNotWritten) {
  const auto reflex_with = [](const std::function<void(ReflexModel&)>& change) {
    ReflexModel model = some_reflex();
    change(model);
    return message_of([&] { to_json(model); });
  };
  EXPECT_THAT(reflex_with([](ReflexModel& m) { m.force.degree = 5; }), HasSubstr("degree is 5"));
  EXPECT_THAT(reflex_with([](ReflexModel& m) { m.force.coefficients[2] = std::nan(""); }), HasSubstr("coefficients"));
  EXPECT_THAT(reflex_with([](ReflexModel& m) { m.shear->per_N(0, 1) = std::nan(""); }), HasSubstr("shear law"));
  EXPECT_THAT(reflex_with([](ReflexModel& m) { m.shear->rms_residual_N = -1.0; }), HasSubstr("residual"));
  const auto explore_with = [](const std::function<void(ExploreModel&)>& change) {
    ExploreModel model = some_explore();
    change(model);
    return message_of([&] { to_json(model); });
  };
  EXPECT_THAT(explore_with([](ExploreModel& m) { m.press.terms = 4; }), HasSubstr("4 terms"));
  EXPECT_THAT(explore_with([](ExploreModel& m) { m.press.terms = 1; }), HasSubstr("beyond its terms"));
  EXPECT_THAT(explore_with([](ExploreModel& m) { m.press.mm[0] = std::nan(""); }), HasSubstr("finite"));
  EXPECT_THAT(explore_with([](ExploreModel& m) { m.press.rms_residual_mm = std::nan(""); }), HasSubstr("residual"));
  EXPECT_THAT(explore_with([](ExploreModel& m) { m.force.rate_per_mm = 0.0; }), HasSubstr("above 0"));
  EXPECT_THAT(explore_with([](ExploreModel& m) { m.lateral_mm_per_px(0, 0) = std::nan(""); }), HasSubstr("lateral"));
  EXPECT_THAT(explore_with([](ExploreModel& m) { m.shear->stiffness(0, 0) = std::nan(""); }), HasSubstr("shear law"));
}

}  // namespace
}  // namespace touchstone::sensors
