#include "fem/fine_relief/fine_relief.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"
#include "fem/finite_strain/finite_press.h"
#include "fem/mesh/slab.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

using ::testing::HasSubstr;

const ElasticMaterial kGel{0.33, 0.49};

const Compliance& coarse_gel() {
  static const Compliance gel = [] {
    SlabMesh slab{12.0, 12.0, 3.0, 0.5, 1.5, 3.5, 3.5, 0.6};
    return compute_compliance(mesh_slab(slab), kGel, {}, 3.0);
  }();
  return gel;
}

const SmoothSurface& coarse_surface() {
  static const SmoothSurface surface(coarse_gel());
  return surface;
}

/// Pressed straight down without friction; the object's origin ends at z.
PressState pressed(const Compliance& gel, const ContactShape& shape, double x, double y, double z,
                   const Eigen::Matrix3d& rotation = Eigen::Matrix3d::Identity(), double friction = 0.0) {
  Press press(gel, shape, friction);
  PressTarget target;
  target.rotation = rotation;
  target.axis = {AxisControl::at(x), AxisControl::at(y), AxisControl::at(z)};
  return press.step(target);
}

double force_of(const ReliefAnswer& answer) {
  double force = 0.0;
  for (const double p : answer.pressure) force += p * answer.grid.pixel_area();
  return force;
}

TEST(SmoothSurface, OnAWidePadTheEndlessLayerLeavesLittleOver) {
  const PressState press = pressed(coarse_gel(), SphereShape{3.0}, 0.1, -0.2, 3.0 - 0.3);
  const SmoothDisplacement smooth = coarse_surface().displacement(press);
  EXPECT_NEAR(smooth.force, press.wrench[2], 1e-9);
  for (const double x : {-2.0, -1.0, 0.0, 1.0, 2.0}) {
    EXPECT_LT(std::abs(smooth.rest.at({x, 0.3 * x}).z()), 0.03 * 0.3) << x;
  }
  EXPECT_LT(smooth.largest_misfit, 0.02 * 0.3);
}

TEST(SmoothSurface, ALinearFieldIsItsOwnSpline) {
  SplineField field = coarse_surface().displacement(pressed(coarse_gel(), SphereShape{3.0}, 0, 0, 5.0)).rest;
  for (Eigen::Index row = 0; row < field.coefficients.rows(); ++row) {
    const Eigen::Vector2d knot = field.knot(row);
    field.coefficients.row(row) << knot.x(), knot.y(), 2.0 * knot.x() - knot.y();
  }
  const Eigen::Vector3d value = field.at({1.37, -2.11});
  EXPECT_LT((value - Eigen::Vector3d(1.37, -2.11, 2.74 + 2.11)).norm(), 1e-12);
}

TEST(FineRelief, TheForceStaysTheCoarseOne) {
  const SphereShape ball{3.0};
  const PressState press = pressed(coarse_gel(), ball, 0.1, -0.2, 3.0 - 0.3);
  const ReliefAnswer answer = solve_fine_relief(coarse_surface(), press, ball);
  EXPECT_TRUE(answer.solved.converged);
  EXPECT_NEAR(force_of(answer), press.wrench[2], 1e-9);
  EXPECT_LT(answer.solved.force_residual, 1e-12);
  EXPECT_FALSE(answer.at_the_edge);
}

// What a smooth ball does, the coarse mesh knows already: the fine solution must agree with it.
TEST(FineRelief, ASmoothBallStandsWhereTheCoarsePressHasIt) {
  const SphereShape ball{3.0};
  const PressState press = pressed(coarse_gel(), ball, 0.1, -0.2, 3.0 - 0.3);
  const ReliefAnswer answer = solve_fine_relief(coarse_surface(), press, ball);
  EXPECT_LT(std::abs(answer.solved.shift), 0.03 * 0.3);
  const HeightField height(coarse_surface(), press, &answer);
  EXPECT_NEAR(height.at({0.1, -0.2}), -0.3 + answer.solved.shift, 1e-3);
}

