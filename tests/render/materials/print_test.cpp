// Discs printed on a surface stay on its material and don't know the mesh.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/random.h"
#include "core/units.h"
#include "render/materials/print.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

using Map = std::function<Eigen::Vector3d(const Eigen::Vector2d&)>;

/// The material square |x|, |y| <= 5, deformed, of `cells` x `cells` squares of two triangles.
Surface printed_sheet(int cells, const Map& deformed, const Material& material, const Print& pattern) {
  Surface surface{{}, material, pattern};
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const Eigen::Vector2d at(5.0 * (2.0 * i / cells - 1.0), 5.0 * (2.0 * j / cells - 1.0));
      surface.print->material_mm.push_back(at);
      surface.mesh.vertices.push_back(deformed(at));
    }
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const int a = j * (cells + 1) + i;
      const int b = a + cells + 1;
      surface.mesh.triangles.push_back({a, a + 1, b + 1});
      surface.mesh.triangles.push_back({a, b + 1, b});
    }
  }
  return surface;
}

Print one_disc(const Eigen::Vector2d& centre, double radius, double ink) {
  Print print;
  print.inks = {grey(ink)};
  print.marks = {{centre, radius, 0}};
  return print;
}

constexpr int kSide = 300;

/// What a grid of vertical rays over |x|, |y| <= half sees: the share that is ink, and the ink's centroid.
struct Seen {
  double share = 0.0;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
};
Seen look_down(const Surface& surface, double half, double ink) {
  Scene scene = empty_scene(1.0);
  scene.surfaces.push_back(surface);
  const Tracer tracer(scene);
  Seen seen;
  int count = 0;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const Eigen::Vector2d at(half * (2.0 * (i + 0.5) / kSide - 1.0), half * (2.0 * (j + 0.5) / kSide - 1.0));
      // A flat matt sheet under surroundings of one shows its albedo.
      const double value = tracer.radiance({at.x(), at.y(), 9.0}, {0, 0, -1}, samples(1))[0];
      if (std::abs(value - ink) > 1e-9) continue;
      ++count;
      seen.centroid += at;
    }
  }
  seen.share = static_cast<double>(count) / (kSide * kSide);
  seen.centroid /= count;
  return seen;
}

const Map kFlat = [](const Eigen::Vector2d& p) { return Eigen::Vector3d(p.x(), p.y(), 0.0); };

TEST(Print, DiscCoversItsAreaOnAnyMesh) {
  for (int cells : {1, 7, 40}) {
    const Surface surface = printed_sheet(cells, kFlat, Lambertian{grey(0.9)}, one_disc({1.2, -0.7}, 2.0, 0.1));
    const Seen seen = look_down(surface, 5.0, 0.1);
    EXPECT_NEAR(seen.share / (kPi * 4.0 / 100.0), 1.0, 2e-3) << cells;
    EXPECT_NEAR((seen.centroid - Eigen::Vector2d(1.2, -0.7)).norm(), 0.0, 5e-3) << cells;
  }
}

// Of 37 x 37 squares of two triangles one of each square's is ink, and a mark lies over both.
TEST(Print, TrianglesOfInkLieUnderTheMarks) {
  Print print = one_disc({1.2, -0.7}, 2.0, 0.1);
  print.inks.push_back(grey(0.3));
  Surface surface = printed_sheet(37, kFlat, Lambertian{grey(0.9)}, print);
  for (std::size_t i = 0; i < surface.mesh.triangles.size(); ++i) surface.print->ground.push_back(i % 2 == 0 ? 1 : -1);
  EXPECT_NEAR(look_down(surface, 5.0, 0.1).share, kPi * 4.0 / 100.0, 3e-4);
  EXPECT_NEAR(look_down(surface, 5.0, 0.3).share, 0.5 * (1.0 - kPi * 4.0 / 100.0), 5e-3);
  surface.print->marks.clear();
  EXPECT_NEAR(look_down(surface, 5.0, 0.3).share, 0.5, 5e-3);
}

TEST(Print, SquareCoversItsSideSquared) {
  Print print = one_disc({1.2, -0.7}, 1.5, 0.1);
  print.marks[0].shape = MarkShape::square;
  const Seen seen = look_down(printed_sheet(5, kFlat, Lambertian{grey(0.9)}, print), 5.0, 0.1);
  EXPECT_NEAR(seen.share / (3.0 * 3.0 / 100.0), 1.0, 2e-3);
  EXPECT_NEAR((seen.centroid - Eigen::Vector2d(1.2, -0.7)).norm(), 0.0, 5e-3);
}

TEST(Print, RectangleCoversItsSides) {
  Print print = one_disc({1.2, -0.7}, 0.4, 0.1);
  print.marks[0].shape = MarkShape::rectangle;
  print.marks[0].half_height = 2.5;
  const Seen seen = look_down(printed_sheet(5, kFlat, Lambertian{grey(0.9)}, print), 5.0, 0.1);
  EXPECT_NEAR(seen.share / (0.8 * 5.0 / 100.0), 1.0, 5e-3);
  EXPECT_NEAR((seen.centroid - Eigen::Vector2d(1.2, -0.7)).norm(), 0.0, 5e-3);
}

