#include "sim/files/gltf_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "core/whole_file.h"
#include "fem/mesh/gel_body.h"
#include "sim/scene/device.h"
#include "sim/scene/device_gel.h"

namespace touchstone::sim {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using testing::HasSubstr;

std::string base64(const std::string& bytes) {
  const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned value = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      value = (value << 8) | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k <= bytes.size() ? digits[(value >> (18 - 6 * k)) & 63u] : '=';
    }
  }
  return text;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

// A cube of edge 2 (units of the file) about the origin, with four vertices of its own for each face, as exporters
// split them for normals.
struct Cube {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::uint16_t> indices;

  Cube() {
    for (int axis = 0; axis < 3; ++axis) {
      for (const float side : {-1.0F, 1.0F}) {
        const auto base = static_cast<std::uint16_t>(vertices.size());
        for (const auto& [u, v] : {std::pair(-1.0F, -1.0F), {1.0F, -1.0F}, {1.0F, 1.0F}, {-1.0F, 1.0F}}) {
          std::array<float, 3> p{};
          p[axis] = side;
          p[(axis + 1) % 3] = u;
          p[(axis + 2) % 3] = v * side;  // turns the face over where it must face the other side
          vertices.push_back(p);
        }
        for (const int corner : {0, 1, 2, 0, 2, 3}) indices.push_back(static_cast<std::uint16_t>(base + corner));
      }
    }
  }

  std::string bytes() const {
    std::string out(vertices.size() * 12 + indices.size() * 2, '\0');
    std::memcpy(out.data(), vertices.data(), vertices.size() * 12);
    std::memcpy(out.data() + vertices.size() * 12, indices.data(), indices.size() * 2);
    return out;
  }

  // `uri` is the buffer's; empty for the binary chunk of a .glb.
  std::string json(const std::string& uri, const std::string& nodes = R"([{"mesh": 0}])",
                   const std::string& root = "0") const {
    const std::string vertex_bytes = std::to_string(vertices.size() * 12);
    const std::string index_bytes = std::to_string(indices.size() * 2);
    return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [)" + root + R"(]}], "nodes": )" + nodes +
           R"(, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]}],
             "accessors": [{"bufferView": 0, "componentType": 5126, "count": )" +
           std::to_string(vertices.size()) +
           R"(, "type": "VEC3", "min": [-1, -1, -1], "max": [1, 1, 1]},
                           {"bufferView": 1, "componentType": 5123, "count": )" +
           std::to_string(indices.size()) + R"(, "type": "SCALAR"}],
             "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": )" +
           vertex_bytes + R"(},
                             {"buffer": 0, "byteOffset": )" +
           vertex_bytes + R"(, "byteLength": )" + index_bytes + R"(}],
             "buffers": [{"byteLength": )" +
           std::to_string(bytes().size()) + (uri.empty() ? "" : R"(, "uri": ")" + uri + "\"") + "}]}";
  }

  std::string embedded(const std::string& nodes = R"([{"mesh": 0}])", const std::string& root = "0") const {
    return json("data:application/octet-stream;base64," + base64(bytes()), nodes, root);
  }

  std::string glb() const {
    std::string text = json("");
    while (text.size() % 4 != 0) text += ' ';
    std::string binary = bytes();
    while (binary.size() % 4 != 0) binary += '\0';
    std::string out = "glTF";
    const auto word = [&](std::size_t value) {
      const auto narrow = static_cast<std::uint32_t>(value);
      out.append(reinterpret_cast<const char*>(&narrow), 4);
    };
    word(2);
    word(12 + 8 + text.size() + 8 + binary.size());
    word(text.size());
    out += "JSON" + text;
    word(binary.size());
    out += std::string("BIN\0", 4) + binary;
    return out;
  }
};