// The mesh's projected displacement overshoots by a tenth and more beside a sharp rim; the fine membrane doesn't.
TEST(FineRelief, UnderASharpFlatPunchTheMembraneIsFlat) {
  const RoundedCylinder punch{2.0, 0.0, 3.0};
  const PressState press = pressed(coarse_gel(), punch, 0.13, 0.07, -0.2);
  ASSERT_GT((press.surface_displacement.col(2).array() + 0.2).abs().minCoeff(), -1.0);
  double overshoot = 0.0;
  for (Eigen::Index v = 0; v < press.surface_displacement.rows(); ++v) {
    overshoot = std::max(overshoot, -0.2 - press.surface_displacement(v, 2));
  }
  EXPECT_GT(overshoot, 0.01) << "else this test shows nothing";
  const ReliefAnswer answer = solve_fine_relief(coarse_surface(), press, punch);
  double lowest = 0.0;
  double highest = -1.0;
  for (std::size_t k = 0; k < answer.height.size(); ++k) {
    lowest = std::min(lowest, answer.height[k]);
    if (answer.contact[k]) highest = std::max(highest, answer.height[k]);
  }
  EXPECT_LT(highest - lowest, 1e-4);
  // Beside the rim it rises without a wiggle.
  const HeightField height(coarse_surface(), press, &answer);
  double before = height.at({0.13 + 2.02, 0.07});
  for (double r = 2.04; r < 2.8; r += 0.02) {
    const double here = height.at({0.13 + r, 0.07});
    EXPECT_GT(here, before) << r;
    before = here;
  }
}

TEST(FineRelief, TheHeightFieldHasNoStepAtTheGridsBorder) {
  const RoundedCylinder punch{2.0, 0.2, 3.0};
  const PressState press = pressed(coarse_gel(), punch, 0.0, 0.0, -0.2);
  const ReliefAnswer answer = solve_fine_relief(coarse_surface(), press, punch);
  const HeightField height(coarse_surface(), press, &answer);
  const double right = answer.grid.first.x() + answer.grid.pitch * (answer.grid.nx - 1);
  // The slope on either side of the border goes through it.
  for (double y = -2.0; y <= 2.0; y += 0.25) {
    const double inside = height.at_material({right - 0.001, y});
    const double before = height.at_material({right - 0.061, y});
    const double outside = height.at_material({right + 0.059, y});
    EXPECT_NEAR(outside, inside + (inside - before), 1e-3 * 0.2) << y;
  }
}

// A hair of 1 mm lying on the gel, pressed in by a quarter: too thin for edges of 0.5 mm. A mesh of 0.12 mm resolves
// it.
TEST(FineRelief, ALyingRodIsAsADirectFineMeshHasIt) {
  const RoundedCylinder rod{0.5, 0.0, 4.0};
  Eigen::Matrix3d lying;
  lying << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // its axis along y
  ASSERT_NEAR(lying.determinant(), 1.0, 1e-12);
  const double depth = 0.25;
  const double z = 0.5 - depth;
  const SlabMesh slab{8.0, 10.0, 3.0, 0.12, 1.2, 0.75, 2.4, 0.3};
  const Compliance fine_gel = compute_compliance(mesh_slab(slab), kGel, {}, 3.0);
  // The object's z axis goes to -y, so the rod reaches from y to y - 4.
  const PressState direct = pressed(fine_gel, rod, 0.0, 2.0, z, lying);
  const PressState coarse = pressed(coarse_gel(), rod, 0.0, 2.0, z, lying);
  ReliefSettings settings;
  settings.control = ReliefControl::pose;
  settings.follow_surface = false;
  const ReliefAnswer answer = solve_fine_relief(coarse_surface(), coarse, rod, settings);
  ASSERT_TRUE(answer.solved.converged);
  const double direct_force = direct.wrench[2];
  EXPECT_NEAR(answer.solved.force, direct_force, 0.02 * direct_force);
  // The mesh knows means over its hats; the field's own are taken by the rule of the edges' middles.
  const HeightField height(coarse_surface(), coarse, &answer);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(fine_gel.mass.cols());
  for (const auto& t : fine_gel.triangles) {
    const Eigen::Vector3d e = fine_gel.vertices[t[1]] - fine_gel.vertices[t[0]];
    const double area = 0.5 * e.cross(fine_gel.vertices[t[2]] - fine_gel.vertices[t[0]]).norm();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d middle = 0.5 * (fine_gel.vertices[t[k]] + fine_gel.vertices[t[(k + 1) % 3]]);
      const double share = area / 6.0 * height.at(middle.head<2>());
      sum[t[k]] += share;
      sum[t[(k + 1) % 3]] += share;
    }
  }
  const Eigen::VectorXd weight = fine_gel.mass * Eigen::VectorXd::Ones(fine_gel.mass.cols());
  const Eigen::VectorXd direct_sum = fine_gel.mass * direct.surface_displacement.col(2);
  double worst = 0.0;
  int compared = 0;
  for (std::size_t v = 0; v < fine_gel.vertices.size(); ++v) {
    const Eigen::Vector2d at = fine_gel.vertices[v].head<2>();
    if (std::abs(at.x()) > 0.7 || std::abs(at.y()) > 1.5) continue;
    const auto row = static_cast<Eigen::Index>(v);
    worst = std::max(worst, std::abs(sum[row] - direct_sum[row]) / weight[row]);
    ++compared;
  }
  EXPECT_GT(compared, 200);
  EXPECT_LT(worst, 0.02 * depth);
}

