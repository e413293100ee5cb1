#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "closed_forms/light_closed_forms.h"
#include "core/units.h"
#include "render/materials/layer_connection.h"

namespace touchstone::render {
namespace {

const std::vector<std::vector<Layer>> kStacks = {
    {{20.0, 1.0}, {5.0, 1.41}},
    {{20.0, 1.0}, {2.0, 1.52}, {5.0, 1.41}},
    {{20.0, 1.0}, {2.0, 1.52}, {5.0, 1.41}, {0.3, 1.0}},
    {{1.0, 1.52}, {5.0, 1.41}, {0.0, 1.7}, {2.0, 1.33}},
    {{3.0, 1.41}, {1e-4, 1.0}, {2.0, 1.41}},
};

double lateral_distance(const std::vector<Layer>& layers, const LayerPath& path) {
  double sum = 0.0;
  for (std::size_t k = 0; k < layers.size(); ++k) sum += layers[k].thickness * path.tangent[k];
  return sum;
}

TEST(LayerConnection, ObeysSnellAndArrives) {
  for (const auto& layers : kStacks) {
    for (double lateral : {0.0, 1e-6, 0.3, 4.0, 12.0, 40.0, 300.0}) {
      const auto path = solve_layer_path(layers, lateral);
      ASSERT_TRUE(path) << "lateral " << lateral;
      EXPECT_NEAR(lateral_distance(layers, *path), lateral, 1e-9 * (1.0 + lateral));
      const double invariant = layers[0].index * path->tangent[0] * path->cosine[0];
      for (std::size_t k = 1; k < layers.size(); ++k) {
        EXPECT_NEAR(layers[k].index * path->tangent[k] * path->cosine[k], invariant, 1e-12);
      }
      EXPECT_GT(path->jacobian, 0.0);
      EXPECT_TRUE(std::isfinite(path->jacobian));
      EXPECT_GE(path->transmittance, 0.0);
      EXPECT_LE(path->transmittance, 1.0);
    }
  }
}

TEST(LayerConnection, OneLayerIsTheInverseSquareLaw) {
  const std::vector<Layer> layers = {{3.0, 1.3}};
  for (double lateral : {0.0, 1.0, 4.0, 1000.0}) {
    const auto path = solve_layer_path(layers, lateral);
    ASSERT_TRUE(path);
    const double distance2 = 9.0 + lateral * lateral;
    EXPECT_NEAR(path->jacobian * distance2, 1.0, 1e-9);
    EXPECT_EQ(path->transmittance, 1.0);
  }
}

TEST(LayerConnection, CutsIntoEqualIndicesChangeNothing) {
  const std::vector<Layer> whole = {{20.0, 1.0}, {7.0, 1.41}};
  const std::vector<Layer> cut = {{13.0, 1.0}, {7.0, 1.0}, {0.0, 1.41}, {5.0, 1.41}, {2.0, 1.41}};
  const auto a = solve_layer_path(whole, 9.0);
  const auto b = solve_layer_path(cut, 9.0);
  ASSERT_TRUE(a && b);
  EXPECT_NEAR(a->jacobian, b->jacobian, 1e-12 * a->jacobian);
  EXPECT_NEAR(a->transmittance, b->transmittance, 1e-12);
}

// All that leaves the source within a cone lands within the circle that the cone's edge reaches.
TEST(LayerConnection, JacobianConservesFlux) {
  for (const auto& layers : kStacks) {
    const double radius = 9.0;
    constexpr int kIntervals = 4000;
    double landed = 0.0;
    for (int i = 0; i <= kIntervals; ++i) {
      const double lateral = radius * std::pow(static_cast<double>(i) / kIntervals, 2);
      const double weight = (i == 0 || i == kIntervals) ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
      const auto path = solve_layer_path(layers, lateral);
      ASSERT_TRUE(path);
      const double stretch = 2.0 * radius * i / (static_cast<double>(kIntervals) * kIntervals);
      landed += weight * 2.0 * kPi * lateral * path->jacobian * path->cosine[layers.size() - 1] * stretch;
    }
    landed /= 3.0;
    const auto edge = solve_layer_path(layers, radius);
    const double sent = 2.0 * kPi * (1.0 - edge->cosine[0]);
    EXPECT_NEAR(landed / sent, 1.0, 1e-3) << layers.size() << " layers";
  }
}

TEST(LayerConnection, AgreesWithBisectionAndDifferences) {
  const std::array<double, 4> thicknesses = {20.0, 2.0, 5.0, 0.5};
  const std::array<double, 4> indices = {1.0, 1.52, 1.41, 1.0};
  std::vector<Layer> layers;
  for (int k = 0; k < 4; ++k) layers.push_back({thicknesses[k], indices[k]});
  for (double lateral : {0.0, 2.0, 8.0, 30.0}) {
    const auto path = solve_layer_path(layers, lateral);
    ASSERT_TRUE(path);
    EXPECT_NEAR(path->tangent[0], closed_forms::apparent_tangent(thicknesses, indices, lateral), 1e-9);
    const double expected = closed_forms::layered_irradiance(thicknesses, indices, lateral);
    EXPECT_NEAR(path->jacobian * path->transmittance * 1e6 / expected, 1.0, 1e-6);
  }
}

TEST(LayerConnection, SourceAndReceiverMayChangePlaces) {
  // Reciprocity: n^2 d omega dA is the same from both ends.
  for (const auto& layers : kStacks) {
    const std::vector<Layer> turned(layers.rbegin(), layers.rend());
    for (double lateral : {0.5, 5.0, 25.0}) {
      const auto there = solve_layer_path(layers, lateral);
      const auto back = solve_layer_path(turned, lateral);
      ASSERT_TRUE(there && back);
      const double n_there = layers.front().index;
      const double n_back = layers.back().index;
      EXPECT_NEAR(there->jacobian * n_there * n_there / (back->jacobian * n_back * n_back), 1.0, 1e-8);
      EXPECT_NEAR(there->transmittance, back->transmittance, 1e-9);
    }
  }
}

TEST(LayerConnection, GrazingLightStaysFinite) {
  const std::vector<Layer> layers = {{1e-3, 1.0}, {5.0, 1.41}};
  for (double lateral : {4.99, 5.0, 5.03, 6.0, 1e3, 1e6, 1e9}) {
    const auto path = solve_layer_path(layers, lateral);
    if (!path) continue;
    EXPECT_TRUE(std::isfinite(path->jacobian) && path->jacobian >= 0.0) << lateral;
    EXPECT_TRUE(std::isfinite(path->transmittance)) << lateral;
  }
  EXPECT_TRUE(solve_layer_path(layers, 1e3));
}

TEST(LayerConnection, NoThicknessIsNoPath) {
  const std::vector<Layer> layers = {{0.0, 1.0}, {0.0, 1.41}};
  EXPECT_FALSE(solve_layer_path(layers, 1.0));
  EXPECT_FALSE(solve_layer_path(layers, 0.0));
}

}  // namespace
}  // namespace touchstone::render