class GltfMesh : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("touchstone_gltf_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path file(const std::string& content, const std::string& name = "a.gltf") const {
    write_whole_file(folder_ / name, content);
    return folder_ / name;
  }

  TriangleMesh read(const std::string& content) const { return read_gltf_mesh(file(content), 1000.0); }

  void expect_refused(const std::string& content, const std::string& words) const {
    const fs::path path = file(content);
    try {
      read_gltf_mesh(path, 1000.0);
      ADD_FAILURE() << "took a file that should fail with: " << words;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(path.string()));
      EXPECT_THAT(error.what(), HasSubstr(words));
      EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n"))) << "one line";
    }
  }

  fs::path folder_;
  Cube cube_;
};

TEST_F(GltfMesh, ReadsTheCubeInMillimetres) {
  const TriangleMesh mesh = read(cube_.embedded());
  EXPECT_EQ(mesh.vertices.size(), 8u) << "welded";
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_NEAR(enclosed_volume(mesh), 8e9, 1.0);
  EXPECT_EQ(fault_of_closed_mesh(mesh), "");
  EXPECT_NEAR(enclosed_volume(read_gltf_mesh(file(cube_.embedded()), 1.0)), 8.0, 1e-9);
}

TEST_F(GltfMesh, AllFormsOfTheFileGiveTheSameSolid) {
  const TriangleMesh mesh = read(cube_.embedded());
  const TriangleMesh binary = read_gltf_mesh(file(cube_.glb(), "a.glb"), 1000.0);
  write_whole_file(folder_ / "cube.bin", cube_.bytes());
  const TriangleMesh beside = read(cube_.json("cube.bin"));
  const TriangleMesh misnamed = read_gltf_mesh(file(cube_.glb(), "b.gltf"), 1000.0);
  for (const TriangleMesh* other : {&binary, &beside, &misnamed}) {
    EXPECT_EQ(other->vertices, mesh.vertices);
    EXPECT_EQ(other->triangles, mesh.triangles);
  }
}

TEST_F(GltfMesh, NodesMoveTheirMeshes) {
  // Half size, a quarter turn about z, then 3 m along the parent's x, which is turned onto y.
  const double r = std::sqrt(0.5);
  const std::string turn = "[0, 0, " + std::to_string(r) + ", " + std::to_string(r) + "]";
  const TriangleMesh mesh = read(cube_.embedded(R"([{"children": [1], "rotation": )" + turn + R"(},
          {"mesh": 0, "translation": [3, 0, 0], "scale": [0.5, 0.25, 1]}])"));
  Eigen::AlignedBox3d box;
  for (const Vector3d& v : mesh.vertices) box.extend(v);
  EXPECT_LT((box.center() - Vector3d(0, 3000, 0)).norm(), 0.01);
  EXPECT_LT((box.sizes() - Vector3d(500, 1000, 2000)).norm(), 0.01);
  const TriangleMesh by_matrix =
      read(cube_.embedded(R"([{"mesh": 0, "matrix": [2,0,0,0, 0,2,0,0, 0,0,2,0, 5,6,7,1]}])"));
  EXPECT_NEAR(enclosed_volume(by_matrix), 64e9, 10.0);
  EXPECT_LT((by_matrix.vertices[0] - Vector3d(3000, 4000, 9000)).norm(), 1e-6);
}

TEST_F(GltfMesh, MirroringNodesKeepTheOutsideOut) {
  const TriangleMesh mesh = read(cube_.embedded(R"([{"mesh": 0, "scale": [-1, 1, 1]}])"));
  EXPECT_NEAR(enclosed_volume(mesh), 8e9, 1.0);
}

TEST_F(GltfMesh, SeveralBodiesAreOneSolid) {
  const TriangleMesh mesh = read(cube_.embedded(R"([{"mesh": 0}, {"mesh": 0, "translation": [2.5, 0, 0]}])", "0, 1"));
  EXPECT_EQ(mesh.vertices.size(), 16u);
  EXPECT_NEAR(enclosed_volume(mesh), 16e9, 1.0);
  expect_refused(cube_.embedded(R"([{"mesh": 0}, {"mesh": 0, "translation": [1.5, 0.1, 0.2]}])", "0, 1"), "cross");
}

