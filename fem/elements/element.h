#pragma once
// Elements that a gel could be made of. Touchstone's own is Taylor-Hood's; the others are what programs without a
// pressure of its own use, here so that what the element buys can be measured on a user's own gel
// (lab/bench/device_bench.h). Devices can't choose them.

#include <Eigen/SparseCore>
#include <span>
#include <string_view>
#include <vector>

#include "fem/elements/compliance.h"
#include "fem/elements/elimination_order.h"
#include "fem/elements/taylor_hood.h"

namespace touchstone::fem {

/// Tetrahedra with straight edges. By the bounds of the potential energy, gels of `quadratic` are stiffer than true
/// ones and those of `linear`, a part of its space, stiffer still: near nu = 0.5 both lock.
enum class Element {
  taylor_hood,                  ///< displacement quadratic, pressure linear and continuous
  quadratic_constant_pressure,  ///< displacement quadratic, a constant pressure in each: the volume change's mean
                                ///< counts
  quadratic,                    ///< displacement quadratic, no pressure (CalculiX' C3D10 and its like)
  linear,                       ///< displacement linear, no pressure
};

/// "Taylor-Hood (P2/P1)" and so on.
std::string_view name_of(Element element);

/// An elastic body in the unknowns of an element, without units.
struct ElementSystem {
  SymmetricEntries matrix;
  EliminationTree tree;
  std::vector<int> displacement;  ///< per node of the space: its first of three unknowns, -1 if it has none
};

/// @pre `scales` are made from `materials`, one a region
ElementSystem make_system(const TaylorHoodSpace& space, const Scales& scales,
                          std::span<const ElasticMaterial> materials, Element element);

/// Rows over the nodes of the space as rows over the nodes that the element has: those of a linear element have no
/// middles of edges, which go as the mean of their ends.
Eigen::SparseMatrix<double> over_nodes_of(Element element, const TaylorHoodSpace& space,
                                          const Eigen::SparseMatrix<double>& rows);

/// compute_compliance() with another element, and with other surfaces compressed: those of more vertices than
/// `most_whole`. @throws Error as there, and for an element that isn't taylor_hood if its elimination fails
Compliance compute_compliance(const TetMesh& mesh, std::span<const ElasticMaterial> materials,
                              std::span<const Bead> beads, double thickness, Element element,
                              const Progress& progress = {}, int most_whole = kMostWholeVertices);

}  // namespace touchstone::fem
