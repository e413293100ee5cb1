#include "fem/mesh/tet_mesh.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

namespace touchstone::fem {
namespace {

/// Faces of a tetrahedron (a, b, c, d) of positive volume, normals out.
constexpr std::array<std::array<int, 3>, 4> kFaces = {{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};

using Face = std::array<int, 3>;

Face sorted(Face face) {
  std::sort(face.begin(), face.end());
  return face;
}

/// +1 for an even permutation of the sorted triple, -1 for an odd one.
int sense(const Face& face) {
  return ((face[0] < face[1]) == (face[1] < face[2])) == (face[0] < face[2]) ? 1 : -1;
}

struct FaceHash {
  std::size_t operator()(const Face& face) const {
    std::size_t hash = 0;
    for (const int vertex : face) {
      hash = (hash ^ static_cast<std::size_t>(vertex)) * 0x9E3779B97F4A7C15ull;
      hash ^= hash >> 29;
    }
    return hash;
  }
};

/// How many tetrahedra have a face.
std::unordered_map<Face, int, FaceHash> face_uses(const TetMesh& mesh) {
  std::unordered_map<Face, int, FaceHash> uses;
  uses.reserve(mesh.tetrahedra.size() * 3);
  for (const auto& tetrahedron : mesh.tetrahedra) {
    for (const auto& local : kFaces) {
      ++uses[sorted({tetrahedron[local[0]], tetrahedron[local[1]], tetrahedron[local[2]]})];
    }
  }
  return uses;
}

bool in_range(const TetMesh& mesh, int vertex) {
  return vertex >= 0 && vertex < static_cast<int>(mesh.vertices.size());
}

std::string fault_of_tetrahedra(const TetMesh& mesh) {
  if (mesh.tetrahedra.empty()) {
    return "there are no tetrahedra";
  }
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!mesh.vertices[i].allFinite()) {
      return fmt::format("vertex {} isn't finite", i);
    }
  }
  std::vector<bool> used(mesh.vertices.size(), false);
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    const auto& tetrahedron = mesh.tetrahedra[e];
    double longest = 0.0;
    for (const int vertex : tetrahedron) {
      if (!in_range(mesh, vertex)) {
        return fmt::format("tetrahedron {} names vertex {} of {}", e, vertex, mesh.vertices.size());
      }
      used[vertex] = true;
      longest = std::max(longest, (mesh.vertices[vertex] - mesh.vertices[tetrahedron[0]]).norm());
    }
    if (!(volume(mesh, tetrahedron) > 1e-12 * longest * longest * longest)) {
      return fmt::format("tetrahedron {} has a volume of {} mm^3; it must be above zero", e, volume(mesh, tetrahedron));
    }
  }
  if (!mesh.region.empty() && mesh.region.size() != mesh.tetrahedra.size()) {
    return fmt::format("{} tetrahedra have {} regions", mesh.tetrahedra.size(), mesh.region.size());
  }
  const auto negative = std::find_if(mesh.region.begin(), mesh.region.end(), [](int region) { return region < 0; });
  if (negative != mesh.region.end()) {
    return fmt::format("tetrahedron {} is of region {}; regions count from 0", negative - mesh.region.begin(),
                       *negative);
  }
  const auto lonely = std::find(used.begin(), used.end(), false);
  if (lonely != used.end()) {
    return fmt::format("vertex {} belongs to no tetrahedron", lonely - used.begin());
  }
  return {};
}

