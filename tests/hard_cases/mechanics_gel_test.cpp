// The hard cases of gels as bodies and meshes, and of the objects that press them: 3, 4 and 13 to 18. The right answer,
// or a refusal that says why, before TetGen sees them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "closed_forms/contact_closed_forms.h"
#include "core/error.h"
#include "core/yaml_reader.h"
#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "fem/mesh/gel_body.h"
#include "fem/shapes/mesh_shape.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/box_gel.h"
#include "tests/support/message_of.h"

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;
using test::box_gel;
using test::did;
using test::message_of;
using test::Worst;
using ::testing::HasSubstr;

std::string error_of(const GelBody& body) {
  return message_of([&] { mesh_gel(body); });
}

/// What is said of `body`, on the page too, as what `what` names.
std::string refusal_of(const std::string& what, const GelBody& body) {
  const std::string message = error_of(body);
  if (message == "no error") {
    did("{}: taken", what);
  } else {
    did("{}: refused, \"{}\"", what, message);
  }
  return message;
}

TEST(HardCase3, AnEdgeAsSharpAsASliverIsRefusedAndItsAngleNamed) {
  // A wedge that ends at some degree: no mesh inside can be better.
  SolidGel knife = box_gel({10, 8, 3});
  for (const int v : {0, 2}) knife.surface.vertices[v].z() = -0.2;
  for (const int v : {1, 3}) knife.surface.vertices[v] += Vector3d(0.0, 0.0, 3.0 - 0.02);
  EXPECT_THAT(refusal_of("a gel that ends in an edge of a degree", knife), HasSubstr("degrees"));
}

TEST(HardCase3, TheSmallestAngleIsReported) {
  const SolidGel gel = box_gel({6, 6, 3});
  const TetMesh mesh = mesh_gel(gel);
  const Compliance made = compute_compliance(mesh, ElasticMaterial{0.33, 0.49}, {}, 3.0);
  EXPECT_NEAR(made.report.smallest_dihedral_deg, smallest_dihedral_angle(mesh) * 180.0 / 3.14159265358979, 1e-9);
  EXPECT_GT(made.report.smallest_dihedral_deg, kSmallestDihedralDeg);
  did("the report of a box of 6 x 6 x 3 mm has its mesh's smallest dihedral angle, {:.3g} degrees ({} are allowed)",
      made.report.smallest_dihedral_deg, kSmallestDihedralDeg);
}

TEST(HardCase4, AVeryThinLayerMeetsTheKernel) {
  const SlabMesh slab{7.0, 7.0, 0.2, 0.2, 0.6, 2.4, 2.4, 0.2};
  for (const double nu : {0.3, 0.45}) {
    const Compliance gel = compute_compliance(mesh_slab(slab), {1.0, nu}, {}, slab.thickness);
    Press press(gel, SphereShape{60.0}, 0.0);
    PressTarget target;
    target.axis = {AxisControl::at(0.013), AxisControl::at(0.021), AxisControl::at(60.0 - 0.04)};
    const PressState& state = press.step(target);
    const auto slope = [](double r) { return r / std::sqrt(3600.0 - r * r); };
    const closed_forms::LayerContact wanted = closed_forms::profile_on_layer(1.0, nu, slab.thickness, slope, 0.04, 4.0);
    ASSERT_LT(slab.thickness / wanted.contact_radius, 0.1);
    Worst away{0.02};
    EXPECT_LT(away(std::abs(state.wrench[2] / wanted.force - 1.0)), away.bar) << nu;
    did("a layer as thin as {:.2g} of the contact's radius, nu = {}: force differs from the elastic layer's in closed "
        "form by {}",
        slab.thickness / wanted.contact_radius, nu, away.text("relative"));
  }
}

TEST(HardCase4, AVeryThinCoatingNeedsNoFinerMesh) {
  SlabGel coated{{10.0, 10.0, 3.0, 0.5, 1.5, 2.0, 2.0, 0.5}, {0.002}};
  EXPECT_EQ(refusal_of("a coating of 2 um under edges of 0.5 mm", coated), "no error");
  coated.layers = {0.0005};
  EXPECT_THAT(refusal_of("one of 0.5 um", coated), HasSubstr("at most 1000 times as wide as high"));
}

