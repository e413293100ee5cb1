// The renderer and the imager against closed forms (light_closed_forms.h). Each row is the worst relative error of a
// few cases, averaged over seeds; the bounds are the statistical error of so many samples, some three standard
// deviations, plus what the closed form itself leaves out, as each row says.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "closed_forms/light_closed_forms.h"
#include "core/seconds_since.h"
#include "core/units.h"
#include "lab/light/light_energy_cases.h"
#include "lab/light/light_setup.h"
#include "lab/validation/validation.h"
#include "render/imager/imager.h"

namespace touchstone::lab {
namespace {

using render::Lambertian;
using render::Medium;
using render::Scene;
using render::Spectrum;
using render::Tracer;

constexpr int kSeeds = 5;
constexpr double kStudent95OfFive = 2.776;  // t of 4 degrees of freedom

TriangleMesh sheet(double half, double z) {
  TriangleMesh mesh;
  mesh.vertices = {{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

render::SpotLamp point_lamp(const Eigen::Vector3d& position, const Eigen::Vector3d& direction, double intensity) {
  render::SpotLamp lamp;
  lamp.position = position;
  lamp.direction = direction;
  lamp.half_angle = kPi / 2;
  lamp.soft_angle = 0.0;
  lamp.power_W = grey(intensity * 2.0 * kPi);
  return lamp;
}

Eigen::Vector3d slanted(double angle) {
  return {std::sin(angle), 0.0, std::cos(angle)};
}

double relative(double value, double expected) {
  return std::abs(value / expected - 1.0);
}

/// White balls in a gel under glass, in surroundings of one: all looks one.
double furnace(std::uint64_t seed, int effort) {
  Scene scene = empty_scene(1.0);
  scene.media = {Medium{1.0, {}}, Medium{1.52, {}}, Medium{1.41, {}}};
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}, {0.0, 2, 0}};
  for (double x : {-2.0, 0.0, 2.0}) scene.balls.push_back({{x, 0.3 * x, -1.0}, 0.8, Lambertian{grey(1.0)}});
  const Tracer tracer(scene);
  double sum = 0.0;
  constexpr int kViews = 25;
  for (int i = 0; i < kViews; ++i) {
    const Eigen::Vector3d from(0.3 * (i % 5) - 0.6, 0.3 * (i / 5) - 0.6, -27.0);
    const Eigen::Vector3d to(1.2 * (i % 5) - 2.4, 0.8 * (i / 5) - 1.6, -1.0);
    sum += tracer.radiance(from, to - from, samples(256 * effort, seed + 100 * i))[0];
  }
  return std::abs(sum / kViews - 1.0);
}

double slab(std::uint64_t seed, int effort) {
  Scene scene = empty_scene(1.0);
  scene.media = {Medium{1.0, {}}, Medium{1.5, {}}};
  scene.faces = {{0.0, 0, 1}, {2.0, 1, 0}};
  scene.surfaces.push_back({sheet(1000.0, 10.0), render::Black{}});  // what the plate passes ends here
  const Tracer tracer(scene);
  double worst = 0.0;
  for (double angle : {0.0, kPi / 4, 1.2}) {
    const double mirrored = tracer.radiance({0, 0, -5}, slanted(angle), samples(4096 * effort, seed))[0];
    worst = std::max(worst, relative(1.0 - mirrored, closed_forms::plate_transmittance(1.5, angle)));
  }
  return worst;
}

double beer_lambert(std::uint64_t seed, int) {
  Scene scene = empty_scene(1.0);
  scene.media = {Medium{1.0, {}}, Medium{1.0, grey(0.3)}};
  scene.faces = {{0.0, 0, 1}, {2.0, 1, 0}};
  const Tracer tracer(scene);
  double worst = 0.0;
  for (double angle : {0.0, 0.4, 0.8, 1.2}) {
    const double seen = tracer.radiance({0, 0, -5}, slanted(angle), samples(1, seed))[0];
    worst = std::max(worst, relative(seen, std::exp(-0.3 * 2.0 / std::cos(angle))));
  }
  return worst;
}

/// A hole of 100 um in 50 um of foil, on the rendered image, from the axis to 30 degrees and beyond.
double pinhole(std::uint64_t seed, int effort) {
  render::PinholeCamera camera;
  camera.width = 101;
  camera.height = 1;
  // Far behind the hole: the closed form takes light from a pixel to both rims as parallel, good to foil / distance.
  camera.distance_mm = 100.0;
  camera.pixel_pitch_um = 1200.0;
  camera.hole_diameter_um = 100.0;
  camera.foil_thickness_um = 50.0;
  const cv::Mat image = Tracer(empty_scene(3.0)).render(camera, samples(1024 * effort, seed)).irradiance;
  double worst = 0.0;
  for (int column = 0; column < camera.width; ++column) {
    constexpr int kParts = 16;
    double expected = 0.0;  // mean over the pixel
    for (int i = 0; i < kParts * kParts; ++i) {
      const double x = 1.2 * (column - 50 + (i % kParts + 0.5) / kParts - 0.5);
      const double y = 1.2 * ((i / kParts + 0.5) / kParts - 0.5);
      expected += closed_forms::pinhole_irradiance(3.0, 0.1, 100.0, std::atan(std::hypot(x, y) / 100.0), 0.05) /
                  (kParts * kParts);
    }
    worst = std::max(worst, relative(image.at<float>(0, column), expected));
  }
  return worst;
}

double patch_under(const Scene& above, std::uint64_t seed, int effort) {
  Scene scene = above;
  scene.surfaces.push_back({sheet(0.01, 0.0), Lambertian{grey(0.6)}});
  return Tracer(scene).radiance({-20, 0, 1.0}, Eigen::Vector3d(20, 0, -1.0), samples(16384 * effort, seed))[0] / 0.6;
}

double disc(std::uint64_t seed, int effort) {
  Scene scene = empty_scene(1.0);
  TriangleMesh mesh;
  mesh.vertices.push_back({0, 0, 2.0});
  constexpr int kCorners = 400;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * kPi * i / kCorners;
    mesh.vertices.push_back({1.5 * std::cos(angle), 1.5 * std::sin(angle), 2.0});
    mesh.triangles.push_back({0, i + 1, (i + 1) % kCorners + 1});
  }
  scene.surfaces.push_back({mesh, render::Black{}});
  return relative(patch_under(scene, seed, effort), 1.0 - closed_forms::disc_share(1.5, 2.0));
}

/// A black ball over a patch, and the light in a closed matt sphere with a lamp at its centre.
double sphere(std::uint64_t seed, int effort) {
  Scene ball = empty_scene(1.0);
  ball.balls.push_back({{0, 0, 3.0}, 1.5, render::Black{}});
  const double shadow = relative(patch_under(ball, seed, effort), 1.0 - closed_forms::sphere_share(1.5, 3.0));
  Scene cavity = empty_scene(0.0);
  cavity.balls.push_back({{0, 0, 0}, 4.0, Lambertian{grey(0.5)}});
  cavity.lamps.push_back(point_lamp({0, 0, 0}, {0, 0, 1}, 1.0));
  cavity.lamps.push_back(point_lamp({0, 0, 0}, {0, 0, -1}, 1.0));
  const double seen = Tracer(cavity).radiance({1, 0.5, 0.2}, {0.3, 0.5, 0.4}, samples(16384 * effort, seed))[0];
  return std::max(shadow, relative(seen, closed_forms::sphere_cavity_radiance(0.5, 1.0, 4.0)));
}

/// Distance in px between where beads under glass and gel are seen and where Snell's law puts them; the worst of four.
double apparent_depth(std::uint64_t seed, int effort) {
  render::PinholeCamera camera;
  camera.pixel_pitch_um = 3.45;
  camera.distance_mm = 3.0;
  camera.hole_diameter_um = 8.0;
  camera.foil_thickness_um = 0.0;
  camera.gel_from_camera = look_at({0, 0, -27}, {0, 0, 0}, {0, 1, 0});
  double worst = 0.0;
  for (const Eigen::Vector3d& centre : {Eigen::Vector3d(0, 0, -0.75), Eigen::Vector3d(4.5, 3.0, -0.75),
                                        Eigen::Vector3d(-6.0, 2.0, -3.0), Eigen::Vector3d(7.0, -4.5, -0.3)}) {
    const double lateral = centre.head<2>().norm();
    const std::array<double, 3> thicknesses = {20.0, 2.0, 5.0 + centre.z()};
    const std::array<double, 3> indices = {1.0, 1.52, 1.41};
    Eigen::Vector3d direction(0, 0, 1);
    if (lateral > 0.0) {
      direction.head<2>() = closed_forms::apparent_tangent(thicknesses, indices, lateral) * centre.head<2>() / lateral;
    }
    const Eigen::Vector2d expected = render::project(camera, camera.gel_from_camera.rotation.transpose() * direction);
    Scene scene = empty_scene(1.0);
    scene.media = {Medium{1.0, {}}, Medium{1.52, {}}, Medium{1.41, {}}};
    scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}};
    cv::Mat mask = cv::Mat::zeros(camera.height, camera.width, CV_8UC1);
    const cv::Rect around(static_cast<int>(expected.x()) - 14, static_cast<int>(expected.y()) - 14, 29, 29);
    mask(around & cv::Rect(0, 0, camera.width, camera.height)) = 1;
    const cv::Mat without = Tracer(scene).render(camera, samples(64 * effort, seed), mask).irradiance;
    scene.balls.push_back({centre, 0.25, render::Black{}});
    const cv::Mat with = Tracer(scene).render(camera, samples(64 * effort, seed), mask).irradiance;
    Eigen::Vector2d sum(0, 0);
    double weight = 0.0;
    for (int row = 0; row < camera.height; ++row) {
      for (int column = 0; column < camera.width; ++column) {
        if (mask.at<unsigned char>(row, column) == 0) continue;
        const double missing = 1.0 - double(with.at<float>(row, column)) / without.at<float>(row, column);
        sum += missing * Eigen::Vector2d(column + 0.5, row + 0.5);
        weight += missing;
      }
    }
    worst = std::max(worst, (sum / weight - expected).norm());
  }
  return worst;
}

