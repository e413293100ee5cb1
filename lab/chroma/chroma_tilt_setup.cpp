#include "lab/chroma/chroma_tilt_setup.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/units.h"
#include "lab/chroma/chroma_design.h"
#include "render/paths/path_tracer.h"

namespace touchstone::lab {
namespace {

enum MediumIndex { kAir = 0, kPlate = 1, kGel = 2 };

constexpr double kPlateIndex = 1.49;  // acrylic
constexpr double kGelIndex = 1.41;    // silicone
constexpr double kFilmIndex = 1.5;
constexpr int kBands = 16;
constexpr double kRigidRadius_mm = 1.6;  // beyond the marker's corners
constexpr double kFadedRadius_mm = 4.2;
constexpr double kBallGap_mm = 0.05;  // of gel between ball and sheet
constexpr double kFilmInGel_mm = 1e-3;
constexpr int kCellsASide = 20;  // of the marker
constexpr int kFineSides = 4;    // the sheet is so finely cut over this many marker's sides
constexpr double kGuideSide_mm = 20.0;
constexpr double kGuideWidth_mm = 36.0;

double ball_depth(const TiltSetup& setup) {
  return 0.5 * setup.side_mm + kBallGap_mm;
}

/// 1 near the marker, 0 far from it.
double share_of_motion(double radius) {
  const double x = std::clamp((kFadedRadius_mm - radius) / (kFadedRadius_mm - kRigidRadius_mm), 0.0, 1.0);
  return x * x * x * (x * (6.0 * x - 15.0) + 10.0);
}

/// Lines of the sheet's grid along one axis, from the marker's middle.
std::vector<double> grid_lines(double side) {
  const double step = side / kCellsASide;
  const int fine = kFineSides * kCellsASide / 2 + kCellsASide / 2;
  std::vector<double> lines;
  for (const double far : {-30.0, -15.0, -8.0}) lines.push_back(far);
  for (int k = -fine; k <= fine; ++k) lines.push_back(step * k);
  for (const double far : {8.0, 15.0, 30.0}) lines.push_back(far);
  return lines;
}

/// Where the sheet's material is; (u, v) from the marker's middle.
Eigen::Vector3d sheet_point(const TiltSetup& setup, TiltMarker marker, const TiltPose& pose, double u, double v) {
  const Eigen::Vector3d rest(u, v, 0.0);
  const double depth = marker == TiltMarker::ball ? ball_depth(setup) : 0.0;
  const double pressed = std::max(0.0, -pose.moved_mm.z());
  const double stretch = marker == TiltMarker::flat ? column_stretch(pressed, setup.gel_mm, setup.poisson_ratio) : 1.0;
  const Eigen::Vector3d arm(stretch * u, stretch * v, depth);  // from the centre that it turns about
  const Eigen::Vector3d moved =
      Eigen::AngleAxisd(pose.tilt, Eigen::Vector3d::UnitY()) * arm - Eigen::Vector3d(0.0, 0.0, depth) + pose.moved_mm;
  const Eigen::Vector3d place(setup.place_mm.x(), setup.place_mm.y(), 0.0);
  return place + rest + share_of_motion(std::hypot(u, v)) * (moved - rest);
}

/// The sheet: all but the marker, and the marker, which share the vertices along its rim.
struct Sheet {
  TriangleMesh white, ink;
};
Sheet make_sheet(const TiltSetup& setup, TiltMarker marker, const TiltPose& pose) {
  const std::vector<double> lines = grid_lines(setup.side_mm);
  const int count = static_cast<int>(lines.size());
  Sheet sheet;
  for (const double v : lines) {
    for (const double u : lines) sheet.white.vertices.push_back(sheet_point(setup, marker, pose, u, v));
  }
  sheet.ink.vertices = sheet.white.vertices;
  const double half = 0.5 * setup.side_mm;
  for (int j = 0; j + 1 < count; ++j) {
    for (int i = 0; i + 1 < count; ++i) {
      const double u = 0.5 * (lines[i] + lines[i + 1]);
      const double v = 0.5 * (lines[j] + lines[j + 1]);
      const bool ink = marker != TiltMarker::ball && std::abs(u) < half && std::abs(v) < half;
      std::vector<std::array<int, 3>>& triangles = ink ? sheet.ink.triangles : sheet.white.triangles;
      const int a = j * count + i;
      triangles.push_back({a, a + 1, a + count + 1});
      triangles.push_back({a, a + count + 1, a + count});
    }
  }
  return sheet;
}

TriangleMesh square_film(const TiltSetup& setup) {
  const double h = 0.5 * setup.film_mm;
  const double z = -setup.gel_mm + kFilmInGel_mm;
  TriangleMesh mesh;
  for (const Eigen::Vector2d& corner : {Eigen::Vector2d(-h, -h), {h, -h}, {h, h}, {-h, h}}) {
    mesh.vertices.emplace_back(setup.place_mm.x() + corner.x(), setup.place_mm.y() + corner.y(), z);
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

/// How far the film is from the lens as seen in air.
double distance_in_air(const TiltSetup& setup) {
  return setup.camera_mm - setup.gel_mm - setup.plate_mm + setup.plate_mm / kPlateIndex + setup.gel_mm / kGelIndex;
}

/// 3 x bands, in proportion to the electrons of a watt: efficiency times photons, which are as the wavelength.
Eigen::MatrixXd electrons_a_watt(const TiltSpectra& spectra) {
  return spectra.efficiency * spectra.bands.centres_nm().matrix().asDiagonal();
}

}  // namespace

TiltSetup far_setup() {
  return {};
}

TiltSetup near_setup() {
  TiltSetup setup;
  setup.gel_mm = 8.0;
  setup.film_mm = 1.54;
  setup.camera_mm = 65.06;
  setup.pixel_pitch_um = 36.08;
  setup.f_number = 11.0;
  setup.half_view_mm = 2.2;
  setup.samples = 64;
  return setup;
}

TiltSpectra read_tilt_spectra(const std::filesystem::path& spectra) {
  using render::CurveKind;
  const auto share = [&](const char* name) { return render::read_spectral_curve(spectra / name, CurveKind::share); };
  const render::SpectralCurve lamp = render::read_spectral_curve(spectra / "led-white-4000K.csv", CurveKind::relative);
  const render::SpectralCurve white = share("silicone-white.csv");
  const render::SpectralCurve magenta = share("pigment-magenta.csv");
  const render::SpectralCurve film = share("film-yellow-500.csv");
  const std::array<render::SpectralCurve, 3> pixels = {share("qe-imx273-red.csv"), share("qe-imx273-green.csv"),
                                                       share("qe-imx273-blue.csv")};
  std::vector<render::SpectralPath> paths;
  for (const render::SpectralCurve& pixel : pixels) {
    for (const render::SpectralCurve& sheet : {white, magenta}) {
      paths.push_back({lamp, {sheet, pixel}});
      paths.push_back({lamp, {film, sheet, film, pixel}});
    }
  }
  TiltSpectra made;
  made.bands = render::adapted_bands(paths, lamp, 400.0, 720.0, kBands);
  made.lamp = render::band_powers(lamp, 1.0, made.bands);
  made.white = render::band_means(white, made.bands);
  made.magenta = render::band_means(magenta, made.bands);
  made.film = render::band_means(film, made.bands);
  made.efficiency.resize(3, made.bands.count());
  for (int c = 0; c < 3; ++c) made.efficiency.row(c) = render::band_means(pixels[c], made.bands).transpose();
  return made;
}

TiltColours tilt_colours(const TiltSpectra& spectra) {
  const Eigen::MatrixXd electrons = electrons_a_watt(spectra);
  const Eigen::Vector3d grey = electrons * spectra.lamp.matrix();
  const auto colour = [&](const render::Spectrum& reflectance) -> Eigen::Vector3d {
    return (electrons * (spectra.lamp * reflectance).matrix()).cwiseQuotient(grey);
  };
  const render::Spectrum twice = spectra.film.square();
  return {colour(spectra.white), colour(spectra.magenta), colour(twice * spectra.white),
          colour(twice * spectra.magenta)};
}

render::Scene tilt_scene(const TiltSetup& setup, const TiltSpectra& spectra, TiltMarker marker, const TiltPose& pose) {
  if (!(pose.tilt >= 0.0 && pose.tilt <= 0.25 * kPi + 1e-12)) {
    fail("a tilt of {:.4g} rad must be from 0 to pi / 4", pose.tilt);
  }
  const double reach = std::max(marker == TiltMarker::ball ? ball_depth(setup) + 0.5 * setup.side_mm : 0.0,
                                kFadedRadius_mm * std::sin(pose.tilt));
  if (!(pose.moved_mm.z() <= 0.0 && reach - pose.moved_mm.z() < setup.gel_mm)) {
    fail("a marker moved by {:.4g} mm must be moved towards the film, and stay clear of it", pose.moved_mm.z());
  }
  render::Scene scene;
  scene.media = {{1.0}, {kPlateIndex}, {kGelIndex}};
  scene.faces = {{-setup.gel_mm - setup.plate_mm, kAir, kPlate}, {-setup.gel_mm, kPlate, kGel}};
  scene.environment = render::flat_spectrum(spectra.bands.count(), 0.0);
  Sheet sheet = make_sheet(setup, marker, pose);
  scene.surfaces.push_back({std::move(sheet.white), render::Lambertian{spectra.white}});
  if (marker == TiltMarker::ball) {
    const Eigen::Vector3d rest(setup.place_mm.x(), setup.place_mm.y(), -ball_depth(setup));
    scene.balls.push_back({rest + pose.moved_mm, 0.5 * setup.side_mm, render::Lambertian{spectra.magenta}});
  } else {
    scene.surfaces.push_back({std::move(sheet.ink), render::Lambertian{spectra.magenta}});
  }
  scene.surfaces.push_back({square_film(setup), render::ThinFilm{spectra.film, kFilmIndex, false}});
  const double z = -setup.gel_mm - 0.5 * setup.plate_mm;
  for (const Eigen::Vector2d& side : {Eigen::Vector2d(-1.0, 0.0), {1.0, 0.0}, {0.0, 1.0}}) {
    const Eigen::Vector2d at = kGuideSide_mm * side;
    scene.lamps.push_back(render::GuideLamp{
        {at.x(), at.y(), z}, {-side.x(), -side.y(), 0.0}, 0.0, kGuideWidth_mm, 40.0 * kRadiansPerDegree, spectra.lamp});
  }
  return scene;
}

render::Camera tilt_camera(const TiltSetup& setup) {
  render::LensCamera camera;
  const double focus = distance_in_air(setup);
  const double px_per_mm = setup.lens_mm / (focus - setup.lens_mm) * kMicrometresPerMillimetre / setup.pixel_pitch_um;
  camera.width = camera.height = 2 * static_cast<int>(std::ceil(setup.half_view_mm * px_per_mm));
  camera.pixel_pitch_um = setup.pixel_pitch_um;
  camera.aperture_mm = setup.lens_mm / setup.f_number;
  camera.focus_distance_mm = focus;
  camera.matrix = render::matrix_of_lens(setup.lens_mm, focus, setup.pixel_pitch_um, camera.width, camera.height);
  camera.matrix.cx += setup.phase_px.x() - setup.place_mm.x() * px_per_mm;
  camera.matrix.cy += setup.phase_px.y() - setup.place_mm.y() * px_per_mm;
  camera.gel_from_camera.translation = {0.0, 0.0, -setup.camera_mm};
  return camera;
}

cv::Mat tilt_picture(const TiltSetup& setup, const TiltSpectra& spectra, TiltMarker marker, const TiltPose& pose,
                     std::uint64_t seed) {
  const render::Tracer tracer(tilt_scene(setup, spectra, marker, pose));
  render::RenderSettings settings;
  settings.seed = seed;
  settings.min_samples = settings.max_samples = setup.samples;
  const cv::Mat light = tracer.render(tilt_camera(setup), settings).irradiance;
  const int bands = spectra.bands.count();
  const Eigen::MatrixXd electrons = electrons_a_watt(spectra);
  const Eigen::Vector3d grey = electrons * spectra.lamp.matrix();
  cv::Mat picture(light.size(), CV_32FC3);
  for (int y = 0; y < light.rows; ++y) {
    const float* from = light.ptr<float>(y);
    for (int x = 0; x < light.cols; ++x) {
      const Eigen::VectorXd here = Eigen::Map<const Eigen::VectorXf>(from + bands * x, bands).cast<double>();
      const Eigen::Vector3d rgb = (electrons * here).cwiseQuotient(grey);
      picture.at<cv::Vec3f>(y, x) = {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]),
                                     static_cast<float>(rgb[2])};
    }
  }
  return picture;
}

}  // namespace touchstone::lab
