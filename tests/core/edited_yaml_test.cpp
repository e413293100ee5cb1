#include "core/edited_yaml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include <string>
#include <utility>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

using test::message_of;
using ::testing::HasSubstr;

TEST(EditedYaml, ChangesNumbersAndLeavesTheRestAsItIs) {
  const std::string text =
      "a: 1.5   # first\nlamps:\n  - {power: [1, 2e-1], name: x}\n  - {power: [3, 4], name: y}\nb: {c: +7}\n";
  const auto each = find_yaml_numbers(text, "t", "lamps[*].power", {});
  ASSERT_EQ(each.size(), 2u);
  ASSERT_EQ(each[1].size(), 2u);
  EXPECT_EQ(each[1][1].path, "lamps[1].power[1]");
  EXPECT_EQ(each[0][1].value, 0.2);
  EXPECT_EQ(find_yaml_numbers(text, "t", "lamps[*].power[*]", {}).size(), 4u);
  const YamlNumber first = find_yaml_numbers(text, "t", "a", {})[0][0];
  const YamlNumber last = find_yaml_numbers(text, "t", "b.c", {})[0][0];
  EXPECT_EQ(
      with_yaml_numbers(text, {{last, -0.1}, {first, 2.0}, {each[1][0], 30.25}}),
      "a: 2   # first\nlamps:\n  - {power: [1, 2e-1], name: x}\n  - {power: [30.25, 4], name: y}\nb: {c: -0.1}\n");
}

TEST(EditedYaml, PathsThatLeadNowhereAreReported) {
  const std::string text =
      "gel: {thickness_mm: 3}\nlist: [1, 2]\nword: soft\nquoted: '3'\na: &x [5]\nb: *x\nc: &y 5\nd: *y\n";
  const auto error_of = [&](const std::string& path) {
    return message_of([&] { find_yaml_numbers(text, "device.yaml", path, {"job.yaml", 7}); });
  };
  EXPECT_THAT(error_of("gel.thicknes_mm"), HasSubstr("job.yaml:7: path 'gel.thicknes_mm'"));
  EXPECT_THAT(error_of("gel.thicknes_mm"), HasSubstr("did you mean 'thickness_mm'?"));
  EXPECT_THAT(error_of("list[2]"), HasSubstr("has 2 items"));
  EXPECT_THAT(error_of("gel[0]"), HasSubstr("isn't a list"));
  EXPECT_THAT(error_of("word"), HasSubstr("isn't a number"));
  EXPECT_THAT(error_of("quoted"), HasSubstr("plain number"));
  EXPECT_THAT(error_of("b"), HasSubstr("shared by an alias"));
  EXPECT_THAT(error_of("d"), HasSubstr("plain number"));
  EXPECT_THAT(error_of("d"), HasSubstr("plain number"));
  EXPECT_THAT(error_of("gel"), HasSubstr("isn't a number"));
  EXPECT_THAT(error_of("list[x]"), HasSubstr("brackets"));
  EXPECT_THAT(error_of(""), HasSubstr("is empty"));
}

/// A number under `depth` keys k, and the path to it.
std::pair<std::string, std::string> nested(int depth) {
  std::string text;
  std::string path;
  for (int k = 0; k < depth; ++k) {
    text += "{k: ";
    path += k == 0 ? "k" : ".k";
  }
  text += "1.5" + std::string(static_cast<std::size_t>(depth), '}');
  return {text, path};
}

TEST(EditedYaml, WhatStandsTooDeepIsRefused) {
  const auto [deep, deep_path] = nested(64);
  EXPECT_EQ(find_yaml_numbers(deep, "device.yaml", deep_path, {})[0][0].value, 1.5);
  for (const int depth : {65, 70, 200}) {
    const auto whole = nested(depth);
    const std::string error = message_of([&] {
      find_yaml_numbers(whole.first, "device.yaml", whole.second, {"job.yaml", 7});
    });
    EXPECT_THAT(error, HasSubstr("job.yaml:7: path 'k.k")) << depth;
    EXPECT_THAT(error, HasSubstr("more than 64 keys and lists deep")) << depth;
  }
  // Lists below the path count, too.
  const std::string lists = "k: " + std::string(70, '[') + "1" + std::string(70, ']');
  EXPECT_THAT(message_of([&] { find_yaml_numbers(lists, "device.yaml", "k", {}); }), HasSubstr("more than 64"));
  EXPECT_THAT(message_of([&] { find_yaml_numbers("k: &x [*x]", "device.yaml", "k", {}); }), HasSubstr("holds itself"));
}

TEST(EditedYaml, FilesAreNamedFromAnotherFolderOn) {
  test::TemporaryFolder folder;
  namespace fs = std::filesystem;
  fs::create_directories(folder.path() / "devices/maps");
  fs::create_directories(folder.path() / "o'ut/fit");
  for (const char* file : {"devices/rest.png", "devices/maps/a b.yaml", "devices/name"}) folder.write(file, "");
  const std::string text =
      "name: name               # a file without a dot isn't meant\n"
      "background: rest.png     # of the unit\n"
      "residual: \"maps/a b.yaml\"\n"
      "lamps: [{spectrum: {file: missing.csv}}, &x {pattern: maps/../rest.png}, *x]\n"
      "whole: " +
      (folder.path() / "devices/rest.png").string() + "\n";
  const std::string moved = with_yaml_files_from(text, folder.path() / "devices", folder.path() / "o'ut/fit");
  EXPECT_EQ(moved,
            "name: name               # a file without a dot isn't meant\n"
            "background: '../../devices/rest.png'     # of the unit\n"
            "residual: '../../devices/maps/a b.yaml'\n"
            "lamps: [{spectrum: {file: missing.csv}}, &x {pattern: '../../devices/rest.png'}, *x]\n"
            "whole: " +
                (folder.path() / "devices/rest.png").string() + "\n");
  // Back again, from a folder with a quote in its name.
  folder.write("o'ut/rest.png", "");
  EXPECT_EQ(with_yaml_files_from("a: rest.png\n", folder.path() / "o'ut", folder.path() / "devices"),
            "a: '../o''ut/rest.png'\n");
  EXPECT_EQ(with_yaml_files_from("a: [x.y, 0.25]\n", folder.path() / "devices", folder.path()), "a: [x.y, 0.25]\n");
}

}  // namespace
}  // namespace touchstone
