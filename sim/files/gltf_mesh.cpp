#include "sim/files/gltf_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string_view>

// Only the declarations: pictures are never decoded here, so no image library is asked for.
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include "core/error.h"
#include "core/json_depth.h"
#include "core/nearest_name.h"
#include "core/short_text.h"
#include "core/whole_file.h"
#include "sim/files/closed_solid.h"

namespace touchstone::sim {
namespace {

constexpr std::size_t kGlbHeader = 20;  // with that of its first chunk
constexpr const char* kMeshopt = "EXT_meshopt_compression";

class GltfSolid {
 public:
  GltfSolid(const std::filesystem::path& path, double mm_per_unit) : name_(path.string()) {
    check_unit(path, mm_per_unit);
    load(path);
    visited_.assign(model_.nodes.size(), false);
    Eigen::Affine3d scale = Eigen::Affine3d::Identity();
    scale.scale(mm_per_unit);
    for (const int root : roots()) add_node(root, scale);
  }

  const TriangleMesh& mesh() const { return mesh_; }

  /// What the name of triangle `index`'s material or mesh says it is.
  fem::FaceKind kind(int index) const {
    static const std::vector<std::string> known = {"side", "outer", "bonded"};  // as fem::FaceKind counts
    const auto [material, mesh] = origin_[static_cast<std::size_t>(index)];
    if (material >= static_cast<int>(model_.materials.size())) {
      refuse("mesh {} names material {}, which isn't there", mesh, material);
    }
    const std::string name = material >= 0 ? model_.materials[static_cast<std::size_t>(material)].name : "";
    const std::string& label = name.empty() ? model_.meshes[static_cast<std::size_t>(mesh)].name : name;
    const auto found = std::find(known.begin(), known.end(), label);
    if (found != known.end()) return static_cast<fem::FaceKind>(found - known.begin());
    if (!name.empty()) {
      refuse("material '{}' isn't a face of a gel; known are outer, bonded and side{}", name,
             did_you_mean(name, known));
    }
    return fem::FaceKind::side;
  }

 private:
  template <typename... Args>
  [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
    fail("{}: {}", name_, fmt::format(format, std::forward<Args>(args)...));
  }

  /// A file's JSON: of a binary one, the first chunk behind 12 bytes of header and 8 of its own.
  static std::string_view json_of(std::string_view content) {
    constexpr std::size_t kLengthAt = 12, kJsonAt = kGlbHeader;
    if (!content.starts_with("glTF") || content.size() < kJsonAt) return content;
    std::uint32_t length = 0;
    std::memcpy(&length, content.data() + kLengthAt, sizeof length);
    return content.substr(kJsonAt, length);
  }

  void load(const std::filesystem::path& path) {
    const std::string content = read_whole_file(path);
    if (content.size() > std::numeric_limits<unsigned>::max()) refuse("is larger than 4 GB");
    if (const int depth = deepest_json(json_of(content)); depth > kDeepestJson) {
      refuse("has lists and maps {} deep in each other; at most {} are read", depth, kDeepestJson);
    }
    refuse_foreign(content);
    const auto size = static_cast<unsigned>(content.size());
    tinygltf::TinyGLTF loader;
    loader.SetImageLoader([](tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*,
                             int, void*) { return true; },
                          nullptr);
    tinygltf::FsCallbacks files = {&tinygltf::FileExists, &tinygltf::ExpandFilePath, &tinygltf::ReadWholeFile,
                                   &tinygltf::WriteWholeFile, nullptr};
    // A buffer's or a picture's name may be that of a pipe, which would keep us waiting, or of an endless device.
    files.FileExists = [](const std::string& file, void*) {
      std::error_code ignored;
      return std::filesystem::is_regular_file(file, ignored);
    };
    loader.SetFsCallbacks(files);
    std::string error;
    std::string warning;
    bool read = false;
    try {
      const std::string folder = path.parent_path().string();
      read = content.starts_with("glTF")
                 ? loader.LoadBinaryFromMemory(&model_, &error, &warning,
                                               reinterpret_cast<const unsigned char*>(content.data()), size, folder)
                 : loader.LoadASCIIFromString(&model_, &error, &warning, content.data(), size, folder);
    } catch (const std::exception& exception) {  // of the JSON parser
      error = exception.what();
    }
    if (!read) {
      while (!error.empty() && error.back() == '\n') error.pop_back();
      std::replace(error.begin(), error.end(), '\n', ' ');
      refuse("isn't a readable glTF file ({})", error.empty() ? "damaged" : error);
    }
  }

