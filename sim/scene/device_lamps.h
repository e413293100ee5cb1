#pragma once
// The lamps of a device file, and what the renderer makes of them.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "render/scene/lamp.h"
#include "sim/files/colour.h"

namespace touchstone::sim {

/// `type` of a lamp in the file; strips, rings and arrays become several lamps.
enum class LampType { spot, led, led_strip, led_ring, led_array, area, projector, guide };
EnumNames<LampType> enum_names(LampType);

/// One entry of a device's `lamps`: a lamp, or LEDs in a row, ring or field. Only the fields that belong to `type` may
/// stand in the file; what they mean is described in render/scene/lamp.h and render/scene/lamp_arrays.h.
struct LampSpec {
  LampType type = LampType::spot;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< of rows and fields: `from_mm`, `corner_mm`
  std::optional<Eigen::Vector3d> target_mm;               ///< what it faces; a guide has `direction` in its place
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();   ///< guide: horizontal
  double lens_radius_mm = 1.0;                            ///< spot
  double half_angle_deg = 20.0;                           ///< spot; of a projector half its width
  double soft_angle_deg = 3.0;                            ///< spot
  double chip_radius_mm = 0.0;                            ///< LEDs
  double viewing_angle_deg = 120.0;                       ///< LEDs, area, guide: full angle at half power
  Eigen::Vector3d to_mm = Eigen::Vector3d::Zero();        ///< led_strip: its other end
  double ring_radius_mm = 0.0;                            ///< led_ring
  int count = 1;                                          ///< led_strip, led_ring
  Eigen::Vector3d side_a_mm = Eigen::Vector3d::UnitX();   ///< led_array: along its columns
  Eigen::Vector3d side_b_mm = Eigen::Vector3d::UnitY();   ///< led_array: along its rows
  Eigen::Vector2i grid = {1, 1};                          ///< led_array: columns, rows
  double power_spread = 0.0;                              ///< rows, rings and fields: of each LED's power, relative
  double tilt_spread_deg = 0.0;                           ///< of each LED's axis
  std::uint64_t seed = 0;                                 ///< of the spreads
  Eigen::Vector2d size_mm = {1.0, 1.0};                   ///< area: width along `along`, height
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();       ///< area
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();          ///< projector: where the picture's top is
  cv::Mat pattern;                                        ///< projector: grey, CV_8UC1
  double width_mm = 1.0;                                  ///< guide: of its exit face
  double tilt_deg = 0.0;                                  ///< guide: how steeply its light rises, in the plate
  bool visible = false;                                   ///< LEDs and area: has it a body that is seen?
  Colour power_W = 0.0;  ///< of each LED, lamp; in each band, or with a spectrum one number: all that it radiates
  std::optional<render::SpectralCurve> spectrum;  ///< relative, for a device that has `bands`
  SourceLocation where;
};

void fields(YamlReader& in, LampSpec& lamp);

/// What a lamp (of a row each LED) radiates in each band, W. @throws Error with file and line
render::Spectrum lamp_power(const LampSpec& lamp, const SceneBands& bands);

/// The renderer's lamps, at `level` of their power. @throws Error with file and line of one that can't be made
std::vector<render::Lamp> lamps_of(const LampSpec& lamp, const SceneBands& bands, double level);

}  // namespace touchstone::sim
