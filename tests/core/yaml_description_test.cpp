// That a struct's description is what its `fields` reads: small structs, one for each way in which fields depend on
// others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/yaml_form.h"

namespace touchstone {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Kind = YamlForm::Kind;
using Case = YamlCase::Kind;

enum class Shape { sphere, box, ring };
EnumNames<Shape> enum_names(Shape) {
  return {{"sphere", Shape::sphere}, {"box", Shape::box}, {"ring", Shape::ring}};
}

std::vector<std::string> keys(const YamlMap& map) {
  std::vector<std::string> all;
  for (const YamlField& field : map.fields) all.push_back(field.key + (field.required ? "!" : ""));
  return all;
}

const YamlField& field(const YamlMap& map, const std::string& key) {
  for (const YamlField& one : map.fields) {
    if (one.key == key) return one;
  }
  throw std::out_of_range(key);
}

YamlCase is(const YamlScalar& value) {
  return {Case::equal, value};
}
const YamlCase kAbsent{Case::absent, false};
const YamlCase kPresent{Case::present, false};

// Each kind of field, with its range and default.

struct Layer {
  double thickness_mm = 0.0;
};
void fields(YamlReader& in, Layer& layer) {
  in.required("thickness_mm", layer.thickness_mm, Allowed::above(0.0));
}

struct Plain {
  double ratio = 0.49;
  int count = 3;
  std::uint64_t seed = 0;
  bool ideal = true;
  Shape shape = Shape::box;
  std::string name;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  std::vector<double> gains;
  std::vector<Layer> layers;
  std::optional<Layer> skin;
  std::optional<double> mass;
};
void fields(YamlReader& in, Plain& plain) {
  in.required("ratio", plain.ratio, Allowed::within(0.0, 0.5));
  in.optional("count", plain.count, Allowed::at_least(1));
  in.optional("seed", plain.seed);
  in.optional("ideal", plain.ideal);
  in.optional("shape", plain.shape);
  in.required("name", plain.name);
  in.optional("at", plain.at);
  in.optional("gains", plain.gains, Allowed::above_up_to(0.0, 10.0));
  in.optional("layers", plain.layers);
  in.optional("skin", plain.skin);
  in.optional("mass", plain.mass);
}

TEST(YamlDescription, TellsEachKindOfField) {
  const auto map = describe_yaml<Plain>();
  EXPECT_FALSE(map->by.has_value()) << map->by->key;
  EXPECT_THAT(keys(*map), ElementsAre("ratio!", "count", "seed", "ideal", "shape", "name!", "at", "gains", "layers",
                                      "skin", "mass"));
  const auto form = [&](const std::string& key) {
    EXPECT_EQ(field(*map, key).forms.size(), 1u) << key;
    return field(*map, key).forms.at(0);
  };
  EXPECT_EQ(form("ratio"), (YamlForm{.kind = Kind::number, .allowed = Allowed::within(0.0, 0.5)}));
  EXPECT_EQ(form("count"), (YamlForm{.kind = Kind::integer, .allowed = Allowed::at_least(1)}));
  EXPECT_EQ(form("seed"), (YamlForm{.kind = Kind::integer, .allowed = Allowed::at_least(0)}));
  EXPECT_EQ(form("ideal"), YamlForm{.kind = Kind::boolean});
  EXPECT_EQ(form("shape"), (YamlForm{.kind = Kind::name, .names = {"sphere", "box", "ring"}}));
  EXPECT_EQ(form("name"), YamlForm{.kind = Kind::text});
  EXPECT_EQ(form("at"), (YamlForm{.kind = Kind::list, .items = {{.kind = Kind::number}}, .length = 3}));
  EXPECT_EQ(form("gains"), (YamlForm{.kind = Kind::list,
                                     .items = {{.kind = Kind::number, .allowed = Allowed::above_up_to(0.0, 10.0)}}}));
  ASSERT_EQ(form("layers").items.size(), 1u);
  EXPECT_EQ(form("layers").items[0].map, form("skin").map) << "one description for each struct";
  EXPECT_THAT(keys(*form("skin").map), ElementsAre("thickness_mm!"));

  EXPECT_EQ(field(*map, "ratio").standard, std::nullopt) << "it must be given";
  EXPECT_EQ(field(*map, "count").standard, YamlScalar(std::int64_t{3}));
  EXPECT_EQ(field(*map, "ideal").standard, YamlScalar(true));
  EXPECT_EQ(field(*map, "shape").standard, YamlScalar(std::string("box")));
  EXPECT_EQ(field(*map, "at").standard, std::nullopt);
  EXPECT_EQ(field(*map, "mass").standard, std::nullopt);
}

// Fields that depend on a name.

struct Body {
  Shape shape = Shape::sphere;
  double radius = 1.0, width = 1.0;
  std::string name;
};
void fields(YamlReader& in, Body& body) {
  in.optional("shape", body.shape);
  if (body.shape == Shape::box) {
    in.required("width", body.width);
  } else {
    in.required("radius", body.radius, Allowed::above(0.0));
  }
  in.optional("name", body.name);
}

TEST(YamlDescription, BranchesWhereANameDecides) {
  const auto map = describe_yaml<Body>();
  ASSERT_TRUE(map->by.has_value());
  EXPECT_EQ(map->by->key, "shape");
  ASSERT_EQ(map->branches.size(), 2u) << "a sphere has the fields of a ring";
  EXPECT_THAT(map->branches[0].cases, ElementsAre(kAbsent, is("sphere"), is("ring")));
  EXPECT_THAT(keys(map->branches[0].map), ElementsAre("radius!", "name"));
  EXPECT_THAT(map->branches[1].cases, ElementsAre(is("box")));
  EXPECT_THAT(keys(map->branches[1].map), ElementsAre("width!", "name"));
}

// Ranges that depend on a name.

struct Vary {
  Shape what = Shape::sphere;
  std::vector<double> values;
};
void fields(YamlReader& in, Vary& vary) {
  in.required("what", vary.what);
  in.required("values", vary.values, vary.what == Shape::ring ? Allowed::within(0.0, 0.5) : Allowed::above(0.0));
}

TEST(YamlDescription, BranchesWhereANameDecidesOnARange) {
  const auto map = describe_yaml<Vary>();
  ASSERT_EQ(map->branches.size(), 2u);
  EXPECT_EQ(field(map->branches[0].map, "values").forms.at(0).items.at(0).allowed, Allowed::above(0.0));
  EXPECT_EQ(field(map->branches[1].map, "values").forms.at(0).items.at(0).allowed, Allowed::within(0.0, 0.5));
}

// Fields that depend on whether another is there, seen by `has` or by std::optional, and on a number that is zero.

struct Surface {
  std::optional<double> radiance;
  double albedo = 0.5, vessels = 0.0, vessel_um = 10.0, power = 0.0;
  std::string spectrum;
};
void fields(YamlReader& in, Surface& surface) {
  in.optional("radiance", surface.radiance, Allowed::at_least(0.0));
  if (!surface.radiance) in.optional("albedo", surface.albedo);
}

struct Wood {
  double vessels = 0.0, vessel_um = 10.0, noise = 0.0;
};
void fields(YamlReader& in, Wood& wood) {
  in.required("vessels", wood.vessels, Allowed::at_least(0.0));
  if (wood.vessels > 0.0) in.required("vessel_um", wood.vessel_um);
  in.optional("noise", wood.noise, Allowed::at_least(0.0));
}

struct Lamp {
  std::string spectrum;
  double power = 0.0;
};
void fields(YamlReader& in, Lamp& lamp) {
  if (in.has("spectrum")) {
    in.required("spectrum", lamp.spectrum);
    in.required("power", lamp.power);
  } else {
    in.optional("power", lamp.power);
  }
}

TEST(YamlDescription, BranchesWhereAFieldsPresenceDecides) {
  const auto surface = describe_yaml<Surface>();
  ASSERT_EQ(surface->branches.size(), 2u);
  EXPECT_EQ(surface->by->key, "radiance");
  EXPECT_THAT(surface->branches[0].cases, ElementsAre(kAbsent));
  EXPECT_THAT(keys(surface->branches[0].map), ElementsAre("albedo"));
  EXPECT_THAT(keys(surface->branches[1].map), IsEmpty());

  const auto lamp = describe_yaml<Lamp>();
  ASSERT_EQ(lamp->branches.size(), 2u);
  EXPECT_EQ(lamp->by->key, "spectrum");
  EXPECT_EQ(lamp->by->forms.at(0).kind, Kind::text);
  EXPECT_THAT(keys(lamp->branches[0].map), ElementsAre("power"));
  EXPECT_THAT(lamp->branches[1].cases, ElementsAre(kPresent));
  EXPECT_THAT(keys(lamp->branches[1].map), ElementsAre("power!"));
}

TEST(YamlDescription, BranchesWhereANumberIsZero) {
  const auto wood = describe_yaml<Wood>();
  ASSERT_EQ(wood->branches.size(), 2u);
  EXPECT_EQ(wood->by->key, "vessels");
  EXPECT_TRUE(wood->by->required);
  EXPECT_THAT(wood->branches[0].cases, ElementsAre(YamlCase{Case::other, std::int64_t{0}}));
  EXPECT_THAT(keys(wood->branches[0].map), ElementsAre("vessel_um!", "noise"));
  EXPECT_THAT(wood->branches[1].cases, ElementsAre(is(std::int64_t{0})));
  EXPECT_THAT(keys(wood->branches[1].map), ElementsAre("noise"));
}

// Branches within branches.

struct Camera {
  Shape type = Shape::sphere;
  bool preset = false;
  int width = 1;
  double hole = 1.0, focal = 1.0;
};
void fields(YamlReader& in, Camera& camera) {
  in.optional("preset", camera.preset);
  camera.preset ? in.optional("width", camera.width) : in.required("width", camera.width);
  in.required("type", camera.type);
  in.required(camera.type == Shape::box ? "hole" : "focal", camera.hole);
}

TEST(YamlDescription, BranchesWithinBranches) {
  const auto map = describe_yaml<Camera>();
  ASSERT_EQ(map->branches.size(), 2u);
  EXPECT_EQ(map->by->key, "preset");
  EXPECT_THAT(map->branches[0].cases, ElementsAre(kAbsent, is(false)));
  const YamlMap& plain = map->branches[0].map;
  ASSERT_EQ(plain.branches.size(), 2u);
  EXPECT_EQ(plain.by->key, "type");
  EXPECT_THAT(keys(plain.branches[0].map), ElementsAre("width!", "focal!"));
  EXPECT_THAT(keys(plain.branches[1].map), ElementsAre("width!", "hole!"));
  EXPECT_THAT(keys(map->branches[1].map.branches.at(1).map), ElementsAre("width", "hole!"));
}

// Bounds and defaults that depend on values, and checks that refuse what was made up.

struct Film {
  double low = 0.4, high = 2.0, rim = 0.0;
};
void fields(YamlReader& in, Film& film) {
  in.optional("low", film.low, Allowed::above(0.0));
  in.optional("high", film.high, Allowed::within(film.low, 100.0));
  film.rim = film.high / 2;
  in.optional("rim", film.rim, Allowed::within(0.0, std::max(0.0, film.high - 50.0)));
  fail("no film is good enough");
}

TEST(YamlDescription, LeavesOutBoundsAndDefaultsThatDependOnValues) {
  const auto map = describe_yaml<Film>();
  ASSERT_THAT(keys(*map), ElementsAre("low", "high", "rim"));
  EXPECT_EQ(field(*map, "low").standard, YamlScalar(0.4));
  EXPECT_EQ(field(*map, "high").forms.at(0).allowed, (Allowed{.high = 100.0}));
  EXPECT_EQ(field(*map, "high").standard, YamlScalar(2.0));
  EXPECT_EQ(field(*map, "rim").forms.at(0).allowed, Allowed::at_least(0.0));
  EXPECT_EQ(field(*map, "rim").standard, std::nullopt);
}

// Values of several forms.

struct Colour {
  std::vector<double> numbers;
};
void read_value(YamlReader& in, Colour& colour, Allowed allowed) {
  if (in.is_list()) {
    colour.numbers = in.numbers(allowed);
  } else if (in.is_map()) {
    Layer layer;
    in.read_struct(layer);
  } else if (!in.text_with("#", "") && !in.text_with("", ".csv")) {
    colour.numbers = {in.number(allowed)};
  }
}
struct Painted {
  Colour colour;
};
void fields(YamlReader& in, Painted& painted) {
  in.required("colour", painted.colour, Allowed::within(0.0, 1.0));
}

TEST(YamlDescription, TellsAllFormsOfAValue) {
  const auto forms = field(*describe_yaml<Painted>(), "colour").forms;
  const YamlForm share{.kind = Kind::number, .allowed = Allowed::within(0.0, 1.0)};
  const auto has = [&](const YamlForm& form) { return std::count(forms.begin(), forms.end(), form) == 1; };
  EXPECT_EQ(forms.size(), 5u);
  EXPECT_TRUE(has(share));
  EXPECT_TRUE(has({.kind = Kind::list, .items = {share}}));
  EXPECT_TRUE(has({.kind = Kind::text, .begin = "#"}));
  EXPECT_TRUE(has({.kind = Kind::text, .end = ".csv"}));
  EXPECT_EQ(std::count_if(forms.begin(), forms.end(), [](const YamlForm& form) { return form.kind == Kind::map; }), 1);
}

// Which keys stand together; and that a reader of files refuses the same.

struct Axis {
  std::optional<double> position, force, angle;
  std::string preset;
};
void fields(YamlReader& in, Axis& axis) {
  in.optional("position", axis.position);
  in.optional("force", axis.force);
  in.optional("angle", axis.angle);
  in.exactly_one_of({"position", "force"});
  in.not_beside("angle", {"force"});
  if (in.has("preset")) axis.preset = in.required_name("preset", {"c310", "imx273"});
}

TEST(YamlDescription, TellsWhichKeysStandTogether) {
  const auto map = describe_yaml<Axis>();
  EXPECT_THAT(keys(*map), ElementsAre("position", "force", "angle", "preset"));
  EXPECT_THAT(map->rules, ElementsAre(YamlRule{YamlRule::Kind::exactly_one, {"position", "force"}},
                                      YamlRule{YamlRule::Kind::not_both, {"angle", "force"}}));
  EXPECT_EQ(field(*map, "preset").forms.at(0), (YamlForm{.kind = Kind::name, .names = {"c310", "imx273"}}));
}

TEST(YamlReader, RefusesKeysThatCannotStandTogether) {
  const auto error = [](const std::string& text) -> std::string {
    try {
      parse_yaml<Axis>(text, "f");
      return "";
    } catch (const Error& wrong) {
      return wrong.what();
    }
  };
  EXPECT_EQ(error("position: 1\nangle: 2\npreset: c310\n"), "");
  EXPECT_EQ(error("force: 1\n"), "");
  EXPECT_EQ(error("force: 1\nposition: 1\n"),
            "f:1: position and force stand here together; exactly one of position, force is needed");
  EXPECT_EQ(error("angle: 1\n"), "f:1: none of position, force stands here; exactly one is needed");
  EXPECT_EQ(error("angle: 1\npositoin: 2\n"), "f:2: unknown key 'positoin' (did you mean 'position'?)");
  EXPECT_EQ(error("force: 1\nangle: 2\n"), "f:2: angle: can't stand beside force");
  EXPECT_EQ(error("force: 1\npreset: c31\n"),
            "f:2: preset: 'c31' is not known (did you mean 'c310'?); allowed is one of: c310, imx273");
}

}  // namespace
}  // namespace touchstone
