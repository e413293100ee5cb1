// Coloured films in direct light, against path tracing without interreflection.

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "render/direct/direct_error.h"
#include "render/direct/direct_fitness.h"
#include "render/direct/direct_renderer.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

constexpr double kBack = -5.0 + 1e-3;  // mm: films on the plate, just inside the gel

Spectrum yellow() {
  Spectrum t(3);
  t << 0.9, 0.6, 0.05;
  return t;
}

/// Three bands; air, a plate of 6 mm and a gel of 5 mm to a white level surface; no lamps.
Scene white_surface() {
  Scene scene = empty_scene(0.0);
  scene.environment = flat_spectrum(3, 0.0);
  scene.interreflection = false;
  scene.media = {Medium{1.0, {}}, Medium{1.49, {}}, Medium{1.41, {}}};
  scene.faces = {{-11.0, 0, 1}, {-5.0, 1, 2}};
  scene.surfaces.push_back({square_sheet(8.0, 0.0), Lambertian{flat_spectrum(3, 0.8)}});
  return scene;
}

GuideLamp guide(const Eigen::Vector2d& towards) {
  GuideLamp lamp;
  lamp.centre = {-14.0 * towards.x(), -14.0 * towards.y(), -8.0};
  lamp.direction = {towards.x(), towards.y(), 0.0};
  lamp.width = 28.0;
  lamp.half_power_angle = 0.6;
  lamp.power_W = flat_spectrum(3, 1.0);
  return lamp;
}

/// Squares on the plate, `half` to each side, a grid of side x side about the middle.
Surface films(int side, double spacing, double half) {
  TriangleMesh mesh;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const int first = static_cast<int>(mesh.vertices.size());
      const Eigen::Vector3d middle(spacing * (column - 0.5 * (side - 1)), spacing * (row - 0.5 * (side - 1)), 0.0);
      for (const Eigen::Vector3d& vertex : square_sheet(half, kBack).vertices) mesh.vertices.push_back(middle + vertex);
      mesh.triangles.push_back({first, first + 1, first + 2});
      mesh.triangles.push_back({first, first + 2, first + 3});
    }
  }
  return {std::move(mesh), ThinFilm{yellow(), 1.5}};
}

LightField field_of(const Scene& scene, const GuideCut& cut = {}) {
  LightFieldSettings settings;
  settings.accuracy = 4e-3;
  settings.guides = cut;
  return make_light_field(scene, {Eigen::Vector3d(-8, -8, -1), Eigen::Vector3d(8, 8, 0.01)}, settings);
}

/// Sees 10 mm of the surface, sharp, with a wide stop.
LensCamera lens(int side) {
  LensCamera camera;
  camera.width = camera.height = side;
  camera.focus_distance_mm = 30.0 - 11.0 + 6.0 / 1.49 + 5.0 / 1.41;
  camera.pixel_pitch_um = 3200.0 / side;
  camera.matrix = matrix_of_lens(6.0, camera.focus_distance_mm, camera.pixel_pitch_um, side, side);
  camera.aperture_mm = 3.0;
  camera.gel_from_camera = look_at({0, 0, -30}, {0, 0, 0}, {0, 1, 0});
  return camera;
}

cv::Mat direct(const Scene& scene, const Camera& camera, const DirectSettings& settings = {}) {
  return DirectRenderer(field_of(scene), camera, scene, settings).render(scene).irradiance;
}

Scene without_films(Scene scene) {
  std::erase_if(scene.surfaces, [](const Surface& s) { return std::holds_alternative<ThinFilm>(s.material); });
  return scene;
}

/// A lamp between film and surface: its light meets film only on its path to the camera.
Scene lamp_above_films() {
  Scene scene = white_surface();
  SpotLamp lamp = half_space_lamp({7.5, 4.0, -3.0}, {0, 0, 1}, 1.0);
  lamp.power_W = flat_spectrum(3, 1.0);
  scene.lamps.push_back(lamp);
  scene.surfaces.push_back(films(1, 1.0, 1.5));
  return scene;
}

