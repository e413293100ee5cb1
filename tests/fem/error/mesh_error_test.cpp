#include "fem/error/mesh_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "core/error.h"
#include "fem/error/press_error.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::target_at;

const SlabMesh kSlab{7.0, 7.0, 2.0, 0.5, 1.2, 2.0, 2.0, 0.6};
const ElasticMaterial kMaterial{0.33, 0.49};
const std::vector<Bead> kBeads = {{{0.2, 0.1, -0.5}, 0.2}};

/// Made once, without a cache.
const Compliance& gel() {
  static const Compliance gel = [] {
    Compliance made = compute_compliance(mesh_slab(kSlab), kMaterial, kBeads, kSlab.thickness);
    made.mesh_error = measure_mesh_error(made, ladder_of(kSlab, kMaterial, kBeads));
    return made;
  }();
  return gel;
}

/// Pressed by a punch of 0.9 mm at a place.
PressState punched(double x, double y) {
  Press press(gel(), RoundedCylinder{0.9, 0.0, 5.0}, 0.0);
  return press.step(target_at(x, y, -0.1));
}

TEST(MeshError, FallsWithTheContactsSizeAndIsAtMostWhole) {
  for (const BodyErrors* body : {&gel().mesh_error.smooth, &gel().mesh_error.sharp}) {
    ASSERT_GE(body->radius_per_edge.size(), 2u);
    EXPECT_TRUE(std::is_sorted(body->radius_per_edge.begin(), body->radius_per_edge.end()));
    for (const ErrorOf kind : {ErrorOf::normal_force, ErrorOf::shear_force, ErrorOf::displacement}) {
      EXPECT_GT(body->mesh_order[kind], 0.3);
      EXPECT_GT(errors_at(*body, 1.5)[kind], errors_at(*body, 3.0)[kind]);
      EXPECT_GT(errors_at(*body, 3.0)[kind], 0.0);
    }
    for (const double tiny : {0.5, 0.1, 1e-3}) {
      for (const double value : errors_at(*body, tiny).values) EXPECT_LE(value, 1.0);
    }
  }
}

TEST(MeshError, SharpBodiesAreWorseThanSmoothOnesOnceResolved) {
  EXPECT_GT(errors_at(gel().mesh_error.sharp, 3.0)[ErrorOf::normal_force],
            2.0 * errors_at(gel().mesh_error.smooth, 3.0)[ErrorOf::normal_force]);
}

TEST(MeshError, LiesOnTheTablesRowsAndStraightBetweenThemInLogarithms) {
  BodyErrors body;
  body.radius_per_edge = {1.0, 4.0};
  body.errors.resize(2);
  body.errors[0].values.fill(0.08);
  body.errors[1].values.fill(0.02);
  body.size_order.values.fill(1.5);
  const auto force_at = [&](double radius) { return errors_at(body, radius)[ErrorOf::normal_force]; };
  EXPECT_DOUBLE_EQ(force_at(1.0), 0.08);
  EXPECT_DOUBLE_EQ(force_at(2.0), 0.04);
  EXPECT_DOUBLE_EQ(force_at(4.0), 0.02);
  EXPECT_DOUBLE_EQ(force_at(50.0), 0.02);
  EXPECT_DOUBLE_EQ(force_at(0.25), 0.64);
  EXPECT_DOUBLE_EQ(force_at(0.01), 1.0);
}

TEST(MeshError, IsTheSameOnOneThreadAndOnMany) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const MeshErrorTable again = measure_mesh_error(gel(), ladder_of(kSlab, kMaterial, kBeads));
  for (const auto& [a, b] :
       {std::pair{&again.smooth, &gel().mesh_error.smooth}, {&again.sharp, &gel().mesh_error.sharp}}) {
    EXPECT_EQ(a->radius_per_edge, b->radius_per_edge);
    ASSERT_EQ(a->errors.size(), b->errors.size());
    for (std::size_t k = 0; k < a->errors.size(); ++k) EXPECT_EQ(a->errors[k].values, b->errors[k].values);
  }
}

TEST(MeshError, AGelWithEdgesOfItsThicknessIsUnknown) {
  const SlabMesh coarse{8.0, 8.0, 1.0, 0.9, 1.0, 3.0, 3.0, 0.5};
  Compliance made = compute_compliance(mesh_slab(coarse), kMaterial, {}, coarse.thickness);
  made.mesh_error = measure_mesh_error(made, ladder_of(coarse, kMaterial, {}));
  EXPECT_TRUE(made.mesh_error.smooth.errors.empty());
  Press press(made, SphereShape{8.0}, 0.0);
  const PressState& state = press.step(target_at(0.0, 0.0, 7.9));
  EXPECT_NEAR(estimate_error(made, state).force.z(), state.wrench[2], 1e-12);
}