TEST(Print, PictureLiesUnderTheMarksAndOverThePlainColour) {
  Print print = one_disc({0, 0}, 0.5, 0.1);
  print.picture = std::make_shared<const PrintedPicture>(PrintedPicture{2, 1, {-2, -1}, {2, 2}, 1, {0.25f, 0.5f}});
  Scene scene = empty_scene(1.0);
  scene.surfaces.push_back(printed_sheet(3, kFlat, Lambertian{grey(0.9)}, print));
  const Tracer tracer(scene);
  const auto albedo = [&](double x, double y) { return tracer.radiance({x, y, 3}, {0, 0, -1}, samples(1))[0]; };
  EXPECT_NEAR(albedo(0.3, 0.1), 0.1, 1e-12);
  EXPECT_NEAR(albedo(-0.7, 0.9), 0.25, 1e-12);
  EXPECT_NEAR(albedo(1.9, -0.9), 0.5, 1e-12);
  EXPECT_NEAR(albedo(0.0, 1.1), 0.9, 1e-12);
  EXPECT_NEAR(albedo(-2.1, 0.0), 0.9, 1e-12);
}

TEST(Print, DiscMovesWithTheMaterial) {
  Eigen::Matrix2d stretch;
  stretch << 1.5, 0.2, -0.1, 0.8;
  const Eigen::Vector2d shift(0.3, -0.4);
  const Map map = [&](const Eigen::Vector2d& p) {
    const Eigen::Vector2d q = stretch * p + shift;
    return Eigen::Vector3d(q.x(), q.y(), 0.0);
  };
  const Surface surface = printed_sheet(5, map, Lambertian{grey(0.9)}, one_disc({1.2, -0.7}, 2.0, 0.1));
  const Seen seen = look_down(surface, 9.0, 0.1);
  EXPECT_NEAR(seen.share / (kPi * 4.0 * stretch.determinant() / 324.0), 1.0, 4e-3);
  EXPECT_NEAR((seen.centroid - (stretch * Eigen::Vector2d(1.2, -0.7) + shift)).norm(), 0.0, 0.01);
}

TEST(Print, LastOfOverlappingDiscsShows) {
  Print print;
  print.inks = {grey(0.1), grey(0.2)};
  print.marks = {{{0, 0}, 1.0, 0}, {{0.5, 0}, 1.0, 1}, {{3, 3}, 0.2, 0}};
  Scene scene = empty_scene(1.0);
  scene.surfaces.push_back(printed_sheet(1, kFlat, Lambertian{grey(0.9)}, print));
  const Tracer tracer(scene);
  const auto albedo = [&](double x, double y) { return tracer.radiance({x, y, 3}, {0, 0, -1}, samples(1))[0]; };
  EXPECT_NEAR(albedo(-0.8, 0), 0.1, 1e-12);
  EXPECT_NEAR(albedo(0.2, 0), 0.2, 1e-12);
  EXPECT_NEAR(albedo(3, 3.1), 0.1, 1e-12);
  EXPECT_NEAR(albedo(-3, 3), 0.9, 1e-12);
}

TEST(Print, InkOnMetalIsMetalOfThatColour) {
  Scene plain = empty_scene(1.0);
  plain.surfaces.push_back({square_sheet(5.0, 0.0), RoughConductor{grey(0.2), 0.3}});
  plain.lamps.push_back(half_space_lamp({3, 0, 4}, {0, 0, -1}, 1e-6));
  Scene printed = plain;
  printed.surfaces[0] = printed_sheet(1, kFlat, RoughConductor{grey(0.8), 0.3}, one_disc({0, 0}, 1.0, 0.2));
  const double expected = Tracer(plain).radiance({0.1, 0, 3}, {0, 0, -1}, samples(64))[0];
  EXPECT_NEAR(Tracer(printed).radiance({0.1, 0, 3}, {0, 0, -1}, samples(64))[0], expected, 1e-6 * expected);
  EXPECT_GT(Tracer(printed).radiance({2.1, 0, 3}, {0, 0, -1}, samples(64))[0], 1.5 * expected);
}

TEST(PrintIndex, FindsWhatASearchOfAllMarksFinds) {
  RandomStream stream(5, 0, Purpose::kTest);
  for (int count : {0, 1, 2, 50, 700}) {
    std::vector<PrintedMark> marks;
    for (int i = 0; i < count; ++i) {
      const double x = 20.0 * stream.uniform() - 10.0;
      const double y = 4.0 * stream.uniform();
      const MarkShape shape = i % 3 == 1 ? MarkShape::square : i % 3 == 2 ? MarkShape::rectangle : MarkShape::round;
      marks.push_back(
          {{x, y}, i % 50 == 7 ? 3.0 : 0.02 + 0.3 * stream.uniform(), 0, shape, 0.01 + 0.9 * stream.uniform()});
    }
    const PrintIndex index(marks);
    for (int i = 0; i < 3000; ++i) {
      const double x = 30.0 * stream.uniform() - 15.0;
      const Eigen::Vector2d at(x, 8.0 * stream.uniform() - 2.0);
      int expected = -1;
      for (int k = 0; k < count; ++k) {
        const Eigen::Vector2d off = at - marks[k].centre;
        const bool round = marks[k].shape == MarkShape::round;
        const double height = marks[k].shape == MarkShape::rectangle ? marks[k].half_height : marks[k].half_width;
        const bool within = std::abs(off.x()) <= marks[k].half_width && std::abs(off.y()) <= height;
        if (round ? off.norm() <= marks[k].half_width : within) expected = k;
      }
      ASSERT_EQ(index.mark_at(at), expected) << count << " marks at " << at.transpose();
    }
    EXPECT_EQ(index.mark_at({std::nan(""), 0.0}), -1);
    EXPECT_EQ(index.mark_at({1e300, -1e300}), -1);
  }
}

}  // namespace
}  // namespace touchstone::render