std::string fault_of_faces(const TetMesh& mesh) {
  const auto uses = face_uses(mesh);
  for (const auto& [face, count] : uses) {
    if (count > 2) {
      return fmt::format("the face of vertices {}, {}, {} belongs to {} tetrahedra", face[0], face[1], face[2], count);
    }
  }
  std::unordered_map<Face, int, FaceHash> senses;
  for (const Face& face : boundary_faces(mesh)) {
    senses[sorted(face)] = sense(face);
  }
  if (mesh.outer.empty()) {
    return "there is no outer surface";
  }
  for (const auto* faces : {&mesh.outer, &mesh.bonded}) {
    const char* name = faces == &mesh.outer ? "outer" : "bonded";
    for (std::size_t t = 0; t < faces->size(); ++t) {
      const Face& face = (*faces)[t];
      const auto found = senses.find(sorted(face));
      if (found == senses.end()) {
        return fmt::format("{} triangle {} isn't a free face of a tetrahedron, or is named twice", name, t);
      }
      if (faces == &mesh.outer && found->second != sense(face)) {
        return fmt::format("the normal of outer triangle {} points into the solid", t);
      }
      senses.erase(found);
    }
  }
  return {};
}

std::string fault_of_bond(const TetMesh& mesh) {
  std::vector<int> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int vertex) {
    while (parent[vertex] != vertex) {
      vertex = parent[vertex] = parent[parent[vertex]];
    }
    return vertex;
  };
  for (const auto& tetrahedron : mesh.tetrahedra) {
    for (int k = 1; k < 4; ++k) {
      parent[root(tetrahedron[k])] = root(tetrahedron[0]);
    }
  }
  std::vector<bool> bonded(mesh.vertices.size(), false);
  for (const Face& face : mesh.bonded) {
    bonded[root(face[0])] = true;
  }
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!bonded[root(static_cast<int>(i))]) {
      return fmt::format("the piece with vertex {} is bonded nowhere: it could fly away", i);
    }
  }
  return {};
}

}  // namespace

int region_count(const TetMesh& mesh) {
  const auto largest = std::max_element(mesh.region.begin(), mesh.region.end());
  return largest == mesh.region.end() ? 1 : *largest + 1;
}

std::vector<std::array<int, 3>> boundary_faces(const TetMesh& mesh) {
  const auto uses = face_uses(mesh);
  std::vector<Face> faces;
  for (const auto& tetrahedron : mesh.tetrahedra) {
    for (const auto& local : kFaces) {
      const Face face = {tetrahedron[local[0]], tetrahedron[local[1]], tetrahedron[local[2]]};
      if (uses.at(sorted(face)) == 1) {
        faces.push_back(face);
      }
    }
  }
  return faces;
}

std::string fault_of(const TetMesh& mesh) {
  std::string fault = fault_of_tetrahedra(mesh);
  if (fault.empty()) {
    fault = fault_of_faces(mesh);
  }
  if (fault.empty()) {
    fault = fault_of_bond(mesh);
  }
  return fault;
}

double volume(const TetMesh& mesh, const std::array<int, 4>& tetrahedron) {
  const Eigen::Vector3d& a = mesh.vertices[tetrahedron[0]];
  const Eigen::Vector3d ab = mesh.vertices[tetrahedron[1]] - a;
  const Eigen::Vector3d ac = mesh.vertices[tetrahedron[2]] - a;
  const Eigen::Vector3d ad = mesh.vertices[tetrahedron[3]] - a;
  return ab.cross(ac).dot(ad) / 6.0;
}

double smallest_dihedral_angle(const TetMesh& mesh) {
  double largest_cosine = -1.0;
  for (const auto& tetrahedron : mesh.tetrahedra) {
    std::array<Eigen::Vector3d, 4> normals;
    for (int f = 0; f < 4; ++f) {
      const Eigen::Vector3d& a = mesh.vertices[tetrahedron[kFaces[f][0]]];
      normals[f] = (mesh.vertices[tetrahedron[kFaces[f][1]]] - a)
                       .cross(mesh.vertices[tetrahedron[kFaces[f][2]]] - a)
                       .normalized();
    }
    for (int f = 0; f < 4; ++f) {
      for (int g = 0; g < f; ++g) {
        largest_cosine = std::max(largest_cosine, -normals[f].dot(normals[g]));
      }
    }
  }
  return std::acos(std::clamp(largest_cosine, -1.0, 1.0));
}

}  // namespace touchstone::fem