TEST(FineRelief, RefiningThePixelsConverges) {
  const RoundedCylinder punch{2.0, 0.2, 3.0};
  const PressState press = pressed(coarse_gel(), punch, 0.0, 0.0, -0.1);
  ReliefSettings settings;
  settings.control = ReliefControl::pose;
  settings.tolerance.gap_mm = 1e-6;
  std::vector<double> force;
  for (const double pitch : {0.08, 0.04, 0.02, 0.01}) {
    settings.pitch = pitch;
    force.push_back(solve_fine_relief(coarse_surface(), press, punch, settings).solved.force);
  }
  EXPECT_LT(std::abs(force[2] - force[3]), 2e-3 * force[3]);
  EXPECT_LT(std::abs(force[2] - force[3]), 0.7 * std::abs(force[0] - force[1]));
}

TEST(FineRelief, AStuckGelCarriesItsImprintAlong) {
  const SphereShape ball{3.0};
  Press press(coarse_gel(), ball, 5.0);
  PressTarget target{Eigen::Matrix3d::Identity(), {AxisControl::at(0), AxisControl::at(0), AxisControl::at(2.7)}};
  press.step(target);
  target.axis[0] = AxisControl::at(0.3);
  const PressState& sheared = press.step(target);
  const ReliefAnswer answer = solve_fine_relief(coarse_surface(), sheared, ball);
  EXPECT_NEAR(answer.tangential({0.0, 0.0}).x(), 0.3, 0.05);
  const HeightField height(coarse_surface(), sheared, &answer);
  double deepest = 0.0;
  double where = 0.0;
  for (double x = -1.0; x <= 1.0; x += 0.01) {
    if (height.at({x, 0.0}) < deepest) deepest = height.at({x, 0.0}), where = x;
  }
  EXPECT_NEAR(where, 0.3, 0.05) << "the imprint is where the object is, not where the gel was";
}

TEST(FineRelief, OutOfContactEverythingIsZero) {
  const SphereShape ball{3.0};
  const PressState press = pressed(coarse_gel(), ball, 0, 0, 3.5);
  const ReliefAnswer answer = solve_fine_relief(coarse_surface(), press, ball);
  EXPECT_EQ(answer.grid.size(), 0u);
  EXPECT_TRUE(answer.solved.converged);
  EXPECT_EQ(answer.solved.force, 0.0);
  const HeightField height(coarse_surface(), press, &answer);
  EXPECT_EQ(height.at({0.3, 0.1}), 0.0);
}

