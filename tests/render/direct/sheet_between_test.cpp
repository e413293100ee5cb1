// A printed sheet moved to first order against the same sheet drawn where it has moved to.

#include "render/direct/sheet_between.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "render/direct/direct_renderer.h"
#include "tests/render/direct/direct_scenes.h"

namespace touchstone::render {
namespace {

constexpr double kSheetHalf = 7.0;
constexpr int kCells = 140;

/// A smooth way that points of the sheet go, mm, times `size`: aside, and deeper in the middle.
Eigen::Vector3d way(const Eigen::Vector2d& material, double size) {
  const double near = std::exp(-material.squaredNorm() / 8.0);
  return size * near * Eigen::Vector3d(1.0, -0.6 + 0.1 * material.x(), -0.5 * std::exp(-material.squaredNorm() / 3.0));
}

/// The dented sheet with dots of one ink and squares of another, its points moved.
Scene printed_sheet(double size) {
  Scene scene = lit_stack(1.0);
  for (Lamp& lamp : scene.lamps) std::get<SpotLamp>(lamp).lens_radius = 0.0;
  Surface sheet{square_relief(kSheetHalf, kCells, [](double x, double y) { return 0.5 * dent(0.6 * x, 0.6 * y); }),
                Lambertian{grey(0.6)}};
  Print print;
  print.inks = {grey(0.05), grey(0.3)};
  for (int j = -3; j <= 3; ++j) {
    for (int i = -3; i <= 3; ++i) {
      const bool round = (i + j) % 2 == 0;
      print.marks.push_back({{1.6 * i, 1.6 * j}, 0.4, round ? 0 : 1, round ? MarkShape::round : MarkShape::square});
    }
  }
  for (Eigen::Vector3d& vertex : sheet.mesh.vertices) {
    print.material_mm.emplace_back(vertex.head<2>());
    vertex += way(print.material_mm.back(), size);
  }
  sheet.normals = vertex_normals(sheet.mesh);
  sheet.print = std::move(print);
  scene.surfaces.push_back(std::move(sheet));
  return scene;
}

SheetMove move_of(double size) {
  SheetMove move;
  move.pitch = 0.1;
  move.first = Eigen::Vector2d::Constant(-kSheetHalf - 0.2);
  move.nx = move.ny = static_cast<int>(2.0 * (kSheetHalf + 0.2) / move.pitch) + 1;
  for (int j = 0; j < move.ny; ++j) {
    for (int i = 0; i < move.nx; ++i) {
      const Eigen::Vector3d at = way(move.first + move.pitch * Eigen::Vector2d(i, j), size);
      for (int axis = 0; axis < 3; ++axis) move.moved.push_back(static_cast<float>(at[axis]));
    }
  }
  return move;
}

/// A camera and its renderer. Without shadows light is smooth: what first order leaves out shows.
struct Drawing {
  LightField field;
  DirectRenderer renderer;

  explicit Drawing(bool shadows, int finer = 1)
      : field(make_light_field(printed_sheet(0.0), {Eigen::Vector3d(-8, -8, -1.5), Eigen::Vector3d(8, 8, 0.2)},
                               accuracy(1e-3))),
        renderer(field, camera(finer), printed_sheet(0.0), settings(shadows)) {}

  /// `finer`: pixels of that part of the width.
  static PinholeCamera camera(int finer = 1) {
    PinholeCamera camera = small_camera(160 * finer, 120 * finer);
    camera.pixel_pitch_um = 0.4 * small_camera(160, 120).pixel_pitch_um / finer;
    // A blur is spread over whole squares of rays: here the sampling is looked at.
    camera.hole_diameter_um = 1e-3;
    camera.foil_thickness_um = 0.0;
    return camera;
  }
  static DirectSettings settings(bool shadows) {
    DirectSettings settings;
    settings.shadows = shadows;
    return settings;
  }

