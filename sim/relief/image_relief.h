#pragma once
// A relief as a picture of its heights.

#include <Eigen/Core>
#include <filesystem>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// Heights from a grey picture: black is the floor, white stands `amplitude_um` high.
struct ImageRelief {
  static constexpr const char* kType = "image";
  static constexpr bool kSharp = false;
  double amplitude_um = 0.0;
  std::filesystem::path file;                         ///< PNG, TIFF, or EXR with floats from 0 to 1
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();  ///< of the whole picture, centred on the object's z axis
  bool repeat = false;                                ///< as a tile, without end
  SourceLocation where;
};

void fields(YamlReader& in, ImageRelief& relief);

/// @throws Error for an image that can't be read
fem::ReliefMap relief_map(const ImageRelief& relief);

/// Two pixels, mm. @throws Error for an image that can't be read
double finest_detail(const ImageRelief& relief);

}  // namespace touchstone::sim
