#include "fem/mesh/gel_body.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "core/error.h"
#include "fem/elements/taylor_hood.h"
#include "fem/mesh/layer_columns.h"
#include "fem/mesh/tetgen_fill.h"
#include "tests/support/box_gel.h"

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
constexpr double kPi = std::numbers::pi;

double total_volume(const TetMesh& mesh, int region = -1) {
  double total = 0.0;
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    if (region < 0 || mesh.region_of(e) == region) total += volume(mesh, mesh.tetrahedra[e]);
  }
  return total;
}

Vector3d area(const TetMesh& mesh, const std::vector<std::array<int, 3>>& faces) {
  Vector3d total = Vector3d::Zero();
  for (const auto& face : faces) {
    const Vector3d& a = mesh.vertices[face[0]];
    total += 0.5 * (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a);
  }
  return total;
}

double plain_area(const TetMesh& mesh, const std::vector<std::array<int, 3>>& faces) {
  double total = 0.0;
  for (const auto& face : faces) total += area(mesh, {face}).norm();
  return total;
}

std::string error_of(const GelBody& body) {
  try {
    mesh_gel(body);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

SlabGel layered_slab(std::vector<double> layers) {
  return {{10.0, 8.0, 3.0, 0.5, 1.5, 1.5, 2.0, 0.5}, std::move(layers)};
}

double cap_volume(double sphere, double height) {
  return kPi * height * height * (3.0 * sphere - height) / 3.0;
}

TEST(LayeredSlab, FillsItsBoxLayerByLayer) {
  const TetMesh mesh = mesh_gel(layered_slab({0.02, 0.7}));
  EXPECT_EQ(fault_of(mesh), "");
  EXPECT_NEAR(total_volume(mesh, 1), 80.0 * 0.02, 1e-9);
  EXPECT_NEAR(total_volume(mesh, 2), 80.0 * 0.7, 1e-9);
  EXPECT_NEAR(total_volume(mesh, 0), 80.0 * 2.28, 1e-9);
  EXPECT_NEAR(area(mesh, mesh.outer).z(), 80.0, 1e-9);
  EXPECT_NEAR(area(mesh, mesh.bonded).z(), -80.0, 1e-9);
  for (const auto& face : mesh.outer) {
    for (const int v : face) EXPECT_EQ(mesh.vertices[v].z(), 0.0);
  }
}

TEST(LayeredSlab, AThinLayerCostsOnePrismAFaceAndNotItsOwnMeshSize) {
  const auto thick = mesh_gel(layered_slab({}));
  const auto coated = mesh_gel(layered_slab({0.01}));
  EXPECT_LT(coated.tetrahedra.size(), thick.tetrahedra.size() + 4 * coated.outer.size());
}

TEST(LayerSheets, AreAsFarApartAsEdgesAndOneALayerAtLeast) {
  const std::vector<double> layers = {0.01, 1.0, 0.3};
  const LayerSheets sheets = layer_sheets(layers, 0.5, 10.0);
  EXPECT_EQ(sheets.region, (std::vector<int>{1, 2, 2, 3}));
  ASSERT_EQ(sheets.depth.size(), 5u);
  EXPECT_NEAR(sheets.depth[2], 0.51, 1e-12);
  EXPECT_EQ(sheets.depth.back(), total_thickness(layers));
  EXPECT_EQ(layer_sheets({}, 0.5, 1.0).region.size(), 0u);
}

TEST(Dome, ACapHasItsVolumeAndItsOuterVerticesLieOnTheSphere) {
  DomeGel dome;
  dome.fine = 0.4;
  dome.coarse = 0.8;
  const TetMesh mesh = mesh_gel(dome);
  EXPECT_EQ(fault_of(mesh), "");
  const double height = 20.0 - std::sqrt(400.0 - 64.0);
  EXPECT_NEAR(thickness_of(GelBody(dome)), height, 1e-12);
  EXPECT_NEAR(total_volume(mesh) / cap_volume(20.0, height), 1.0, 0.01);
  EXPECT_LT(total_volume(mesh), cap_volume(20.0, height));
  EXPECT_NEAR(plain_area(mesh, mesh.bonded), kPi * 64.0, 0.01 * kPi * 64.0);
  EXPECT_NEAR(plain_area(mesh, mesh.outer), 2.0 * kPi * 20.0 * height, 0.01 * 2.0 * kPi * 20.0 * height);
  const Vector3d centre(0, 0, -20.0);
  double highest = -1.0;
  for (const auto& face : mesh.outer) {
    for (const int v : face) {
      EXPECT_NEAR((mesh.vertices[v] - centre).norm(), 20.0, 1e-12);
      highest = std::max(highest, mesh.vertices[v].z());
    }
  }
  EXPECT_EQ(highest, 0.0) << "the apex is the origin";
  for (const auto& face : mesh.bonded) {
    for (const int v : face) EXPECT_NEAR(mesh.vertices[v].z(), -height, 1e-12);
  }
}

TEST(Dome, ACylinderCarriesTheCapDownToItsThickness) {
  DomeGel dome;
  dome.thickness = 5.0;
  const TetMesh mesh = mesh_gel(dome);
  const double height = 20.0 - std::sqrt(400.0 - 64.0);
  EXPECT_NEAR(total_volume(mesh) / (cap_volume(20.0, height) + kPi * 64.0 * (5.0 - height)), 1.0, 0.02);
  double lowest = 0.0;
  for (const auto& face : mesh.bonded) {
    for (const int v : face) lowest = std::min(lowest, mesh.vertices[v].z());
    EXPECT_NEAR(area(mesh, {face}).normalized().z(), -1.0, 1e-12);
  }
  EXPECT_EQ(lowest, -5.0);
}

TEST(Dome, ItsLayersAreConcentric) {
  for (const double thickness : {0.0, 5.0}) {
    DomeGel dome;
    dome.thickness = thickness;
    dome.layers = {0.05, 0.2};
    const TetMesh mesh = mesh_gel(dome);
    EXPECT_EQ(fault_of(mesh), "");
    const Vector3d centre(0, 0, -20.0);
    const std::array<double, 4> limits = {0.0, 19.75, 19.95, 20.0};
    for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
      const int region = mesh.region_of(e);
      for (const int v : mesh.tetrahedra[e]) {
        const double radius = (mesh.vertices[v] - centre).norm();
        if (region == 0) {
          EXPECT_LT(radius, 19.75 + 1e-9);
        } else {
          EXPECT_GT(radius, limits[3 - region] - 1e-9) << region;
          EXPECT_LT(radius, limits[4 - region] + 1e-9) << region;
        }
      }
    }
    // A cap's layers end on the base and are bonded there, those over a cylinder end on its side.
    dome.layers.clear();
    const TetMesh plain = mesh_gel(dome);
    EXPECT_NEAR(plain_area(mesh, mesh.bonded), plain_area(plain, plain.bonded), 1e-6);
    EXPECT_NEAR(total_volume(mesh), total_volume(plain), 1e-3 * total_volume(plain));
  }
}

TEST(Dome, IsSixfoldSymmetricOnTheOutside) {
  const TetMesh mesh = mesh_gel(DomeGel());
  std::set<std::array<long, 3>> places;
  const auto key = [](const Vector3d& x) -> std::array<long, 3> {
    return {std::lround(1e7 * x.x()), std::lround(1e7 * x.y()), std::lround(1e7 * x.z())};
  };
  for (const auto& face : mesh.outer) {
    for (const int v : face) places.insert(key(mesh.vertices[v]));
  }
  const Eigen::AngleAxisd turn(kPi / 3.0, Vector3d::UnitZ());
  for (const auto& face : mesh.outer) {
    const auto turned = key(turn * mesh.vertices[face[0]]);
    bool found = false;
    for (long dx = -1; dx <= 1; ++dx) {
      for (long dy = -1; dy <= 1; ++dy) found = found || places.count({turned[0] + dx, turned[1] + dy, turned[2]}) > 0;
    }
    EXPECT_TRUE(found);
  }
}

TEST(Fingertip, TheSleeveAndTheBackAreBondedTheRestCanBeTouched) {
  FingertipGel tip;
  tip.layers = {0.3};
  const TetMesh mesh = mesh_gel(tip);
  EXPECT_EQ(fault_of(mesh), "");
  EXPECT_EQ(thickness_of(GelBody(tip)), 16.0);
  EXPECT_NEAR(total_volume(mesh) / (kPi * 64.0 * 8.0 + 2.0 / 3.0 * kPi * 512.0), 1.0, 0.04);
  const double free = 2.0 * kPi * 64.0 + 2.0 * kPi * 8.0 * 2.0;
  const double held = 2.0 * kPi * 8.0 * 6.0 + kPi * 64.0;
  EXPECT_NEAR(plain_area(mesh, mesh.outer) / free, 1.0, 0.03);
  EXPECT_NEAR(plain_area(mesh, mesh.bonded) / held, 1.0, 0.03);
  for (const auto& face : mesh.bonded) {
    for (const int v : face) {
      const Vector3d& x = mesh.vertices[v];
      const bool back = std::abs(x.z() + 16.0) < 1e-9;
      const bool side = std::abs(std::hypot(x.x(), x.y()) - 8.0) < 1e-9 && x.z() < -10.0 + 1e-9;
      EXPECT_TRUE(back || side);
    }
  }
  // The skin is everywhere 0.3 mm under the outside.
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    for (const int v : mesh.tetrahedra[e]) {
      const Vector3d& x = mesh.vertices[v];
      const double out = x.z() > -8.0 ? (x - Vector3d(0, 0, -8)).norm() : std::hypot(x.x(), x.y());
      EXPECT_GE(mesh.region[e] == 1 ? out - 7.7 : 7.7 - out, -1e-9);
    }
  }
}