TEST(FineRelief, APreviousAnswerOnlyMakesItQuicker) {
  const RoundedCylinder punch{2.0, 0.2, 3.0};
  const PressState press = pressed(coarse_gel(), punch, 0.0, 0.0, -0.1);
  const PressState next = pressed(coarse_gel(), punch, 0.0, 0.0, -0.102);
  const ReliefAnswer before = solve_fine_relief(coarse_surface(), press, punch);
  const ReliefAnswer cold = solve_fine_relief(coarse_surface(), next, punch);
  const ReliefAnswer warm = solve_fine_relief(coarse_surface(), next, punch, {}, &before);
  EXPECT_LT(warm.solved.iterations, cold.solved.iterations);
  EXPECT_NEAR(warm.solved.shift, cold.solved.shift, 1e-4);
}

TEST(FineRelief, TheNumberOfThreadsChangesNoBit) {
  const SphereShape ball{3.0};
  const PressState press = pressed(coarse_gel(), ball, 0.1, -0.2, 3.0 - 0.3);
  std::vector<double> one;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = solve_fine_relief(coarse_surface(), press, ball).height;
  }
  EXPECT_EQ(one, solve_fine_relief(coarse_surface(), press, ball).height);
}

/// A flat stamp whose face bears waves of `period` along x, `amplitude` from trough to crest.
ReliefShape wavy_stamp(double period, double amplitude) {
  constexpr int kPoints = 64;
  std::vector<float> heights;
  for (int i = 0; i < kPoints; ++i) {
    heights.push_back(static_cast<float>(0.5 * amplitude * (1.0 - std::cos(2.0 * std::numbers::pi * i / kPoints))));
  }
  const Eigen::Vector2d spacing(period / kPoints, 1.0);
  return {RoundedCylinder{2.0, 0.2, 3.0}, std::make_shared<const ReliefMap>(kPoints, 1, Eigen::Vector2d(0, 0), spacing,
                                                                            std::array{true, true}, heights)};
}

/// Trough to crest of the membrane in the stamp's middle, over a period beside the axis.
double imprint(const ReliefShape& stamp, double period, double depth) {
  ReliefShape plain = stamp;
  plain.relief = std::make_shared<const ReliefMap>(stamp.relief->blurred(0.5));
  const PressState press = pressed(coarse_gel(), plain, 0.0, 0.0, -depth);
  ReliefSettings settings;
  settings.pitch = 0.01;
  const ReliefAnswer answer = solve_fine_relief(coarse_surface(), press, stamp, settings);
  EXPECT_TRUE(answer.solved.converged);
  const HeightField height(coarse_surface(), press, &answer);
  double low = 1.0;
  double high = -1.0;
  for (double x = 0.0; x < period; x += 0.002) {
    low = std::min(low, height.at({x, 0.0}));
    high = std::max(high, height.at({x, 0.0}));
  }
  return high - low;
}

// In the stamp's middle the pressure is nearly uniform, so the critical pressure of [Johnson1985, sec. 13.2] decides
// whether the waves are filled: p* = pi E* (amplitude/2) / period.
TEST(FineRelief, WavesAreFilledOrBridgedAsJohnsonSays) {
  const double plane_modulus = 0.33 / (1.0 - 0.49 * 0.49);
  const double depth = 0.15;
  const PressState press = pressed(coarse_gel(), RoundedCylinder{2.0, 0.2, 3.0}, 0.0, 0.0, -depth);
  const ReliefAnswer answer = solve_fine_relief(coarse_surface(), press, RoundedCylinder{2.0, 0.2, 3.0});
  const PixelGrid& grid = answer.grid;
  const double pressure = answer.pressure[grid.at(grid.nx / 2, grid.ny / 2)];
  const double period = 0.4;
  const double critical = 2.0 * period * pressure / (std::numbers::pi * plane_modulus);  // amplitude filled just so
  ASSERT_GT(critical, 0.003);
  EXPECT_NEAR(imprint(wavy_stamp(period, 0.7 * critical), period, depth), 0.7 * critical, 0.01 * critical);
  const double bridged = imprint(wavy_stamp(period, 4.0 * critical), period, depth);
  EXPECT_LT(bridged, 2.5 * critical);
  EXPECT_GT(bridged, 0.5 * critical);
}

