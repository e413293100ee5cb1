#include "sensors/tractions/friction_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr int kSide = 7;
constexpr int kMarkers = kSide * kSide;
constexpr double kPressure = 0.1;  // MPa
constexpr double kArea = 9.0;      // mm^2 a marker

/// Frames drawn by hand: the inner 5 x 5 markers touch; each has a motion and a traction ratio along x of its own.
struct Scene {
  std::vector<double> moved = std::vector<double>(kMarkers, 0.0);  ///< mm along x
  std::vector<double> ratio = std::vector<double>(kMarkers, 0.0);
  double centre = 0.0;  ///< of pressure, mm along x

  static bool touches(int m) {
    const int i = m % kSide, j = m / kSide;
    return i >= 1 && i <= 5 && j >= 1 && j <= 5;
  }
  static bool is_rim(int m) {
    const int i = m % kSide, j = m / kSide;
    return touches(m) && (i == 1 || i == 5 || j == 1 || j == 5);
  }
  MarkerField field() const {
    MarkerField field;
    field.grid = {kSide, kSide};
    for (const double x : moved) field.displacement.emplace_back(x, 0.0, -0.3);
    field.measured.assign(kMarkers, 1);
    return field;
  }
  TractionField tractions() const {
    TractionField result;
    result.in_contact = true;
    result.markers.resize(kMarkers);
    for (int m = 0; m < kMarkers; ++m) {
      if (!touches(m)) continue;
      MarkerTraction& marker = result.markers[static_cast<std::size_t>(m)];
      marker.contact = 1.0;
      marker.traction = {kPressure * ratio[static_cast<std::size_t>(m)], 0.0, -kPressure};
      marker.covariance = 1e-6 * Eigen::Matrix3d::Identity();
      result.wrench.head<3>() -= kArea * marker.traction;
    }
    result.uncertainty = 1e-4 * Matrix6d::Identity();
    result.centre_of_pressure = {centre, 0.0};
    return result;
  }
  void move_all(double step) {
    for (int m = 0; m < kMarkers; ++m) {
      if (touches(m)) moved[static_cast<std::size_t>(m)] += step;
    }
  }
  void load_all(double to) {
    for (int m = 0; m < kMarkers; ++m) {
      if (touches(m)) ratio[static_cast<std::size_t>(m)] = to;
    }
  }
};

FrictionState update(FrictionObserver& observer, const Scene& scene) {
  return observer.update(scene.field(), scene.tractions());
}

TEST(Friction, AnObjectThatCarriesAllMarkersSticks) {
  FrictionObserver observer;
  Scene scene;
  EXPECT_EQ(update(observer, scene).state, ContactSlip::kUnknown) << "nothing has moved";
  FrictionState state;
  for (int k = 1; k <= 8; ++k) {
    scene.move_all(0.1);
    scene.load_all(0.05 * k);
    state = update(observer, scene);
  }
  EXPECT_EQ(state.state, ContactSlip::kSticking);
  EXPECT_FALSE(state.friction.has_value()) << "only that it's above 0.4 is known";
  EXPECT_NEAR(state.ratio, 0.4, 1e-12);
  for (int m = 0; m < kMarkers; ++m) {
    EXPECT_EQ(state.markers[static_cast<std::size_t>(m)].state,
              Scene::touches(m) ? MarkerSlip::kStick : MarkerSlip::kNoContact);
  }
}

TEST(Friction, ARimThatLagsSlipsAndTellsTheFriction) {
  FrictionObserver observer;
  Scene scene;
  update(observer, scene);
  FrictionState state;
  for (int k = 1; k <= 8; ++k) {
    for (int m = 0; m < kMarkers; ++m) {
      if (!Scene::touches(m)) continue;
      scene.moved[static_cast<std::size_t>(m)] += Scene::is_rim(m) ? 0.04 : 0.1;
      scene.ratio[static_cast<std::size_t>(m)] = Scene::is_rim(m) ? 0.6 : 0.03 * k;
    }
    state = update(observer, scene);
  }
  EXPECT_EQ(state.state, ContactSlip::kPartial);
  ASSERT_TRUE(state.friction.has_value());
  EXPECT_FALSE(state.friction->of_sliding);
  EXPECT_NEAR(state.friction->value, 0.6, 1e-9);
  EXPECT_GT(state.friction->error, 0.0);
  for (int m = 0; m < kMarkers; ++m) {
    if (!Scene::touches(m)) continue;
    const MarkerFriction& marker = state.markers[static_cast<std::size_t>(m)];
    EXPECT_EQ(marker.state, Scene::is_rim(m) ? MarkerSlip::kSlip : MarkerSlip::kStick);
    EXPECT_NEAR(*marker.lag, Scene::is_rim(m) ? 0.6 : 0.0, 1e-9);
  }
}

