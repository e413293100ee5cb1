#include "tests/golden/golden_scenes.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "core/error.h"
#include "core/units.h"
#include "render/spectra/spectral_curve.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/scene.h"
#include "sim/view/visible_scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::golden {
namespace {

using namespace render;

const Bands<3> kRed(1.0, 0.15, 0.05);
const Bands<3> kGreen(0.15, 1.0, 0.2);
const Bands<3> kBlue(0.05, 0.2, 1.0);

/// A pinhole 17.4 mm below the glass that sees 20 x 15 mm of the gel's surface.
PinholeCamera sensor_camera(int width = 64, int height = 48) {
  PinholeCamera camera;
  camera.width = width;
  camera.height = height;
  camera.pixel_pitch_um = 69.0 * 64.0 / width;
  camera.distance_mm = 5.0;
  camera.gel_from_camera = look_at({0, 0, -22.4}, {0, 0, 0}, {0, 1, 0});
  return camera;
}

/// Air below z = -7, a plate of 2 mm, gel above: media 0, 1, 2.
Scene plate_and_gel(int bands) {
  Scene scene;
  scene.environment = flat_spectrum(bands, 0.0);
  scene.media = {Medium{1.0}, Medium{1.517}, Medium{1.41}};
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}};
  return scene;
}

/// A membrane of 22 x 17 mm into which a ball and a ridge are pressed from above; looks down at the camera.
TriangleMesh pressed_membrane() {
  constexpr int kColumns = 110;
  constexpr int kRows = 85;
  TriangleMesh mesh;
  for (int j = 0; j <= kRows; ++j) {
    for (int i = 0; i <= kColumns; ++i) {
      const double x = 0.2 * i - 11.0;
      const double y = 0.2 * j - 8.5;
      const double ball = 0.9 * std::exp(-((x + 3.5) * (x + 3.5) + y * y) / (2.0 * 1.3 * 1.3));
      const double ridge = 0.5 / (1.0 + std::exp((std::abs(x - 4.5) - 0.7) / 0.12)) *
                           (1.0 / (1.0 + std::exp((std::abs(y - 1.0) - 3.5) / 0.12)));
      mesh.vertices.push_back({x, y, -ball - ridge});
    }
  }
  for (int j = 0; j < kRows; ++j) {
    for (int i = 0; i < kColumns; ++i) {
      const int a = j * (kColumns + 1) + i;
      const int b = a + kColumns + 1;
      mesh.triangles.push_back({a, b + 1, a + 1});
      mesh.triangles.push_back({a, b, b + 1});
    }
  }
  return mesh;
}

/// Dots of 0.5 mm radius every 2 mm, of one ink.
Print dots_on(const TriangleMesh& mesh, const Spectrum& ink) {
  Print print;
  for (const Eigen::Vector3d& vertex : mesh.vertices) print.material_mm.push_back(vertex.head<2>());
  print.inks = {ink};
  for (int i = -5; i <= 5; ++i) {
    for (int j = -4; j <= 4; ++j) print.marks.push_back({{2.0 * i, 2.0 * j}, 0.5, 0});
  }
  return print;
}

SpotLamp led(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Spectrum& power_W) {
  SpotLamp lamp;
  lamp.position = position;
  lamp.direction = target - position;
  lamp.lens_radius = 0.8;
  lamp.half_angle = 0.4;
  lamp.soft_angle = 0.35;
  lamp.power_W = power_W;
  return lamp;
}

/// Red, green and blue LEDs low at three sides, in the gel as gelsight has them.
void light_from_the_sides(Scene& scene, double shift_mm = 0.0) {
  scene.lamps.push_back(led({-14, -2 + shift_mm, -3.5}, {0, 0, -0.5}, 0.02 * kRed));
  scene.lamps.push_back(led({14, -2, -3.5}, {0, 0, -0.5}, 0.02 * kGreen));
  scene.lamps.push_back(led({0, 13, -3.5}, {0, 0, -0.5}, 0.02 * kBlue));
}

