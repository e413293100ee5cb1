#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/error.h"
#include "core/units.h"
#include "render/direct_fitness.h"
#include "render/direct_renderer.h"
#include "render/ray_scene.h"
#include "render/shadow_reach.h"
#include "tests/render/light_scenes.h"

namespace touchstone::render {
namespace {

/// A dent of 1 mm, as a ball of some 4 mm would press, with walls of 40 degrees.
double dent(double x, double y) {
  return -0.8 * std::exp(-(x * x + y * y) / 1.2) - 0.2 * std::exp(-((x - 3) * (x - 3) + y * y) / 0.3);
}

SpotLamp lamp_from(const Eigen::Vector3d& position, double lens_radius) {
  SpotLamp lamp;
  lamp.position = position;
  lamp.direction = -position;
  lamp.lens_radius = lens_radius;
  lamp.half_angle = 0.7;
  lamp.soft_angle = 0.2;
  lamp.power_W = grey(0.5);
  return lamp;
}

/// Glass and gel, three lamps from below, one of them low.
Scene lit_stack(double environment) {
  Scene scene = sensor_stack(environment);
  scene.interreflection = false;
  scene.lamps = {lamp_from({15, 0, -20}, 1.0), lamp_from({-10, 12, -18}, 1.0), lamp_from({-6, -30, -12}, 1.5)};
  return scene;
}

Scene dented_scene(double environment, const Material& material) {
  Scene scene = lit_stack(environment);
  scene.surfaces.push_back({square_relief(7.0, 70, dent), material});
  return scene;
}

Eigen::AlignedBox3d reach_of_membrane() {
  return {Eigen::Vector3d(-7, -7, -1.5), Eigen::Vector3d(7, 7, 0)};
}

LightFieldSettings accuracy(double value) {
  LightFieldSettings settings;
  settings.accuracy = value;
  return settings;
}

TEST(LightField, HoldsWhatLampsSend) {
  const Scene scene = lit_stack(0.0);
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(2e-3));
  EXPECT_LE(field.error, 2e-3);
  EXPECT_GT(field.error, 0.0);
  LightFieldSettings many;
  many.lens_points = 12;  // nine times the places on the lens
  std::mt19937 random(3);
  std::uniform_real_distribution<double> side(-7.0, 7.0);
  std::uniform_real_distribution<double> depth(-1.5, 0.0);
  double wrong = 0.0;
  double whole = 0.0;
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector3d at(side(random), side(random), depth(random));
    float flow[12];
    look_up_flow(field, find_cell(field, float(at.x()), float(at.y()), float(at.z())), flow);
    double wrong_here = 0.0;
    double whole_here = 0.0;
    for (int lamp = 0; lamp < 3; ++lamp) {
      const Eigen::Vector4d exact = exact_flow(field, lamp, at, many);
      wrong_here += (Eigen::Vector3d(flow[4 * lamp], flow[4 * lamp + 1], flow[4 * lamp + 2]) - exact.head<3>()).norm();
      whole_here += exact[3];
    }
    wrong += wrong_here * wrong_here;
    whole += whole_here * whole_here;
  }
  EXPECT_LT(std::sqrt(wrong / whole), field.error + 5e-4);
}

TEST(LightField, ErrorFallsWithTheGrid) {
  const Scene scene = lit_stack(0.0);
  const LightField coarse = make_light_field(scene, reach_of_membrane(), accuracy(1e-2));
  const LightField fine = make_light_field(scene, reach_of_membrane(), accuracy(5e-4));
  EXPECT_LE(fine.error, 5e-4);
  EXPECT_LE(coarse.error, 1e-2);
  EXPECT_GT(fine.nodes.prod(), coarse.nodes.prod());
}