/// A box, meshed finely within 1.5 mm of the middle.
SolidGel box_gel(const Vector3d& size) {
  SolidGel gel = test::box_gel(size);
  gel.fine_half_x = gel.fine_half_y = 1.5;
  return gel;
}

TEST(Solid, ABoxOfTwelveTrianglesIsMeshedAsFineAsASlab) {
  const SolidGel gel = box_gel({10, 8, 3});
  const TetMesh mesh = mesh_gel(gel);
  EXPECT_EQ(fault_of(mesh), "");
  EXPECT_EQ(thickness_of(GelBody(gel)), 3.0);
  EXPECT_NEAR(total_volume(mesh), 240.0, 1e-9);
  EXPECT_NEAR(area(mesh, mesh.outer).z(), 80.0, 1e-9);
  EXPECT_NEAR(area(mesh, mesh.bonded).z(), -80.0, 1e-9);
  int fine = 0;
  for (const auto& face : mesh.outer) {
    for (int k = 0; k < 3; ++k) {
      const Vector3d& a = mesh.vertices[face[k]];
      const Vector3d& b = mesh.vertices[face[(k + 1) % 3]];
      if (std::max({std::abs(a.x()), std::abs(a.y()), std::abs(b.x()), std::abs(b.y())}) > 1.2) continue;
      EXPECT_LT((a - b).norm(), 2.0 * gel.fine);
      ++fine;
    }
  }
  EXPECT_GT(fine, 30);
}

