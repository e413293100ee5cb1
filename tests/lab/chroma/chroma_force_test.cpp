#include "lab/chroma/chroma_force_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "core/error.h"
#include "fem/mesh/slab.h"

namespace touchstone::lab {
namespace {

const ForceSetup& setup() {
  static const ForceSetup made = [] {
    ForceSetup result;
    fem::SlabMesh slab;
    slab.size_x = slab.size_y = 26.0;
    slab.thickness = 5.0;
    slab.fine = 1.0;
    slab.coarse = 2.5;
    slab.fine_half_x = slab.fine_half_y = 9.0;
    slab.fine_depth = 1.0;
    result.truth_gel = std::make_shared<const fem::Compliance>(
        fem::compute_compliance(fem::mesh_slab(slab), fem::ElasticMaterial{0.4, 0.49}, {}, 5.0));
    result.markers.grid = {7, 7};
    for (int j = 0; j < 7; ++j) {
      for (int i = 0; i < 7; ++i) result.markers.markers.push_back({{3.0 * (i - 3), 3.0 * (j - 3)}, 1.0, true});
    }
    result.compliance =
        marker_compliance(*result.truth_gel, result.markers, patches_over(*result.truth_gel, result.markers, 1.5));
    return result;
  }();
  return made;
}

ForceProbe punch() {
  ForceProbe probe;
  probe.shape = ProbeShape::cylinder;
  probe.width_mm = 11.0;
  probe.place = {-0.6, 0.4};
  probe.depth_mm = 0.5;
  probe.friction = 0.5;
  probe.direction_rad = 0.3;
  return probe;
}

TEST(ChromaForce, AProbeIsPressedDraggedAndSlides) {
  int frames = 0, sliding = 0;
  double before = 0.0;
  play_probe(setup(), punch(), {}, [&](const ForceFrame& frame) {
    EXPECT_EQ(frame.number, frames);
    EXPECT_NEAR(frame.drag_mm, 0.1 * frames, 1e-12);
    EXPECT_GT(frame.press.wrench[2], 0.0);
    const double ratio = frame.press.wrench.head<2>().norm() / frame.press.wrench[2];
    EXPECT_LE(ratio, 0.5 * (1.0 + 1e-6)) << "Coulomb";
    if (frame.slides) {
      EXPECT_GT(ratio, 0.46);
    }
    EXPECT_TRUE(frames > 0 || !frame.slides);
    if (!frame.slides) {
      EXPECT_GE(ratio, before - 0.02);
      before = ratio;
    }
    for (const MarkerTruth& marker : frame.markers) {
      EXPECT_LE(marker.stick + marker.slip, 1.0 + 1e-9);
      EXPECT_GE(std::min(marker.stick, marker.slip), -1e-9);
    }
    // The middle marker is under the punch.
    EXPECT_NEAR(frame.markers[24].stick + frame.markers[24].slip, 1.0, 1e-9);
    sliding += frame.slides;
    ++frames;
  });
  EXPECT_GT(sliding, 5);
  EXPECT_LT(frames, 41);
}

TEST(ChromaForce, ForcesAndFrictionComeBackFromNoisyMarkers) {
  const ForceRun run = run_force_probe(setup(), punch(), noisy_truth({7, 7}, 0.02, 0.06, 11));
  const ForceScore result = score({run});
  EXPECT_EQ(result.frames, static_cast<int>(run.samples.size()));
  EXPECT_LT(result.relative, 0.06);
  EXPECT_LT(result.mean_absolute_N.head<2>().maxCoeff(), 0.15);
  EXPECT_EQ(result.slid, 1);
  ASSERT_EQ(result.friction_known, 1);
  EXPECT_LT(result.friction_error, 0.05);
  EXPECT_GT(result.markers.agreement(), 0.75);
  EXPECT_GT(result.sliding_seen, 0);
  // Torques too, about the place that the gel was carried to: some mm from the origin, N mm.
  for (const ForceSample& sample : run.samples) {
    const double arm = (sample.estimate.tail<3>() - sample.truth.tail<3>()).norm() / sample.truth.head<3>().norm();
    EXPECT_LT(arm, 0.6) << sample.frame;
  }
}

TEST(ChromaForce, RunsRepeat) {
  const DragSettings drag{0.1, 0.3, 2};
  const ForceRun first = run_force_probe(setup(), punch(), noisy_truth({7, 7}, 0.02, 0.06, 11), drag);
  const ForceRun second = run_force_probe(setup(), punch(), noisy_truth({7, 7}, 0.02, 0.06, 11), drag);
  const ForceRun other = run_force_probe(setup(), punch(), noisy_truth({7, 7}, 0.02, 0.06, 12), drag);
  ASSERT_EQ(first.samples.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(first.samples[k].estimate, second.samples[k].estimate);
    EXPECT_NE(first.samples[k].estimate, other.samples[k].estimate);
  }
}

TEST(ChromaForce, FramesWithTooFewMarkersAreCountedNotInverted) {
  const MarkerReader whole = noisy_truth({7, 7}, 0.02, 0.06, 11);
  const MarkerReader lost = [&](const ForceFrame& frame) {
    sensors::MarkerField field = whole(frame);
    const auto left = static_cast<std::size_t>(sensors::TractionInversion::kLeastMarkers - (frame.number > 1 ? 1 : 0));
    for (std::size_t m = left; m < field.measured.size(); ++m) field.measured[m] = 0;
    return field;
  };
  const ForceRun run = run_force_probe(setup(), punch(), lost, {0.1, 0.4, 2});
  EXPECT_EQ(run.samples.size(), 2u);
  EXPECT_EQ(run.unread, 3);
  EXPECT_EQ(score({run, run}).unread, 6);
  EXPECT_EQ(score({run, run}).frames, 4);
}

/// Where strains are small, linear and finite elasticity are one; deeper, the linear map must fall behind.
TEST(ChromaForce, LargeStrainsDifferFromSmallOnes) {
  fem::SlabMesh slab;
  slab.size_x = slab.size_y = 15.0;
  slab.thickness = 4.0;
  slab.fine = 1.3;
  slab.coarse = 2.5;
  slab.fine_half_x = slab.fine_half_y = 3.0;
  slab.fine_depth = 1.0;
  const std::array materials = {fem::ElasticMaterial{0.4, 0.49}};
  ForceSetup small;
  small.truth_gel =
      std::make_shared<const fem::Compliance>(fem::compute_compliance(fem::mesh_slab(slab), materials, {}, 4.0));
  const fem::FiniteGel finite(fem::mesh_slab(slab), materials, {}, 4.0);
  small.markers.grid = {5, 5};
  for (int j = 0; j < 5; ++j) {
    for (int i = 0; i < 5; ++i) small.markers.markers.push_back({{2.0 * (i - 2), 2.0 * (j - 2)}, 0.7, true});
  }
  small.compliance =
      marker_compliance(*small.truth_gel, small.markers, patches_over(*small.truth_gel, small.markers, 1.0));
  small.inversion.lateral_noise_mm = small.inversion.normal_noise_mm = 0.002;
  ForceProbe ball = punch();
  ball.shape = ProbeShape::hemisphere;
  ball.width_mm = 16.0;
  const std::vector<LargeStrainRow> rows =
      large_strain_ladder(small, finite, ball, {0.1, 0.8}, noisy_truth({5, 5}, 0.0, 0.0, 1));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_NEAR(rows[0].linear_N, rows[0].truth_N, 0.03 * rows[0].truth_N);
  EXPECT_LT(rows[1].linear_N, 0.97 * rows[1].truth_N);
  EXPECT_LT(rows[1].estimate_N, rows[1].truth_N);
  EXPECT_NEAR(rows[1].estimate_N, rows[1].linear_N, 0.15 * rows[1].linear_N) << "the estimator is linear";
  EXPECT_GT(rows[1].largest_strain, rows[0].largest_strain);
  EXPECT_THAT(
      [&] {
        large_strain_ladder(setup(), finite, ball, {0.1}, noisy_truth({7, 7}, 0, 0, 1));
      },
      ::testing::ThrowsMessage<Error>(::testing::HasSubstr("they need the same mesh")));
}

TEST(ChromaForce, ASetupNeedsMarkers) {
  sim::DeviceSpec bare;
  EXPECT_THAT([&] { set_up_force(bare, {}); },
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr("neither printed markers nor beads")));
  bare.beads = sim::BeadSpec{};
  EXPECT_THAT([&] { set_up_force(bare, {}); },
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr("no printed markers")));
}