TEST(LightField, RefusesWhatItCannotHold) {
  const Scene scene = lit_stack(0.0);
  const Eigen::AlignedBox3d reach = reach_of_membrane();
  Scene dark = scene;
  dark.lamps.clear();
  EXPECT_THROW(make_light_field(dark, reach), Error);
  EXPECT_THROW(make_light_field(scene, Eigen::AlignedBox3d{}), Error);
  EXPECT_THROW(make_light_field(scene, {Eigen::Vector3d(-1, -1, -6), Eigen::Vector3d(1, 1, 0)}), Error);  // a face
  Scene inside = scene;
  std::get<SpotLamp>(inside.lamps[0]).position = {0, 0, -1};
  EXPECT_THROW(make_light_field(inside, reach), Error);
  for (double bad : {0.0, -1.0, 2.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(make_light_field(scene, reach, accuracy(bad)), Error);
  }
  Scene sharp = scene;  // a lobe whose sharp rim crosses the membrane
  std::get<SpotLamp>(sharp.lamps[0]).half_angle = 0.1;
  std::get<SpotLamp>(sharp.lamps[0]).soft_angle = 0.0;
  std::get<SpotLamp>(sharp.lamps[0]).lens_radius = 0.0;
  LightFieldSettings small = accuracy(1e-4);
  small.most_nodes = 5000;
  EXPECT_THROW(make_light_field(sharp, reach, small), Error);
}

/// A plane of albedo 0.6 at z = 0 without faces, a point lamp under it.
Scene plane_scene(const Eigen::Vector3d& lamp) {
  Scene scene = empty_scene(0.0);
  scene.interreflection = false;
  scene.lamps = {half_space_lamp(lamp, {0, 0, 1}, 2.0)};
  scene.surfaces.push_back({square_sheet(9.0, 0.0), Lambertian{grey(0.6)}});
  return scene;
}

TEST(DirectRenderer, PointSourceOverAMattPlane) {
  const Eigen::Vector3d lamp(2, 1, -15);
  const Scene scene = plane_scene(lamp);
  const LightField field =
      make_light_field(scene, {Eigen::Vector3d(-9, -9, -0.2), Eigen::Vector3d(9, 9, 0.2)}, accuracy(5e-4));
  const PinholeCamera camera = small_camera(30, 22);
  DirectSettings sharp;
  sharp.blur = false;
  DirectRenderer renderer(field, camera, scene, sharp);
  const DirectImage image = renderer.render(scene);
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const auto ray = pinhole_ray(camera, column + 0.5, row + 0.5, 0.5, 0.5);
      ASSERT_TRUE(ray);
      const Eigen::Vector3d from = camera.gel_from_camera * ray->origin;
      const Eigen::Vector3d along = camera.gel_from_camera.turn(ray->direction);
      const Eigen::Vector3d place = from - along * (from.z() / along.z());
      const Eigen::Vector3d way = lamp - place;
      // L = rho I cos / (pi r^2), in W and m.
      const double radiance = 0.6 * 2.0 * (-way.z() / way.norm()) / (kPi * way.squaredNorm() * 1e-6);
      EXPECT_NEAR(image.irradiance.at<float>(row, column) / (ray->weight * radiance), 1.0, 3e-3);
    }
  }
  EXPECT_EQ(image.shadow_rays, 0u);  // nothing stands over a plane
  EXPECT_EQ(image.shadow_spared, 30u * 22u);
}

