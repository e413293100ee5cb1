#pragma once
// Layers on a gel, far thinner perhaps than its elements: flat prisms in columns over the faces of the body below, each
// cut into three tetrahedra. Taylor-Hood takes their flatness (see kFlattestPrism).

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "fem/mesh/tet_mesh.h"

namespace touchstone::fem {

/// Longest edge of a prism over its height. Measured: layers of 1 um to 0.5 mm, a tenth to a hundred times as stiff as
/// the body below, on edges of 0.45 mm growing to 3 mm, are as exact as no layer (0.1 % of the work of a Gaussian
/// pressure, nu = 0.3), up to 3000 times as wide as high.
inline constexpr double kFlattestPrism = 1000.0;

/// Sheets of nodes through the layers, from the outer surface inwards.
struct LayerSheets {
  std::vector<double> depth;  ///< mm, rising from 0 to the sum of the layers
  std::vector<int> region;    ///< of the prisms under each sheet but the last: 1 is the outermost layer
};

/// Sheets as far apart as the wanted edges, `fine` down to `fine_depth` and growing below, but at least one prism a
/// layer.
LayerSheets layer_sheets(std::span<const double> layers, double fine, double fine_depth);

/// Thickness of all layers, mm. @throws Error if one isn't finite and above zero
double total_thickness(std::span<const double> layers);

/// The faces of a body that layers lie on, and where.
struct LayerColumns {
  std::vector<std::array<int, 3>> faces;  ///< of the body's mesh, normals out
  std::vector<FaceKind> kinds;            ///< what each becomes on the outside
  FaceKind rim = FaceKind::side;          ///< what the layers' ends become
  /// Where the column over a vertex of the body is, at a depth below the outside; at the last sheet it must be the
  /// vertex itself.
  std::function<Eigen::Vector3d(int vertex, double depth)> at;
};

/// Puts the layers on: region 0 is what was there. `mesh.outer` and `mesh.bonded` lose the covered faces and get the
/// new ones. @throws Error if a layer is too thin for the faces' edges (kFlattestPrism)
void add_layers(const LayerSheets& sheets, const LayerColumns& columns, TetMesh& mesh);

}  // namespace touchstone::fem
