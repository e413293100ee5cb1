#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sensors/colour/hue_model.h"
#include "sensors/markers/marker_field.h"

namespace touchstone::sensors {

/// One marker's displacement.
struct HueEstimate {
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();  ///< gel frame: a press is -z
  bool measured = false;      ///< false: the marker is flawed, or the model doesn't apply
  bool extrapolated = false;  ///< it looks as nothing did in calibration
};

/// A whole grid's.
struct HueField {
  MarkerField field;
  std::vector<std::uint8_t> extrapolated;  ///< 0 or 1, for each marker; 0 where not measured
};

/// Estimates displacements from readings, by a model and the markers' appearance at rest. What one marker taught holds
/// for all: each has its own hue and place at rest, and its own gains if it has some.
class HueEstimator {
 public:
  /// @param rest of the sensor as it is now, not that of the calibration: mounted anew, it looks different
  /// @throws Error if the model is faulty (fault_of), or has gains for a marker that the grid hasn't; or as map_of_rest
  HueEstimator(const HueModel& model, const ColourMarkerReading& rest);

  /// All markers of a picture; flawed ones have no estimate. @throws Error if the reading's grid isn't that of the rest
  HueField estimate(const ColourMarkerReading& reading) const;
  /// @throws Error if the reading's grid isn't that of the rest
  HueEstimate estimate(std::size_t marker, const ColourMarker& seen) const;

  const PictureMap& map() const { return map_; }

 private:
  HueModel model_;
  ColourMarkerReading rest_;
  PictureMap map_;
  std::vector<Eigen::Vector2d> places_;
  std::vector<MarkerGain> gains_;  ///< of every marker
  Eigen::MatrixXi terms_;
};

}  // namespace touchstone::sensors
