// What is seen of gels whose outer surface is a dome or a fingertip.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "core/error.h"
#include "core/units.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/view/scene_view.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kSphere = 15.0;
constexpr double kBase = 6.0;
constexpr double kThickness = 4.0;
const double kRimZ = std::sqrt(kSphere * kSphere - kBase * kBase) - kSphere;

const char* const kView = R"(
plate: {thickness_mm: 2, refractive_index: 1.49}
coating: {type: matt, albedo: 0.5}
lamps:
  - {position_mm: [16, 0, -18], target_mm: [0, 0, -2], lens_radius_mm: 0.5, half_angle_deg: 40, soft_angle_deg: 15, power_W: [1]}
  - {position_mm: [-9, 14, -18], target_mm: [0, 0, -2], lens_radius_mm: 0.5, half_angle_deg: 40, soft_angle_deg: 15, power_W: [1]}
room_radiance: 0
camera:
  type: lens
  width: 96
  height: 72
  pixel_pitch_um: 30
  focal_length_mm: 4
  f_number: 8
  focus_distance_mm: 16
  lens_position_mm: [0, 0, -18]
  look_at_mm: [0, 0, 0]
  exposure_us: 500
  full_well_e: 50000
  read_noise_e: 5
)";

DeviceSpec device(const std::string& gel) {
  return parse_yaml<DeviceSpec>(
      "name: small\ngel: {" + gel +
          ", youngs_modulus_MPa: 0.2, poisson_ratio: 0.49, refractive_index: 1.41}\n"
          "mesh: {fine_mm: 0.7, coarse_mm: 2, fine_half_extent_mm: [4, 4], fine_depth_mm: 0.8}\n" +
          kView,
      "device.yaml");
}

DeviceSpec dome_device() {
  return device(fmt::format("shape: dome, sphere_radius_mm: {}, base_radius_mm: {}, thickness_mm: {}", kSphere, kBase,
                            kThickness));
}

const char* const kPlate = "name: plate\nshape: {type: box, size_mm: [30, 30, 2]}\n";
const char* const kBall = "name: ball\nshape: {type: sphere, radius_mm: 2}\n";

/// Straight down at (x, y) until the object's own origin is at `z`.
SceneSpec scene_of(DeviceSpec device_of, const std::string& object, double x, double y, double z) {
  SceneSpec scene;
  scene.device = std::move(device_of);
  scene.object = parse_yaml<ObjectSpec>(object, "object.yaml");
  scene.motion = parse_yaml<MotionSpec>(
      fmt::format("start_mm: [{0}, {1}, {2}]\nkeys:\n  - {{frames: 1, z: {{position_mm: {3}}}}}\n", x, y, z + 1.0, z),
      "motion.yaml");
  scene.outputs = {.frames = false, .ideal = true, .radiance = true};
  return scene;
}

std::shared_ptr<const fem::Compliance> gel_of(const DeviceSpec& of) {
  static const test::TemporaryFolder folder;
  return set_up_gel(of, folder.path());
}

struct Pressed {
  SceneSpec scene;
  Plan plan;
  std::shared_ptr<const fem::Compliance> gel;
  SceneView view;
  std::vector<Truth> truths;

  explicit Pressed(SceneSpec scene_of_it)
      : scene(std::move(scene_of_it)),
        plan(make_plan(scene)),
        gel(gel_of(scene.device)),
        view(scene, plan, *gel),
        truths(play_motion(scene, plan, *gel)) {}
  const fem::PressState& press() const { return truths.back().press; }
};

double off_the_dome(const Eigen::Vector3d& point) {
  return (point - Eigen::Vector3d(0, 0, -kSphere)).norm() - kSphere;
}

double area_of(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    area += 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
  }
  return area;
}