  /// Refuses versions and extensions that the library knows nothing of: it reads on, and finds fault with something
  /// else, or nothing in the file.
  void refuse_foreign(std::string_view content) const {
    if (content.starts_with("glTF") && content.size() >= kGlbHeader) {
      std::uint32_t version = 0;
      std::memcpy(&version, content.data() + 4, sizeof version);
      if (version != 2) refuse("is a binary glTF file of version {}; 2 is read, store it so", version);
    }
    const auto text = nlohmann::json::parse(json_of(content), nullptr, false);
    if (!text.is_object()) return;  // the library says what is wrong with it
    const auto asset = text.find("asset");
    if (asset != text.end() && asset->is_object()) {
      // A later 2.x is read as far as its minVersion allows.
      const auto needed = asset->find("minVersion") != asset->end() ? "minVersion" : "version";
      const auto version = asset->find(needed);
      const std::string shown = version == asset->end() ? "none"
                                : version->is_string()  ? version->get<std::string>()
                                                        : version->dump();
      const bool reads = needed[0] == 'm' ? shown == "2.0" : shown.starts_with("2.");
      if (!reads) refuse("is glTF of {} {}; 2.0 is read, store it so", needed, short_text(shown));
    }
    const auto required = text.find("extensionsRequired");
    if (required != text.end() && required->is_array()) {
      for (const auto& extension : *required) {
        if (extension.is_string()) refuse_extension(extension.get<std::string>());
      }
    }
    const auto used = text.find("extensionsUsed");
    // Its buffers have no bytes without it, whether it is called required or not.
    if (used != text.end() && used->is_array() && std::ranges::find(*used, kMeshopt) != used->end()) {
      refuse_extension(kMeshopt);
    }
  }

  void refuse_extension(const std::string& extension) const {
    // These change how surfaces look, not where they are.
    const bool harmless = extension.starts_with("KHR_materials_") || extension.starts_with("KHR_texture_") ||
                          extension == "KHR_lights_punctual" || extension == "EXT_texture_webp";
    if (harmless) return;
    if (extension == "KHR_draco_mesh_compression" || extension == kMeshopt) {
      refuse("is compressed by {}, which isn't read; store it without compression", extension);
    }
    refuse("needs the extension {}, which isn't supported; store plain triangles", short_text(extension));
  }

  std::vector<int> roots() const {
    if (!model_.scenes.empty()) {
      const int scene = model_.defaultScene < 0 ? 0 : model_.defaultScene;
      if (scene >= static_cast<int>(model_.scenes.size())) refuse("names scene {}, which isn't there", scene);
      return model_.scenes[scene].nodes;
    }
    std::vector<bool> child(model_.nodes.size(), false);
    for (const tinygltf::Node& node : model_.nodes) {
      for (const int index : node.children) {
        if (index >= 0 && index < static_cast<int>(child.size())) child[index] = true;
      }
    }
    std::vector<int> result;
    for (std::size_t i = 0; i < child.size(); ++i) {
      if (!child[i]) result.push_back(static_cast<int>(i));
    }
    return result;
  }

  Eigen::Affine3d transform_of(const tinygltf::Node& node, int index) const {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    if (!node.matrix.empty()) {
      if (node.matrix.size() != 16) refuse("node {} has a matrix of {} numbers", index, node.matrix.size());
      matrix = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());  // by columns, as Eigen
    } else {
      Eigen::Affine3d parts = Eigen::Affine3d::Identity();
      const auto need = [&](const std::vector<double>& numbers, std::size_t count, const char* what) {
        if (!numbers.empty() && numbers.size() != count) refuse("node {} has a bad {}", index, what);
        return !numbers.empty();
      };
      if (need(node.translation, 3, "translation")) {
        parts.translate(Eigen::Vector3d(node.translation[0], node.translation[1], node.translation[2]));
      }
      if (need(node.rotation, 4, "rotation")) {
        const Eigen::Quaterniond turn(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
        if (!(std::abs(turn.norm() - 1.0) < 1e-3)) refuse("node {} has a rotation that isn't a unit quaternion", index);
        parts.rotate(turn.normalized());
      }
      if (need(node.scale, 3, "scale")) {
        parts.scale(Eigen::Vector3d(node.scale[0], node.scale[1], node.scale[2]));
      }
      matrix = parts.matrix();
    }
    if (!matrix.allFinite()) refuse("node {} has a transform that isn't finite", index);
    if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) refuse("node {} has a matrix that isn't affine", index);
    return Eigen::Affine3d(matrix);
  }

