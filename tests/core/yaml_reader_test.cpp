#include "core/yaml_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/whole_file.h"
#include "tests/support/message_of.h"

namespace touchstone {
namespace {

using testing::HasSubstr;

enum class Effect { automatic, on, off };
EnumNames<Effect> enum_names(Effect) {
  return {{"auto", Effect::automatic}, {"on", Effect::on}, {"off", Effect::off}};
}

struct Effects {
  Effect friction = Effect::automatic;
};
void fields(YamlReader& in, Effects& effects) {
  in.optional("friction", effects.friction);
}

enum class Shape { sphere, box };
EnumNames<Shape> enum_names(Shape) {
  return {{"sphere", Shape::sphere}, {"box", Shape::box}};
}

struct Layer {
  double thickness_mm = 0.0;
  std::string name = "unnamed";
};
void fields(YamlReader& in, Layer& layer) {
  in.required("thickness_mm", layer.thickness_mm, Allowed::above(0.0));
  in.optional("name", layer.name);
}

struct Device {
  double ratio = 0.49;
  int count = 1;
  std::int64_t time_us = 0;
  std::uint64_t seed = 0;
  bool ideal = false;
  Shape shape = Shape::sphere;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  std::vector<double> gains;
  std::vector<Layer> layers;
  std::optional<Layer> skin;
};
void fields(YamlReader& in, Device& device) {
  in.required("poisson_ratio", device.ratio, Allowed::within(0.0, 0.5));
  in.optional("count", device.count, Allowed::at_least(1));
  in.optional("time_us", device.time_us);
  in.optional("seed", device.seed);
  in.optional("ideal", device.ideal);
  in.optional("shape", device.shape);
  in.optional("at", device.at);
  in.optional("gains", device.gains, Allowed::above_up_to(0.0, 10.0));
  in.optional("layers", device.layers);
  in.optional("skin", device.skin);
}

Device read(const std::string& text) {
  return parse_yaml<Device>(text, "device.yaml");
}

// The text's error begins with the place and has the words.
void expect_error(const std::string& text, int line, const std::vector<std::string>& words) {
  try {
    read(text);
    ADD_FAILURE() << "took:\n" << text;
  } catch (const Error& error) {
    EXPECT_EQ(error.where().line, line) << error.what();
    EXPECT_THAT(error.what(), testing::StartsWith("device.yaml"));
    for (const std::string& word : words) EXPECT_THAT(error.what(), HasSubstr(word));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n"))) << "one line";
  }
}

TEST(YamlReader, ReadsAllKindsOfFields) {
  const Device device = read(
      "# a comment\n"
      "poisson_ratio: 0.45\n"
      "count: +3\n"
      "time_us: -9000000000\n"
      "seed: 18446744073709551615\n"
      "ideal: true\n"
      "shape: box\n"
      "at: [1, -2.5, 3e-1]\n"
      "gains: [1, 10]\n"
      "layers:\n"
      "  - thickness_mm: 5\n"
      "    name: gel\n"
      "  - thickness_mm: 2.5\n"
      "skin: {thickness_mm: 0.1}\n");
  EXPECT_EQ(device.ratio, 0.45);
  EXPECT_EQ(device.count, 3);
  EXPECT_EQ(device.time_us, -9000000000);
  EXPECT_EQ(device.seed, 18446744073709551615u);
  EXPECT_TRUE(device.ideal);
  EXPECT_EQ(device.shape, Shape::box);
  EXPECT_EQ(device.at, Eigen::Vector3d(1, -2.5, 0.3));
  EXPECT_EQ(device.gains, (std::vector<double>{1, 10}));
  ASSERT_EQ(device.layers.size(), 2u);
  EXPECT_EQ(device.layers[0].name, "gel");
  EXPECT_EQ(device.layers[1].thickness_mm, 2.5);
  ASSERT_TRUE(device.skin.has_value());
  EXPECT_EQ(device.skin->thickness_mm, 0.1);
}

TEST(YamlReader, OptionalFieldsKeepTheirDefaults) {
  const Device device = read("poisson_ratio: 0\n");
  EXPECT_EQ(device.count, 1);
  EXPECT_FALSE(device.skin.has_value());
}

TEST(YamlReader, UnknownKeysAreNamedWithTheNearestKnownOne) {
  expect_error("poisson_ratio: 0.4\ncuont: 2\n", 2, {"unknown key 'cuont'", "did you mean 'count'?"});
  expect_error("poisson_ratio: 0.4\n\n\nweather: fine\n", 4, {"unknown key 'weather'"});
  expect_error("poisson_ratio: 0.4\nlayers:\n  - thickness_mm: 1\n  - thickness_mm: 1\n    nmae: x\n", 5,
               {"layers[1]", "unknown key 'nmae'", "'name'"});
}

TEST(YamlReader, MissingKeysAreNamed) {
  expect_error("count: 2\n", 1, {"'poisson_ratio' is missing"});
  expect_error("poisson_ratio: 0.4\nskin:\n  name: x\n", 3, {"skin", "'thickness_mm' is missing"});
}

TEST(YamlReader, DuplicateKeysAreRefused) {
  expect_error("poisson_ratio: 0.4\ncount: 2\npoisson_ratio: 0.3\n", 3, {"'poisson_ratio'", "second time"});
}

TEST(YamlReader, WrongKindsAreRefused) {
  expect_error("poisson_ratio: soft\n", 1, {"poisson_ratio", "'soft'", "number"});
  expect_error("poisson_ratio: [0.4]\n", 1, {"poisson_ratio", "a number is needed"});
  expect_error("poisson_ratio:\n", 1, {"poisson_ratio", "a number is needed"});
  expect_error("poisson_ratio: 0.4\ncount: 2.5\n", 2, {"count", "'2.5'", "whole number"});
  expect_error("poisson_ratio: 0.4\ncount: 2 apples\n", 2, {"count", "whole number"});
  expect_error("poisson_ratio: 0.4\ncount: +-2\n", 2, {"count", "whole number"});
  expect_error("poisson_ratio: 0.4\nseed: -1\n", 2, {"seed", "from 0 up"});
  expect_error("poisson_ratio: 0.4\nideal: yes\n", 2, {"ideal", "'yes'", "true"});
  expect_error("poisson_ratio: 0.4\nat: [1, 2]\n", 2, {"at", "has 2 numbers, 3 are needed"});
  expect_error("poisson_ratio: 0.4\nat: 1\n", 2, {"at", "a list is needed"});
  expect_error("poisson_ratio: 0.4\nskin: thick\n", 2, {"skin", "a map of fields is needed"});
  expect_error("poisson_ratio: 0.4\nshape: spher\n", 2, {"shape", "'spher'", "did you mean 'sphere'?", "box"});
  expect_error("- 1\n- 2\n", 1, {"a map of fields is needed"});
  expect_error("", 0, {"a map of fields is needed"});
}

TEST(YamlReader, NumbersOutOfRangeAreRefusedWithTheRange) {
  expect_error("count: 1\npoisson_ratio: 0.6\n", 2, {"poisson_ratio", "0.6", "from 0 to 0.5"});
  expect_error("poisson_ratio: -0.1\n", 1, {"poisson_ratio", "-0.1", "from 0 to 0.5"});
  expect_error("poisson_ratio: 0.4\nskin: {thickness_mm: 0}\n", 2, {"skin.thickness_mm", "above 0"});
  expect_error("poisson_ratio: 0.4\ngains: [1, 0]\n", 2, {"gains[1]", "above 0 to 10"});
  expect_error("poisson_ratio: 0.4\ncount: 0\n", 2, {"count", "at least 1"});
}

TEST(YamlReader, NumbersThatDoNotFitTheirTypeAreRefused) {
  expect_error("poisson_ratio: 0.4\ncount: 4294967298\n", 2, {"count", "4294967298", "2147483647"});
  expect_error("poisson_ratio: 0.4\ntime_us: 9223372036854775808\n", 2, {"time_us"});
  expect_error("poisson_ratio: 0.4\nseed: 18446744073709551616\n", 2, {"seed"});
}

TEST(YamlReader, NanAndInfinityAreRefused) {
  for (const char* bad : {"nan", ".nan", "NaN", "inf", "-.inf", "1e999"}) {
    expect_error(std::string("poisson_ratio: ") + bad + "\n", 1, {"poisson_ratio", bad});
  }
}

TEST(YamlReader, WhatIsNotYamlIsRefusedWithTheLine) {
  expect_error("poisson_ratio: 0.4\nat: [1, 2\ncount: }\n", 3, {"isn't YAML"});
  expect_error("poisson_ratio: 0.4\n---\npoisson_ratio: 0.3\n", 3, {"second document"});
  expect_error(std::string(100000, '['), 1, {"isn't YAML"});
  expect_error(", a\n", 1, {"second document"});  // one that YAML::LoadAll makes endlessly many of
}

TEST(YamlReader, LargeOnesAreRefusedBeforeTheyAreRead) {
  const std::string large = "count: 1" + std::string(4'000'000, ' ');
  const std::string refusal = "has 4000008 bytes; a YAML file may have 4000000";
  const auto path = std::filesystem::path(testing::TempDir()) / "touchstone_large.yaml";
  write_whole_file(path, large);
  EXPECT_EQ(test::message_of([&] { YamlReader::open(path); }), path.string() + ": " + refusal);
  EXPECT_EQ(test::message_of([&] { YamlReader::parse(large, "text"); }), "text: " + refusal);
  std::filesystem::remove(path);
}

TEST(YamlReader, RangesSayThemselves) {
  EXPECT_EQ(Allowed::above(0.0).text(), "above 0");
  EXPECT_EQ(Allowed::at_least(1.0).text(), "at least 1");
  EXPECT_EQ(Allowed::within(0.0, 0.5).text(), "from 0 to 0.5");
  EXPECT_EQ(Allowed::above_up_to(0.0, 1.0).text(), "above 0 to 1");
  EXPECT_EQ(Allowed::any().text(), "a finite number");
  EXPECT_FALSE(Allowed::above(0.0).holds(0.0));
  EXPECT_TRUE(Allowed::at_least(0.0).holds(0.0));
  EXPECT_TRUE(Allowed::above_up_to(0.0, 1.0).holds(1.0));
}

TEST(YamlReader, FilesAreReadAndNamed) {
  const auto path = std::filesystem::path(testing::TempDir()) / "touchstone_yaml_test.yaml";
  write_whole_file(path, "poisson_ratio: 0.4\n");
  EXPECT_EQ(read_yaml<Device>(path).ratio, 0.4);
  EXPECT_EQ(YamlReader::open(path).folder(), path.parent_path());
  write_whole_file(path, "count: 1\npoisson_ratio: 7\n");
  try {
    read_yaml<Device>(path);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::StartsWith(path.string() + ":2: "));
  }
  std::filesystem::remove(path);
  EXPECT_THROW(read_yaml<Device>(path), Error);
}

TEST(YamlReader, OnAndOffMayHaveBecomeTruthValues) {
  EXPECT_EQ(parse_yaml<Effects>("friction: off", "a").friction, Effect::off);
  EXPECT_EQ(parse_yaml<Effects>("friction: false", "a").friction, Effect::off);
  EXPECT_EQ(parse_yaml<Effects>("{\"friction\": true}", "a").friction, Effect::on);
  EXPECT_THAT(test::message_of([] { parse_yaml<Effects>("friction: no", "a"); }), HasSubstr("'no' is not known"));
  EXPECT_THAT(test::message_of([] { parse_yaml<Device>("poisson_ratio: 0.1\nshape: false", "a"); }),
              HasSubstr("'false' is not known"));
}

TEST(YamlReader, ValuesAndKeysMustBeUtf8AndCommentsNeedNot) {
  EXPECT_EQ(parse_yaml<Layer>("# 5 \xb5m\nthickness_mm: 1 # \xff\nname: k\xc3\xb6rper", "a").name, "k\xc3\xb6rper");
  EXPECT_THAT(test::message_of([] { parse_yaml<Layer>("thickness_mm: 1\nname: k\xf6rper", "a.yaml"); }),
              testing::AllOf(HasSubstr("a.yaml:2: name: '"), HasSubstr("isn't UTF-8; save the file as UTF-8")));
  EXPECT_THAT(test::message_of([] { parse_yaml<Layer>("thickness_mm: 1\nn\xe4me: x", "a.yaml"); }),
              HasSubstr("a.yaml:2:"));
  EXPECT_EQ(parse_yaml<Layer>("\xef\xbb\xbfthickness_mm: 1\r\nname: x\r\n", "a").name, "x");
}

}  // namespace
}  // namespace touchstone
