#include "sensors/tractions/traction_inversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "core/error.h"
#include "core/random.h"
#include "tests/sensors/tractions/half_space_markers.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kLateral = 0.02, kNormal = 0.06;  // mm, as the settings have it

class Inversion : public ::testing::Test {
 protected:
  Inversion() : map_(fixtures::half_space_markers(7, 12, 1.5)) {}

  /// Tractions on the gel of a round contact of radius 4.5 mm about (x, y): a pressure that falls to the rim, and the
  /// same times `shear` along the gel.
  Eigen::VectorXd press(double x, double y, double peak_MPa, const Eigen::Vector2d& shear) const {
    Eigen::VectorXd tractions = Eigen::VectorXd::Zero(3 * map_.patches());
    for (int p = 0; p < map_.patches(); ++p) {
      const double r = (map_.patch_centre(p) - Eigen::Vector2d(x, y)).norm() / 4.5;
      if (r >= 1.0) continue;
      const double pressure = peak_MPa * std::sqrt(1.0 - r * r);
      tractions.segment<3>(3 * p) << pressure * shear.x(), pressure * shear.y(), -pressure;
    }
    return tractions;
  }
  MarkerField field_of(const Eigen::VectorXd& tractions) const {
    return displacements_under(map_, Eigen::Map<const Eigen::Matrix3Xd>(tractions.data(), 3, map_.patches()));
  }
  static MarkerField with_noise(MarkerField field, std::uint64_t seed) {
    RandomStream random(seed, 0, Purpose::kTest);
    for (Eigen::Vector3d& d : field.displacement) {
      d += Eigen::Vector3d(kLateral * random.normal(), kLateral * random.normal(), kNormal * random.normal());
    }
    return field;
  }
  Eigen::Vector3d force_on_object(const Eigen::VectorXd& tractions) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int p = 0; p < map_.patches(); ++p) sum -= map_.patch_area() * tractions.segment<3>(3 * p);
    return sum;
  }
  MarkerCompliance map_;
};

TEST_F(Inversion, FindsSmoothTractionsFromGoodMarkers) {
  const Eigen::VectorXd truth = press(0.7, -0.4, 0.12, {0.3, -0.2});
  TractionSettings settings;
  settings.lateral_noise_mm = settings.normal_noise_mm = 1e-5;
  TractionInversion inversion(map_, settings);
  const TractionField found = inversion.invert(field_of(truth));
  const Eigen::Vector3d force = force_on_object(truth);
  ASSERT_GT(force.z(), 3.0);
  EXPECT_LT((found.wrench.head<3>() - force).norm(), 0.005 * force.norm());
  const Eigen::VectorXd tractions = found.traction.reshaped();
  EXPECT_LT((tractions - truth).norm(), 0.12 * truth.norm());
}

TEST_F(Inversion, SignsAreThoseOnTheObject) {
  TractionInversion inversion(map_);
  // The gel is pushed down and dragged along +x: the object is pushed up and held back.
  const TractionField found = inversion.invert(field_of(press(1.5, 0.0, 0.12, {0.4, 0.0})));
  ASSERT_TRUE(found.in_contact);
  EXPECT_GT(found.wrench[2], 1.0);
  EXPECT_LT(found.wrench[0], -0.4);
  EXPECT_LT(found.wrench[4], -1.0) << "Fz at x > 0 turns the object about -y";
  EXPECT_NEAR(found.centre_of_pressure.x(), 1.5, 0.5);
  EXPECT_GE(found.markers[24].contact, 0.9);
  EXPECT_LT(found.markers[24].traction.z(), 0.0);
  EXPECT_GT(found.markers[24].traction.x(), 0.0);
}

