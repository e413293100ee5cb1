#pragma once
// Colours as people see and measure them: sRGB [IEC61966], CIE 1931 XYZ and CIE 1976 L*a*b* under D65, and the colour
// difference CIEDE2000.

#include <Eigen/Core>

namespace touchstone {

/// XYZ of D65 for the 2 degree observer, Y = 1: the white of sRGB.
inline const Eigen::Vector3d kD65White(0.95047, 1.0, 1.08883);

/// sRGB values, 0 to 1, as parts of the primaries' light, 0 to 1; values beyond are continued (below 0 linearly).
Eigen::Vector3d linear_from_srgb(const Eigen::Vector3d& srgb);
/// The inverse, of one value: 12.92 x to x = 0.0031308, then 1.055 x^(1/2.4) - 0.055.
double srgb_from_linear(double linear);

/// XYZ of light in sRGB's primaries; (1, 1, 1) is kD65White.
Eigen::Vector3d xyz_from_linear_srgb(const Eigen::Vector3d& linear);

/// (L*, a*, b*) beside a white of kD65White [ISO11664, part 4].
Eigen::Vector3d lab_from_xyz(const Eigen::Vector3d& xyz);
/// The inverse.
Eigen::Vector3d xyz_from_lab(const Eigen::Vector3d& lab);
/// Of an sRGB colour.
Eigen::Vector3d lab_from_srgb(const Eigen::Vector3d& srgb);

/// The colour of hue `hue_deg` (red 0, green 120, blue 240), saturation and lightness, 0 to 1, in the double cone of
/// HSL [Joblove1978], as sRGB.
Eigen::Vector3d srgb_from_hsl(double hue_deg, double saturation, double lightness);

/// CIEDE2000 [ISO11664, part 6] between two (L*, a*, b*), parametric factors 1: about 1 is just seen.
double ciede2000(const Eigen::Vector3d& lab_1, const Eigen::Vector3d& lab_2);

}  // namespace touchstone
