#include "sim/files/plain_mesh.h"

#include <sys/resource.h>
#include <unistd.h>

#include <assimp/MemoryIOWrapper.h>
#include <assimp/scene.h>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <new>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/isolated_call.h"
#include "core/short_text.h"
#include "core/text_file.h"
#include "core/whole_file.h"
#include "sim/files/closed_solid.h"
#include "sim/files/polygon_triangles.h"

namespace touchstone::sim {
namespace {

constexpr std::size_t kMegabyte = 1 << 20;
// What the library may take for a file. Of 500,000 triangles, 12 to 150 megabytes, it took up to 0.03 s and 7 megabytes
// a megabyte, both for OBJ.
constexpr std::size_t kMemory = 1024 * kMegabyte, kMemoryPerByte = 100;
constexpr int kSeconds = 10, kSecondsPerMegabyte = 1;
constexpr unsigned kMostCorners = 1000;  // of a face
constexpr std::size_t kLongestReason = 100;
constexpr int kWaitPerSecond = 20;  // other work may hold the cores

/// For people; the library takes it as a suffix, too, as capital letters don't matter to it.
const char* name_of(PlainMeshFormat format) {
  switch (format) {
    case PlainMeshFormat::stl:
      return "STL";
    case PlainMeshFormat::obj:
      return "OBJ";
    case PlainMeshFormat::ply:
      return "PLY";
  }
  return "";
}

/// The library reads "1,5" as 1, and says of a text that was cut off what it thinks of its last word.
void check_stl_text(std::string_view text) {
  constexpr std::string_view kVertex = "vertex", kBlanks = " \t\r\n";
  const std::size_t end = text.rfind("endsolid");
  const std::size_t last = std::max(text.rfind("endfacet"), text.rfind(kVertex));
  const bool any = text.find("facet") != std::string_view::npos;
  if (any && (end == std::string_view::npos || last == std::string_view::npos || end < last)) {
    fail("is cut off: its text has no 'endsolid' behind its last facet");
  }
  int number = 0;
  for (std::size_t at = text.find(kVertex); at != std::string_view::npos; at = text.find(kVertex, at)) {
    const std::size_t before = text.find_last_not_of(" \t", at - 1);        // the text begins with "solid"
    const bool begins_line = text[before] == '\n' || text[before] == '\r';  // elsewhere it may be in a solid's name
    at += kVertex.size();
    if (!begins_line || at >= text.size() || kBlanks.find(text[at]) == std::string_view::npos) continue;
    ++number;
    for (int axis = 0; axis < 3; ++axis) {
      at = std::min(text.find_first_not_of(kBlanks, at), text.size());
      const std::size_t next = std::min(text.find_first_of(kBlanks, at), text.size());
      const std::string_view cell = text.substr(at, next - at);
      const std::string_view digits = cell.substr(cell.starts_with('+') ? 1 : 0);
      double value = 0.0;
      const auto [to, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
      if (error == std::errc::invalid_argument || to != digits.data() + digits.size()) {
        fail("vertex {} of its text has '{}' in the place of a number", number, short_text(cell));
      }
      at = next;
    }
  }
}

/// A text as the library wants it, in small letters and without blanks before it; a binary file as it is. The library
/// takes a file for a binary one by its size modulo 2^32, and says little of one that was cut off.
std::string checked_stl(const std::string& content) {
  constexpr std::size_t kCountAt = 80, kHeader = 84, kTriangle = 50;
  // Some binary files begin with "solid", as texts do, but no text has a zero byte.
  if (content.find('\0') == std::string::npos) {
    std::string text = content.substr(std::min(content.find_first_not_of(" \t\r\n"), content.size()));
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
    if (!text.starts_with("solid")) fail("isn't an STL file: it is a text that doesn't begin with 'solid'");
    check_stl_text(text);
    return text;
  }
  if (content.size() < kHeader) fail("isn't an STL file: {} bytes are no header of a binary one", content.size());
  std::uint32_t count = 0;
  std::memcpy(&count, content.data() + kCountAt, sizeof count);
  const std::uint64_t size = kHeader + kTriangle * std::uint64_t{count};
  if (size != content.size()) {
    fail("has {} bytes, and the {} triangles that its header says take {}", content.size(), count, size);
  }
  return content;
}

/// The library never comes back from a PLY file whose header has no end.
void check_ply_header(std::string_view content) {
  if (!content.starts_with("ply")) fail("isn't a PLY file: it doesn't begin with 'ply'");
  if (content.find("\nend_header") == std::string_view::npos &&
      content.find("\rend_header") == std::string_view::npos) {
    fail("isn't a PLY file: its header has no line 'end_header'");
  }
}

/// The library makes faces up where a PLY file ends too early.
void check_ply_counts(const std::string& content, const aiScene& scene) {
  std::uint64_t vertices = 0, faces = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    vertices += mesh.mNumVertices;
    faces += mesh.mNumFaces;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices < 3) fail("face {} has {} corners", f, mesh.mFaces[f].mNumIndices);
    }
  }
  std::istringstream header(content.substr(0, content.find("end_header")));
  for (std::string line; std::getline(header, line);) {
    std::istringstream words(line);
    std::string element, name;
    std::uint64_t count = 0;
    if (!(words >> element >> name >> count) || element != "element") continue;
    const std::uint64_t found = name == "vertex" ? vertices : name == "face" ? faces : count;
    if (found != count) fail("its header says {} of the element {}, and {} could be read", count, name, found);
  }
}

