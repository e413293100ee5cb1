// Horizons of sheets whose answer is known in closed form.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "render/direct/sheet_horizons.h"

namespace touchstone::render {
namespace {

/// A sheet of z(x, y) over 10 x 10 mm, its points moved aside so that no line of the horizons' grid is one of its own.
TriangleMesh sheet_of(const std::function<double(double, double)>& height, int cells = 400) {
  TriangleMesh mesh;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const double x = -5.0 + 10.0 * i / cells + 0.003 * std::sin(3.0 * j);
      const double y = -5.0 + 10.0 * j / cells;
      mesh.vertices.emplace_back(x, y, height(x, y));
    }
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const int a = j * (cells + 1) + i;
      const int c = a + cells + 1;
      mesh.triangles.push_back({a, a + 1, c + 1});
      mesh.triangles.push_back({a, c + 1, c});
    }
  }
  return mesh;
}

constexpr double kHigh = 0.5, kRadius = 1.5;

/// A paraboloid towards the light, over a plane.
double bump(double x, double y, double side) {
  return side * std::max(0.0, kHigh * (1.0 - (x * x + y * y) / (kRadius * kRadius)));
}

float horizon(const SheetHorizons& horizons, const Eigen::Vector2d& place, const Eigen::Vector2d& to) {
  float all[SheetHorizons::kAround];
  horizons.at(float(place.x()), float(place.y()), all);
  const SheetHorizons::Between at = SheetHorizons::between(SheetHorizons::azimuth(float(to.x()), float(to.y())));
  const float* const p = all + at.low;
  return SheetHorizons::spline(p[0], p[1], p[2], p[3], at.share);
}

// From D beside its middle the bump's horizon is where a line touches it: at x = D - sqrt(D^2 - R^2) from the middle,
// with the slope 2 H x / R^2.
TEST(SheetHorizons, ABumpStandsAsHighAsItsTangent) {
  for (const double side : {1.0, -1.0}) {
    HorizonSettings settings;
    settings.side = float(side);
    settings.flattest = 0.1f;
    settings.pitch = 0.04f;
    const auto found = SheetHorizons::find(sheet_of([&](double x, double y) { return bump(x, y, side); }), settings);
    ASSERT_TRUE(found);
    for (int k = 0; k < 37; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / 37.0;
      const Eigen::Vector2d out(std::cos(angle), std::sin(angle));
      for (const double distance : {1.6, 2.0, 2.7}) {
        const Eigen::Vector2d place = distance * out;
        const double touch = distance - std::sqrt(distance * distance - kRadius * kRadius);
        const double expected = 2.0 * kHigh * touch / (kRadius * kRadius);
        // Azimuths are at most 14 degrees apart: half way a line passes the middle aside by a tenth of the distance and
        // sees less.
        EXPECT_NEAR(horizon(*found, place, -out), expected, 0.05 * expected) << angle << " " << distance;
        EXPECT_NEAR(horizon(*found, place, out), 0.0, 1e-6);
        EXPECT_TRUE(found->any(float(place.x()), float(place.y())));
      }
      // On its far side the bump's own slope is the horizon.
      const double own = 0.8;
      EXPECT_NEAR(horizon(*found, own * out, -out), 2.0 * kHigh * own / (kRadius * kRadius), 0.02);
    }
    EXPECT_FALSE(found->any(4.9f, 4.9f));
  }
}

// A wall of height H is H / d high at the distance d in front of it, H / (d sin(angle)) aside.
TEST(SheetHorizons, AWallIsLowerFromAfar) {
  HorizonSettings settings;
  settings.flattest = 0.05f;
  settings.pitch = 0.05f;
  constexpr double kWall = 0.3;
  const auto found = SheetHorizons::find(
      sheet_of([](double x, double) { return -kWall * std::clamp((x - 1.0) / 0.02 + 0.5, 0.0, 1.0); }, 800), settings);
  ASSERT_TRUE(found);
  for (const double distance : {0.4, 1.0, 2.0}) {
    for (const double angle : {-0.6, 0.0, 0.3, 0.9}) {
      const double expected = kWall / distance * std::cos(angle);
      // The wall's top is found at the first place on it, by up to a pitch too far away.
      const double pitch = double(settings.pitch) * (distance < 0.9 ? 1 : settings.far_pitches);
      EXPECT_NEAR(horizon(*found, {1.0 - distance, 0.0}, {std::cos(angle), std::sin(angle)}), expected,
                  (pitch / distance + 0.02) * expected)
          << distance << " " << angle;
    }
  }
  // Behind the wall, on its top, nothing stands higher.
  EXPECT_NEAR(horizon(*found, {1.5, 0.0}, {1.0, 0.0}), 0.0, 1e-6);
}

TEST(SheetHorizons, WhatIsFlatterThanAllLightHidesNone) {
  HorizonSettings settings;
  settings.flattest = 1.0f;  // steeper than the bump's 0.67
  const auto found = SheetHorizons::find(sheet_of([](double x, double y) { return bump(x, y, -1.0); }), settings);
  ASSERT_TRUE(found);
  for (const float x : {0.0f, 0.7f, 1.4f, 3.0f}) EXPECT_FALSE(found->any(x, 0.0f));
}

TEST(SheetHorizons, ASheetThatFoldsIsNoHeightField) {
  TriangleMesh folded = sheet_of([](double x, double y) { return bump(x, y, -1.0); }, 40);
  folded.vertices[folded.vertices.size() / 2].x() += 1.0;
  EXPECT_FALSE(SheetHorizons::find(folded, {}));
}

}  // namespace
}  // namespace touchstone::render