TEST_F(GltfMesh, NodesOutsideTheSceneAreLeftOut) {
  const TriangleMesh mesh = read(cube_.embedded(R"([{"mesh": 0}, {"mesh": 0, "translation": [1, 0, 0]}])", "0"));
  EXPECT_EQ(mesh.triangles.size(), 12u);
}

TEST_F(GltfMesh, PicturesAreNotDecoded) {
  const std::string text = replaced(cube_.embedded(), R"("buffers":)",
                                    R"("images": [{"uri": "data:image/png;base64,AAAA"}, {"uri": "missing.png"}],
                                       "textures": [{"source": 0}], "buffers":)");
  EXPECT_EQ(read(text).triangles.size(), 12u);
}

TEST_F(GltfMesh, OpenOrTwistedSurfacesAreRefused) {
  Cube open = cube_;
  open.indices.resize(open.indices.size() - 3);
  expect_refused(open.embedded(), "the surface is open");
  Cube inside_out = cube_;
  for (std::size_t i = 0; i < inside_out.indices.size(); i += 3) {
    std::swap(inside_out.indices[i], inside_out.indices[i + 1]);
  }
  expect_refused(inside_out.embedded(), "inside out");
  Cube one = cube_;
  std::swap(one.indices[0], one.indices[1]);
  expect_refused(one.embedded(), "have opposite orientations");
  expect_refused(cube_.embedded(R"([{"mesh": 0, "scale": [1, 0, 1]}])"), "isn't a closed solid");
}

TEST_F(GltfMesh, NumbersThatAreNoneAreRefused) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Cube cube = cube_;
    cube.vertices[5][1] = bad;
    expect_refused(cube.embedded(), "vertex 5 isn't finite");
  }
  EXPECT_THROW(read_gltf_mesh(file(cube_.embedded()), 0.0), Error);
  EXPECT_THROW(read_gltf_mesh(file(cube_.embedded()), -1.0), Error);
  EXPECT_THROW(read_gltf_mesh(file(cube_.embedded()), std::nan("")), Error);
  expect_refused(cube_.embedded(R"([{"mesh": 0, "scale": [1e308, 1e308, 1e308]}])"), "isn't finite");
  expect_refused(cube_.embedded(R"([{"mesh": 0, "rotation": [0, 0, 0, 0]}])"), "unit quaternion");
  expect_refused(cube_.embedded(R"([{"mesh": 0, "matrix": [1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]}])"), "affine");
}

TEST_F(GltfMesh, IndicesOutOfRangeAreRefused) {
  Cube cube = cube_;
  cube.indices[7] = 24;
  expect_refused(cube.embedded(), "names vertex 24, but has 24");
  const std::string text = cube_.embedded();
  expect_refused(replaced(text, R"("POSITION": 0)", R"("POSITION": 7)"), "accessor 7");
  expect_refused(replaced(text, R"("indices": 1)", R"("indices": 9)"), "accessor");
  expect_refused(replaced(text, R"("POSITION": 0)", R"("NORMAL": 0)"), "without positions");
  expect_refused(replaced(text, R"("count": 24)", R"("count": 25)"), "beyond its buffer");
  expect_refused(replaced(text, R"("count": 36)", R"("count": 39)"), "beyond its buffer");
  expect_refused(replaced(text, R"("count": 36)", R"("count": 35)"), "multiple of 3");
  expect_refused(replaced(text, R"("count": 36)", R"("count": 4611686018427387906)"), "");
  expect_refused(replaced(text, R"("bufferView": 1)", R"("bufferView": 5)"), "");
  expect_refused(replaced(text, R"("byteOffset": 288, "byteLength": 72)", R"("byteOffset": 300, "byteLength": 72)"),
                 "");
  expect_refused(replaced(text, R"("mesh": 0)", R"("mesh": 3)"), "mesh 3");
  expect_refused(replaced(text, R"("nodes": [0])", R"("nodes": [4])"), "node 4");
  expect_refused(replaced(text, R"("scene": 0)", R"("scene": 2)"), "scene 2");
}

