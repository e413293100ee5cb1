#include "sim/files/plain_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/random.h"
#include "core/whole_file.h"
#include "sim/files/mesh_file.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A box of 6 x 8 x 10 about the origin, written by meshio and by ADMesh (Debian's python3-meshio and admesh).
const fs::path kBoxes = fs::path(TOUCHSTONE_SOURCE_DIR) / "tests/fuzz/corpus/plain_mesh";

/// `what` in all places, or in the first one only.
std::string replaced(std::string text, const std::string& what, const std::string& by, bool all = false) {
  std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  for (; at != std::string::npos; at = all ? text.find(what, at + by.size()) : std::string::npos) {
    text.replace(at, what.size(), by);
  }
  return text;
}

std::string box(const std::string& name) {
  return read_whole_file(kBoxes / name);
}

class PlainMesh : public testing::Test {
 protected:
  TriangleMesh read(const std::string& content, const std::string& suffix, double mm_per_unit = 1.0) const {
    const fs::path file = folder_.path() / ("body" + suffix);
    write_whole_file(file, content);
    return read_mesh_file(file, mm_per_unit);
  }

  void expect_box(const std::string& content, const std::string& suffix) const {
    const TriangleMesh mesh = read(content, suffix);
    EXPECT_EQ(mesh.vertices.size(), 8u) << "welded";
    EXPECT_EQ(mesh.triangles.size(), 12u);
    EXPECT_NEAR(enclosed_volume(mesh), 480.0, 1e-9);
  }

  std::string error_of(const std::string& content, const std::string& suffix) const {
    try {
      read(content, suffix);
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_THAT(message, HasSubstr((folder_.path() / ("body" + suffix)).string()));
      EXPECT_THAT(message, testing::Not(HasSubstr("\n"))) << "one line";
      EXPECT_LT(message.size(), 400u);
      return message;
    }
    return "no error";
  }

  test::TemporaryFolder folder_;
};

TEST_F(PlainMesh, ReadsWhatOtherProgramsWrote) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(kBoxes)) {
    SCOPED_TRACE(entry.path().string());
    ++files;
    const TriangleMesh mesh = read_mesh_file(entry.path(), 2.0);
    EXPECT_EQ(mesh.vertices.size(), 8u);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    EXPECT_NEAR(enclosed_volume(mesh), 8.0 * 480.0, 1e-8);
    Eigen::AlignedBox3d bounds;
    for (const Eigen::Vector3d& vertex : mesh.vertices) bounds.extend(vertex);
    EXPECT_EQ(bounds.min(), Eigen::Vector3d(-6.0, -8.0, -10.0));
    EXPECT_EQ(bounds.max(), Eigen::Vector3d(6.0, 8.0, 10.0));
  }
  EXPECT_EQ(files, 9);
}

TEST_F(PlainMesh, TheSuffixSaysTheKindAndTheUsualUnit) {
  for (const char* name : {"a.stl", "a.STL", "a.obj", "b.c.ply"}) EXPECT_EQ(usual_mm_per_unit(name), 1.0);
  for (const char* name : {"a.glb", "a.gltf", "a.GLB"}) EXPECT_EQ(usual_mm_per_unit(name), 1000.0);
  for (const char* name : {"a.step", "stl", "a.stl.zip", ""}) EXPECT_THROW(usual_mm_per_unit(name), Error) << name;
  expect_box(box("meshio-binary.stl"), ".STL");
  EXPECT_THAT(error_of(box("meshio-binary.stl"), ".step"),
              HasSubstr("files that end in '.step'; known are .glb, .gltf, .stl, .obj and .ply"));
  EXPECT_THROW(read(box("meshio-binary.stl"), ".stl", 0.0), Error);
  EXPECT_THROW(read(box("meshio-binary.stl"), ".stl", std::nan("")), Error);
  EXPECT_THROW(read_mesh_file(folder_.path() / "none.stl", 1.0), Error);
}

TEST_F(PlainMesh, ABinaryFileMayBeginWithSolid) {
  const std::string binary = box("meshio-binary.stl");
  for (const char fill : {' ', '\0'}) {
    std::string header = "solid made by a program";
    header.resize(80, fill);
    expect_box(header + binary.substr(80), ".stl");
    EXPECT_THAT(error_of(header + binary.substr(80, 400), ".stl"),
                HasSubstr("480 bytes, and the 12 triangles that its header says take 684"));
  }
}