TEST(CurvedGel, ARestingDomeIsItsSphere) {
  const Pressed dome(scene_of(dome_device(), kPlate, 0, 0, 3.0));  // 2 mm above the apex
  const std::vector<PlacedShape> shapes = placed_shapes(dome.view.objects, dome.press());
  const GelSheet sheet = dome.view.gel.sheet(dome.press(), shapes);
  double widest = 0.0;
  for (std::size_t i = 0; i < sheet.mesh.vertices.size(); ++i) {
    EXPECT_NEAR(off_the_dome(sheet.mesh.vertices[i]), 0.0, 1e-9);
    EXPECT_LT((sheet.mesh.vertices[i] - sheet.rest[i]).norm(), 1e-12);
    widest = std::max(widest, sheet.rest[i].head<2>().norm());
  }
  EXPECT_NEAR(widest, kBase, 1e-9);
  EXPECT_NEAR(area_of(sheet.mesh), 2.0 * kPi * kSphere * -kRimZ, 2e-3 * 2.0 * kPi * kSphere * -kRimZ);
  for (const int touched : sheet.touched) EXPECT_EQ(touched, -1);
}

TEST(CurvedGel, NormalsOfARestingDomeAreTheSpheres) {
  const Pressed dome(scene_of(dome_device(), kPlate, 0, 0, 3.0));
  const render::Scene seen = dome.view.seen(dome.press(), {});
  const render::Surface& sheet = seen.surfaces[0];
  ASSERT_EQ(sheet.normals.size(), sheet.mesh.vertices.size());
  double squares = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < sheet.normals.size(); ++i) {
    const Eigen::Vector3d& at = sheet.mesh.vertices[i];
    if (at.head<2>().norm() > kBase - 0.5) continue;  // at the rim triangles are on one side only
    const Eigen::Vector3d normal = (at - Eigen::Vector3d(0, 0, -kSphere)) / kSphere;
    const double angle = std::acos(std::min(1.0, normal.dot(sheet.normals[i]))) / kRadiansPerDegree;
    squares += angle * angle;
    ++count;
  }
  EXPECT_LT(std::sqrt(squares / count), 0.1) << "degrees";
}

// The object's face at z = -0.25: what touches it lies on it, nothing reaches through.
TEST(CurvedGel, AFlatPlateFlattensTheDomeToADisc) {
  // The gel that goes aside makes the sheet wider by 0.95 % of its base, on finer meshes; by 1.03 with edges of 0.7 mm.
  DeviceSpec finer = dome_device();
  finer.mesh.fine_mm = 0.5;
  const Pressed dome(scene_of(finer, kPlate, 0, 0, 1.0 - 0.25));
  ASSERT_TRUE(dome.plan.fine_relief) << "a gentle dome gets the fine contact";
  const auto relief = dome.view.relief(dome.press());
  ASSERT_TRUE(relief && relief->grid.size() > 0);
  const double face = -0.25 + relief->solved.shift;
  const GelSheet sheet = whole_sheet(dome.view.membrane->sheet(dome.press(), *relief));
  double touched_area = 0.0;
  double widest = 0.0;
  double narrowest = 1e9;
  for (std::size_t k = 0; k < sheet.mesh.triangles.size(); ++k) {
    for (const int v : sheet.mesh.triangles[k]) {
      EXPECT_LT(sheet.mesh.vertices[v].z(), face + 1e-4);
      EXPECT_NEAR(off_the_dome(sheet.rest[v]), 0.0, 1e-9);
      const double radius = sheet.mesh.vertices[v].head<2>().norm();
      if (sheet.touched[k] >= 0) {
        EXPECT_NEAR(sheet.mesh.vertices[v].z(), face, 1e-4);
        widest = std::max(widest, radius);
      } else {
        narrowest = std::min(narrowest, radius);
      }
    }
    if (sheet.touched[k] < 0) continue;
    const auto& t = sheet.mesh.triangles[k];
    const Eigen::Vector3d a = sheet.mesh.vertices[t[0]];
    touched_area += 0.5 * (sheet.mesh.vertices[t[1]] - a).cross(sheet.mesh.vertices[t[2]] - a).norm();
  }
  const double radius = std::sqrt(touched_area / kPi);
  EXPECT_NEAR(widest, radius, 0.12);     // of pixels of 0.07 mm: it's round
  EXPECT_NEAR(narrowest, radius, 0.12);  // and has no hole
  EXPECT_NEAR(area_of(sheet.mesh), 2.0 * kPi * kSphere * -kRimZ, 0.01 * kPi * kBase * kBase);
}

