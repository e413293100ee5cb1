#include "lab/press/marker_compliance_export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/error.h"
#include "core/yaml_reader.h"
#include "fem/contact/press.h"
#include "fem/fine_relief/layer_response.h"
#include "fem/mesh/slab.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kThickness = 5.0;
const fem::ElasticMaterial kMaterial{0.4, 0.49};

/// Two beads a side, under the middle.
std::vector<fem::Bead> beads() {
  std::vector<fem::Bead> result;
  for (const double y : {-1.0, 1.0}) {
    for (const double x : {-1.0, 1.0}) result.push_back({{x, y, -0.6}, 0.3});
  }
  return result;
}

fem::Compliance gel_with_edges(double fine) {
  fem::SlabMesh slab;
  slab.size_x = slab.size_y = 28.0;
  slab.thickness = kThickness;
  slab.fine = fine;
  slab.coarse = 2.5;
  slab.fine_half_x = slab.fine_half_y = 4.0;
  slab.fine_depth = 1.0;
  return fem::compute_compliance(fem::mesh_slab(slab), kMaterial, beads(), kThickness);
}

const fem::Compliance& gel() {
  static const fem::Compliance made = gel_with_edges(0.8);
  return made;
}

SurfaceMarkers grid_of(int side, double spacing, double half_width, bool square = true) {
  SurfaceMarkers markers;
  markers.grid = {side, side};
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      markers.markers.push_back(
          {spacing * (Eigen::Vector2d(i, j).array() - 0.5 * (side - 1)).matrix(), half_width, square});
    }
  }
  return markers;
}

PatchGrid patches_of(int side, double width) {
  return {{side, side}, width, Eigen::Vector2d::Constant(-0.5 * width * (side - 1))};
}

/// Betti's law: patches and markers of the same squares may change places.
TEST(MarkerComplianceExport, IsReciprocal) {
  const sensors::MarkerCompliance map = marker_compliance(gel(), grid_of(4, 1.5, 0.75), patches_of(4, 1.5));
  const Eigen::MatrixXd& u = map.displacement;
  EXPECT_LT((u - u.transpose()).norm(), 1e-9 * u.norm());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(u).eigenvalues().minCoeff(), 0.0) << "it takes work";
}

/// The same numbers by either order: few markers under many patches, or many under few.
TEST(MarkerComplianceExport, DoesntDependOnWhichAreMore) {
  const SurfaceMarkers nine = grid_of(3, 2.0, 0.8);
  const PatchGrid sixteen = patches_of(4, 1.5), four = patches_of(2, 1.5);
  const Eigen::MatrixXd wide = marker_compliance(gel(), nine, sixteen).displacement;
  const Eigen::MatrixXd tall = marker_compliance(gel(), nine, four).displacement;
  ASSERT_EQ(wide.cols(), 48);
  ASSERT_EQ(tall.cols(), 12);
  // The four patches are the middle ones of the sixteen.
  constexpr int kMiddle[] = {5, 6, 9, 10};
  for (int p = 0; p < 4; ++p) {
    EXPECT_LT((tall.middleCols(3 * p, 3) - wide.middleCols(3 * kMiddle[p], 3)).norm(), 1e-9 * tall.norm()) << p;
  }
}

/// The layer's kernel knows nothing of finite elements: pressure on one patch of an endless bonded layer.
TEST(MarkerComplianceExport, AgreesWithTheEndlessLayer) {
  const SurfaceMarkers markers = grid_of(3, 3.0, 1.0);
  const Eigen::MatrixXd map = marker_compliance(gel(), markers, patches_of(1, 2.0)).displacement;
  const Eigen::MatrixXd finer = marker_compliance(gel_with_edges(0.5), markers, patches_of(1, 2.0)).displacement;
  constexpr int kPixels = 80;
  constexpr double kPitch = 0.25;
  const fem::PixelGrid grid{kPixels, kPixels, kPitch, Eigen::Vector2d::Constant(-0.5 * kPitch * (kPixels - 1))};
  const fem::LayerResponse layer(kMaterial, kThickness, grid, fem::GridEdges::free);
  std::vector<double> pressure(grid.size(), 0.0), sunk(grid.size());
  const auto within = [&](int i, int j, double x, double y, double half) {
    const Eigen::Vector2d at = grid.centre(i, j);
    return std::abs(at.x() - x) < half && std::abs(at.y() - y) < half;
  };
  for (int j = 0; j < kPixels; ++j) {
    for (int i = 0; i < kPixels; ++i) pressure[grid.at(i, j)] = within(i, j, 0, 0, 1.0) ? 1.0 : 0.0;
  }
  layer.apply(pressure, sunk, *layer.make_scratch());
  for (int m = 0; m < 9; ++m) {
    const Eigen::Vector2d& rest = markers.markers[static_cast<std::size_t>(m)].centre;
    double sum = 0.0;
    int count = 0;
    for (int j = 0; j < kPixels; ++j) {
      for (int i = 0; i < kPixels; ++i) {
        if (!within(i, j, rest.x(), rest.y(), 1.0)) continue;
        sum += sunk[grid.at(i, j)];
        ++count;
      }
    }
    ASSERT_EQ(count, 64);
    // Pressed down, so against z.
    const double layer_mm = sum / count;
    const int row = 3 * m + 2;
    if (m != 4) {  // the bulge beside a patch is a small difference of large terms
      EXPECT_NEAR(map(row, 2), layer_mm, 0.02 * map(3 * 4 + 2, 2)) << m;
      continue;
    }
    // Of the patch itself elements see less than all, and more the smaller they are.
    EXPECT_LT(map(row, 2), layer_mm);
    EXPECT_NEAR(map(row, 2), layer_mm, 0.05 * layer_mm);
    EXPECT_LT(std::abs(layer_mm - finer(row, 2)), 0.6 * std::abs(layer_mm - map(row, 2)));
  }
}

