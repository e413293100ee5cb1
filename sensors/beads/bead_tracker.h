#pragma once
// Follows a grid of beads from frame to frame: the marker tracker of the high-speed visio-haptic sensor
// [VisioHaptic2024, sec. 3.2, steps i to ix].
//
// What the paper leaves open, and what is done here:
// - Only the windows round the beads need the scaled grey values of step ii, so only they are scaled; the mean over
//   ROI-A that gives the factor is the true one. ROI-A and the windows may reach over the image's border: they are cut.
// - Step iv subtracts the window's mean from each grey value. Taken with the sign that makes beads positive, and
//   clipped to 0..255 as 8-bit images are, this leaves bead pixels bright and most of the background at 0, for dark
//   and for bright beads alike.
// - Step vii takes the centroid of all highlighted pixels. Where several connected regions are left, this tracker takes
//   the one whose centroid is nearest to the bead's last position, among those that look like a bead (BeadAppearance).
//   Otsu's method is then applied again to the highlighted class alone: where a bead touches something half as dark,
//   this core lies elsewhere than the whole region, and its centroid is taken. Where what touches it is nearly as dark,
//   so that neither looks like a bead alone, the window's darkest pixels are taken (a fifth of the bead's usual area).
// - A region that touches the window's border is cut by it: the window is moved onto it, and it is measured again.
// - A window in which nothing looks like a bead gives no measurement, where Otsu's method alone would invent one. Then
//   the whole cell is searched, coarsely; if there's no bead either, the bead is `hidden` for
//   `max_hidden_frames`, then it is reset to its cell's centre. It is searched in each frame until it's found again.
// - A measurement that doesn't go along with the neighbouring beads is looked for again where they have the bead
//   (BeadConsistency). What isn't there either is hidden; a hidden bead's position goes along with its neighbours.
//   After `max_hidden_frames` anything in its cell that looks like a bead is taken again.
// - All beads may jump by more than half a cell between two frames, so that each cell holds a neighbour's bead and one
//   side none: then they are looked for where the jump would have brought all of them.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/frame.h"
#include "sensors/image/frame_light.h"

