// The statistics that the procedural surfaces promise: grain sizes, pitches, cell sizes, roughness; that they go on
// without a seam; that a seed is a piece and nothing else.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <set>

#include "core/error.h"
#include "core/units.h"
#include "sim/relief/relief.h"
#include "sim/relief/relief_cells.h"
#include "sim/relief/relief_tile.h"
#include "sim/scene/object.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kPixel_mm = 0.02;

/// `side` mm of a map, from the origin.
cv::Mat heights_of(const fem::ReliefMap& map, double side, double pixel = kPixel_mm) {
  const int n = static_cast<int>(std::lround(side / pixel));
  cv::Mat heights(n, n, CV_32FC1);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) heights.at<float>(j, i) = static_cast<float>(map.at(i * pixel, j * pixel));
  }
  return heights;
}

/// Sq, mm: root mean square about the mean plane's height.
double sq_of(const cv::Mat& heights) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(heights, mean, deviation);
  return deviation[0];
}

/// The period, mm, of the strongest wave along x (or y) alone, among those from `shortest` to `longest`.
double strongest_period(const cv::Mat& heights, bool along_x, double shortest, double longest) {
  cv::Mat profile;
  cv::reduce(heights, profile, along_x ? 0 : 1, cv::REDUCE_AVG, CV_64F);
  profile = profile.reshape(1, 1) - cv::mean(profile);
  double best = 0.0, period = 0.0;
  for (double length = shortest; length <= longest; length *= 1.002) {
    double re = 0.0, im = 0.0;
    for (int i = 0; i < profile.cols; ++i) {
      const double window = 0.5 - 0.5 * std::cos(2.0 * kPi * i / profile.cols);
      const double phase = 2.0 * kPi * i * kPixel_mm / length;
      re += window * profile.at<double>(0, i) * std::cos(phase);
      im += window * profile.at<double>(0, i) * std::sin(phase);
    }
    if (std::hypot(re, im) > best) {
      best = std::hypot(re, im);
      period = length;
    }
  }
  return period;
}

std::vector<std::filesystem::path> texture_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/objects/textures")) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(TextureObjects, AreFortyOfTheTextsKinds) {
  std::map<std::string, int> kinds;
  std::set<std::string> names;
  for (const auto& file : texture_files()) {
    const ObjectSpec object = read_object(file);
    EXPECT_EQ(object.name, file.stem().string());
    ASSERT_TRUE(object.relief) << file;
    ++kinds[std::visit([](const auto& kind) { return std::string(kind.kType); }, object.relief->kind)];
    names.insert(object.name);
  }
  EXPECT_EQ(names.size(), 40U);
  const std::map<std::string, int> expected{{"fabric", 14},   {"foam", 13},   {"tissue", 3},
                                            {"sandpaper", 7}, {"plastic", 1}, {"wood", 2}};
  EXPECT_EQ(kinds, expected);
}

/// Small pieces of one surface of each kind, as functions of the seed.
std::vector<std::pair<std::string, std::function<fem::ReliefMap(std::uint64_t)>>> small_pieces() {
  const auto piece = [](auto kind) {
    kind.size_mm = 5.0;
    return [kind](std::uint64_t seed) {
      auto one = kind;
      one.seed = seed;
      return relief_map(one);
    };
  };
  FabricRelief twill, knit, corduroy, felt;
  twill.weave = Weave::twill;
  twill.twist_mm = 0.9;
  twill.twist_um = 20;
  twill.fuzz_per_mm2 = 2;
  knit.weave = Weave::knit;
  knit.pitch_mm = {0.7, 0.5};
  knit.yarn_mm = {0.28, 0.28};
  corduroy.weave = Weave::corduroy;
  corduroy.pitch_mm = {1.2, 1.2};
  felt.weave = Weave::felt;
  felt.yarn_mm = {0.04, 0.04};
  felt.fuzz_per_mm2 = 20;
  FoamRelief closed, beads;
  closed.kind = FoamKind::closed;
  beads.kind = FoamKind::beads;
  TissueRelief dots;
  dots.embossing = Embossing::dots;
  return {{"twill", piece(twill)},
          {"knit", piece(knit)},
          {"corduroy", piece(corduroy)},
          {"felt", piece(felt)},
          {"open", piece(FoamRelief{})},
          {"closed", piece(closed)},
          {"beads", piece(beads)},
          {"tissue", piece(dots)},
          {"sandpaper", piece(SandpaperRelief{})},
          {"plastic", piece(PlasticRelief{})},
          {"wood", piece(WoodRelief{})}};
}

