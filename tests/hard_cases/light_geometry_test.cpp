// The hard case of light, 27: faces, bodies and lamps where they are awkward. What a good program does with it stands
// in script/hard_cases_page.py; the numbers of its pictures are radiances.

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

TEST(HardCase27Light, GrazingLampLightsByItsSine) {
  Worst away{1e-3};
  // At 1e-4 mm over the membrane the light comes in at some 1e-5 rad.
  for (const double height : {1.0, 1e-2, 1e-4}) {
    Scene scene = empty_scene(0.0);
    scene.surfaces.push_back({square_sheet(100.0, 0.0), kWhite});
    scene.lamps.push_back(half_space_lamp({10, 0, height}, {-1, 0, 0}, 1.0));
    const double r = std::hypot(10.0, height);
    const double expected = 1e6 * height / (kPi * r * r * r);
    const double seen = Tracer(scene).radiance({0, 0, 5}, {0, 0, -1}, samples(4))[0];
    EXPECT_LT(away(std::abs(seen / expected - 1.0)), away.bar) << height;
  }
  did("a lamp 10 mm off and 1, 0.01 and 0.0001 mm over a sheet: its light differs from the law of sine by {}",
      away.text("relative"));
}

TEST(HardCase27Light, GrazingViewOfAWhiteSheetIsTheFurnace) {
  PinholeCamera camera = few_pixels();
  camera.pixel_pitch_um = 100.0;
  camera.gel_from_camera = look_at({-20, 0, 0.02}, {0, 0, 0.0}, {0, 0, 1});
  double least = 1.0;
  Worst most{1.01};
  for (const Material& material :
       {Material(kWhite), Material(RoughConductor{grey(1.0), 0.5}), Material(DiffuseTransmitter{grey(0.5), grey(0.5)}),
        Material(ThinFilm{grey(1.0), 1.5, true}), Material(RoughRefractive{1, 0, 0.3})}) {
    Scene scene = empty_scene(1.0);
    scene.media.push_back(Medium{1.5});
    scene.surfaces.push_back({square_sheet(50.0, 0.0), material});
    const Seen seen = render_checked(scene, camera);
    EXPECT_LE(most(seen.most()), most.bar) << material.index();  // a metal's lost light comes back in the mean only
    EXPECT_GT(seen.least(), 0.0) << material.index();
    if (material.index() == 0) {
      EXPECT_TRUE(seen.is(1.0));
    }
    least = std::min(least, seen.least());
  }
  did("sheets of five loss-free materials under a sky of 1, seen at 0.06 degrees: {:.4g} to {}", least, most.text());
}

TEST(HardCase27Light, CameraInsideTheGelSeesTheFurnaceWithoutTheFacesLoss) {
  Scene scene = sensor_stack(1.0);
  scene.surfaces.push_back({square_sheet(40.0, 0.0), Refractive{2, 0}});
  scene.balls.push_back({{0.5, 0, -1.0}, 0.4, kWhite});
  PinholeCamera camera = few_pixels();
  camera.gel_from_camera = look_at({0, 0, -4.0}, {0, 0, 0}, {0, 1, 0});
  const Seen seen = render_checked(scene, camera);
  EXPECT_TRUE(seen.is(1.41 * 1.41));
  did("a camera inside the gel (n = 1.41) under a sky of 1 with a white bead in it: {} (n squared is {:.5g})",
      seen.range(), 1.41 * 1.41);
}

TEST(HardCase27Light, CameraOnAFaceSeesOneOfItsSides) {
  for (const double z : {-7.0, -5.0}) {
    Scene scene = sensor_stack(1.0);
    PinholeCamera camera = few_pixels();
    camera.gel_from_camera = look_at({0, 0, z}, {0, 0, 0}, {0, 1, 0});
    const Seen seen = render_checked(scene, camera);
    const double below = z == -7.0 ? 1.0 : 1.52 * 1.52;
    EXPECT_TRUE(seen.is(below)) << seen.mean.transpose();
    did("a camera in the plane of a face at {} mm under a sky of 1: {} (one of the face's sides: {:.5g})", z,
        seen.range(), below);
  }
}

TEST(HardCase27Light, CameraInsideABodySeesThatBodyOnly) {
  Scene scene = empty_scene(5.0);
  scene.balls.push_back({{0, 0, -27}, 1.0, Emitter{grey(0.25)}});
  const Seen inside = render_checked(scene, few_pixels());
  EXPECT_TRUE(inside.is(0.25));
  scene.balls[0].material = Black{};
  const double black = render_checked(scene, few_pixels()).most();
  EXPECT_EQ(black, 0.0);
  scene.balls[0].material = Lambertian{grey(0.5)};
  const double matt = render_checked(scene, few_pixels()).most();
  EXPECT_EQ(matt, 0.0) << "no light gets in";
  did("a camera inside a ball that shines with 0.25: {}; inside a black one: {}; inside a matt one: {}", inside.range(),
      black, matt);
}