TEST_F(GltfMesh, WhatIsNotPlainTrianglesIsRefused) {
  const std::string text = cube_.embedded();
  for (const char* mode : {"0", "1", "3", "5", "6"}) {
    expect_refused(replaced(text, R"("mode": 4)", std::string(R"("mode": )") + mode), std::string("mode ") + mode);
  }
  expect_refused(replaced(text, R"("type": "VEC3")", R"("type": "VEC2")"), "type");
  expect_refused(replaced(text, R"("componentType": 5123)", R"("componentType": 5122)"), "component type 5122");
  expect_refused(replaced(text, R"("componentType": 5126)", R"("componentType": 5122)"), "aren't floats");
  expect_refused(replaced(text, R"("count": 24,)",
                          R"("count": 24, "sparse": {"count": 1, "indices": {"bufferView": 1, "componentType": 5123},
                             "values": {"bufferView": 0}},)"),
                 "sparse");
  expect_refused(replaced(text, R"("scene": 0)", R"("extensionsRequired": ["KHR_draco_mesh_compression"], "scene": 0)"),
                 "KHR_draco_mesh_compression");
  expect_refused(
      replaced(text, R"("mode": 4)",
               R"("mode": 4, "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}})"),
      "KHR_draco_mesh_compression");
  expect_refused(replaced(text, R"("mode": 4)", R"("mode": 4, "targets": [{"POSITION": 0}])"), "morph");
  expect_refused(replaced(text, R"({"mesh": 0})", R"({"mesh": 0, "skin": 0})"), "skinned");
}

TEST_F(GltfMesh, OtherVersionsAreNamed) {
  const std::string text = cube_.embedded();
  expect_refused(replaced(text, R"("version": "2.0")", R"("version": "1.0")"), "is glTF of version 1.0; 2.0 is read");
  expect_refused(R"({"asset": {"version": "1.0"}, "scenes": {"s": {"nodes": ["n"]}}, "nodes": {"n": {"meshes": []}}})",
                 "is glTF of version 1.0; 2.0 is read");
  expect_refused(replaced(text, R"("version": "2.0")", R"("version": "3.0")"), "is glTF of version 3.0");
  expect_refused(replaced(text, R"("version": "2.0")", R"("version": "2.1", "minVersion": "2.1")"), "minVersion 2.1");
  EXPECT_EQ(read(replaced(text, R"("version": "2.0")", R"("version": "2.1", "minVersion": "2.0")")).triangles.size(),
            read(text).triangles.size());
  std::string binary = cube_.glb();
  binary[4] = 1;
  expect_refused(binary, "is a binary glTF file of version 1; 2 is read");
}

TEST_F(GltfMesh, CompressionIsNamedWhateverElseIsMissing) {
  // Draco leaves accessors without views, meshopt a buffer without bytes: the library stumbles over these first.
  const std::string text = cube_.embedded();
  expect_refused(
      replaced(replaced(text, R"("scene": 0)", R"("extensionsRequired": ["KHR_draco_mesh_compression"], "scene": 0)"),
               R"("bufferView": 0, )", ""),
      "is compressed by KHR_draco_mesh_compression, which isn't read");
  for (const char* list : {"extensionsRequired", "extensionsUsed"}) {
    expect_refused(
        replaced(replaced(text, R"("scene": 0)", fmt::format(R"("{}": ["EXT_meshopt_compression"], "scene": 0)", list)),
                 R"("buffers": [)", R"("buffers": [{"byteLength": 1}, )"),
        "is compressed by EXT_meshopt_compression, which isn't read");
  }
}

