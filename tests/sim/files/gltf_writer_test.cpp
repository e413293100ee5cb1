#include "sim/files/gltf_writer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "sim/files/gltf_mesh.h"
#include "sim/scene/object.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

TriangleMesh ball(double radius) {
  ShapeSpec shape;
  shape.type = ShapeKind::sphere;
  shape.radius_mm = radius;
  return visible_mesh(shape);
}

struct ReadBack {
  nlohmann::json json;
  std::string binary;
};

std::uint32_t word(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

/// By the layout in the specification, 4.4: a header of three words, then chunks.
ReadBack take_apart(const std::string& bytes) {
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(bytes, 4), 2u);
  EXPECT_EQ(word(bytes, 8), bytes.size());
  const std::size_t text = word(bytes, 12);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  EXPECT_EQ(text % 4, 0u);
  ReadBack out{nlohmann::json::parse(bytes.substr(20, text)), {}};
  if (20 + text < bytes.size()) {
    EXPECT_EQ(bytes.substr(24 + text, 4), std::string("BIN\0", 4));
    out.binary = bytes.substr(28 + text);
    EXPECT_EQ(out.binary.size(), word(bytes, 20 + text));
    EXPECT_EQ(out.binary.size() % 4, 0u);
  }
  return out;
}

TEST(GltfWriter, VerticesAndTrianglesComeBackBitForBit) {
  const TriangleMesh mesh = ball(1.7);
  const ReadBack back = take_apart(glb_bytes({{"skip", {}}, {"a", ball(0.3)}, {"b", mesh}}, {}));
  ASSERT_EQ(back.json["meshes"].size(), 2u);
  const auto& primitive = back.json["meshes"][1]["primitives"][0];
  const auto& accessors = back.json["accessors"];
  const auto& positions = accessors[primitive["attributes"]["POSITION"].get<int>()];
  const auto& corners = accessors[primitive["indices"].get<int>()];
  ASSERT_EQ(positions["count"].get<std::size_t>(), mesh.vertices.size());
  ASSERT_EQ(corners["count"].get<std::size_t>(), 3 * mesh.triangles.size());
  EXPECT_EQ(positions["componentType"], 5126);
  EXPECT_EQ(corners["componentType"], 5125);
  const std::size_t first = back.json["bufferViews"][positions["bufferView"].get<int>()]["byteOffset"];
  const std::size_t first_corner = back.json["bufferViews"][corners["bufferView"].get<int>()]["byteOffset"];
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto expected = static_cast<float>(mesh.vertices[i][static_cast<Eigen::Index>(axis)]);
      ASSERT_EQ(std::memcmp(back.binary.data() + first + 12 * i + 4 * axis, &expected, 4), 0) << i;
      EXPECT_LE(positions["min"][axis].get<float>(), expected);
      EXPECT_GE(positions["max"][axis].get<float>(), expected);
    }
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_EQ(word(back.binary, first_corner + 12 * i + 4 * k), static_cast<std::uint32_t>(mesh.triangles[i][k]));
    }
  }
}

TEST(GltfWriter, TheProjectsOwnReaderFindsTheSolidInMetresWithYUp) {
  const test::TemporaryFolder folder;
  const TriangleMesh mesh = ball(2.0);
  write_glb(folder.path() / "ball.glb", {{"ball", mesh, {1, 0, 0}, 1.0, false, {{5.0, 6.0, 7.0}}}}, {});
  const TriangleMesh back = read_gltf_mesh(folder.path() / "ball.glb", 1000.0);
  ASSERT_EQ(back.triangles.size(), mesh.triangles.size());
  EXPECT_NEAR(enclosed_volume(back), enclosed_volume(mesh), 1e-4);
  Eigen::AlignedBox3d box, expected;
  for (const auto& v : back.vertices) box.extend(v);
  for (const auto& v : mesh.vertices) expected.extend(Eigen::Vector3d(v.x() + 5.0, v.z() + 7.0, -v.y() - 6.0));
  EXPECT_LT((box.center() - expected.center()).norm(), 1e-4);
}

TEST(GltfWriter, TheCameraLooksWhereItLooks) {
  const RigidTransform gel_from_camera = look_at({1, 2, -18}, {0, 0, 0}, {0, 1, 0});
  const ReadBack back = take_apart(glb_bytes({}, {{gel_from_camera, 0.4, 1.5}}));
  const auto& node = back.json["nodes"][back.json["scenes"][0]["nodes"][1].get<int>()];
  const auto m = node["matrix"].get<std::vector<double>>();
  ASSERT_EQ(m.size(), 16u);
  const Eigen::Map<const Eigen::Matrix4d> world(m.data());
  const Eigen::Vector3d eye = world.block<3, 1>(0, 3);
  EXPECT_LT((eye - Eigen::Vector3d(0.001, -0.018, -0.002)).norm(), 1e-12) << "metres, y up";
  const Eigen::Vector3d view = -world.block<3, 1>(0, 2);
  EXPECT_LT((view + eye.normalized()).norm(), 1e-12) << "along -z, to the origin";
  EXPECT_NEAR((world.block<3, 3>(0, 0).determinant()), 1.0, 1e-12);
  EXPECT_FALSE(back.json.contains("buffers"));
}

TEST(GltfWriter, WhatIsNotFiniteIsRefused) {
  TriangleMesh mesh = ball(1.0);
  mesh.vertices[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(glb_bytes({{"bad", mesh}}, {}), Error);
  EXPECT_THROW(write_glb("/nowhere/at/all.glb", {{"good", ball(1.0)}}, {}), Error);
}

}  // namespace
}  // namespace touchstone::sim
