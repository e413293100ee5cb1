#pragma once
// Slip that begins at the contact's rim, before the object slides: a second detector beside the thesis's two ratios
// (slip_rule.h), which look at what has gone already. The idea is that of [Yuan2015]: under a small shear load the
// contact moves as one, under a large one the field of markers becomes inhomogeneous. The measure is our own:
//
// Over the last few frames, in which the contact's middle moved by `least_motion_px` or more, the markers on the
// contact patch moved by u(x). That is taken apart by least squares into
//   u = t + w J x + s x - (|z|^2 l - 2/7 z (z.l)),
// a translation t (of the middle), a turn w, a swelling s (pressing spreads the gel), and a lag l that grows with the
// squared distance from the middle; z is x in units of the edge (of the part of the patch that is looked at). While all
// sticks the field moves with the object and l is small; where a rim slips, it stays behind: l.t/|t|^2 grows to some 1
// as the stick zone shrinks. The second part of the lag is what an incompressible gel does under a round contact that
// slips [Johnson1985, eq. 3.91]: its surface lags less along the motion than across it.
//
// Once the whole contact slides, the markers stand still and there's no lag to be seen. Then the patch itself moves
// over the markers (`sliding`), in the direction in which they are sheared: by `slide_px` within the frames kept, while
// they go less than half as far, and the gel is sheared by `least_shear_px` or more. Without that shear a ball that
// rolls in would look the same.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "sensors/markers/contact_patch.h"
#include "sensors/markers/marker_tracker.h"

namespace touchstone::sensors {

/// Which motion is compared, and from which lag on it is slip.
struct IncipientSlipSettings {
  int history_frames = 15;       ///< how far back motion is sought (0.5 s at 30 frames/s); 2 to 1000
  double least_motion_px = 0.7;  ///< of the middle; below, noise of the centroids is too large a part of it. Above 0
  /// Markers within this part of the patch's size have a say. A mask of pixels that differ from the background is
  /// larger than the contact, since the gel slopes down beside it: under balls 1.15 to 1.35 times. So the outermost of
  /// these markers lie just beside the contact, where most of the lag is. 0.2 to 1
  double patch_part = 0.9;
  int least_markers = 6;        ///< on the patch, measured now and then; at least 6
  double lag_threshold = 0.55;  ///< 0 to 2
  double certainty = 2.0;       ///< the lag less so many of its standard errors must pass the threshold; 0 to 10
  double slide_px = 3.0;        ///< above 0
  double least_shear_px = 2.0;  ///< mean displacement of the patch's markers since rest; at least 0
};

/// What the markers say about slip.
enum class SlipState : std::uint8_t {
  kNoContact,
  kSticking,   ///< or nothing that says otherwise
  kIncipient,  ///< the rim lags behind
  kSliding,    ///< the patch moves over the markers
};
/// "no contact", "sticking", "incipient", "sliding"
const char* name_of(SlipState state);

/// The detector's answer for one frame, with the figures behind it.
struct IncipientSlip {
  SlipState state = SlipState::kNoContact;
  std::optional<double> lag;  ///< none: too little motion, or too few markers
  double lag_error = 0.0;     ///< standard error, from what the fit leaves over
  double motion_px = 0.0;     ///< of the middle, over the frames compared
  int frames = 0;             ///< how many back the compared frame lies
  int markers = 0;            ///< that the fit went through
  double slide_px = 0.0;      ///< how far the patch moved over the markers within the frames kept
  double shear_px = 0.0;      ///< mean displacement since rest

  /// At the rim, or of the whole contact.
  bool slips() const { return state == SlipState::kIncipient || state == SlipState::kSliding; }
};

/// Looks at frames of one tracker, in their order. After the first nothing is allocated. One object is for one thread.
class IncipientSlipDetector {
 public:
  /// @throws Error naming the setting that is out of its range
  explicit IncipientSlipDetector(const IncipientSlipSettings& settings = {});

  /// `patch`: where the gel is touched in this frame; none: nothing touches, and the frames before are forgotten. They
  /// are forgotten, too, if the tracker says that it may have mixed up markers, or if it has another number of them.
  const IncipientSlip& update(const TrackedMarkers& markers, const std::optional<ContactPatch>& patch);

  /// Forgets all frames, as when the tracker is restarted.
  void restart() { kept_ = 0; }

  const IncipientSlipSettings& settings() const { return settings_; }

 private:
  struct Past {
    std::vector<Eigen::Vector2d> displacement;
    std::vector<std::uint8_t> found;
    Eigen::Vector2d patch_centre;
  };
  const Past& back(int frames) const;
  bool fit_lag(const TrackedMarkers& markers, const ContactPatch& patch, const Past& past);
  void find_lag(const TrackedMarkers& markers, const ContactPatch& patch);
  void find_slide(const TrackedMarkers& markers, const ContactPatch& patch);
  void remember(const TrackedMarkers& markers, const ContactPatch& patch);

  IncipientSlipSettings settings_;
  IncipientSlip result_;
  std::vector<Past> past_;  ///< a ring
  int newest_ = 0;
  int kept_ = 0;
};

}  // namespace touchstone::sensors
