#pragma once
// The frames of a chroma calibration on disk: pictures and a table that says how far which marker is displaced in each.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "core/error.h"
#include "datasets/sources/table_frames.h"
#include "sensors/colour/colour_marker_finder.h"
#include "sensors/colour/hue_calibration.h"

namespace touchstone::lab {

/// One line of the table.
struct AnnotatedMarker {
  std::filesystem::path file;
  std::size_t marker = 0;  ///< its number in the grid
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
  int series = 0;
  SourceLocation where;
};

/// Reads a CSV file with the header `file,marker_column,marker_row,x_mm,y_mm,z_mm,series`: how far a marker (columns
/// and rows count from 0) is displaced in a picture (gel frame: a press is -z), and which press or shear it belongs to.
/// Files are `frames`. @throws Error with file, line and field
std::vector<AnnotatedMarker> read_hue_sample_table(datasets::TableFrames& frames, const std::filesystem::path& csv,
                                                   const Eigen::Vector2i& grid);

/// What is left of the table once its pictures are read.
struct TableSamples {
  std::vector<sensors::HueSample> samples;
  std::vector<std::string> left_out;  ///< one line each: a marker that is flawed in its picture
};

/// Reads each picture once. `finder` has seen the picture at rest.
/// @throws Error with the table's line: a picture that can't be read, isn't a colour one of 8 bit, or has another size
///   than that at rest; a marker that isn't sound at rest
TableSamples read_hue_samples(datasets::TableFrames& frames, const std::vector<AnnotatedMarker>& table,
                              sensors::ColourMarkerFinder& finder);

}  // namespace touchstone::lab
