#pragma once
// Force over depth of lumps under a skin, pressed by a flat face: the vhs sensor's gel, or a rigid plate of the force
// sensor of [VisioHaptic2024]. Finite elements on both sides where both give way, computed at some moduli; what lies
// between is interpolated.
//
// Lengths alone fix the law of a rigid plate on a piece of moduli (E_skin, E_core) but for a factor: F = E_skin
// f(E_core / E_skin, depth). The gel's adds one modulus, so its table has a few skins besides.

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "lab/vhs/palpation_spec.h"
#include "sim/scene/device.h"

namespace touchstone::lab {

/// What presses on the lump.
enum class PalpationFace {
  rigid,  ///< a plate, as stiff as sim::set_up_plate's
  gel     ///< the vhs sensor's
};

/// A press of one piece: all at `depth_step_mm` from 0 on, straight between: the steps are fine.
struct PalpationLaw {
  double depth_step_mm = 0.0;
  std::vector<double> force_N;           ///< elastic, of the moduli as they are at once
  std::vector<double> radius_mm;         ///< of a circle as large as the contact
  std::vector<Eigen::VectorXd> bead_px;  ///< of the gel: x and y of each bead's image less that at rest
  double skin_share = 0.0;               ///< d ln F / d ln E_skin at half the depth: how much of a small
  double core_share = 0.0;               ///< relaxation of the part shows in the force
  double deepest_mm() const { return depth_step_mm * static_cast<double>(force_N.size() - 1); }
  /// @pre 0 <= depth <= deepest_mm()
  double force(double depth) const;
  double stiffness(double depth) const;  ///< N/mm
  /// mm, at which the force is this one; the deepest for more. @pre the forces rise
  double depth(double force) const;
  double radius(double depth) const;  ///< mm
  /// px, as `bead_px`, at this depth (mm).
  Eigen::VectorXd beads(double depth) const;

 private:
  double at(const std::vector<double>& values, double depth) const;
};

/// At which depths and moduli the law is computed.
struct PalpationTableSettings {
  double deepest_mm = 2.2;
  int depths = 11;          ///< at which is pressed
  double ratio_step = 0.7;  ///< between ratios of moduli, in the logarithm (see ratio_place)
  double skin_step = 0.16;  ///< of ln E_skin, between the two skins either side of the middle one's
  double friction = 0.5;
  double lump_mesh_mm = 0.0;  ///< 0: the lump's own
};

/// The laws of all pieces of a spec on one face.
class PalpationTable {
 public:
  /// Presses what is needed. `device` and its compliance `gel` matter for PalpationFace::gel alone.
  /// @throws Error as the presses do
  PalpationTable(const PalpationSpec& spec, PalpationFace face, const sim::DeviceSpec& device,
                 const fem::Compliance& gel, const PalpationTableSettings& settings, const std::filesystem::path& cache,
                 const Progress& progress = {});

  /// @throws Error for moduli beyond those of the spec's pieces and six times their spread
  PalpationLaw law(double skin_MPa, double core_MPa) const;

  /// Largest strain measure of the gel (fem::PressState::largest_strain) in any press up to the stop force; of a plate
  /// its own, next to nothing. The lumps' isn't known.
  double largest_strain() const { return strain_; }
  int presses() const { return presses_; }

 private:
  struct Node {
    Eigen::VectorXd log_force;  ///< ln(F / (E_unit depth^1.5)) at the fine depths, from the first on
    Eigen::VectorXd area;       ///< mm^2
    Eigen::MatrixXd beads;      ///< fine depths x 2 beads, px
  };
  const Node& node(std::size_t ratio, std::size_t skin) const { return nodes_[skin * ratios_.size() + ratio]; }

  double step_ = 0.0;
  std::vector<double> ratios_;     ///< places, see ratio_place
  std::vector<double> log_skins_;  ///< one for a rigid face
  std::vector<Node> nodes_;
  double strain_ = 0.0;
  int presses_ = 0;
};

/// ln r for cores that matter, and no more than ln 100 however hard the core is: evenly spaced, places tell pieces
/// apart evenly.
double ratio_place(double core_over_skin);

/// Where the camera sees the gel's beads, px: each centre's refracted ray through the hole's middle, x and y in turn.
/// @throws Error for a camera that isn't a pinhole
Eigen::VectorXd bead_pixels(const sim::DeviceSpec& device, const Eigen::MatrixX3d& displacement);

}  // namespace touchstone::lab
