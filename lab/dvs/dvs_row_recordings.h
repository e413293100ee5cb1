#pragma once
// The recordings that the rows of force and of material share.

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "lab/dvs/dvs_recordings.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {

/// Kinds of event pixels that the rows ask for.
struct DvsPixelKind {
  const char* id;
  const char* title;
  double noise;       ///< of the device's leak and shot noise
  double thresholds;  ///< of the device's
};
/// In the order of DvsRecording::by_pixels.
inline constexpr std::array<DvsPixelKind, 6> kDvsPixelKinds = {{{"device", "as the device has them", 1.0, 1.0},
                                                                {"noise_0", "without noise", 0.0, 1.0},
                                                                {"noise_10", "with ten times the noise", 10.0, 1.0},
                                                                {"threshold_067", "thresholds of 2/3", 1.0, 2.0 / 3.0},
                                                                {"threshold_150", "thresholds of 3/2", 1.0, 1.5},
                                                                {"threshold_200", "thresholds of twice", 1.0, 2.0}}};

/// Shared by both groups of rows, so that it's made once.
using DvsRecordings = std::shared_ptr<const std::vector<DvsRecording>>;

/// The 48 grasps of [Naeini2020], seen by all kinds; the quick form: four of each material, seen by the first. The
/// camera watches for 0.2 s before the servo moves. Made once, kept as long as the program runs. @throws Error as its
/// parts
DvsRecordings dvs_row_recordings(const ValidateOptions& options);

/// The same 48, but more alike, seen by the first kind. `name` distinguishes the spreads.
DvsRecordings dvs_alike_recordings(const ValidateOptions& options, const std::string& name, const DvsSpread& spread);

}  // namespace touchstone::lab
