// Hard cases of light (27 of shared/DESIGN.md): faces, bodies and lamps where they are awkward. Each test says what a
// good program does with the case.

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "core/units.h"
#include "light_laws.h"

namespace touchstone::render {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Lambertian kWhite{grey(1.0)};

SpotLamp lamp_at(const Eigen::Vector3d& position, double lens_radius, double power_W = 1e-3) {
  SpotLamp lamp;
  lamp.position = position;
  lamp.direction = -position;
  lamp.lens_radius = lens_radius;
  lamp.half_angle = 0.6;
  lamp.power_W = grey(power_W);
  return lamp;
}

/// Glass and gel, a white membrane on it, a lamp below the glass: what a tactile sensor is.
Scene sensor(double environment = 0.0) {
  Scene scene = sensor_stack(environment);
  scene.surfaces.push_back({square_sheet(12.0, 0.0, false), Lambertian{grey(0.7)}});
  scene.lamps.push_back(lamp_at({8, 0, -20}, 1.0));
  return scene;
}

/// The largest difference of two pictures, relative to the brighter pixel.
double difference(const Scene& a, const Scene& b, const Camera& camera = few_pixels()) {
  const Eigen::ArrayXd one = values_of(Tracer(a).render(camera, samples(64, 16)).irradiance);
  const Eigen::ArrayXd other = values_of(Tracer(b).render(camera, samples(64, 16)).irradiance);
  EXPECT_GT(one.minCoeff(), 0.0);
  return ((one - other).abs() / one.max(other)).maxCoeff();
}

// Rounding of single precision in Embree's rays.
constexpr double kRounding = 2e-5;

TEST(HardLight, GrazingLampLightsByItsSine) {
  // At 1e-4 mm over the membrane the light comes in at some 1e-5 rad.
  for (const double height : {1.0, 1e-2, 1e-4}) {
    Scene scene = empty_scene(0.0);
    scene.surfaces.push_back({square_sheet(100.0, 0.0), kWhite});
    scene.lamps.push_back(half_space_lamp({10, 0, height}, {-1, 0, 0}, 1.0));
    const double r = std::hypot(10.0, height);
    const double expected = 1e6 * height / (kPi * r * r * r);
    EXPECT_NEAR(Tracer(scene).radiance({0, 0, 5}, {0, 0, -1}, samples(4))[0], expected, 1e-3 * expected) << height;
  }
}

TEST(HardLight, GrazingViewOfAWhiteSheetIsTheFurnace) {
  PinholeCamera camera = few_pixels();
  camera.pixel_pitch_um = 100.0;
  camera.gel_from_camera = look_at({-20, 0, 0.02}, {0, 0, 0.0}, {0, 0, 1});
  for (const Material& material :
       {Material(kWhite), Material(RoughConductor{grey(1.0), 0.5}), Material(DiffuseTransmitter{grey(0.5), grey(0.5)}),
        Material(ThinFilm{grey(1.0), 1.5, true}), Material(RoughRefractive{1, 0, 0.3})}) {
    Scene scene = empty_scene(1.0);
    scene.media.push_back(Medium{1.5});
    scene.surfaces.push_back({square_sheet(50.0, 0.0), material});
    const Seen seen = look(scene, camera);
    EXPECT_LE(seen.most(), 1.0 + 1e-2) << material.index();  // a metal's lost light comes back in the mean only
    EXPECT_GT(seen.least(), 0.0) << material.index();
    if (material.index() == 0) {
      EXPECT_TRUE(seen.is(1.0));
    }
  }
}

TEST(HardLight, CameraInsideTheGelSeesTheFurnaceWithoutTheFacesLoss) {
  Scene scene = sensor_stack(1.0);
  scene.surfaces.push_back({square_sheet(40.0, 0.0), Refractive{2, 0}});
  scene.balls.push_back({{0.5, 0, -1.0}, 0.4, kWhite});
  PinholeCamera camera = few_pixels();
  camera.gel_from_camera = look_at({0, 0, -4.0}, {0, 0, 0}, {0, 1, 0});
  EXPECT_TRUE(look(scene, camera).is(1.41 * 1.41));
}

TEST(HardLight, CameraOnAFaceSeesOneOfItsSides) {
  for (const double z : {-7.0, -5.0}) {
    Scene scene = sensor_stack(1.0);
    PinholeCamera camera = few_pixels();
    camera.gel_from_camera = look_at({0, 0, z}, {0, 0, 0}, {0, 1, 0});
    const Seen seen = look(scene, camera);
    const double below = z == -7.0 ? 1.0 : 1.52 * 1.52;
    EXPECT_TRUE(seen.is(below)) << seen.mean.transpose();
  }
}

TEST(HardLight, CameraInsideABodySeesThatBodyOnly) {
  Scene scene = empty_scene(5.0);
  scene.balls.push_back({{0, 0, -27}, 1.0, Emitter{grey(0.25)}});
  EXPECT_TRUE(look(scene, few_pixels()).is(0.25));
  scene.balls[0].material = Black{};
  EXPECT_EQ(look(scene, few_pixels()).most(), 0.0);
  scene.balls[0].material = Lambertian{grey(0.5)};
  EXPECT_EQ(look(scene, few_pixels()).most(), 0.0) << "no light gets in";
}

TEST(HardLight, MatchedFlatFacesChangeNothing) {
  const Scene plain = sensor(0.3);
  Scene cut = plain;
  cut.media.push_back(Medium{1.41});  // gel again
  cut.media.push_back(Medium{1.0});   // air again
  cut.faces = {{-20.5, 0, 4}, {-20.0, 4, 4}, {-7.0, 4, 1}, {-5.0, 1, 2}, {-3.0, 2, 3}, {-1e-3, 3, 2}};
  EXPECT_LT(difference(plain, cut), kRounding);
}

TEST(HardLight, MatchedBodiesAndFilmsChangeNothing) {
  const Scene plain = sensor(0.3);
  for (const bool rough : {false, true}) {
    Scene with = plain;
    with.media.push_back(Medium{1.41});
    const Material matched = rough ? Material(RoughRefractive{3, 2, 0.4}) : Material(Refractive{3, 2});
    with.balls.push_back({{1, 1, -2.5}, 1.5, matched});
    with.surfaces.push_back(
        {square_sheet(20.0, -4.0, true), rough ? Material(RoughRefractive{2, 2, 0.4}) : Material(Refractive{2, 2})});
    EXPECT_LT(difference(plain, with), kRounding) << rough;
  }
  Scene with = plain;
  with.surfaces.push_back({square_sheet(20.0, -4.0), ThinFilm{grey(1.0), 1.41, true}});
  EXPECT_LT(difference(plain, with), kRounding);
}

TEST(HardLight, LayersOfNoThicknessActAsTheirFacesSay) {
  // Air of no thickness between glass and gel: a crack, whose two faces mirror. The sky stays one all the same.
  Scene scene = sensor_stack(1.0);
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 0}, {-5.0, 0, 2}};
  scene.surfaces.push_back({square_sheet(40.0, 0.0, false), kWhite});
  EXPECT_TRUE(look(scene, few_pixels(), 256, 10000).is(1.0));
  scene.environment = grey(0.0);
  scene.lamps.push_back(lamp_at({8, 0, -20}, 1.0));
  const Seen crack = look(scene, few_pixels());
  EXPECT_GT(crack.most(), 0.0);
  // Less comes through two more mirrors than through bonded glass and gel.
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}};
  EXPECT_LT(crack.most(), look(scene, few_pixels()).most());
}

