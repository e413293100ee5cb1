// A sheet with normals is shaded as the curved surface that its triangles stand for.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "render/cameras/first_hits.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

constexpr double kRadius = 4.0;
const Eigen::Vector3d kCentre(0.0, 0.0, 3.0);

/// The lower cap of the sphere as a sheet of n x n squares.
TriangleMesh cap(int n) {
  return square_relief(
      2.7, n, [](double x, double y) { return kCentre.z() - std::sqrt(kRadius * kRadius - x * x - y * y); }, false);
}

std::vector<Eigen::Vector3d> normals_of_cap(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals;
  for (const Eigen::Vector3d& vertex : mesh.vertices) normals.push_back((vertex - kCentre) / kRadius);
  return normals;
}

/// One point lamp of 5 W/sr, nothing else; `lamp` may stand so low that part of the cap turns away from it.
Scene lit_by(const Eigen::Vector3d& lamp) {
  Scene scene = empty_scene(0.0);
  scene.interreflection = false;
  scene.lamps = {half_space_lamp(lamp, -lamp, 5.0)};
  return scene;
}

double seen_from_below(const Tracer& tracer, double x, double y) {
  return tracer.radiance({x, y, -20.0}, {0, 0, 1}, samples(1))[0];
}

TEST(SmoothShading, APlaneWithNormalsIsThePlane) {
  for (const Material& material : {Material{Lambertian{grey(0.6)}}, Material{RoughConductor{grey(0.7), 0.4}}}) {
    Scene flat = lit_by({6, 2, -9});
    flat.interreflection = true;
    flat.environment = grey(0.3);
    flat.surfaces = {{square_relief(
                          5.0, 7, [](double, double) { return 0.0; }, false),
                      material}};
    Scene smooth = flat;
    smooth.surfaces[0].normals.assign(smooth.surfaces[0].mesh.vertices.size(), {0, 0, -1});
    const cv::Mat one = Tracer(flat).render(small_camera(16, 12), samples(16)).irradiance;
    const cv::Mat other = Tracer(smooth).render(small_camera(16, 12), samples(16)).irradiance;
    for (int row = 0; row < one.rows; ++row) {
      for (int column = 0; column < one.cols; ++column) {
        EXPECT_NEAR(one.at<float>(row, column), other.at<float>(row, column), 1e-6 * one.at<float>(row, column));
      }
    }
  }
}

// Irradiance by closed form: intensity times cosine over the squared distance, on the sphere's own point.
TEST(SmoothShading, ASphereOfFacetsShinesAsTheSphere) {
  const Eigen::Vector3d lamp(9, 3, -6);
  Scene scene = lit_by(lamp);
  const TriangleMesh mesh = cap(24);  // facets of 0.23 mm: 3 degrees from one to the next
  scene.surfaces = {{mesh, Lambertian{grey(0.6)}}};
  const Tracer facets(scene);
  scene.surfaces[0].normals = normals_of_cap(mesh);
  const Tracer smooth(scene);
  double wrong_of_facets = 0.0;
  double wrong = 0.0;
  double all = 0.0;
  RandomStream random(5, 0, Purpose::kTest);
  for (int k = 0; k < 2000; ++k) {
    const double x = 4.8 * random.uniform() - 2.4;
    const double y = 4.8 * random.uniform() - 2.4;
    const Eigen::Vector3d place(x, y, kCentre.z() - std::sqrt(kRadius * kRadius - x * x - y * y));
    const Eigen::Vector3d offset = lamp - place;
    const double cosine = std::max(0.0, offset.normalized().dot((place - kCentre) / kRadius));
    const double expected = 0.6 / kPi * 5.0 * cosine / offset.squaredNorm() * 1e6;
    all += expected * expected;
    wrong += std::pow(seen_from_below(smooth, x, y) - expected, 2);
    wrong_of_facets += std::pow(seen_from_below(facets, x, y) - expected, 2);
  }
  EXPECT_LT(std::sqrt(wrong / all), 2e-3);
  EXPECT_GT(std::sqrt(wrong_of_facets / all), 2e-2) << "then this test says nothing";
}