TEST(HardCase27Light, MatchedFlatFacesChangeNothing) {
  const Scene plain = sensor(0.3);
  Scene cut = plain;
  cut.media.push_back(Medium{1.41});  // gel again
  cut.media.push_back(Medium{1.0});   // air again
  cut.faces = {{-20.5, 0, 4}, {-20.0, 4, 4}, {-7.0, 4, 1}, {-5.0, 1, 2}, {-3.0, 2, 3}, {-1e-3, 3, 2}};
  Worst away{kRounding};
  EXPECT_LT(away(difference(plain, cut)), away.bar);
  did("four more flat faces between equal indices: pixels differ by {}", away.text("relative"));
}

TEST(HardCase27Light, MatchedBodiesAndFilmsChangeNothing) {
  const Scene plain = sensor(0.3);
  Worst away{kRounding};
  for (const bool rough : {false, true}) {
    Scene with = plain;
    with.media.push_back(Medium{1.41});
    const Material matched = rough ? Material(RoughRefractive{3, 2, 0.4}) : Material(Refractive{3, 2});
    with.balls.push_back({{1, 1, -2.5}, 1.5, matched});
    with.surfaces.push_back(
        {square_sheet(20.0, -4.0, true), rough ? Material(RoughRefractive{2, 2, 0.4}) : Material(Refractive{2, 2})});
    EXPECT_LT(away(difference(plain, with)), away.bar) << rough;
  }
  Scene with = plain;
  with.surfaces.push_back({square_sheet(20.0, -4.0), ThinFilm{grey(1.0), 1.41, true}});
  EXPECT_LT(away(difference(plain, with)), away.bar);
  did("a ball, a sheet and a film of the gel's own index, smooth and rough: pixels differ by {}",
      away.text("relative"));
}

TEST(HardCase27Light, LayersOfNoThicknessActAsTheirFacesSay) {
  // Air of no thickness between glass and gel: a crack, whose two faces mirror. The sky stays one all the same.
  Scene scene = sensor_stack(1.0);
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 0}, {-5.0, 0, 2}};
  scene.surfaces.push_back({square_sheet(40.0, 0.0, false), kWhite});
  const Seen sky = render_checked(scene, few_pixels(), 256, 10000);
  EXPECT_TRUE(sky.is(1.0));
  scene.environment = grey(0.0);
  scene.lamps.push_back(lamp_at({8, 0, -20}, 1.0));
  const Seen crack = render_checked(scene, few_pixels());
  EXPECT_GT(crack.most(), 0.0);
  // Less comes through two more mirrors than through bonded glass and gel.
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}};
  const Seen bonded = render_checked(scene, few_pixels());
  EXPECT_LT(crack.most(), bonded.most());
  did("a crack of no thickness between glass and gel under a sky of 1: {}; of a lamp {:.3g} of what bonded faces let "
      "through",
      sky.range(), crack.most() / bonded.most());
}

TEST(HardCase27Light, GelSheetInTheGlassFaceKeepsTheFurnace) {
  // The gel's own lower face, as triangles, lies exactly in the flat face of the glass.
  Scene scene = sensor_stack(1.0);
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 0}};
  scene.surfaces.push_back({square_sheet(40.0, -5.0, false), Refractive{2, 0}});
  scene.surfaces.push_back({square_sheet(40.0, 0.0), Refractive{2, 0}});
  const Seen seen = render_checked(scene, few_pixels());
  EXPECT_TRUE(seen.is(1.0));
  did("the gel's face as triangles exactly in the glass's flat face under a sky of 1: {}", seen.range());
}

TEST(HardCase27Light, TheSameSheetTwiceIsOneOfThem) {
  Scene scene = sensor(0.2);
  scene.surfaces.push_back({square_sheet(12.0, 0.0, false), Lambertian{grey(0.7)}});
  scene.surfaces.push_back({square_sheet(12.0, 0.0, true), Lambertian{grey(0.7)}});
  Worst away{kRounding};
  EXPECT_LT(away(difference(sensor(0.2), scene)), away.bar);
  did("the same sheet three times in one place: pixels differ from one sheet's by {}", away.text("relative"));
}