TEST_F(PlainMesh, WhatIsNoStlIsRefused) {
  const std::string binary = box("meshio-binary.stl");
  const std::string text = box("meshio-text.stl");
  expect_box(replaced(text, "\n", "\r\n", true), ".stl");
  std::string capitals = text;
  for (char& letter : capitals) letter = static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
  expect_box("\n " + capitals, ".stl");
  EXPECT_THAT(error_of("", ".stl"), HasSubstr("is empty"));
  EXPECT_THAT(error_of("This is a letter.\n", ".stl"), HasSubstr("a text that doesn't begin with 'solid'"));
  EXPECT_THAT(error_of("solid nothing\nendsolid nothing\n", ".stl"), HasSubstr("holds no triangles"));
  EXPECT_THAT(error_of(std::string(20, '\0'), ".stl"), HasSubstr("20 bytes are no header"));
  EXPECT_THAT(error_of(binary + "more", ".stl"), HasSubstr("688 bytes, and the 12 triangles"));
  EXPECT_THAT(error_of(replaced(text, "vertex 3.0 4.0 -5.0", "vertex 3.0 4.0"), ".stl"),
              HasSubstr("of its text has 'endloop' in the place of a number"));
  EXPECT_THAT(error_of(replaced(text, "-5.0", "-5,0", true), ".stl"), HasSubstr("has '-5,0' in the place of a number"));
  EXPECT_THAT(error_of(text.substr(0, text.size() / 2), ".stl"), HasSubstr("is cut off"));
  expect_box(replaced(text, "solid", "solid of a vertex and a facet"), ".stl");
  // A count of 2^32 / 2 + 12 triangles takes 684 bytes modulo 2^32, by which the library judges.
  std::string many = binary;
  const std::uint32_t count = 0x80000000U + 12;
  std::memcpy(many.data() + 80, &count, sizeof count);
  EXPECT_THAT(error_of(many, ".stl"), HasSubstr("684 bytes, and the 2147483660 triangles"));
}

TEST_F(PlainMesh, AMarkOfUtf8IsPassedOver) {
  for (const char* name : {"meshio-text.stl", "meshio-text.ply", "meshio-quads.obj"}) {
    expect_box("\xef\xbb\xbf" + box(name), fs::path(name).extension());
  }
}

TEST_F(PlainMesh, FilesOfOtherKindsAreNamed) {
  EXPECT_THAT(error_of("PK\x03\x04" + std::string(200, '\0'), ".stl"), HasSubstr("it is a ZIP archive (as 3MF is)"));
  EXPECT_THAT(error_of("\x1f\x8b\x08" + std::string(200, '\0'), ".stl"), HasSubstr("it is packed by gzip"));
  EXPECT_THAT(error_of("<!DOCTYPE html>", ".obj"), HasSubstr("it is a page or a file of XML"));
  EXPECT_THAT(error_of("version https://git-lfs.github.com/spec/v1\n", ".glb"), HasSubstr("a pointer of Git LFS"));
  EXPECT_THAT(error_of(std::string("\xff\xfes\0o\0l\0", 8), ".stl"), HasSubstr("text in UTF-16; save it as UTF-8"));
  EXPECT_THAT(error_of("glTF\x02" + std::string(20, '\0'), ".stl"),
              HasSubstr("binary glTF; its name must end in .glb"));
}

TEST_F(PlainMesh, NumbersThatAreNoneAreRefused) {
  EXPECT_THAT(error_of(replaced(box("meshio-text.stl"), "-5.0", "nan", true), ".stl"), HasSubstr("isn't finite"));
  EXPECT_THAT(error_of(replaced(box("meshio-text.stl"), "-5.0", "1e999", true), ".stl"), HasSubstr("isn't finite"));
  EXPECT_THAT(error_of(replaced(box("meshio-text.ply"), "-5.0", "nan", true), ".ply"), HasSubstr("isn't finite"));
  EXPECT_THAT(error_of(replaced(box("meshio-quads.obj"), "v -3.0", "v inf"), ".obj"), HasSubstr("isn't finite"));
  std::string binary = box("meshio-binary.stl");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(binary.data() + 84 + 12, &nan, sizeof nan);
  EXPECT_THAT(error_of(binary, ".stl"), HasSubstr("vertex 0 isn't finite"));
}

