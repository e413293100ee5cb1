#pragma once
// Design rules of a sensor that measures depth by how large its soft markers look behind a rigid filter [Lin2019, sec.
// III.C]: eqs. 1 to 3, figs. 4 and 5. The filter is d before the pinhole, the marker t behind the filter.
//
// What the equations say of the thickness. By eq. 3 a force F on one marker makes the strain e = F / (E L0^2), whatever
// t is, so the marker's stretch S = 1 + nu e is the same for all t and its displacement is e t. By eq. 1 it then looks
// larger by S / (1 - e t / (d + t)) - 1, and that only grows with t: with d + t held (the constraint that n markers
// fill the field of view) up to d = 0, with d held towards S / (1 - e) - 1. No law in which the strain doesn't depend
// on t changes this. So eqs. 1 to 3, read as they are printed, have no thickness that maximises the relative change.
// Fig. 4c and the paper ("greater marker mobility ... at the expense of a smaller change in the apparent area") have
// one. It is there in these readings (ApparentMeasure):
//   - the change l - l0 of the picture itself, in mm or pixels, with the filter, at d, filling the view: a thicker
//     sensor puts the marker farther away, where it is small. best_picture_thickness() is d (1 - nu) / (1 + nu) for
//     small forces: a third of d for nu = 0.5;
//   - the change of the picture's area, likewise: d (1 - 2 nu) / (2 (1 + nu)), which is 0 for nu = 0.5, and a little
//     above for forces that aren't small;
//   - the relative change of a marker that is made larger the farther away it is, so as to fill the view as its filter
//     does: the strain then falls as 1 / (d + t)^2. For small forces the optimum is that of the area.
// With a given displacement in place of a given force all of them fall with t.

#include <vector>

#include "core/yaml_reader.h"

namespace touchstone::lab {

/// Width of the sensor in [Lin2019], mm.
inline constexpr double kChromaSensorWidth_mm = 35.0;

/// The angle (radians) that a lens sees on a sensor of this width: 2 atan(width / (2 focal length)). @throws Error
/// unless both are finite and above 0
double angle_of_view(double focal_length_mm, double sensor_mm = kChromaSensorWidth_mm);

/// The distance (mm) at which a marker takes the n-th part of the angle of view: L0 / tan(theta / n), before eq. 1.
/// @throws Error unless the side is above 0, the angle above 0 and below pi, n at least 1, and theta / n below pi / 2
double distance_in_view(double marker_mm, double angle_of_view, int markers);

/// How much larger a marker looks that came nearer by `displacement_mm` from `distance_mm`; to first order,
/// displacement over distance (eq. 2). @throws Error unless the distance is above 0, and the displacement less than it
double apparent_change(double displacement_mm, double distance_mm);

/// A soft square on the gel: its side, and the gel under it.
struct SoftMarker {
  double side_mm = 2.0;
  double youngs_modulus_MPa = 0.4;
  double poisson_ratio = 0.5;
};

/// e = F / (E L0^2), the strain of the column of gel under a marker (eq. 3). @throws Error unless side and modulus are
/// above 0, Poisson's ratio from 0 to 0.5, the force at least 0, and the strain below 1
double column_strain(double force_N, const SoftMarker& marker);

/// Displacement (mm) of a marker under a force on it (eq. 3). @throws Error as column_strain, or unless the thickness
/// is above 0
double column_displacement(double force_N, const SoftMarker& marker, double thickness_mm);

/// L / L0 of a marker that is pressed in (eq. 3). @throws Error unless the thickness is above 0, the displacement from
/// 0 to less than it, and Poisson's ratio from 0 to 0.5
double column_stretch(double displacement_mm, double thickness_mm, double poisson_ratio);

/// How much larger a stretched marker looks that came nearer: eq. 1 with L in the place of L0, stretch / (1 - dz / D)
/// - 1. @throws Error as apparent_change, or unless the stretch is above 0
double stretched_apparent_change(double stretch, double displacement_mm, double distance_mm);

/// What is to be largest, and what stays as it is while the thickness changes.
enum class ApparentMeasure {
  relative_whole_fixed,  ///< (l - l0) / l0, d + t held: the constraint as printed
  relative_film_fixed,   ///< (l - l0) / l0, d held
  picture_film_fixed,    ///< (l - l0) / l_film, d held: the picture's change over that of a filter as large as L0
  area_film_fixed,       ///< (l^2 - l0^2) / l_film^2, d held
  relative_fills_view,   ///< (l - l0) / l0, d held, the marker's side growing as (d + t) / d
};
EnumNames<ApparentMeasure> enum_names(ApparentMeasure);

/// A sensor whose thickness is to be chosen.
struct ChromaDesign {
  SoftMarker marker;
  double force_N = 0.0;      ///< on one marker
  double distance_mm = 0.0;  ///< d + t for relative_whole_fixed, else d
};

/// Eqs. 1 to 3 together (fig. 4c). @throws Error as the functions above, or if the thickness is at or beyond d + t
double apparent_measure(ApparentMeasure measure, const ChromaDesign& design, double thickness_mm);

/// The thickness with the largest picture_film_fixed, in closed form: d (1 - s) / (s - (1 - e)) with s^2 = (1 + nu e)(1
/// - e), which is d (1 - nu) / (1 + nu) where e is 0. @throws Error as column_strain, or unless d is above 0
double best_picture_thickness(const ChromaDesign& design);

}  // namespace touchstone::lab