/// A ring of white LEDs round the camera.
void light_from_below(Scene& scene, const Spectrum& power_W) {
  for (int i = 0; i < 8; ++i) {
    const double angle = 2.0 * kPi * (i + 0.5) / 8.0;
    scene.lamps.push_back(led({16 * std::cos(angle), 16 * std::sin(angle), -20}, {0, 0, -2}, power_W));
  }
}

GoldenScene metallic_membrane() {
  Scene scene = plate_and_gel(3);
  scene.surfaces.push_back({pressed_membrane(), RoughConductor{Bands<3>(0.85, 0.83, 0.8), 0.35}});
  light_from_the_sides(scene);
  return {"metallic-membrane", scene, sensor_camera()};
}

/// A half-transparent white layer on clear gel, as dvs has, with dark things on it: a plate that it wets and a ball
/// that dents it by less than its thickness.
GoldenScene milky_layer() {
  Scene scene = plate_and_gel(3);
  scene.media.push_back({1.41, Bands<3>(0.004, 0.006, 0.01), Bands<3>(1.1, 1.2, 1.3), 0.6});
  scene.faces.push_back({-1.5, 2, 3});
  scene.faces.push_back({0.0, 3, 0});
  scene.environment = flat_spectrum(3, 5.0);
  scene.balls.push_back({{-4, 0, 1.6}, 2.2, Lambertian{flat_spectrum(3, 0.03)}});
  TriangleMesh plate;
  plate.vertices = {{2, -3, -0.02}, {7, -3, -0.02}, {7, 3, -0.02}, {2, 3, -0.02}};
  plate.triangles = {{0, 2, 1}, {0, 3, 2}};
  scene.surfaces.push_back({plate, Lambertian{Bands<3>(0.2, 0.05, 0.05)}});
  light_from_below(scene, flat_spectrum(3, 0.02));
  return {"milky-layer", scene, sensor_camera()};
}

/// A yellow film on the plate before magenta print, white LEDs, 16 bands.
GoldenScene film_over_print() {
  const auto file = [](const char* name) {
    return std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes" / "spectra" / name;
  };
  const SpectralBands bands = even_bands(400.0, 720.0, 16);
  Scene scene = plate_and_gel(16);
  const TriangleMesh membrane = pressed_membrane();
  const Spectrum magenta = band_means(read_spectral_curve(file("pigment-magenta.csv"), CurveKind::share), bands);
  const Spectrum white = band_means(read_spectral_curve(file("silicone-white.csv"), CurveKind::share), bands);
  scene.surfaces.push_back({membrane, Lambertian{white}, dots_on(membrane, magenta)});
  TriangleMesh film;
  film.vertices = {{-12, -9, -5.001}, {0.9, -9, -5.001}, {0.9, 9, -5.001}, {-12, 9, -5.001}};
  film.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Spectrum yellow = band_means(read_spectral_curve(file("film-yellow-500.csv"), CurveKind::share), bands);
  scene.surfaces.push_back({film, ThinFilm{yellow, 1.517, false}});
  light_from_below(scene,
                   band_powers(read_spectral_curve(file("led-white-4000K.csv"), CurveKind::relative), 0.1, bands));
  return {"film-over-print", scene, sensor_camera(32, 24)};
}

/// A frosted ball and a clear one before dotted paper, in a bright room.
GoldenScene frosted_ball() {
  Scene scene;
  scene.environment = Bands<3>(0.5, 0.6, 0.8);
  scene.media = {Medium{1.0}, Medium{1.5, Bands<3>(0.02, 0.01, 0.03)}};
  const TriangleMesh paper = pressed_membrane();
  scene.surfaces.push_back({paper, Lambertian{flat_spectrum(3, 0.8)}, dots_on(paper, Bands<3>(0.1, 0.1, 0.5))});
  scene.balls.push_back({{-3.5, 0, -5}, 2.5, RoughRefractive{1, 0, 0.2}});
  scene.balls.push_back({{3.5, 0, -5}, 2.5, Refractive{1, 0}});
  scene.lamps.push_back(led({10, 8, -20}, {0, 0, -2}, flat_spectrum(3, 0.005)));
  return {"frosted-ball", scene, sensor_camera()};
}

