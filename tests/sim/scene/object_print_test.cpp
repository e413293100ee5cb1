// What is printed on objects: files, marks, pictures, skins, and what a camera is handed of them.

#include "sim/scene/object_print.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/cie_colour.h"
#include "sim/files/image_file.h"
#include "sim/files/srgb_reflectance.h"
#include "sim/plan/plan.h"
#include "sim/scene/object.h"
#include "sim/view/visible_scene.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using test::message_of;
using ::testing::HasSubstr;

const std::filesystem::path kScenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";

SceneBands grey_band() {
  SceneBands bands;
  bands.centres_nm = render::Spectrum::Constant(1, 550.0);
  return bands;
}

ObjectSpec object_with(const std::string& print) {
  return parse_yaml<ObjectSpec>("name: card\nshape: {type: box, size_mm: [20, 20, 2]}\nalbedo: 0.8\nprint:\n" + print,
                                "object.yaml");
}

render::Print printed(const ObjectSpec& object, const ContactPressure* pressure = nullptr) {
  return object_print(ready_print(object.print), grey_band(), object.albedo, pressure);
}

TEST(SrgbReflectance, LooksUnderD65AsItsNumbersSay) {
  for (const double r : {0.0, 0.2, 1.0}) {
    for (const double g : {0.0, 0.5, 1.0}) {
      for (const double b : {0.0, 0.7, 1.0}) {
        const Eigen::Vector3d srgb(r, g, b);
        const render::SpectralCurve curve = srgb_reflectance(srgb);
        const Eigen::Vector3d xyz = xyz_from_linear_srgb(linear_from_srgb(srgb));
        EXPECT_NEAR((xyz_under_d65(curve) - xyz).norm(), 0.0, 1e-6) << srgb.transpose();
        for (const double value : curve.values) {
          EXPECT_GE(value, 0.0);
          EXPECT_LE(value, 1.0);
        }
      }
    }
  }
}

TEST(SrgbReflectance, SingleInksAreMetamersOfHalftones) {
  const Eigen::Vector3d srgb(0.7, 0.4, 0.3);
  const render::SpectralCurve ink = single_ink_reflectance(srgb);
  const render::SpectralCurve halftone = srgb_reflectance(srgb);
  EXPECT_NEAR((xyz_under_d65(ink) - xyz_under_d65(halftone)).norm(), 0.0, 1e-6);
  double largest = 0.0;
  for (double nm = 420; nm <= 680; nm += 5) largest = std::max(largest, std::abs(ink.at(nm) - halftone.at(nm)));
  EXPECT_GT(largest, 0.02);
}

TEST(SrgbReflectance, SharesMakeOne) {
  double sum = 0.0;
  for (const double share : corner_shares({0.3, 0.9, 0.1})) sum += share;
  EXPECT_NEAR(sum, 1.0, 1e-15);
}

TEST(Colour, MayBeAnSrgbColour) {
  const ObjectSpec red =
      parse_yaml<ObjectSpec>("name: red\nshape: {type: sphere, radius_mm: 1}\nalbedo: '#ff0000'\n", "object.yaml");
  SceneBands bands;
  bands.centres_nm = Eigen::Array3d(610, 540, 455);
  const render::Spectrum seen = in_bands(red.albedo, bands, "albedo");
  EXPECT_GT(seen[0], 0.9);
  EXPECT_LT(seen[1], 0.1);
  EXPECT_LT(seen[2], 0.1);
  const auto error = [](const std::string& fields) {
    return message_of(
        [&] { parse_yaml<ObjectSpec>("name: a\nshape: {type: sphere, radius_mm: 1}\n" + fields, "object.yaml"); });
  };
  EXPECT_THAT(error("albedo: '#ff00'\n"), HasSubstr("albedo: is '#ff00'; an sRGB colour is # and six"));
  EXPECT_THAT(error("albedo: '#ff00gg'\n"), HasSubstr("six hexadecimal digits"));
  EXPECT_THAT(error("radiance: '#ff0000'\n"), HasSubstr("only what reflects"));
}

