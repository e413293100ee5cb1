// The bodies that the contact is tried by, and what it makes of some of them today.

#include "lab/bench/body_bench.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>

#include "lab/bench/body_meshes.h"

namespace touchstone::lab {
namespace {

double lowest(const TriangleMesh& mesh) {
  double z = 1e9;
  for (const auto& vertex : mesh.vertices) z = std::min(z, vertex.z());
  return z;
}

void expect_solid(const TriangleMesh& mesh, double volume, const std::string& what) {
  EXPECT_EQ(fault_of_closed_mesh(mesh), "") << what;
  EXPECT_NEAR(enclosed_volume(mesh), volume, 1e-9 * volume) << what;
  EXPECT_NEAR(lowest(mesh), 0.0, 1e-12) << what;
}

TEST(BodyMeshes, AreClosedAndOfTheVolumeThatTheirMeasuresSay) {
  std::set<int> cells;
  for (const char letter : letters_known()) {
    // The plate, and the letter's cells of the stroke's square.
    const TriangleMesh mesh = letter_on_plate(letter, 0.5, 0.2, 2.0);
    EXPECT_EQ(fault_of_closed_mesh(mesh), "") << letter;
    const double letters_cells = (enclosed_volume(mesh) - 63.0 * 0.25 * 2.0) / (0.25 * 0.2);
    EXPECT_NEAR(letters_cells, std::round(letters_cells), 1e-9) << letter;
    cells.insert(static_cast<int>(std::lround(letters_cells)));
  }
  EXPECT_EQ(*cells.begin(), 7);    // I
  EXPECT_EQ(*cells.rbegin(), 20);  // O
  expect_solid(studs_on_plate(3, 0.5, 1.25, 0.2, 2.0), 3.75 * 3.75 * 2.0 + 9 * 0.25 * 0.2, "studs");
  expect_solid(ridges_on_plate(4, 0.4, 1.0, 5.0, 0.3, 2.0), 4.0 * 5.0 * 2.0 + 4 * 0.4 * 5.0 * 0.3, "ridges");
  const double square = 2.0 * 2.0 * 2.0;  // of circumradius 2
  expect_solid(turned_profile({{0.0, 0.0}, {2.0, 0.0}, {2.0, 3.0}, {0.0, 3.0}}, 4), 3.0 * square, "prism");
  expect_solid(turned_profile({{1.0, 0.0}, {2.0, 0.0}, {2.0, 3.0}, {1.0, 3.0}}, 4), 3.0 * square * 0.75, "ring");
  expect_solid(turned_profile({{0.0, 0.0}, {2.0, 3.0}, {0.0, 3.0}}, 4), square, "cone");
}

TEST(BodyMeshes, AThreadHasItsPitchAndItsFlanks) {
  const double pitch = 1.0;
  const fem::MeshShape rod(threaded_rod(3.0, pitch, 6));
  const auto height = [&](double x) { return *rod.first_entry({x, 0.0, -5.0}, Eigen::Vector3d::UnitZ()) - 5.0; };
  // Along its lowest line: crests at 0, roots 5/8 of the sharp thread's height above them, half a pitch on.
  EXPECT_NEAR(height(0.0), 0.0, 1e-9);
  EXPECT_NEAR(height(0.5), 0.625 * std::sqrt(0.75) * pitch, 1e-9);
  for (const double x : {-2.1, -0.7, 0.2, 1.33}) EXPECT_NEAR(height(x), height(x + pitch), 1e-9) << x;
  EXPECT_NEAR(height(0.3125) - height(0.1875), 0.125 * std::tan(std::numbers::pi / 3.0), 1e-9);
}

/// The quick form's gels, made once.
const std::vector<TrialGel>& quick_gels() {
  static const std::vector<TrialGel> gels = set_up_trials(true, {});
  return gels;
}

constexpr int kQuickTrials = 20;

TEST(BodyDraws, AreWhereTheySayAndTheSameEachTime) {
  std::set<BodyPlace> seen;
  for (int k = 0; k < 3 * kQuickTrials; ++k) {
    const BodyTrial trial = draw_trial(1, k, quick_gels());
    EXPECT_EQ(in_words(trial), in_words(draw_trial(1, k, quick_gels())));
    EXPECT_EQ(trial.body.family, body_families()[static_cast<std::size_t>(k) % body_families().size()]);
    seen.insert(trial.placed);
    const fem::Compliance& mesh = *quick_gels()[trial.gel].own;
    const auto has = [&](auto&& is) { return std::any_of(mesh.vertices.begin(), mesh.vertices.end(), is); };
    if (trial.placed == BodyPlace::on_node) {
      EXPECT_TRUE(has([&](const auto& vertex) { return vertex.template head<2>() == trial.place_mm; }));
    }
    if (trial.placed == BodyPlace::along_edge && trial.body.side && trial.tilt_deg == 0.0) {
      // A node lies on the side's line, and another one.
      const Eigen::Rotation2Dd turn(trial.yaw_deg * std::numbers::pi / 180.0);
      const Eigen::Vector2d along = turn * trial.body.side->direction;
      const Eigen::Vector2d point = trial.place_mm + turn * trial.body.side->point;
      const auto on_line = std::count_if(mesh.vertices.begin(), mesh.vertices.end(), [&](const auto& vertex) {
        const Eigen::Vector2d from = vertex.template head<2>() - point;
        return std::abs(from.x() * along.y() - from.y() * along.x()) < 1e-9;
      });
      EXPECT_GE(on_line, 2) << in_words(trial);
    }
  }
  EXPECT_EQ(seen.size(), 5U);
}

TEST(BodyBench, ItsReferenceSeesABlockOnAPlateAsTheSameBoxAlone) {
  // The box is a shape of its own, by closed forms; the block a mesh. Its plate is 0.3 mm away and can't touch.
  BodyTrial block = draw_trial(1, 5, quick_gels());
  ASSERT_EQ(block.body.family, "block on plate");
  block.gel = 0;
  block.friction = 0.0;
  block.place_mm = {0.13, -0.21};
  block.yaw_deg = 17.0;
  block.depth_mm = 0.1;
  const auto at_height = [](double height) {
    return fem::MeshShape(pattern_on_plate({-1.5, -1.0, 1.0, 1.5}, {-1.3, -0.8, 0.8, 1.3},
                                           {false, false, false, false, true, false, false, false, false}, height,
                                           3.0));
  };
  block.body.height_mm = 0.3;
  block.body.shape = at_height(0.3);
  block.body.lifted = at_height(2.3);
  BodyTrial box = block;
  box.body.shape = fem::BoxShape{{2.0, 1.6, 6.0}};
  box.body.lifted.reset();
  const TrialOutcome of_block = run_trial(block, quick_gels()[0]);
  const TrialOutcome of_box = run_trial(box, quick_gels()[0]);
  ASSERT_GT(of_box.reference_N, 0.01);
  EXPECT_TRUE(of_block.plate_lifted);
  EXPECT_NEAR(of_block.reference_N, of_box.reference_N, 1e-3 * of_box.reference_N);
}

TEST(BodyBench, TodaysErrorsAreNoLargerThanMeasured) {
  std::vector<TrialOutcome> outcomes;
  for (int k = 0; k < kQuickTrials; ++k) {
    const BodyTrial trial = draw_trial(1, k, quick_gels());
    outcomes.push_back(run_trial(trial, quick_gels()[trial.gel]));
    const TrialOutcome& outcome = outcomes.back();
    EXPECT_EQ(outcome.reference_failure, "") << in_words(trial);
    if (outcome.force) {
      std::printf("%+7.2f %% force, %.1f bars, %3d vertices: %s\n", 100.0 * outcome.force->off, outcome.force->bars(),
                  outcome.contact_vertices, in_words(trial).c_str());
    }
    if (!outcome.failure.empty()) std::printf("%s\n", outcome.failure.c_str());
  }
  const TrialSummary force = summarise(outcomes, &TrialOutcome::force);
  const TrialSummary depth = summarise(outcomes, &TrialOutcome::depth);
  const auto failed =
      std::count_if(outcomes.begin(), outcomes.end(), [](const auto& one) { return !one.failure.empty(); });
  std::printf("force: median %.2f %%, within two bars %.0f %%; depth: %.2f %%, %.0f %%; %d fail\n",
              100.0 * force.median, 100.0 * force.within, 100.0 * depth.median, 100.0 * depth.within,
              static_cast<int>(failed));
  // Wanted of 300 bodies against a mesh with 0.35 of the edges (docs/bench/bodies.md): medians below 1 %, at least 95 %
  // within two bars, no failure. The bounds are what these bodies gave on 2026-11-27, and a little more: whoever makes
  // the contact better lowers them.
  EXPECT_EQ(force.count, kQuickTrials);
  EXPECT_LT(force.median, 0.03);   // 2.4 %
  EXPECT_GE(force.within, 0.95);   // 100 %
  EXPECT_LT(depth.median, 0.022);  // 1.6 %
  EXPECT_GE(depth.within, 0.95);   // 100 %
  EXPECT_EQ(failed, 0);
}

}  // namespace
}  // namespace touchstone::lab
