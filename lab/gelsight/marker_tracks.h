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
  double arrow_scale = 1.0;   ///< of the pictures that are shown (sensors/markers/marker_overlay.h)
  double full_force_N = 5.0;  ///< likewise (sensors/markers/touch_overlay.h)
  /// Shown a picture of each frame with its markers' arrows and, if they are read, its touch; may be empty.
  std::function<void(const datasets::SourceFrame& frame, const cv::Mat& picture)> show = {};
  std::function<void()> begin_again = {};  ///< called if all frames come once more (see write_marker_tracks)
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
  int jumped_at = -1;             ///< the first frame from which on markers may have each other's names; -1: none
  int touched_at_rest_seen = -1;  ///< the first frame that showed that the gel was touched in the frame at rest
  int better_rest = -1;           ///< of these frames the one whose rows of markers are straightest
  int rest_frame = -1;            ///< that frame, where it was taken for rest; else -1
  TouchCount touches = {};        ///< if touches are read
  std::vector<std::string> faults = {};  ///< of frames that are left out, naming them
};

/// Follows the markers of each sequence and writes FOLDER/markers.csv (docs/file-formats.md, "Recorded frames"), a line
/// for each marker of each frame; if asked for FOLDER/touch.csv, a line for each frame. The folder is made if it isn't
/// there. If a later frame shows that a sequence's first one, taken for rest, was touched, all frames are gone through
/// once more, with the frame for rest whose rows of markers are straightest; not of live streams. A frame that can't be
/// read or is of another size has one line that says so. So has a sequence whose frame at rest can't be used, unless
/// it's the only one. Tables are written as frames come, so that they take no memory.
/// @throws Error naming the picture if the frame at rest can't be used (of all sequences, if there are several), or if
///   no frame can be
std::vector<MarkerTrack> write_marker_tracks(const std::vector<datasets::FrameStream>& streams,
                                             const MarkerTrackSettings& settings, const std::filesystem::path& folder,
                                             const Progress& progress = {});

}  // namespace touchstone::lab
