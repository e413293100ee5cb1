#pragma once
// Bodies of many kinds at lucky and unlucky places: what the contact is tried by.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fem/elements/compliance.h"
#include "fem/shapes/contact_shape.h"
#include "sim/scene/device.h"

namespace touchstone::lab {

/// A straight side of a body: a line in the plane of its lowest face, object frame.
struct BodySide {
  Eigen::Vector2d point = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();
};

/// A body, made by code.
struct TrialBody {
  std::string family;  ///< one of body_families()
  std::string words;   ///< its sizes, for who wants to make it again
  fem::ContactShape shape;
  double width_mm = 0.0;         ///< the narrowest measure of what touches, or may come to touch
  double reach_mm = 0.0;         ///< from its axis to the farthest of what touches
  std::optional<BodySide> side;  ///< if it has a straight one
  /// Of a pattern on a plate: how far it stands out, and the same pattern under a plate that is farther away, which
  /// presses the same gel in the same way as long as neither plate touches.
  double height_mm = 0.0;
  std::optional<fem::ContactShape> lifted = {};
};

/// Families, in the order in which the draws go through them.
const std::vector<std::string>& body_families();

/// Where a body is put.
enum class BodyPlace {
  anywhere,
  on_node,    ///< its axis on a node of the mesh
  on_edge,    ///< its axis on the middle of an edge
  on_axis,    ///< its axis on the gel's axis of symmetry
  along_edge  ///< a side of it over an edge of the mesh; its axis on a node if it has no straight side
};
std::string name_of(BodyPlace place);  ///< as it is declared, with spaces

/// One body pressed on one gel.
struct BodyTrial {
  std::uint64_t seed = 0;
  int index = 0;
  TrialBody body;
  std::size_t gel = 0;  ///< of trial_gels()
  BodyPlace placed = BodyPlace::anywhere;
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();  ///< of the object's origin
  double tilt_deg = 0.0;                               ///< about the object's y axis, before
  double yaw_deg = 0.0;                                ///< about the gel's z
  double depth_mm = 0.0;                               ///< beyond the first touch
  double friction = 0.0;
  double shear_deg = 0.0;  ///< with friction: the direction in which it is dragged afterwards
};

/// A gel to press on.
struct TrialGel {
  std::string name;
  sim::DeviceSpec device;                                           ///< gel and mesh alone
  double reference_edges = 0.35;                                    ///< the reference's edges over its own
  std::shared_ptr<const fem::Compliance> own = {}, reference = {};  ///< once set up
};

/// Slab, dome and fingertip, not set up; the references are within what the program takes. In the quick form their fine
/// part is smaller, and the reference's edges are half as long as their own: a tenth of the set-up's time.
std::vector<TrialGel> trial_gels(bool quick);

/// The trial of this number, a pure function of seed, index and the gels' own surface meshes. Gel, size, place, angles,
/// depth and friction are drawn independently; families take turns. @pre the gels are set up
BodyTrial draw_trial(std::uint64_t seed, int index, const std::vector<TrialGel>& gels);

/// All that is needed to make it again.
std::string in_words(const BodyTrial& trial);

}  // namespace touchstone::lab
