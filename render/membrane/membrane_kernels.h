#pragma once
// Where light goes inside a milky membrane on a clear plate, as far as its outer face: computed once, by random walks.
//
// The membrane fills -thickness < z < 0, the plate lies below it, air (and the camera) below that. A walk begins in the
// membrane and ends where it first arrives at the outer face z = 0, or where it leaves the plate towards the camera, or
// where it is absorbed. What the outer face then does with it (air mirrors it, a touching body swallows it) is no part
// of these figures, so that they serve for any state of the face (membrane_light.h).
//
// Directions at the face are grouped into sectors of the cosine to its normal: what is totally reflected by air, and
// two of what isn't. All walks start and end evenly over azimuth; by symmetry a kernel is then a function of the
// distance only.

#include <array>
#include <cstdint>
#include <vector>

namespace touchstone::render {

/// A membrane and the plate that it lies on, for one band of light. Both are infinite.
struct MembraneOptics {
  double thickness_mm = 0.0;
  double index = 1.41;
  double absorption_per_mm = 0.0;  ///< natural logarithm
  double scattering_per_mm = 0.0;
  double anisotropy = 0.0;  ///< mean cosine of a scattering, as Medium::anisotropy
  double plate_thickness_mm = 0.0;
  double plate_index = 1.0;
};

/// Sectors of the cosine to the face's normal, inside the membrane: 0 is what air reflects totally.
inline constexpr int kFaceSectors = 3;

/// The sectors' limits as squared cosines, so that sector k has the share limits[k+1] - limits[k] of even light's flux.
/// A membrane of the index 1 is cut in three equal parts.
std::array<double, kFaceSectors + 1> sector_limits(double index);

/// A share that is spread over the face: how much of it lands in each annulus, and what lands beyond the last.
struct RadialShare {
  std::vector<double> in_annulus;
  double beyond = 0.0;
  /// All annuli and what is beyond.
  double total() const;
};

/// What the camera sees in a direction of the membrane's: the sine s of the angle to the normal there, the azimuth phi
/// to that of the direction:
///   K = even + (s^2 - S / 2) slant + s cos(phi) aside + s^2 cos(2 phi) oval,    S = (largest s)^2,
/// the first terms of a series in s, fitted by least squares over all directions up to the largest s.
struct ViewKernel {
  RadialShare even, slant, aside, oval;
};

/// All figures of one membrane, by sector of the direction at the face and annulus of the distance.
struct MembraneKernels {
  MembraneOptics optics;
  double largest_sine = 0.0;  ///< S = largest_sine^2
  std::array<double, kFaceSectors + 1> limits = {};
  std::vector<double> radii_mm;  ///< the annuli's outer radii
  /// Of light that leaves the face evenly (matt) in sector i, what arrives next in sector j. Distance from the start.
  std::array<std::array<RadialShare, kFaceSectors>, kFaceSectors> exchange;
  std::array<double, kFaceSectors> exchange_absorbed = {};
  /// Of what of that air lets out: the mean cosine of the angle between its path along the face and the line from the
  /// start, times the share.
  std::array<std::array<RadialShare, kFaceSectors>, kFaceSectors> exchange_outward;
  /// Mean Fresnel reflectance, inside, of what arrives in a sector on these paths.
  std::array<double, kFaceSectors> exchange_reflectance = {};
  /// Of a walk along a camera's ray, from where it enters the membrane, what arrives first in sector j after at least
  /// one scattering or mirroring. Distance from where the straight ray meets the face.
  std::array<ViewKernel, kFaceSectors> view;
  std::array<RadialShare, kFaceSectors> view_outward;  ///< as exchange_outward
  std::array<double, kFaceSectors> view_reflectance = {};
  /// What is absorbed on those paths: at s, absorbed[0] + (s^2 - S / 2) absorbed[1]. Without the straight ray's.
  std::array<double, 2> view_absorbed = {};
};

/// How many walks the figures are means of.
struct MembraneWalkSettings {
  std::uint64_t seed = 1;
  int walks = 1 << 21;        ///< from each sector, and twice as many from the camera
  double largest_sine = 0.4;  ///< of a camera's direction in the membrane
};

/// @throws Error for optics or settings that make no sense: it names the field, the value and what is allowed. The same
/// for any number of threads.
MembraneKernels walk_membrane(const MembraneOptics& optics, const MembraneWalkSettings& settings = {});

/// The share of a straight camera ray that reaches the face without a scattering or being absorbed, at the squared
/// sine.
double straight_share(const MembraneOptics& optics, double squared_sine);

}  // namespace touchstone::render