TEST_F(GltfMesh, NodesInACircleAreRefused) {
  expect_refused(cube_.embedded(R"([{"children": [1]}, {"mesh": 0, "children": [0]}])"), "twice");
  expect_refused(cube_.embedded(R"([{"mesh": 0, "children": [0]}])"), "twice");
}

TEST_F(GltfMesh, FilesThatAreNoneAreRefused) {
  try {
    read_gltf_mesh(folder_ / "missing.glb", 1000.0);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("missing.glb"));
  }
  EXPECT_THROW(read_gltf_mesh(folder_, 1000.0), Error);
  expect_refused("", "isn't a readable glTF file");
  expect_refused("solid cube\nendsolid\n", "isn't a readable glTF file");
  expect_refused(R"({"asset": {"version": "2.0"}})", "");
  expect_refused("[[[[", "isn't a readable glTF file");
  expect_refused(cube_.json("missing.bin"), "isn't a readable glTF file");
  ASSERT_EQ(mkfifo((folder_ / "pipe.bin").c_str(), 0600), 0);  // nobody writes into it: opening it would wait for ever
  expect_refused(cube_.json("pipe.bin"), "isn't a readable glTF file");
}

TEST_F(GltfMesh, TruncatedFilesAreRefusedAtEveryLength) {
  for (const std::string& whole : {cube_.glb(), cube_.embedded()}) {
    for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 150) {
      ASSERT_THROW(read(whole.substr(0, length)), Error) << length << " of " << whole.size() << " bytes";
    }
  }
}

// Any damage gives an Error or a sound solid, never a crash or a bad mesh. Under AddressSanitizer this is worth most.
TEST_F(GltfMesh, DamagedFilesNeverGiveABadMesh) {
  RandomStream random(1, 0, Purpose::kTest);
  int refused = 0;
  for (int i = 0; i < 400; ++i) {
    std::string content = i % 2 == 0 ? cube_.glb() : cube_.embedded();
    for (int k = 0; k < 3; ++k) content[random() % content.size()] = static_cast<char>(random() % 256);
    try {
      EXPECT_EQ(fault_of_closed_mesh(read(content)), "");
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

/// The cube as three triangle lists: its six faces (12 indices of 2 bytes each) as side, side, ... with the last two
/// (axis z: lower, upper) named by materials.
std::string named_cube(const Cube& cube, const std::string& sides, const std::string& lower, const std::string& upper,
                       const std::string& mesh_name = "gel") {
  std::string text = cube.embedded();
  const auto list = [](int accessor, int material) {
    return R"({"attributes": {"POSITION": 0}, "indices": )" + std::to_string(accessor) +
           (material < 0 ? "" : R"(, "material": )" + std::to_string(material)) + R"(, "mode": 4})";
  };
  text = replaced(text, R"({"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}])",
                  list(1, sides.empty() ? -1 : 0) + "," + list(2, lower.empty() ? -1 : 1) + "," +
                      list(3, upper.empty() ? -1 : 2) + R"(], "name": ")" + mesh_name + "\"");
  text = replaced(text, R"("count": 36, "type": "SCALAR"})",
                  R"("count": 24, "type": "SCALAR"},
      {"bufferView": 1, "byteOffset": 48, "componentType": 5123, "count": 6, "type": "SCALAR"},
      {"bufferView": 1, "byteOffset": 60, "componentType": 5123, "count": 6, "type": "SCALAR"})");
  return replaced(text, R"("accessors")",
                  R"("materials": [{"name": ")" + sides + R"("}, {"name": ")" + lower + R"("}, {"name": ")" + upper +
                      R"("}], "accessors")");
}