/// An elastic body whose face is the plane z = 0, towards -z, or the lower cap of a ball about (0, 0, 0).
std::shared_ptr<const Compliance> elastic_body(const ElasticMaterial& material, double radius) {
  TetMesh mesh = fixtures::box_mesh({4.2, 4.2, 3}, 11, 11, 7);
  for (Eigen::Vector3d& vertex : mesh.vertices) {
    vertex = {vertex.x(), -vertex.y(), -vertex.z()};
    if (radius > 0.0) {
      const double low = -std::sqrt(radius * radius - vertex.head<2>().squaredNorm());
      vertex.z() = low - vertex.z() / 3.0 * low;  // held in the plane z = 0
    }
  }
  return std::make_shared<Compliance>(compute_compliance(mesh, material, {}, 3.0));
}

/// As soft as the gel, the stamp takes half of each wave: of what is filled the gel shows its own compliance's share.
TEST(FineRelief, AnElasticObjectTakesItsShareOfAWave) {
  const double depth = 0.25;
  const double period = 0.4;
  const ElasticMaterial soft{0.33, 0.45};
  const double share = (1.0 - 0.49 * 0.49) / (2.0 - 0.49 * 0.49 - 0.45 * 0.45);
  const RoundedCylinder plain{2.0, 0.2, 3.0};
  const PressBody body{plain, 0.0, elastic_body(soft, 0.0)};
  Press press(coarse_gel(), std::vector{body});
  PressTarget target;
  target.axis = {AxisControl::at(0.0), AxisControl::at(0.0), AxisControl::at(-depth)};
  const PressState& state = press.step(target);
  ReliefSettings settings;
  settings.pitch = 0.01;
  settings.object = soft;
  // Trough to crest, of the wave of the stamp's period alone.
  const auto waves = [&](double amplitude) {
    const ReliefAnswer answer = solve_fine_relief(coarse_surface(), state, wavy_stamp(period, amplitude), settings);
    EXPECT_TRUE(answer.solved.converged);
    const HeightField height(coarse_surface(), state, &answer);
    constexpr int kPlaces = 200;
    double sum = 0.0;
    for (int i = 0; i < kPlaces; ++i) {
      const double x = period * i / kPlaces;
      sum += std::cos(2.0 * std::numbers::pi * x / period) * height.at({x, 0.0});
    }
    return 4.0 * sum / kPlaces;
  };
  const double of_amplitude = (waves(0.01) - waves(0.0)) / 0.01;
  EXPECT_NEAR(std::abs(of_amplitude), share, 0.02 * share);
  settings.object = ElasticMaterial{3e4, 0.45};  // no share
  EXPECT_NEAR(std::abs(waves(0.01) - waves(0.0)) / 0.01, 1.0, 0.02);
}

/// What an elastic ball does, the coarse press knows already.
TEST(FineRelief, AnElasticBallStandsWhereTheCoarsePressHasIt) {
  const double depth = 0.4;
  const ElasticMaterial soft{0.5, 0.45};
  const SphereShape ball{3.0};
  Press press(coarse_gel(), std::vector{PressBody{ball, 0.0, elastic_body(soft, 3.0)}});
  PressTarget target;
  target.axis = {AxisControl::at(0.1), AxisControl::at(-0.2), AxisControl::at(3.0 - depth)};
  const PressState& state = press.step(target);
  ASSERT_EQ(state.object_gives.size(), static_cast<Eigen::Index>(coarse_gel().vertices.size()));
  ReliefSettings settings;
  settings.object = soft;
  const ReliefAnswer answer = solve_fine_relief(coarse_surface(), state, ball, settings);
  EXPECT_TRUE(answer.solved.converged);
  EXPECT_LT(std::abs(answer.solved.shift), 0.03 * depth);
  const HeightField fine(coarse_surface(), state, &answer);
  const HeightField coarse(coarse_surface(), state, nullptr);
  const Eigen::Vector2d middle(0.1, -0.2);
  EXPECT_NEAR(fine.at(middle), coarse.at(middle), 0.03 * depth);
  // Taken for a rigid one, it would sink as deep as it stands.
  const ReliefAnswer rigid = solve_fine_relief(coarse_surface(), state, ball);
  EXPECT_GT(std::abs(rigid.solved.shift), 3.0 * std::abs(answer.solved.shift) + 0.1 * depth);
}