TEST(DirectRenderer, ABallsShadowHasItsOutline) {
  const Eigen::Vector3d lamp(8, 3, -15);
  Scene scene = plane_scene(lamp);
  scene.balls.push_back({{0.5, 0.2, -1.5}, 0.6, Black{}});
  const LightField field =
      make_light_field(scene, {Eigen::Vector3d(-9, -9, -0.2), Eigen::Vector3d(9, 9, 0.2)}, accuracy(2e-3));
  const PinholeCamera camera = small_camera(160, 120);
  DirectSettings sharp;
  sharp.blur = false;
  DirectRenderer renderer(field, camera, scene, sharp);
  const DirectImage image = renderer.render(scene);
  int dark = 0;
  const Ball& ball = scene.balls.front();
  const auto distance_from_line = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const Eigen::Vector3d along = (b - a).normalized();
    return (ball.centre - a - along * along.dot(ball.centre - a)).norm();
  };
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const auto ray = pinhole_ray(camera, column + 0.5, row + 0.5, 0.5, 0.5);
      const Eigen::Vector3d from = camera.gel_from_camera * ray->origin;
      const Eigen::Vector3d along = camera.gel_from_camera.turn(ray->direction);
      const Eigen::Vector3d place = from - along * (from.z() / along.z());
      const double seen = distance_from_line(from, place);
      const double lit = distance_from_line(place, lamp);
      if (std::abs(seen - ball.radius) < 2e-3 || std::abs(lit - ball.radius) < 2e-3) continue;
      const bool expected = seen > ball.radius && lit > ball.radius;
      EXPECT_EQ(image.irradiance.at<float>(row, column) > 0.0f, expected) << column << ", " << row;
      dark += seen > ball.radius && lit < ball.radius ? 1 : 0;
    }
  }
  EXPECT_GT(dark, 30);
}

/// Mean of a direct image against the path tracer's in units of the error, and relative root mean square difference
/// less what noise explains.
void expect_equal_light(const Scene& scene, const char* what) {
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(5e-4));
  const PinholeCamera camera = small_camera(32, 24);
  DirectSettings settings;
  settings.samples = 32;
  settings.seed = 99;
  const cv::Mat direct = DirectRenderer(field, camera, scene, settings).render(scene).irradiance;
  const RenderedImage traced = Tracer(scene).render(camera, samples(128));
  double difference = 0.0;
  double variance = 0.0;
  double squares = 0.0;
  double sum = 0.0;
  double sum2 = 0.0;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const double a = direct.at<float>(row, column);
      const double b = traced.irradiance.at<float>(row, column);
      const double error = traced.standard_error.at<float>(row, column);
      difference += a - b;
      squares += (a - b) * (a - b);
      variance += error * error;
      sum += b;
      sum2 += b * b;
    }
  }
  // The direct image draws from the same pixel, hole and lens areas with a quarter of the samples, but all lamps at
  // each: its own error is taken as the tracer's. The field's interpolation may add its 5e-4.
  EXPECT_LT(std::abs(difference), 4.0 * std::sqrt(2.0 * variance) + 5e-4 * sum) << what << ": means";
  EXPECT_LT(std::sqrt(std::max(0.0, squares - 2.0 * variance) / sum2), 0.015) << what << ": pixels";
  EXPECT_LT(std::sqrt(variance / sum2), 0.03) << what << ": the reference's noise";
}

TEST(DirectRenderer, AgreesWithThePathTracer) {
  expect_equal_light(dented_scene(0.0, Lambertian{grey(0.7)}), "matt");
  expect_equal_light(dented_scene(3.0, Lambertian{grey(0.7)}), "matt, bright room");
  expect_equal_light(dented_scene(0.0, RoughConductor{grey(0.8), 0.5}), "rough metal");
  Scene absorbing = dented_scene(0.0, Lambertian{grey(0.7)});
  absorbing.media[1].absorption = grey(0.02);
  absorbing.media[2].absorption = grey(0.1);
  expect_equal_light(absorbing, "absorbing");
  Scene beads = dented_scene(0.0, Lambertian{grey(0.7)});
  beads.balls.push_back({{1.5, 0.5, -1.1}, 0.25, Lambertian{grey(0.3)}});
  beads.balls.push_back({{-2.0, 1.0, -0.8}, 0.4, Black{}});
  expect_equal_light(beads, "beads");
}