TEST(ObjectPrint, ShippedCardsRead) {
  EXPECT_EQ(read_object(kScenes / "objects/steel-rule.yaml").print.size(), 1u);
  EXPECT_EQ(read_object(kScenes / "objects/hue-circle.yaml").print.size(), 2u);
  EXPECT_TRUE(depends_on_pressure(read_object(kScenes / "objects/skin.yaml").print));
  EXPECT_FALSE(depends_on_pressure(read_object(kScenes / "objects/steel-rule.yaml").print));
}

TEST(ObjectPrint, RuleIsLinesOfItsPitch) {
  const render::Print print =
      printed(object_with("  - {type: rule, ink: 0.05, scales: [{pitch_mm: 0.5, width_mm: 0.1, length_mm: 2, count: 3, "
                          "from_mm: [-1, 1]}]}\n"));
  ASSERT_EQ(print.marks.size(), 3u);
  const render::PrintIndex index(print.marks);
  EXPECT_EQ(index.mark_at({-1.04, 2.9}), 0);
  EXPECT_EQ(index.mark_at({-0.5, 1.1}), 1);
  EXPECT_EQ(index.mark_at({0.04, 1.1}), 2);
  EXPECT_EQ(index.mark_at({-0.75, 2}), -1);
  EXPECT_EQ(index.mark_at({-1, 3.1}), -1);
  EXPECT_DOUBLE_EQ(print.inks[0][0], 0.05);
}

