#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "fem/elements/taylor_hood.h"

namespace touchstone::fem {

Eigen::Vector3d TaylorHoodSpace::position(int node) const {
  if (node < vertices) {
    return mesh->vertices[node];
  }
  const auto [a, b] = edges[node - vertices];
  return 0.5 * (mesh->vertices[a] + mesh->vertices[b]);
}

int TaylorHoodSpace::middle(int a, int b) const {
  const std::array<int, 2> edge = {std::min(a, b), std::max(a, b)};
  const auto found = std::lower_bound(edges.begin(), edges.end(), edge);
  TS_ASSERT(found != edges.end() && *found == edge);
  return vertices + static_cast<int>(found - edges.begin());
}

namespace {

/// A vertex has one pressure in each group of regions around it; the least group's is the vertex' own.
void number_pressures(const std::vector<int>& group, TaylorHoodSpace& space) {
  const TetMesh& mesh = *space.mesh;
  std::vector<std::array<int, 2>> pairs;  // vertex, group
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    for (const int vertex : mesh.tetrahedra[e]) {
      pairs.push_back({vertex, group[mesh.region_of(e)]});
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  space.pressure_vertex.resize(space.vertices);
  std::iota(space.pressure_vertex.begin(), space.pressure_vertex.end(), 0);
  std::vector<int> place(pairs.size());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const int vertex = pairs[k][0];
    if (k == 0 || pairs[k - 1][0] != vertex) {
      place[k] = vertex;
    } else {
      place[k] = static_cast<int>(space.pressure_vertex.size());
      space.pressure_vertex.push_back(vertex);
    }
  }
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    std::array<int, 4> pressures{};
    for (int k = 0; k < 4; ++k) {
      const std::array<int, 2> pair = {mesh.tetrahedra[e][k], group[mesh.region_of(e)]};
      pressures[k] = place[std::lower_bound(pairs.begin(), pairs.end(), pair) - pairs.begin()];
    }
    space.element_pressures.push_back(pressures);
  }
}

/// `group` per region: the pressure is continuous within a group.
TaylorHoodSpace space_of(const TetMesh& mesh, const std::vector<int>& group) {
  TaylorHoodSpace space;
  space.mesh = &mesh;
  space.vertices = static_cast<int>(mesh.vertices.size());
  for (const auto& tetrahedron : mesh.tetrahedra) {
    for (const auto& [i, j] : kTetEdges) {
      space.edges.push_back({std::min(tetrahedron[i], tetrahedron[j]), std::max(tetrahedron[i], tetrahedron[j])});
    }
  }
  std::sort(space.edges.begin(), space.edges.end());
  space.edges.erase(std::unique(space.edges.begin(), space.edges.end()), space.edges.end());
  space.nodes = space.vertices + static_cast<int>(space.edges.size());
  for (const auto& tetrahedron : mesh.tetrahedra) {
    std::array<int, 10> nodes{};
    std::copy(tetrahedron.begin(), tetrahedron.end(), nodes.begin());
    for (int k = 0; k < 6; ++k) {
      nodes[4 + k] = space.middle(tetrahedron[kTetEdges[k][0]], tetrahedron[kTetEdges[k][1]]);
    }
    space.elements.push_back(nodes);
  }
  space.clamped.assign(space.nodes, 0);
  for (const auto& face : mesh.bonded) {
    for (int k = 0; k < 3; ++k) {
      space.clamped[face[k]] = 1;
      space.clamped[space.middle(face[k], face[(k + 1) % 3])] = 1;
    }
  }
  space.displacement.assign(space.nodes, -1);
  number_pressures(group, space);
  space.pressure.assign(space.pressure_vertex.size(), -1);
  for (int node = 0; node < space.nodes; ++node) {
    if (!space.clamped[node]) {
      space.displacement[node] = space.unknowns;
      space.unknowns += 3;
    }
    if (node < space.vertices) {
      space.pressure[node] = space.unknowns++;
    }
  }
  for (std::size_t k = space.vertices; k < space.pressure.size(); ++k) {
    space.pressure[k] = space.unknowns++;
  }
  return space;
}

void require_sound(const TetMesh& mesh) {
  const std::string fault = fault_of(mesh);
  if (!fault.empty()) {
    fail("the gel's mesh can't be used: {}", fault);
  }
}

void require_materials(const TetMesh& mesh, std::span<const ElasticMaterial> materials) {
  for (const ElasticMaterial& material : materials) {
    check(material);
  }
  if (static_cast<int>(materials.size()) < region_count(mesh)) {
    fail("the gel's mesh has {} regions, but {} materials are given", region_count(mesh), materials.size());
  }
}

bool alike(const ElasticMaterial& a, const ElasticMaterial& b) {
  return a.youngs_modulus == b.youngs_modulus && a.poisson_ratio == b.poisson_ratio;
}

}  // namespace

TaylorHoodSpace make_space(const TetMesh& mesh) {
  require_sound(mesh);
  std::vector<int> group(region_count(mesh));
  std::iota(group.begin(), group.end(), 0);
  return space_of(mesh, group);
}

TaylorHoodSpace make_space(const TetMesh& mesh, std::span<const ElasticMaterial> materials) {
  require_sound(mesh);
  require_materials(mesh, materials);
  std::vector<int> group(region_count(mesh));
  for (std::size_t r = 0; r < group.size(); ++r) {
    const auto first = std::find_if(materials.begin(), materials.end(),
                                    [&](const ElasticMaterial& other) { return alike(other, materials[r]); });
    group[r] = static_cast<int>(first - materials.begin());
  }
  return space_of(mesh, group);
}

Scales make_scales(const TetMesh& mesh, std::span<const ElasticMaterial> materials) {
  require_materials(mesh, materials);
  double total = 0.0;
  std::vector<double> part(materials.size(), 0.0);
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    const double size = volume(mesh, mesh.tetrahedra[e]);
    total += size;
    part[mesh.region_of(e)] += size;
  }
  Scales scales;
  scales.length = std::cbrt(total);
  scales.stress = shear_modulus(materials[0]);
  if (!std::all_of(materials.begin(), materials.end(),
                   [&](const ElasticMaterial& material) { return shear_modulus(material) == scales.stress; })) {
    double logarithm = 0.0;
    for (std::size_t r = 0; r < materials.size(); ++r) {
      logarithm += part[r] / total * std::log(shear_modulus(materials[r]));
    }
    scales.stress = std::exp(logarithm);
  }
  for (const ElasticMaterial& material : materials) {
    const double ratio = lame_ratio(material);
    Scales::Region region;
    region.shear = shear_modulus(material) / scales.stress;
    // Of the order of G is p beyond lambda = G; below, sqrt(lambda/G) makes the pressure's block -1. Beside a stiffer
    // material the square root of its G keeps the blocks' sizes alike.
    region.pressure_scale = std::sqrt(region.shear * std::min(ratio, 1.0));
    region.compressibility = ratio <= 1.0 ? 1.0 : 1.0 / ratio;
    scales.regions.push_back(region);
  }
  return scales;
}

Scales make_scales(const TetMesh& mesh, const ElasticMaterial& material) {
  return make_scales(mesh, std::vector<ElasticMaterial>(region_count(mesh), material));
}

}  // namespace touchstone::fem
