#include "lab/studies/design_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/whole_file.h"
#include "lab/studies/study.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using touchstone::test::message_of;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::filesystem::path scenes() {
  return std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
}

DesignPlan grid_of(std::vector<double> a, std::vector<double> b) {
  DesignPlan plan;
  plan.vary = {{"gel.thickness_mm", std::move(a), 0, 0, false, {}},
               {"beads.spacing_mm", std::move(b), 0, 0, false, {}}};
  return plan;
}

DesignPlan box_of(DesignSampling sampling, int designs) {
  DesignPlan plan;
  plan.sampling = sampling;
  plan.designs = designs;
  plan.vary = {{"a", {}, 2.0, 10.0, false, {}}, {"b", {}, 0.01, 100.0, true, {}}, {"c", {}, -1.0, 1.0, false, {}}};
  return plan;
}

TEST(DesignPoints, OfAGridAreAllCombinations) {
  const auto points = design_points(grid_of({1, 2}, {5, 6, 7}));
  ASSERT_EQ(points.size(), 6u);
  EXPECT_THAT(points[0], ElementsAre(1, 5));
  EXPECT_THAT(points[1], ElementsAre(1, 6));
  EXPECT_THAT(points[5], ElementsAre(2, 7));
}

TEST(DesignPoints, FillEachRangeOncePerStrip) {
  // Both samplings put one of 64 designs in each of 64 strips of every variable; logarithmic ones have strips of equal
  // ratio.
  for (const DesignSampling sampling : {DesignSampling::latin_hypercube, DesignSampling::sobol}) {
    const DesignPlan plan = box_of(sampling, 64);
    const auto points = design_points(plan);
    ASSERT_EQ(points.size(), 64u);
    for (std::size_t v = 0; v < 3; ++v) {
      std::set<int> strips;
      for (const auto& point : points) {
        const DesignVariable& of = plan.vary[v];
        const double share = of.logarithmic ? std::log(point[v] / of.from) / std::log(of.to / of.from)
                                            : (point[v] - of.from) / (of.to - of.from);
        EXPECT_GE(share, 0.0);
        EXPECT_LT(share, 1.0 + 1e-12);
        strips.insert(static_cast<int>(share * 64.0 + 1e-9));
      }
      EXPECT_EQ(strips.size(), 64u) << "variable " << v;
    }
    EXPECT_EQ(points, design_points(plan));
    DesignPlan other = plan;
    other.seed = 2;
    EXPECT_NE(points, design_points(other));
  }
}

TEST(DesignPoints, OfSobolFillSquaresToo) {
  // 64 points of a (0,2)-sequence: one in each of the 8 x 8 squares of the first two variables.
  std::set<std::pair<int, int>> squares;
  for (const auto& point : design_points(box_of(DesignSampling::sobol, 64))) {
    squares.emplace(static_cast<int>((point[0] - 2.0) / 8.0 * 8.0),
                    static_cast<int>(std::log(point[1] / 0.01) / std::log(1e4) * 8.0));
  }
  EXPECT_EQ(squares.size(), 64u);
}

TEST(DesignAt, ChangesTheNumbersAndNamesWhatTheDeviceRefuses) {
  const DesignPlan plan = grid_of({3, 5}, {2, 30});
  const DesignBase base = read_design_base(scenes() / "devices" / "vhs.yaml");
  const sim::DeviceSpec device = design_at(base, plan, {3, 2});
  EXPECT_EQ(device.gel.thickness_mm, 3.0);
  EXPECT_EQ(device.beads->spacing_mm, 2.0);
  EXPECT_EQ(std::get<sim::SlabSpec>(device.gel.shape).size_x_mm, 20.0);
  EXPECT_THAT(message_of([&] {
                design_at(base, plan, {3, -2});
              }),
              HasSubstr("with gel.thickness_mm 3, beads.spacing_mm -2: "));
  DesignPlan wrong = plan;
  wrong.vary[0].path = "gel.thicknes_mm";
  EXPECT_THAT(message_of([&] { check_paths(base, wrong); }), HasSubstr("thickness_mm"));
}

/// error = 0.3 a^-2 b, range = 4 a; designs of b = 3 can't be had.
DesignTable made_up() {
  DesignTable table;
  table.plan = grid_of({1, 2, 4}, {1, 2, 3});
  table.figures = {{"error_N", Better::lower, "made up"}, {"range_N", Better::higher, "made up"}};
  table.points = design_points(table.plan);
  for (const auto& point : table.points) {
    const bool had = point[1] < 3;
    table.values.push_back({had ? 0.3 / (point[0] * point[0]) * point[1] : kNone, had ? 4.0 * point[0] : kNone});
    table.faults.push_back(had ? "" : "the beads \"touch\"");
  }
  table.base = {0.2, 3.0};
  return table;
}