TEST(TextureRelief, ASeedIsAPieceAndNothingElse) {
  for (const auto& [name, piece] : small_pieces()) {
    SCOPED_TRACE(name);
    const cv::Mat one = heights_of(piece(1), 4.0), again = heights_of(piece(1), 4.0), other = heights_of(piece(2), 4.0);
    EXPECT_EQ(cv::norm(one, again, cv::NORM_INF), 0.0);
    EXPECT_GT(cv::norm(one, other, cv::NORM_L1) / static_cast<double>(one.total()), 0.1 * sq_of(one));  // another piece
    EXPECT_NEAR(sq_of(other) / sq_of(one), 1.0, 0.35);  // of the same material
  }
}

TEST(TextureRelief, GoesOnWithoutASeam) {
  for (const auto& [name, piece] : small_pieces()) {
    SCOPED_TRACE(name);
    const fem::ReliefMap map = piece(3);
    // The first period is found as the shift that gives the same heights; steps across its border are as all others.
    const cv::Mat heights = heights_of(map, 14.0);
    std::vector<double> steps;  // mean |difference| between columns i and i + 1
    for (int i = 0; i + 1 < heights.cols; ++i) {
      steps.push_back(cv::norm(heights.col(i), heights.col(i + 1), cv::NORM_L1) / heights.rows);
    }
    // The lattice that the weave or the embossing has makes unequal steps, but none that stands alone: the largest step
    // recurs in the tile's interior.
    std::vector<double> sorted = steps;
    std::sort(sorted.begin(), sorted.end());
    const double usual = sorted[sorted.size() * 98 / 100];  // borders are less than one column in a hundred
    EXPECT_LT(sorted.back(), 3.0 * usual);
    EXPECT_GT(usual, 0.0);
  }
}

TEST(FabricRelief, PeaksAtItsPitch) {
  for (const Weave weave : {Weave::plain, Weave::knit, Weave::corduroy}) {
    FabricRelief cloth;
    cloth.weave = weave;
    cloth.pitch_mm = weave == Weave::corduroy ? Eigen::Vector2d(1.2, 1.2) : Eigen::Vector2d(0.6, 0.45);
    cloth.yarn_mm = weave == Weave::knit ? Eigen::Vector2d(0.25, 0.25) : Eigen::Vector2d(0.5, 0.4);
    cloth.irregularity = 0.05;
    cloth.size_mm = 9.0;
    const cv::Mat heights = heights_of(relief_map(cloth), 9.0);
    SCOPED_TRACE(static_cast<int>(weave));
    // Along x a wale of a knit shows its two legs.
    const double across = weave == Weave::knit ? 0.5 * cloth.pitch_mm.x() : cloth.pitch_mm.x();
    EXPECT_NEAR(strongest_period(heights, true, 0.8 * across, 1.3 * across), across, 0.02 * across);
    if (weave == Weave::corduroy) continue;
    EXPECT_NEAR(strongest_period(heights, false, 0.8 * cloth.pitch_mm.y(), 1.3 * cloth.pitch_mm.y()),
                cloth.pitch_mm.y(), 0.02 * cloth.pitch_mm.y());
  }
}

TEST(FabricRelief, WeavesAreTheTextbooks) {
  FabricRelief cloth;
  const auto share_over = [&](int repeat) {
    int over = 0;
    for (int end = 0; end < repeat; ++end) {
      for (int pick = 0; pick < repeat; ++pick) over += warp_is_over(cloth, end, pick) ? 1 : 0;
    }
    return static_cast<double>(over) / (repeat * repeat);
  };
  EXPECT_DOUBLE_EQ(share_over(2), 0.5);
  EXPECT_NE(warp_is_over(cloth, 0, 0), warp_is_over(cloth, 1, 0));
  cloth.weave = Weave::basket;
  EXPECT_DOUBLE_EQ(share_over(4), 0.5);
  EXPECT_EQ(warp_is_over(cloth, 0, 0), warp_is_over(cloth, 1, 1));
  cloth.weave = Weave::twill;
  cloth.over = 3;
  cloth.under = 1;
  EXPECT_DOUBLE_EQ(share_over(4), 0.75);
  for (int k = 0; k < 8; ++k) EXPECT_EQ(warp_is_over(cloth, k, 2 + k), warp_is_over(cloth, 0, 2));  // the diagonal
  cloth.weave = Weave::herringbone;
  cloth.over = cloth.under = 2;
  EXPECT_DOUBLE_EQ(share_over(16), 0.5);
  for (int k = 0; k < 8; ++k) {  // it turns back after 8 ends
    EXPECT_EQ(warp_is_over(cloth, 7 - k, 5), warp_is_over(cloth, 8 + k, 5));
  }
  cloth.weave = Weave::satin;
  cloth.harness = 8;
  cloth.step = 3;
  EXPECT_DOUBLE_EQ(share_over(8), 7.0 / 8.0);
  std::set<int> binders;
  for (int end = 0; end < 8; ++end) {
    for (int pick = 0; pick < 8; ++pick) {
      if (!warp_is_over(cloth, end, pick)) binders.insert(pick);
    }
  }
  EXPECT_EQ(binders.size(), 8U);  // each pick binds once
}