// To first order in the slope a plate on a dome is a ball of the dome's radius on a flat gel.
TEST(CurvedGel, APlateOnADomeIsABallOnASlab) {
  constexpr double kDepth = 0.15;
  const Pressed dome(scene_of(dome_device(), kPlate, 0, 0, 1.0 - kDepth));
  const Pressed slab(scene_of(device("size_x_mm: 12, size_y_mm: 12, thickness_mm: 4"),
                              fmt::format("name: ball\nshape: {{type: sphere, radius_mm: {}}}\n", kSphere), 0, 0,
                              kSphere - kDepth));
  const auto one = dome.view.relief(dome.press());
  const auto other = slab.view.relief(slab.press());
  ASSERT_TRUE(one && other);
  const auto radius = [](const fem::ReliefAnswer& answer) {
    double pixels = 0.0;
    for (const char touched : answer.contact) pixels += touched;
    return std::sqrt(pixels * answer.grid.pixel_area() / kPi);
  };
  EXPECT_NEAR(dome.press().wrench[2], slab.press().wrench[2], 0.06 * slab.press().wrench[2]);
  EXPECT_NEAR(radius(*one), radius(*other), 0.03 * radius(*other));
}

TEST(CurvedGel, TheHeightMapIsOverTheRestingDome) {
  SceneSpec scene = scene_of(dome_device(), kPlate, 0, 0, 1.0 - 0.25);
  scene.outputs.height = true;
  scene.membrane.pixel_um = 100;
  const Pressed dome(scene);
  const auto relief = dome.view.relief(dome.press());
  const cv::Mat height = dome.view.membrane->height(dome.press(), relief);
  const double face = -0.25 + relief->solved.shift;
  EXPECT_NEAR(height.at<float>(height.rows / 2, height.cols / 2), face, 2e-3);  // the apex was at 0
  // On the disc the surface is the face; a millimetre aside the dome was lower by what it falls there.
  const int aside = height.cols / 2 + 10;
  const double x = 0.1 * (aside + 0.5 - 0.5 * height.cols);
  EXPECT_NEAR(height.at<float>(height.rows / 2, aside), face + (kSphere - std::sqrt(kSphere * kSphere - x * x)), 2e-3);
  const cv::Mat rest = dome.view.membrane->height(dome.truths.front().press, {});
  EXPECT_EQ(cv::countNonZero(cv::abs(rest) > 1e-9f), 0);
}

TEST(CurvedGel, ADomeLooksTheSameByDirectLightAndByPaths) {
  SceneSpec scene = scene_of(dome_device(), kPlate, 0, 0, 1.0 - 0.3);
  scene.effects.interreflection = Switch::off;
  scene.light.max_samples = 256;
  scene.light.min_samples = 256;
  scene.effects.direct_light = Switch::on;
  const Pressed direct(scene);
  const VirtualCamera quick(direct.scene, direct.plan, *direct.gel, direct.truths);
  ASSERT_TRUE(quick.light_choice().direct) << quick.light_choice().reason;
  scene.effects.direct_light = Switch::off;
  const Plan plan = make_plan(scene);
  const VirtualCamera slow(scene, plan, *direct.gel, direct.truths);
  const cv::Mat one = quick.capture(direct.truths.back()).radiance;
  const cv::Mat other = slow.capture_whole(direct.truths.back()).radiance;
  const cv::Mat lit = one.reshape(1) > 0.2 * cv::mean(one.reshape(1))[0];
  ASSERT_GT(cv::countNonZero(lit), static_cast<int>(lit.total()) / 2) << "it isn't dark";
  // Sharp rims, the frame's above all, are what the two draw differently.
  EXPECT_LT(cv::norm(one, other) / cv::norm(other), 0.03);
}

