#pragma once
// What a picture of a lit sheet consists of, ray by ray: enough to draw the sheet again after it has moved a little.

#include <array>
#include <vector>

#include "render/cameras/camera.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// The points where a picture's rays meet a matt sheet with their light, before blur. Made by
/// DirectRenderer::sheet_points, moved by SheetBetween (sheet_between.h).
struct SheetPoints {
  ImageGrid grid;
  int bands = 0;
  /// Floats a point, row by row: material coordinates x, y (mm; Print::material_mm), slopes dz/dx, dz/dy of the sheet,
  /// then for each band the vector g and the number a of which the radiance of a white sheet with the unit normal n,
  /// which faces the camera, is n.g + a: of lamps with their shadows, and of the bounced light.
  std::vector<float> values;
  std::vector<float> places;      ///< 3 a point, mm
  std::vector<float> directions;  ///< 3 a point, of the ray
  std::vector<char> on_sheet;     ///< a point: 0 where the ray doesn't meet the sheet; `values` is then 0
  std::vector<float> others;      ///< [band][point]: the radiance of those; 0 elsewhere

  static constexpr int kGeometry = 4;  ///< floats before the bands
  static constexpr int kLight = 4;     ///< floats a band
  int stride() const { return kGeometry + kLight * bands; }
  std::size_t count() const { return static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows); }
};

}  // namespace touchstone::render