TEST(SandpaperRelief, GrainsHaveTheGradesSizeAndNumber) {
  EXPECT_DOUBLE_EQ(grain_size_mm(60), 0.269);
  EXPECT_DOUBLE_EQ(grain_size_mm(220), 0.068);
  double last = 1.0, last_sq = 1.0;
  for (const int grit : {60, 80, 100, 120, 150, 180, 220}) {
    SandpaperRelief paper;
    paper.grit = grit;
    paper.size_mm = 8.0;
    paper.backing_um = 0.0;
    const double size = grain_size_mm(grit);
    EXPECT_LT(size, last);
    last = size;
    EXPECT_NEAR(grains_per_mm2(paper) * kPi * size * size / 4.0, paper.coat, 1e-12);
    const cv::Mat heights = heights_of(relief_map(paper), 8.0);
    const double sq = sq_of(heights);
    EXPECT_LT(sq, last_sq) << grit;
    last_sq = sq;
    // Half of a grain stands out, so heights go from 0 to about that, and the roughness is a fifth of a grain.
    EXPECT_NEAR(sq / size, 0.2, 0.05) << grit;
    double highest = 0.0;
    cv::minMaxLoc(heights, nullptr, &highest);
    EXPECT_GT(highest, 0.6 * size) << grit;
    EXPECT_LT(highest, 2.0 * size) << grit;
  }
}

TEST(FoamRelief, CellsHaveTheirMeanSize) {
  for (const double cell : {0.4, 0.8}) {
    const Eigen::Vector2d size(12.0, 12.0);
    RandomStream random(5, 0, Purpose::kTest);
    std::vector<CellPoint> points;
    for (const auto& place : scatter(size, 4.0 / (kPi * cell * cell), 0.6, random)) points.push_back({place, 0.0});
    const CellDiagram diagram(size, points);
    const double mean_area = size.prod() / static_cast<double>(diagram.points().size());
    EXPECT_NEAR(std::sqrt(4.0 * mean_area / kPi), cell, 0.01 * cell);
  }
}

TEST(CellDiagram, WallsAreMidwayBetweenPointsOfOneWeight) {
  const Eigen::Vector2d size(4.0, 4.0);
  std::vector<CellPoint> points;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) points.push_back({{i + 0.5, j + 0.5}, 0.0});
  }
  const CellDiagram diagram(size, points);
  const CellPlace place = diagram.at({0.6, 0.55});
  EXPECT_EQ(place.cell, 0);
  EXPECT_NEAR(place.wall, 0.4, 1e-12);
  EXPECT_EQ(place.neighbour, 1);
  EXPECT_NEAR(place.second_wall, 0.45, 1e-12);
  EXPECT_NEAR(diagram.at({3.9, 0.5}).wall, 0.1, 1e-12);  // across the border
  EXPECT_EQ(diagram.at({3.9, 0.5}).neighbour, 0);
  // A heavier point moves its walls outwards: by (w1 - w2) / (2 distance).
  points[0].weight = 0.2;
  EXPECT_NEAR(CellDiagram(size, points).at({0.6, 0.55}).wall, 0.5, 1e-12);
}

TEST(CellDiagram, ScatteredPointsKeepTheirDistance) {
  const Eigen::Vector2d size(6.0, 4.0);
  RandomStream random(9, 0, Purpose::kTest);
  const auto points = scatter(size, 20.0, 0.6, random);
  EXPECT_EQ(points.size(), 480U);
  double least = 1e9;
  for (std::size_t a = 0; a < points.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      Eigen::Vector2d offset = points[a] - points[b];
      for (int k = 0; k < 2; ++k) offset[k] -= size[k] * std::round(offset[k] / size[k]);
      least = std::min(least, offset.norm());
    }
  }
  EXPECT_GE(least, 0.6 / std::sqrt(20.0) - 1e-12);
}

TEST(ReliefTile, RandomFieldsHaveUnitPowerAndTheirCorrelation) {
  ReliefTile tile({6.0, 6.0}, 0.0F);
  RandomStream random(3, 0, Purpose::kTest);
  const double lx = 0.1, ly = 0.3;
  const std::vector<float> field = smooth_field(tile, {lx, ly}, random);
  const auto correlation = [&](int di, int dj) {
    double sum = 0.0;
    for (int j = 0; j < tile.ny; ++j) {
      for (int i = 0; i < tile.nx; ++i)
        sum += static_cast<double>(field[tile.at(i, j)]) * field[tile.at(i + di, j + dj)];
    }
    return sum / static_cast<double>(field.size());
  };
  EXPECT_NEAR(correlation(0, 0), 1.0, 1e-4);
  for (const int steps : {2, 4, 7}) {
    EXPECT_NEAR(correlation(steps, 0), std::exp(-std::pow(steps * tile.spacing.x() / lx, 2)), 0.08);
    EXPECT_NEAR(correlation(0, steps), std::exp(-std::pow(steps * tile.spacing.y() / ly, 2)), 0.08);
  }
}

