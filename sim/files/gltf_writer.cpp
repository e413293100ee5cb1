#include "sim/files/gltf_writer.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/whole_file.h"

namespace touchstone::sim {
namespace {

using nlohmann::ordered_json;

// Numbers of the glTF 2.0 specification.
constexpr int kFloat = 5126;
constexpr int kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr std::uint32_t kMagic = 0x46546C67;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;
constexpr std::size_t kMostBytes = std::numeric_limits<std::uint32_t>::max();
constexpr double kMetresPerMm = 1e-3;

template <typename T>
void append(std::string& bytes, T value) {  // glTF is little-endian, as are the processors that Embree runs on
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

ordered_json numbers(const Eigen::Vector3f& v) {
  return ordered_json::array({v.x(), v.y(), v.z()});
}

/// glTF's y-up axes from the gel's: (x, y, z) -> (x, z, -y).
Eigen::Matrix3d y_up_from_gel() {
  Eigen::Matrix3d turn;
  turn << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return turn;
}

/// Column by column, as glTF has matrices.
ordered_json matrix(const Eigen::Matrix3d& linear, const Eigen::Vector3d& translation) {
  ordered_json out = ordered_json::array();
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) out.push_back(linear(row, column) + 0.0);
    out.push_back(0.0);
  }
  for (int row = 0; row < 3; ++row) out.push_back(translation[row]);
  out.push_back(1.0);
  return out;
}

class Glb {
 public:
  Glb() {
    json_["asset"] = {{"version", "2.0"}, {"generator", "Touchstone"}};
    json_["scene"] = 0;
    ordered_json scene = ordered_json::object();
    scene["nodes"] = ordered_json::array({0});
    json_["scenes"].push_back(std::move(scene));
    json_["nodes"].push_back(
        {{"name", "gel frame, mm"}, {"matrix", matrix(kMetresPerMm * y_up_from_gel(), Eigen::Vector3d::Zero())}});
  }

  void add(const GltfPart& part) {
    if (part.mesh.triangles.empty() || part.places.empty()) return;
    const int positions = add_positions(part);
    const int corners = add_corners(part.mesh);
    ordered_json material = {{"name", part.name},
                             {"doubleSided", true},
                             {"pbrMetallicRoughness",
                              {{"baseColorFactor", {part.colour.x(), part.colour.y(), part.colour.z(), part.opacity}},
                               {"metallicFactor", part.metal ? 1.0 : 0.0},
                               {"roughnessFactor", part.metal ? 0.3 : 0.9}}}};
    if (part.opacity < 1.0) material["alphaMode"] = "BLEND";
    const auto mesh = json_["meshes"].size();
    ordered_json primitive = ordered_json::object();
    primitive["attributes"]["POSITION"] = positions;
    primitive["indices"] = corners;
    primitive["material"] = json_["materials"].size();
    ordered_json one = ordered_json::object();
    one["name"] = part.name;
    one["primitives"].push_back(std::move(primitive));
    json_["meshes"].push_back(std::move(one));
    json_["materials"].push_back(std::move(material));
    for (std::size_t i = 0; i < part.places.size(); ++i) {
      ordered_json node = {{"name", part.places.size() == 1 ? part.name : fmt::format("{} {}", part.name, i)},
                           {"mesh", mesh}};
      if (part.places[i] != Eigen::Vector3d::Zero()) node["translation"] = numbers(part.places[i].cast<float>());
      json_["nodes"][0]["children"].push_back(json_["nodes"].size());
      json_["nodes"].push_back(std::move(node));
    }
  }

  void add(const GltfCamera& camera) {
    // glTF's cameras look along -z with +y up.
    Eigen::Matrix3d turned = camera.gel_from_camera.rotation;
    turned.col(1) *= -1.0;
    turned.col(2) *= -1.0;
    const ordered_json node = {
        {"name", "camera"},
        {"camera", json_["cameras"].size()},
        {"matrix",
         matrix(y_up_from_gel() * turned, kMetresPerMm * (y_up_from_gel() * camera.gel_from_camera.translation))}};
    json_["cameras"].push_back(
        {{"name", "camera"},
         {"type", "perspective"},
         {"perspective", {{"aspectRatio", camera.aspect}, {"yfov", camera.vertical_view}, {"znear", 1e-4}}}});
    json_["scenes"][0]["nodes"].push_back(json_["nodes"].size());
    json_["nodes"].push_back(node);
  }

  std::string bytes() {
    if (!binary_.empty()) {
      ordered_json buffer = ordered_json::object();
      buffer["byteLength"] = binary_.size();
      json_["buffers"].push_back(std::move(buffer));
    }
    std::string text = json_.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::size_t total = 12 + 8 + text.size() + (binary_.empty() ? 0 : 8 + binary_.size());
    if (total > kMostBytes) fail("glTF: {} bytes; a .glb can have {}", total, kMostBytes);
    std::string out;
    out.reserve(total);
    append(out, kMagic);
    append(out, std::uint32_t{2});
    append(out, static_cast<std::uint32_t>(total));
    append(out, static_cast<std::uint32_t>(text.size()));
    append(out, kJsonChunk);
    out += text;
    if (binary_.empty()) return out;
    append(out, static_cast<std::uint32_t>(binary_.size()));
    append(out, kBinaryChunk);
    out += binary_;
    return out;
  }

 private:
  /// An accessor of all that was appended to the buffer since `begin`.
  int accessor(std::size_t begin, int target, ordered_json entry) {
    json_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", binary_.size() - begin}, {"target", target}});
    entry["bufferView"] = json_["bufferViews"].size() - 1;
    json_["accessors"].push_back(std::move(entry));
    return static_cast<int>(json_["accessors"].size()) - 1;
  }

  int add_positions(const GltfPart& part) {
    const std::size_t begin = binary_.size();
    Eigen::Vector3f low = part.mesh.vertices.front().cast<float>();
    Eigen::Vector3f high = low;
    for (const Eigen::Vector3d& vertex : part.mesh.vertices) {
      const Eigen::Vector3f stored = vertex.cast<float>();
      if (!stored.allFinite()) fail("glTF: '{}' has a vertex that isn't finite", part.name);
      low = low.cwiseMin(stored);
      high = high.cwiseMax(stored);
      for (int axis = 0; axis < 3; ++axis) append(binary_, stored[axis]);
    }
    return accessor(begin, kArrayBuffer,
                    {{"componentType", kFloat},
                     {"count", part.mesh.vertices.size()},
                     {"type", "VEC3"},
                     {"min", numbers(low)},
                     {"max", numbers(high)}});
  }

  int add_corners(const TriangleMesh& mesh) {
    const std::size_t begin = binary_.size();
    for (const auto& triangle : mesh.triangles) {
      for (const int corner : triangle) append(binary_, static_cast<std::uint32_t>(corner));
    }
    return accessor(begin, kElementArrayBuffer,
                    {{"componentType", kUnsignedInt}, {"count", 3 * mesh.triangles.size()}, {"type", "SCALAR"}});
  }

  ordered_json json_;
  std::string binary_;
};

}  // namespace

std::string glb_bytes(const std::vector<GltfPart>& parts, const std::vector<GltfCamera>& cameras) {
  Glb glb;
  for (const GltfPart& part : parts) glb.add(part);
  for (const GltfCamera& camera : cameras) glb.add(camera);
  return glb.bytes();
}

void write_glb(const std::filesystem::path& path, const std::vector<GltfPart>& parts,
               const std::vector<GltfCamera>& cameras) {
  write_whole_file(path, glb_bytes(parts, cameras));
}

}  // namespace touchstone::sim