TEST(GelBody, EstimatesHoldWithinAFactorOfTwo) {
  DomeGel coated;
  coated.thickness = 5.0;
  coated.layers = {0.03};
  FingertipGel skin;
  skin.layers = {0.3};
  FingertipGel fine;
  fine.fine = 0.3;
  for (const GelBody& body : std::vector<GelBody>{SlabGel{}, layered_slab({0.02}), layered_slab({0.1, 1.0}), DomeGel(),
                                                  coated, FingertipGel(), skin, fine, box_gel({10, 8, 3})}) {
    const auto made = static_cast<double>(mesh_gel(body).tetrahedra.size());
    EXPECT_GT(estimated_tetrahedra(body), 0.6 * made) << body.index();
    EXPECT_LT(estimated_tetrahedra(body), 2.0 * made) << body.index();
  }
}

TEST(GelBody, SameInputGivesTheSameMesh) {
  DomeGel coated;
  coated.layers = {0.03};
  for (const GelBody& body : std::vector<GelBody>{layered_slab({0.3}), coated, FingertipGel(), box_gel({6, 6, 3})}) {
    const TetMesh first = mesh_gel(body);
    const TetMesh second = mesh_gel(body);
    EXPECT_EQ(first.vertices, second.vertices);
    EXPECT_EQ(first.tetrahedra, second.tetrahedra);
    EXPECT_EQ(first.outer, second.outer);
    EXPECT_EQ(first.region, second.region);
  }
}

TEST(GelBody, NoLayersIsThePlainSlabBitForBit) {
  const TetMesh plain = mesh_slab(layered_slab({}).mesh);
  const TetMesh body = mesh_gel(layered_slab({}));
  EXPECT_EQ(plain.vertices, body.vertices);
  EXPECT_EQ(plain.tetrahedra, body.tetrahedra);
  EXPECT_TRUE(body.region.empty());
}