/// The bars hold what they say, over noise and places: z^2 has a mean about 1.
TEST_F(Inversion, ErrorsAreWithinTheBars) {
  TractionInversion inversion(map_);
  Eigen::Vector3d squares = Eigen::Vector3d::Zero(), within = Eigen::Vector3d::Zero();
  constexpr int kSeeds = 60;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    RandomStream random(seed, 1, Purpose::kTest);
    const Eigen::VectorXd truth = press(3.0 * random.uniform() - 1.5, 3.0 * random.uniform() - 1.5,
                                        0.06 + 0.08 * random.uniform(), {0.5 * random.uniform(), -0.3});
    const TractionField found = inversion.invert(with_noise(field_of(truth), seed));
    const Eigen::Vector3d force = force_on_object(truth);
    for (int a = 0; a < 3; ++a) {
      ASSERT_GT(found.sigma(a), 0.0);
      const double z = (found.wrench[a] - force[a]) / found.sigma(a);
      squares[a] += z * z / kSeeds;
      within[a] += (std::abs(z) < 2.0 ? 1.0 : 0.0) / kSeeds;
      EXPECT_LE(found.noise(a, a), found.uncertainty(a, a) * 1.5);
    }
    EXPECT_NEAR(found.misfit, 1.0, 0.35);
  }
  for (int a = 0; a < 3; ++a) {
    EXPECT_GT(squares[a], 0.4) << a;
    EXPECT_LT(squares[a], 1.8) << a;
    EXPECT_GT(within[a], 0.85) << a;
  }
}

TEST_F(Inversion, NothingPullsAndNothingActsBesideTheContact) {
  TractionInversion inversion(map_);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const TractionField found = inversion.invert(with_noise(field_of(press(0.0, 0.0, 0.1, {0.2, 0.0})), seed));
    ASSERT_TRUE(found.in_contact);
    int touching = 0;
    for (int p = 0; p < map_.patches(); ++p) {
      EXPECT_LE(found.traction(2, p), 0.0);
      if (found.contact[static_cast<std::size_t>(p)] == 0) {
        EXPECT_TRUE(found.traction.col(p).isZero(0.0));
      }
      touching += found.contact[static_cast<std::size_t>(p)];
    }
    EXPECT_GT(touching, 10);
    EXPECT_LT(touching, 70);
  }
}

TEST_F(Inversion, NoiseAloneIsNoContact) {
  TractionInversion inversion(map_);
  int contacts = 0;
  MarkerField rest = field_of(Eigen::VectorXd::Zero(3 * map_.patches()));
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const TractionField found = inversion.invert(with_noise(rest, seed));
    contacts += found.in_contact;
    if (!found.in_contact) {
      EXPECT_TRUE(found.wrench.isZero(0.0));
      EXPECT_TRUE(found.traction.isZero(0.0));
      EXPECT_GT(found.sigma(2), 0.0) << "a light touch can't be ruled out";
    }
  }
  EXPECT_LE(contacts, 2);
}

TEST_F(Inversion, AStifferGelHasTractionsInProportion) {
  const MarkerField field = with_noise(field_of(press(0.5, 0.5, 0.1, {0.2, 0.1})), 4);
  MarkerCompliance stiff = map_;
  stiff.youngs_modulus *= 2.0;
  stiff.displacement *= 0.5;
  const TractionField soft_found = TractionInversion(map_).invert(field);
  const TractionField stiff_found = TractionInversion(stiff).invert(field);
  EXPECT_EQ(soft_found.contact, stiff_found.contact);
  EXPECT_LT((stiff_found.traction - 2.0 * soft_found.traction).norm(), 1e-9 * stiff_found.traction.norm());
  EXPECT_NEAR(stiff_found.wrench[2], 2.0 * soft_found.wrench[2], 1e-9);
  EXPECT_NEAR(stiff_found.sigma(2), 2.0 * soft_found.sigma(2), 1e-9);
}

TEST_F(Inversion, DoesWithoutSomeMarkersAndSaysSo) {
  const Eigen::VectorXd truth = press(0.3, 0.2, 0.1, {0.2, 0.0});
  const MarkerField whole = with_noise(field_of(truth), 2);
  MarkerField partial = whole;
  for (const std::size_t m : {16u, 23u, 24u, 31u, 3u, 40u}) {
    partial.measured[m] = 0;
    partial.displacement[m].setConstant(std::numeric_limits<double>::quiet_NaN());  // it must not be looked at
  }
  TractionInversion inversion(map_);
  const TractionField of_all = inversion.invert(whole);
  const TractionField of_some = inversion.invert(partial);
  EXPECT_EQ(of_some.measured, 43);
  EXPECT_GT(of_some.sigma(2), of_all.sigma(2));
  EXPECT_LT(std::abs(of_some.wrench[2] - force_on_object(truth).z()), 3.0 * of_some.sigma(2));
  // What was worked out for one set of markers doesn't leak into the next.
  const TractionField again = inversion.invert(whole);
  EXPECT_EQ(again.wrench, of_all.wrench);
}