TEST(FineRelief, RefusesWhatItCantDo) {
  const SphereShape ball{3.0};
  const PressState press = pressed(coarse_gel(), ball, 0.0, 0.0, 2.7);
  const auto error_of = [&](const ReliefSettings& settings) {
    try {
      solve_fine_relief(coarse_surface(), press, ball, settings);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  ReliefSettings settings;
  settings.pitch = 0.0005;
  EXPECT_THAT(error_of(settings), HasSubstr("1 to 2048"));
  settings.pitch = std::nan("");
  EXPECT_THAT(error_of(settings), HasSubstr("pitch is nan"));
  Compliance domed = coarse_gel();
  domed.vertices[3].z() = -0.2;
  try {
    const SmoothSurface surface(domed);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("flat and domed gels only"));
  }
}

/// A gel of 3 mm for linear and for large strains, with `edge` where it is pressed.
struct BothGels {
  explicit BothGels(double edge) {
    const TetMesh mesh = mesh_slab(SlabMesh{10.0, 10.0, 3.0, edge, 1.5, 2.0, 2.0, 0.8});
    linear = compute_compliance(mesh, kGel, {}, 3.0);
    finite = std::make_unique<FiniteGel>(mesh, std::span(&kGel, 1), std::vector<Bead>{}, 3.0);
    surface = std::make_unique<SmoothSurface>(linear);
  }
  Compliance linear;
  std::unique_ptr<FiniteGel> finite;
  std::unique_ptr<SmoothSurface> surface;
};

// The coarse press has the large strains, the fine contact only what is smaller than the mesh: linear elasticity's
// share is small. On a mesh of half the edges the same surface comes out.
TEST(FineRelief, AtFiniteStrainItIsNearerToAFinerMeshThanTheMeshsOwnSurface) {
  constexpr double kDepth = 0.45;
  const SphereShape ball{2.0};
  const auto pressed_at = [&](const BothGels& gels) {
    FinitePress press(*gels.finite, ball, 0.5);
    PressTarget target;
    target.axis = {AxisControl::at(0.13), AxisControl::at(0.09), AxisControl::at(ball.radius - kDepth)};
    return press.step(target);
  };
  const BothGels coarse(0.6), fine(0.3);
  const PressState coarse_press = pressed_at(coarse), fine_press = pressed_at(fine);
  const ReliefSettings pixels{.pitch = 0.05, .tolerance = {}, .object = {}};
  const ReliefAnswer coarse_relief = solve_fine_relief(*coarse.surface, coarse_press, ball, pixels);
  const ReliefAnswer fine_relief = solve_fine_relief(*fine.surface, fine_press, ball, pixels);
  const HeightField truth(*fine.surface, fine_press, &fine_relief);
  const auto rms = [&](const ReliefAnswer* relief) {
    const HeightField field(*coarse.surface, coarse_press, relief);
    double squares = 0.0;
    int count = 0;
    for (double y = -1.9; y < 2.0; y += 0.1) {
      for (double x = -1.9; x < 2.0; x += 0.1, ++count) squares += std::pow(field.at({x, y}) - truth.at({x, y}), 2);
    }
    return std::sqrt(squares / count);
  };
  const double with = rms(&coarse_relief), without = rms(nullptr);
  EXPECT_LT(with, 0.4 * without);
  EXPECT_LT(with, 0.005) << "mm: a hundredth of the depth";
  RecordProperty("rms_mm", std::to_string(with) + " for " + std::to_string(without));
}

}  // namespace
}  // namespace touchstone::fem
