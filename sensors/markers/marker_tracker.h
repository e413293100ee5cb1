#pragma once
// Follows a gel's markers from frame to frame by their nearest neighbours, and says how far each has moved since the
// frame at rest [Li2015, sec. 4.3].
//
// What the thesis leaves open, and what is done here:
// - A marker and a blob belong together if each is the other's nearest, and not farther than `longest_step` of a
//   spacing. So no two markers share a blob, and a step that could lead to the neighbour's place is no match: it's
//   reported.
// - A marker that isn't measured is held where its neighbours' mean displacement carries it, and looked for there.
// - Where the gel's middle jumps by about a whole spacing between two frames, markers take their neighbours' names
//   there. But the gel's rim stays, so between the two there's a place that jumps by half a spacing, where a blob waits
//   beyond the longest step (`kTooFar`). From such a frame on `jumped` is set, until every rest position has its blob
//   again: then the gel is at rest, and each marker is home.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "sensors/markers/marker_finder.h"

namespace touchstone::sensors {

/// What markers look like, how far they may go between frames, and how much their area may change.
struct MarkerTrackerSettings {
  MarkerAppearance appearance = {};
  double longest_step = 0.4;     ///< between two frames, as a part of the spacing; 0.05 to 0.5
  double max_area_change = 1.8;  ///< up or down, against the marker's own usual area; above 1
};

/// Was a marker measured in the frame, and if not, why not?
enum class MarkerStatus : std::uint8_t {
  kFound,
  kFoundAgain,  ///< wasn't measured in the frame before
  kHidden,      ///< there's no blob near, or so little of it that its middle isn't the marker's
  kMerged,      ///< its blob is too large: it holds another marker, or a shadow
  kAtBorder,    ///< cut by the picture's edge
  kTooFar,      ///< the nearest blob without a marker is more than the longest step away
};
/// Was the marker measured in this frame?
inline bool is_found(MarkerStatus status) {
  return status == MarkerStatus::kFound || status == MarkerStatus::kFoundAgain;
}
/// "found", "found again", "hidden", "merged", "at border", "too far"
const char* name_of(MarkerStatus status);

/// Markers of one frame, in the order in which the first frame showed them (by rows). All coordinates are finite px.
struct TrackedMarkers {
  std::int64_t t_us = 0;
  std::vector<Eigen::Vector2d> rest;       ///< in the first frame
  std::vector<Eigen::Vector2d> positions;  ///< measured where found, else held
  std::vector<MarkerStatus> status;
  std::vector<int> area_px;  ///< of each marker's blob; 0 where not found
  int unclaimed = 0;         ///< blobs that look like a whole marker and belong to none
  bool jumped = false;       ///< markers may have taken their neighbours' names (see above)
  FrameLight light = FrameLight::kNormal;

  int found() const;  ///< number of markers measured in this frame
  Eigen::Vector2d displacement(std::size_t marker) const { return positions[marker] - rest[marker]; }
};

/// Follows the markers of one camera. After the first frame nothing is allocated. One object is for one thread.
class MarkerTracker {
 public:
  /// The first frame must show so many whole markers.
  static constexpr int kLeastMarkers = 4;

  /// @throws Error naming the setting that is out of its range
  explicit MarkerTracker(const MarkerTrackerSettings& settings);

  /// Looks at the next frame; the first one is the gel at rest. The result is valid until the next call.
  /// A later frame without light (dark, saturated, flat) has no marker found, and all of them held.
  /// @throws Error as MarkerFinder::find; for a first frame without light, or with fewer markers than kLeastMarkers;
  /// for a time that isn't later than the last frame's. The tracker is then as it was before the call
  const TrackedMarkers& track(const Frame& frame);

  /// What the last call of track() returned; empty before the first.
  const TrackedMarkers& tracked() const { return result_; }

  /// Forgets all frames: the next one is the gel at rest.
  void restart() {
    result_ = TrackedMarkers();
    spacing_px_ = 0.0;
  }

  /// Median distance of a marker to its nearest neighbour at rest, px; 0 before the first frame.
  double spacing_px() const { return spacing_px_; }

 private:
  void begin(const std::vector<MarkerBlob>& blobs);
  void follow(const std::vector<MarkerBlob>& blobs);
  bool is_at_rest(const std::vector<MarkerBlob>& blobs);
  void predict();
  Eigen::Vector2d carried_by_neighbours(std::size_t marker) const;

  MarkerTrackerSettings settings_;
  MarkerFinder finder_;
  TrackedMarkers result_;
  double spacing_px_ = 0.0;
  std::vector<double> usual_area_;
  std::vector<int> neighbour_begin_;  ///< into neighbours_; one more than markers
  std::vector<int> neighbours_;       ///< at rest, within 1.6 spacings
  std::vector<Eigen::Vector2d> expected_;
  std::vector<int> nearest_blob_;
  std::vector<int> nearest_marker_;  ///< of each blob
  std::vector<std::uint8_t> claimed_;
};

}  // namespace touchstone::sensors