namespace touchstone::sensors {

/// Whether beads are darker or brighter than what is behind them.
enum class BeadPolarity : std::uint8_t { kDark, kBright };

/// How a bead's centroid is taken from its pixels.
enum class CentroidKind : std::uint8_t {
  kBinary,    ///< each bead pixel counts the same (the paper, step vii)
  kWeighted,  ///< pixels at the rim count by how much of them the bead covers, judged by their grey value
};

/// What a region must be like to be taken for a bead.
struct BeadAppearance {
  BeadPolarity polarity = BeadPolarity::kDark;
  double min_area_px = 12.0;
  double max_area_fraction = 0.6;  ///< of the window ROI-B
  /// Least difference between the mean grey values of region and background, after brightness is scaled (0..255).
  double min_difference = 15.0;
  /// Largest ratio of the region's principal second moments; 1 is a disc, half a disc has 3.6.
  double max_elongation = 4.0;
  /// Largest ratio, of either to the other, between the region's area and the bead's own area in the frames before.
  double max_area_change = 2.0;
  /// A bead's core: what Otsu's method highlights among the bead's own pixels. Its least part of the usual area (also
  /// that of the darkest pixels, where there is no such core; 1 = no cores), its largest elongation, and how far its
  /// centroid may lie from the bead's before the core's is taken instead.
  double least_core = 0.2;
  double core_elongation = 2.0;
  double core_shift_px = 0.8;
};

/// The filter of sec. 3.2.2: position and velocity, for each bead and axis; the acceleration is white noise.
struct BeadFilterSettings {
  double measurement_px = 0.05;  ///< standard deviation of a measured coordinate
  /// Standard deviation of the acceleration, held over one frame interval, in px/s^2. The default smooths at 600
  /// frames/s, passes a 100 Hz vibration, and leaves frames at 30 frames/s nearly as measured.
  double acceleration_px_per_s2 = 2e4;
  double first_velocity_px_per_s = 500.0;  ///< standard deviation of the velocity before the second frame
};

/// Beads move as the gel does that holds them: smoothly, so a bead goes nearly where its neighbours go. What looks like
/// a bead and doesn't is something else, say a black speck on what touches the gel.
struct BeadConsistency {
  bool on = true;
  /// How far a bead's motion since the frame before may differ from the median of its (up to eight) neighbours'
  /// motions, in sides of a cell. In rendered load cycles at 30 frames/s it was 0.08 at most.
  double lone_motion = 0.125;
  /// Likewise of motions since the first frame, if something that looks like a bead lies within `lone_motion` of where
  /// the neighbours have it: the bead, while something else is followed. In rendered load cycles it was 0.21 at most.
  double lone_displacement = 0.25;
  /// How far a bead may lie from where a regular grid has it in the first frame, in sides of a cell, if something that
  /// looks like a bead lies within `lone_motion` of there.
  double first_offset = 0.2;
};

/// All that the tracker can be set to; the defaults are those of the published sensor where the paper gives them.
struct BeadTrackerSettings {
  int grid = 3;                    ///< N: beads a side; 2 to 32
  int roi_a_px = 220;              ///< side of ROI-A, which is split into N x N cells
  int roi_b_px = 30;               ///< side of the window round one bead; 6 to 64, and no larger than a cell
  double mean_brightness = 150.0;  ///< to which ROI-A's mean grey value is scaled
  double contrast = 2.0;           ///< factor of step iv
  int morphology_px = 3;           ///< side of the square element of step vi, odd; 1 = no opening and closing
  BeadAppearance appearance = {};
  BeadConsistency consistency = {};
  CentroidKind centroid = CentroidKind::kBinary;
  int max_hidden_frames = 10;
  BeadFilterSettings filter = {};
  /// Centre of ROI-A in the first frame, in px; the image's centre if not given.
  std::optional<Eigen::Vector2d> first_centre_px = std::nullopt;
};

/// Where a bead's position in a frame comes from.
enum class BeadStatus : std::uint8_t {
  kFound,       ///< measured in the window round its last position
  kFoundAgain,  ///< measured after a search of its whole cell
  kHidden,      ///< nothing in its cell looks and moves like it; the position goes where its neighbours go
  kReset,       ///< left its cell, or was hidden for too long; the position is its cell's centre
};
/// Whether the bead was measured in this frame.
inline bool is_found(BeadStatus status) {
  return status == BeadStatus::kFound || status == BeadStatus::kFoundAgain;
}

/// What was found in one frame. Beads are in row-major order of the grid: left to right, then top to bottom.
/// Coordinates are px in the convention of core/transform.h (a pixel's centre is at + 0.5), always finite.
struct TrackedBeads {
  std::int64_t t_us = 0;
  std::vector<Eigen::Vector2d> positions;  ///< filtered (step ix); the tracker's result
  std::vector<Eigen::Vector2d> measured;   ///< centroids before the filter; equal to `positions` where not found
  std::vector<double> area_px;             ///< of each bead's region; 0 where not found
  std::vector<BeadStatus> status;
  FrameLight light = FrameLight::kNormal;  ///< judged on ROI-A
  double mean_grey = 0.0;                  ///< of ROI-A, in the frame's own digital numbers

  int found() const;  ///< number of beads measured in this frame
};

/// The text for a status: "found", "found again", "hidden", "reset".
const char* name_of(BeadStatus status);

/// Follows the beads of one camera. After the first frame nothing is allocated. One object is for one thread.
class BeadTracker {
 public:
  /// @throws Error naming the setting that is out of its range
  explicit BeadTracker(const BeadTrackerSettings& settings);
  ~BeadTracker();
  BeadTracker(BeadTracker&&) noexcept;
  BeadTracker& operator=(BeadTracker&&) noexcept;

  /// Looks at the next frame: 8 or 16 bit, grey or BGR. The result is valid until the next call.
  /// @throws Error for an empty image, another type, a size or type unlike the first frame's, an image smaller than
  ///   a window, or a time that isn't later than the frame's before. The tracker is then as it was before the call.
  const TrackedBeads& track(const Frame& frame);

  /// Forgets all frames: the next one is the first.
  void restart();

  /// As they were given.
  const BeadTrackerSettings& settings() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace touchstone::sensors
