#include "fem/elements/taylor_hood.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "fem/elements/elimination_order.h"
#include "fem/elements/quadrature.h"

namespace touchstone::fem {
namespace {

/// Products of two linear functions are quadratic: all of the stiffness is exact with this rule.
const std::vector<SimplexPoint<4>>& stiffness_rule() {
  // The symmetric four-point rule of degree two.
  static const std::vector<SimplexPoint<4>> rule = [] {
    const double a = (5.0 - std::sqrt(5.0)) / 20.0;
    std::vector<SimplexPoint<4>> points;
    for (int k = 0; k < 4; ++k) {
      SimplexPoint<4> point{Eigen::Vector4d::Constant(a), 0.25};
      point.barycentric[k] = 1.0 - 3.0 * a;
      points.push_back(point);
    }
    return points;
  }();
  return rule;
}

/// Gradients (columns) of the four barycentric coordinates.
Eigen::Matrix<double, 3, 4> barycentric_gradients(const std::array<Eigen::Vector3d, 4>& corners) {
  Eigen::Matrix3d edges;
  for (int k = 0; k < 3; ++k) {
    edges.col(k) = corners[k + 1] - corners[0];
  }
  Eigen::Matrix<double, 3, 4> gradients;
  gradients.rightCols<3>() = edges.inverse().transpose();
  gradients.col(0) = -(gradients.col(1) + gradients.col(2) + gradients.col(3));
  return gradients;
}

std::array<Eigen::Vector3d, 4> corners_of(const TetMesh& mesh, int element) {
  std::array<Eigen::Vector3d, 4> corners;
  for (int k = 0; k < 4; ++k) {
    corners[k] = mesh.vertices[mesh.tetrahedra[element][k]];
  }
  return corners;
}

/// Gradients (columns) of the ten quadratic shape functions.
Eigen::Matrix<double, 3, 10> shape_gradients(const Eigen::Matrix<double, 3, 4>& flat, const Eigen::Vector4d& at) {
  Eigen::Matrix<double, 3, 10> gradients;
  for (int k = 0; k < 4; ++k) {
    gradients.col(k) = (4.0 * at[k] - 1.0) * flat.col(k);
  }
  for (int k = 0; k < 6; ++k) {
    const auto [a, b] = kTetEdges[k];
    gradients.col(4 + k) = 4.0 * (at[a] * flat.col(b) + at[b] * flat.col(a));
  }
  return gradients;
}

/// What one element needs for its blocks, without units.
struct ElementShape {
  double volume = 0.0;
  Scales::Region scales;
  std::array<Eigen::Matrix<double, 3, 10>, 4> gradients;  // at the points of stiffness_rule
};

ElementShape element_shape(const TaylorHoodSpace& space, const Scales& scales, int element) {
  const auto corners = corners_of(*space.mesh, element);
  const Eigen::Matrix<double, 3, 4> flat = barycentric_gradients(corners) * scales.length;
  ElementShape shape;
  shape.volume = volume(*space.mesh, space.mesh->tetrahedra[element]) / std::pow(scales.length, 3);
  shape.scales = scales.regions[space.mesh->region_of(element)];
  for (int q = 0; q < 4; ++q) {
    shape.gradients[q] = shape_gradients(flat, stiffness_rule()[q].barycentric);
  }
  return shape;
}

/// Coupling of two of an element's nodes: rows and columns 0..2 displacement, 3 pressure (for corners).
Eigen::Matrix4d element_block(const ElementShape& shape, int i, int j) {
  const Scales::Region& scales = shape.scales;
  Eigen::Matrix4d block = Eigen::Matrix4d::Zero();
  for (int q = 0; q < 4; ++q) {
    const SimplexPoint<4>& point = stiffness_rule()[q];
    const double weight = point.weight * shape.volume;
    const Eigen::Vector3d gi = shape.gradients[q].col(i);
    const Eigen::Vector3d gj = shape.gradients[q].col(j);
    // 2 eps(N_i e_a) : eps(N_j e_b) = (gi.gj) delta_ab + gi_b gj_a
    block.topLeftCorner<3, 3>() +=
        (weight * scales.shear) * (gi.dot(gj) * Eigen::Matrix3d::Identity() + gj * gi.transpose());
    if (i < 4) {
      block.bottomLeftCorner<1, 3>() -= (weight * scales.pressure_scale * point.barycentric[i]) * gj.transpose();
    }
    if (j < 4) {
      block.topRightCorner<3, 1>() -= (weight * scales.pressure_scale * point.barycentric[j]) * gi;
    }
  }
  if (i < 4 && j < 4) {
    block(3, 3) = -scales.compressibility * shape.volume * (i == j ? 0.1 : 0.05);
  }
  return block;
}

/// What carries unknowns: a node (its displacement and, at a vertex, its first pressure), or one of a vertex' further
/// pressures.
struct Carriers {
  explicit Carriers(const TaylorHoodSpace& from)
      : space(from), count(from.nodes + static_cast<int>(from.pressure.size()) - from.vertices) {}

