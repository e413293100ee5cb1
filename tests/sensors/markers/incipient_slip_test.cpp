// The contact patch, and slip found in fields of markers that are known: by formula with noise, and through painted
// pictures.

#include "sensors/markers/incipient_slip.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "tests/sensors/markers/painted_markers.h"

namespace touchstone::sensors {
namespace {

const Eigen::Vector2d kCentre(160, 120);
constexpr double kRadius = 60.0;  // of the contact, px

/// The patches of these tests are the contact itself.
const IncipientSlipSettings kWholePatch{.patch_part = 1.0, .least_markers = 8};

cv::Mat disc(const Eigen::Vector2d& centre, double radius) {
  cv::Mat mask(240, 320, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if ((Eigen::Vector2d(x + 0.5, y + 0.5) - centre).norm() <= radius) mask.at<std::uint8_t>(y, x) = 255;
    }
  }
  return mask;
}

ContactPatch round_patch(const Eigen::Vector2d& centre, double radius) {
  ContactPatch patch;
  patch.centre = centre;
  patch.area_px = 3.14159265 * radius * radius;
  patch.edge = Eigen::Matrix2d::Identity() / (radius * radius);
  return patch;
}

/// How far a surface goes with a disc of radius `stick` that is stuck to it, at a distance from its middle: the field
/// of [Cattaneo1938], outside as a half space's (2/pi asin(stick/r)).
double part_carried(double distance, double stick) {
  return distance <= stick ? 1.0 : 2.0 / 3.14159265358979 * std::asin(stick / distance);
}

/// Feeds a detector with fields instead of pictures.
struct Field {
  TrackedMarkers markers;
  RandomStream random{7, 0, Purpose::kTest};
  double noise_px = 0.04;

  explicit Field(double spacing = 22.6) {
    markers.rest = fixtures::marker_grid(spacing);
    markers.positions = markers.rest;
    markers.status.assign(markers.rest.size(), MarkerStatus::kFound);
    true_displacement.assign(markers.rest.size(), Eigen::Vector2d::Zero());
  }
  std::vector<Eigen::Vector2d> true_displacement;

