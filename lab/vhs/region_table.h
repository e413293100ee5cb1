#pragma once
// Rectangles in pictures, on disk: patches of known colour, and regions whose colour is asked for.

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/error.h"
#include "datasets/sources/table_frames.h"

namespace touchstone::lab {

/// A rectangle of known colour in a picture.
struct KnownPatch {
  std::filesystem::path file;
  cv::Rect place;
  Eigen::Vector3d lab;  ///< CIE L*a*b*, D65
  SourceLocation where;
};

/// Reads a CSV with the header `file,left_px,top_px,width_px,height_px,L,a,b` (CIE L*a*b* under D65) or
/// `file,left_px,top_px,width_px,height_px,red,green,blue` (sRGB, 0 to 255). Files are `frames`.
/// @throws Error with file, line and field
std::vector<KnownPatch> read_patch_table(datasets::TableFrames& frames, const std::filesystem::path& csv);

/// A part of each picture, with a name.
struct NamedRegion {
  std::string name;
  cv::Mat mask;  ///< CV_8UC1
};
/// Of a CSV with the header `region,left_px,top_px,width_px,height_px`. @throws Error with file, line and field
std::vector<NamedRegion> read_region_table(const std::filesystem::path& csv, const cv::Size& size);

}  // namespace touchstone::lab