TEST(MarkerComplianceExport, AMarkerIsTheMeanOfThePressesSurface) {
  fem::Press press(gel(), fem::RoundedCylinder{2.5, 0.3, 5.0}, 0.5);
  fem::PressTarget target;
  target.axis = {fem::AxisControl::at(0.4), fem::AxisControl::at(-0.3), fem::AxisControl::at(-0.4)};
  press.step(target);
  target.axis[0].value += 0.2;
  const fem::PressState& state = press.step(target);
  const SurfaceMarkers markers = grid_of(3, 2.0, 0.7);
  const std::vector<Eigen::Vector3d> means = MarkerMeans(gel(), markers).of(state.surface_displacement);
  EXPECT_LT(means[4].z(), -0.3);
  EXPECT_GT(means[4].x(), 0.05);
  // The press' own tractions, as their means over patches: the finer the patches, the nearer.
  const auto difference = [&](int side, double width) {
    const PatchGrid patches = patches_of(side, width);
    SurfaceMarkers squares;
    squares.grid = patches.grid;
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        squares.markers.push_back({patches.first + width * Eigen::Vector2d(i, j), 0.5 * width, true});
      }
    }
    const std::vector<Eigen::Vector3d> tractions = MarkerMeans(gel(), squares).of(state.traction);
    Eigen::VectorXd all(3 * side * side);
    for (int p = 0; p < side * side; ++p) all.segment<3>(3 * p) = tractions[static_cast<std::size_t>(p)];
    const Eigen::VectorXd moved = marker_compliance(gel(), markers, patches).displacement * all;
    double worst = 0.0;
    for (int m = 0; m < 9; ++m) {
      worst = std::max(worst, (moved.segment<3>(3 * m) - means[static_cast<std::size_t>(m)]).norm());
    }
    return worst;
  };
  const double coarse = difference(8, 1.0);
  EXPECT_LT(difference(16, 0.5), 0.6 * coarse);
  EXPECT_LT(difference(32, 0.25), 0.3 * coarse);
}

TEST(MarkerComplianceExport, DiscsAndSquaresOfOneAreaMoveAlike) {
  const PatchGrid patch = patches_of(1, 2.0);
  const Eigen::MatrixXd squares = marker_compliance(gel(), grid_of(2, 3.0, 0.5), patch).displacement;
  const Eigen::MatrixXd discs =
      marker_compliance(gel(), grid_of(2, 3.0, 1.0 / std::sqrt(std::acos(-1.0)), false), patch).displacement;
  EXPECT_LT((squares - discs).norm(), 0.02 * squares.norm());
  EXPECT_GT((squares - discs).norm(), 0.0);
}

TEST(MarkerComplianceExport, BeadsMoveAsTheComplianceSays) {
  std::vector<Eigen::Vector3d> rest;
  for (const fem::Bead& bead : beads()) rest.push_back(bead.centre);
  const sensors::MarkerCompliance map = bead_compliance(gel(), rest, patches_of(6, 1.5));
  EXPECT_EQ(map.marker_grid, Eigen::Vector2i(2, 2));
  // An even traction over all patches is, away from their outline, the even traction of all vertices there.
  Eigen::VectorXd even = Eigen::VectorXd::Zero(3 * map.patches());
  for (int p = 0; p < map.patches(); ++p) even[3 * p] = 0.01;
  const Eigen::VectorXd moved = map.displacement * even;
  for (int m = 0; m < 4; ++m) {
    EXPECT_NEAR(moved[3 * m], moved[0], 0.02 * moved[0]) << "the four beads are alike";
    EXPECT_GT(moved[3 * m], 0.0);
  }
  const sensors::MarkerCompliance one = bead_compliance(gel(), rest, patches_of(1, 9.0));
  EXPECT_LT((one.displacement.col(0) * 0.01 - moved).norm(), 1e-9 * moved.norm()) << "nine patches of 1.5 mm are one";
  rest.pop_back();
  EXPECT_THAT([&] { bead_compliance(gel(), rest, patches_of(1, 9.0)); },
              ThrowsMessage<Error>(HasSubstr("3 rest positions don't fit the gel's 4 beads")));
}