TEST(HardCase27Light, BeadsAtTheMembraneKeepTheFurnace) {
  double least = HUGE_VAL;
  double most = 0.0;
  // Under the face, touching it from below, cut by it, touching it from above, and coincident ones.
  for (const double z : {-0.5001, -0.5, -0.2, 0.0, 0.3, 0.5}) {
    Scene scene = sensor_stack(1.0);
    scene.surfaces.push_back({square_sheet(40.0, 0.0), Refractive{2, 0}});
    scene.balls.push_back({{0.3, 0, z}, 0.5, kWhite});
    scene.balls.push_back({{0.3, 0, z}, 0.5, kWhite});
    const Seen seen = render_checked(scene, few_pixels(), 64, 10000);
    EXPECT_TRUE(seen.is(1.0)) << z << ": " << seen.least() << " to " << seen.most();
    least = std::min(least, seen.least());
    most = std::max(most, seen.most());
  }
  did("two coincident white beads below, in and above the membrane, touching it and not, under a sky of 1: {:.5g} to "
      "{:.5g}",
      least, most);
}

TEST(HardCase27Light, BeadsThroughTheGlassFaceKeepTheFurnace) {
  Scene scene = sensor_stack(1.0);
  scene.balls.push_back({{0, 0, -5.0}, 0.5, kWhite});
  scene.balls.push_back({{2, 0, -7.0}, 0.5, kWhite});
  scene.balls.push_back({{-2, 0, -4.5}, 0.5, kWhite});
  const Seen seen = render_checked(scene, few_pixels(), 64, 10000);
  EXPECT_TRUE(seen.is(1.0));
  did("white beads cut by the glass's faces under a sky of 1: {}", seen.range());
}

TEST(HardCase27Light, BlackMembraneGivesNothingBack) {
  Scene scene = sensor();
  scene.surfaces[0].material = Black{};
  const double black = render_checked(scene, few_pixels()).most();
  EXPECT_EQ(black, 0.0);
  scene.surfaces[0].material = Lambertian{grey(0.0)};
  EXPECT_EQ(render_checked(scene, few_pixels()).most(), 0.0);
  scene.surfaces[0].material = RoughConductor{grey(0.0), 0.2};  // Schlick's rim light is all that is left
  const double rim = render_checked(scene, few_pixels()).most();
  scene.surfaces[0].material = RoughConductor{grey(1.0), 0.2};
  Worst share{0.05};
  EXPECT_LT(share(rim / render_checked(scene, few_pixels()).most()), share.bar);
  did("a black membrane: {}; a metal that reflects nothing but at its rim: {} of a bright one", black, share.text());
}

TEST(HardCase27Light, ABrightLampInViewIsItsRadianceAndNoMore) {
  Scene scene = sensor(0.0);
  scene.balls.push_back({{0, 0, -12}, 3.0, Emitter{grey(1e6)}});
  const Seen seen = render_checked(scene, few_pixels(), 1024);
  EXPECT_LE(seen.most(), 1e6 * (1.0 + 1e-6));
  EXPECT_GT(seen.most(), 0.9e6);
  EXPECT_GT(seen.least(), 1e3) << "it lights the membrane, too";
  did("a lamp of radiance 1e6 in view: its pixels {:.7g}, the membrane's from {:.3g} up", seen.most(), seen.least());
}

TEST(HardCase27Light, FaultyTrianglesAreRefusedByName) {
  const auto said = [](const Scene& faulty) {
    const std::string message = refusal_of(faulty);
    did("a faulty triangle is {}", refused(message));
    return message;
  };
  Scene scene = sensor();
  scene.surfaces[0].mesh.vertices[2].z() = kNan;
  EXPECT_THAT(said(scene), HasSubstr("surface 0: vertex 2 isn't finite"));
  scene = sensor();
  scene.surfaces[0].mesh.triangles[1] = {0, 2, 2};
  EXPECT_THAT(said(scene), HasSubstr("surface 0: triangle 1 has no area"));
  scene = sensor();
  scene.surfaces[0].mesh.vertices[1] = {0, 0, 0};  // in line with the diagonal's ends
  EXPECT_THAT(said(scene), HasSubstr("surface 0: triangle 0 has no area"));
}

