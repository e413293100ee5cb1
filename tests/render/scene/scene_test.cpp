// A faulty scene is refused with one line that names the part.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/error.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Scene good_scene() {
  Scene scene = sensor_stack(1.0);
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Refractive{2, 0}});
  scene.balls.push_back({{0, 0, -1}, 0.25, RoughConductor{grey(0.6), 0.3}});
  scene.lamps.push_back(half_space_lamp({0, 0, -20}, {0, 0, 1}, 1.0));
  return scene;
}

void expect_refused(const std::function<void(Scene&)>& spoil, const std::string& part) {
  Scene scene = good_scene();
  spoil(scene);
  try {
    const Tracer tracer(scene);
    ADD_FAILURE() << "taken, though " << part << " is faulty";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(part));
    EXPECT_THAT(std::string(error.what()), testing::Not(testing::HasSubstr("\n")));
  }
}

TEST(SceneCheck, AGoodSceneIsTaken) {
  EXPECT_NO_THROW(Tracer{good_scene()});
}

TEST(SceneCheck, FaultsAreRefusedByName) {
  expect_refused([](Scene& s) { s.surfaces[0].mesh.vertices[2].y() = kNan; }, "surface 0: vertex 2");
  expect_refused([](Scene& s) { s.surfaces[0].mesh.vertices[1] = s.surfaces[0].mesh.vertices[0]; },
                 "surface 0: triangle 0 has no area");
  expect_refused([](Scene& s) { s.surfaces[0].mesh.triangles[1][2] = 4; }, "triangle 1 names vertex 4");
  expect_refused([](Scene& s) { s.surfaces[0].material = Refractive{2, 3}; }, "medium_outside");
  expect_refused([](Scene& s) { s.surfaces[0].material = Lambertian{grey(1.5)}; }, "albedo is 1.5");
  expect_refused([](Scene& s) { s.surfaces[0].material = Lambertian{Spectrum::Constant(3, 0.5)}; }, "3 bands");
  expect_refused([](Scene& s) { s.surfaces[0].material = Emitter{grey(-1.0)}; }, "radiance is -1");
  expect_refused([](Scene& s) { s.surfaces[0].material = Emitter{grey(kNan)}; }, "radiance");
  expect_refused([](Scene& s) { s.balls[0].radius = -0.25; }, "ball 0: radius is -0.25");
  expect_refused([](Scene& s) { s.balls[0].centre.x() = INFINITY; }, "ball 0");
  expect_refused([](Scene& s) { s.balls[0].material = RoughConductor{grey(0.5), 0.0}; }, "roughness is 0");
  expect_refused([](Scene& s) { s.media[1].index = kNan; }, "medium 1: index");
  expect_refused([](Scene& s) { s.media[1].index = 0.5; }, "medium 1: index is 0.5");
  expect_refused([](Scene& s) { s.media[2].absorption = grey(-1.0); }, "medium 2: absorption");
  expect_refused([](Scene& s) { s.media[2].scattering = grey(kNan); }, "medium 2: scattering");
  expect_refused([](Scene& s) { s.media[2].scattering = grey(2000.0); }, "medium 2: scattering is 2000");
  expect_refused([](Scene& s) { s.media[2].anisotropy = 1.0; }, "medium 2: anisotropy is 1");
  expect_refused([](Scene& s) { s.media[2].anisotropy = kNan; }, "medium 2: anisotropy");
  expect_refused([](Scene& s) { s.faces[1].z = -8.0; }, "face 1");
  expect_refused([](Scene& s) { s.faces[1].medium_below = 0; }, "face 1");
  expect_refused([](Scene& s) { std::get<SpotLamp>(s.lamps[0]).direction.setZero(); }, "lamp 0");
  expect_refused([](Scene& s) { std::get<SpotLamp>(s.lamps[0]).power_W = grey(kNan); }, "lamp 0: power_W");
  expect_refused([](Scene& s) { std::get<SpotLamp>(s.lamps[0]).half_angle = 2.0; }, "half_angle 2");
  expect_refused([](Scene& s) { s.environment = grey(INFINITY); }, "environment");
  expect_refused([](Scene& s) { s.environment = Spectrum(); }, "no band");
  expect_refused([](Scene& s) { s.media.clear(); }, "no medium");
}

TEST(SceneCheck, FaultySheetsAndFilmsAreRefusedByName) {
  expect_refused([](Scene& s) { s.balls[0].material = DiffuseTransmitter{grey(0.6), grey(0.5)}; }, "sum must be");
  expect_refused([](Scene& s) { s.balls[0].material = DiffuseTransmitter{grey(-0.1), grey(0.5)}; }, "reflectance");
  expect_refused([](Scene& s) { s.balls[0].material = DiffuseTransmitter{grey(0.1), {}}; }, "transmittance has 0");
  expect_refused([](Scene& s) { s.balls[0].material = ThinFilm{grey(1.2)}; }, "transmittance is 1.2");
  expect_refused([](Scene& s) { s.balls[0].material = ThinFilm{grey(0.5), 0.9}; }, "index is 0.9");
  expect_refused([](Scene& s) { s.balls[0].material = RoughRefractive{1, 0, 0.0}; }, "roughness is 0");
  expect_refused([](Scene& s) { s.balls[0].material = RoughRefractive{3, 0, 0.1}; }, "medium_inside is medium 3");
  Scene scene = good_scene();
  scene.balls[0].material = DiffuseTransmitter{grey(0.9), grey(0.1)};
  EXPECT_NO_THROW(Tracer{scene});
}