// Facets of a millimetre that are shaded as the curved sheet that they stand for.
TEST(DirectRenderer, AgreesWithThePathTracerOnSmoothSheets) {
  for (const Material& material : {Material{Lambertian{grey(0.7)}}, Material{RoughConductor{grey(0.8), 0.5}}}) {
    Scene scene = lit_stack(0.0);
    const auto ripples = [](double x, double y) { return 0.25 * (std::sin(1.5 * x) * std::cos(1.3 * y) - 1.0); };
    scene.surfaces = {{square_relief(7.0, 14, ripples), material}};
    const cv::Mat facets = Tracer(scene).render(small_camera(32, 24), samples(64)).irradiance;
    scene.surfaces[0].normals = vertex_normals(scene.surfaces[0].mesh);
    const cv::Mat smooth = Tracer(scene).render(small_camera(32, 24), samples(64)).irradiance;
    EXPECT_GT(cv::norm(facets, smooth) / cv::norm(smooth), 0.02) << "then facets would pass, too";
    expect_equal_light(scene, "smooth");
  }
}

TEST(DirectRenderer, AgreesWithThePathTracerUnderLedAndAreaLamps) {
  Scene scene = dented_scene(0.0, Lambertian{grey(0.7)});
  LedLamp led;
  led.position = {-10, 12, -18};
  led.direction = Eigen::Vector3d(0, 0, -1) - led.position;
  led.radius = 0.9;
  led.half_power_angle = 0.5;
  led.power_W = grey(1.0);
  AreaLamp area;
  area.centre = {14, 0, -16};
  area.direction = -area.centre;
  area.along = {0, 1, 0};
  area.width = 3.0;
  area.power_W = grey(1.0);
  scene.lamps = {led, area};
  expect_equal_light(scene, "LED and area");

  led.visible = true;
  scene.lamps = {led};
  EXPECT_THROW(make_light_field(scene, reach_of_membrane(), accuracy(5e-3)), Error);
}

TEST(DirectRenderer, SpreadingCentralRaysIsTheHolesOwnBlur) {
  Scene scene = dented_scene(1.0, Lambertian{grey(0.7)});
  scene.balls.push_back({{1.5, 0.5, -1.1}, 0.25, Lambertian{grey(0.3)}});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-3));
  PinholeCamera camera = small_camera(96, 72);
  camera.pixel_pitch_um *= 0.7;  // the picture's edge sees the membrane, too
  const auto picture = [&](int samples, bool blur) {
    DirectSettings settings;
    settings.samples = samples;
    settings.blur = blur;
    settings.rays_across_blur = 4.0;
    return DirectRenderer(field, camera, scene, settings).render(scene).irradiance;
  };
  const cv::Mat whole = picture(64, true);
  const auto error = [&](const cv::Mat& image) { return cv::norm(image, whole, cv::NORM_L2) / cv::norm(whole); };
  const cv::Mat spread = picture(1, true);
  EXPECT_LT(error(spread), 0.008);  // most of it the 64 samples' own noise
  EXPECT_GT(error(picture(1, false)), 5.0 * error(spread));
  EXPECT_NEAR(cv::mean(spread)[0] / cv::mean(whole)[0], 1.0, 2e-3);
}

TEST(DirectRenderer, MoreRaysAtEdgesGiveThePixelsArea) {
  Scene scene = dented_scene(0.0, Lambertian{grey(0.7)});
  for (Lamp& lamp : scene.lamps)
    std::get<SpotLamp>(lamp).lens_radius = 0.0;  // else shadows have rims that one direction can't tell
  scene.balls.push_back({{1.5, 0.5, -1.1}, 0.25, Lambertian{grey(0.1)}});
  scene.balls.push_back({{-2.0, 1.0, -0.8}, 0.4, Black{}});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-3));
  PinholeCamera camera = small_camera(96, 72);
  camera.pixel_pitch_um *= 0.7;
  camera.hole_diameter_um = 1e-3;
  camera.foil_thickness_um = 0.0;
  const auto picture = [&](int samples, int side) {
    DirectSettings settings;
    settings.samples = samples;
    settings.edge_side = side;
    return DirectRenderer(field, camera, scene, settings).render(scene);
  };
  const cv::Mat whole = picture(64, 1).irradiance;
  const auto error = [&](const DirectImage& image) {
    return cv::norm(image.irradiance, whole, cv::NORM_L2) / cv::norm(whole);
  };
  const DirectImage one = picture(1, 1);
  const DirectImage many = picture(1, 4);
  EXPECT_EQ(one.edge_pixels, 0u);
  EXPECT_GT(many.edge_pixels, 100u);
  EXPECT_LT(many.edge_pixels, 96u * 72u / 4u);
  EXPECT_LT(error(many), 0.25 * error(one));
  EXPECT_LT(error(picture(1, 2)), 0.6 * error(one));
}

