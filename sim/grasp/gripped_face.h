#pragma once
// What the membrane on a gripper's static finger feels and shows of a hexagonal piece that the dynamic finger presses
// on it [Naeini2020, sec. II, V.A].
//
// Gel frame: the piece lies along x on one of its flats, +z leads to the dynamic finger. That finger presses along its
// own normal, which leans by `tilt_deg` from z: the membrane bears N along -z and N tan(tilt) along +y. For the paper's
// hexagon and 15 degrees the finger touches the edge of the upper flat at +y, and from there its line of force goes
// through the lower flat 0.13 mm from its middle: nothing turns the piece, so its orientation is the grasp's and stays.
//
// The press is frictionless, step by step in N, linear elastic on both sides by the mortar coupling
// (fem/contact/press.h); the piece is held at its upper flat. Its elements are too wide to show a contact's rim, so
// each state is solved anew on the map's cells: an endless layer as soft to short waves as membrane and piece together
// answers the cells' pressure, and what it doesn't know (the piece's height and sides, the pad's ends) is taken from
// the press, as a smooth field: displacements there less the layer's to the same pressure, fitted by polynomials.
//
// How stiff the membrane is depends on how the flat's rims lie in the mesh: 0.0162 to 0.0188 mm/N with edges of 0.5 mm,
// where an endless layer of cells has 0.0172. A servo of 0.53 mm/N behind it doesn't notice.
//
// What friction adds is the shear's displacement: the piece sticks, and the membrane under it goes along by the mean of
// what tractions in proportion to the pressure do to it. So states depend on the load alone: closing and opening pass
// through the same ones. Left out: the flats beside the lower one (they rise by 60 degrees, the membrane bulges by less
// than a tenth of a millimetre), adhesion, and the piece's lean under shear but for the travel that it takes.

#include <Eigen/Core>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/transform.h"
#include "fem/elements/compliance.h"
#include "fem/fine_relief/layer_response.h"
#include "sim/scene/device.h"
#include "sim/scene/object.h"

namespace touchstone::sim {

/// How the piece lies on the membrane.
struct GrippedPose {
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();  ///< of its middle, gel frame
  double yaw_deg = 0.0;                                ///< about the membrane's normal
  double pitch_deg = 0.0;                              ///< above 0: its end at +x stands off
  double roll_deg = 0.0;                               ///< above 0: its long side at +y stands off
};

/// Which states are solved, on which cells, and how rough the faces are.
struct GrippedFaceSettings {
  double tilt_deg = 15.0;        ///< of the force to the membrane's normal (sec. V.A)
  double least_force_N = 0.01;   ///< normal force of the first state
  double largest_force_N = 6.0;  ///< of the last: the paper's 3.7 N and what a finger that rings adds
  double force_ratio = 1.45;     ///< from one state to the next
  double cell_mm = 0.2;          ///< of the maps
  double rms_slope = 0.08;       ///< of the roughness of membrane and piece together, see fem::real_contact_share
};

/// A load, and what belongs to it.
struct GripPoint {
  double normal_N = 0.0;        ///< on the membrane
  double shear_N = 0.0;         ///< on the membrane, along +y
  double force_N = 0.0;         ///< of the finger, along its normal
  double travel_mm = 0.0;       ///< of the finger along its normal since the touch; below 0: apart
  double approach_mm = 0.0;     ///< of the piece along -z since the touch
  double stiffness_N_mm = 0.0;  ///< slope of force_N over travel_mm; 0 apart
};

/// The membrane's outer face as it is seen, cell by cell of the grid: row j, column i is the cell about
/// grid.centre(i, j). All CV_32F.
struct FaceMap {
  cv::Mat coverage;  ///< share of the cell in real contact with the piece, 0 to 1
  cv::Mat gap_mm;    ///< of air between membrane and piece, where they don't touch; kNoPiece_mm or more: none over it
  cv::Mat pressure_MPa;  ///< mean of the cell; they sum up to the normal force
};

inline constexpr double kNoPiece_mm = 10.0;  ///< a gap that stands for none

/// One piece in one pose. Immutable; many threads may ask it.
class GrippedFace {
 public:
  /// `piece` is a hexagon; `elastic` its compliance (set_up_elastic_object, or fem::with_modulus of that), null for a
  /// rigid one. The gel is a slab; nothing that is given is kept.
  /// @throws Error for settings that make no sense, a piece that isn't a hexagon, isn't over the membrane, or that
  /// friction can't hold at this tilt; and as fem::Press::step
  GrippedFace(const DeviceSpec& device, const fem::Compliance& gel, const ObjectSpec& piece,
              const std::shared_ptr<const fem::Compliance>& elastic, const GrippedPose& pose,
              const GrippedFaceSettings& settings = {});

  const fem::PixelGrid& grid() const { return grid_; }
  /// The states that were solved, the first one at no load.
  const std::vector<GripPoint>& states() const { return states_; }
  /// @throws Error if that is beyond the last state
  GripPoint at_travel(double travel_mm) const;
  /// @throws Error likewise
  GripPoint at_normal_force(double normal_N) const;

  /// The face at a load. A pure function.
  FaceMap map(const GripPoint& point) const;

 private:
  /// A cell that the piece is over, as the unloaded pose has it.
  struct Cell {
    int place = 0;       ///< in the grid
    float under = 0.0F;  ///< share of it that lies under the flat
    int bears = 0;      ///< the index in `signed_` that it goes by: its own, or that of the nearest cell under the flat
    float rise = 0.0F;  ///< mm, of the piece over the flat's plane
  };
  void lay_out(const DeviceSpec& device, const ObjectSpec& piece, const RigidTransform& gel_from_piece,
               const Eigen::Vector2d& flat);
  std::size_t state_below(double normal_N) const;

  GrippedFaceSettings settings_;
  double cosine_, sine_;
  double contact_modulus_ = 1.0;
  double per_gap_ = 1.0;  ///< MPa/mm, makes a gap a negative pressure: `signed_`
  fem::PixelGrid grid_;
  std::vector<Cell> cells_;
  std::vector<int> bearing_;  ///< cells, places in the grid, at least half of which lies under the flat
  std::vector<GripPoint> states_;
  std::vector<std::vector<float>> signed_;  ///< per state and bearing cell: pressure (MPa) or -gap * per_gap_
  double gel_shear_ = 0.0;                  ///< mm along y that the membrane under the piece goes per N of shear
};

}  // namespace touchstone::sim
