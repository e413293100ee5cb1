#pragma once
// A gel's force model from frames on disk whose forces are known.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/sources/frame_source.h"
#include "sensors/markers/touch_forces.h"

namespace touchstone::lab {

/// The model, and of which frames it was made.
struct TouchForceCalibration {
  sensors::GelForceFit fit;
  int frames = 0;                        ///< read
  int samples = 0;                       ///< of them: something touches, and they can be trusted
  std::vector<std::string> faults = {};  ///< of frames that are left out, naming them
};

/// Reads the markers of each sequence, which is a series, from its frame at rest on, and fits the lines.
/// @param parts what else is known of the gel: heights, mm_per_px; lines aren't looked at
/// @param rest a picture of the gel untouched; empty: the stream's own, or where it has none, its first frame
/// @throws Error naming the frame whose force isn't known, or the picture at rest that can't be used; as fit_gel_forces
TouchForceCalibration calibrate_touch_forces(const std::vector<datasets::FrameStream>& streams,
                                             const sensors::TouchCalibration& parts, const std::filesystem::path& rest,
                                             const std::string& gel, const std::string& indenter,
                                             const Progress& progress = {});

}  // namespace touchstone::lab