/// A lamp through air, glass and gel to a matt surface, at four places, against Snell's law by bisection.
double lamp_through_layers(std::uint64_t seed, int) {
  Scene scene = empty_scene(0.0);
  scene.media = {Medium{1.0, {}}, Medium{1.52, {}}, Medium{1.41, {}}};
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}};
  scene.interreflection = false;
  scene.lamps.push_back(point_lamp({0, 0, -27}, {0, 0, 1}, 1.0));
  scene.surfaces.push_back({sheet(50.0, 0.0), Lambertian{grey(0.8)}});
  const Tracer tracer(scene);
  const std::array<double, 3> thicknesses = {20.0, 2.0, 5.0};
  const std::array<double, 3> indices = {1.0, 1.52, 1.41};
  double worst = 0.0;
  for (double x : {0.0, 5.0, 15.0, 40.0}) {
    const double sine = std::sin(std::atan(closed_forms::apparent_tangent(thicknesses, indices, x))) / 1.41;
    const double cosine = std::sqrt(1.0 - sine * sine);
    const double expected =
        0.8 / kPi * closed_forms::layered_irradiance(thicknesses, indices, x) * cosine / (1.41 * 1.41);
    worst = std::max(worst, relative(tracer.radiance({x, 0, -2}, {0, 0, 1}, samples(1, seed))[0], expected));
  }
  return worst;
}

