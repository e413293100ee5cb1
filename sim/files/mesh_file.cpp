#include "sim/files/mesh_file.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/input_file.h"
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

/// What a file is by its first bytes, where its name says something else; "" where they don't tell.
std::string_view kind_of(std::string_view first) {
  constexpr std::pair<std::string_view, std::string_view> kKinds[] = {
      {"PK\x03\x04", "a ZIP archive (as 3MF is)"},
      {"\x1f\x8b", "packed by gzip"},
      {"7z\xbc\xaf", "a 7z archive"},
      {"<", "a page or a file of XML"},
      {"version https://git-lfs", "a pointer of Git LFS, in the place of the file itself"},
      {"ISO-10303-21", "a STEP file"},
      {"Kaydara FBX", "an FBX file"},
      {"\xff\xfe", "text in UTF-16; save it as UTF-8"},
      {"\xfe\xff", "text in UTF-16; save it as UTF-8"},
  };
  for (const auto& [begin, kind] : kKinds) {
    if (first.starts_with(begin)) return kind;
  }
  return "";
}

void refuse_other_kind(const std::filesystem::path& path, bool plain) {
  std::string first(32, '\0');
  InputFile file(path);
  first.resize(file.read(first.data(), first.size()));
  const std::string_view kind =
      plain && first.starts_with("glTF") ? "binary glTF; its name must end in .glb" : kind_of(first);
  if (!kind.empty()) fail("{}: isn't what its name says: it is {}", path.string(), kind);
}

}  // namespace

double usual_mm_per_unit(const std::filesystem::path& path) {
  return plain_format_of(path) ? 1.0 : 1000.0;
}

TriangleMesh read_mesh_file(const std::filesystem::path& path, double mm_per_unit) {
  const std::optional<PlainMeshFormat> plain = plain_format_of(path);
  refuse_other_kind(path, plain.has_value());
  return plain ? read_plain_mesh(path, *plain, mm_per_unit) : read_gltf_mesh(path, mm_per_unit);
}

}  // namespace touchstone::sim
