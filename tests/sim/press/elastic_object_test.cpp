// Objects that give way themselves.

#include "sim/press/elastic_object.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/units.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/scene/scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

const char* const kBox = "shape: {type: box, size_mm: [4, 4, 3]}";
const char* const kBall = "shape: {type: sphere, radius_mm: 3}";

std::string elastic_of(double modulus, double poisson, double mesh = 0.8) {
  return fmt::format("elastic: {{youngs_modulus_MPa: {}, poisson_ratio: {}, mesh_mm: {}}}", modulus, poisson, mesh);
}

ObjectSpec object_of(const std::string& shape, const std::string& elastic) {
  return parse_yaml<ObjectSpec>("name: probe\n" + shape + "\nfriction: 0.5\n" + elastic + "\n", "probe.yaml");
}

/// A pad of 8 x 8 x 3 mm of 0.3 MPa; the object goes down by some tenths of a millimetre.
SceneSpec scene_of(const ObjectSpec& object) {
  SceneSpec scene;
  scene.device = parse_yaml<DeviceSpec>(R"(
name: small
gel: {size_x_mm: 8, size_y_mm: 8, thickness_mm: 3, youngs_modulus_MPa: 0.3, poisson_ratio: 0.45}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [2.4, 2.4], fine_depth_mm: 1}
plate: {thickness_mm: 1, refractive_index: 1.5}
)",
                                        "small.yaml");
  scene.object = object;
  scene.motion =
      parse_yaml<MotionSpec>("start_mm: [0, 0, 4]\nkeys:\n  - {frames: 1, z: {position_mm: 0}}\n", "motion.yaml");
  const double lowest = object.shape.type == ShapeKind::box ? -1.5 : -3.0;
  scene.motion.keys[0].z->position_mm = -lowest - 0.15;
  scene.outputs.frames = false;
  return scene;
}

const test::TemporaryFolder& cache() {
  static const test::TemporaryFolder folder;
  return folder;
}

double force_of(const SceneSpec& scene) {
  const Plan plan = make_plan(scene);
  const auto gel = set_up_gel(scene.device, cache().path());
  const auto elastic = set_up_elastic_objects(scene, plan, cache().path());
  return play_motion(scene, plan, *gel, {}, nullptr, elastic).back().press.wrench[2];
}

TEST(ElasticObject, OfSteelIsAsGoodAsRigidAndFoamHardlyPresses) {
  for (const char* shape : {kBox, kBall}) {
    const double rigid = force_of(scene_of(object_of(shape, "")));
    const double steel = force_of(scene_of(object_of(shape, elastic_of(2e5, 0.3))));
    const double like_the_gel = force_of(scene_of(object_of(shape, elastic_of(0.3, 0.45))));
    const double foam = force_of(scene_of(object_of(shape, elastic_of(0.003, 0.1))));
    EXPECT_NEAR(steel, rigid, 1e-4 * rigid) << shape;
    EXPECT_LT(like_the_gel, 0.8 * rigid) << shape;
    EXPECT_GT(like_the_gel, 0.2 * rigid) << shape;
    EXPECT_GT(foam, 0.0) << shape;
    EXPECT_LT(foam, 0.05 * rigid) << shape;
  }
}

TEST(ElasticObject, ASoftBoxOnAHardGelPressesLikeASpring) {
  // Foam without lateral contraction, held above, on a gel a thousand times as stiff: F = E A d / h. It is as large as
  // the pad, so that no rim is between two of the gel's vertices; what is left is that the two meshes don't fit.
  const double expected = 3e-4 * 64.0 * 0.15 / 3.0;
  const auto error = [&](double mesh) {
    const std::string box = "shape: {type: box, size_mm: [8, 8, 3]}";
    return std::abs(force_of(scene_of(object_of(box, elastic_of(3e-4, 0.0, mesh)))) / expected - 1.0);
  };
  const double coarse = error(1.2);
  const double fine = error(0.6);
  EXPECT_LT(coarse, 0.02);
  EXPECT_LT(fine, 0.01);
  EXPECT_LT(fine, 0.5 * coarse);
}

TEST(ElasticObject, IsInItsOwnFrameAndSymmetric) {
  const auto body = set_up_elastic_object(object_of(kBox, elastic_of(1.0, 0.3)), cache().path());
  double lowest = 0.0;
  double highest = -10.0;
  for (const Eigen::Vector3d& vertex : body->vertices) {
    lowest = std::min(lowest, vertex.z());
    highest = std::max(highest, vertex.z());
  }
  EXPECT_NEAR(lowest, -1.5, 1e-12);
  EXPECT_LE(highest, 1.5 + 1e-12);
  const Eigen::MatrixXd h = body->surface.view();
  EXPECT_LT((h - h.transpose()).norm(), 1e-9 * h.norm());
  // An even pressure from below pushes the underside up, and more than the sides.
  Eigen::VectorXd up = Eigen::VectorXd::Zero(h.cols());
  for (std::size_t v = 0; v < body->vertices.size(); ++v) {
    if (body->vertices[v].z() < -1.5 + 1e-9) up[static_cast<Eigen::Index>(3 * v + 2)] = 1.0;
  }
  EXPECT_GT(up.dot(h * up), 0.0);
  EXPECT_GT((h * up).dot(up), 0.5 * (h * up).norm());
}