TEST(MeshError, LevelsThatCantBeMadeAreLeftOut) {
  LadderGel ladder = ladder_of(kSlab, kMaterial, kBeads);
  const auto make = ladder.with_edges;
  int asked = 0;
  ladder.with_edges = [&](double factor) {
    if (++asked == 1) fail("no such mesh");
    return make(factor);
  };
  EXPECT_FALSE(measure_mesh_error(gel(), ladder).smooth.errors.empty());
  ladder.with_edges = [](double) -> Compliance { fail("no such mesh"); };
  EXPECT_TRUE(measure_mesh_error(gel(), ladder).smooth.errors.empty());
}

TEST(PressError, IsZeroOutOfContact) {
  Press press(gel(), SphereShape{2.0}, 0.3);
  const PressError error = estimate_error(gel(), press.step(target_at(0.0, 0.0, 2.1)));
  EXPECT_EQ(error.force.norm(), 0.0);
  EXPECT_EQ(error.displacement, 0.0);
  EXPECT_EQ(error.beads, 0.0);
  EXPECT_EQ(error.traction, 0.0);
}

TEST(PressError, TellsSpheresFromPunchesByTheirPressure) {
  // Contacts of the same size, three edges in radius.
  Press sphere(gel(), SphereShape{6.0}, 0.0);
  Press punch(gel(), RoundedCylinder{1.5, 0.0, 5.0}, 0.0);
  const PressState& under_sphere = sphere.step(target_at(0.07, 0.05, 6.0 - 0.3));
  const PressState& under_punch = punch.step(target_at(0.07, 0.05, -0.1));
  const double smooth = estimate_error(gel(), under_sphere).force.z() / under_sphere.wrench[2];
  const double sharp = estimate_error(gel(), under_punch).force.z() / under_punch.wrench[2];
  const auto is_of = [](double value, const BodyErrors& body) {
    const double expected = errors_at(body, 3.0)[ErrorOf::normal_force];
    return value > 0.6 * expected && value < 1.6 * expected;
  };
  EXPECT_TRUE(is_of(smooth, gel().mesh_error.smooth)) << smooth;
  EXPECT_TRUE(is_of(sharp, gel().mesh_error.sharp)) << sharp;
}

TEST(PressError, OfAPureNormalPressIsAlongTheNormalButForTheCrossForce) {
  const PressState state = punched(0.1, 0.0);
  const PressError error = estimate_error(gel(), state);
  EXPECT_GT(error.force.z(), 0.0);
  EXPECT_GT(error.force.x(), 0.0);
  EXPECT_LT(error.force.x(), 0.1 * error.force.z());
  EXPECT_DOUBLE_EQ(error.force.x(), error.force.y());
}

TEST(PressError, PatchesApartAreJudgedEachByItself) {
  const PressState left = punched(-1.5, 0.0);
  const PressState right = punched(1.5, 0.1);
  PressState both = left;
  both.traction += right.traction;
  both.bearing_share = left.bearing_share.cwiseMin(right.bearing_share);
  both.surface_displacement += right.surface_displacement;
  both.bead_displacement += right.bead_displacement;
  for (std::size_t v = 0; v < both.node_state.size(); ++v) {
    ASSERT_FALSE(left.node_state[v] != NodeState::open && right.node_state[v] != NodeState::open);
    if (right.node_state[v] != NodeState::open) both.node_state[v] = right.node_state[v];
  }
  const double sum = estimate_error(gel(), left).force.z() + estimate_error(gel(), right).force.z();
  EXPECT_NEAR(estimate_error(gel(), both).force.z(), sum, 1e-12 * sum);
}

TEST(PressError, ScalesWithTheLoad) {
  // A punch's answer is linear in its depth, so its errors are too.
  Press shallow(gel(), RoundedCylinder{0.9, 0.0, 5.0}, 0.0);
  Press deep(gel(), RoundedCylinder{0.9, 0.0, 5.0}, 0.0);
  const PressError small = estimate_error(gel(), shallow.step(target_at(0.1, 0.0, -1e-4)));
  const PressError large = estimate_error(gel(), deep.step(target_at(0.1, 0.0, -2e-4)));
  EXPECT_NEAR(large.force.z() / small.force.z(), 2.0, 1e-4);
  EXPECT_NEAR(large.displacement / small.displacement, 2.0, 1e-4);
  EXPECT_NEAR(large.beads / small.beads, 2.0, 1e-4);
  EXPECT_NEAR(large.traction / small.traction, 2.0, 1e-4);
}

}  // namespace
}  // namespace touchstone::fem