TEST(DirectFilms, TheCameraSeesThroughThemAsPathsDo) {
  Scene scene = lamp_above_films();
  const LensCamera camera = lens(40);
  const cv::Mat found = direct(scene, camera);
  const cv::Mat bare = direct(without_films(scene), camera);
  const RenderedImage traced = Tracer(scene).render(camera, samples(256));
  // By what film leaves of blue: all of it, none of it, or some at the blurred edge.
  double ours[3] = {}, theirs[3] = {}, variance[3] = {};
  int count[3] = {};
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 40; ++column) {
      const auto& a = found.at<cv::Vec3f>(row, column);
      const auto& b = traced.irradiance.at<cv::Vec3f>(row, column);
      const double blue = a[2] / bare.at<cv::Vec3f>(row, column)[2];
      const int kind = blue > 0.999 ? 0 : blue < 0.051 ? 1 : 2;
      const double error = traced.standard_error.at<float>(row, column);
      // The edge pixel by pixel: three bands of a disc of some pixels across.
      if (kind == 2) {
        EXPECT_NEAR(a[2], b[2], 4.0 * error + 0.06 * bare.at<cv::Vec3f>(row, column)[2]) << row;
      }
      ours[kind] += double(a[0]) + double(a[1]) + double(a[2]);
      theirs[kind] += double(b[0]) + double(b[1]) + double(b[2]);
      variance[kind] += error * error;
      ++count[kind];
    }
  }
  for (int kind = 0; kind < 3; ++kind) {
    EXPECT_GE(count[kind], 60) << kind;
    EXPECT_NEAR(ours[kind] / theirs[kind], 1.0, 3.0 * std::sqrt(variance[kind]) / theirs[kind] + 4e-3) << kind;
  }
  DirectErrorSettings judge;
  judge.pixels = 800;
  judge.samples = 128;
  const DirectError error = measure_direct_error(found, scene, camera, judge);
  EXPECT_LT(error.rms, 0.01 + 2.0 * error.rms_error);
  EXPECT_LT(std::abs(error.mean), 2e-3 + 3.0 * error.mean_error);
}

// One ray with the disc's mean is as good as many rays that each meet film or not.
TEST(DirectFilms, TheDiscsMeanIsThatOfManyRays) {
  Scene scene = lamp_above_films();
  DirectSettings many;
  many.samples = 64;
  const cv::Mat sampled = direct(scene, lens(40), many);
  EXPECT_LT(cv::norm(sampled - direct(scene, lens(40)), cv::NORM_L2), 0.02 * cv::norm(sampled, cv::NORM_L2));
}

// All of a guide's light crosses the film, at many slopes: t^(1 / cos) in every band. Each of the beams that it is cut
// into counts by its own slope, so what is left out is what slopes differ within a beam.
TEST(DirectFilms, AWideLampShinesThroughAsPathsDo) {
  Scene scene = white_surface();
  scene.lamps = {guide({1, 0})};
  scene.surfaces.push_back(films(1, 1.0, 40.0));
  const PinholeCamera camera = small_camera(32, 24);
  const cv::Scalar traced = cv::sum(Tracer(scene).render(camera, samples(256)).irradiance);
  const cv::Scalar traced_bare = cv::sum(Tracer(without_films(scene)).render(camera, samples(256)).irradiance);
  const auto worst = [&](const GuideCut& cut) {
    const auto sum = [&](const Scene& of) {
      return cv::sum(DirectRenderer(field_of(of, cut), camera, of).render(of).irradiance);
    };
    const cv::Scalar found = sum(scene);
    const cv::Scalar bare = sum(without_films(scene));
    double most = 0.0;
    for (int band = 0; band < 3; ++band) {
      const double share = found[band] / bare[band];
      EXPECT_LT(share, std::pow(yellow()[band], 2.0)) << "slanting paths are longer";
      most = std::max(most, std::abs(share / (traced[band] / traced_bare[band]) - 1.0));
    }
    return most;
  };
  const double usual = worst({});
  const double fine = worst({10, 4});
  EXPECT_LT(usual, 0.03);  // of the 0.04 % of blue that are left
  EXPECT_LT(fine, 0.015);
}

TEST(DirectFilms, AGridUnderGuidesIsNearWhatPathsHave) {
  Scene scene = white_surface();
  scene.lamps = {guide({1, 0}), guide({-1, 0}), guide({0, -1})};
  scene.surfaces.push_back(films(5, 2.0, 0.63));
  DirectErrorSettings judge;
  judge.pixels = 900;
  const DirectError error = measure_direct_error(direct(scene, lens(90)), scene, lens(90), judge);
  EXPECT_LT(error.rms_error, 0.01) << "the test is too coarse";
  EXPECT_LT(error.rms, 0.04);
  EXPECT_LT(std::abs(error.mean), 0.015 + 3.0 * error.mean_error);
}

TEST(DirectFilms, LightNeverGrows) {
  Scene scene = white_surface();
  scene.lamps = {guide({1, 0}), guide({0, -1})};
  scene.surfaces.push_back(films(5, 2.0, 0.63));
  const cv::Mat with = direct(scene, lens(60));
  const cv::Mat without = direct(without_films(scene), lens(60));
  double most = 0.0;
  const cv::Mat grown = with - without;
  cv::minMaxLoc(grown.reshape(1), nullptr, &most);
  EXPECT_LT(most, 1e-5 * cv::norm(without, cv::NORM_INF));
}