TEST(ReliefTile, RandomWavesAreSmoothAndClosed) {
  RandomStream random(4, 0, Purpose::kTest);
  double squares = 0.0;
  constexpr int kWaves = 400;
  for (int k = 0; k < kWaves; ++k) {
    const auto wave = random_wave(10.0, 0.5, random);
    EXPECT_NEAR(wave(0.0), wave(10.0), 1e-9);
    squares += wave(1.7) * wave(1.7);
  }
  EXPECT_NEAR(squares / kWaves, 1.0, 0.2);
}

TEST(WoodRelief, GrainRunsAlongY) {
  WoodRelief wood;
  wood.size_mm = 6.0;
  const cv::Mat heights = heights_of(relief_map(wood), 6.0);
  const cv::Mat across = heights.colRange(1, heights.cols) - heights.colRange(0, heights.cols - 1);
  const cv::Mat along = heights.rowRange(1, heights.rows) - heights.rowRange(0, heights.rows - 1);
  EXPECT_GT(cv::norm(across) / cv::norm(along), 2.0);
}

TEST(TissueRelief, KnobsAreRaisedByTheEmbossing) {
  TissueRelief tissue;
  tissue.embossing = Embossing::dots;
  tissue.emboss_mm = 1.5;
  tissue.emboss_um = 150;
  tissue.size_mm = 6.0;
  const fem::ReliefMap map = relief_map(tissue);
  // Knobs of a hexagonal lattice stand at (0, 0) and at (1/2, sqrt(3)/2) of the pitch; midway along x is the sheet.
  double knobs = 0.0, sheet = 0.0;
  for (int k = 0; k < 4; ++k) {
    for (const double off : {-0.1, 0.0, 0.1}) {
      knobs += map.at(1.5 * k + off, off) + map.at(1.5 * k + 0.75 + off, 0.75 * std::sqrt(3.0));
      sheet += map.at(1.5 * k + 0.75 + off, off) + map.at(1.5 * k + off, 0.75 * std::sqrt(3.0));
    }
  }
  EXPECT_NEAR((knobs - sheet) / 24.0, 0.15, 0.03);
}

TEST(TextureRelief, RefusesBadFigures) {
  const auto message = [](const std::string& relief) -> std::string {
    try {
      parse_yaml<ObjectSpec>("name: a\nshape: {type: sphere, radius_mm: 3}\nrelief: " + relief + "\n", "object.yaml");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message("{type: sandpaper, grit: 120}"), "");
  EXPECT_THAT(message("{type: sandpaper, grit: 119}"), HasSubstr("there's no grit P119; known are P40, P60"));
  EXPECT_THAT(message("{type: sandpaper, grit: 120, coat: 1.2}"), HasSubstr("from 0.05 to 1"));
  EXPECT_THAT(message("{type: sandpaper}"), HasSubstr("grit"));
  EXPECT_THAT(message("{type: fabric, weave: velvet, pitch_mm: [1, 1], yarn_mm: [1, 1], thickness_mm: 1}"),
              HasSubstr("velvet"));
  EXPECT_THAT(message("{type: fabric, weave: satin, pitch_mm: [1, 1], yarn_mm: [1, 1], thickness_mm: 1, harness: 8, "
                      "step: 2}"),
              HasSubstr("a satin of 8 can't be shifted by 2"));
  EXPECT_THAT(message("{type: fabric, weave: plain, pitch_mm: [1, 1], yarn_mm: [1, 1], thickness_mm: 1, over: 2}"),
              HasSubstr("over"));
  EXPECT_THAT(message("{type: foam, kind: open, cell_mm: 0.5, wall_mm: 0.6, depth_um: 100}"),
              HasSubstr("leave nothing"));
  EXPECT_THAT(message("{type: foam, kind: beads, cell_mm: 5, wall_mm: 0.6, depth_um: 100}"), HasSubstr("too large"));
  EXPECT_THAT(message("{type: wood, ring_mm: 2, ring_um: 10, vessels_per_mm2: 0, vessel_um: 100}"),
              HasSubstr("vessel"));
  EXPECT_THAT(message("{type: tissue, embossing: none, emboss_um: 3, crepe_mm: 0.3, crepe_um: 10}"),
              HasSubstr("emboss_um"));
  EXPECT_THAT(message("{type: plastic, pebble_mm: 1, valley_mm: 1.5, depth_um: 50}"), HasSubstr("valley_mm"));
}

}  // namespace
}  // namespace touchstone::sim
