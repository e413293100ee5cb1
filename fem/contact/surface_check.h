#pragma once
// What a press's deformed surface shows that the equations behind it leave out: a gel that folds, that wrinkles under
// its skin, or that reaches into the object's side. Contact of the gel with itself isn't solved by any press.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fem/contact/press.h"
#include "fem/elements/elastic_material.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

/// A gel's outer surface after a press.
struct SurfaceCheck {
  int turned_over = 0;  ///< triangles that face more than 90 degrees away from where they did, or have no area left
  std::optional<std::pair<int, int>> crossing;  ///< two triangles that cross, each of which hasn't turned over
  double into_object = 0.0;                     ///< mm: how deep free vertices lie within a rigid body
  double edge = 0.0;                            ///< mm: the longest edge at the vertex that lies deepest
  double shortening = 0.0;  ///< the largest over the triangles: by which part of it a line in the surface is shorter
};

/// `state` is one of a press with PressOutput::fields on the gel with this outer surface. `bodies`: in the press's
/// order; null: an elastic one, which gives way, so nothing is said to lie in it.
SurfaceCheck check_surface(std::span<const Eigen::Vector3d> vertices, std::span<const std::array<int, 3>> triangles,
                           std::span<const ContactShape* const> bodies, const PressState& state);

/// Part by which a thin film on a thick soft body must be shortened before it wrinkles:
/// 1/4 (3 E_body' / E_film')^(2/3), E' = E / (1 - nu^2) ([Allen1969]; [Chen2004, sec. 2]). For a film no stiffer than
/// the body, of which this says nothing, infinity.
double wrinkling_strain(const ElasticMaterial& film, const ElasticMaterial& body);

/// What is to be doubted of a press for what check_surface() found: sentences without a full stop, none if nothing is.
/// `materials`: the gel's body's, then its layers' from the outer surface inwards. A free vertex counts as within the
/// object from `kIntoObject` edges on: nearer to its outline the mesh can't say.
std::vector<std::string> surface_doubts(const SurfaceCheck& check, std::span<const ElasticMaterial> materials);

inline constexpr double kIntoObject = 0.5;  ///< edges of the gel, see above

}  // namespace touchstone::fem