TEST(ObjectPrint, HueCircleHasItsHuesInOrder) {
  HueCirclePrint circle;
  circle.patches = 3;
  circle.radius_mm = 4;
  circle.diameter_mm = 1;
  circle.centre_mm = {1, 0};
  EXPECT_NEAR((disc_srgb(circle, 1) - Eigen::Vector3d(0, 1, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((disc_centre(circle, 0) - Eigen::Vector2d(5, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((disc_centre(circle, 1) - Eigen::Vector2d(-1, 2 * std::sqrt(3.0))).norm(), 0.0, 1e-12);
}

TEST(ObjectPrint, SpecksAreTheSameForASeedAndStayInTheirPlace) {
  const auto specks = [](int seed) {
    return printed(object_with("  - {type: specks, count: 200, diameters_mm: [0.3, 0.5], size_mm: [8, 6], centre_mm: "
                               "[1, 2], seed: " +
                               std::to_string(seed) + "}\n"))
        .marks;
  };
  const auto first = specks(1);
  ASSERT_EQ(first.size(), 200u);
  int wide = 0;
  for (const render::PrintedMark& mark : first) {
    EXPECT_LE(std::abs(mark.centre.x() - 1), 4.0);
    EXPECT_LE(std::abs(mark.centre.y() - 2), 3.0);
    EXPECT_TRUE(mark.half_width == 0.15 || mark.half_width == 0.25);
    wide += mark.half_width == 0.25 ? 1 : 0;
  }
  EXPECT_NEAR(wide, 100, 4 * std::sqrt(50.0));
  EXPECT_EQ(specks(1)[7].centre, first[7].centre);
  EXPECT_NE(specks(2)[7].centre, first[7].centre);
}

// Upper left of the file is at -x, -y: where a device's camera has its upper left.
TEST(ObjectPrint, ImageLiesAsADeviceSeesIt) {
  const test::TemporaryFolder folder;
  cv::Mat picture(2, 4, CV_8UC3, cv::Scalar(255, 255, 255));
  picture.at<cv::Vec3b>(0, 0) = {0, 0, 0};
  picture.at<cv::Vec3b>(1, 3) = {0, 255, 0};  // green
  write_png(folder.path() / "card.png", picture);
  ObjectSpec object = object_with("  - {type: image, file: card.png, size_mm: [8, 4]}\n");
  std::get<ImagePrint>(object.print[0].kind).file = folder.path() / "card.png";
  const render::Print print = printed(object);
  ASSERT_TRUE(print.picture);
  EXPECT_NEAR(*print.picture->at({-3, -1}), 0.0, 1e-6);
  EXPECT_NEAR(*print.picture->at({-1, -1}), 1.0, 1e-6);
  EXPECT_GT(*print.picture->at({3.9, 1.9}), 0.8);  // at 550 nm
  EXPECT_EQ(print.picture->at({4.1, 1}), nullptr);
  EXPECT_EQ(print.picture->at({std::nan(""), 1}), nullptr);
  write_png(folder.path() / "large.png", cv::Mat(4001, 4000, CV_8UC1, cv::Scalar(9)));
  std::get<ImagePrint>(object.print[0].kind).file = folder.path() / "large.png";
  EXPECT_THAT(message_of([&] { ready_print(object.print); }), HasSubstr("4000 x 4001 pixels; at most 16000000"));
  std::get<ImagePrint>(object.print[0].kind).file = folder.path() / "no.png";
  EXPECT_THAT(message_of([&] { ready_print(object.print); }), HasSubstr("object.yaml:5: print.file"));
}

TEST(ObjectPrint, MistakesAreRefusedByName) {
  const auto error = [](const std::string& print) { return message_of([&] { object_with(print); }); };
  EXPECT_THAT(error("  - {type: rules}\n"), HasSubstr("rule"));
  EXPECT_THAT(error("  - {type: rule, scales: []}\n"), HasSubstr("scales: there is none"));
  EXPECT_THAT(
      error("  - {type: rule, scales: [{pitch_mm: 0.5, width_mm: 0.6, length_mm: 2, count: 3, from_mm: [0, 0]}]}\n"),
      HasSubstr("width_mm"));
  EXPECT_THAT(error("  - {type: specks, count: 2, diameters_mm: [], size_mm: [1, 1]}\n"),
              HasSubstr("diameters_mm: there is none"));
  EXPECT_THAT(error("  - {type: hue_circle, radius_mm: 2, diameter_mm: 1, lightness: 2}\n"), HasSubstr("from 0 to 1"));
  EXPECT_THAT(error("  - {type: skin, patches: []}\n"), HasSubstr("patches: there is none"));
  const std::string patch = "patches: [{kind: purpura, centre_mm: [0, 0], diameter_mm: 2, colour: 0.3}]";
  EXPECT_THAT(error("  - {type: skin, " + patch + ", venule_kPa: 5}\n"), HasSubstr("venule_kPa: 5; it must be below"));
  EXPECT_THAT(error("  - {type: skin, " + patch + ", pixel_mm: 1e-4}\n"), HasSubstr("pixel_mm: 0.0001 makes"));
  EXPECT_THAT(
      error("  - {type: specks, count: 1, diameters_mm: [1], size_mm: [1, 1]}\n  - {type: skin, " + patch + "}\n"),
      HasSubstr("layer 2 is a picture"));
  EXPECT_THAT(message_of([] {
                parse_yaml<ObjectSpec>("name: a\nshape: {type: sphere, radius_mm: 1}\nradiance: 1\nprint: []\n",
                                       "o.yaml");
              }),
              HasSubstr("print"));
}

TEST(SkinPrint, VesselsCloseBetweenTheirPressures) {
  const SkinPrint skin;
  EXPECT_EQ(open_share(skin, 0.0), 1.0);
  EXPECT_EQ(open_share(skin, 1.6), 1.0);
  EXPECT_NEAR(open_share(skin, 0.5 * (1.6 + 4.27)), 0.5, 1e-12);
  EXPECT_EQ(open_share(skin, 4.27), 0.0);
  EXPECT_EQ(open_share(skin, 50.0), 0.0);
}

/// One pressure over x from -10 to `edge`, none beyond.
ContactPressure pressed_left_of(double edge, double kPa) {
  ContactPressure pressure;
  pressure.places = {{-10, -10}, {edge, -10}, {edge, 10}, {-10, 10}};
  pressure.kPa.assign(4, kPa);
  pressure.triangles = {{0, 1, 2}, {0, 2, 3}};
  return pressure;
}

TEST(SkinPrint, PressureTakesErythemaAwayAndLeavesPurpura) {
  const ObjectSpec skin = object_with(
      "  - {type: skin, patches: [{kind: erythema, centre_mm: [-3, 0], diameter_mm: 4, colour: 0.4}, {kind: purpura, "
      "centre_mm: [3, 0], diameter_mm: 4, colour: 0.3}]}\n");
  const auto seen = [&](const ContactPressure* pressure, double x) {
    return *printed(skin, pressure).picture->at({x, 0.01});
  };
  EXPECT_NEAR(seen(nullptr, -3), 0.4, 1e-6);
  EXPECT_NEAR(seen(nullptr, 3), 0.3, 1e-6);
  EXPECT_NEAR(seen(nullptr, 0), 0.8, 1e-6);
  const ContactPressure all = pressed_left_of(10, 8.0);
  EXPECT_NEAR(seen(&all, -3), 0.8, 1e-6);
  EXPECT_NEAR(seen(&all, 3), 0.3, 1e-6);
  const ContactPressure half = pressed_left_of(-3, 0.5 * (1.6 + 4.27));
  EXPECT_NEAR(seen(&half, -3.5), 0.6, 1e-6);  // half of the vessels
  EXPECT_NEAR(seen(&half, -2.5), 0.4, 1e-6);
}

TEST(ContactPressure, IsLinearOverATriangleAndNoneBesideIt) {
  ContactPressure pressure;
  pressure.places = {{0, 0}, {4, 0}, {0, 4}};
  pressure.kPa = {1, 5, 9};
  pressure.triangles = {{0, 1, 2}};
  const std::vector<double> grid = pressure.on_grid({-1, -1}, 1.0, 6, 6);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      const Eigen::Vector2d at(column - 0.5, row - 0.5);
      const bool inside = at.minCoeff() >= 0.0 && at.sum() <= 4.0;
      EXPECT_NEAR(grid[static_cast<std::size_t>(6 * row + column)], inside ? 1 + at.x() + 2 * at.y() : 0.0, 1e-12);
    }
  }
  pressure.places = {{0, 0}, {1, 1}, {2, 2}};  // edge on
  for (const double value : pressure.on_grid({-1, -1}, 1.0, 6, 6)) EXPECT_EQ(value, 0.0);
}

TEST(ObjectPrint, LiesOnTheLowerFaceOnly) {
  const ObjectSpec object = read_object(kScenes / "objects/hue-circle.yaml");
  const VisibleObject visible = visible_object(object, 0.5);
  ASSERT_EQ(visible.printed_mm.size(), visible.body.vertices.size());
  int low = 0;
  for (const auto& t : visible.body.triangles) {
    const Eigen::Vector3d a = visible.body.vertices[t[0]];
    const bool down = (visible.body.vertices[t[1]] - a).cross(visible.body.vertices[t[2]] - a).normalized().z() < -0.5;
    for (const int v : t) {
      const Eigen::Vector2d here = visible.body.vertices[v].head<2>();
      if (down) {
        EXPECT_EQ(visible.printed_mm[v], here);
      } else {
        EXPECT_GT(visible.printed_mm[v].norm(), 1e4);
      }
    }
    low += down ? 1 : 0;
  }
  EXPECT_EQ(low, 2);
}

SceneSpec scene_of(const std::string& name) {
  return read_scene(kScenes / "vhs" / name);
}

TEST(ObjectPrint, IsPlannedWhereItCanBeSeen) {
  SceneSpec scene = scene_of("skin.yaml");
  EXPECT_TRUE(make_plan(scene).object_print);
  EXPECT_TRUE(make_plan(scene).skin_blanching);
  scene.effects.fine_relief = Switch::on;
  EXPECT_THAT(message_of([&] { make_plan(scene); }), HasSubstr("a skin's marks can't be had with fine relief"));
  scene.effects.fine_relief = Switch::automatic;
  scene.outputs = {};
  scene.outputs.frames = false;
  EXPECT_FALSE(make_plan(scene).object_print);
  scene.outputs.depth = true;  // a first hit has no colour
  EXPECT_FALSE(make_plan(scene).object_print);
  scene = scene_of("steel-rule.yaml");
  EXPECT_TRUE(make_plan(scene).object_print);
  EXPECT_FALSE(make_plan(scene).skin_blanching);
  scene.object.print.clear();
  EXPECT_FALSE(make_plan(scene).object_print);
  scene = scene_of("skin.yaml");
  scene.device = read_scene(kScenes / "gelsight/ball-press.yaml").device;  // coated
  EXPECT_FALSE(make_plan(scene).object_print);
  EXPECT_FALSE(make_plan(scene).skin_blanching);
}

}  // namespace
}  // namespace touchstone::sim