TEST(HardCase13, CoincidentAndNearlyCoincidentVerticesAreRefusedByName) {
  // The same place twice: two sheets that share a corner's place but not its vertex.
  SolidGel twice = box_gel({6, 6, 3});
  twice.surface.vertices.push_back(twice.surface.vertices[7]);
  twice.surface.triangles[3][1] = 8;
  EXPECT_THAT(refusal_of("a gel with a corner's vertex twice", twice),
              HasSubstr("isn't a closed solid: the edge between vertices"));
  // 1e-9 mm apart: closed, and with a needle of a triangle.
  SolidGel near = box_gel({6, 6, 3});
  near.surface.vertices.push_back(near.surface.vertices[7] + Vector3d(0, 0, -1e-9));
  near.surface.triangles[7] = {3, 6, 8};
  near.surface.triangles[11] = {3, 8, 5};
  near.surface.triangles.push_back({6, 7, 8});
  near.surface.triangles.push_back({7, 5, 8});
  near.faces.resize(14, FaceKind::side);
  EXPECT_THAT(refusal_of("two vertices 1e-9 mm apart", near), HasSubstr("vertices 7 and 8 at"));
  EXPECT_THAT(error_of(near), HasSubstr("they must be at least 0.005 mm apart"));
}

TEST(HardCase13, AVertexThatAllButTouchesAFaceIsRefused) {
  // A notch in the top that stops 1e-9 mm above the bottom.
  SolidGel notched = box_gel({6, 6, 3});
  notched.surface.vertices.push_back(Vector3d(0.5, 0.25, -3.0 + 1e-9));
  notched.surface.triangles[2] = {4, 5, 8};
  notched.surface.triangles[3] = {5, 7, 8};
  notched.surface.triangles.push_back({7, 6, 8});
  notched.surface.triangles.push_back({6, 4, 8});
  notched.faces.resize(14, FaceKind::outer);
  EXPECT_THAT(refusal_of("a vertex 1e-9 mm off a face", notched), HasSubstr("vertex 8 at (0.5, 0.25"));
  EXPECT_THAT(error_of(notched), HasSubstr("beside triangle"));
}

TEST(HardCase14, ASolidWithANumberThatIsNoneIsRefused) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    SolidGel gel = box_gel({6, 6, 3});
    gel.surface.vertices[3].y() = bad;
    EXPECT_THAT(refusal_of(fmt::format("a gel's vertex at {}", bad), gel), HasSubstr("vertex 3 isn't finite"));
    gel = box_gel({6, 6, 3});
    gel.fine = bad;
    EXPECT_THAT(refusal_of(fmt::format("mesh edges of {} mm", bad), gel), HasSubstr("must be finite"));
  }
}

TEST(HardCase14, AFileWithANumberThatIsNoneIsRefusedByLineAndField) {
  for (const char* bad : {"nan", ".nan", "inf", "-.inf", "1e999"}) {
    YamlReader file = YamlReader::parse(fmt::format("\nthickness_mm: {}\n", bad), "device.yaml");
    double thickness = 0.0;
    const std::string said = message_of([&] { file.required("thickness_mm", thickness, Allowed::above(0.0)); });
    EXPECT_THAT(said, HasSubstr("device.yaml:2"));
    EXPECT_THAT(said, HasSubstr("thickness_mm"));
    did("a thickness of {} in a file: refused, \"{}\"", bad, said);
  }
}

TEST(HardCase14, AnObjectWithAVertexThatIsNowhereIsRefused) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    TriangleMesh mesh = box_gel({6, 6, 3}).surface;
    mesh.vertices[3].y() = bad;
    const std::string said = message_of([&] { const MeshShape shape(mesh); });
    EXPECT_THAT(said, HasSubstr("vertex 3 isn't finite"));
    did("an object's vertex at {}: refused, \"{}\"", bad, said);
  }
}

TEST(HardCase15, ABoundaryThatCrossesItselfIsRefused) {
  SolidGel gel = box_gel({6, 6, 3});
  gel.surface.vertices[7] = Vector3d(-1.0, -1.0, -5.0);  // a corner pulled through the bottom
  EXPECT_THAT(refusal_of("a gel with a corner pulled through its bottom", gel), HasSubstr("cross"));
  const std::string said = message_of([&] { const MeshShape shape(gel.surface); });
  EXPECT_THAT(said, HasSubstr("cross"));
  did("an object of that shape: refused, \"{}\"", said);
}

TEST(HardCase16, NoThicknessIsRefused) {
  SolidGel flat = box_gel({6, 6, 3});
  for (auto& vertex : flat.surface.vertices) vertex.z() = 0.0;
  EXPECT_THAT(refusal_of("a box of no height", flat), HasSubstr("isn't a closed solid"));
  SolidGel film = box_gel({6, 6, 1e-9});
  EXPECT_THAT(refusal_of("a film of 1e-9 mm", film), HasSubstr("at most 200 times its shortest"));
  SlabGel slab;
  slab.mesh.thickness = 0.0;
  EXPECT_THAT(refusal_of("a slab of no thickness", slab), HasSubstr("thickness is 0 mm"));
  DomeGel dome;
  dome.base_radius = 0.0;
  EXPECT_THAT(refusal_of("a dome without a base", dome), HasSubstr("base radius is 0 mm"));
  FingertipGel tip;
  tip.radius = 0.0;
  EXPECT_THAT(refusal_of("a fingertip of no radius", tip), HasSubstr("is 0 mm"));
}

