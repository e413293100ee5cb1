#include "fem/elements/element.h"

#include "core/error.h"
#include "fem/elements/quadrature.h"

namespace touchstone::fem {
namespace {

/// 2 eps(N_i e_a) : eps(N_j e_b) = (gi.gj) delta_ab + gi_b gj_a, as in taylor_hood.cpp.
Eigen::Matrix3d shearing(const Eigen::Vector3d& gi, const Eigen::Vector3d& gj) {
  return gi.dot(gj) * Eigen::Matrix3d::Identity() + gj * gi.transpose();
}

/// A body without pressure unknowns: for each two nodes of an element int 2 G eps:eps + lambda div div, or with the
/// mean of one div in place of it.
class PressureFreeBody {
 public:
  PressureFreeBody(const TaylorHoodSpace& space, const Scales& scales, std::span<const ElasticMaterial> materials,
                   Element element)
      : space_(space), scales_(scales), element_(element) {
    for (std::size_t r = 0; r < scales.regions.size(); ++r) {
      lambda_.push_back(scales.regions[r].shear * lame_ratio(materials[r]));
    }
  }

  ElementRow row(int element, int node, const std::array<bool, 10>& wanted) const {
    ElementRow row;
    row.fill(Eigen::Matrix4d::Zero());
    const TetMesh& mesh = *space_.mesh;
    std::array<Eigen::Vector3d, 4> corners;
    for (int k = 0; k < 4; ++k) corners[k] = mesh.vertices[mesh.tetrahedra[element][k]] / scales_.length;
    const double size = volume(mesh, mesh.tetrahedra[element]) / std::pow(scales_.length, 3);
    const int region = mesh.region_of(element);
    const double shear = scales_.regions[region].shear;
    if (element_ == Element::linear) {
      if (node >= 4) return row;
      // The quadratic functions' gradients at the corner opposite to none: a linear function is N_corner + half of the
      // edges' functions that meet there.
      const Eigen::Matrix<double, 3, 10> quadratic = quadratic_gradients(corners, Eigen::Vector4d::Constant(0.25));
      Eigen::Matrix<double, 3, 4> linear = quadratic.leftCols<4>();
      for (int edge = 0; edge < 6; ++edge) {
        for (const int end : kTetEdges[edge]) linear.col(end) += 0.5 * quadratic.col(4 + edge);
      }
      for (int k = 0; k < 4; ++k) {
        if (wanted[k]) row[k].topLeftCorner<3, 3>() = size * block(linear.col(node), linear.col(k), shear, region);
      }
      return row;
    }
    Eigen::Matrix<double, 3, 10> mean = Eigen::Matrix<double, 3, 10>::Zero();
    const std::vector<SimplexPoint<4>>& rule = symmetric_tetrahedron_rule();
    for (const SimplexPoint<4>& point : rule) {
      const Eigen::Matrix<double, 3, 10> gradients = quadratic_gradients(corners, point.barycentric);
      mean += point.weight * gradients;
      for (int k = 0; k < 10; ++k) {
        if (!wanted[k]) continue;
        row[k].topLeftCorner<3, 3>() +=
            point.weight * size *
            (element_ == Element::quadratic ? block(gradients.col(node), gradients.col(k), shear, region)
                                            : Eigen::Matrix3d(shear * shearing(gradients.col(node), gradients.col(k))));
      }
    }
    if (element_ == Element::quadratic_constant_pressure) {
      for (int k = 0; k < 10; ++k) {
        if (wanted[k])
          row[k].topLeftCorner<3, 3>() += size * lambda_[region] * mean.col(node) * mean.col(k).transpose();
      }
    }
    return row;
  }

 private:
  Eigen::Matrix3d block(const Eigen::Vector3d& gi, const Eigen::Vector3d& gj, double shear, int region) const {
    return shear * shearing(gi, gj) + lambda_[region] * gi * gj.transpose();
  }

  const TaylorHoodSpace& space_;
  const Scales& scales_;
  Element element_;
  std::vector<double> lambda_;
};

/// Leaves out the unknowns that have no new number.
SymmetricEntries renumbered(const SymmetricEntries& matrix, const std::vector<int>& number, int size) {
  SymmetricEntries result;
  result.size = size;
  for (std::size_t k = 0; k < matrix.values.size(); ++k) {
    const int row = number[matrix.rows[k]];
    const int column = number[matrix.columns[k]];
    if (row >= 0 && column >= 0) result.add(row, column, matrix.values[k]);
  }
  return result;
}

/// The same for an order: what separates a mesh's nodes separates any part of them.
EliminationTree renumbered(const EliminationTree& tree, const std::vector<int>& number) {
  EliminationTree result;
  result.parent = tree.parent;
  int begin = 0;
  for (const int end : tree.end) {
    for (int k = begin; k < end; ++k) {
      if (number[tree.order[k]] >= 0) result.order.push_back(number[tree.order[k]]);
    }
    result.end.push_back(static_cast<int>(result.order.size()));
    begin = end;
  }
  return result;
}

}  // namespace

std::string_view name_of(Element element) {
  switch (element) {
    case Element::taylor_hood:
      return "Taylor-Hood (P2/P1)";
    case Element::quadratic_constant_pressure:
      return "quadratic, constant pressure (P2/P0)";
    case Element::quadratic:
      return "quadratic (P2)";
    case Element::linear:
      return "linear (P1)";
  }
  return "";
}

ElementSystem make_system(const TaylorHoodSpace& space, const Scales& scales,
                          std::span<const ElasticMaterial> materials, Element element) {
  if (element == Element::taylor_hood) {
    return {assemble(space, scales), elimination_tree(space), space.displacement};
  }
  std::vector<int> number(space.unknowns, -1);
  ElementSystem system;
  system.displacement.assign(space.nodes, -1);
  int size = 0;
  const int nodes = element == Element::linear ? space.vertices : space.nodes;
  for (int node = 0; node < nodes; ++node) {
    if (space.clamped[node]) continue;
    system.displacement[node] = size;
    for (int a = 0; a < 3; ++a) number[space.displacement[node] + a] = size++;
  }
  const PressureFreeBody body(space, scales, materials, element);
  system.matrix = renumbered(
      assemble_rows(space,
                    [&](int e, int node, const std::array<bool, 10>& wanted) { return body.row(e, node, wanted); }),
      number, size);
  system.tree = renumbered(elimination_tree(space), number);
  return system;
}

Eigen::SparseMatrix<double> over_nodes_of(Element element, const TaylorHoodSpace& space,
                                          const Eigen::SparseMatrix<double>& rows) {
  if (element != Element::linear) return rows;
  std::vector<Eigen::Triplet<double>> entries;
  for (int vertex = 0; vertex < space.vertices; ++vertex) entries.emplace_back(vertex, vertex, 1.0);
  for (int node = space.vertices; node < space.nodes; ++node) {
    for (const int end : space.edges[node - space.vertices]) entries.emplace_back(node, end, 0.5);
  }
  Eigen::SparseMatrix<double> linear(space.nodes, space.nodes);
  linear.setFromTriplets(entries.begin(), entries.end());
  return rows * linear;
}

}  // namespace touchstone::fem
