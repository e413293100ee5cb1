#pragma once
// Explore mode on pictures of any source: a fingertip's dots to presses and forces, and from known ones to a model.

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/sources/frame_source.h"
#include "sensors/reflex/explore_tracker.h"
#include "sensors/reflex/explore_training.h"

namespace touchstone::lab {

/// How the dots of pictures are followed.
struct DotPictureSettings {
  /// Pictures of the fingertip untouched, whose mean is taken; none: the stream's own, or where it has none, each
  /// sequence's first picture.
  std::vector<std::filesystem::path> rest = {};
  sensors::ExploreSettings tracker = {};
};

/// A model, and how it does.
struct ExploreCalibration {
  sensors::TrainedExplore made;
  std::int64_t pictures = 0;                            ///< learned from
  sensors::ExploreErrors fitted;                        ///< on these
  std::optional<sensors::ExploreErrors> left_out = {};  ///< on sequences left out in turn, of several
  std::vector<std::string> faults = {};                 ///< of pictures that are left out, naming them
};
/// Follows each sequence; pictures that aren't in the table are followed, but not learned from.
/// @throws Error naming table and line for a picture that isn't there; as sensors::train_explore; if no picture can be
/// used
ExploreCalibration calibrate_explore(const std::vector<datasets::FrameStream>& streams,
                                     const std::filesystem::path& presses, const DotPictureSettings& settings,
                                     int terms, const Progress& progress = {});

/// What came of all pictures.
struct ExploreSummary {
  std::int64_t pictures = 0, absolute = 0, relative = 0;
  double largest_N = 0.0;
  std::optional<double> rms_N = {};      ///< of the normal force, where it's known
  std::vector<std::string> faults = {};  ///< of pictures that are left out, naming them
};
/// Follows each sequence and writes `csv`, a line a picture (docs/file-formats.md, "Recorded frames").
/// @throws Error as sensors::ExploreTracker of a picture at rest, or if no picture can be used
ExploreSummary write_explore_forces(const sensors::ExploreModel& model,
                                    const std::vector<datasets::FrameStream>& streams,
                                    const DotPictureSettings& settings, const std::filesystem::path& csv,
                                    const Progress& progress = {});

}  // namespace touchstone::lab