TEST(CurvedGel, APressBesideTheApexTouchesThere) {
  const Pressed dome(scene_of(dome_device(), kBall, 3.0, 0, 2.0 - 0.31 - 0.2));  // the dome is 0.31 mm down there
  const auto relief = dome.view.relief(dome.press());
  ASSERT_TRUE(relief && relief->grid.size() > 0);
  const GelSheet sheet = whole_sheet(dome.view.membrane->sheet(dome.press(), *relief));
  const Eigen::Vector3d centre = relief->moved(dome.press().gel_from_object).translation;
  int touched = 0;
  for (std::size_t k = 0; k < sheet.mesh.triangles.size(); ++k) {
    if (sheet.touched[k] < 0) continue;
    ++touched;
    for (const int v : sheet.mesh.triangles[k]) EXPECT_NEAR((sheet.mesh.vertices[v] - centre).norm(), 2.0, 1e-3);
  }
  EXPECT_GT(touched, 50);
}

// What photometric stereo reads: a ball's slopes, to a part of a degree, though the mesh has edges of 0.7 mm.
void expect_the_balls_own_slopes(const Pressed& pressed) {
  ASSERT_TRUE(pressed.plan.fine_relief);
  const auto relief = pressed.view.relief(pressed.press());
  ASSERT_TRUE(relief && relief->grid.size() > 0);
  const render::Scene seen = pressed.view.seen(pressed.press(), relief);
  const render::Surface& sheet = seen.surfaces[0];
  const Eigen::Vector3d centre = relief->moved(pressed.press().gel_from_object).translation;
  double squares = 0.0;
  int count = 0;
  const GelSheet whole = whole_sheet(pressed.view.membrane->sheet(pressed.press(), *relief));
  std::vector<char> inside(sheet.normals.size(), 1);  // all triangles round it touch
  std::vector<char> used(sheet.normals.size(), 0);
  for (std::size_t k = 0; k < whole.mesh.triangles.size(); ++k) {
    for (const int v : whole.mesh.triangles[k]) {
      used[v] = 1;
      if (whole.touched[k] < 0) inside[v] = 0;
    }
  }
  for (std::size_t i = 0; i < sheet.normals.size(); ++i) {
    if (inside[i] == 0 || used[i] == 0) continue;
    const Eigen::Vector3d normal = (centre - sheet.mesh.vertices[i]).normalized();
    const double angle = std::acos(std::min(1.0, normal.dot(sheet.normals[i]))) / kRadiansPerDegree;
    squares += angle * angle;
    ++count;
  }
  ASSERT_GT(count, 100);
  EXPECT_LT(std::sqrt(squares / count), 0.25) << "degrees";
}

TEST(CurvedGel, ABallShowsItsOwnSlopes) {
  expect_the_balls_own_slopes(Pressed(scene_of(dome_device(), kBall, 0, 0, 2.0 - 0.3)));
  expect_the_balls_own_slopes(
      Pressed(scene_of(device("size_x_mm: 12, size_y_mm: 12, thickness_mm: 4"), kBall, 0.2, 0.1, 2.0 - 0.3)));
}

TEST(CurvedGel, OffTheGelNothingTouches) {
  const Pressed beside(scene_of(dome_device(), kBall, 9.0, 0, 1.0));
  EXPECT_EQ(beside.press().contact_vertices, 0);
  const auto relief = beside.view.relief(beside.press());
  EXPECT_TRUE(!relief || relief->grid.size() == 0);
  const render::Scene seen = beside.view.seen(beside.press(), relief);
  for (const Eigen::Vector3d& vertex : seen.surfaces[0].mesh.vertices) EXPECT_NEAR(off_the_dome(vertex), 0.0, 1e-9);
}

TEST(CurvedGel, APressAtTheRimStaysOnTheGel) {
  const Pressed rim(scene_of(dome_device(), kBall, 5.6, 0, 2.0 + kRimZ));
  ASSERT_GT(rim.press().contact_vertices, 0);
  const render::Scene seen = rim.view.seen(rim.press(), rim.view.relief(rim.press()));
  EXPECT_NO_THROW(render::check_scene(seen));
  for (const Eigen::Vector3d& vertex : seen.surfaces[0].mesh.vertices) {
    EXPECT_GT(vertex.z(), -kThickness);
    EXPECT_LT(vertex.head<2>().norm(), kBase + 0.5);
  }
}

