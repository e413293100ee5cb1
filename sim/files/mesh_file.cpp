#include "sim/files/mesh_file.h"

#include <algorithm>
#include <cctype>
#include <string>

#include "core/error.h"
#include "sim/files/gltf_mesh.h"
#include "sim/files/plain_mesh.h"

namespace touchstone::sim {
namespace {

enum class MeshFormat { gltf, stl, obj, ply };

MeshFormat format_of(const std::filesystem::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  if (suffix == ".glb" || suffix == ".gltf") return MeshFormat::gltf;
  if (suffix == ".stl") return MeshFormat::stl;
  if (suffix == ".obj") return MeshFormat::obj;
  if (suffix == ".ply") return MeshFormat::ply;
  fail("{}: no mesh is read from files that end in '{}'; known are .glb, .gltf, .stl, .obj and .ply", path.string(),
       path.extension().string());
}

}  // namespace

double usual_mm_per_unit(const std::filesystem::path& path) {
  return format_of(path) == MeshFormat::gltf ? 1000.0 : 1.0;
}

TriangleMesh read_mesh_file(const std::filesystem::path& path, double mm_per_unit) {
  switch (format_of(path)) {
    case MeshFormat::gltf:
      return read_gltf_mesh(path, mm_per_unit);
    case MeshFormat::stl:
      return read_plain_mesh(path, PlainMeshFormat::stl, mm_per_unit);
    case MeshFormat::obj:
      return read_plain_mesh(path, PlainMeshFormat::obj, mm_per_unit);
    case MeshFormat::ply:
      return read_plain_mesh(path, PlainMeshFormat::ply, mm_per_unit);
  }
  TS_ASSERT(false);
  return {};
}

}  // namespace touchstone::sim