TEST_F(GltfMesh, AGelsFacesAreNamedByTheirMaterials) {
  for (const char* sides : {"side", ""}) {
    const GelSurface gel = read_gltf_gel(file(named_cube(cube_, sides, "bonded", "outer")), 1.0);
    ASSERT_EQ(gel.faces.size(), gel.mesh.triangles.size());
    EXPECT_EQ(gel.faces.size(), 12u);
    for (std::size_t t = 0; t < gel.faces.size(); ++t) {
      double z = 0.0;
      for (const int v : gel.mesh.triangles[t]) z += gel.mesh.vertices[v].z() / 3.0;
      EXPECT_EQ(gel.faces[t], z > 0.9 ? fem::FaceKind::outer : z < -0.9 ? fem::FaceKind::bonded : fem::FaceKind::side);
    }
  }
  // A mesh's name stands in where there is no material.
  const GelSurface held = read_gltf_gel(file(named_cube(cube_, "", "", "outer", "bonded")), 1.0);
  EXPECT_EQ(std::count(held.faces.begin(), held.faces.end(), fem::FaceKind::bonded), 10);
}

TEST_F(GltfMesh, AGelsNamesThatAreNoneAreRefused) {
  const auto error_of = [&](const std::string& content) -> std::string {
    try {
      read_gltf_gel(file(content), 1.0);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(
      error_of(named_cube(cube_, "side", "bondd", "outer")),
      HasSubstr("material 'bondd' isn't a face of a gel; known are outer, bonded and side (did you mean 'bonded'?)"));
  EXPECT_THAT(error_of(named_cube(cube_, "side", "side", "outer")), HasSubstr("no face named 'bonded'"));
  EXPECT_THAT(error_of(named_cube(cube_, "side", "bonded", "side")), HasSubstr("no face named 'outer'"));
  EXPECT_THAT(error_of(cube_.embedded()), HasSubstr("no face named 'bonded'"));
  EXPECT_THAT(error_of(replaced(named_cube(cube_, "side", "bonded", "outer"), R"("material": 2)", R"("material": 7)")),
              HasSubstr("material 7"));
  Cube open = cube_;
  open.indices[33] = open.indices[30];
  open.indices[34] = open.indices[31];
  open.indices[35] = open.indices[32];
  EXPECT_THAT(error_of(named_cube(open, "side", "bonded", "outer")), HasSubstr("isn't a closed solid"));
}

TEST_F(GltfMesh, VerticesANanometreApartAreOneInAGel) {
  Cube cube = cube_;
  cube.vertices[3][0] += 1e-7F;
  const GelSurface gel = read_gltf_gel(file(named_cube(cube, "side", "bonded", "outer")), 1.0);
  EXPECT_EQ(gel.mesh.vertices.size(), 8u);
}

TEST_F(GltfMesh, AGelOfTheFileIsSetUpByTheDeviceThatNamesIt) {
  // The cube of edge 2 about the origin, lowered by 1: its top is z = 0.
  file(replaced(named_cube(cube_, "side", "bonded", "outer"), R"({"mesh": 0})",
                R"({"mesh": 0, "translation": [0, 0, -1]})"),
       "pad.gltf");
  const std::string device = R"(name: pad
gel:
  shape: mesh
  file: pad.gltf
  mm_per_unit: 2
  youngs_modulus_MPa: 0.3
mesh: {fine_mm: 0.8, coarse_mm: 1.2, fine_half_extent_mm: [1, 1], fine_depth_mm: 0.5}
plate: {thickness_mm: 1, refractive_index: 1.5}
)";
  file(device, "pad.yaml");
  const DeviceSpec pad = read_device(folder_ / "pad.yaml");
  EXPECT_NEAR(pad.gel.thickness_mm, 4.0, 1e-6);
  const fem::TetMesh mesh = fem::mesh_gel(gel_body(pad));
  double total = 0.0;
  for (const auto& t : mesh.tetrahedra) total += fem::volume(mesh, t);
  EXPECT_NEAR(total, 64.0, 1e-6);
  file(replaced(device, "pad.gltf", "pat.gltf"), "bad.yaml");
  try {
    read_device(folder_ / "bad.yaml");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("bad.yaml:4: gel.file: "));
    EXPECT_THAT(error.what(), HasSubstr("pat.gltf"));
  }
}

}  // namespace
}  // namespace touchstone::sim