// Where the sphere turns away from a low lamp facets would be lit or dark as a whole, and cast shadows on each other.
TEST(SmoothShading, TheTerminatorIsTheSpheresOwn) {
  const Eigen::Vector3d lamp(30, 0, 0.5);
  Scene scene = lit_by(lamp);
  const TriangleMesh mesh = cap(24);
  scene.surfaces = {{mesh, Lambertian{grey(0.6)}}};
  scene.surfaces[0].normals = normals_of_cap(mesh);
  const Tracer smooth(scene);
  for (double y = -1.0; y <= 1.0; y += 0.037) {
    for (double x = -1.5; x <= 2.0; x += 0.041) {
      const Eigen::Vector3d place(x, y, kCentre.z() - std::sqrt(kRadius * kRadius - x * x - y * y));
      const Eigen::Vector3d offset = lamp - place;
      const double cosine = std::max(0.0, offset.normalized().dot((place - kCentre) / kRadius));
      const double scale = 0.6 / kPi * 5.0 / offset.squaredNorm() * 1e6;
      EXPECT_NEAR(seen_from_below(smooth, x, y), scale * cosine, 2e-3 * scale) << x << " " << y;
    }
  }
}

TEST(SmoothShading, NoLightComesFromBelowTheTrueSurface) {
  // Normals that lean towards a lamp which stands behind the sheet.
  Scene scene = lit_by({8, 0, 1.5});
  scene.surfaces = {{square_relief(
                         5.0, 10, [](double, double) { return 0.0; }, false),
                     Lambertian{grey(0.6)}}};
  scene.surfaces[0].normals.assign(scene.surfaces[0].mesh.vertices.size(), Eigen::Vector3d(0.6, 0, -0.8));
  const Tracer tracer(scene);
  for (double x = -3.9; x < 4.0; x += 0.3) EXPECT_EQ(seen_from_below(tracer, x, 0.21), 0.0) << x;
}

TEST(SmoothShading, MakesNoEnergy) {
  const auto bumps = [](double x, double y) { return 0.25 * std::sin(2.1 * x) * std::cos(1.7 * y); };
  for (const Material& material : {Material{Lambertian{grey(1.0)}}, Material{RoughConductor{grey(1.0), 0.5}}}) {
    Scene scene = empty_scene(1.0);
    const TriangleMesh mesh =
        square_relief(5.0, 20, bumps, false);  // coarse: facets up to 20 degrees off their neighbours
    scene.surfaces = {{mesh, material, std::nullopt, vertex_normals(mesh)}};
    const Tracer tracer(scene);
    RandomStream random(9, 0, Purpose::kTest);
    double sum = 0.0;
    constexpr int kRays = 300;
    for (int k = 0; k < kRays; ++k) {
      const Eigen::Vector3d from(6.0 * random.uniform() - 3.0, 6.0 * random.uniform() - 3.0, -8.0);
      const Eigen::Vector3d to(6.0 * random.uniform() - 3.0, 6.0 * random.uniform() - 3.0, 0.0);
      RenderSettings settings = samples(64);
      settings.seed = static_cast<std::uint64_t>(k);
      sum += tracer.radiance(from, to - from, settings)[0];
    }
    EXPECT_LT(sum / kRays, 1.0 + 5e-3);
    EXPECT_GT(sum / kRays, 0.97);
  }
}

TEST(SmoothShading, FirstHitsTellTheSmoothNormal) {
  Scene scene = empty_scene(0.0);
  const TriangleMesh mesh = cap(16);
  scene.surfaces = {{mesh, Lambertian{grey(0.6)}, std::nullopt, normals_of_cap(mesh)}};
  const PinholeCamera camera = small_camera(40, 30);
  int hits = 0;
  for (const FirstHit& hit : first_hits(scene, make_ready(camera))) {
    if (hit.object != 0) continue;
    ++hits;
    const Eigen::Vector3d true_normal = (hit.position - kCentre).normalized();
    EXPECT_LT(std::acos(std::min(1.0, hit.normal.dot(true_normal))), 2e-3);
  }
  EXPECT_GT(hits, 100);
}

TEST(SmoothShading, FaultyNormalsAreRefused) {
  Scene scene = empty_scene(0.0);
  scene.surfaces = {{square_sheet(1.0, 0.0), Lambertian{grey(0.6)}}};
  scene.surfaces[0].normals = {{0, 0, 1}};
  EXPECT_THROW(check_scene(scene), Error);
  scene.surfaces[0].normals.assign(4, Eigen::Vector3d(0, 0, 2));
  EXPECT_THROW(check_scene(scene), Error);
  scene.surfaces[0].normals.assign(4, Eigen::Vector3d(0, 0, std::numeric_limits<double>::quiet_NaN()));
  EXPECT_THROW(check_scene(scene), Error);
  scene.surfaces[0].normals.assign(4, Eigen::Vector3d(0, 0, 1));
  EXPECT_NO_THROW(check_scene(scene));
}

}  // namespace
}  // namespace touchstone::render
