#pragma once
// What lamps there are. Lengths in mm, angles in radians, all in the gel frame.
//
//   scene.lamps.push_back(LedLamp{.position = {9, 0, -8}, .direction = {-1, 0, 0.4}, .radius = 0.9,
//                                 .half_power_angle = 15 * kRadiansPerDegree, .power_W = watts});
//
// A lamp stands in the medium of the flat layer that its height lies in (Scene::faces), so a lamp between the faces of
// a plate is a lamp in the glass; `power_W` is what it sends into that medium, in each band. Rows and rings of LEDs are
// made by lamp_arrays.h.
//
// Which renderer takes which: the path tracer all of them; a light field (light_field.h) those that aren't visible.
//
// How lamp light gets to a place:
//  - through the flat faces between the two straight on, exactly, by one connection to a point of the lamp
//    (lamp_connection.h);
//  - by mirror images of a lamp in flat faces, and through curved faces: only where a path hits the lamp itself, so
//    only that of lamps with `visible` set and some size (lamp_bodies.h). A GuideLamp has its mirror images in its
//    plate built in. For other lamps light mirrored by a face on its path is left out. Measured with an LED of radius 2
//    mm before and after it was made visible, in glass and gel over beads: from below in air what is left out is under
//    0.2 % of a bead's light and of an object's on the gel, and nothing of a membrane's; from the plate's side as much
//    again as the direct light, from the gel's side a quarter of a bead's light and twice that of an object on the gel.
//    So a lamp inside plate or gel should be a GuideLamp, or visible.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <string>
#include <variant>
#include <vector>

#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// A small projection lens: a disc of `lens_radius` (0 is a point) at `position`, facing `direction`. Each point of the
/// lens sends the same intensity (W/sr) into every direction within `half_angle` of `direction`, falling smoothly to
/// zero over a further `soft_angle` (radians; together below pi/2). `power_W` is all it emits, in each band.
/// The lens isn't seen by the camera nor by bounced light; it only lights.
struct SpotLamp {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double lens_radius = 0.0;
  double half_angle = 0.5;
  double soft_angle = 0.05;
  Spectrum power_W;
};

/// The half-power angle of a surface that shows the same radiance from everywhere: intensity as the cosine.
inline constexpr double kLambertianHalfPower = 1.0471975511965976;  // pi / 3

/// A round chip: a disc of `radius` (0 is a point) whose points send the intensity I0 cos^m(theta) about `direction`
/// into the half space before it, m from `half_power_angle` (lobe_exponent), the angle where the intensity is half of
/// that on the axis. Data sheets give the full angle: a "30 degree" LED has a half-power angle of 15.
///
/// `visible`: it is a black disc with a luminous front: seen by the camera and by bounced light, and in the way of
/// light. Needs a radius above 0 and a half-power angle of at most pi/3 (beyond it the radiance grows without end
/// towards the edge).
struct LedLamp {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double radius = 0.0;
  double half_power_angle = kLambertianHalfPower;
  Spectrum power_W;
  bool visible = false;
};

/// A luminous rectangle about `centre`, `width` along the part of `along` that is square to `direction` and `height`
/// across it; lobe and `visible` as of LedLamp. With the default lobe its radiance is power / (pi width height).
struct AreaLamp {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();
  double width = 1.0;
  double height = 1.0;
  double half_power_angle = kLambertianHalfPower;
  Spectrum power_W;
  bool visible = false;
};

/// A projector with a point lens. `pattern` (CV_8UC1 or CV_32FC1, grey, values 0 or more) is thrown about `direction`:
/// seen from the lens its middle row is `half_width_angle` wide to either side, its pixels are square and its top is
/// towards `up`. On a plane square to `direction` the irradiance is in proportion to the pixel, whatever its place.
/// `power_W` is all that leaves the lens with this pattern.
struct ProjectedLamp {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  double half_width_angle = 0.4;
  cv::Mat pattern;
  Spectrum power_W;
};

/// Light from the end of a light guide into a plate that guides it on: a luminous upright rectangle between the two
/// faces of the layer that `centre` lies in, `width` mm wide, square to the horizontal `direction`. It has the same
/// radiance at each of its points: intensity I0 cos^m about an axis that rises by `tilt` from `direction` (cut off at
/// the rectangle's own plane), m from `half_power_angle`; both angles are those inside the plate. An LED of half-power
/// angle a in air shows asin(sin(a) / n) in a plate of index n.
///
/// Light that meets the plate's faces is mirrored there by Fresnel's equations as often as its path has it (fully,
/// where the angle is beyond the critical one), which is taken from mirror images of the exit face
/// (guide_connection.h). Where the medium next to the plate has a lower index, rays flatter than the critical angle
/// stay in the plate: a gel of index 1.41 on acrylic of 1.49 gets no light that rises by less than 19 degrees. The
/// layer's faces are endless, there is no far end that sends light back.
struct GuideLamp {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  double tilt = 0.0;
  double width = 1.0;
  double half_power_angle = 0.2;
  Spectrum power_W;
};

/// Every kind of lamp.
using LampKinds = std::variant<SpotLamp, LedLamp, AreaLamp, ProjectedLamp, GuideLamp>;

/// One of these. It is the variant (std::visit, std::get and the like take it) with its copying out of line: inlined it
/// makes GCC 12 warn, wrongly, of uninitialised members of the kinds that the lamp isn't.
struct Lamp : LampKinds {
  using LampKinds::LampKinds;
  Lamp();
  Lamp(const Lamp&);
  Lamp(Lamp&&) noexcept;
  Lamp& operator=(const Lamp&);
  Lamp& operator=(Lamp&&) noexcept;
  ~Lamp();
};

/// m of a lobe cos^m that is at one half at the angle given: ln(1/2) / ln(cos angle). @pre 0 < angle < pi/2
double lobe_exponent(double half_power_angle);

/// The integral over all directions of what emission_profile says (prepared_lamp.h), sr: the intensity on the axis is
/// power / this. The pattern of a ProjectedLamp counts with its values.
double emission_integral(const Lamp& lamp);

/// Where a lamp's middle is, and what it sends (W in each band).
const Eigen::Vector3d& lamp_position(const Lamp& lamp);
/// What it sends into its medium, W in each band.
const Spectrum& lamp_power(const Lamp& lamp);

/// The directions of a luminous rectangle's width and height: unit, square to each other and to the way it shines.
struct RectangleSides {
  Eigen::Vector3d across, up;
};
RectangleSides sides_of(const AreaLamp& lamp);  ///< @pre `along` isn't along `direction`

/// How far it reaches from its middle; 0 for a point, and for a guide, whose end stands inside its plate.
double lamp_extent(const Lamp& lamp);

/// Where it faces (not always a unit vector), and the radius of the disc that a round lamp is; 0 of other kinds.
const Eigen::Vector3d& lamp_direction(const Lamp& lamp);
/// The radius of a round lamp, mm; 0 of other kinds.
double disc_radius(const Lamp& lamp);

/// Has it a body that rays can meet?
bool is_visible(const Lamp& lamp);

/// Equal in all fields (patterns: pixel by pixel).
bool same_lamp(const Lamp& a, const Lamp& b);

struct FlatFace;

/// @throws Error naming `what`, the value and what is allowed. `faces` as in Scene, checked before.
void check_lamp(const Lamp& lamp, Eigen::Index bands, const std::vector<FlatFace>& faces, const std::string& what);

}  // namespace touchstone::render
