#include "core/triangle_mesh.h"

namespace touchstone {

double enclosed_volume(const TriangleMesh& mesh) {
  double six_volumes = 0.0;
  for (const auto& t : mesh.triangles) {
    six_volumes += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
  }
  return six_volumes / 6.0;
}

}  // namespace touchstone