  const TaylorHoodSpace& space;
  int count;

  int of_pressure(int pressure) const {
    return pressure < space.vertices ? pressure : space.nodes + pressure - space.vertices;
  }
  /// The unknown of a carrier's component (3: pressure), or -1.
  int unknown(int carrier, int component) const {
    if (carrier >= space.nodes) {
      return component == 3 ? space.pressure[carrier - space.nodes + space.vertices] : -1;
    }
    if (component == 3) {
      return carrier < space.vertices ? space.pressure[carrier] : -1;
    }
    return space.clamped[carrier] ? -1 : space.displacement[carrier] + component;
  }
};

/// Which rows of an element's blocks go to a carrier.
struct Member {
  int carrier;
  int local;  ///< place of the node in the element
  int first;  ///< rows first..last: 0..3 all, 0..2 displacement alone, 3..3 pressure alone
  int last;
};

std::vector<Member> members_of(const Carriers& carriers, int element) {
  std::vector<Member> members;
  const TaylorHoodSpace& space = carriers.space;
  for (int k = 0; k < 10; ++k) {
    const int node = space.elements[element][k];
    const int pressure = k < 4 ? carriers.of_pressure(space.element_pressures[element][k]) : node;
    members.push_back({node, k, 0, pressure == node ? 3 : 2});
    if (pressure != node) {
      members.push_back({pressure, k, 3, 3});
    }
  }
  return members;
}

}  // namespace

Eigen::Matrix<double, 10, 1> quadratic_shape(const Eigen::Vector4d& at) {
  Eigen::Matrix<double, 10, 1> values;
  for (int k = 0; k < 4; ++k) {
    values[k] = at[k] * (2.0 * at[k] - 1.0);
  }
  for (int k = 0; k < 6; ++k) {
    values[4 + k] = 4.0 * at[kTetEdges[k][0]] * at[kTetEdges[k][1]];
  }
  return values;
}

Eigen::Matrix<double, 3, 10> quadratic_gradients(const std::array<Eigen::Vector3d, 4>& corners,
                                                 const Eigen::Vector4d& barycentric) {
  return shape_gradients(barycentric_gradients(corners), barycentric);
}

SymmetricEntries assemble(const TaylorHoodSpace& space, const Scales& scales) {
  std::vector<ElementShape> shapes(space.elements.size());
  tbb::parallel_for(std::size_t{0}, shapes.size(),
                    [&](std::size_t e) { shapes[e] = element_shape(space, scales, static_cast<int>(e)); });
  return assemble_rows(space, [&](int element, int node, const std::array<bool, 10>& wanted) {
    ElementRow row;
    for (int k = 0; k < 10; ++k) {
      if (wanted[k]) {
        row[k] = element_block(shapes[element], node, k);
      }
    }
    return row;
  });
}

SymmetricEntries assemble_rows(
    const TaylorHoodSpace& space,
    const std::function<ElementRow(int element, int node, const std::array<bool, 10>& wanted)>& row_of) {
  const Carriers carriers(space);
  std::vector<std::vector<Member>> members(space.elements.size());
  tbb::parallel_for(std::size_t{0}, members.size(),
                    [&](std::size_t e) { members[e] = members_of(carriers, static_cast<int>(e)); });
  // Elements around each carrier, in their order, and the carrier's place among the element's members.
  std::vector<std::vector<std::array<int, 2>>> around(carriers.count);
  for (std::size_t e = 0; e < members.size(); ++e) {
    for (std::size_t k = 0; k < members[e].size(); ++k) {
      around[members[e][k].carrier].push_back({static_cast<int>(e), static_cast<int>(k)});
    }
  }
  std::vector<SymmetricEntries> rows(carriers.count);
  tbb::parallel_for(0, carriers.count, [&](int carrier) {
    std::vector<int> neighbours;
    for (const auto& [element, place] : around[carrier]) {
      for (const Member& other : members[element]) {
        if (other.carrier >= carrier) {
          neighbours.push_back(other.carrier);
        }
      }
    }
    std::sort(neighbours.begin(), neighbours.end());
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
    std::vector<Eigen::Matrix4d> blocks(neighbours.size(), Eigen::Matrix4d::Zero());
    for (const auto& [element, place] : around[carrier]) {
      const Member& own = members[element][place];
      std::array<bool, 10> wanted{};
      for (const Member& other : members[element]) {
        wanted[other.local] = wanted[other.local] || other.carrier >= carrier;
      }
      const ElementRow row = row_of(element, own.local, wanted);
      for (const Member& other : members[element]) {
        if (other.carrier >= carrier) {
          const auto found = std::lower_bound(neighbours.begin(), neighbours.end(), other.carrier);
          const Eigen::Matrix4d& block = row[other.local];
          Eigen::Matrix4d& sum = blocks[found - neighbours.begin()];
          const int height = own.last - own.first + 1;
          const int width = other.last - other.first + 1;
          sum.block(own.first, other.first, height, width) += block.block(own.first, other.first, height, width);
        }
      }
    }
    for (std::size_t n = 0; n < neighbours.size(); ++n) {
      for (int a = 0; a < 4; ++a) {
        for (int b = neighbours[n] == carrier ? a : 0; b < 4; ++b) {
          const int row = carriers.unknown(carrier, a);
          const int column = carriers.unknown(neighbours[n], b);
          if (row >= 0 && column >= 0) {
            rows[carrier].add(row, column, blocks[n](a, b));
          }
        }
      }
    }
  });
  SymmetricEntries matrix;
  matrix.size = space.unknowns;
  std::size_t total = 0;
  for (const SymmetricEntries& row : rows) {
    total += row.values.size();
  }
  matrix.rows.reserve(total);
  matrix.columns.reserve(total);
  matrix.values.reserve(total);
  for (const SymmetricEntries& row : rows) {
    matrix.rows.insert(matrix.rows.end(), row.rows.begin(), row.rows.end());
    matrix.columns.insert(matrix.columns.end(), row.columns.begin(), row.columns.end());
    matrix.values.insert(matrix.values.end(), row.values.begin(), row.values.end());
  }
  return matrix;
}

Eigen::VectorXd load_vector(const TaylorHoodSpace& space, const Scales& scales, const ElasticLoads& loads) {
  const TetMesh& mesh = *space.mesh;
  Eigen::MatrixX3d force = Eigen::MatrixX3d::Zero(space.nodes, 3);  // N
  if (loads.body_force) {
    const auto rule = tetrahedron_rule(6);
    for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
      const double size = volume(mesh, mesh.tetrahedra[e]);
      const auto corners = corners_of(mesh, static_cast<int>(e));
      for (const auto& point : rule) {
        Eigen::Vector3d x = Eigen::Vector3d::Zero();
        for (int k = 0; k < 4; ++k) {
          x += point.barycentric[k] * corners[k];
        }
        const Eigen::Vector3d f = loads.body_force(x) * (point.weight * size);
        const auto shape = quadratic_shape(point.barycentric);
        for (int k = 0; k < 10; ++k) {
          force.row(space.elements[e][k]) += shape[k] * f.transpose();
        }
      }
    }
  }
  if (loads.traction) {
    auto bonded = mesh.bonded;
    const auto key = [](std::array<int, 3> face) {
      std::sort(face.begin(), face.end());
      return face;
    };
    std::transform(bonded.begin(), bonded.end(), bonded.begin(), key);
    std::sort(bonded.begin(), bonded.end());
    const auto rule = triangle_rule(6);
    for (const auto& face : boundary_faces(mesh)) {
      if (std::binary_search(bonded.begin(), bonded.end(), key(face))) {
        continue;
      }
      const Eigen::Vector3d a = mesh.vertices[face[0]];
      const Eigen::Vector3d b = mesh.vertices[face[1]];
      const Eigen::Vector3d c = mesh.vertices[face[2]];
      const Eigen::Vector3d cross = (b - a).cross(c - a);
      const double area = 0.5 * cross.norm();
      for (const auto& point : rule) {
        const Eigen::Vector3d& l = point.barycentric;
        const Eigen::Vector3d f =
            loads.traction(l[0] * a + l[1] * b + l[2] * c, cross.normalized()) * (point.weight * area);
        for (int k = 0; k < 3; ++k) {
          force.row(face[k]) += l[k] * (2.0 * l[k] - 1.0) * f.transpose();
          const int next = (k + 1) % 3;
          force.row(space.middle(face[k], face[next])) += 4.0 * l[k] * l[next] * f.transpose();
        }
      }
    }
  }
  Eigen::VectorXd right = Eigen::VectorXd::Zero(space.unknowns);
  for (int node = 0; node < space.nodes; ++node) {
    if (!space.clamped[node]) {
      right.segment<3>(space.displacement[node]) =
          force.row(node).transpose() / (scales.stress * scales.length * scales.length);
    }
  }
  return right;
}