TEST(HardLight, GelSheetInTheGlassFaceKeepsTheFurnace) {
  // The gel's own lower face, as triangles, lies exactly in the flat face of the glass.
  Scene scene = sensor_stack(1.0);
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 0}};
  scene.surfaces.push_back({square_sheet(40.0, -5.0, false), Refractive{2, 0}});
  scene.surfaces.push_back({square_sheet(40.0, 0.0), Refractive{2, 0}});
  EXPECT_TRUE(look(scene, few_pixels()).is(1.0));
}

TEST(HardLight, TheSameSheetTwiceIsOneOfThem) {
  Scene scene = sensor(0.2);
  scene.surfaces.push_back({square_sheet(12.0, 0.0, false), Lambertian{grey(0.7)}});
  scene.surfaces.push_back({square_sheet(12.0, 0.0, true), Lambertian{grey(0.7)}});
  EXPECT_LT(difference(sensor(0.2), scene), kRounding);
}

TEST(HardLight, BeadsAtTheMembraneKeepTheFurnace) {
  // Under the face, touching it from below, cut by it, touching it from above, and coincident ones.
  for (const double z : {-0.5001, -0.5, -0.2, 0.0, 0.3, 0.5}) {
    Scene scene = sensor_stack(1.0);
    scene.surfaces.push_back({square_sheet(40.0, 0.0), Refractive{2, 0}});
    scene.balls.push_back({{0.3, 0, z}, 0.5, kWhite});
    scene.balls.push_back({{0.3, 0, z}, 0.5, kWhite});
    const Seen seen = look(scene, few_pixels(), 64, 10000);
    EXPECT_TRUE(seen.is(1.0)) << z << ": " << seen.least() << " to " << seen.most();
  }
}

