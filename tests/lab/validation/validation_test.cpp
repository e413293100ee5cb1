#include "lab/validation/validation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "lab/validation/row_list.h"
#include "lab/validation/validation_page.h"

namespace touchstone::lab {
namespace {

std::vector<ValidationGroup> two_groups(std::vector<std::string>& ran) {
  const auto group = [&ran](const std::string& name) {
    return ValidationGroup{name, [&ran, name](const ValidateOptions& options) {
                             ran.push_back(name);
                             ValidationRow row;
                             row.id = name + ".row";
                             row.title = "A row";
                             row.unit = "N";
                             row.published = 0.1;
                             row.ours = name == "light" ? std::nan("") : 0.05;
                             row.ci95 = {0.04, 0.06};
                             row.holds = true;
                             row.quick = options.quick;
                             return std::vector<ValidationRow>{row};
                           }};
  };
  return {group("mechanics"), group("light")};
}

TEST(Validation, AllRunsEveryGroupOnce) {
  std::vector<std::string> ran;
  const auto rows = validate({"light", "all", "light"}, two_groups(ran), {});
  EXPECT_EQ(ran, (std::vector<std::string>{"mechanics", "light"}));
  EXPECT_EQ(rows.size(), 2u);
}

TEST(Validation, ASensorsNameRunsAllItsParts) {
  std::vector<std::string> ran;
  const auto group = [&ran](const std::string& name) {
    return ValidationGroup{name, [&ran, name](const ValidateOptions&) {
                             ran.push_back(name);
                             return std::vector<ValidationRow>{};
                           }};
  };
  const std::vector<ValidationGroup> known = {group("light"), group("gel.height"), group("gel.map"), group("vhs")};
  validate({"gel"}, known, {});
  EXPECT_EQ(ran, (std::vector<std::string>{"gel.height", "gel.map"}));
  ran.clear();
  validate({"gel.map"}, known, {});
  EXPECT_EQ(ran, (std::vector<std::string>{"gel.map"}));
  EXPECT_THROW(validate({"gel."}, known, {}), Error);
}

TEST(Validation, UnknownGroupNamesTheNearestAndRunsNothing) {
  std::vector<std::string> ran;
  try {
    validate({"light", "mecanics"}, two_groups(ran), {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("did you mean 'mechanics'?"));
  }
  EXPECT_TRUE(ran.empty());
}

TEST(Validation, JsonHasTheAgreedMembersInOrder) {
  std::vector<std::string> ran;
  ValidateOptions options;
  options.quick = true;
  const auto rows = validate({"all"}, two_groups(ran), options);
  const auto json = nlohmann::ordered_json::parse(to_json(rows));
  std::vector<std::string> members;
  for (const auto& [key, value] : json.at(0).items()) members.push_back(key);
  EXPECT_THAT(members, ::testing::ElementsAre("id", "title", "unit", "published", "reference", "ours", "ci95", "better",
                                              "holds", "quick", "seconds"));
  EXPECT_EQ(json.at(0).at("published"), 0.1);
  EXPECT_TRUE(json.at(0).at("reference").is_null());
  EXPECT_EQ(json.at(0).at("ci95").at(1), 0.06);
  EXPECT_EQ(json.at(0).at("quick"), true);
  EXPECT_TRUE(json.at(1).at("ours").is_null()) << "NaN isn't JSON";
}

TEST(Validation, ARowThatDeniesItsSourcesFindingDoesNotHoldHoweverGoodItsFigure) {
  const ValidationGroup group = {"light", [](const ValidateOptions& options) {
                                   RowList rows("light.", options, RowList::Since::begin);
                                   rows.add_bounded("detected_percent", "detected at 250 Hz", "%", Better::higher, 84.0,
                                                    true, 90.0);
                                   EXPECT_TRUE(rows.last().holds);
                                   deny(rows.last(), "250 Hz are too few");
                                   return rows.rows();
                                 }};
  const std::vector<ValidationRow> rows = validate({"light"}, {group}, {});
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_FALSE(rows[0].holds);
  const std::string words = "detected at 250 Hz (doesn't hold: denies the finding that 250 Hz are too few)";
  EXPECT_THAT(to_table(rows), ::testing::AllOf(::testing::HasSubstr("NO"), ::testing::HasSubstr(words)));
  const auto json = nlohmann::ordered_json::parse(to_json(rows));
  EXPECT_EQ(json.at(0).at("holds"), false);
  EXPECT_EQ(json.at(0).at("title"), words);
  EXPECT_THAT(to_markdown(rows, {"1", "p", ""}), ::testing::HasSubstr("0 of 1 rows hold."));
  EXPECT_THAT(to_markdown(rows, {"1", "p", ""}), ::testing::HasSubstr(words));
}

TEST(Validation, TableShowsEachRow) {
  std::vector<std::string> ran;
  const std::string table = to_table(validate({"all"}, two_groups(ran), {}));
  EXPECT_THAT(table, ::testing::HasSubstr("mechanics.row"));
  EXPECT_THAT(table, ::testing::HasSubstr("light.row"));
}

}  // namespace
}  // namespace touchstone::lab