ElasticSolution solve_elastic(const TaylorHoodSpace& space, const ElasticMaterial& material,
                              const ElasticLoads& loads) {
  return solve_elastic(space, std::vector<ElasticMaterial>(region_count(*space.mesh), material), loads);
}

ElasticSolution solve_elastic(const TaylorHoodSpace& space, std::span<const ElasticMaterial> materials,
                              const ElasticLoads& loads) {
  const Scales scales = make_scales(*space.mesh, materials);
  const Carriers carriers(space);
  Eigen::VectorXd right = load_vector(space, scales, loads);
  ElasticSolution solution;
  solution.displacement = Eigen::MatrixX3d::Zero(space.nodes, 3);
  if (loads.bonded_displacement) {
    for (int node = 0; node < space.nodes; ++node) {
      if (space.clamped[node]) {
        solution.displacement.row(node) = loads.bonded_displacement(space.position(node)).transpose();
      }
    }
    // What is given goes to the right-hand side.
    for (std::size_t e = 0; e < space.elements.size(); ++e) {
      const auto& nodes = space.elements[e];
      if (std::none_of(nodes.begin(), nodes.end(), [&](int node) { return space.clamped[node] != 0; })) {
        continue;
      }
      const ElementShape shape = element_shape(space, scales, static_cast<int>(e));
      const std::vector<Member> members = members_of(carriers, static_cast<int>(e));
      for (int j = 0; j < 10; ++j) {
        if (!space.clamped[nodes[j]]) {
          continue;
        }
        Eigen::Vector4d given = Eigen::Vector4d::Zero();
        given.head<3>() = solution.displacement.row(nodes[j]).transpose() / scales.length;
        for (const Member& member : members) {
          const Eigen::Vector4d pull = element_block(shape, member.local, j) * given;
          for (int a = member.first; a <= member.last; ++a) {
            const int row = carriers.unknown(member.carrier, a);
            if (row >= 0) {
              right[row] -= pull[a];
            }
          }
        }
      }
    }
  }
  const Eigen::VectorXd found = solve_symmetric(assemble(space, scales), elimination_order(space), right);
  for (int node = 0; node < space.nodes; ++node) {
    if (!space.clamped[node]) {
      solution.displacement.row(node) = scales.length * found.segment<3>(space.displacement[node]).transpose();
    }
  }
  solution.pressure.resize(static_cast<Eigen::Index>(space.pressure.size()));
  for (std::size_t e = 0; e < space.elements.size(); ++e) {
    const double scale = scales.regions[space.mesh->region_of(e)].pressure_scale;
    for (const int pressure : space.element_pressures[e]) {
      solution.pressure[pressure] = scales.stress * scale * found[space.pressure[pressure]];
    }
  }
  return solution;
}

