#pragma once
// How exact the owner of a scene or a device wants what is simulated. See docs/file-formats.md.

#include <optional>

#include "core/yaml_reader.h"

namespace touchstone::sim {

/// What may be left out at most, in the units of who looks at it.
struct Accuracy {
  double force_percent = 1.0;  ///< of the force on the object
  double pixel_noise = 1.0;    ///< of the imager's temporal noise in a pixel
  double marker_px = 0.05;     ///< of where something is seen
  double height_um = 5.0;      ///< of the gel's surface
  double event_percent = 5.0;  ///< of the events that a change of light makes
};

/// A block `accuracy`: what isn't given there is taken from the device's, or is as above.
struct AccuracySpec {
  std::optional<double> force_percent;
  std::optional<double> pixel_noise;
  std::optional<double> marker_px;
  std::optional<double> height_um;
  std::optional<double> event_percent;
  SourceLocation where;
};

void fields(YamlReader& in, AccuracySpec& accuracy);

/// What `first` gives, and what `second` gives beside it. Nothing if neither is there.
std::optional<AccuracySpec> merged(const std::optional<AccuracySpec>& first, const std::optional<AccuracySpec>& second);

/// The same with the defaults. Nothing if neither is there.
std::optional<Accuracy> accuracy_of(const std::optional<AccuracySpec>& first,
                                    const std::optional<AccuracySpec>& second);

}  // namespace touchstone::sim
