// Lamps that are seen: by the camera, and by paths that share their light with connections.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "closed_forms/light_closed_forms.h"
#include "lamp_scenes.h"

namespace touchstone::render {
namespace {

/// A luminous square of side 2 mm that shines down from `height`.
AreaLamp square_above(double height, bool visible) {
  AreaLamp area;
  area.centre = {0.5, 0, height};
  area.direction = {0, 0, -1};
  area.width = area.height = 2.0;
  area.power_W = grey(4e-6 * kPi);  // radiance 1
  area.visible = visible;
  return area;
}

void expect_equal(const Estimate& a, const Estimate& b, const std::string& what) {
  EXPECT_GT(a.mean, 0.0) << what;
  EXPECT_LT(std::hypot(a.error, b.error), 0.02 * a.mean) << what << ": the test is too coarse";
  EXPECT_LT(difference(a, b), 4.0) << what << ": " << a.mean << " +- " << a.error << " and " << b.mean << " +- "
                                   << b.error;
}

TEST(SeenLamp, ShowsItsRadianceFromBeforeAndBlackFromBehind) {
  Scene scene = empty_scene(0.3);
  scene.lamps = {square_above(2.0, true)};
  const Tracer tracer(scene);
  for (double angle : {0.0, 0.6}) {
    const Eigen::Vector3d viewing(std::sin(angle), 0, std::cos(angle));
    EXPECT_NEAR(tracer.radiance(Eigen::Vector3d(0.5, 0, 2) - 3.0 * viewing, viewing, samples(1))[0], 1.0, 1e-12)
        << angle;
    EXPECT_EQ(tracer.radiance(Eigen::Vector3d(0.5, 0, 2) + 3.0 * viewing, -viewing, samples(1))[0], 0.0) << angle;
  }
  EXPECT_EQ(tracer.radiance({1.6, 0, 0}, {0, 0, 1}, samples(1))[0], 0.3) << "beside it";
  scene.lamps = {square_above(2.0, false)};
  EXPECT_EQ(Tracer(scene).radiance({0.5, 0, 0}, {0, 0, 1}, samples(1))[0], 0.3) << "a lamp that isn't visible";
}

TEST(SeenLamp, NarrowLobeShowsLessFromTheSide) {
  Scene scene = empty_scene(0.0);
  LedLamp led;
  led.position = {0, 0, 5};
  led.direction = {0, 0, -1};
  led.radius = 1.0;
  led.half_power_angle = 30.0 * kRadiansPerDegree;
  led.power_W = grey(1.0);
  led.visible = true;
  scene.lamps = {led};
  const double m = lobe_exponent(led.half_power_angle);
  const double on_axis = (m + 1.0) / (2.0 * kPi) / (kPi * 1e-6);
  const Tracer tracer(scene);
  for (double angle : {0.0, 0.5, 1.2}) {
    const Eigen::Vector3d viewing(std::sin(angle), 0, std::cos(angle));
    EXPECT_NEAR(tracer.radiance(led.position - 4.0 * viewing, viewing, samples(1))[0] / on_axis,
                std::pow(std::cos(angle), m - 1.0), 1e-9);
  }
}

// Through the plate T of it, mirrored in the plate what T leaves.
TEST(SeenLamp, IsSeenThroughAPlateAndInIt) {
  Scene scene = empty_scene(0.0);
  scene.media = {Medium{1.0, {}}, Medium{1.5, {}}};
  scene.faces = {{3.0, 0, 1}, {4.0, 1, 0}};
  scene.lamps = {square_above(6.0, true)};
  const double passed = closed_forms::plate_transmittance(1.5, 0.0);
  EXPECT_NEAR(Tracer(scene).radiance({0.5, 0, 0}, {0, 0, 1}, samples(4096))[0], passed, 1e-3);
  AreaLamp below = square_above(0.0, true);
  below.direction = {0, 0, 1};
  scene.lamps = {below};
  EXPECT_NEAR(Tracer(scene).radiance({0.5, 0, 1}, {0, 0, 1}, samples(4096))[0], 1.0 - passed, 1e-3);
}

TEST(SeenLamp, StandsInTheWayOfOtherLight) {
  Scene scene = empty_scene(0.0);
  scene.lamps = {half_space_lamp({0.5, 0, 9}, {0, 0, -1}, 1.0)};
  EXPECT_GT(irradiance_at(scene, 0.5, 0, 1, 1), 0.0);
  AreaLamp dark = square_above(2.0, true);
  dark.power_W = grey(0.0);
  scene.lamps.push_back(dark);
  EXPECT_EQ(irradiance_at(scene, 0.5, 0, 1, 16), 0.0);
  EXPECT_GT(irradiance_at(scene, 3.0, 0, 1, 16), 0.0);
}

// With paths that run into the lamp and without them: the same mean, whatever lies in the lamp's light.
TEST(SharedLight, IsThatOfConnectionsAlone) {
  struct Thing {
    const char* what;
    Material material;
    double height;
  };
  for (const Thing& thing :
       {Thing{"matt, close by", Lambertian{grey(0.7)}, 0.3}, Thing{"matt", Lambertian{grey(0.7)}, 4},
        Thing{"metal", RoughConductor{grey(0.8), 0.3}, 1.0},
        Thing{"transmitter", DiffuseTransmitter{grey(0.5), grey(0.4)}, 0.5},
        Thing{"rough glass", RoughRefractive{1, 0, 0.3}, 1.0}}) {
    Scene scene = empty_scene(0.0);
    scene.media = {Medium{1.0, {}}, Medium{1.4, {}}};
    scene.surfaces.push_back({square_sheet(50.0, 0.0), thing.material});
    const auto seen = [&](bool visible) {
      AreaLamp beside = square_above(thing.height + 1.0, visible);  // not behind the other
      beside.centre.y() = 12.0;
      scene.lamps = {square_above(thing.height, visible), beside};
      // Across the lamp's own light, so that it isn't seen itself.
      return view(scene, {-4, 0, 0.2}, {4.5, 0, -0.2}, 4000);
    };
    expect_equal(seen(false), seen(true), thing.what);
  }
}

/// An Emitter of radiance 1 where a level AreaLamp shines up or down, with a black back.
void add_luminous_twin(Scene& scene, const AreaLamp& area) {
  TriangleMesh mesh;
  const Eigen::Vector3d& c = area.centre;
  for (const auto& [x, y] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
    mesh.vertices.emplace_back(c.x() + x * area.width, c.y() + y * area.height, c.z());
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.surfaces.push_back({mesh, Emitter{grey(1.0)}});
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex.z() -= 1e-3 * area.direction.z();
  scene.surfaces.push_back({mesh, Black{}});
}

// The strongest law: an Emitter of the same radiance, which only paths find, lights all just the same, through glass
// and gel with all their mirror images.
TEST(SharedLight, IsThatOfALuminousSurface) {
  for (const bool in_gel : {false, true}) {
    Scene scene = sensor_stack(0.0);
    scene.surfaces.push_back({square_sheet(30.0, 0.0, false), Lambertian{grey(0.6)}});
    scene.surfaces.push_back({square_sheet(1.0, -2.0), RoughConductor{grey(0.8), 0.4}});
    AreaLamp area;
    area.centre = in_gel ? Eigen::Vector3d(3, 0, -4.5) : Eigen::Vector3d(3, 0, -10);
    area.direction = {0, 0, 1};
    area.width = 4.0;
    area.height = 6.0;
    area.visible = true;
    const double index = in_gel ? 1.41 : 1.0;
    area.power_W = grey(24e-6 * kPi * index * index);
    Scene luminous = scene;
    add_luminous_twin(luminous, area);
    scene.lamps = {area};
    const std::string where = in_gel ? "in the gel: " : "in air: ";
    expect_equal(view(scene, {-3, 0, -1}, {0.5, 0, 1}, 3000), view(luminous, {-3, 0, -1}, {0.5, 0, 1}, 12000),
                 where + "membrane");
    expect_equal(view(scene, {-3, 0, -1}, {3, 0, -1}, 3000), view(luminous, {-3, 0, -1}, {3, 0, -1}, 6000),
                 where + "metal, lit by mirrored light");
  }
}

TEST(SharedLight, InAScatteringMediumIsThatOfALuminousSurface) {
  Scene scene = empty_scene(0.0);
  scene.media = {Medium{1.0, grey(0.05), grey(0.4), 0.5}};
  Scene luminous = scene;
  add_luminous_twin(luminous, square_above(1.0, true));
  scene.lamps = {square_above(1.0, true)};
  expect_equal(view(scene, {-6, 0, 0.3}, {1, 0, 0}, 5000), view(luminous, {-6, 0, 0.3}, {1, 0, 0}, 12000), "milk");
}

TEST(SharedLight, IsLessNoisyThanConnectionsCloseToTheLamp) {
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({square_sheet(50.0, 0.0), Lambertian{grey(0.7)}});
  const auto error = [&](bool visible) {
    scene.lamps = {square_above(0.05, visible)};
    return view(scene, {-4, 0, 0.02}, {4.5, 0, -0.02}, 4000).error;
  };
  EXPECT_LT(error(true), 0.3 * error(false));
}

TEST(DarkLamps, OfEveryKindGiveNoLight) {
  Scene scene = sensor_stack(0.0);
  scene.surfaces.push_back({square_sheet(30.0, 0.0, false), Lambertian{grey(0.6)}});
  AreaLamp area = square_above(-1.0, true);
  GuideLamp guide;
  guide.centre = {-5, 0, -6};
  ProjectedLamp thrown;
  thrown.position = {0, 0, -20};
  thrown.pattern = cv::Mat(2, 2, CV_8UC1, cv::Scalar(3));
  for (Lamp lamp : {Lamp(LedLamp{}), Lamp(area), Lamp(guide), Lamp(thrown)}) {
    std::visit([](auto& one) { one.power_W = grey(0.0); }, lamp);
    scene.lamps.push_back(lamp);
  }
  EXPECT_EQ(Tracer(scene).radiance({0, 0, -0.5}, {0, 0, 1}, samples(64))[0], 0.0);
}

}  // namespace
}  // namespace touchstone::render