TEST(HardCase27Light, TrianglesBelowSinglePrecisionAreTakenAndHarmless) {
  // Sound in double precision; in Embree's single precision all three corners are one point, or lie on a line.
  Scene scene = sensor(0.3);
  TriangleMesh tiny = square_sheet(1e-9, 0.0);
  for (auto& vertex : tiny.vertices) vertex += Eigen::Vector3d(3.0, 3.0, -2.0);
  scene.surfaces.push_back({tiny, kWhite});
  TriangleMesh needle = square_sheet(1.0, 0.0);
  for (auto& vertex : needle.vertices) vertex = {vertex.x() + 3.0, 1e-9 * vertex.y() + 3.0, -2.0};
  scene.surfaces.push_back({needle, kWhite});
  scene.surfaces.push_back({needle, Refractive{0, 2}});
  Worst away{1e-3};
  EXPECT_LT(away(difference(sensor(0.3), scene)), away.bar);
  render_checked(scene, few_pixels());
  did("a sheet of 1e-9 mm and needles of 1e-9 mm, points and lines in single precision: pixels differ by {}",
      away.text("relative"));
}

TEST(HardCase27Light, OneTriangleAndNoTriangle) {
  Scene scene = sensor_stack(1.0);
  TriangleMesh one;
  one.vertices = {{-3, -3, 0}, {3, -3, 0}, {0, 3, 0}};
  one.triangles = {{0, 1, 2}};
  scene.surfaces.push_back({one, kWhite});
  scene.surfaces.push_back({TriangleMesh{}, kWhite});
  const Seen seen = render_checked(scene, few_pixels(), 256, 10000);
  EXPECT_TRUE(seen.is(1.0));
  did("a sheet of one white triangle and one of none under a sky of 1: {}", seen.range());
}

TEST(HardCase27Light, WhatIsOutOfSightChangesNothing) {
  const Scene plain = sensor(0.3);
  Scene with = plain;
  with.balls.push_back({{0, 0, -60}, 2.0, Black{}});          // behind the camera
  with.balls.push_back({{5000, 0, 5000}, 1.0, kWhite});       // far away
  with.surfaces.push_back({square_sheet(3.0, 9.0), kWhite});  // beyond the membrane
  // The ball behind the camera hides some of the sky that the membrane sees through the glass.
  EXPECT_LT(difference(plain, with), 0.05);
  with.balls.erase(with.balls.begin());
  Worst away{kRounding};
  EXPECT_LT(away(difference(plain, with)), away.bar);
  did("a ball 7 m off and a sheet beyond the membrane: pixels differ by {}", away.text("relative"));
}

TEST(HardCase27Light, HugeCoordinatesAreRefusedByName) {
  const auto spoilt = [](auto&& spoil) {
    Scene scene = sensor();
    scene.balls.push_back({{0, 0, -1}, 0.25, kWhite});
    spoil(scene);
    const std::string message = refusal_of(scene);
    did("what lies a kilometre off or more is {}", refused(message));
    return message;
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

TEST(HardCase27Light, AMetreFromTheOriginTheFurnaceHolds) {
  Scene scene = empty_scene(1.0);
  const Eigen::Vector3d far(1e3, 0, 0);
  TriangleMesh sheet = square_sheet(50.0, 0.0, false);
  for (auto& vertex : sheet.vertices) vertex += far;
  scene.surfaces.push_back({sheet, kWhite});
  scene.balls.push_back({far + Eigen::Vector3d(0, 0, -5), 2.0, kWhite});
  PinholeCamera camera = few_pixels();
  camera.gel_from_camera.translation += far;
  const Seen seen = render_checked(scene, camera, 64, 10000);
  EXPECT_TRUE(seen.is(1.0));
  did("a white sheet and a ball a metre from the origin under a sky of 1: {}", seen.range());
}

TEST(HardCase27Light, TinyBodiesAreHarmless) {
  // A millionth of a millimetre is less than the distance at which rays leave a surface.
  Scene scene = sensor_stack(1.0);
  scene.surfaces.push_back({square_sheet(1e-6, -1.0, false), kWhite});
  scene.balls.push_back({{0, 0, -2}, 1e-6, kWhite});
  scene.balls.push_back({{0, 0, -3}, 1e-6, Refractive{0, 2}});
  const Seen from_afar = render_checked(scene, few_pixels(), 64, 10000);
  EXPECT_TRUE(from_afar.is(1.0));
  // Looked at from as near.
  PinholeCamera camera = few_pixels();
  camera.hole_diameter_um = 1e-4;
  camera.foil_thickness_um = 0.0;
  camera.gel_from_camera = look_at({0, 0, -1.0 - 1e-5}, {0, 0, -1}, {0, 1, 0});
  const Seen from_near = render_checked(scene, camera, 64, 10000);
  EXPECT_TRUE(from_near.is(1.41 * 1.41));
  did("white bodies of 1e-6 mm under a sky of 1: {}; from 1e-5 mm off, in gel of n squared = {:.5g}: {}",
      from_afar.range(), 1.41 * 1.41, from_near.range());
}

}  // namespace
}  // namespace touchstone::render
