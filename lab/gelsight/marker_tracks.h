#pragma once
// Displacements of printed markers on disk, and what touches them, from frames on disk.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/sources/frame_source.h"
#include "lab/gelsight/touch_lines.h"
#include "sensors/markers/marker_tracker.h"

namespace touchstone::lab {

/// How tracks are made and written.
struct MarkerTrackSettings {
  /// A picture of the gel untouched; empty: the stream's own, or where it has none, each sequence's first frame.
  std::filesystem::path rest = {};
  bool overlay = false;      ///< a picture of each frame with its markers' arrows, too
  double arrow_scale = 1.0;  ///< of these (sensors/markers/marker_overlay.h)
  /// Shown each of these pictures, whether they are kept or not; may be empty.
  std::function<void(const cv::Mat& picture)> show = {};
  /// If there, contact, slip and what else is known of the gel (forces, heights) is read, too; without a background,
  /// which each sequence has of its own.
  std::optional<sensors::TouchCalibration> touch = {};
};

/// What came of one sequence.
struct MarkerTrack {
  std::string sequence;
  sensors::MarkerAppearance appearance = {};  ///< as learnt from its frame at rest
  int markers = 0;                            ///< seen at rest; 0: its frame at rest can't be used
  std::int64_t frames = 0;                    ///< read
  std::int64_t places = 0, trusted = 0;       ///< markers over all frames
  int jumped_at = -1;       ///< the first frame from which on markers may have each other's names; -1: none
  TouchCount touches = {};  ///< if touches are read
  std::vector<std::string> faults = {};  ///< of frames that are left out, naming them
};

/// Follows the markers of each sequence and writes FOLDER/markers.csv (docs/file-formats.md, "Recorded frames"), a line
/// for each marker of each frame; if asked for FOLDER/touch.csv, a line for each frame, and FOLDER/overlay/STEM.png, of
/// several sequences FOLDER/overlay/SEQUENCE/STEM.png. The folder is made if it isn't there. A frame that can't be read
/// or is of another size has one line that says so. So has a sequence whose frame at rest can't be used, unless it's
/// the only one. Tables are written as frames come, so that they take no memory.
/// @throws Error naming the picture if the frame at rest can't be used (of all sequences, if there are several), or if
///   no frame can be
std::vector<MarkerTrack> write_marker_tracks(const std::vector<datasets::FrameStream>& streams,
                                             const MarkerTrackSettings& settings, const std::filesystem::path& folder,
                                             const Progress& progress = {});

}  // namespace touchstone::lab