TEST_F(PlainMesh, TrianglesWithoutAreaAreNoSolid) {
  const std::string facet =
      "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 1 0\n  vertex 2 2 0\n endloop\nendfacet\n";
  EXPECT_THAT(error_of("solid\n" + facet + facet + "endsolid\n", ".stl"), HasSubstr("triangle 0 has no area"));
  const std::string point =
      "facet normal 0 0 1\n outer loop\n  vertex 1 2 3\n  vertex 1 2 3\n  vertex 1 2 3\n endloop\nendfacet\n";
  EXPECT_THAT(error_of("solid\n" + point + point + "endsolid\n", ".stl"), HasSubstr("it has no triangles"));
  // Of a sound solid the triangles that collapse are left out, as glTF's are.
  expect_box(replaced(box("meshio-text.stl"), "solid\n", "solid\n" + point), ".stl");
}

TEST_F(PlainMesh, SurfacesThatBoundNothingAreRefused) {
  const std::string text = box("meshio-text.stl");
  const std::size_t first = text.find("facet"), second = text.find("facet normal", first + 5);
  EXPECT_THAT(error_of(text.substr(0, first) + text.substr(second), ".stl"), HasSubstr("the surface is open"));
  const std::string quads = box("meshio-quads.obj");
  EXPECT_THAT(error_of(replaced(quads, "f 1 3 4 2", "f 1 2 4 3"), ".obj"), HasSubstr("opposite orientations"));
  std::string turned = quads;  // mirrored, all faces look inwards
  for (const char* x : {"3.0", "-3.0"}) turned = replaced(turned, std::string("v ") + x, std::string("v X") + x, true);
  turned = replaced(replaced(turned, "X-3.0", "3.0", true), "X3.0", "-3.0", true);
  EXPECT_THAT(error_of(turned, ".obj"), HasSubstr("inside out"));
  std::string stepped = quads;  // two boxes that reach into one another
  for (int k = 0; k < 8; ++k) {
    stepped +=
        fmt::format("v {} {} {}\n", (k & 1 ? 3.0 : -3.0) + 0.5, (k & 2 ? 4.0 : -4.0) + 0.5, (k & 4 ? 5.0 : -5.0) + 0.5);
  }
  stepped += "f 9 11 12 10\nf 13 14 16 15\nf 9 10 14 13\nf 11 15 16 12\nf 9 13 15 11\nf 10 12 16 14\n";
  EXPECT_THAT(error_of(stepped, ".obj"), HasSubstr("cross"));
}

TEST_F(PlainMesh, ObjFacesMayHaveManyCorners) {
  // A prism over an arrowhead, whose outline isn't convex, with a corner in the middle of a straight side.
  const std::string prism =
      "v 0 0 0\nv 2 1 0\nv 4 0 0\nv 2 4 0\nv 1 2 0\nv 0 0 1\nv 2 1 1\nv 4 0 1\nv 2 4 1\nv 1 2 1\n"
      "f 5 4 3 2 1\nf 6 7 8 9 10\nf 1 2 7 6\nf 2 3 8 7\nf 3 4 9 8\nf 4 5 10 9\nf 5 1 6 10\n";
  const TriangleMesh mesh = read(prism, ".obj");
  EXPECT_EQ(mesh.triangles.size(), 3u + 3u + 10u);
  EXPECT_NEAR(enclosed_volume(mesh), 6.0, 1e-9);  // the triangle's 8 less the notch's 2
  // Four corners, three of them in a line: the other diagonal's triangles would have no area.
  const std::string spike =
      "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 1\n"
      "f 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
  EXPECT_NEAR(enclosed_volume(read(spike, ".obj")), 2.0 / 3.0, 1e-9);
  EXPECT_THAT(error_of(replaced(box("meshio-quads.obj"), "f 1 3 4 2", "f 1 4 3 2"), ".obj"),
              HasSubstr("face 0 of 4 corners crosses itself"));
  std::string many = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf";
  for (int k = 0; k < 334; ++k) many += " 1 2 3";
  EXPECT_THAT(error_of(many + "\n", ".obj"), HasSubstr("1002 corners; at most 1000"));
}

TEST_F(PlainMesh, VerticesOfNoTriangleArentTheSolids) {
  std::string ply = replaced(box("meshio-quads.ply"), "vertex 8", "vertex 9");
  const std::size_t last = ply.rfind("\n3.0 4.0 5.0\n");
  ASSERT_NE(last, std::string::npos);
  expect_box(ply.insert(last + 13, "1000 0 0\n"), ".ply");
}