TEST(Friction, AContactThatMovesOverItsMarkersSlides) {
  FrictionObserver observer;
  Scene scene;
  FrictionState state;
  for (int k = 0; k <= 6; ++k) {
    scene.move_all(0.1);
    scene.load_all(0.1 * k);
    state = update(observer, scene);
  }
  scene.load_all(0.7);
  for (int k = 0; k < 12; ++k) {
    scene.centre += 0.1;
    state = update(observer, scene);
  }
  EXPECT_EQ(state.state, ContactSlip::kSliding);
  EXPECT_GE(state.slide_mm, 0.4);
  ASSERT_TRUE(state.friction.has_value());
  EXPECT_TRUE(state.friction->of_sliding);
  EXPECT_NEAR(state.friction->value, 0.7, 0.01);
  EXPECT_EQ(state.markers[24].state, MarkerSlip::kSlip);
  // Stopped and held, with less shear: what was read of friction stays known.
  scene.load_all(0.3);
  for (int k = 0; k < 30; ++k) state = update(observer, scene);
  EXPECT_NEAR(state.friction->value, 0.7, 0.01);
  EXPECT_EQ(state.state, ContactSlip::kSticking);
  EXPECT_EQ(state.markers[24].state, MarkerSlip::kUnknown);
}

TEST(Friction, AContactThatGoesAgainstTheShearDoesntSlide) {
  FrictionObserver observer;
  Scene scene;
  scene.load_all(0.5);
  FrictionState state;
  for (int k = 0; k < 14; ++k) {
    scene.centre -= 0.1;
    state = update(observer, scene);
    EXPECT_NE(state.state, ContactSlip::kSliding);
  }
}

TEST(Friction, WhileShearGrowsItIsNoSliding) {
  FrictionObserver observer;
  Scene scene;
  for (int k = 1; k < 14; ++k) {
    scene.centre += 0.1;
    scene.load_all(0.05 * k);
    EXPECT_NE(update(observer, scene).state, ContactSlip::kSliding) << k;
  }
}

TEST(Friction, LosingContactForgets) {
  FrictionObserver observer;
  Scene scene;
  scene.load_all(0.5);
  for (int k = 0; k < 14; ++k) {
    scene.centre += 0.1;
    update(observer, scene);
  }
  TractionField none = scene.tractions();
  none.in_contact = false;
  const FrictionState& state = observer.update(scene.field(), none);
  EXPECT_EQ(state.state, ContactSlip::kNoContact);
  EXPECT_FALSE(state.friction.has_value());
  EXPECT_EQ(update(observer, scene).state, ContactSlip::kUnknown);
}

TEST(Friction, MarkersAtTheContactsRimStayUnknown) {
  FrictionObserver observer;
  Scene scene;
  FrictionState state;
  for (int k = 0; k < 9; ++k) {
    scene.move_all(0.1);
    scene.load_all(0.2);
    TractionField tractions = scene.tractions();
    tractions.markers[8].contact = 0.5;
    state = observer.update(scene.field(), tractions);
  }
  EXPECT_EQ(state.markers[8].state, MarkerSlip::kUnknown);
  EXPECT_EQ(state.markers[9].state, MarkerSlip::kStick);
}

TEST(Friction, BadInputIsRefused) {
  FrictionObserver observer;
  const Scene scene;
  MarkerField field = scene.field();
  field.measured.pop_back();
  EXPECT_THAT([&] { observer.update(field, scene.tractions()); }, ThrowsMessage<Error>(HasSubstr("49 markers")));
  TractionField fewer = scene.tractions();
  fewer.markers.pop_back();
  EXPECT_THAT([&] { observer.update(scene.field(), fewer); }, ThrowsMessage<Error>(HasSubstr("tractions are of 48")));
  const auto with = [](auto&& change) {
    FrictionSettings settings;
    change(settings);
    return [settings] { FrictionObserver{settings}; };
  };
  EXPECT_THAT(with([](FrictionSettings& s) { s.history_frames = 1; }),
              ThrowsMessage<Error>(HasSubstr("history_frames")));
  EXPECT_THAT(with([](FrictionSettings& s) { s.lag = 1.0; }), ThrowsMessage<Error>(HasSubstr("lag is 1")));
  EXPECT_THAT(with([](FrictionSettings& s) { s.slide_mm = 0.0; }), ThrowsMessage<Error>(HasSubstr("slide_mm is 0")));
}

}  // namespace
}  // namespace touchstone::sensors