TEST(DesignTable, TheFrontIsWhatNothingBeats) {
  DesignTable table = made_up();
  const std::vector<std::size_t> both = {0, 1};
  // A larger `a` is better in both, a smaller b in the error.
  EXPECT_THAT(pareto_front(table, both), ElementsAre(6));
  table.figures[1].better = Better::lower;
  EXPECT_THAT(pareto_front(table, both), ElementsAre(0, 3, 6));
  table.figures[1].better = Better::near;  // doesn't count
  EXPECT_THAT(pareto_front(table, both), ElementsAre(6));
}

TEST(DesignTable, ElasticitiesOfAPowerLawAreItsExponents) {
  const DesignTable table = made_up();
  const Elasticity error = elasticity(table, 0);
  EXPECT_EQ(error.designs, 6);
  EXPECT_NEAR(error.slope[0], -2.0, 1e-12);
  EXPECT_NEAR(error.slope[1], 1.0, 1e-12);
  EXPECT_NEAR(error.r2, 1.0, 1e-12);
  DesignTable one = table;
  for (auto& values : one.values) values[0] = -1.0;
  EXPECT_EQ(elasticity(one, 0).designs, 0);
}

TEST(DesignTable, TheReportHasTableFrontAndPlots) {
  const DesignTable table = made_up();
  const StudyResult result = design_report(table, {"s", "A title.", "An answer.", {0, 1}, {0, 1}, {6}});
  ASSERT_EQ(result.files.size(), 4u);
  EXPECT_EQ(result.files[0].name, "s.csv");
  EXPECT_THAT(result.files[0].text, HasSubstr("gel.thickness_mm,beads.spacing_mm,error_N,range_N,fault\n1,1,0.3,4,\n"));
  EXPECT_THAT(result.files[0].text, HasSubstr("\"the beads 'touch'\""));
  EXPECT_THAT(result.files[1].text, HasSubstr("| 4 | 1 | 0.0187 | 16 |"));
  EXPECT_THAT(result.files[1].text, HasSubstr("| error_N | -2.00 | +1.00 | 1.00 |"));
  EXPECT_THAT(result.files[2].text, HasSubstr("<svg"));
  EXPECT_EQ(result.files[2].name, "s-error_N.svg");
  EXPECT_EQ(result.notes.size(), 3u);
  EXPECT_THAT(message_of([&] { figure_number(table.figures, "eror_N", {}); }), HasSubstr("error_N"));
}

TEST(BeadForceStudy, FilesAreRefusedWithTheirLine) {
  const test::TemporaryFolder folder;
  const std::string s = scenes().string();
  const std::string head = "name: x\nkind: bead_force\ndevice: " + s + "/devices/vhs.yaml\nobject: " + s +
                           "/objects/probe-6mm.yaml\ntraining: " + s + "/motions/load-cycle.yaml\nverification: " + s +
                           "/motions/verification.yaml\n";
  const auto refused = [&](const std::string& rest) {
    write_whole_file(folder.path() / "s.yaml", head + rest);
    return message_of([&] { read_study(folder.path() / "s.yaml"); });
  };
  EXPECT_EQ(refused("vary: [{path: gel.thickness_mm, values: [3, 4]}]\n"), "no error");
  EXPECT_THAT(refused("vary: [{path: gel.thickness_mm, values: [3, 3]}]\n"),
              HasSubstr("s.yaml:7: values: 3 after 3, they must rise"));
  EXPECT_THAT(refused("vary: [{path: gel.thickness_mm, from: 3, to: 4}]\n"), HasSubstr("a grid needs values"));
  EXPECT_THAT(refused("vary: [{path: gel.thick, values: [3]}]\n"), HasSubstr("s.yaml:7: "));
  EXPECT_THAT(refused("vary: [{path: gel.thickness_mm, values: [3]}]\nload_N: 5\nmost_N: 4\n"),
              HasSubstr("s.yaml:9: most_N"));
  EXPECT_THAT(refused("sampling: sobol\nvary: [{path: gel.thickness_mm, from: 3, to: 4}]\n"), HasSubstr("designs"));
}

}  // namespace
}  // namespace touchstone::lab
