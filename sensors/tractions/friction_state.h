#pragma once
// Stick and slip under an object, and its friction, from the tractions and motions of a gel's markers: what [Lin2019]
// asks for ("the local friction coefficient, the ratio between the lateral shear stress and the normal stress").
//
// What can be seen. Coulomb's coefficient shows only where something slips: |q| = mu p there, |q| < mu p elsewhere. Two
// things show slip, both in material coordinates (where the gel was at rest), in which a sticking contact can't move:
// - Of a part: as the object is dragged, markers that stick under it all move as one rigid body; those that slip lag
//   behind. Those that went furthest, a third of them, are taken for the object; a marker's lag is the part of their
//   motion, along it, that it doesn't take part in.
// - Of all: the markers stand still, and the contact itself moves over them. Its middle is the centre of pressure,
//   which the tractions give to a tenth of a marker spacing. It goes along the shear traction on the gel, and the ratio
//   of shear to normal force doesn't grow any more.
//
// What can't: while nothing moves, stick and slip look the same, so each marker keeps its last state; a marker whose
// square isn't wholly in contact, or whose motion is within the noise, stays unknown.

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "sensors/markers/marker_field.h"
#include "sensors/tractions/traction_inversion.h"

namespace touchstone::sensors {

/// Does the object stick at this marker?
enum class MarkerSlip : std::uint8_t { kNoContact, kUnknown, kStick, kSlip };
/// "no contact", "unknown", "stick", "slip"
const char* name_of(MarkerSlip state);

/// Does the object stick as a whole?
enum class ContactSlip : std::uint8_t {
  kNoContact,
  kUnknown,   ///< it hasn't been dragged far enough yet
  kSticking,  ///< or nothing that says otherwise
  kPartial,   ///< some of it slips
  kSliding,   ///< all of it
};
/// "no contact", "unknown", "sticking", "partial", "sliding"
const char* name_of(ContactSlip state);

/// Noise, how far back motion is sought, and what a verdict takes.
struct FrictionSettings {
  double lateral_noise_mm = 0.02;  ///< of a marker's displacement, as for the inversion; above 0
  int history_frames = 15;         ///< how far back motion is sought; 4 to 1000
  double least_motion_mm = 0.3;    ///< of the object over the frames compared; above 0
  double whole_contact = 0.7;      ///< share of a marker's square that must touch for a verdict; 0.3 to 1
  double lag = 0.25;               ///< of a marker that slips; above 0, below 1
  double saturation = 0.85;        ///< traction ratio of a marker that slips, parts of the friction; above 0, below 1
  double certainty = 0.5;          ///< standard errors that a verdict takes; 0 to 10
  double slide_mm = 0.4;           ///< that the contact must have moved over the markers to be sliding; above 0
};

/// One marker. Ratio and tractions are means over its square (MarkerTraction).
struct MarkerFriction {
  MarkerSlip state = MarkerSlip::kNoContact;
  double pressure = 0.0;      ///< MPa
  double shear = 0.0;         ///< |q|, MPa
  double ratio = 0.0;         ///< |q|/p: at most the friction; 0 without pressure
  double ratio_error = 0.0;   ///< standard error
  std::optional<double> lag;  ///< none: no motion to compare
};

/// Friction as it could be read, with its standard error.
struct FrictionEstimate {
  double value = 0.0;
  double error = 0.0;
  bool of_sliding = false;  ///< read while all slid; else off the slipping markers only
};

/// The answer for one frame.
struct FrictionState {
  ContactSlip state = ContactSlip::kNoContact;
  std::vector<MarkerFriction> markers;
  double ratio = 0.0;        ///< of the whole contact: shear force over normal force
  double ratio_error = 0.0;  ///< standard error
  /// Kept as long as the contact lasts. None: nothing has slipped yet, all that is known is that friction is above the
  /// largest ratio seen.
  std::optional<FrictionEstimate> friction;
  double motion_mm = 0.0;  ///< of the object, over the frames compared
  double slide_mm = 0.0;   ///< of the contact over the markers, within the history
};

/// Looks at frames in their order. One object is for one thread.
class FrictionObserver {
 public:
  /// @throws Error naming the setting that is out of its range
  explicit FrictionObserver(const FrictionSettings& settings = {});

  /// `tractions` is what TractionInversion made of `field`. Where nothing is in contact, all before is forgotten.
  /// @throws Error if the two don't belong to the same number of markers, or the number has changed
  const FrictionState& update(const MarkerField& field, const TractionField& tractions);

  /// Forgets all frames.
  void restart();

  const FrictionSettings& settings() const { return settings_; }

 private:
  struct Past {
    std::vector<Eigen::Vector2d> displacement;
    std::vector<std::uint8_t> measured;
    Eigen::Vector2d centre;  ///< of pressure, in material coordinates, mm
    double ratio = 0.0;      ///< of the whole contact
  };
  void read_ratios(const TractionField& tractions);
  void find_lags(const TractionField& tractions);
  void find_slide(const TractionField& tractions);
  void judge(const TractionField& tractions);
  void read_friction();

  FrictionSettings settings_;
  FrictionState result_;
  struct Slid {
    double ratio = 0.0, error = 0.0;
  };
  std::deque<Past> past_;  ///< the newest last
  std::deque<Slid> slid_;  ///< the last frames that slid
};

}  // namespace touchstone::sensors
