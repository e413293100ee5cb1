#pragma once
// The lookup table of [Li2015, sec. 2.2.2, step 0]: from a colour difference to the membrane's slope.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sensors/heights/lamp_model.h"

namespace touchstone::sensors {

/// A grid over colour differences (BGR, corrected for the place), each cell with the slope that it stands for. Colours
/// outside of the grid are taken to its nearest cell.
struct SlopeTable {
  std::array<int, 3> cells{};           ///< along B, G, R
  Eigen::Vector3f lowest;               ///< the centre of cell (0, 0, 0), digital numbers
  float step = 1.0F;                    ///< between centres, digital numbers
  std::vector<Eigen::Vector2f> slopes;  ///< R fastest, then G, then B
  std::vector<std::uint16_t> hits;      ///< calibration pixels that fell into each cell, at most 65535

  /// The number of the colour's cell in `slopes` and `hits`; the nearest cell for a colour outside of the grid.
  std::size_t index_of(const Eigen::Vector3f& colour) const;
  /// Whether calibration has hit the colour's cell or one of the 26 beside it.
  bool measured_near(const Eigen::Vector3f& colour) const;
};

/// How fine the table's grid is, and what fills cells without samples.
struct SlopeTableSettings {
  double finest_step_DN = 2.0;  ///< made larger until the grid has at most `most_cells`
  std::size_t most_cells = 1U << 20U;
  double prior_pixels = 4.0;  ///< as how many calibration pixels a cell's surroundings count
  double steepest = 4.0;      ///< no slope is longer: the limit of step 2 of the thesis
};

/// Each cell gets the lamps' slope for its colour (slope_by_lamps) plus the calibration's mean deviation from it: of
/// its own pixels, blended with that of coarser and coarser cells around it, `prior_pixels` strong. So well measured
/// cells hold their own mean, gaps are bridged smoothly, and far from all measurements matt shading holds. The colour
/// of rest has slope zero. @pre `samples` isn't empty; `lamps` is the matrix that the corrected colours belong to
SlopeTable build_slope_table(std::span<const ColourSample> samples, const Eigen::Matrix3d& lamps,
                             const SlopeTableSettings& settings);

/// How much of its table a calibration has measured.
struct TableCoverage {
  std::size_t cells = 0;
  std::size_t cells_hit = 0;
  double steepest_slope = 0.0;  ///< of the calibration: 99 % of its pixels are less steep
};
/// How much of the table these samples reach.
TableCoverage coverage_of(const SlopeTable& table, std::span<const ColourSample> samples);

}  // namespace touchstone::sensors