TEST(MarkerComplianceExport, PatchesCoverTheMarkersAndStayOnTheGel) {
  const PatchGrid small = patches_over(gel(), grid_of(4, 3.0, 1.0), 1.5);
  const double reach = -small.first.x() + 0.75;
  EXPECT_GE(reach, 4.5 + 2.0);
  EXPECT_LE(reach, 4.5 + 2.0 + 0.76);
  const PatchGrid whole = patches_over(gel(), grid_of(9, 3.0, 1.0), 1.5);
  EXPECT_EQ(whole.grid, Eigen::Vector2i(18, 18)) << "of a face 28 mm wide";
  EXPECT_THAT([] { patches_over(gel(), grid_of(4, 3.0, 1.0), 0.0); }, ThrowsMessage<Error>(HasSubstr("side is 0 mm")));
  EXPECT_THAT([] { patches_over(gel(), grid_of(4, 3.0, 1.0), 0.05); }, ThrowsMessage<Error>(HasSubstr("too small")));
  EXPECT_THAT([] { patches_over(gel(), grid_of(4, 3.0, 1.0), 40.0); }, ThrowsMessage<Error>(HasSubstr("40 mm")));
}

TEST(MarkerComplianceExport, BadPlacesAreRefused) {
  const PatchGrid one = patches_of(1, 2.0);
  EXPECT_THAT([&] { marker_compliance(gel(), grid_of(2, 27.0, 1.0), one); },
              ThrowsMessage<Error>(HasSubstr("marker 0 of 4.000 mm^2 about (-13.500, -13.500) mm isn't wholly")));
  EXPECT_THAT([&] { marker_compliance(gel(), grid_of(2, 3.0, 1.0), patches_of(15, 2.0)); },
              ThrowsMessage<Error>(HasSubstr("patch 0")));
  SurfaceMarkers fewer = grid_of(2, 3.0, 1.0);
  fewer.markers.pop_back();
  EXPECT_THAT([&] { marker_compliance(gel(), fewer, one); }, ThrowsMessage<Error>(HasSubstr("3 markers")));
  EXPECT_THAT([&] { marker_compliance(gel(), grid_of(2, 3.0, 0.0), one); },
              ThrowsMessage<Error>(HasSubstr("half width of 0 mm")));
}

TEST(MarkerComplianceExport, DevicesWithoutMarkersAreRefused) {
  const std::string slab =
      "name: d\ngel: {size_x_mm: 28, size_y_mm: 28, thickness_mm: 5, youngs_modulus_MPa: 0.4, poisson_ratio: 0.49, "
      "refractive_index: 1.4}\nplate: {thickness_mm: 4, refractive_index: 1.49}\n";
  const auto device = [](const std::string& text) { return parse_yaml<sim::DeviceSpec>(text, "d.yaml"); };
  EXPECT_THAT([&] { check_marker_compliance(device(slab)); },
              ThrowsMessage<Error>(HasSubstr("neither printed markers nor beads")));
  const std::string coat = "coating: {type: matt, albedo: 0.5, print: {grid: [3, 3], spacing_mm: [3, 3], ";
  EXPECT_THAT([&] { check_marker_compliance(device(slab + coat + "diameter_mm: 1, jitter_mm: 0.2}}\n")); },
              ThrowsMessage<Error>(HasSubstr("jittered")));
  const SurfaceMarkers round = printed_markers(device(slab + coat + "diameter_mm: 1}}\n"));
  EXPECT_EQ(round.markers.size(), 9u);
  EXPECT_FALSE(round.markers[0].square);
  EXPECT_EQ(round.markers[0].half_width, 0.5);
  EXPECT_EQ(round.markers[2].centre, Eigen::Vector2d(3, -3));
  const sim::DeviceSpec squares = device(slab + coat + "shape: square, side_mm: 2}}\n");
  EXPECT_TRUE(printed_markers(squares).markers[0].square);
  const sensors::MarkerCompliance map = export_marker_compliance(squares, gel());
  EXPECT_EQ(map.patch_side, 1.5);
  EXPECT_EQ(map.gel, "d");
  EXPECT_EQ(map.thickness, 5.0);
  EXPECT_EQ(sensors::fault_of(map), "");
}

}  // namespace
}  // namespace touchstone::lab
