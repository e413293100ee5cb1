#include "lab/studies/apparent_change_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "lab/press/pressed_marker.h"
#include "lab/studies/study.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;

constexpr const char* kDevice =
    "name: small\n"
    "gel: {size_x_mm: 8, size_y_mm: 8, thickness_mm: 2, youngs_modulus_MPa: 0.4, poisson_ratio: 0.5,\n"
    "      refractive_index: 1.41}\n"
    "mesh: {fine_mm: 0.6, coarse_mm: 1.5, fine_half_extent_mm: [2, 2], fine_depth_mm: 0.5}\n"
    "plate: {thickness_mm: 3, refractive_index: 1.49}\n";
constexpr const char* kPunch =
    "name: punch\nshape: {type: rounded_cylinder, radius_mm: 1.8, edge_radius_mm: 0, height_mm: 2}\nalbedo: 0.5\n";
constexpr const char* kStudy =
    "name: s\nkind: apparent_change\ndevice: d.yaml\nvary: {field: gel.thickness_mm, values: [1.5, 2, 3]}\n"
    "lenses_mm: [24, 50]\nobjects: [punch.yaml]\nforce_N: [0.05, 0.1]\nfriction: 0\n";

class ApparentChangeStudy : public ::testing::Test {
 protected:
  ApparentChangeStudy() {
    folder_.write("d.yaml", kDevice);
    folder_.write("punch.yaml", kPunch);
  }
  StudySpec read(const std::string& text) { return read_study(folder_.write("s.yaml", text)); }
  ApparentChangeSpec spec(const std::string& more = "") {
    return std::get<ApparentChangeSpec>(read(kStudy + more).kind);
  }
  std::string fault(const std::string& text) {
    try {
      read(text);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  test::TemporaryFolder folder_;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST_F(ApparentChangeStudy, ByFormulaIsChromaDesign) {
  const ApparentChangeResult result = run_apparent_change(spec("by: [formula]\n"), folder_.path());
  ASSERT_EQ(result.rows.size(), 2u * 2u * 3u);
  EXPECT_TRUE(result.notes.empty());
  const ApparentChangeRow& row = result.rows.back();
  EXPECT_EQ(row.force_N, 0.1);
  EXPECT_EQ(row.lens_mm, 50.0);
  EXPECT_EQ(row.value, 3.0);
  const ChromaDesign design{{2.0, 0.4, 0.5}, 0.1, distance_in_view(2.0, angle_of_view(50.0), 10)};
  for (int k = 0; k < kStudiedMeasureCount; ++k) {
    EXPECT_EQ(row.measure[k], apparent_measure(kStudiedMeasures[k], design, 3.0));
  }
}

TEST_F(ApparentChangeStudy, OfAPunchIsLinearInItsForce) {
  const ApparentChangeResult result = run_apparent_change(spec("by: [linear]\n"), folder_.path());
  ASSERT_EQ(result.rows.size(), 2u * 2u * 3u);
  for (std::size_t k = 0; k < 6; ++k) {
    const ApparentChangeRow& light = result.rows[k];
    const ApparentChangeRow& heavy = result.rows[k + 6];
    ASSERT_EQ(2.0 * light.force_N, heavy.force_N);
    EXPECT_NEAR(heavy.displacement_mm, 2.0 * light.displacement_mm, 1e-3 * heavy.displacement_mm);
    EXPECT_GT(light.stretch, 1.0);
    // The punch is wider than the marker, so all of it comes nearer and looks larger than its stretch alone tells.
    EXPECT_GT(light.measure[1], light.stretch - 1.0);
    // The same press seen by the other lens is the same press.
    EXPECT_EQ(light.displacement_mm, result.rows[(k + 3) % 6].displacement_mm);
  }
}

TEST_F(ApparentChangeStudy, StretchesAMarkerMostOnAGelNeitherThinNorThick) {
  // A thin incompressible gel can't get out of the way, a thick one hardly stretches where it is pressed.
  folder_.write("d.yaml", replaced(replaced(kDevice, "fine_mm: 0.6", "fine_mm: 0.4"), "[2, 2]", "[1.2, 1.2]"));
  folder_.write("punch.yaml", replaced(kPunch, "radius_mm: 1.8", "radius_mm: 1"));
  const ApparentChangeSpec wanted = std::get<ApparentChangeSpec>(
      read(replaced(replaced(kStudy, "[1.5, 2, 3]", "[0.4, 0.8, 3]"), "[24, 50]", "[24]") + "by: [linear]\n").kind);
  const ApparentChangeResult result = run_apparent_change(wanted, folder_.path());
  ASSERT_EQ(result.rows.size(), 6u);
  EXPECT_GT(result.rows[1].stretch - 1.0, 1.1 * (result.rows[0].stretch - 1.0));
  EXPECT_GT(result.rows[1].stretch - 1.0, 1.5 * (result.rows[2].stretch - 1.0));
  for (const ApparentOptimum& optimum : optima_of(result)) EXPECT_TRUE(optimum.interior);
}

TEST_F(ApparentChangeStudy, WritesTheSameBytesTwice) {
  const StudySpec study = read(kStudy);
  const StudyResult first = run_study(study, folder_.path());
  const StudyResult second = run_study(study, folder_.path());
  ASSERT_EQ(first.files.size(), 2u + 4u);
  for (std::size_t k = 0; k < first.files.size(); ++k) EXPECT_EQ(first.files[k].text, second.files[k].text);
  EXPECT_THAT(first.files[0].text, HasSubstr("object,by,force_N,gel.thickness_mm,lens_mm,displacement_mm"));
  EXPECT_THAT(first.files[1].text, HasSubstr("| punch | linear | 0.1 | 50 |"));
}

TEST_F(ApparentChangeStudy, LeavesEmptyWhatCantBeHad) {
  // 2 N go through the column of [Lin2019, eq. 3], and a gel of 20 mm leaves no space for the camera.
  const ApparentChangeSpec wanted = std::get<ApparentChangeSpec>(
      read(replaced(replaced(kStudy, "[1.5, 2, 3]", "[2, 20]"), "[0.05, 0.1]", "[2]") + "by: [formula]\n").kind);
  const ApparentChangeResult result = run_apparent_change(wanted, folder_.path());
  for (const ApparentChangeRow& row : result.rows) EXPECT_TRUE(std::isnan(row.measure[0]));
  EXPECT_TRUE(optima_of(result).empty());
}

TEST(OptimaOf, AreVerticesOfParabolasOrEnds) {
  ApparentChangeResult result;
  for (const double value : {1.0, 2.0, 4.0, 5.0}) {
    ApparentChangeRow row;
    row.value = value;
    row.measure[0] = 1.0 - std::pow(value - 2.6, 2);
    row.measure[1] = value;
    row.measure[2] = -value;
    row.measure[3] = value < 5.0 ? value : NAN;
    result.rows.push_back(row);
  }
  const std::vector<ApparentOptimum> optima = optima_of(result);
  ASSERT_EQ(optima.size(), 4u);
  EXPECT_TRUE(optima[0].interior);
  EXPECT_NEAR(optima[0].value, 2.6, 1e-12);
  EXPECT_FALSE(optima[1].interior);
  EXPECT_EQ(optima[1].value, 5.0);
  EXPECT_FALSE(optima[2].interior);
  EXPECT_EQ(optima[2].value, 1.0);
  EXPECT_FALSE(optima[3].interior);
  EXPECT_EQ(optima[3].value, 4.0);
}

TEST_F(ApparentChangeStudy, MistakesAreRefusedWithTheirPlace) {
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& part) {
    EXPECT_THAT(fault(replaced(kStudy, from, to)), HasSubstr(part)) << to;
  };
  refused("apparent_change", "apparent_chnge", "s.yaml:2: kind: 'apparent_chnge'");
  refused("name: s\n", "name: a/b\n", "'a/b' can't name files");
  refused("d.yaml", "none.yaml", "s.yaml:3: device: there is no file");
  refused("[punch.yaml]", "[none.yaml]", "s.yaml:6: objects: there is no file");
  refused("gel.thickness_mm", "gel.thicknes_mm", "did you mean 'gel.thickness_mm'");
  refused("[1.5, 2, 3]", "[]", "vary.values: is empty");
  refused("[1.5, 2, 3]", "[1.5, 1.5]", "must rise");
  refused("[1.5, 2, 3]", "[-1, 2]", "vary.values[0]: -1 is not allowed");
  refused("[1.5, 2, 3]", "[0.1, 2]", "s.yaml:4: vary: with gel.thickness_mm = 0.1: the slab's fine edge length");
  refused("[24, 50]", "[0, 50]", "lenses_mm");
  refused("[punch.yaml]", "[]", "objects: is empty");
  refused("[0.05, 0.1]", "[0.1, 0.05]", "force_N: 0.05 stands after 0.1");
  refused("friction: 0", "friction: -1", "friction");
  refused("friction: 0", "by: []", "by: is empty");
  refused("friction: 0", "colour: 3", "colour");
  refused("friction: 0", "by: [linear, linear]", "by: linear stands there a second time");
  refused("[punch.yaml]", "[punch.yaml, punch.yaml]", "has the name 'punch' a second time");
  refused("[24, 50]", "[0.001, 50]\nmarkers_in_view: 1", "lenses_mm: 1 markers");
  folder_.write("odd.yaml", replaced(kPunch, "name: punch", "name: a/b"));
  refused("[punch.yaml]", "[odd.yaml]", "'a/b' in odd.yaml can't name files");
}

TEST(PressedMarker, IsPicturedByThalesWithoutRefraction) {
  const render::Scene faces = bare_faces(5.0, 1.0, 8.0, 1.0);
  const auto camera = camera_before(24.0, 40.0);
  const auto square = [](double z) {
    return std::vector<Eigen::Vector3d>{{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}};
  };
  EXPECT_NEAR(std::sqrt(pictured_area(faces, camera, square(0.0))), 24.0 * 2.0 / 40.0, 1e-9);
  EXPECT_NEAR(std::sqrt(pictured_area(faces, camera, square(-1.0))), 24.0 * 2.0 / 39.0, 1e-9);
  EXPECT_THROW(pictured_area(faces, camera_before(24.0, 13.0), square(0.0)), Error);
}

TEST(PressedMarker, LooksNearerThroughGelAndPlate) {
  // A small square on the axis: by its apparent depth.
  const render::Scene faces = bare_faces(5.0, 1.41, 8.0, 1.49);
  const std::vector<Eigen::Vector3d> square = {{-0.01, -0.01, 0}, {0.01, -0.01, 0}, {0.01, 0.01, 0}, {-0.01, 0.01, 0}};
  const double distance = 27.0 + 8.0 / 1.49 + 5.0 / 1.41;
  EXPECT_NEAR(std::sqrt(pictured_area(faces, camera_before(24.0, 40.0), square)), 24.0 * 0.02 / distance, 1e-7);
}

TEST(PressedMarker, PointsGoWithTheirTriangles) {
  const std::vector<Eigen::Vector3d> vertices = {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}};
  const std::vector<std::array<int, 3>> triangles = {{0, 1, 2}, {0, 2, 3}};
  const SurfacePoints points = locate_points(vertices, triangles, {{0.5, -1.0}, {0.0, 0.0}, {-2.0, 2.0}});
  Eigen::MatrixX3d displacement(4, 3);
  for (int k = 0; k < 4; ++k) displacement.row(k) << 0.1 * vertices[k].x(), -0.2 * vertices[k].y(), vertices[k].x();
  const std::vector<Eigen::Vector3d> moved = displaced(points, displacement);
  EXPECT_LT((moved[0] - Eigen::Vector3d(0.55, -0.8, 0.5)).norm(), 1e-12);
  EXPECT_LT((moved[1]).norm(), 1e-12);
  EXPECT_LT((moved[2] - Eigen::Vector3d(-2.2, 1.6, -2.0)).norm(), 1e-12);
  EXPECT_THROW(locate_points(vertices, triangles, {{2.1, 0.0}}), Error);
  EXPECT_THROW(square_marker(vertices, triangles, 5.0), Error);
  EXPECT_THROW(square_marker(vertices, triangles, 0.0), Error);
}

}  // namespace
}  // namespace touchstone::lab