TEST(ChromaForce, ScoresAddUp) {
  ForceRun run;
  run.probe.friction = 0.5;
  ForceSample sample;
  sample.truth << 1, 0, 2, 0, 0, 0;
  sample.estimate << 1.5, 0, 1, 0, 0, 0;
  sample.sigma << 0.5, 1, 0.25, 1, 1, 1;
  run.samples.push_back(sample);
  sample.estimate = sample.truth;
  sample.slides = true;
  sample.slip = sensors::ContactSlip::kSliding;
  sample.friction = 0.6;
  run.samples.push_back(sample);
  run.markers.stick_as_stick = 3;
  run.markers.slip_as_stick = 1;
  run.markers.stick_as_unknown = 7;
  const ForceScore result = score({run});
  EXPECT_EQ(result.frames, 2);
  EXPECT_NEAR(result.mean_absolute_N.x(), 0.25, 1e-12);
  EXPECT_NEAR(result.mean_absolute_N.z(), 0.5, 1e-12);
  EXPECT_NEAR(result.relative, 0.5 * std::sqrt(1.25) / std::sqrt(5.0), 1e-12);
  EXPECT_NEAR(result.z_square.z(), 8.0, 1e-12);
  EXPECT_NEAR(result.within_two_bars.z(), 0.5, 1e-12);
  EXPECT_EQ(result.sliding_seen, 1);
  EXPECT_EQ(result.sliding_frames, 1);
  EXPECT_EQ(result.sliding_false, 0);
  EXPECT_NEAR(result.friction_error, 0.1, 1e-12);
  EXPECT_NEAR(result.friction_relative, 0.2, 1e-12);
  EXPECT_NEAR(result.markers.agreement(), 0.75, 1e-12);
}

TEST(ChromaForce, ProbesAreDrawnWithinTheirBounds) {
  const std::vector<ForceProbe> probes = draw_force_probes(30, 5);
  ASSERT_EQ(probes.size(), 30u);
  EXPECT_EQ(probes[0].shape, ProbeShape::square);
  EXPECT_EQ(probes[4].shape, ProbeShape::cylinder);
  EXPECT_EQ(probes[8].shape, ProbeShape::hemisphere);
  for (const ForceProbe& probe : probes) {
    EXPECT_GE(probe.friction, 0.3);
    EXPECT_LE(probe.friction, 1.2);
    EXPECT_LE(probe.place.cwiseAbs().maxCoeff(), 4.0);
    EXPECT_THAT(probe.name(), ::testing::HasSubstr(name_of(probe.shape)));
  }
  EXPECT_EQ(draw_force_probes(3, 5)[2].friction, probes[2].friction) << "a probe is its seed's and number's";
  EXPECT_NE(draw_force_probes(3, 6)[2].friction, probes[2].friction);
}

}  // namespace
}  // namespace touchstone::lab