TEST(SceneCheck, FaultyPrintsAreRefusedByName) {
  const auto spoil = [](const std::function<void(Print&)>& change) {
    return [change](Scene& s) {
      s.surfaces[0].material = Lambertian{grey(0.9)};
      Print print;
      print.material_mm = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
      print.inks = {grey(0.1)};
      print.marks = {{{0, 0}, 0.5, 0}};
      change(print);
      s.surfaces[0].print = print;
    };
  };
  Scene scene = good_scene();
  spoil([](Print&) {})(scene);
  EXPECT_NO_THROW(Tracer{scene});
  expect_refused(spoil([](Print& p) { p.material_mm.pop_back(); }), "surface 0: print: 3 material points");
  expect_refused(spoil([](Print& p) { p.material_mm[2].x() = kNan; }), "material point 2");
  expect_refused(spoil([](Print& p) { p.inks[0] = grey(1.1); }), "ink 0 is 1.1");
  expect_refused(spoil([](Print& p) { p.marks[0].half_width = 0.0; }), "half width of mark 0 is 0");
  expect_refused(spoil([](Print& p) { p.marks[0].half_width = kNan; }), "half width of mark 0");
  expect_refused(spoil([](Print& p) { p.marks[0].centre.y() = kNan; }), "centre of mark 0");
  expect_refused(spoil([](Print& p) { p.marks[0].ink = 1; }), "mark 0 has ink 1");
  expect_refused(spoil([](Print& p) { p.marks[0].shape = MarkShape::rectangle; }), "half height of mark 0 is 0");
  const auto pictured = [&](const std::function<void(PrintedPicture&)>& change) {
    return spoil([change](Print& p) {
      PrintedPicture picture{2, 1, {-1, -1}, {1, 2}, 1, {0.2f, 0.4f}};
      change(picture);
      p.picture = std::make_shared<const PrintedPicture>(picture);
    });
  };
  pictured([](PrintedPicture&) {})(scene);
  EXPECT_NO_THROW(Tracer{scene});
  expect_refused(pictured([](PrintedPicture& p) { p.rows = 0; }), "picture: 2 x 0 pixels");
  expect_refused(pictured([](PrintedPicture& p) { p.bands = 3; }), "picture: has 3 bands");
  expect_refused(pictured([](PrintedPicture& p) { p.low.x() = kNan; }), "picture: its corner");
  expect_refused(pictured([](PrintedPicture& p) { p.pixel_mm.y() = 0.0; }), "picture: pixels of 1 x 0 mm");
  expect_refused(pictured([](PrintedPicture& p) { p.values.pop_back(); }), "picture: 1 values");
  expect_refused(pictured([](PrintedPicture& p) { p.values[1] = 1.5f; }), "picture: a value is 1.5");
  expect_refused(
      [&](Scene& s) {
        spoil([](Print&) {})(s);
        s.surfaces[0].material = Refractive{2, 0};
      },
      "can be printed on");
}

TEST(SceneCheck, TwoBandsAreRefused) {
  Scene scene;
  scene.environment = Spectrum::Constant(2, 1.0);
  EXPECT_THROW(Tracer{scene}, Error);
}

TEST(RenderCheck, FaultySettingsCameraAndMaskAreRefused) {
  const Tracer tracer(good_scene());
  const PinholeCamera camera = small_camera(8, 6);
  const RenderSettings settings = samples(1);
  EXPECT_NO_THROW(tracer.render(camera, settings));

  RenderSettings bad_settings = settings;
  bad_settings.min_samples = 0;
  EXPECT_THROW(tracer.render(camera, bad_settings), Error);
  bad_settings = settings;
  bad_settings.noise = NoiseTarget{Spectrum::Constant(3, 1.0), 1.0, 1.0, 0.5};
  EXPECT_THROW(tracer.render(camera, bad_settings), Error);
  bad_settings.noise = NoiseTarget{grey(1.0), 1.0, 1.0, 0.0};
  EXPECT_THROW(tracer.render(camera, bad_settings), Error);

  PinholeCamera bad_camera = camera;
  bad_camera.width = 0;
  EXPECT_THROW(tracer.render(bad_camera, settings), Error);
  bad_camera = camera;
  bad_camera.hole_diameter_um = kNan;
  EXPECT_THROW(tracer.render(bad_camera, settings), Error);
  bad_camera = camera;
  bad_camera.gel_from_camera.rotation *= 2.0;
  EXPECT_THROW(tracer.render(bad_camera, settings), Error);

  EXPECT_THROW(tracer.render(camera, settings, cv::Mat::ones(6, 7, CV_8UC1)), Error);
  EXPECT_THROW(tracer.render(camera, settings, cv::Mat::ones(6, 8, CV_32FC1)), Error);
  EXPECT_THROW(tracer.preview(camera, 0), Error);
  EXPECT_THROW(tracer.radiance({0, 0, 0}, {0, 0, 0}, settings), Error);
}

}  // namespace
}  // namespace touchstone::render