// A sheet's edge that runs with the rows, or the columns, at ten places between two pixels: what is covered is found
// over all of it, and in each row to one ray.
TEST(DirectRenderer, AnEdgeThatRunsWithThePixelsIsWhereItIs) {
  const Scene whole = plane_scene({2, 1, -15});
  const LightField field =
      make_light_field(whole, {Eigen::Vector3d(-9, -9, -0.2), Eigen::Vector3d(9, 9, 0.2)}, accuracy(5e-3));
  PinholeCamera camera = small_camera(64, 64);
  camera.pixel_pitch_um *= 0.5;
  camera.hole_diameter_um = 1e-3;
  camera.foil_thickness_um = 0.0;
  const double mm_per_px = camera.pixel_pitch_um * 1e-3 * 27.0 / camera.distance_mm;
  for (const int side : {2, 4}) {
    DirectSettings settings;
    settings.edge_side = side;
    const cv::Mat full = DirectRenderer(field, camera, whole, settings).render(whole).irradiance;
    for (int step = 0; step < 10; ++step) {
      const double edge_px = 20.0 + step / 10.0 + 0.03;  // from the picture's middle
      for (const int axis : {0, 1}) {
        Scene scene = whole;
        for (Eigen::Vector3d& vertex : scene.surfaces[0].mesh.vertices) {
          vertex[axis] = std::clamp(vertex[axis], -edge_px * mm_per_px, edge_px * mm_per_px);
        }
        cv::Mat covered = DirectRenderer(field, camera, scene, settings).render(scene).irradiance / full;
        if (axis == 1) covered = covered.t();
        double sum = 0.0;
        for (int row = 8; row < 56; ++row) {
          const double found = cv::sum(covered.row(row).colRange(8, 56))[0];
          EXPECT_NEAR(found, 2.0 * edge_px, 2.0 / (side * side) + 2e-3) << side << " " << step << " " << row;
          sum += found / 48.0;
        }
        EXPECT_NEAR(sum, 2.0 * edge_px, 0.012) << side << " " << step;
      }
    }
  }
}

TEST(DirectRenderer, BandsAreIndependent) {
  Scene scene = dented_scene(0.0, Lambertian{grey(0.7)});
  scene.media[2].absorption = grey(0.1);
  const PinholeCamera camera = small_camera(16, 12);
  const auto picture = [&](const Scene& of) {
    const LightField field = make_light_field(of, reach_of_membrane(), accuracy(1e-2));
    return DirectRenderer(field, camera, of).render(of).irradiance;
  };
  const cv::Mat one = picture(scene);
  constexpr int kBands = 16;
  Scene many = scene;
  many.environment = flat_spectrum(kBands, 0.0);
  many.surfaces[0].material = Lambertian{flat_spectrum(kBands, 0.7)};
  for (Lamp& each : many.lamps) {
    auto& lamp = std::get<SpotLamp>(each);
    lamp.power_W = flat_spectrum(kBands, 0.5);
    lamp.power_W[5] = 1.0;
  }
  many.media[2].absorption = flat_spectrum(kBands, 0.1);
  const cv::Mat all = picture(many);
  ASSERT_EQ(all.type(), CV_32FC(kBands));
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const float* bands = all.ptr<float>(row) + kBands * column;
      const float expected = one.at<float>(row, column);
      for (int band = 0; band < kBands; ++band) {
        EXPECT_NEAR(bands[band], (band == 5 ? 2.0f : 1.0f) * expected, 1e-5f * expected + 1e-12f);
      }
    }
  }
}