TEST_F(PlainMesh, WhatObjFilesHaveBesideFacesIsntLookedAt) {
  const std::string quads = box("meshio-quads.obj");
  // The library would open a materials' file; a device that never ends would keep it.
  expect_box("mtllib /dev/zero\nusemtl steel\no body\ng side\ns 1\nvt 0 0\nvn 0 0 1\n" + quads + "l 1 2 3\np 4\n",
             ".obj");
  const std::string vertices = quads.substr(0, quads.find("\nf ") + 1);
  expect_box(vertices + "f -8 -6 -5 -7\nf -4 -3 -1 -2\nf -8 -7 -3 -4\nf -6 -2 -1 -5\nf -8 -4 -2 -6\nf -7 -5 -1 -3\n",
             ".obj");
  EXPECT_THAT(error_of(replaced(quads, "f 1 3", "f 9 3"), ".obj"), HasSubstr("index out of range"));
  EXPECT_THAT(error_of(replaced(quads, "f 1 3", "f 0 3"), ".obj"), HasSubstr("isn't a readable OBJ file"));
  EXPECT_THAT(error_of(replaced(quads, "f 1 3", "f -99 3"), ".obj"), HasSubstr("index out of range"));
  EXPECT_THAT(error_of("a letter\nof some lines\nand no solid\n", ".obj"), HasSubstr("holds no triangles"));
}

TEST_F(PlainMesh, PlyHeadersThatSayTooMuchOrTooLittleAreRefused) {
  const std::string text = box("meshio-text.ply");
  const std::string binary = box("meshio-binary.ply");
  for (const std::string& whole : {text, binary}) {
    for (const auto& [what, by] : {std::pair("face 12", "face 13"),
                                   {"face 12", "face 11"},
                                   {"vertex 8", "vertex 7"},
                                   {"vertex 8", "vertex 9"},
                                   {"face 12", "face 2000000000"},
                                   {"vertex 8", "vertex 4000000000"},
                                   {"face 12", "face -1"}}) {
      EXPECT_NE(error_of(replaced(whole, what, by), ".ply"), "no error") << what << " -> " << by;
    }
  }
  EXPECT_THAT(error_of(replaced(text, "end_header", "header"), ".ply"), HasSubstr("no line 'end_header'"));
  EXPECT_THAT(error_of("a letter\nend_header\n", ".ply"), HasSubstr("doesn't begin with 'ply'"));
#ifndef __SANITIZE_ADDRESS__  // whose operator new ends the process that reads the file, and doesn't throw
  EXPECT_THAT(error_of(replaced(text, "vertex 8", "vertex 4000000000"), ".ply"), HasSubstr("holds more than it can"));
#endif
  EXPECT_THAT(error_of(replaced(text, "\n3 ", "\n400000000 "), ".ply"), HasSubstr("isn't a readable PLY file"));
  const std::size_t last = text.rfind("\n3 ");
  EXPECT_THAT(error_of(text.substr(0, last) + "\n3 1 7 99\n", ".ply"), HasSubstr("names vertex 99, but there are 8"));
  EXPECT_THAT(error_of(text.substr(0, last) + "\n3 1 7 -1\n", ".ply"), HasSubstr("names vertex"));
}

TEST_F(PlainMesh, TruncatedFilesAreRefusedAtEveryLength) {
  for (const char* name : {"meshio-text.stl", "admesh-binary.stl", "meshio-quads.ply", "meshio-binary.ply"}) {
    const std::string whole = box(name);
    // The end of a text only says that it ends.
    const std::size_t end =
        whole.rfind("\n  vertex") == std::string::npos ? whole.size() - 2 : whole.rfind("\n  vertex");
    for (std::size_t length = 0; length < end; length += 1 + whole.size() / 25) {
      ASSERT_NE(error_of(whole.substr(0, length), fs::path(name).extension()), "no error") << name << ' ' << length;
    }
  }
}

// Any damage gives an Error or a sound solid, never a crash or a bad mesh.
TEST_F(PlainMesh, DamagedFilesNeverGiveABadMesh) {
  RandomStream random(1, 0, Purpose::kTest);
  int refused = 0;
  for (int i = 0; i < 60; ++i) {
    const std::string name = i % 3 == 0 ? "meshio-binary.stl" : i % 3 == 1 ? "meshio-binary.ply" : "meshio-text.ply";
    std::string content = box(name);
    for (int k = 0; k < 3; ++k) content[random() % content.size()] = static_cast<char>(random() % 256);
    try {
      EXPECT_EQ(fault_of_closed_mesh(read(content, fs::path(name).extension())), "");
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 20);
}

}  // namespace
}  // namespace touchstone::sim
