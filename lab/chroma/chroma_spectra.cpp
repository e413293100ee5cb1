#include "lab/chroma/chroma_spectra.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/error.h"
#include "core/units.h"
#include "lab/chroma/chroma_setup.h"
#include "render/cameras/first_hits.h"
#include "render/paths/path_tracer.h"
#include "sensors/colour/hue.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_imager.h"
#include "sim/scene/scene.h"
#include "sim/view/scene_view.h"

namespace touchstone::lab {
namespace {

constexpr double kHalfPatch_mm = 0.2;    // of the square that is looked at: clear of what the lens blurs at rims
constexpr double kLeastMarker_mm = 1.0;  // narrower ones leave no space for it
constexpr double kStep_nm = 1.0;         // of the products
constexpr const char* kNames[] = {"white", "magenta", "yellow", "red"};
constexpr std::size_t kPalette[] = {0, 3, 4, 1};  // blue for white

using Curve = std::function<double(double nm)>;

/// The curves of the four, without the lamps' light.
struct Curves {
  render::SpectralCurve lamp, white, magenta, film;

  double product(ChromaColour colour, double nm) const {
    const bool ink = colour == ChromaColour::magenta || colour == ChromaColour::red;
    const bool filtered = colour == ChromaColour::yellow || colour == ChromaColour::red;
    return (ink ? magenta : white).at(nm) * (filtered ? film.at(nm) : 1.0);
  }
};

const render::SpectralCurve& curve_of(const sim::Colour& colour, const sim::DeviceSpec& device, const char* what) {
  if (!colour.curve) fail("device {}: {} must be a spectrum, not numbers", device.name, what);
  return *colour.curve;
}

Curves curves_of(const sim::DeviceSpec& device) {
  if (!device.bands) fail("device {}: has no bands, so it has no spectra", device.name);
  if (!device.coating || !device.coating->print || device.coating->type != sim::CoatingType::matt) {
    fail("device {}: needs a matt coating with markers", device.name);
  }
  if (!device.films) fail("device {}: has no films", device.name);
  if (device.lamps.empty() || !device.lamps.front().spectrum) {
    fail("device {}: needs lamps that have a spectrum", device.name);
  }
  const sim::PrintSpec& print = *device.coating->print;
  if (print.shape != render::MarkShape::square || !(print.width_mm >= kLeastMarker_mm) ||
      !(print.spacing_mm.y() - print.width_mm > 2.0 * kHalfPatch_mm)) {
    fail("device {}: needs square markers of at least {} mm, {} mm apart at their rims", device.name, kLeastMarker_mm,
         2.0 * kHalfPatch_mm);
  }
  return {*device.lamps.front().spectrum, curve_of(device.coating->albedo, device, "coating.albedo"),
          curve_of(print.colour, device, "coating.print.colour"),
          curve_of(device.films->transmittance, device, "films.transmittance")};
}

/// Integral of lamp times `factor` over a band.
double light_in_band(const Curves& curves, const Curve& factor, double from_nm, double to_nm) {
  const int steps = std::max(1, static_cast<int>(std::lround((to_nm - from_nm) / kStep_nm)));
  double sum = 0.0;
  for (int k = 0; k < steps; ++k) {
    const double nm = from_nm + (k + 0.5) / steps * (to_nm - from_nm);
    sum += render::emitted_at(curves.lamp, nm) * factor(nm) * (to_nm - from_nm) / steps;
  }
  return sum;
}

render::Spectrum light_of(const Curves& curves, ChromaColour colour, const render::SpectralBands& bands) {
  render::Spectrum light(bands.count());
  for (int b = 0; b < bands.count(); ++b) {
    light[b] = light_in_band(
        curves, [&](double nm) { return curves.product(colour, nm); }, bands.edges_nm[b], bands.edges_nm[b + 1]);
  }
  return light;
}

SeenHue hue_of(const render::Spectrum& light, const render::Imager& imager) {
  const render::QuantumEfficiency electrons = render::response_of(imager).electrons_per_irradiance;
  Eigen::Vector3d rgb = (electrons * light.matrix()).cwiseProduct(imager.white_balance);
  // A binned picture's green sample has twice the electrons, and half of the gain.
  for (int c = 0; c < 3; ++c) rgb[c] *= render::channel_imager(imager, c).gain_DN_per_e;
  const double most = rgb.maxCoeff();
  const double span = most - rgb.minCoeff();
  SeenHue seen;
  seen.saturation = span / most;
  if (!(span > 0.0)) return seen;
  const double hue = sensors::hue_of(sensors::hue_direction(rgb[2], rgb[1], rgb[0]));
  seen.hue_deg = sensors::hue_difference(hue, 0.0) / kRadiansPerDegree;
  return seen;
}

/// Where the four are looked for, from the rest place of a marker's middle and as they look on the sheet.
struct Patches {
  double shear_mm = 0.0;  ///< along x
  std::array<Eigen::Vector2d, 4> places;
};
Patches patches_of(const sim::DeviceSpec& device) {
  const sim::PrintSpec& print = *device.coating->print;
  const double half = 0.5 * print.width_mm;
  const double distance = parallax_of(device).viewing_distance_mm;
  const double film = 0.5 * device.films->side_mm * distance / (distance - device.gel.thickness_mm);
  Patches patches;
  patches.shear_mm = half;
  // From left to right: the film's rim at -film, the marker's at 0, the film's at film, the marker's at 2 half.
  patches.places = {Eigen::Vector2d(0.0, 0.5 * print.spacing_mm.y()), Eigen::Vector2d(0.5 * (film + 2.0 * half), 0.0),
                    Eigen::Vector2d(-0.5 * film, 0.0), Eigen::Vector2d(0.5 * film, 0.0)};
  const bool fits = 0.5 * film > kHalfPatch_mm && 2.0 * half - film > 2.0 * kHalfPatch_mm;
  // Nor may the neighbour's film reach the patches of what is beside one.
  const double right = patches.places[1].x() + kHalfPatch_mm;
  const bool free = film + right < print.spacing_mm.x() && film + kHalfPatch_mm < 0.5 * print.spacing_mm.y();
  if (!fits || !free) {
    fail("device {}: films that look {:.3g} mm wide don't leave half of a marker of {} mm free", device.name,
         2.0 * film, print.width_mm);
  }
  return patches;
}

/// The device with nothing near it, made fast: it stays flat, so its mesh doesn't matter.
sim::SceneSpec bare_scene(sim::DeviceSpec device) {
  constexpr double kFarAbove_mm = 20.0;
  device.mesh.fine_mm = device.mesh.coarse_mm;
  device.mesh.fine_depth_mm = std::max(device.mesh.fine_depth_mm, device.mesh.fine_mm);
  sim::SceneSpec scene;
  scene.device = std::move(device);
  scene.object.name = "ball";
  scene.object.shape.radius_mm = 1.0;
  scene.motion.start_mm = {0, 0, kFarAbove_mm};
  sim::MotionKey key;
  key.z = sim::AxisKey{kFarAbove_mm, std::nullopt};
  scene.motion.keys = {key};
  scene.effects.fine_relief = sim::Switch::off;
  scene.effects.friction = sim::Switch::off;
  scene.effects.interreflection = sim::Switch::on;
  return scene;
}

}  // namespace

ChromaSpectra measure_chroma_spectra(const sim::DeviceSpec& device, const std::filesystem::path& cache, int samples,
                                     std::uint64_t seed) {
  const Curves curves = curves_of(device);
  const Patches patches = patches_of(device);
  const sim::SceneSpec scene = bare_scene(device);
  const sim::Plan plan = sim::make_plan(scene);
  const auto gel = sim::set_up_gel(scene.device, cache);
  fem::PressState press = sim::at_rest(sim::play_motion(scene, plan, *gel).front().press);
  press.surface_displacement.col(0).setConstant(patches.shear_mm);
  const sim::SceneView view(scene, plan, *gel);
  const render::Scene seen = view.seen(press, {});
  const render::Camera camera = sim::camera_of(*device.camera);
  const render::ReadyCamera ready = render::make_ready(camera);
  const render::Imager imager = sim::imager(device, plan.bands, false);

  cv::Mat where(device.camera->height, device.camera->width, CV_8UC1, cv::Scalar(0));  // colour + 1
  const Eigen::Vector2d marker = 0.5 * device.coating->print->spacing_mm;
  for (const double side_x : {-1.0, 1.0}) {
    for (const double side_y : {-1.0, 1.0}) {
      for (std::size_t colour = 0; colour < patches.places.size(); ++colour) {
        std::vector<cv::Point> corners;
        for (const Eigen::Vector2d& corner : {Eigen::Vector2d(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
          const Eigen::Vector2d at = Eigen::Vector2d(side_x * marker.x(), side_y * marker.y()) +
                                     patches.places[colour] + kHalfPatch_mm * corner;
          const auto pixel = render::project_through_faces(seen, ready, {at.x(), at.y(), 0.0});
          if (!pixel) fail("device {}: the camera doesn't see the markers in the middle", device.name);
          corners.emplace_back(static_cast<int>(std::floor(pixel->x())), static_cast<int>(std::floor(pixel->y())));
        }
        cv::fillConvexPoly(where, corners, cv::Scalar(static_cast<double>(colour + 1)));
      }
    }
  }
  render::RenderSettings settings;
  settings.seed = seed;
  settings.min_samples = settings.max_samples = samples;
  const cv::Mat light = render::Tracer(seen).render(camera, settings, where).irradiance;

  ChromaSpectra spectra;
  TS_ASSERT(plan.bands.ranges);
  spectra.bands = *plan.bands.ranges;
  const int bands = spectra.bands.count();
  std::array<render::Spectrum, 4> sums;
  sums.fill(render::Spectrum::Zero(bands));
  for (int y = 0; y < where.rows; ++y) {
    for (int x = 0; x < where.cols; ++x) {
      const int colour = where.at<std::uint8_t>(y, x);
      if (colour == 0) continue;
      const float* pixel = light.ptr<float>(y) + bands * x;
      for (int b = 0; b < bands; ++b) sums[colour - 1][b] += static_cast<double>(pixel[b]);
    }
  }
  const render::Spectrum white = light_of(curves, ChromaColour::white, spectra.bands);
  for (std::size_t k = 0; k < spectra.colours.size(); ++k) {
    const auto colour = static_cast<ChromaColour>(k);
    ChromaSpectrum& one = spectra.colours[k];
    one.name = kNames[k];
    if (!(sums[k].sum() > 0.0)) fail("device {}: no light comes from {}", device.name, one.name);
    const render::Spectrum of_curves = light_of(curves, colour, spectra.bands);
    one.rendered = sums[k] / sums[k].sum();
    one.product = colour == ChromaColour::white ? of_curves : sums[0] * of_curves / white;
    one.product /= one.product.sum();
    one.error = (one.rendered - one.product).abs().sum();
    one.rendered_hue = hue_of(one.rendered, imager);
    one.product_hue = hue_of(of_curves, imager);
  }
  return spectra;
}

plots::LinePlot plot_of(const ChromaSpectra& spectra) {
  plots::LinePlot plot;
  plot.title = "Light that reaches the camera (dashed: products of the curves)";
  plot.x_label = "wavelength, nm";
  plot.y_label = "part of the light, % a nm";
  plot.log_x = plot.log_y = false;
  const render::Spectrum centres = spectra.bands.centres_nm();
  for (const bool rendered : {true, false}) {
    for (std::size_t k = 0; k < spectra.colours.size(); ++k) {
      const ChromaSpectrum& one = spectra.colours[k];
      plots::PlotCurve curve;
      if (rendered) curve.name = one.name;
      curve.colour = kPalette[k];
      curve.dashed = !rendered;
      for (int b = 0; b < spectra.bands.count(); ++b) {
        const double width = spectra.bands.edges_nm[b + 1] - spectra.bands.edges_nm[b];
        curve.points.emplace_back(centres[b], 100.0 * (rendered ? one.rendered : one.product)[b] / width);
      }
      plot.curves.push_back(std::move(curve));
    }
  }
  return plot;
}

}  // namespace touchstone::lab