  template <typename Step>
  const TrackedMarkers& step(Step&& displacement_step) {
    for (std::size_t i = 0; i < markers.rest.size(); ++i) {
      true_displacement[i] += displacement_step(markers.rest[i]);
      markers.positions[i] =
          markers.rest[i] + true_displacement[i] + noise_px * Eigen::Vector2d(random.normal(), random.normal());
    }
    ++markers.t_us;
    return markers;
  }
};

TEST(ContactPatch, AnEllipseIsFoundWhereItIs) {
  cv::Mat mask(240, 320, CV_8UC1, cv::Scalar(0));
  cv::ellipse(mask, {150, 100}, {60, 30}, 30, 0, 360, cv::Scalar(255), cv::FILLED);
  const auto patch = contact_patch(mask, 50);
  ASSERT_TRUE(patch);
  EXPECT_NEAR(patch->centre.x(), 150.5, 0.3);
  EXPECT_NEAR(patch->centre.y(), 100.5, 0.3);
  EXPECT_NEAR(patch->reach_squared({150.5 + 60 * std::cos(0.5236), 100.5 + 60 * std::sin(0.5236)}), 1.0, 0.05);
  EXPECT_NEAR(patch->reach_squared({150.5 - 30 * std::sin(0.5236), 100.5 + 30 * std::cos(0.5236)}), 1.0, 0.08);
}

TEST(ContactPatch, SpecksFarOutDontWidenIt) {
  cv::Mat mask = disc(kCentre, kRadius);
  RandomStream random(2, 0, Purpose::kTest);
  for (int i = 0; i < 200; ++i)
    mask.at<std::uint8_t>(static_cast<int>(240 * random.uniform()), static_cast<int>(320 * random.uniform())) = 255;
  const auto patch = contact_patch(mask, 50);
  ASSERT_TRUE(patch);
  EXPECT_NEAR(patch->reach_squared(kCentre + Eigen::Vector2d(kRadius, 0)), 1.0, 0.05);
}

TEST(ContactPatch, MarkersCutByTheBorderAreErasedWithTheOthers) {
  Field field;
  cv::Mat mask = disc(kCentre, kRadius);
  cv::Mat with_specks = mask.clone();
  for (int y = 10; y < 230; y += 22) with_specks(cv::Rect(0, y, 5, 5)).setTo(255);
  erase_markers(mask, field.markers, 7.5);
  erase_markers(with_specks, field.markers, 7.5);
  EXPECT_EQ(cv::norm(mask, with_specks, cv::NORM_INF), 0.0);
}

TEST(ContactPatch, ARingCoversLittleOfItsPatch) {
  const cv::Mat filled = disc(kCentre, kRadius);
  const cv::Mat ring = filled - disc(kCentre, 0.93 * kRadius);
  const auto patch = contact_patch(filled, 50), rim = contact_patch(ring, 50);
  ASSERT_TRUE(patch && rim);
  EXPECT_NEAR(patch->cover(), 1.0, 0.01);
  EXPECT_LT(rim->cover(), 0.15);
}

TEST(ContactPatch, NothingAndTooLittleIsNoPatch) {
  cv::Mat mask(240, 320, CV_8UC1, cv::Scalar(0));
  EXPECT_FALSE(contact_patch(mask, 50));
  EXPECT_FALSE(contact_patch(mask, 0));
  mask(cv::Rect(5, 5, 7, 7)).setTo(255);
  EXPECT_FALSE(contact_patch(mask, 50));
  EXPECT_TRUE(contact_patch(mask, 49));
  EXPECT_THROW(contact_patch(cv::Mat(), 1), Error);
  EXPECT_THROW(contact_patch(cv::Mat(4, 4, CV_32FC1, cv::Scalar(0)), 1), Error);
}

TEST(ContactPatch, MeanDisplacementIsOverItsMarkers) {
  Field field;
  field.noise_px = 0.0;
  field.step([](const Eigen::Vector2d& place) {
    return (place - kCentre).norm() < kRadius ? Eigen::Vector2d(2, -1) : Eigen::Vector2d(0, 0);
  });
  const PatchMotion mean = patch_motion(field.markers, round_patch(kCentre, 0.9 * kRadius));
  EXPECT_GT(mean.markers, 10);
  EXPECT_LT((mean.px - Eigen::Vector2d(2, -1)).norm(), 1e-12);
  ASSERT_TRUE(mean.turn);
  EXPECT_NEAR(*mean.turn, 0.0, 1e-12);
  const PatchMotion none = patch_motion(field.markers, round_patch({-500, 0}, 10));
  EXPECT_EQ(none.markers, 0);
  EXPECT_FALSE(none.turn);
}

TEST(ContactPatch, ATurnIsReadWhateverElseMoves) {
  // Turned by 0.3 about a place beside the patch, swollen, moved; then noise, which the stated error must account for.
  const Eigen::Matrix2d turn = 1.04 * Eigen::Rotation2Dd(0.3).toRotationMatrix();
  const auto turned = [&](const Eigen::Vector2d& place) {
    const Eigen::Vector2d from(100, 90);
    return Eigen::Vector2d(from + turn * (place - from) + Eigen::Vector2d(5, -3) - place);
  };
  const ContactPatch patch = round_patch(kCentre, 3.0 * kRadius);
  Field exact;
  exact.noise_px = 0.0;
  exact.step(turned);
  const PatchMotion seen = patch_motion(exact.markers, patch);
  ASSERT_TRUE(seen.turn);
  EXPECT_NEAR(*seen.turn, 0.3, 1e-12);
  EXPECT_LT(seen.turn_error, 1e-6);
  double squares = 0.0, stated = 0.0;
  constexpr int kTries = 400;
  for (int i = 0; i < kTries; ++i) {
    Field noisy;
    noisy.random = RandomStream(static_cast<std::uint64_t>(i), 0, Purpose::kTest);
    noisy.noise_px = 0.2;
    noisy.step(turned);
    const PatchMotion one = patch_motion(noisy.markers, patch);
    squares += std::pow(*one.turn - 0.3, 2) / kTries;
    stated += std::pow(one.turn_error, 2) / kTries;
  }
  EXPECT_NEAR(std::sqrt(squares / stated), 1.0, 0.1);  // a standard deviation of 400 is known to 3.5 %
}

TEST(IncipientSlip, StickingMotionHasNoLag) {
  // All rigid motions of the object, with the swelling of a press on top.
  IncipientSlipDetector detector(kWholePatch);
  Field field;
  Eigen::Vector2d centre = kCentre;
  for (int frame = 0; frame < 40; ++frame) {
    const Eigen::Vector2d shift(frame < 30 ? 0.6 : 0.0, 0.3);
    centre += shift;
    const IncipientSlip& slip = detector.update(field.step([&](const Eigen::Vector2d& place) {
      const Eigen::Vector2d from = place - kCentre;
      return Eigen::Vector2d(shift + 0.004 * Eigen::Vector2d(-from.y(), from.x()) + 0.002 * from);
    }),
                                                round_patch(centre, kRadius));
    EXPECT_EQ(slip.state, SlipState::kSticking) << "frame " << frame;
    if (slip.lag) {
      EXPECT_LT(std::abs(*slip.lag), 4.0 * slip.lag_error + 0.02) << "frame " << frame;
    }
  }
}

TEST(IncipientSlip, LagGrowsAsTheStickZoneShrinks) {
  double before = -1.0;
  for (const double stick : {1.0, 0.8, 0.6, 0.4, 0.2}) {
    IncipientSlipDetector detector(kWholePatch);
    Field field;
    field.noise_px = 0.0;
    IncipientSlip slip;
    for (int frame = 0; frame < 5; ++frame) {  // object and patch go by a pixel a frame, with what sticks
      slip = detector.update(field.step([&](const Eigen::Vector2d& place) {
        return Eigen::Vector2d(part_carried((place - kCentre).norm(), stick * kRadius), 0.0);
      }),
                             round_patch(kCentre + Eigen::Vector2d(frame + 1, 0), kRadius));
    }
    ASSERT_TRUE(slip.lag);
    EXPECT_GT(*slip.lag, before) << "stick zone of " << stick;
    before = *slip.lag;
    EXPECT_EQ(slip.state == SlipState::kIncipient, *slip.lag >= 0.5);
    if (stick == 1.0) {
      EXPECT_NEAR(*slip.lag, 0.0, 1e-3);  // a marker at the edge lies just outside of what sticks
    }
    if (stick == 0.2) {
      EXPECT_EQ(slip.state, SlipState::kIncipient);
    }
  }
}

TEST(IncipientSlip, IsFoundBeforeTheMiddleSlips) {
  // [Mindlin1949]: under a shear load Q the stick radius is (1 - Q/(mu P))^(1/3) of the contact's; the object moves on
  // evenly.
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    IncipientSlipDetector detector(kWholePatch);
    Field field;
    field.random = RandomStream(seed, 0, Purpose::kTest);
    Eigen::Vector2d centre = kCentre;
    int found = -1;
    constexpr int kGross = 30;
    for (int frame = 0; frame < 60; ++frame) {
      const double load = std::min(static_cast<double>(frame) / kGross, 1.0);
      // The displacement of the middle is 1 - (1 - load)^(2/3) of the last one.
      const auto moved = [](double part) { return 25.0 * (1.0 - std::pow(1.0 - part, 2.0 / 3.0)); };
      const double next = std::min(static_cast<double>(frame + 1) / kGross, 1.0);
      const double step = moved(next) - moved(load);
      const double stick = std::cbrt(1.0 - load) * kRadius;
      centre.x() += frame < kGross ? step : 1.0;
      const IncipientSlip& slip = detector.update(field.step([&](const Eigen::Vector2d& place) {
        return Eigen::Vector2d(step * part_carried((place - kCentre).norm(), std::max(stick, 1e-9)), 0.0);
      }),
                                                  round_patch(centre, kRadius));
      if (found < 0 && slip.state != SlipState::kSticking) found = frame;
    }
    EXPECT_GT(found, kGross / 3) << "seed " << seed;
    EXPECT_LT(found, kGross) << "seed " << seed;
  }
}