  // By a list, not by recursion: a chain of a million nodes must not overflow the stack.
  void add_node(int root, const Eigen::Affine3d& root_parent) {
    std::vector<std::pair<int, Eigen::Affine3d>> open = {{root, root_parent}};
    while (!open.empty()) {
      const auto [index, parent] = open.back();
      open.pop_back();
      if (index < 0 || index >= static_cast<int>(model_.nodes.size()))
        refuse("names node {}, which isn't there", index);
      if (visited_[index]) refuse("node {} is in the tree of nodes twice", index);
      visited_[index] = true;
      const tinygltf::Node& node = model_.nodes[index];
      const Eigen::Affine3d transform = parent * transform_of(node, index);
      if (node.mesh >= 0) {
        if (node.mesh >= static_cast<int>(model_.meshes.size())) refuse("names mesh {}, which isn't there", node.mesh);
        if (node.skin >= 0) refuse("mesh {} is skinned; store it in the pose that is meant", node.mesh);
        if (node.extensions.count("EXT_mesh_gpu_instancing") != 0)
          refuse("node {} is instanced by an extension", index);
        for (const tinygltf::Primitive& primitive : model_.meshes[node.mesh].primitives) {
          add_primitive(primitive, node.mesh, transform);
        }
      }
      for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) {
        open.emplace_back(*child, transform);
      }
    }
  }

  // The bytes of an accessor's elements: all `count` of `element_size` bytes, `stride` apart, are inside the buffer.
  struct Elements {
    const unsigned char* first;
    std::size_t count, stride;
    int component;
  };

  Elements elements(int index, int type, const char* what) const {
    if (index < 0 || index >= static_cast<int>(model_.accessors.size())) {
      refuse("{} are in accessor {}, which isn't there", what, index);
    }
    const tinygltf::Accessor& accessor = model_.accessors[index];
    if (accessor.sparse.isSparse) refuse("accessor {} is sparse, which isn't supported", index);
    if (accessor.type != type) refuse("accessor {} isn't of the type that {} have", index, what);
    if (accessor.bufferView < 0 || accessor.bufferView >= static_cast<int>(model_.bufferViews.size())) {
      refuse("accessor {} has no buffer view", index);
    }
    const tinygltf::BufferView& view = model_.bufferViews[accessor.bufferView];
    if (view.buffer < 0 || view.buffer >= static_cast<int>(model_.buffers.size())) {
      refuse("buffer view {} has no buffer", accessor.bufferView);
    }
    const std::vector<unsigned char>& data = model_.buffers[view.buffer].data;
    const int component_size = tinygltf::GetComponentSizeInBytes(static_cast<unsigned>(accessor.componentType));
    const int components = tinygltf::GetNumComponentsInType(static_cast<unsigned>(type));
    if (component_size < 1 || components < 1) refuse("accessor {} has an unknown type", index);
    const auto element_size = static_cast<std::size_t>(component_size * components);
    const std::size_t stride = view.byteStride == 0 ? element_size : view.byteStride;
    // Each length is compared with what is left, so that no sum can overflow.
    const bool view_fits = view.byteOffset <= data.size() && view.byteLength <= data.size() - view.byteOffset;
    const bool starts = view_fits && accessor.byteOffset <= view.byteLength;
    const std::size_t available = starts ? view.byteLength - accessor.byteOffset : 0;
    const bool fits =
        accessor.count == 0 || (available >= element_size && accessor.count - 1 <= (available - element_size) / stride);
    if (!view_fits || !starts || stride < element_size || !fits) {
      refuse("accessor {} ({} elements) reaches beyond its buffer", index, accessor.count);
    }
    return {data.data() + view.byteOffset + accessor.byteOffset, accessor.count, stride, accessor.componentType};
  }

  template <typename T>
  static T load_as(const unsigned char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
  }