TEST(CurvedGel, APressThroughTheGelIsRefused) {
  const SceneSpec scene = scene_of(dome_device(), kPlate, 0, 0, 1.0 - kThickness - 0.1);
  EXPECT_THROW(play_motion(scene, make_plan(scene), *gel_of(scene.device)), Error);
}

// Nearly a hemisphere, its rim at 75 degrees, touched where it slopes by 38.
TEST(CurvedGel, AContactOnASteepFlankIsSeenThere) {
  constexpr double kSteepSphere = 7.0;
  constexpr double kRadius = 2.0;
  constexpr double kDepth = 0.25;
  constexpr double kAside = 5.4;  // of the ball's centre
  const double reach = kSteepSphere + kRadius - kDepth;
  const double z = std::sqrt(reach * reach - kAside * kAside) - kSteepSphere;
  SceneSpec scene =
      scene_of(device("shape: dome, sphere_radius_mm: 7, base_radius_mm: 6.76, thickness_mm: 6"), kBall, kAside, 0, z);
  scene.device.mesh.fine_half_extent_mm = {7.0, 7.0};
  scene.outputs.height = true;
  scene.membrane.pixel_um = 50;
  const Pressed dome(scene);
  ASSERT_TRUE(dome.plan.fine_relief);
  const auto relief = dome.view.relief(dome.press());
  ASSERT_TRUE(relief && relief->grid.size() > 0);
  const Eigen::Vector3d middle(0.0, 0.0, -kSteepSphere);
  const Eigen::Vector3d centre = relief->moved(dome.press().gel_from_object).translation;
  EXPECT_LT((relief->direction - (centre - middle).normalized()).norm(), 0.05);
  const GelSheet sheet = whole_sheet(dome.view.membrane->sheet(dome.press(), *relief));
  double touched_area = 0.0;
  for (std::size_t k = 0; k < sheet.mesh.triangles.size(); ++k) {
    const auto& t = sheet.mesh.triangles[k];
    for (const int v : t) {
      EXPECT_NEAR((sheet.rest[v] - middle).norm(), kSteepSphere, 1e-9);
      EXPECT_GT((sheet.mesh.vertices[v] - centre).norm(), kRadius - 1e-3) << "nothing reaches into the ball";
      if (sheet.touched[k] >= 0) {
        EXPECT_NEAR((sheet.mesh.vertices[v] - centre).norm(), kRadius, 1e-3);
      }
    }
    for (int i = 0; i < 3; ++i) {  // else flat cells are heights of their own
      const Eigen::Vector3d halfway = 0.5 * (sheet.rest[t[i]] + sheet.rest[t[(i + 1) % 3]]);
      EXPECT_LT(kSteepSphere - (halfway - middle).norm(), 1.001e-3);
    }
    if (sheet.touched[k] < 0) continue;
    const Eigen::Vector3d a = sheet.mesh.vertices[t[0]];
    touched_area += 0.5 * (sheet.mesh.vertices[t[1]] - a).cross(sheet.mesh.vertices[t[2]] - a).norm();
  }
  // Hertz of two balls, which knows no plate behind the gel; a bound for what is plainly wrong.
  const double hertz = kPi * kDepth / (1.0 / kRadius + 1.0 / kSteepSphere);
  EXPECT_NEAR(touched_area, hertz, 0.15 * hertz);
  EXPECT_NO_THROW(render::check_scene(dome.view.seen(dome.press(), relief)));
  // Over the middle of the contact the height map's surface is the ball's.
  const cv::Mat height = dome.view.membrane->height(dome.press(), relief);
  const Eigen::Vector3d touched = middle + (centre - middle) * (kSteepSphere / (centre - middle).norm());
  const int column = static_cast<int>((touched.x() + 0.5 * 0.05 * height.cols) / 0.05);
  const int row = height.rows / 2;
  const Eigen::Vector2d over(0.05 * (column + 0.5 - 0.5 * height.cols), 0.05 * (row + 0.5 - 0.5 * height.rows));
  const Eigen::Vector3d seen(over.x(), over.y(),
                             rest_height(scene.device.gel, over) + double(height.at<float>(row, column)));
  EXPECT_NEAR((seen - centre).norm(), kRadius, 2e-3);
}