  SheetBetween points(double size) {
    const Scene scene = printed_sheet(size);
    return {renderer.sheet_points(scene).value(), scene.surfaces[0]};
  }
  cv::Mat moved(const SheetBetween& from, const SheetMove& move) {
    std::vector<float> radiance;
    from.radiance(move, radiance);
    cv::Mat picture;
    renderer.picture_of(radiance, picture);
    return picture;
  }
  /// What the same way of drawing makes of the sheet where it is.
  cv::Mat drawn(double size) { return moved(points(size), move_of(0.0)); }
};

double off(const cv::Mat& one, const cv::Mat& other) {
  return cv::norm(one, other, cv::NORM_L2) / cv::norm(other, cv::NORM_L2);
}

TEST(SheetBetween, WithoutAMoveItIsThePicture) {
  Drawing drawing(true);
  const Scene scene = printed_sheet(0.0);
  // What is left is the picture's own: at marks' outlines it counts sixteen rays a square.
  EXPECT_LT(off(drawing.drawn(0.0), drawing.renderer.render(scene).irradiance), 0.01);
}

/// The mean of squares of side x side pixels.
cv::Mat averaged(const cv::Mat& picture, int side) {
  cv::Mat out(picture.rows / side, picture.cols / side, CV_32FC1);
  for (int row = 0; row < out.rows; ++row) {
    for (int column = 0; column < out.cols; ++column) {
      out.at<float>(row, column) =
          static_cast<float>(cv::mean(picture(cv::Rect(column * side, row * side, side, side)))[0]);
    }
  }
  return out;
}

/// Root mean square and largest difference of logarithms.
std::pair<double, double> off_in_logs(const cv::Mat& one, const cv::Mat& other) {
  cv::Mat a;
  cv::Mat b;
  cv::log(one, a);
  cv::log(other, b);
  return {cv::norm(a, b, cv::NORM_L2) / std::sqrt(static_cast<double>(one.total())), cv::norm(a, b, cv::NORM_INF)};
}

TEST(SheetBetween, OutlinesCoverPixelsByTheirArea) {
  constexpr int kFiner = 4;
  Drawing coarse(false);
  Drawing fine(false, kFiner);
  const Scene scene = printed_sheet(0.0);
  // Sixteen rays in each of sixteen parts of a pixel.
  const cv::Mat truth = averaged(fine.renderer.render(scene).irradiance, kFiner);
  const auto [by_area, worst_by_area] = off_in_logs(coarse.drawn(0.0), truth);
  const auto [by_rays, worst_by_rays] = off_in_logs(coarse.renderer.render(scene).irradiance, truth);
  EXPECT_LT(by_area, 0.5 * by_rays) << "of single rays of sixteen in dark ink: " << by_rays;
  EXPECT_LT(worst_by_area, 0.5 * worst_by_rays) << worst_by_rays;
}

TEST(SheetBetween, WhatItLeavesOutIsOfSecondOrder) {
  Drawing drawing(false);
  const SheetBetween still = drawing.points(0.0);
  const cv::Mat before = drawing.moved(still, move_of(0.0));
  const auto error = [&](double size) { return off(drawing.moved(still, move_of(size)), drawing.drawn(size)); };
  const double whole = error(0.4);
  const double half = error(0.2);
  EXPECT_GT(off(before, drawing.drawn(0.2)), 50.0 * half) << "nothing moves";
  EXPECT_GT(whole, 3.0 * half);
  EXPECT_LT(half, 0.005);
}

TEST(SheetBetween, ReachIsHowFarItGoes) {
  Drawing drawing(false);
  const SheetBetween still = drawing.points(0.0);
  const double mm_per_px = Drawing::camera().pixel_pitch_um * 1e-3 * 27.0 / Drawing::camera().distance_mm;
  const SheetReach reach = still.reach(move_of(0.1));
  // (1, -0.6) along the sheet in the middle, some more by the view of what goes deeper there.
  EXPECT_NEAR(reach.pixels, 0.1 * std::hypot(1.0, 0.6) / mm_per_px, 0.15 * reach.pixels);
  EXPECT_NEAR(still.reach(move_of(0.2)).slope, 2.0 * reach.slope, 0.1 * reach.slope);
  EXPECT_EQ(still.reach(move_of(0.0)).pixels, 0.0);
}

TEST(SheetBetween, AnyNumberOfThreadsGivesTheSameBytes) {
  Drawing drawing(true);
  const cv::Mat many = drawing.moved(drawing.points(0.0), move_of(0.1));
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const cv::Mat one = drawing.moved(drawing.points(0.0), move_of(0.1));
  EXPECT_EQ(cv::norm(many, one, cv::NORM_INF), 0.0);
}

TEST(SheetBetween, OnlyASheetWhoseMaterialIsKnownHasPoints) {
  Drawing drawing(true);
  Scene scene = printed_sheet(0.0);
  scene.surfaces[0].print.reset();
  EXPECT_FALSE(drawing.renderer.sheet_points(scene));
  scene = printed_sheet(0.0);
  scene.surfaces[0].material = RoughConductor{grey(0.6)};
  EXPECT_FALSE(drawing.renderer.sheet_points(scene));
}

}  // namespace
}  // namespace touchstone::render
