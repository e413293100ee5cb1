#include "sim/sensor/membrane_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "render/imager/imager.h"
#include "sim/plan/scene_bands.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_imager.h"
#include "sim/view/visible_scene.h"

namespace touchstone::sim {
namespace {

/// The device's one band. @throws Error if it isn't fit for fast pictures
SceneBands one_band(const DeviceSpec& device) {
  const auto refuse = [&](const char* what) {
    fail_at(device.where, "the membrane's fast pictures can't be had: {}", what);
  };
  if (!device.camera) refuse("the device has no camera");
  if (device.camera->bayer != render::BayerPattern::none) refuse("its camera has colours; allowed is bayer: none");
  if (!device.gel.slab()) refuse("its gel isn't a slab");
  if (!device.lamps.empty()) refuse("it has lamps; allowed is light of the room alone");
  if (device.coating || device.beads || device.films) refuse("it has a coating, beads or films");
  if (device.bands || device.band_wavelengths_nm.size() != 1) {
    refuse("it has several bands; allowed is one wavelength in band_wavelengths_nm");
  }
  SceneBands bands;
  bands.centres_nm = Eigen::ArrayXd::Constant(1, device.band_wavelengths_nm.front());
  return bands;
}

int even_cells(double length_mm, double cell_mm) {
  return std::max(2, 2 * static_cast<int>(std::ceil(0.5 * length_mm / cell_mm - 1e-9)));
}

}  // namespace

render::MembraneOptics membrane_optics(const DeviceSpec& device) {
  const SceneBands bands = one_band(device);
  render::MembraneOptics optics;
  optics.thickness_mm = device.gel.thickness_mm;
  optics.index = device.gel.refractive_index;
  optics.absorption_per_mm = in_bands(device.gel.absorption_per_mm, bands, "gel.absorption_per_mm")[0];
  optics.scattering_per_mm = in_bands(device.gel.scattering_per_mm, bands, "gel.scattering_per_mm")[0];
  optics.anisotropy = device.gel.scattering_anisotropy;
  optics.plate_thickness_mm = device.plate.thickness_mm;
  optics.plate_index = device.plate.refractive_index;
  return optics;
}

double in_one_band(const DeviceSpec& device, const Colour& colour, const char* what) {
  return in_bands(colour, one_band(device), what)[0];
}

MembraneCamera::MembraneCamera(const DeviceSpec& device, const MembraneCameraSettings& settings)
    : optics_(membrane_optics(device)) {
  const SceneBands bands = one_band(device);
  radiance_ = in_bands(device.room_radiance, bands, "room_radiance")[0];
  if (!(radiance_ > 0.0)) fail_at(device.where, "room_radiance: the membrane is lit by the room, which is dark");
  if (device.room_radiance_behind) {
    behind_ = in_bands(*device.room_radiance_behind, bands, "room_radiance_behind")[0] / radiance_;
  }
  if (!(settings.cell_mm > 0.0)) fail("membrane camera: cell_mm is {}; it must be above 0", settings.cell_mm);
  render::Imager counter = sim::imager(device, bands, false);
  counter.exposure_s = 1.0;
  electrons_per_irradiance_ = render::response_of(counter).electrons_per_irradiance(0, 0);

  const auto& slab = std::get<SlabSpec>(device.gel.shape);
  const double x = slab.size_x_mm;
  const double y = slab.size_y_mm;
  const double cell = std::min({settings.cell_mm, x / 2, y / 2});
  // Square cells that end with the membrane along x, and beyond it by less than two along y.
  const int columns = even_cells(x, cell);
  const double side = x / columns;
  const int rows = even_cells(y, side);
  const render::FaceGrid grid{-x / 2, -0.5 * side * rows, side, columns, rows};
  render::MembraneWalkSettings walks;
  walks.walks = settings.walks;
  walks.seed = settings.seed;
  render::MembraneLightSettings light;
  light.behind = behind_;
  light.view_cell_mm = side;
  light.exchange_cell_mm = 2.0 * side;
  light_ = std::make_unique<const render::MembraneLight>(render::walk_membrane(optics_, walks),
                                                         camera_of(*device.camera), grid, light);
}

cv::Mat MembraneCamera::irradiance(const render::FaceState& state) const {
  return light_->irradiance(state) * radiance_;
}

cv::Mat MembraneCamera::photocurrent(const render::FaceState& state) const {
  return light_->irradiance(state) * (radiance_ * electrons_per_irradiance_);
}

render::FaceState MembraneCamera::free_face() const {
  render::FaceState state;
  state.contact = cv::Mat(grid().rows, grid().columns, CV_32FC1, cv::Scalar(0.0));
  return state;
}

render::FaceState face_state(const render::FaceGrid& grid, const fem::PixelGrid& from, const cv::Mat& coverage,
                             const cv::Mat& gap_mm, double no_body_mm, double albedo, double height_mm) {
  for (const cv::Mat* map : {&coverage, &gap_mm}) {
    if (map->type() != CV_32FC1 || map->cols != from.nx || map->rows != from.ny) {
      fail("face state: a map of {} x {} cells; its grid has {} x {} (32-bit floats, one channel)", map->cols,
           map->rows, from.nx, from.ny);
    }
  }
  render::FaceState state;
  state.albedo = albedo;
  state.height_mm = height_mm;
  constexpr float kNone = std::numeric_limits<float>::infinity();
  state.contact = cv::Mat(grid.rows, grid.columns, CV_32FC1, cv::Scalar(0.0));
  state.gap_mm = cv::Mat(grid.rows, grid.columns, CV_32FC1, cv::Scalar(kNone));
  // Limits of the other grid's cells that overlap an interval, and by how much of their width.
  const auto overlap = [](double low, double high, double first, double pitch, int cell) {
    const double begin = first + (cell - 0.5) * pitch;
    return std::max(0.0, std::min(high, begin + pitch) - std::max(low, begin));
  };
  const auto cell_of = [](double place, double first, double pitch) {
    return static_cast<int>(std::floor((place - first) / pitch + 0.5));
  };
  for (int row = 0; row < grid.rows; ++row) {
    const double y0 = grid.top_mm + row * grid.spacing_mm;
    const double y1 = y0 + grid.spacing_mm;
    const int j0 = std::max(0, cell_of(y0, from.first.y(), from.pitch));
    const int j1 = std::min(from.ny - 1, cell_of(y1, from.first.y(), from.pitch));
    const int j = cell_of(0.5 * (y0 + y1), from.first.y(), from.pitch);
    for (int column = 0; column < grid.columns; ++column) {
      const double x0 = grid.left_mm + column * grid.spacing_mm;
      const double x1 = x0 + grid.spacing_mm;
      const int i0 = std::max(0, cell_of(x0, from.first.x(), from.pitch));
      const int i1 = std::min(from.nx - 1, cell_of(x1, from.first.x(), from.pitch));
      double wet = 0.0;
      for (int b = j0; b <= j1; ++b) {
        const double high = overlap(y0, y1, from.first.y(), from.pitch, b);
        for (int a = i0; a <= i1; ++a) {
          wet += high * overlap(x0, x1, from.first.x(), from.pitch, a) * coverage.at<float>(b, a);
        }
      }
      const double share = wet / (grid.spacing_mm * grid.spacing_mm);
      state.contact.at<float>(row, column) = static_cast<float>(std::clamp(share, 0.0, 1.0));
      const int i = cell_of(0.5 * (x0 + x1), from.first.x(), from.pitch);
      if (i < 0 || j < 0 || i >= from.nx || j >= from.ny) continue;
      const float gap = gap_mm.at<float>(j, i);
      if (gap < no_body_mm) state.gap_mm.at<float>(row, column) = gap;
    }
  }
  return state;
}

}  // namespace touchstone::sim