TEST(GelBody, BadNumbersAreRefusedByName) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity, -1.0}) {
    for (int field = 0; field < 7; ++field) {
      DomeGel d;
      double* lengths[] = {&d.sphere_radius, &d.base_radius, &d.thickness, &d.fine,
                           &d.coarse,        &d.fine_radius, &d.fine_depth};
      *lengths[field] = bad;
      EXPECT_THAT(error_of(d), HasSubstr("must be finite")) << field;
      FingertipGel f;
      double* others[] = {&f.radius, &f.length, &f.sleeve, &f.fine, &f.coarse, &f.fine_radius, &f.fine_depth};
      *others[field] = bad;
      EXPECT_THAT(error_of(f), HasSubstr("must be finite")) << field;
    }
    EXPECT_THAT(error_of(layered_slab({bad})), HasSubstr("a layer's thickness is"));
    DomeGel coated;
    coated.layers = {bad};
    EXPECT_THAT(error_of(coated), HasSubstr("a layer's thickness is"));
  }
  EXPECT_THAT(error_of(layered_slab({0.0})), HasSubstr("a layer's thickness is 0 mm"));
}

TEST(GelBody, ShapesThatCannotBeAreRefused) {
  DomeGel dome;
  dome.base_radius = 21.0;
  EXPECT_THAT(error_of(dome), HasSubstr("must not be above its sphere's radius, 20 mm"));
  dome = {};
  dome.thickness = 1.0;
  EXPECT_THAT(error_of(dome), HasSubstr("its cap alone is"));
  dome = {};
  dome.sphere_radius = 40.0;
  EXPECT_THAT(error_of(dome), HasSubstr("meets its base at 11.5 degrees"));
  dome = {};
  dome.layers = {1.6};
  EXPECT_THAT(error_of(dome), HasSubstr("there is space for"));
  dome = {};
  dome.fine = 0.05;
  dome.coarse = 0.1;
  EXPECT_THAT(error_of(dome), HasSubstr("at most 160000 are allowed"));
  FingertipGel tip;
  tip.sleeve = 9.0;
  EXPECT_THAT(error_of(tip), HasSubstr("sleeve is 9 mm long; it must not be longer than its cylinder, 8 mm"));
  tip = {};
  tip.sleeve = 7.9;
  EXPECT_THAT(error_of(tip), HasSubstr("are left"));
  EXPECT_THAT(error_of(layered_slab({1.0, 1.9})), HasSubstr("there is space for"));
  EXPECT_THAT(error_of(layered_slab({1e-4})), HasSubstr("at most 1000 times as wide as high"));
}

TEST(GelBody, NamesItsMaterials) {
  EXPECT_EQ(material_count(SlabGel{}), 1);
  EXPECT_EQ(material_count(layered_slab({0.1, 0.2})), 3);
  EXPECT_EQ(material_count(box_gel({1, 1, 1})), 1);
}

TEST(GelBody, ChecksumsTellBodiesApart) {
  std::set<std::string> sums;
  const auto add = [&](const GelBody& body) {
    Sha256 sum;
    add_to(sum, body);
    sums.insert(sum.digest());
  };
  std::vector<GelBody> bodies = {SlabGel{}, layered_slab({}), layered_slab({0.1}), layered_slab({0.1, 0.1}),
                                 DomeGel(), FingertipGel(),   box_gel({6, 6, 3}),  box_gel({6, 6, 3.5})};
  DomeGel dome;
  dome.layers = {0.1};
  bodies.emplace_back(dome);
  SolidGel other = box_gel({6, 6, 3});
  other.faces[4] = FaceKind::outer;
  bodies.emplace_back(other);
  for (const GelBody& body : bodies) add(body);
  EXPECT_EQ(sums.size(), bodies.size());
  for (const GelBody& body : bodies) add(body);
  EXPECT_EQ(sums.size(), bodies.size());
}

TEST(TetGen, AFilledBoundaryThatIsKeptHasNoNewVertex) {
  // mesh_revolved relies on it: the core's surface is exactly the rings'.
  const DomeGel dome;
  const TetMesh mesh = mesh_gel(dome);
  const std::size_t outside = boundary_faces(mesh).size();
  EXPECT_EQ(outside, mesh.outer.size() + mesh.bonded.size());
}

}  // namespace
}  // namespace touchstone::fem