TEST(HardLight, BeadsThroughTheGlassFaceKeepTheFurnace) {
  Scene scene = sensor_stack(1.0);
  scene.balls.push_back({{0, 0, -5.0}, 0.5, kWhite});
  scene.balls.push_back({{2, 0, -7.0}, 0.5, kWhite});
  scene.balls.push_back({{-2, 0, -4.5}, 0.5, kWhite});
  EXPECT_TRUE(look(scene, few_pixels(), 64, 10000).is(1.0));
}

TEST(HardLight, BlackMembraneGivesNothingBack) {
  Scene scene = sensor();
  scene.surfaces[0].material = Black{};
  EXPECT_EQ(look(scene, few_pixels()).most(), 0.0);
  scene.surfaces[0].material = Lambertian{grey(0.0)};
  EXPECT_EQ(look(scene, few_pixels()).most(), 0.0);
  scene.surfaces[0].material = RoughConductor{grey(0.0), 0.2};  // Schlick's rim light is all that is left
  const double rim = look(scene, few_pixels()).most();
  scene.surfaces[0].material = RoughConductor{grey(1.0), 0.2};
  EXPECT_LT(rim, 0.05 * look(scene, few_pixels()).most());
}

TEST(HardLight, ABrightLampInViewIsItsRadianceAndNoMore) {
  Scene scene = sensor(0.0);
  scene.balls.push_back({{0, 0, -12}, 3.0, Emitter{grey(1e6)}});
  const Seen seen = look(scene, few_pixels(), 1024);
  EXPECT_LE(seen.most(), 1e6 * (1.0 + 1e-6));
  EXPECT_GT(seen.most(), 0.9e6);
  EXPECT_GT(seen.least(), 1e3) << "it lights the membrane, too";
}

TEST(HardLight, FaultyTrianglesAreRefusedByName) {
  Scene scene = sensor();
  scene.surfaces[0].mesh.vertices[2].z() = kNan;
  EXPECT_THAT(refusal_of(scene), HasSubstr("surface 0: vertex 2 isn't finite"));
  scene = sensor();
  scene.surfaces[0].mesh.triangles[1] = {0, 2, 2};
  EXPECT_THAT(refusal_of(scene), HasSubstr("surface 0: triangle 1 has no area"));
  scene = sensor();
  scene.surfaces[0].mesh.vertices[1] = {0, 0, 0};  // in line with the diagonal's ends
  EXPECT_THAT(refusal_of(scene), HasSubstr("surface 0: triangle 0 has no area"));
}

TEST(HardLight, TrianglesBelowSinglePrecisionAreTakenAndHarmless) {
  // Sound in double precision; in Embree's single precision all three corners are one point, or lie on a line.
  Scene scene = sensor(0.3);
  TriangleMesh tiny = square_sheet(1e-9, 0.0);
  for (auto& vertex : tiny.vertices) vertex += Eigen::Vector3d(3.0, 3.0, -2.0);
  scene.surfaces.push_back({tiny, kWhite});
  TriangleMesh needle = square_sheet(1.0, 0.0);
  for (auto& vertex : needle.vertices) vertex = {vertex.x() + 3.0, 1e-9 * vertex.y() + 3.0, -2.0};
  scene.surfaces.push_back({needle, kWhite});
  scene.surfaces.push_back({needle, Refractive{0, 2}});
  EXPECT_LT(difference(sensor(0.3), scene), 1e-3);
  look(scene, few_pixels());
}

