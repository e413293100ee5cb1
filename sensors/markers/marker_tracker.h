#pragma once
// Follows a gel's markers from frame to frame by their nearest neighbours, and says how far each has moved since the
// frame at rest [Li2015, sec. 4.3].
//
// What the thesis leaves open, and what is done here:
// - A marker and a blob belong together if each is the other's nearest, and not farther than `longest_step` of the
//   distance to the marker's neighbour. So no two markers share a blob, and a step that could lead to the neighbour's
//   place is no match: it's reported.
// - Markers are expected where they were, or as far on as their last step took them, whichever the blobs of all of them
//   fit better: a gel that is dragged at half a spacing a frame is followed, and so is one of which a frame was
//   dropped.
// - A marker that isn't measured is held where its neighbours' mean displacement carries it, and looked for there.
// - A gel is continuous: a marker that has left its neighbours by more than `kStray` of the way to them has another
//   marker's blob, or a speck of something. It's reported and held.
// - Where the gel's middle jumps by about a whole spacing between two frames, markers take their neighbours' names
//   there. But the gel's rim stays, so between the two there's a place that jumps by half a spacing, where a blob waits
//   beyond the longest step (`kTooFar`). From such a frame on `jumped` is set, until every rest position has its blob
//   again: then the gel is at rest, and each marker is home. Where no rim is in view and markers stand in a lattice, a
//   jump of a whole spacing looks like none.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/frame.h"
#include "sensors/markers/marker_finder.h"
#include "sensors/markers/marker_learning.h"
#include "sensors/markers/rest_doubt.h"

namespace touchstone::sensors {

/// What markers look like, how far they may go between frames, and how much their area may change.
struct MarkerTrackerSettings {
  std::optional<MarkerAppearance> appearance = {};  ///< none: it's learnt from the frame at rest
  /// How far from where it is expected a marker may be found, as a part of the distance to its nearest neighbour at
  /// rest (of which no more counts than 1.5 median ones); 0.05 to 0.5
  double longest_step = 0.4;
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
  kStray,       ///< its blob has left the neighbours' by far: it's another's, or no marker
};
/// Was the marker measured in this frame?
inline bool is_found(MarkerStatus status) {
  return status == MarkerStatus::kFound || status == MarkerStatus::kFoundAgain;
}
/// "found", "found again", "hidden", "merged", "at border", "too far", "stray"
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
  RestDoubt rest_doubt = {};      ///< what this frame says of the first one
  bool rest_was_touched = false;  ///< this frame or one before has shown it: displacements are from no rest

  int found() const;  ///< number of markers measured in this frame
  /// Whether the marker was measured in this frame, and its name is sure.
  bool trusted(std::size_t marker) const { return is_found(status[marker]) && !jumped; }
  Eigen::Vector2d displacement(std::size_t marker) const { return positions[marker] - rest[marker]; }
};

/// Follows the markers of one camera. After the first frame nothing is allocated. One object is for one thread.
class MarkerTracker {
 public:
  /// @throws Error naming the setting that is out of its range
  explicit MarkerTracker(const MarkerTrackerSettings& settings);

  /// Looks at the next frame; the first one is the gel at rest. The result is valid until the next call.
  /// A later frame without light (dark, saturated, flat) has no marker found, and all of them held.
  /// @throws Error as MarkerFinder::find; for a first frame without light, in which none stand out, or with fewer whole
  /// markers than kLeastMarkers; for a time that isn't later than the last frame's. The tracker is then as it was
  /// before the call
  const TrackedMarkers& track(const Frame& frame);

  /// What the last call of track() returned; empty before the first.
  const TrackedMarkers& tracked() const { return result_; }

  /// Forgets all frames: the next one is the gel at rest.
  void restart() {
    result_ = TrackedMarkers();
    spacing_px_ = 0.0;
    finder_.reset();
  }

  /// Median distance of a marker to its nearest neighbour at rest, px; 0 before the first frame.
  double spacing_px() const { return spacing_px_; }

  /// What markers look like: as given, or as learnt from the first frame; none before that.
  std::optional<MarkerAppearance> appearance() const {
    return finder_ ? std::optional(finder_->appearance()) : settings_.appearance;
  }

 private:
  void begin(const std::vector<MarkerBlob>& blobs);
  void follow(const std::vector<MarkerBlob>& blobs, std::int64_t t_us);
  bool is_at_rest(const std::vector<MarkerBlob>& blobs);
  void predict(const std::vector<MarkerBlob>& blobs, std::int64_t t_us);
  double misfit(const std::vector<MarkerBlob>& blobs, double steps) const;
  void match(const std::vector<MarkerBlob>& blobs);
  void reject_strays();
  void note_steps(std::int64_t t_us);
  Eigen::Vector2d carried_by_neighbours(std::size_t marker) const;
  void doubt_rest();

  MarkerTrackerSettings settings_;
  std::optional<MarkerFinder> finder_;
  TrackedMarkers result_;
  double spacing_px_ = 0.0;
  std::vector<double> usual_area_;
  std::vector<double> distance_px_;       ///< to each marker's nearest neighbour at rest, at most 1.5 spacings
  std::vector<int> neighbour_begin_;      ///< into neighbours_; one more than markers
  std::vector<int> neighbours_;           ///< at rest, within 1.6 spacings, and at least the nearest three
  std::vector<Eigen::Vector2d> before_;   ///< positions in the last frame with light
  std::vector<Eigen::Vector2d> step_;     ///< from the one before that
  double seen_us_ = 0.0, step_us_ = 0.0;  ///< when the last frame with light was, and how long the step took
  std::vector<int> strays_;
  std::vector<Eigen::Vector2d> expected_;
  std::vector<int> nearest_blob_;
  std::vector<int> nearest_marker_;  ///< of each blob
  std::vector<std::uint8_t> claimed_;
  std::vector<std::uint8_t> found_;
  std::vector<MarkerTriple> triples_;  ///< at rest
};

}  // namespace touchstone::sensors