TEST(HardCase17, AnAspectOf1000IsRefused) {
  EXPECT_THAT(refusal_of("a box of 1000 x 1000 x 1 mm", box_gel({1000, 1000, 1})),
              HasSubstr("at most 200 times its shortest"));
  SlabGel slab;
  slab.mesh.size_x = slab.mesh.size_y = 1000.0;
  slab.mesh.thickness = 1.0;
  EXPECT_THAT(refusal_of("a slab of 1000 x 1000 x 1 mm", slab), HasSubstr("at most 200 times its shortest"));
  DomeGel dome;
  dome.sphere_radius = 1e6;
  dome.base_radius = 500.0;
  dome.thickness = 1.0;
  EXPECT_THAT(refusal_of("a dome 1 mm thick and 1000 mm wide", dome), HasSubstr("at most 200 times the other"));
  FingertipGel tip;
  tip.length = 8000.0;
  EXPECT_THAT(refusal_of("a fingertip 8000 mm long", tip), HasSubstr("at most 200 times the other"));
  // Below that the budget decides.
  SolidGel wide = box_gel({100, 100, 1});
  wide.fine = 0.3;
  wide.coarse = 100.0;
  EXPECT_THAT(refusal_of("100 x 100 x 1 mm in edges of 0.3 mm", wide), HasSubstr("at most 40000 are allowed"));
}

TEST(HardCase18, AnOpenOrNonManifoldSurfaceIsRefused) {
  SolidGel open = box_gel({6, 6, 3});
  open.surface.triangles.pop_back();
  open.faces.pop_back();
  EXPECT_THAT(refusal_of("a gel without one of its triangles", open), HasSubstr("the surface is open"));
  SolidGel fin = box_gel({6, 6, 3});
  fin.surface.vertices.push_back(Vector3d(0, 0, 2));
  fin.surface.triangles.push_back({5, 6, 8});
  fin.surface.triangles.push_back({6, 5, 8});
  fin.faces.resize(14, FaceKind::side);
  EXPECT_THAT(refusal_of("a gel with a fin", fin), HasSubstr("the surface isn't manifold"));
  SolidGel inside_out = box_gel({6, 6, 3});
  for (auto& t : inside_out.surface.triangles) std::swap(t[1], t[2]);
  EXPECT_THAT(refusal_of("a gel turned inside out", inside_out), HasSubstr("it is inside out"));
}

TEST(HardCase18, ASolidWithoutABondOrAnOuterFaceIsRefused) {
  SolidGel loose = box_gel({6, 6, 3});
  loose.faces[0] = loose.faces[1] = FaceKind::side;
  EXPECT_THAT(refusal_of("a gel bonded nowhere", loose), HasSubstr("has no bonded face"));
  SolidGel closed = box_gel({6, 6, 3});
  closed.faces[2] = closed.faces[3] = FaceKind::bonded;
  EXPECT_THAT(refusal_of("a gel bonded all round", closed), HasSubstr("has no outer face"));
}

TEST(HardCase18, AnOpenOrNonManifoldObjectIsRefused) {
  const auto refused_as = [](const std::string& what, const TriangleMesh& mesh) {
    const std::string said = message_of([&] { const MeshShape shape(mesh); });
    did("{}: refused, \"{}\"", what, said);
    return said;
  };
  TriangleMesh open = box_gel({6, 6, 3}).surface;
  open.triangles.pop_back();
  EXPECT_THAT(refused_as("an object without one of its triangles", open), HasSubstr("the surface is open"));
  TriangleMesh fin = box_gel({6, 6, 3}).surface;
  fin.vertices.emplace_back(0, 0, 2);
  fin.triangles.push_back({5, 6, 8});
  fin.triangles.push_back({6, 5, 8});
  EXPECT_THAT(refused_as("an object with a fin", fin), HasSubstr("the surface isn't manifold"));
  TriangleMesh inside_out = box_gel({6, 6, 3}).surface;
  for (auto& t : inside_out.triangles) std::swap(t[1], t[2]);
  EXPECT_THAT(refused_as("an object turned inside out", inside_out), HasSubstr("inside out"));
}

}  // namespace
}  // namespace touchstone::fem