TEST(DirectRenderer, SameBytesForAnyThreadsAndHistory) {
  const Scene rest = [] {
    Scene scene = lit_stack(1.0);
    scene.surfaces.push_back({square_relief(7.0, 70, [](double, double) { return 0.0; }), Lambertian{grey(0.7)}});
    return scene;
  }();
  Scene dented = rest;
  dented.surfaces[0].mesh = square_relief(7.0, 70, dent);
  Scene finer = rest;
  finer.surfaces[0].mesh = square_relief(7.0, 50, dent);
  const PinholeCamera camera = small_camera(50, 38);
  const auto picture = [&](int threads, bool history) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const LightField field = make_light_field(rest, reach_of_membrane(), accuracy(5e-3));
    DirectRenderer renderer(field, camera, rest);
    if (history) {
      renderer.render(finer);
      renderer.render(rest);
    }
    return renderer.render(dented).irradiance;
  };
  const cv::Mat one = picture(1, false);
  for (const cv::Mat& other : {picture(3, false), picture(4, true)}) {
    EXPECT_EQ(cv::norm(one, other, cv::NORM_INF), 0.0);
  }
  EXPECT_GT(cv::sum(one)[0], 0.0);
}

TEST(DirectRenderer, RefusesOtherScenes) {
  const Scene scene = dented_scene(0.0, Lambertian{grey(0.7)});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-2));
  const PinholeCamera camera = small_camera(8, 6);
  EXPECT_EQ(unfit_for_direct(field, scene), "");
  DirectRenderer renderer(field, camera, scene);
  const auto refuses = [&](auto change) {
    Scene other = scene;
    change(other);
    EXPECT_THROW(renderer.render(other), Error);
  };
  refuses([](Scene& s) { s.interreflection = true; });
  refuses([](Scene& s) { std::get<SpotLamp>(s.lamps[0]).power_W = grey(0.6); });
  refuses([](Scene& s) { s.media[2].index = 1.5; });
  refuses([](Scene& s) { s.surfaces[0].material = Refractive{2, 0}; });
  refuses([](Scene& s) { s.media[2].scattering = grey(0.1); });
  refuses([](Scene& s) {
    Print print;
    s.surfaces[0].print = print;  // without material coordinates
  });
  refuses([](Scene& s) { s.surfaces[0].mesh.vertices[0].z() = -6.0; });  // in the glass
  refuses([](Scene& s) { s.surfaces[0].mesh.vertices[0].x() = -8.0; });  // beside the box
  refuses([](Scene& s) { s.surfaces[0].mesh.vertices[0].x() = std::nan(""); });
  refuses([](Scene& s) { s.balls.push_back({{0, 0, -2}, 1.0, Lambertian{grey(0.5)}}); });  // out of the box
  DirectSettings bad;
  bad.samples = 0;
  EXPECT_THROW(DirectRenderer(field, camera, scene, bad), Error);
  bad.samples = 1;
  bad.edge_side = 3;
  EXPECT_THROW(DirectRenderer(field, camera, scene, bad), Error);
  bad.edge_side = 2;
  bad.edge_contrast = -1.0;
  EXPECT_THROW(DirectRenderer(field, camera, scene, bad), Error);
  bad.edge_contrast = 0.1;
  for (double rays : {0.0, 65.0, std::numeric_limits<double>::quiet_NaN()}) {
    bad.rays_across_blur = rays;
    EXPECT_THROW(DirectRenderer(field, camera, scene, bad), Error);
  }
  PinholeCamera blind = camera;
  blind.distance_mm = 0.0;
  EXPECT_THROW(DirectRenderer(field, blind, scene), Error);
}

/// Rays from places on a sheet to the lamps, against what the map says of them.
struct ReachTally {
  int hidden = 0;  // rays that meet something
  int missed = 0;  // of them, those that the map would have spared
  int spared = 0;
};

