#pragma once
// How far a gel's presses are off because its mesh isn't infinitely fine, as measured at set-up (see
// fem/error/mesh_error.h).

#include <array>
#include <vector>

namespace touchstone::fem {

/// What the errors are of.
enum class ErrorOf {
  normal_force,  ///< relative
  shear_force,   ///< relative
  cross_force,   ///< a false force along the surface, relative to the normal force
  displacement,  ///< of the surface within twice the contact's radius, RMS, relative to its largest displacement
  beads,         ///< of the bead that is furthest off, relative to the largest bead displacement
  traction       ///< over the contact, RMS, relative to the mean traction
};
inline constexpr int kErrorKinds = 6;  ///< of ErrorKind

/// One value for each ErrorOf.
struct RelativeErrors {
  std::array<double, kErrorKinds> values{};

  double& operator[](ErrorOf kind) { return values[static_cast<std::size_t>(kind)]; }
  double operator[](ErrorOf kind) const { return values[static_cast<std::size_t>(kind)]; }
};

/// Errors for one sort of body, by the contact's radius over the mesh's edge at the contact.
struct BodyErrors {
  std::vector<double> radius_per_edge;  ///< rising
  std::vector<RelativeErrors> errors;   ///< at each of them
  RelativeErrors mesh_order;            ///< p of error ~ edge^p at a fixed contact
  RelativeErrors size_order;            ///< q of error ~ radius^-q on a fixed mesh
};

/// Empty where no ladder could be made: the errors aren't known then.
struct MeshErrorTable {
  BodyErrors smooth;  ///< spheres: the pressure falls to zero at the contact's edge
  BodyErrors sharp;   ///< flat punches: the pressure rises at the edge, without bound
};

/// The errors at a contact, straight lines between the rows' logarithms; below the rows they go on with size_order,
/// above them they stay. At most 1, and 1 if the table is empty.
RelativeErrors errors_at(const BodyErrors& body, double radius_per_edge);

}  // namespace touchstone::fem