Eigen::Vector3d displacement_at(const TaylorHoodSpace& space, const ElasticSolution& solution, int element,
                                const Eigen::Vector4d& barycentric) {
  const auto shape = quadratic_shape(barycentric);
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  for (int k = 0; k < 10; ++k) {
    value += shape[k] * solution.displacement.row(space.elements[element][k]).transpose();
  }
  return value;
}

double pressure_at(const TaylorHoodSpace& space, const ElasticSolution& solution, int element,
                   const Eigen::Vector4d& barycentric) {
  double value = 0.0;
  for (int k = 0; k < 4; ++k) {
    value += barycentric[k] * solution.pressure[space.element_pressures[element][k]];
  }
  return value;
}

Eigen::Matrix3d displacement_gradient_at(const TaylorHoodSpace& space, const ElasticSolution& solution, int element,
                                         const Eigen::Vector4d& barycentric) {
  const auto gradients = shape_gradients(barycentric_gradients(corners_of(*space.mesh, element)), barycentric);
  Eigen::Matrix3d value = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 10; ++k) {
    value += solution.displacement.row(space.elements[element][k]).transpose() * gradients.col(k).transpose();
  }
  return value;
}

Eigen::Matrix3d stress_at(const TaylorHoodSpace& space, const ElasticMaterial& material,
                          const ElasticSolution& solution, int element, const Eigen::Vector4d& barycentric) {
  const Eigen::Matrix3d gradient = displacement_gradient_at(space, solution, element, barycentric);
  return shear_modulus(material) * (gradient + gradient.transpose()) -
         pressure_at(space, solution, element, barycentric) * Eigen::Matrix3d::Identity();
}

}  // namespace touchstone::fem
