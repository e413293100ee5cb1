#pragma once
// What a device's model of light is missing against a real unit, learned from recorded presses: an empirical
// correction of its pictures, in a file beside the device. See docs/file-formats.md.

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/yaml_reader.h"

namespace touchstone::sim {

/// A sum of Gaussian bumps over what the membrane around a pixel looks like. A pixel is described by its slopes (rise
/// over run along the picture's u and v) and by how far it is pressed in, each smoothed with Gaussians of several
/// widths, and maybe by its place; each in units of the scales below. With p the description without the place, and
/// q the place, the correction is
///
///   sum over centres k of weight_k exp(-|q - q_k|^2 / 2) (exp(-|p - p_k|^2 / 2) - exp(-(|p|^2 + |p_k|^2) / 2)),
///
/// which is the mean of a Gaussian process that is known to be zero where nothing is pressed (p = 0)
/// [Rasmussen2006, eq. 2.19]. It is zero there exactly, and fades to zero away from what was seen.
struct ResidualMap {
  std::string about;                         ///< what it was learned from, for people
  int presses = 0;                           ///< that it was learned from
  double left_out_before_DN = 0.0;           ///< root mean square of what is missing in presses
  double left_out_after_DN = 0.0;            ///< and what is left of it if each is corrected by a map of the others
  int width_px = 0;                          ///< of the picture
  int height_px = 0;                         ///< of the picture
  double mm_per_px = 0.0;                    ///< on the gel
  std::vector<double> neighbourhoods_mm;     ///< standard deviations
  double slope_scale = 1.0;                  ///< tangent
  double height_scale_mm = 1.0;              ///< of how far a pixel is pressed in
  std::optional<double> place_scale_mm;      ///< absent: the place plays no part
  std::vector<std::vector<double>> centres;  ///< of each neighbourhood slope u, slope v, depth; then place u, v
  std::vector<Eigen::Vector3d> weights_DN;   ///< a centre each: red, green, blue, numbers of 255

  /// How many numbers describe a pixel.
  int features() const;
};

void fields(YamlReader& in, ResidualMap& map);

/// Reads and checks a file. @throws Error with file and line
ResidualMap read_residual_map(const std::filesystem::path& file);
/// The file's text.
std::string to_yaml(const ResidualMap& map);
/// One line for people: that it's an empirical correction, of what, and how good.
std::string in_words(const ResidualMap& map);

}  // namespace touchstone::sim