/// Eight unlike lamps over a matt ball, one chosen at each hit, against the sum of the eight alone.
double lamp_choice(std::uint64_t seed, int effort) {
  Scene scene = empty_scene(0.0);
  scene.interreflection = false;
  scene.balls.push_back({{0, 0, 0}, 2.0, Lambertian{grey(0.7)}});
  std::vector<render::Lamp> lamps;
  for (int i = 0; i < 8; ++i) {
    const double angle = kPi / 4 * i;
    lamps.push_back(point_lamp({12 * std::cos(angle), 12 * std::sin(angle), -8.0 - i},
                               Eigen::Vector3d(-std::cos(angle), -std::sin(angle), 0.7), 1.0 + i));
  }
  double worst = 0.0;
  for (const Eigen::Vector3d& target :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1.2, 0.3, 0), Eigen::Vector3d(-0.4, 1.6, 0)}) {
    const Eigen::Vector3d eye(0, 0, -30);
    double sum = 0.0;
    for (const render::Lamp& lamp : lamps) {
      scene.lamps = {lamp};
      sum += Tracer(scene).radiance(eye, target - eye, samples(1, seed))[0];
    }
    scene.lamps = lamps;
    worst = std::max(worst, relative(Tracer(scene).radiance(eye, target - eye, samples(4096 * effort, seed))[0], sum));
  }
  return worst;
}

/// Temporal variance against mean, from pairs of frames: var = K^2 var_d + 1/12 + K (mean - dark).
double photon_transfer(std::uint64_t seed, int effort) {
  constexpr double kPlanckTimesLight = 6.62607015e-34 * 299792458.0;
  render::Imager imager;
  imager.bits = 12;
  imager.active_area_um2 = 10.0;
  imager.exposure_s = 1e-3;
  imager.quantum_efficiency.resize(1, 1);
  imager.quantum_efficiency << 0.5;
  imager.wavelengths_nm = grey(540.0);
  imager.full_well_e = 10000.0;
  imager.read_noise_e = 3.0;
  imager.prnu = 0.01;
  imager.dsnu_e = 2.0;
  imager.gain_DN_per_e = 0.35;
  imager.black_level_DN = 20.0;
  const double per_electron = kPlanckTimesLight / (540e-9 * 10e-12 * 1e-3 * 0.5);
  const int side = effort > 1 ? 1200 : 500;
  const render::FixedPattern pattern = render::fixed_pattern(imager, {side, side}, seed);
  double worst = 0.0;
  for (double electrons : {10.0, 100.0, 1000.0, 8000.0}) {
    const cv::Mat light(side, side, CV_32FC1, cv::Scalar(electrons * per_electron));
    cv::Mat a, b;
    render::expose(light, imager, pattern, seed, 1).convertTo(a, CV_64F);
    render::expose(light, imager, pattern, seed, 2).convertTo(b, CV_64F);
    const double mean = 0.5 * (cv::mean(a)[0] + cv::mean(b)[0]);
    const cv::Mat difference = a - b;
    const double variance = 0.5 * cv::mean(difference.mul(difference))[0];
    const double expected = 0.35 * 0.35 * 9.0 + 1.0 / 12.0 + 0.35 * (mean - 20.0);
    worst = std::max(worst, relative(variance, expected));
  }
  return worst;
}

