#pragma once
// Objects that give way themselves: from an object's file to its own compliance.

#include <filesystem>
#include <memory>
#include <vector>

#include "core/triangle_mesh.h"
#include "fem/elements/compliance.h"
#include "fem/mesh/solid_gel.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// The object's closed surface in triangles of about `edge_mm`, object frame: of even size, as a mesh of its inside
/// needs them. A box's and a mesh's are left as they are: meshing cuts them where they are too large.
TriangleMesh even_surface(const ShapeSpec& shape, double edge_mm);

/// The elastic object as a gel on its back: turned by half a turn about x, so that its underside is the outer surface,
/// and moved so that this is at z = 0. Triangles wholly at or above the height where it is held are bonded, the others
/// outer. @pre the object is elastic
/// @throws Error if it isn't held anywhere, or nowhere free
fem::SolidGel solid_of(const ObjectSpec& object);

/// A compliance of a solid on its back, turned onto its feet again, its lowest point at the height `lowest` (mm).
fem::Compliance turned_back(fem::Compliance solid, double lowest);

/// The object's own compliance in its own frame, kept in the cache. @pre the object is elastic
/// @throws Error with the place in the object's file, if it can't be meshed
std::shared_ptr<const fem::Compliance> set_up_elastic_object(const ObjectSpec& object,
                                                             const std::filesystem::path& cache_folder);

/// The same for all objects of a scene, in their order; null for rigid ones. Empty where the plan has no elastic
/// object: nothing is set up then.
std::vector<std::shared_ptr<const fem::Compliance>> set_up_elastic_objects(const SceneSpec& scene, const Plan& plan,
                                                                           const std::filesystem::path& cache_folder);

}  // namespace touchstone::sim
