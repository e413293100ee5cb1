// Closed boxes: what lamps send out, walls take in. And form factors, white prints, beads in fog.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "closed_forms/light_closed_forms.h"
#include "core/random.h"
#include "core/units.h"
#include "light_scenes.h"

namespace touchstone::render {
namespace {

constexpr double kHalf = 5.0;
constexpr std::array<double, 6> kAlbedos = {0.9, 0.5, 0.2, 0.7, 0.4, 0.8};

/// The wall of axis a, at kHalf or -kHalf: a point of it for x, y from -1 to 1.
Eigen::Vector3d on_wall(int wall, double x, double y) {
  const int axis = wall / 2;
  Eigen::Vector3d point;
  point[axis] = wall % 2 == 0 ? kHalf : -kHalf;
  point[(axis + 1) % 3] = kHalf * x;
  point[(axis + 2) % 3] = kHalf * y;
  return point;
}

/// Six matt walls, each of another albedo, and a lamp that sends 1 W/sr all round.
Scene box_with_a_lamp() {
  Scene scene = empty_scene(0.0);
  for (int wall = 0; wall < 6; ++wall) {
    TriangleMesh mesh;
    for (const auto& [x, y] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
      mesh.vertices.push_back(on_wall(wall, x, y));
    }
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.surfaces.push_back({mesh, Lambertian{grey(kAlbedos[wall])}});
  }
  for (double sense : {-1.0, 1.0}) scene.lamps.push_back(half_space_lamp({1.0, -0.7, 2.0}, {0, 0, sense}, 1.0));
  return scene;
}

/// The power (W) that the walls take in: a wall that shows the radiance L takes (1 - albedo) pi L / albedo from each
/// m^2.
Estimate absorbed(const Scene& scene, int points) {
  const Tracer tracer(scene);
  RandomStream stream(500, 0, Purpose::kTest);
  constexpr double kArea = 4.0 * kHalf * kHalf * 1e-6;
  Estimate sum;
  for (int wall = 0; wall < 6; ++wall) {
    const double share = (1.0 - kAlbedos[wall]) * kPi / kAlbedos[wall] * kArea;
    double mean = 0.0;
    double squares = 0.0;
    for (int i = 0; i < points; ++i) {
      const double x = 2.0 * stream.uniform() - 1.0;
      const Eigen::Vector3d place = on_wall(wall, x, 2.0 * stream.uniform() - 1.0);
      const Eigen::Vector3d inward = -place.normalized();  // seen from close by, so that nothing stands before it
      RenderSettings settings = samples(4);
      settings.seed = static_cast<std::uint64_t>(wall * points + i);
      const double light = share * tracer.radiance(place + 1e-3 * inward, -inward, settings)[0];
      mean += light / points;
      squares += light * light / points;
    }
    sum.mean += mean;
    sum.error += (squares - mean * mean) / points;
  }
  sum.error = std::sqrt(sum.error);
  return sum;
}

void expect_balance(const Scene& scene, const char* what, double most_error = 0.035) {
  const Estimate found = absorbed(scene, 3000);
  EXPECT_NEAR(found.mean, 4.0 * kPi, 4.0 * found.error) << what;
  EXPECT_LT(found.error, most_error * 4.0 * kPi) << what;
}

TEST(ClosedBox, WallsTakeInWhatTheLampSends) {
  expect_balance(box_with_a_lamp(), "empty");
}

// Things that absorb nothing change where light goes and not how much there is.
TEST(ClosedBox, LosslessThingsInItTakeNothing) {
  Scene matt = box_with_a_lamp();
  matt.balls.push_back({{-1.5, 1.0, -1.0}, 2.0, Lambertian{grey(1.0)}});
  expect_balance(matt, "a white ball");

  Scene sheet = box_with_a_lamp();
  sheet.surfaces.push_back({square_sheet(3.0, 0.0), DiffuseTransmitter{grey(0.35), grey(0.65)}});
  expect_balance(sheet, "a diffuse transmitter");

  for (const auto& [alpha, index] : {std::pair(0.4, 1.6), std::pair(0.7, 1.3)}) {
    Scene glass = box_with_a_lamp();
    glass.media = {Medium{}, Medium{index}};
    glass.balls.push_back({{-1.5, 1.0, -1.0}, 2.0, RoughRefractive{1, 0, alpha}});
    expect_balance(glass, "a rough glass ball");
  }

  Scene foggy = box_with_a_lamp();
  foggy.media = {Medium{1.0, {}, grey(0.1), 0.6}};
  foggy.balls.push_back({{-1.5, 1.0, -1.0}, 2.0, Lambertian{grey(1.0)}});
  expect_balance(foggy, "fog", 0.08);  // particles beside the lamp shine brightly
}

// What black things take is missing.
TEST(ClosedBox, ABlackBallIsMissed) {
  Scene scene = box_with_a_lamp();
  scene.balls.push_back({{-1.5, 1.0, -1.0}, 2.0, Black{}});
  const Estimate found = absorbed(scene, 1000);
  EXPECT_LT(found.mean, 0.9 * 4.0 * kPi);
}

TEST(FormFactors, OfCoaxialDiscs) {
  // A disc that covers nearly the whole half space takes nearly all; a small one its share of a point's hemisphere.
  EXPECT_NEAR(closed_forms::coaxial_discs_share(1.0, 1e4, 1.0), 1.0, 1e-7);
  EXPECT_NEAR(closed_forms::coaxial_discs_share(1e-4, 1.5, 2.0), closed_forms::disc_share(1.5, 2.0), 1e-6);
  EXPECT_NEAR(1.0 * closed_forms::coaxial_discs_share(1.0, 2.0, 1.5),
              4.0 * closed_forms::coaxial_discs_share(2.0, 1.0, 1.5), 1e-12);

  const auto disc = [](double radius, double z) {
    TriangleMesh mesh;
    mesh.vertices.push_back({0, 0, z});
    constexpr int kCorners = 400;
    for (int i = 0; i < kCorners; ++i) {
      const double angle = 2.0 * kPi * i / kCorners;
      mesh.vertices.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
      mesh.triangles.push_back({0, i + 1, (i + 1) % kCorners + 1});
    }
    return mesh;
  };
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({disc(2.0, 1.5), Emitter{grey(1.0)}});
  scene.surfaces.push_back({disc(1.001, 0.0), Lambertian{grey(0.8)}});
  const Tracer tracer(scene);
  RandomStream stream(510, 0, Purpose::kTest);
  double sum = 0.0;
  constexpr int kPoints = 4000;
  for (int i = 0; i < kPoints; ++i) {  // places of the lower disc, seen from close by
    const double radius = std::sqrt(stream.uniform());
    const double angle = 2.0 * kPi * stream.uniform();
    const Eigen::Vector3d from(radius * std::cos(angle), radius * std::sin(angle), 0.01);
    RenderSettings settings = samples(16);
    settings.seed = static_cast<std::uint64_t>(i);
    sum += tracer.radiance(from, {0, 0, -1}, settings)[0] / (0.8 * kPoints);
  }
  EXPECT_NEAR(sum, closed_forms::coaxial_discs_share(1.0, 2.0, 1.5), 4.0 * 0.5 / std::sqrt(16.0 * kPoints));
}

TEST(WhiteFurnace, WhitePrintOnWhiteReturnsOne) {
  for (const Material& ground : {Material(Lambertian{grey(1.0)}), Material(RoughConductor{grey(1.0), 0.3})}) {
    Scene scene = sensor_stack(1.0);
    Print print;
    print.material_mm = {{-4, -4}, {4, -4}, {4, 4}, {-4, 4}};
    print.inks = {grey(1.0)};
    for (int i = 0; i < 5; ++i) print.marks.push_back({{-2.0 + i, 0.3 * i}, 0.4, 0});
    scene.surfaces.push_back({square_sheet(10.0, 0.1), Refractive{2, 0}});
    scene.surfaces.push_back({square_sheet(4.0, 0.0, false), ground, print});
    for (double x : {-2.0, -1.5, 0.0, 1.1}) {
      const Estimate seen = view(scene, {x, -1.0, -27}, {0, 0.035, 1}, 200);
      EXPECT_NEAR(seen.mean, 1.0, 4.0 * seen.error + 5e-3) << x;  // a white metal's table is good to some 1e-3
      EXPECT_LT(seen.error, 0.01);
    }
  }
}

TEST(WhiteFurnace, BeadsOfAllKindsInAMilkyGelReturnOne) {
  Scene scene = sensor_stack(1.0);
  scene.media[2] = Medium{1.41, {}, grey(0.5), 0.7};
  scene.media.push_back(Medium{1.6});
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Refractive{2, 0}});
  scene.balls.push_back({{-1.2, 0, -1.5}, 0.6, Lambertian{grey(1.0)}});
  scene.balls.push_back({{1.2, 0, -1.5}, 0.6, Refractive{3, 2}});
  scene.balls.push_back({{0, 1.2, -1.5}, 0.6, RoughRefractive{3, 2, 0.3}});
  scene.balls.push_back({{0, -1.2, -1.5}, 0.6, Refractive{0, 2}});
  scene.surfaces.push_back({square_sheet(0.5, -3.0), DiffuseTransmitter{grey(0.5), grey(0.5)}});
  scene.surfaces.push_back({square_sheet(0.8, -4.0), ThinFilm{grey(1.0), 1.5, true}});
  for (const auto& [x, y] : {std::pair(-1.2, 0.0), std::pair(1.2, 0.1), std::pair(0.1, 1.2), std::pair(0.0, -1.2)}) {
    const Estimate seen = view(scene, {x, y, -20}, {0, 0, 1}, 200);
    EXPECT_NEAR(seen.mean, 1.0, 4.0 * seen.error + 1e-9) << x << " " << y;
    EXPECT_LT(seen.error, 0.01);
  }
}

}  // namespace
}  // namespace touchstone::render