// What is behind a film is seen through it, be it a luminous body or, past the surface's rim, the surroundings; what
// stands before it isn't.
TEST(DirectFilms, LuminousThingsAreSeenThroughThem) {
  Scene scene = white_surface();
  scene.lamps = {guide({1, 0})};
  scene.environment = flat_spectrum(3, 1.0);
  scene.surfaces[0] = {square_sheet(1.0, -0.5), Emitter{flat_spectrum(3, 1.0)}};
  scene.surfaces.push_back(films(1, 1.0, 12.0));
  const PinholeCamera camera = small_camera(32, 24);
  for (const bool before : {false, true}) {
    if (before) {
      for (Eigen::Vector3d& vertex : scene.surfaces[1].mesh.vertices) vertex.z() = -0.2;
    }
    const cv::Mat found = direct(scene, camera);
    const cv::Mat traced = Tracer(scene).render(camera, samples(256)).irradiance;
    const cv::Point body(16, 12);
    const cv::Point surroundings(3, 12);
    const auto& at_body = found.at<cv::Vec3f>(body);
    const auto& beside = found.at<cv::Vec3f>(surroundings);
    for (int band = 0; band < 3; ++band) {
      // But for light that runs to and fro between the faces, some of which passes the film twice more.
      EXPECT_NEAR(at_body[band], traced.at<cv::Vec3f>(body)[band], 0.01 * at_body[0]) << before << band;
      EXPECT_NEAR(beside[band], traced.at<cv::Vec3f>(surroundings)[band], 0.01 * beside[0]) << before << band;
    }
    EXPECT_LT(beside[2], 0.2f * beside[0]);
    if (before) {
      EXPECT_GT(at_body[2], 0.99f * at_body[0]);
    } else {
      EXPECT_LT(at_body[2], 0.2f * at_body[0]);
    }
  }
}

TEST(DirectFilms, RefusesWhatAScreenCannotStandFor) {
  Scene scene = white_surface();
  scene.lamps = {guide({1, 0})};
  scene.surfaces.push_back(films(3, 2.0, 0.7));
  const LightField field = field_of(scene);
  ASSERT_EQ(unfit_for_direct(field, scene), "");
  DirectRenderer renderer(field, lens(16), scene);
  const auto refuses = [&](const std::string& what, auto change) {
    Scene other = scene;
    change(other);
    const std::string fault = unfit_for_direct(field, other);
    EXPECT_NE(fault.find(what), std::string::npos) << what << ": " << fault;
    EXPECT_THROW(renderer.render(other), Error);
    EXPECT_THROW(DirectRenderer(field, lens(16), other), Error);
  };
  const auto film_of = [](Scene& s) -> ThinFilm& { return std::get<ThinFilm>(s.surfaces[1].material); };
  refuses("level", [](Scene& s) { s.surfaces[1].mesh.vertices[1].z() += 0.1; });
  refuses("colours", [&](Scene& s) {
    s.surfaces.push_back(s.surfaces[1]);
    film_of(s).transmittance[1] = 0.7;
  });
  refuses("mirror", [&](Scene& s) { film_of(s).fresnel = true; });
  refuses("index", [&](Scene& s) { film_of(s).index = 1.4; });
  refuses("metal", [](Scene& s) { s.surfaces[0].material = RoughConductor{flat_spectrum(3, 0.8), 0.3}; });
  refuses("balls", [](Scene& s) { s.balls.push_back({{0, 0, -0.5}, 0.2, Black{}}); });
  refuses("layer", [](Scene& s) {
    for (Eigen::Vector3d& vertex : s.surfaces[1].mesh.vertices) vertex.z() = -5.1;
  });
  Scene absorbing = scene;
  absorbing.media[1].absorption = flat_spectrum(3, 0.01);
  EXPECT_NE(unfit_for_direct(field_of(absorbing), absorbing).find("absorbs"), std::string::npos);
}

TEST(DirectFilms, RefusesOtherFilmsThanThoseAtRest) {
  Scene scene = white_surface();
  scene.lamps = {guide({1, 0})};
  scene.surfaces.push_back(films(3, 2.0, 0.7));
  DirectRenderer renderer(field_of(scene), lens(16), scene);
  const auto refuses = [&](const char* what, auto change) {
    Scene other = scene;
    change(other);
    EXPECT_THROW(renderer.render(other), Error) << what;
  };
  refuses("moved", [](Scene& s) {
    for (Eigen::Vector3d& vertex : s.surfaces[1].mesh.vertices) vertex.x() += 0.1;
  });
  refuses("of another colour", [](Scene& s) { std::get<ThinFilm>(s.surfaces[1].material).transmittance[0] = 0.8; });
  refuses("fewer", [](Scene& s) { s.surfaces.pop_back(); });
  refuses("more", [](Scene& s) {
    s.surfaces.push_back(s.surfaces[1]);
    for (Eigen::Vector3d& vertex : s.surfaces[2].mesh.vertices) vertex.x() += 1.0;
  });
  // Others may change: what hides nothing at rest may come before the surface.
  Scene other = scene;
  other.surfaces.push_back({square_sheet(0.5, -0.5), Lambertian{flat_spectrum(3, 0.3)}});
  EXPECT_GT(cv::sum(renderer.render(other).irradiance)[0], 0.0);
}

}  // namespace
}  // namespace touchstone::render