ReachTally tally(const Scene& scene, bool soft) {
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(2e-3));
  const LampBearings bearings(field, soft);
  const ShadowReach reach(bearings, scene, is_connected(scene.surfaces[0].mesh));
  const RayScene rays(scene);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  ReachTally result;
  for (int k = 0; k < 20000; ++k) {
    // From a place on the sheet, to its lower side.
    RayHit start;
    if (!rays.intersect({6.99 * unit(random), 6.99 * unit(random), 3.0}, {0, 0, -1}, 10.0, start)) continue;
    if (start.object != 0) continue;
    const Eigen::Vector3d from = start.position - RayScene::leave_distance(start.position) * start.normal;
    const std::uint64_t doubt = reach.doubtful(float(start.position.x()), float(start.position.y()), start.object);
    for (int lamp = 0; lamp < field.beam_count(); ++lamp) {
      // The direction as DirectBatch takes it, for a soft shadow at a place set off by up to the lens's radius.
      const double off = soft ? disc_radius(field.lamp(lamp)) : 0.0;
      float flow[4 * 8];
      look_up_flow(
          field,
          find_cell(field, float(from.x() + off * unit(random)), float(from.y() + off * unit(random)), float(from.z())),
          flow);
      const Eigen::Vector3d towards =
          -Eigen::Vector3f(flow[4 * lamp], flow[4 * lamp + 1], flow[4 * lamp + 2]).cast<double>().normalized();
      if (towards.dot(start.normal) >= 0.0) continue;
      const bool doubtful = (doubt >> lamp & 1u) != 0;
      RayHit hit;
      if (rays.intersect(from, towards, 50.0, hit)) {
        ++result.hidden;
        result.missed += doubtful ? 0 : 1;
      } else {
        result.spared += doubtful ? 0 : 1;
      }
    }
  }
  return result;
}

TEST(ShadowReach, NeverSparesALampThatSomethingHides) {
  Scene scene = dented_scene(0.0, Lambertian{grey(0.5)});
  scene.surfaces.push_back({square_sheet(0.5, -1.2), Black{}});
  for (auto& vertex : scene.surfaces[1].mesh.vertices) vertex.x() += 4.0;
  scene.balls.push_back({{-3, 2, -0.9}, 0.4, Black{}});
  scene.balls.push_back({{-4, -4, -3.0}, 0.8, Black{}});
  scene.lamps.push_back(lamp_from({25, -20, -9}, 1.0));
  for (const bool soft : {false, true}) {
    const ReachTally found = tally(scene, soft);
    EXPECT_EQ(found.missed, 0);
    EXPECT_GT(found.hidden, 500);
    EXPECT_GT(found.spared, soft ? 5000 : 30000);
  }
}

TEST(ShadowReach, SparesNothingOverAFold) {
  Scene scene = lit_stack(0.0);
  TriangleMesh two = square_sheet(5.0, 0.0);
  const TriangleMesh lower = square_sheet(2.0, -1.0);
  for (const auto& vertex : lower.vertices) two.vertices.push_back(vertex);
  for (const auto& t : lower.triangles) two.triangles.push_back({t[0] + 4, t[1] + 4, t[2] + 4});
  scene.surfaces.push_back({two, Lambertian{grey(0.5)}});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-2));
  const LampBearings bearings(field, false);
  const ShadowReach reach(bearings, scene, is_connected(scene.surfaces[0].mesh));
  EXPECT_EQ(reach.doubtful(0.0f, 0.0f, 0), 7u);
}

TEST(ShadowReach, SparesNothingOnBallsAndBesideTheMap) {
  Scene scene = dented_scene(0.0, Lambertian{grey(0.5)});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-2));
  const LampBearings bearings(field, false);
  const ShadowReach reach(bearings, scene, true);
  EXPECT_EQ(reach.doubtful(0.0f, 0.0f, 1), 7u);
  EXPECT_EQ(reach.doubtful(9.0f, 0.0f, 0), 7u);
  EXPECT_EQ(reach.doubtful(-5.0f, 3.0f, 0), 0u);  // flat there
}

}  // namespace
}  // namespace touchstone::render