TEST_F(Inversion, IsAFunctionOfItsInput) {
  const MarkerField field = with_noise(field_of(press(0.3, 0.2, 0.1, {0.2, 0.0})), 9);
  TractionInversion first(map_), second(map_);
  second.invert(with_noise(field, 10));
  const TractionField a = first.invert(field), b = second.invert(field);
  EXPECT_EQ(a.traction, b.traction);
  EXPECT_EQ(a.wrench, b.wrench);
  EXPECT_EQ(a.uncertainty, b.uncertainty);
}

TEST_F(Inversion, RefusesWhatDoesntFit) {
  TractionInversion inversion(map_);
  const MarkerField sound = field_of(press(0, 0, 0.1, {0, 0}));
  MarkerField field = sound;
  const auto inverting = [&](auto&& change) {
    change(field);
    return [&inversion, changed = std::exchange(field, sound)] { inversion.invert(changed); };
  };
  EXPECT_THAT(inverting([](MarkerField& f) {
                f.grid = {10, 10};
              }),
              ThrowsMessage<Error>(HasSubstr("10 x 10 markers, the marker compliance is of 7 x 7")));
  EXPECT_THAT(inverting([](MarkerField& f) { f.displacement.pop_back(); }),
              ThrowsMessage<Error>(HasSubstr("48 displacements")));
  EXPECT_THAT(inverting([](MarkerField& f) { f.measured.clear(); }), ThrowsMessage<Error>(HasSubstr("0 marks")));
  EXPECT_THAT(inverting([](MarkerField& f) { f.displacement[5].y() = std::numeric_limits<double>::infinity(); }),
              ThrowsMessage<Error>(HasSubstr("marker 5 isn't finite")));
  EXPECT_THAT(inverting([](MarkerField& f) { std::fill(f.measured.begin() + 8, f.measured.end(), 0); }),
              ThrowsMessage<Error>(HasSubstr("8 markers are measured, at least 9")));
}

TEST_F(Inversion, SettingsAreChecked) {
  const auto with = [&](auto&& change) {
    TractionSettings settings;
    change(settings);
    return [this, settings] { TractionInversion(map_, settings); };
  };
  EXPECT_THAT(with([](TractionSettings& s) { s.lateral_noise_mm = 0.0; }),
              ThrowsMessage<Error>(HasSubstr("lateral_noise_mm is 0")));
  EXPECT_THAT(with([](TractionSettings& s) { s.normal_noise_mm = std::numeric_limits<double>::quiet_NaN(); }),
              ThrowsMessage<Error>(HasSubstr("normal_noise_mm is nan")));
  EXPECT_THAT(with([](TractionSettings& s) { s.correlation = 0.0; }), ThrowsMessage<Error>(HasSubstr("correlation")));
  EXPECT_THAT(with([](TractionSettings& s) { s.scale = -1.0; }), ThrowsMessage<Error>(HasSubstr("scale is -1")));
  MarkerCompliance fine = map_;
  fine.patch_grid = {40, 40};
  fine.displacement = Eigen::MatrixXd::Ones(3 * fine.markers(), 3 * fine.patches());
  EXPECT_THAT([&] { TractionInversion{fine}; }, ThrowsMessage<Error>(HasSubstr("1600 patches; at most 1100")));
  MarkerCompliance faulty = map_;
  faulty.thickness = 0.0;
  EXPECT_THAT([&] { TractionInversion{faulty}; }, ThrowsMessage<Error>(HasSubstr("thickness is 0")));
}

}  // namespace
}  // namespace touchstone::sensors
