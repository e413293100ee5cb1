#pragma once
// The fine relief that an object file may lay on its shape. See docs/file-formats.md.

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "core/yaml_reader.h"
#include "fem/relief_map.h"

namespace touchstone::sim {

enum class ReliefKind { waves, grid, hair, image };
EnumNames<ReliefKind> enum_names(ReliefKind);

/// Heights from 0 to `amplitude_um` over the shape's lower side, mapped along the object's z axis; the plain shape is
/// the floor. Only the fields that belong to `type` may stand in the file.
struct ReliefSpec {
  ReliefKind type = ReliefKind::waves;
  double amplitude_um = 0.0;   ///< trough to crest; a hair's diameter
  double pitch_mm = 0.0;       ///< waves (along x), grid (x and y): the period; hair: from one to
                               ///< the next, 0: a single one. Hairs lie along y, waves' crests too
  std::filesystem::path file;  ///< image: grey, black is the floor
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();  ///< image: of the whole picture, centred on the object's z axis
  bool repeat = false;                                ///< image: as a tile, without end
  SourceLocation where;
};

void fields(YamlReader& in, ReliefSpec& relief);

/// The finest detail, mm: the waves' period, the hair's diameter, two pixels of the image. Reads the image's size.
/// @throws Error for an image that can't be read
double finest_detail(const ReliefSpec& relief);

/// @throws Error for an image that can't be read
fem::ReliefMap relief_map(const ReliefSpec& relief);

}  // namespace touchstone::sim