struct LightCase {
  const char* id;
  const char* title;
  const char* unit;
  double bound;
  std::function<double(std::uint64_t seed, int effort)> error;
};

}  // namespace

std::vector<ValidationRow> validate_light(const ValidateOptions& options) {
  const std::vector<LightCase> cases = {
      // Of 6400 paths few are lost or won at all: Russian roulette and one choice of two at faces are the only spread.
      {"light.furnace", "white things in gel under glass, in surroundings of one", "1", 5e-4, furnace},
      {"light.slab", "what a plate of n = 1.5 passes at 0, 45 and 69 degrees", "1", 3e-4, slab},
      {"light.beer_lambert", "absorption along slanted paths", "1", 1e-9, beer_lambert},
      // The closed form's own error is foil / distance, 5e-4; the rest is sampling.
      {"light.pinhole", "fall-off behind 100 um in 50 um of foil, to 31 degrees", "1", 1e-3, pinhole},
      {"light.disc", "surroundings hidden by a coaxial disc", "1", 1e-3, disc},
      // The cavity's paths end by Russian roulette: half a percent of 16384 paths, three times that at most.
      {"light.sphere", "surroundings hidden by a ball; light in a closed sphere", "1", 0.015, sphere},
      {"light.apparent_depth", "beads under glass and gel seen where Snell puts them", "px", 0.1, apparent_depth},
      {"light.connection", "a lamp through air, glass and gel", "1", 1e-4, lamp_through_layers},
      {"light.lamp_choice", "eight lamps, one traced a hit, against their sum", "1", 1e-3, lamp_choice},
      // A variance of n differences has a standard error of sqrt(2/n): 0.28 % of 500 x 500; the worst of four.
      {"light.photon_transfer", "variance against mean of the imager", "1", 0.01, photon_transfer},
      // The same of 250 x 1000 pixels; the worst of twelve.
      {"light.photon_transfer_presets", "variance against mean of every imager preset", "1", 0.012,
       photon_transfer_of_presets},
      // Each path carries what it would without the body.
      {"light.rough_furnace", "bodies of rough glass in surroundings of one", "1", 1e-9, rough_furnace},
      // Places by the lamp and far from it differ much: 1.5 % for one seed, the mean of five.
      {"light.closed_box", "what the walls of a closed box take in of what its lamp sends", "1", 0.02, closed_box},
      // Of 160,000 paths 60 % meet the disc: 0.2 %.
      {"light.coaxial_discs", "light from disc to disc", "1", 6e-3, coaxial_discs},
  };
  const int effort = options.quick ? 1 : 4;
  std::vector<ValidationRow> rows;
  for (const LightCase& one : cases) {
    if (options.progress) options.progress("light", static_cast<std::int64_t>(rows.size()), std::ssize(cases));
    const auto begun = std::chrono::steady_clock::now();
    std::array<double, kSeeds> errors;
    double sum = 0.0;
    for (int i = 0; i < kSeeds; ++i) sum += errors[i] = one.error(static_cast<std::uint64_t>(11 + i), effort);
    ValidationRow row;
    row.id = one.id;
    row.title = one.title;
    row.unit = one.unit;
    row.reference = 0.0;
    row.ours = sum / kSeeds;
    double squares = 0.0;
    for (double error : errors) squares += std::pow(error - row.ours, 2);
    const double half = kStudent95OfFive * std::sqrt(squares / (kSeeds - 1) / kSeeds);
    row.ci95 = {row.ours - half, row.ours + half};
    row.better = Better::lower;
    row.holds = row.ours <= one.bound;
    row.quick = options.quick;
    row.seconds = seconds_since(begun);
    rows.push_back(row);
  }
  return rows;
}

}  // namespace touchstone::lab