TEST(IncipientSlip, AFlatPunchThatSlidesAtOnceIsSeenSliding) {
  // No rim slips first: the markers go with the punch, then stop all together while it goes on.
  IncipientSlipDetector detector(kWholePatch);
  Field field;
  Eigen::Vector2d centre = kCentre;
  int found = -1;
  for (int frame = 0; frame < 40; ++frame) {
    const double step = frame < 20 ? 0.8 : 0.0;
    centre.x() += 0.8;
    const IncipientSlip& slip = detector.update(
        field.step([&](const Eigen::Vector2d&) { return Eigen::Vector2d(step, 0.0); }), round_patch(centre, kRadius));
    if (found < 0 && slip.state != SlipState::kSticking) {
      found = frame;
      EXPECT_EQ(slip.state, SlipState::kSliding);
    }
  }
  EXPECT_GE(found, 20);
  EXPECT_LE(found, 26);
}

TEST(IncipientSlip, PressingHoldingAndRollingInAreNoSlip) {
  IncipientSlipDetector detector(kWholePatch);
  Field field;
  Eigen::Vector2d centre = kCentre - Eigen::Vector2d(30, 0);
  Eigen::Vector2d centre_before = centre;
  double swelling = 0.0, swelling_before = 0.0;
  for (int frame = 0; frame < 60; ++frame) {
    double radius = kRadius;
    if (frame < 20) {  // pressing: the gel spreads from the middle
      radius = kRadius * (0.3 + 0.035 * frame);
      swelling = 0.004 * frame;
    } else if (frame >= 40) {  // rolling: the dent goes on, no marker is carried along
      centre.x() += 2.0;
    }
    const IncipientSlip& slip = detector.update(field.step([&](const Eigen::Vector2d& place) {
      return Eigen::Vector2d(swelling * (place - centre) - swelling_before * (place - centre_before));
    }),
                                                round_patch(centre, radius));
    EXPECT_EQ(slip.state, SlipState::kSticking)
        << "frame " << frame << " slide " << slip.slide_px << " shear " << slip.shear_px;
    centre_before = centre;
    swelling_before = swelling;
  }
}

