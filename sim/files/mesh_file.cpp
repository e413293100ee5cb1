#include "sim/files/mesh_file.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <string>

#include "core/error.h"
#include "sim/files/gltf_mesh.h"
#include "sim/files/plain_mesh.h"

namespace touchstone::sim {
namespace {

/// None: glTF.
std::optional<PlainMeshFormat> plain_format_of(const std::filesystem::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  if (suffix == ".glb" || suffix == ".gltf") return std::nullopt;
  if (suffix == ".stl") return PlainMeshFormat::stl;
  if (suffix == ".obj") return PlainMeshFormat::obj;
  if (suffix == ".ply") return PlainMeshFormat::ply;
  fail("{}: no mesh is read from files that end in '{}'; known are .glb, .gltf, .stl, .obj and .ply", path.string(),
       path.extension().string());
}

}  // namespace

double usual_mm_per_unit(const std::filesystem::path& path) {
  return plain_format_of(path) ? 1.0 : 1000.0;
}

TriangleMesh read_mesh_file(const std::filesystem::path& path, double mm_per_unit) {
  const std::optional<PlainMeshFormat> plain = plain_format_of(path);
  return plain ? read_plain_mesh(path, *plain, mm_per_unit) : read_gltf_mesh(path, mm_per_unit);
}

}  // namespace touchstone::sim