TEST(CurvedGel, FineReliefOnASteeperDomeIsRefused) {
  SceneSpec scene = scene_of(device("shape: dome, sphere_radius_mm: 7, base_radius_mm: 6.95"), kPlate, 0, 0, 0.8);
  EXPECT_FALSE(make_plan(scene).fine_relief);
  scene.effects.fine_relief = Switch::on;
  EXPECT_THAT(test::message_of([&] { make_plan(scene); }),
              AllOf(HasSubstr("flat and domed gels only (domes up to 80.2 degrees"), HasSubstr("83.1 degrees")));
}

TEST(CurvedGel, AFingertipIsAHemisphereOnACylinder) {
  constexpr double kRadius = 5.0;
  const Pressed tip(scene_of(device("shape: fingertip, radius_mm: 5, length_mm: 3, sleeve_mm: 1.5"), kBall, 0, 0, 1.8));
  EXPECT_FALSE(tip.plan.fine_relief);
  const std::vector<PlacedShape> shapes = placed_shapes(tip.view.objects, tip.press());
  const GelSheet sheet = tip.view.gel.sheet(tip.press(), shapes);
  for (const Eigen::Vector3d& rest : sheet.rest) {
    const double off = rest.z() < -kRadius ? rest.head<2>().norm() - kRadius
                                           : (rest - Eigen::Vector3d(0, 0, -kRadius)).norm() - kRadius;
    EXPECT_NEAR(off, 0.0, 1e-9);
  }
  int touched = 0;
  for (std::size_t k = 0; k < sheet.mesh.triangles.size(); ++k) {
    for (const int v : sheet.mesh.triangles[k]) {
      const double distance = (sheet.mesh.vertices[v] - Eigen::Vector3d(0, 0, 1.8)).norm();
      EXPECT_GT(distance, 2.0 - 1e-9);
      if (sheet.touched[k] >= 0) {
        EXPECT_NEAR(distance, 2.0, 0.02);
      }
    }
    touched += sheet.touched[k] >= 0;
  }
  EXPECT_GT(touched, 10);
  EXPECT_NO_THROW(render::check_scene(tip.view.seen(tip.press(), {})));
}

TEST(CurvedGel, PrintMovesWithTheDome) {
  SceneSpec scene = scene_of(dome_device(), kPlate, 0, 0, 1.0 - 0.25);
  scene.device.coating->print = PrintSpec{.grid = {3, 3}, .spacing_mm = {2.0, 2.0}, .width_mm = 0.5, .colour = 0.05};
  const Pressed dome(scene);
  const auto relief = dome.view.relief(dome.press());
  const render::Scene seen = dome.view.seen(dome.press(), relief);
  const render::Surface& sheet = seen.surfaces[0];
  ASSERT_TRUE(sheet.print);
  ASSERT_EQ(sheet.print->material_mm.size(), sheet.mesh.vertices.size());
  const fem::SmoothSurface& surface = *dome.view.membrane->surface();
  for (std::size_t i = 0; i < sheet.mesh.vertices.size(); ++i) {
    const Eigen::Vector2d laid_out = surface.laid_out(sheet.print->material_mm[i]);
    const fem::SurfacePlace rest = surface.place(laid_out);
    const Eigen::Vector3d in = sheet.mesh.vertices[i] - rest.point - relief->tangential(laid_out);
    EXPECT_LT(in.cross(rest.normal).norm(), 1e-9) << "else along the surface's normal";
  }
}

}  // namespace
}  // namespace touchstone::sim
