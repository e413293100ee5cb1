#include "sensors/touch_map/tactile_map.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/sensors/touch_map/drawn_relief.h"

namespace touchstone::sensors {
namespace {

using fixtures::Surface;
using fixtures::touch_of;

struct PoseError {
  double mm, degrees;
};

PoseError error_of(const PlanarPose& found, const PlanarPose& truth) {
  const PlanarPose rest = truth.inverse() * found;
  return {rest.translation.norm(), std::abs(rest.angle) / kRadiansPerDegree};
}

TEST(TactileMap, EveryTurnIsLocalisedByFeaturesAlone) {
  const Surface relief = fixtures::strewn_relief(3);
  TactileMapSettings plain;
  plain.registration.refine = false;
  TactileMap text(plain), ours;
  text.add(touch_of(relief, {}, 1));
  ours.add(touch_of(relief, {}, 1));
  for (int i = 0; i <= 12; ++i) {
    const PlanarPose truth{(30 * i - 180) * kRadiansPerDegree, {2.0 * std::cos(2.1 * i), 2.0 * std::sin(1.7 * i)}};
    const TouchImage touch = touch_of(relief, truth, static_cast<std::uint64_t>(10 + i));
    const Registration by_features = text.localise(touch);
    ASSERT_TRUE(by_features.localised()) << name_of(by_features.outcome) << " at " << 30 * i - 180;
    EXPECT_FALSE(by_features.refined);
    EXPECT_LT(error_of(by_features.to_from_from, truth).mm, 0.04) << "half a pixel of the features' picture";
    EXPECT_LT(error_of(by_features.to_from_from, truth).degrees, 0.3);
    const Registration refined = ours.localise(touch);
    ASSERT_TRUE(refined.localised());
    EXPECT_TRUE(refined.refined);
    EXPECT_LT(error_of(refined.to_from_from, truth).mm, 0.005) << "a tenth of a pixel";
    EXPECT_LT(error_of(refined.to_from_from, truth).degrees, 0.02);
    EXPECT_GT(refined.confidence, 0.98);
  }
}

/// The part of the relief that a map knows, its heights against the truth.
double rms_error(const TactileMap& map, const Surface& relief, const PlanarPose& surface_from_map) {
  double squares = 0.0, sum = 0.0;
  int count = 0;
  const TactileMapData& data = map.data();
  for (int v = 0; v < data.weight.rows; ++v) {
    for (int u = 0; u < data.weight.cols; ++u) {
      if (data.weight.at<float>(v, u) <= 0.0F) continue;
      const double error = data.height_mm.at<float>(v, u) - relief(surface_from_map * data.frame.point_of({u, v}));
      squares += error * error, sum += error, ++count;
    }
  }
  return std::sqrt(squares / count - sum / count * sum / count);
}

TEST(TactileMap, GrowsTouchByTouchAndKeepsTheRelief) {
  const Surface relief = fixtures::strewn_relief(5);
  const PlanarPose root{0.3, {-2.0, 1.0}};
  TactileMap map;
  ASSERT_TRUE(map.empty());
  ASSERT_TRUE(map.add(touch_of(relief, root, 1)).localised());
  for (int i = 1; i <= 6; ++i) {
    const PlanarPose pose = root * PlanarPose{0.2 * i, {4.0 * std::cos(i), 4.0 * std::sin(i)}};
    // No two presses are equally deep.
    const Surface pressed = [&](const Eigen::Vector2d& p) { return relief(p) + 0.01 * (i % 3); };
    const Registration added = map.add(touch_of(pressed, pose, static_cast<std::uint64_t>(i + 1)));
    ASSERT_TRUE(added.localised());
    EXPECT_LT(error_of(added.to_from_from, root.inverse() * pose).mm, 0.01);
  }
  EXPECT_EQ(map.data().touches, 7);
  EXPECT_GT(map.data().weight.cols, 400);
  EXPECT_GT(map.data().weight.rows, 340);
  EXPECT_LT(rms_error(map, relief, root), 0.003) << "noise of one touch is 0.002";
}

TEST(TactileMap, OverlapsAreAveraged) {
  const Surface relief = fixtures::strewn_relief(5);
  TactileMap once, often;
  once.add(touch_of(relief, {}, 1));
  for (std::uint64_t i = 1; i <= 9; ++i) ASSERT_TRUE(often.add(touch_of(relief, {}, i)).localised());
  EXPECT_LT(rms_error(often, relief, {}), 0.5 * rms_error(once, relief, {})) << "a third, were it not for resampling";
}

TEST(TactileMap, WithoutLevellingHeightsAreThoseOfTheTouches) {
  const Surface relief = fixtures::strewn_relief(5);
  const Surface deeper = [&](const Eigen::Vector2d& p) { return relief(p) + 0.02; };
  TactileMapSettings text;
  text.level = false;
  text.blend_mm = 0.0;
  TactileMap plain(text), levelled;
  for (TactileMap* map : {&plain, &levelled}) {
    map->add(touch_of(relief, {}, 1));
    map->add(touch_of(deeper, {}, 2));
  }
  const auto middle = [](const TactileMap& map) {
    return cv::mean(map.data().height_mm(cv::Rect(40, 40, 240, 160)))[0];
  };
  EXPECT_NEAR(middle(plain) - middle(levelled), 0.01, 1e-4);
}

TEST(TactileMap, ATouchOfAnotherSizeIsLocalised) {
  const Surface relief = fixtures::strewn_relief(6);
  TactileMap map;
  map.add(touch_of(relief, {}, 1));
  fixtures::Camera small;
  small.columns = 200, small.rows = 160;
  const PlanarPose truth{-1.0, {1.0, 0.5}};
  const Registration found = map.localise(touch_of(relief, truth, 2, small));
  ASSERT_TRUE(found.localised());
  EXPECT_LT(error_of(found.to_from_from, truth).mm, 0.01);
}

/// A plug's face: a plate with two windows and a bent seam.
double plug_face(const Eigen::Vector2d& p) {
  const auto inside = [](const Eigen::Vector2d& at, double half_x, double half_y, double blur) {
    const double beyond = std::max(std::abs(at.x()) - half_x, std::abs(at.y()) - half_y);
    return 1.0 / (1.0 + std::exp(beyond / blur));
  };
  const double bent = p.x() - (std::abs(p.y() - 3.5) < 1.0 ? 0.5 : 0.0);
  const double seam = std::exp(-50.0 * bent * bent);
  const double windows = inside({std::abs(p.x()) - 2.85, p.y() - 0.3}, 1.25, 1.12, 0.05);
  return inside(p, 6.0, 6.0, 0.1) * (0.25 - 0.2 * windows - 0.03 * seam);
}

TEST(TactileMap, BulgesThatStayWithTheSensorDontHideThePlug) {
  // What photometric stereo gets wrong of steep edges: heights beside them bulge over some half a millimetre, up on the
  // sensor's one side and down on its other, however the plug is turned.
  const auto bulging = [](const PlanarPose& pose, std::uint64_t seed) {
    TouchImage touch = touch_of(plug_face, pose, seed);
    cv::Mat wide, bulge;
    cv::GaussianBlur(touch.height_mm, wide, {0, 0}, 0.5 / touch.mm_per_px);
    cv::Sobel(wide, bulge, CV_32F, 1, 0, 3, 1.0 / (8.0 * touch.mm_per_px));
    return touch_by_height(touch.height_mm + bulge, touch.mm_per_px, 0.12);
  };
  const PlanarPose root{0.0, {0.3, 0.2}};
  TactileMap map;
  map.add(bulging(root, 1));
  for (const double angle : {1.0, -1.0}) ASSERT_TRUE(map.add(bulging({angle, {0.3, 0.2}}, 2)).localised());
  for (int degrees = -90; degrees <= 90; degrees += 15) {
    const PlanarPose pose{degrees * kRadiansPerDegree, {0.3, -0.4}};
    const Registration found = map.localise(bulging(pose, static_cast<std::uint64_t>(200 + degrees)));
    ASSERT_TRUE(found.localised()) << degrees << " degrees: " << name_of(found.outcome);
    EXPECT_LT(error_of(found.to_from_from, root.inverse() * pose).mm, 0.05) << degrees << " degrees";
    EXPECT_LT(error_of(found.to_from_from, root.inverse() * pose).degrees, 0.15) << degrees << " degrees";
  }
}

TEST(TactileMap, PartOfAnObjectIsEnough) {
  // Contact in one half of the image only, as on a tilted object.
  const Surface relief = fixtures::strewn_relief(6);
  TactileMap map;
  map.add(touch_of(relief, {}, 1));
  const PlanarPose truth{2.0, {1.0, 0.5}};
  TouchImage half = touch_of(relief, truth, 2);
  half.contact.rowRange(0, 120).setTo(0);
  half.height_mm.rowRange(0, 120).setTo(0);
  const Registration found = map.localise(half);
  ASSERT_TRUE(found.localised()) << name_of(found.outcome);
  EXPECT_LT(error_of(found.to_from_from, truth).mm, 0.02);
}

}  // namespace
}  // namespace touchstone::sensors