TEST(IncipientSlip, WithoutContactAllIsForgotten) {
  IncipientSlipDetector detector(kWholePatch);
  Field field;
  const auto motion = [](const Eigen::Vector2d&) { return Eigen::Vector2d(1.0, 0.0); };
  EXPECT_EQ(detector.update(field.step(motion), std::nullopt).state, SlipState::kNoContact);
  EXPECT_FALSE(detector.update(field.step(motion), round_patch(kCentre, kRadius)).lag);  // nothing to compare with
  EXPECT_TRUE(detector.update(field.step(motion), round_patch(kCentre, kRadius)).lag);
  field.markers.jumped = true;
  EXPECT_FALSE(detector.update(field.step(motion), round_patch(kCentre, kRadius)).lag);
  field.markers.jumped = false;
  EXPECT_FALSE(detector.update(field.step(motion), round_patch(kCentre, kRadius)).lag);
  EXPECT_TRUE(detector.update(field.step(motion), round_patch(kCentre, kRadius)).lag);
  Field others(30.0);  // another gel
  EXPECT_FALSE(detector.update(others.step(motion), round_patch(kCentre, kRadius)).lag);
}

TEST(IncipientSlip, TooFewMarkersGiveNoLag) {
  IncipientSlipDetector detector(kWholePatch);
  Field field;
  for (int frame = 0; frame < 5; ++frame) {
    const auto& markers = field.step([](const Eigen::Vector2d&) { return Eigen::Vector2d(1.0, 0.0); });
    const IncipientSlip& slip = detector.update(markers, round_patch(kCentre, 25.0));
    EXPECT_LT(slip.markers, 8);
    EXPECT_FALSE(slip.lag);
    EXPECT_EQ(slip.state, SlipState::kSticking);
  }
}

TEST(IncipientSlip, IsFoundInPictures) {
  // The whole chain: pictures, tracker, patch, detector, with noise.
  fixtures::MarkerPicture picture;
  picture.noise = 2.0;
  const auto rest = fixtures::marker_grid();
  MarkerTracker tracker({});
  IncipientSlipDetector detector(kWholePatch);
  auto places = rest;
  std::vector<SlipState> states;
  for (int frame = 0; frame < 12; ++frame) {
    const TrackedMarkers& markers =
        tracker.track({fixtures::paint_markers(picture, places, static_cast<std::uint64_t>(1 + frame)), frame});
    cv::Mat mask = disc(kCentre + Eigen::Vector2d(0.8 * frame, 0.0), kRadius);
    erase_markers(mask, markers, 5.0);
    states.push_back(detector.update(markers, contact_patch(mask, 100)).state);
    const double stick = frame < 6 ? kRadius : 0.3 * kRadius;
    for (std::size_t i = 0; i < rest.size(); ++i) {
      places[i].x() += 0.8 * part_carried((rest[i] - kCentre).norm(), stick);
    }
  }
  for (int frame = 0; frame <= 6; ++frame) EXPECT_EQ(states[static_cast<std::size_t>(frame)], SlipState::kSticking);
  EXPECT_EQ(states.back(), SlipState::kIncipient);
}

TEST(IncipientSlip, BadSettingsAreRefused) {
  const auto refuses = [](auto change) {
    IncipientSlipSettings settings;
    change(settings);
    EXPECT_THROW(IncipientSlipDetector{settings}, Error);
  };
  refuses([](auto& s) { s.history_frames = 1; });
  refuses([](auto& s) { s.least_motion_px = 0.0; });
  refuses([](auto& s) { s.patch_part = 0.1; });
  refuses([](auto& s) { s.least_markers = 5; });
  refuses([](auto& s) { s.lag_threshold = std::nan(""); });
  refuses([](auto& s) { s.certainty = -1.0; });
  refuses([](auto& s) { s.slide_px = 0.0; });
  refuses([](auto& s) { s.least_shear_px = -1.0; });
}

}  // namespace
}  // namespace touchstone::sensors