void check_faces(const aiMesh& mesh) {
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D& p = mesh.mVertices[v];
    if (!Eigen::Vector3f(p.x, p.y, p.z).allFinite()) fail("vertex {} isn't finite", v);
  }
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    for (unsigned k = 0; k < face.mNumIndices; ++k) {
      if (face.mIndices[k] < mesh.mNumVertices) continue;
      fail("face {} names vertex {}, but there are {}", f, face.mIndices[k], mesh.mNumVertices);
    }
  }
}

/// What comes back from the other process: the counts, the vertices, the triangles.
struct Counts {
  std::uint64_t vertices = 0, triangles = 0;
};

std::vector<std::array<int, 3>> cut(const aiMesh& mesh, unsigned index) {
  const aiFace& face = mesh.mFaces[index];
  if (face.mNumIndices == 3) return {{0, 1, 2}};
  if (face.mNumIndices > kMostCorners) {
    fail("face {} has {} corners; at most {} are read", index, face.mNumIndices, kMostCorners);
  }
  std::vector<Eigen::Vector3d> corners;
  for (unsigned k = 0; k < face.mNumIndices; ++k) {
    const aiVector3D& p = mesh.mVertices[face.mIndices[k]];
    corners.emplace_back(p.x, p.y, p.z);
  }
  std::vector<std::array<int, 3>> triangles = polygon_triangles(corners);
  if (triangles.empty()) fail("face {} of {} corners crosses itself or has no area", index, face.mNumIndices);
  return triangles;
}

std::string bytes_of(const aiScene& scene) {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<int, 3>> triangles;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    const auto base = static_cast<int>(vertices.size());
    if (vertices.size() + mesh.mNumVertices > 3 * kMostTriangles) fail("has more than {} vertices", 3 * kMostTriangles);
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      vertices.emplace_back(p.x, p.y, p.z);
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices < 3) continue;  // a point or a line
      for (const auto& [i, j, k] : cut(mesh, f)) {
        triangles.push_back({base + static_cast<int>(face.mIndices[i]), base + static_cast<int>(face.mIndices[j]),
                             base + static_cast<int>(face.mIndices[k])});
      }
    }
    if (triangles.size() > kMostTriangles) fail("has more than {} triangles", kMostTriangles);
  }
  const Counts counts{vertices.size(), triangles.size()};
  std::string bytes;
  const auto add = [&](const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); };
  add(&counts, sizeof counts);
  add(vertices.data(), sizeof(Eigen::Vector3f) * vertices.size());
  add(triangles.data(), sizeof(std::array<int, 3>) * triangles.size());
  return bytes;
}