  void add_primitive(const tinygltf::Primitive& primitive, int mesh_index, const Eigen::Affine3d& transform) {
    if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1) {
      refuse("mesh {} has a primitive of mode {}; allowed is 4, triangles", mesh_index, primitive.mode);
    }
    if (!primitive.extensions.empty()) {
      for (const char* compression : {"KHR_draco_mesh_compression", "EXT_meshopt_compression"}) {
        if (primitive.extensions.count(compression) != 0) {
          refuse("mesh {} is compressed by {}; store plain triangles", mesh_index, compression);
        }
      }
    }
    if (!primitive.targets.empty()) refuse("mesh {} has morph targets; store the shape that is meant", mesh_index);
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) refuse("mesh {} has a primitive without positions", mesh_index);
    const Elements positions = elements(position->second, TINYGLTF_TYPE_VEC3, "positions");
    if (positions.component != TINYGLTF_COMPONENT_TYPE_FLOAT) {
      refuse("mesh {} has positions that aren't floats", mesh_index);
    }
    if (positions.count > 3 * kMostTriangles || mesh_.vertices.size() + positions.count > 3 * kMostTriangles) {
      refuse("has more than {} vertices", 3 * kMostTriangles);
    }
    const auto base = static_cast<int>(mesh_.vertices.size());
    for (std::size_t i = 0; i < positions.count; ++i) {
      Eigen::Vector3d point;
      for (int axis = 0; axis < 3; ++axis)
        point[axis] = load_as<float>(positions.first + i * positions.stride + 4 * axis);
      point = transform * point;
      if (!point.allFinite()) refuse("mesh {}: vertex {} isn't finite", mesh_index, i);
      mesh_.vertices.push_back(point);
    }
    const bool mirrored = transform.linear().determinant() < 0.0;  // glTF 2.0, 3.7.4: the winding turns round
    add_triangles(primitive, mesh_index, base, positions.count, mirrored);
  }

  void add_triangles(const tinygltf::Primitive& primitive, int mesh_index, int base, std::size_t vertex_count,
                     bool mirrored) {
    const bool listed = primitive.indices >= 0;
    Elements indices{};
    if (listed) indices = elements(primitive.indices, TINYGLTF_TYPE_SCALAR, "indices");
    const std::size_t count = listed ? indices.count : vertex_count;
    if (count % 3 != 0) refuse("mesh {} has {} triangle corners, which isn't a multiple of 3", mesh_index, count);
    if (count / 3 + mesh_.triangles.size() > kMostTriangles) refuse("has more than {} triangles", kMostTriangles);
    const auto corner = [&](std::size_t i) -> int {
      std::size_t vertex = i;
      if (listed) {
        const unsigned char* const bytes = indices.first + i * indices.stride;
        switch (indices.component) {
          case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            vertex = *bytes;
            break;
          case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            vertex = load_as<std::uint16_t>(bytes);
            break;
          case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            vertex = load_as<std::uint32_t>(bytes);
            break;
          default:
            refuse("mesh {} has indices of component type {}", mesh_index, indices.component);
        }
      }
      if (vertex >= vertex_count) refuse("mesh {} names vertex {}, but has {}", mesh_index, vertex, vertex_count);
      return base + static_cast<int>(vertex);
    };
    for (std::size_t i = 0; i < count; i += 3) {
      std::array<int, 3> triangle = {corner(i), corner(i + 1), corner(i + 2)};
      if (mirrored) std::swap(triangle[1], triangle[2]);
      mesh_.triangles.push_back(triangle);
      origin_.push_back({primitive.material, mesh_index});
    }
  }

  std::string name_;
  tinygltf::Model model_;
  std::vector<bool> visited_;
  TriangleMesh mesh_;
  std::vector<std::array<int, 2>> origin_;  // per triangle: material or -1, mesh
};

}  // namespace

TriangleMesh read_gltf_mesh(const std::filesystem::path& path, double mm_per_unit) {
  return closed_solid(GltfSolid(path, mm_per_unit).mesh(), path);
}

GelSurface read_gltf_gel(const std::filesystem::path& path, double mm_per_unit) {
  const GltfSolid solid(path, mm_per_unit);
  std::vector<int> kept;
  GelSurface surface;
  surface.mesh = closed_solid(solid.mesh(), path, &kept);
  for (const int triangle : kept) surface.faces.push_back(solid.kind(triangle));
  for (const auto& [kind, name] :
       {std::pair(fem::FaceKind::bonded, "bonded"), std::pair(fem::FaceKind::outer, "outer")}) {
    if (std::find(surface.faces.begin(), surface.faces.end(), kind) == surface.faces.end()) {
      fail("{}: has no face named '{}': give its triangles a material of that name", path.string(), name);
    }
  }
  return surface;
}

}  // namespace touchstone::sim
