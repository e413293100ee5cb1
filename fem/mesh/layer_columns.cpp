#include "fem/mesh/layer_columns.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "fem/mesh/tetgen_fill.h"

namespace touchstone::fem {
namespace {

using Face = std::array<int, 3>;

Face sorted(Face face) {
  std::sort(face.begin(), face.end());
  return face;
}

void erase_faces(const std::vector<Face>& gone, std::vector<Face>& from) {
  std::vector<Face> keys;
  for (const Face& face : gone) keys.push_back(sorted(face));
  std::sort(keys.begin(), keys.end());
  std::erase_if(from, [&](const Face& face) { return std::binary_search(keys.begin(), keys.end(), sorted(face)); });
}

/// Three tetrahedra that fill the prism between two triangles; the sides' diagonals go from the lower column's bottom
/// to the higher one's top, so that neighbours agree.
std::array<std::array<int, 4>, 3> prism(const std::array<int, 3>& bottom, const std::array<int, 3>& top) {
  std::array<int, 3> by_column = {0, 1, 2};
  std::sort(by_column.begin(), by_column.end(), [&](int a, int b) { return bottom[a] < bottom[b]; });
  const auto [a, b, c] = by_column;
  return {{{bottom[a], bottom[b], bottom[c], top[c]},
           {bottom[a], bottom[b], top[b], top[c]},
           {bottom[a], top[a], top[b], top[c]}}};
}

}  // namespace

double total_thickness(std::span<const double> layers) {
  double total = 0.0;
  for (const double layer : layers) {
    if (!std::isfinite(layer) || layer <= 0.0) {
      fail("a layer's thickness is {} mm; it must be finite and above zero", layer);
    }
    total += layer;
  }
  return total;
}

LayerSheets layer_sheets(std::span<const double> layers, double fine, double fine_depth) {
  LayerSheets sheets;
  double depth = 0.0;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const double edge = fine + kEdgeGrowth * std::max(0.0, depth - fine_depth);
    const int parts = std::max(1, static_cast<int>(std::lround(layers[k] / edge)));
    for (int part = 0; part < parts; ++part) {
      sheets.depth.push_back(depth + layers[k] * part / parts);
      sheets.region.push_back(static_cast<int>(k) + 1);
    }
    depth += layers[k];
  }
  sheets.depth.push_back(depth);
  return sheets;
}

void add_layers(const LayerSheets& sheets, const LayerColumns& columns, TetMesh& mesh) {
  if (sheets.region.empty()) {
    return;
  }
  TS_ASSERT(columns.kinds.size() == columns.faces.size());
  const int body_vertices = static_cast<int>(mesh.vertices.size());
  mesh.region.resize(mesh.tetrahedra.size(), 0);
  erase_faces(columns.faces, mesh.outer);
  erase_faces(columns.faces, mesh.bonded);

  // sheet[s][vertex of the body]: its vertex at sheet s; the last sheet is the body's.
  std::vector<std::map<int, int>> sheet(sheets.depth.size());
  for (const Face& face : columns.faces) {
    for (const int vertex : face) sheet.back()[vertex] = vertex;
  }
  for (std::size_t s = sheets.region.size(); s-- > 0;) {
    for (const auto& [vertex, itself] : sheet.back()) {
      sheet[s][vertex] = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(columns.at(vertex, sheets.depth[s]));
    }
  }
  for (std::size_t s = sheets.region.size(); s-- > 0;) {
    const double height = sheets.depth[s + 1] - sheets.depth[s];
    for (const Face& face : columns.faces) {
      Face bottom{};
      Face top{};
      double longest = 0.0;
      for (int k = 0; k < 3; ++k) {
        bottom[k] = sheet[s + 1].at(face[k]);
        top[k] = sheet[s].at(face[k]);
      }
      for (int k = 0; k < 3; ++k) {
        longest = std::max(longest, (mesh.vertices[top[(k + 1) % 3]] - mesh.vertices[top[k]]).norm());
      }
      if (longest > kFlattestPrism * height) {
        fail(
            "a layer's elements would be {:.3g} mm wide and {:.3g} mm high; at most {} times as wide as high is "
            "allowed: make the gel's edge lengths smaller or the layer thicker",
            longest, height, kFlattestPrism);
      }
      for (auto& tetrahedron : prism(bottom, top)) {
        if (volume(mesh, tetrahedron) < 0.0) std::swap(tetrahedron[2], tetrahedron[3]);
        mesh.tetrahedra.push_back(tetrahedron);
        mesh.region.push_back(sheets.region[s]);
      }
    }
  }
  for (std::size_t f = 0; f < columns.faces.size(); ++f) {
    Face top{};
    for (int k = 0; k < 3; ++k) top[k] = sheet.front().at(columns.faces[f][k]);
    if (columns.kinds[f] == FaceKind::outer) mesh.outer.push_back(top);
    if (columns.kinds[f] == FaceKind::bonded) mesh.bonded.push_back(top);
  }
  if (columns.rim == FaceKind::side) {
    return;
  }
  // The columns' ends: boundary faces with a new vertex, but not all on the outside.
  const int first_outside = static_cast<int>(mesh.vertices.size() - sheet.front().size());
  for (const Face& face : boundary_faces(mesh)) {
    const auto [low, high] = std::minmax({face[0], face[1], face[2]});
    if (high >= body_vertices && low < first_outside) {
      (columns.rim == FaceKind::bonded ? mesh.bonded : mesh.outer).push_back(face);
    }
  }
}

}  // namespace touchstone::fem