GoldenScene through_a_lens() {
  GoldenScene golden = printed_membrane(0.7, 0.0);
  golden.name = "through-a-lens";
  LensCamera lens;
  lens.width = 64;
  lens.height = 48;
  lens.pixel_pitch_um = 69.0;
  // Focused on the membrane, seen through glass and gel, a wide stop: the dents are out of focus.
  lens.focus_distance_mm = 15.4 + 2.0 / 1.517 + 5.0 / 1.41;
  lens.matrix = matrix_of_lens(3.5, lens.focus_distance_mm, lens.pixel_pitch_um, lens.width, lens.height);
  lens.distortion.k1 = -0.25;
  lens.distortion.k2 = 0.05;
  lens.distortion.p1 = 0.004;
  lens.aperture_mm = 1.6;
  lens.gel_from_camera = sensor_camera().gel_from_camera;
  golden.camera = lens;
  return golden;
}

/// The vhs device with a camera of a hundredth of the pixels and a coarser mesh, before and in a press with shear.
GoldenScene vhs(bool pressed) {
  const std::filesystem::path scenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
  sim::SceneSpec spec = sim::read_scene(scenes / "vhs" / "cycle.yaml");
  spec.device.camera->width = 64;
  spec.device.camera->height = 48;
  spec.device.camera->pixel_pitch_um = 69.0;
  spec.device.mesh.fine_mm = 0.8;
  spec.device.mesh.coarse_mm = 2.0;
  spec.motion = parse_yaml<sim::MotionSpec>(
      "start_mm: [0.7, -0.4, 0.05]\nkeys:\n  - {frames: 1, z: {force_N: 3.5}}\n  - {frames: 1, x: {force_N: 1}}\n",
      "press.yaml");
  const sim::Plan plan = sim::make_plan(spec);
  static const test::TemporaryFolder cache;
  const auto gel = sim::set_up_gel(spec.device, cache.path());
  const std::vector<sim::Truth> truths = sim::play_motion(spec, plan, *gel);
  const sim::Truth& truth = pressed ? truths.back() : truths.front();
  return {pressed ? "vhs-pressed" : "vhs-rest",
          sim::visible_scene(spec, plan, sim::visible_objects(spec), sim::VisibleGel(*gel), truth.press),
          sim::camera_of(*spec.device.camera)};
}

const std::map<std::string, std::function<GoldenScene()>>& makers() {
  static const std::map<std::string, std::function<GoldenScene()>> all = {
      {"film-over-print", film_over_print},
      {"frosted-ball", frosted_ball},
      {"metallic-membrane", metallic_membrane},
      {"milky-layer", milky_layer},
      {"printed-membrane", [] { return printed_membrane(0.7, 0.0); }},
      {"through-a-lens", through_a_lens},
      {"vhs-pressed", [] { return vhs(true); }},
      {"vhs-rest", [] { return vhs(false); }},
  };
  return all;
}

}  // namespace

GoldenScene printed_membrane(double albedo, double lamp_shift_mm) {
  Scene scene = plate_and_gel(3);
  const TriangleMesh membrane = pressed_membrane();
  scene.surfaces.push_back({membrane, Lambertian{flat_spectrum(3, albedo)}, dots_on(membrane, flat_spectrum(3, 0.05))});
  light_from_the_sides(scene, lamp_shift_mm);
  return {"printed-membrane", scene, sensor_camera()};
}

const std::vector<std::string>& golden_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& [name, maker] : makers()) all.push_back(name);
    return all;
  }();
  return names;
}

GoldenScene golden_scene(const std::string& name) {
  const auto found = makers().find(name);
  if (found == makers().end())
    fail("there is no golden image called {}; there are {}", name, fmt::join(golden_names(), ", "));
  return found->second();
}

}  // namespace touchstone::golden