TEST(HardLight, OneTriangleAndNoTriangle) {
  Scene scene = sensor_stack(1.0);
  TriangleMesh one;
  one.vertices = {{-3, -3, 0}, {3, -3, 0}, {0, 3, 0}};
  one.triangles = {{0, 1, 2}};
  scene.surfaces.push_back({one, kWhite});
  scene.surfaces.push_back({TriangleMesh{}, kWhite});
  EXPECT_TRUE(look(scene, few_pixels(), 256, 10000).is(1.0));
}

TEST(HardLight, WhatIsOutOfSightChangesNothing) {
  const Scene plain = sensor(0.3);
  Scene with = plain;
  with.balls.push_back({{0, 0, -60}, 2.0, Black{}});          // behind the camera
  with.balls.push_back({{5000, 0, 5000}, 1.0, kWhite});       // far away
  with.surfaces.push_back({square_sheet(3.0, 9.0), kWhite});  // beyond the membrane
  // The ball behind the camera hides some of the sky that the membrane sees through the glass.
  EXPECT_LT(difference(plain, with), 0.05);
  with.balls.erase(with.balls.begin());
  EXPECT_LT(difference(plain, with), kRounding);
}

TEST(HardLight, HugeCoordinatesAreRefusedByName) {
  const auto spoilt = [](auto&& spoil) {
    Scene scene = sensor();
    scene.balls.push_back({{0, 0, -1}, 0.25, kWhite});
    spoil(scene);
    return refusal_of(scene);
  };
  EXPECT_THAT(spoilt([](Scene& s) { s.surfaces[0].mesh.vertices[1].x() = 1e6; }), HasSubstr("surface 0: vertex 1"));
  EXPECT_THAT(spoilt([](Scene& s) { s.balls[0].centre.x() = 1e6; }), HasSubstr("ball 0"));
  EXPECT_THAT(spoilt([](Scene& s) { s.balls[0].centre.x() = 1e300; }), HasSubstr("ball 0"));
  EXPECT_THAT(spoilt([](Scene& s) { s.lamps.push_back(lamp_at({0, -1e6, 0}, 1.0)); }), HasSubstr("lamp 1"));
  EXPECT_THAT(spoilt([](Scene& s) { s.faces[0].z = -1e6; }), HasSubstr("face 0"));
  PinholeCamera camera = few_pixels();
  camera.gel_from_camera.translation.x() = 1e6;
  const Tracer tracer(sensor());
  EXPECT_THAT(refusal([&] { tracer.render(camera, samples(1)); }), HasSubstr("gel_from_camera"));
  LensCamera lens;
  lens.width = lens.height = 4;
  lens.matrix = {500, 500, 2, 2};
  lens.gel_from_camera.translation.z() = -1e300;
  EXPECT_THAT(refusal([&] { tracer.render(lens, samples(1)); }), HasSubstr("gel_from_camera"));
}

TEST(HardLight, AMetreFromTheOriginTheFurnaceHolds) {
  Scene scene = empty_scene(1.0);
  const Eigen::Vector3d far(1e3, 0, 0);
  TriangleMesh sheet = square_sheet(50.0, 0.0, false);
  for (auto& vertex : sheet.vertices) vertex += far;
  scene.surfaces.push_back({sheet, kWhite});
  scene.balls.push_back({far + Eigen::Vector3d(0, 0, -5), 2.0, kWhite});
  PinholeCamera camera = few_pixels();
  camera.gel_from_camera.translation += far;
  EXPECT_TRUE(look(scene, camera, 64, 10000).is(1.0));
}

TEST(HardLight, TinyBodiesAreHarmless) {
  // A millionth of a millimetre is less than the distance at which rays leave a surface.
  Scene scene = sensor_stack(1.0);
  scene.surfaces.push_back({square_sheet(1e-6, -1.0, false), kWhite});
  scene.balls.push_back({{0, 0, -2}, 1e-6, kWhite});
  scene.balls.push_back({{0, 0, -3}, 1e-6, Refractive{0, 2}});
  EXPECT_TRUE(look(scene, few_pixels(), 64, 10000).is(1.0));
  // Looked at from as near.
  PinholeCamera camera = few_pixels();
  camera.hole_diameter_um = 1e-4;
  camera.foil_thickness_um = 0.0;
  camera.gel_from_camera = look_at({0, 0, -1.0 - 1e-5}, {0, 0, -1}, {0, 1, 0});
  EXPECT_TRUE(look(scene, camera, 64, 10000).is(1.41 * 1.41));
}

}  // namespace
}  // namespace touchstone::render