TEST(ElasticObject, ThatIsSwitchedOffIsRigidAndIsNotSetUp) {
  SceneSpec scene = scene_of(object_of(kBox, elastic_of(0.01, 0.3)));
  scene.effects.elastic_object = Switch::off;
  const Plan plan = make_plan(scene);
  EXPECT_FALSE(plan.elastic_object);
  const test::TemporaryFolder empty;
  EXPECT_TRUE(set_up_elastic_objects(scene, plan, empty.path()).empty());
  EXPECT_TRUE(std::filesystem::is_empty(empty.path())) << "something was set up";
  EXPECT_EQ(force_of(scene), force_of(scene_of(object_of(kBox, ""))));
}

TEST(ElasticObject, IsCalledForByAModulusAndSaysWhy) {
  const auto row = [](const SceneSpec& scene) {
    for (const Effect& effect : make_plan(scene).effects) {
      if (effect.name == "elastic object") return effect;
    }
    return Effect{};
  };
  EXPECT_FALSE(row(scene_of(object_of(kBall, ""))).on);
  const Effect soft = row(scene_of(object_of(kBall, elastic_of(0.01, 0.3))));
  EXPECT_TRUE(soft.on);
  EXPECT_THAT(soft.why, HasSubstr("0.01 MPa"));
}

std::string error_of(const SceneSpec& scene) {
  try {
    force_of(scene);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ElasticObject, RefusesWhatCannotBe) {
  SceneSpec rigid = scene_of(object_of(kBox, ""));
  rigid.effects.elastic_object = Switch::on;
  EXPECT_THAT(error_of(rigid), HasSubstr("no object has the field `elastic`"));

  SceneSpec held_nowhere =
      scene_of(object_of(kBox, "elastic: {youngs_modulus_MPa: 1, poisson_ratio: 0.3, mesh_mm: 0.8, held_above_mm: 2}"));
  EXPECT_THAT(error_of(held_nowhere), HasSubstr("probe.yaml:4: elastic: none of the object's faces"));
  SceneSpec held_all = scene_of(
      object_of(kBox, "elastic: {youngs_modulus_MPa: 1, poisson_ratio: 0.3, mesh_mm: 0.8, held_above_mm: -2}"));
  EXPECT_THAT(error_of(held_all), HasSubstr("all of the object's faces"));
  SceneSpec too_fine =
      scene_of(object_of(kBox, "elastic: {youngs_modulus_MPa: 1, poisson_ratio: 0.3, mesh_mm: 0.001}"));
  EXPECT_THAT(error_of(too_fine), HasSubstr("probe.yaml:4: elastic: the object can't be set up"));

  SceneSpec shaken = scene_of(object_of(kBox, elastic_of(1.0, 0.3)));
  shaken.effects.inertia = Switch::on;
  EXPECT_THAT(error_of(shaken), HasSubstr("inertia isn't simulated with an elastic object"));
  SceneSpec rough = scene_of(object_of(kBox, elastic_of(1.0, 0.3)));
  rough.effects.fine_relief = Switch::on;
  EXPECT_EQ(error_of(rough), "") << "no picture is asked for";
  rough.device.gel.relaxation = {{0.2, 1.0}};
  EXPECT_THAT(error_of(rough), HasSubstr("fine relief isn't simulated with an elastic object on a gel that relaxes"));

  const auto refused = [](const std::string& elastic) {
    try {
      object_of(kBox, elastic);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refused("elastic: {youngs_modulus_MPa: 0, poisson_ratio: 0.3, mesh_mm: 1}"), HasSubstr("probe.yaml:4"));
  EXPECT_THAT(refused("elastic: {youngs_modulus_MPa: 1, poisson_ratio: 0.6, mesh_mm: 1}"), HasSubstr("0.6"));
  EXPECT_THAT(refused("elastic: {youngs_modulus_MPa: 1, poisson_ratio: 0.3}"), HasSubstr("mesh_mm"));
}

TEST(ElasticObject, RoundSurfacesAreClosedEvenAndOfTheRightVolume) {
  const ShapeSpec ball = object_of(kBall, "").shape;
  const ShapeSpec pill =
      object_of("shape: {type: rounded_cylinder, radius_mm: 3, edge_radius_mm: 1, height_mm: 5}", "").shape;
  const ShapeSpec disc =
      object_of("shape: {type: rounded_cylinder, radius_mm: 3, edge_radius_mm: 0, height_mm: 1}", "").shape;
  const double ring = 2.0 * kPi;
  const double round_edge = ring * (kPi / 4 * 2.0 + 1.0 / 3.0) - ring * 0.5 * (9.0 - 4.0);
  const std::pair<ShapeSpec, double> cases[] = {{ball, 36.0 * kPi}, {pill, 45.0 * kPi + round_edge}, {disc, 9.0 * kPi}};
  for (const auto& [shape, volume] : cases) {
    const TriangleMesh mesh = even_surface(shape, 0.5);
    EXPECT_EQ(fault_of_closed_mesh(mesh), "");
    double sum = 0.0;
    for (const auto& t : mesh.triangles) {
      sum += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6.0;
      for (int k = 0; k < 3; ++k) {
        const double edge = (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm();
        EXPECT_LT(edge, 1.0);
        EXPECT_GT(edge, 0.15);
      }
    }
    EXPECT_NEAR(sum, volume, 0.02 * volume);
  }
}

}  // namespace
}  // namespace touchstone::sim