/// Read by the library, without any of its steps that change a mesh: they repair what should be refused, and cut faces
/// into triangles without area.
std::string read_by_assimp(const std::string& content, PlainMeshFormat format) {
  Assimp::Importer importer;
  // It knows of this one file only, so that materials' files aren't opened.
  importer.SetIOHandler(
      new Assimp::MemoryIOSystem(reinterpret_cast<const std::uint8_t*>(content.data()), content.size(), nullptr));
  const std::string name = std::string(AI_MEMORYIO_MAGIC_FILENAME) + "." + name_of(format);
  const auto refuse = [&] {
    std::string why = importer.GetErrorString();
    if (const std::size_t at = why.find(name); at != std::string::npos) why.replace(at, name.size(), "it");
    if (why == std::bad_alloc().what()) why = "it says that it holds more than it can";
    if (why.size() > kLongestReason) why.replace(kLongestReason, why.size(), "...");  // it may quote all of the file
    fail("isn't a readable {} file ({})", name_of(format), why.empty() ? "damaged" : why);
  };
  const aiScene* const scene = importer.ReadFile(name, 0);
  if (scene == nullptr) refuse();
  if (format == PlainMeshFormat::ply) check_ply_counts(content, *scene);
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) check_faces(*scene->mMeshes[m]);
  return bytes_of(*scene);
}

/// In a process of its own: it may take so much more memory than it has.
void limit_memory(std::size_t more) {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const auto limit = static_cast<rlim_t>(pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + more);
  const rlimit memory{limit, limit};
  setrlimit(RLIMIT_AS, &memory);
}

constexpr char kMesh = 'M', kRefused = 'R';

TriangleMesh mesh_of(std::string_view bytes, double mm_per_unit) {
  const auto take = [&](void* data, std::size_t size) {
    TS_ASSERT(size <= bytes.size());
    std::copy_n(bytes.data(), size, static_cast<char*>(data));  // also of nothing to nowhere
    bytes.remove_prefix(size);
  };
  Counts counts;
  take(&counts, sizeof counts);
  TriangleMesh mesh;
  mesh.vertices.resize(counts.vertices);
  mesh.triangles.resize(counts.triangles);
  for (Eigen::Vector3d& vertex : mesh.vertices) {
    Eigen::Vector3f point;
    take(point.data(), sizeof point);
    vertex = mm_per_unit * point.cast<double>();
  }
  take(mesh.triangles.data(), sizeof(std::array<int, 3>) * mesh.triangles.size());
  return mesh;
}

}  // namespace

TriangleMesh read_plain_mesh(const std::filesystem::path& path, PlainMeshFormat format, double mm_per_unit) {
  check_unit(path, mm_per_unit);
  std::string content = read_whole_file(path);
  content.erase(0, byte_order_mark(content));
  if (content.empty()) fail("{}: is empty", path.string());
  std::string answer;
  try {
    const int seconds = kSeconds + kSecondsPerMegabyte * static_cast<int>(content.size() / kMegabyte);
    answer = isolated_call(
        [&] {
          try {
            if (format == PlainMeshFormat::ply) check_ply_header(content);
            limit_memory(kMemory + kMemoryPerByte * content.size());
            return kMesh + read_by_assimp(format == PlainMeshFormat::stl ? checked_stl(content) : content, format);
          } catch (const Error& error) {
            return kRefused + std::string(error.what());
          }
        },
        seconds, kWaitPerSecond * seconds);
  } catch (const Error& error) {
    fail("{}: isn't a readable {} file, it is damaged or cut off (reading it failed: {})", path.string(),
         name_of(format), error.what());
  }
  if (answer.front() == kRefused) fail("{}: {}", path.string(), answer.substr(1));
  return closed_solid(mesh_of(std::string_view(answer).substr(1), mm_per_unit), path);
}

}  // namespace touchstone::sim
