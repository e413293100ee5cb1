// A hexagonal piece gripped on the membrane. A short piece on a small pad, so that each set-up takes a second.

#include "sim/grasp/gripped_face.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "fem/fine_relief/pixel_contact.h"
#include "sim/press/elastic_object.h"
#include "sim/press/gel_setup.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kLength = 12.0;
constexpr double kFlat = 6.5 / 1.7320508075688772;

const test::TemporaryFolder& cache() {
  static const test::TemporaryFolder folder;
  return folder;
}

const DeviceSpec& device() {
  static const DeviceSpec made = parse_yaml<DeviceSpec>(R"(
name: small
gel: {size_x_mm: 20, size_y_mm: 14, thickness_mm: 2, youngs_modulus_MPa: 0.25, poisson_ratio: 0.49}
mesh: {fine_mm: 0.5, coarse_mm: 1.5, fine_half_extent_mm: [6.8, 2.7], fine_depth_mm: 1}
plate: {thickness_mm: 5, refractive_index: 1.49}
)",
                                                        "small.yaml");
  return made;
}

const fem::Compliance& gel() {
  static const auto made = set_up_gel(device(), cache().path());
  return *made;
}

ObjectSpec piece(const std::string& more = "") {
  return parse_yaml<ObjectSpec>(
      "name: piece\nshape: {type: hexagon, across_flats_mm: 6.5, length_mm: 12}\nfriction: 0.8\n" + more, "piece.yaml");
}

/// Null for a rigid one.
std::shared_ptr<const fem::Compliance> elastic_of(double modulus, double poisson = 0.45) {
  if (std::isinf(modulus)) return nullptr;
  const ObjectSpec object =
      piece(fmt::format("elastic: {{youngs_modulus_MPa: 1, poisson_ratio: {}, mesh_mm: 1.5}}\n", poisson));
  return std::make_shared<const fem::Compliance>(
      fem::with_modulus(*set_up_elastic_object(object, cache().path()), modulus));
}

GrippedFace face_of(double modulus, const GrippedPose& pose = {}, const GrippedFaceSettings& settings = {}) {
  return {device(), gel(), piece(), elastic_of(modulus), pose, settings};
}

constexpr double kRigid = std::numeric_limits<double>::infinity();

const GrippedFace& level_rigid() {
  static const GrippedFace face = face_of(kRigid);
  return face;
}

GrippedPose pitched(double degrees) {
  GrippedPose pose;
  pose.pitch_deg = degrees;
  return pose;
}

/// The press looks at rigid overlap, so a soft piece can't be solved as far.
GrippedFaceSettings gentle() {
  GrippedFaceSettings settings;
  settings.largest_force_N = 1.2;
  return settings;
}

/// Of cells that bear, those at the rim whole.
double pressed_area(const GrippedFace& face, double force) {
  const FaceMap map = face.map(face.at_normal_force(force));
  return face.grid().pixel_area() * cv::countNonZero(map.pressure_MPa > 0);
}

/// Mean place of a map's values.
Eigen::Vector2d centroid(const GrippedFace& face, const cv::Mat& map) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double all = 0.0;
  for (int j = 0; j < map.rows; ++j) {
    for (int i = 0; i < map.cols; ++i) {
      sum += map.at<float>(j, i) * face.grid().centre(i, j);
      all += map.at<float>(j, i);
    }
  }
  return sum / all;
}

TEST(GrippedFace, PressuresSumUpToTheForceAndSharesAreShares) {
  const GrippedFace face = face_of(0.5, pitched(0.15));
  for (const double force : {0.003, 0.01, 0.05, 0.3, 0.4, 1.0, 3.7}) {
    const FaceMap map = face.map(face.at_normal_force(force));
    EXPECT_NEAR(cv::sum(map.pressure_MPa)[0] * face.grid().pixel_area(), force, 1e-5 * force);
    double least = 0.0;
    double most = 0.0;
    cv::minMaxLoc(map.coverage, &least, &most);
    EXPECT_GE(least, 0.0);
    EXPECT_LE(most, 1.0);
    cv::minMaxLoc(map.gap_mm, &least, &most);
    EXPECT_GE(least, 0.0);
    EXPECT_FLOAT_EQ(static_cast<float>(most), static_cast<float>(kNoPiece_mm)) << "beside the piece there is none";
  }
}

// An independent way to the same answer: the endless layer under the strip, without finite elements. The pad's sides
// are four thicknesses away along the strip's ends and two and a half beside it; the elements' own error is a percent
// or two.
TEST(GrippedFace, IsAsStiffAsTheLayersOwnSolutionOfARigidStrip) {
  constexpr double kForce = 1.0;
  const auto reference = [&](double pitch) {
    const fem::PixelGrid grid{
        static_cast<int>(std::lround(kLength / pitch)), static_cast<int>(std::lround(kFlat / pitch)), pitch, {0, 0}};
    const fem::LayerResponse layer({0.25, 0.49}, 2.0, grid, fem::GridEdges::free);
    const std::vector<double> gap(grid.size(), 0.0);
    return -fem::solve_pixel_contact(layer, {gap, kForce}).shift;
  };
  const double expected = reference(0.1);
  EXPECT_NEAR(reference(0.2), expected, 0.03 * expected) << "what cells of the map's size make of it";
  EXPECT_NEAR(level_rigid().at_normal_force(kForce).approach_mm, expected, 0.04 * expected);
}

TEST(GrippedFace, PieceAndMembraneAreSpringsInARow) {
  const auto softness = [](double modulus) { return face_of(modulus, {}, gentle()).at_normal_force(1.0).approach_mm; };
  const double rigid = level_rigid().at_normal_force(1.0).approach_mm;
  const double of_piece = softness(0.1) - rigid;  // ten times the softness of one of 1 MPa, and so on
  EXPECT_NEAR(softness(1.0) - rigid, of_piece / 10, 0.06 * of_piece / 10);
  EXPECT_NEAR(softness(0.3) - rigid, of_piece / 3, 0.04 * of_piece / 3);
  EXPECT_NEAR(softness(2.1e5), rigid, 1e-3 * rigid);
  // A column of the flat's width is softer than the hexagon, one of its largest width stiffer.
  EXPECT_LT(of_piece, 6.5 / (0.1 * kLength * kFlat));
  EXPECT_GT(of_piece, 0.6 * 6.5 / (0.1 * kLength * 2.0 * kFlat));
}

TEST(GrippedFace, SofterPiecesAreTouchedFurtherAtTheSameForce) {
  double last = 0.0;
  for (const double modulus : {kRigid, 2.4, 1.1, 0.15}) {
    const GrippedFace face = face_of(modulus, pitched(0.4), gentle());
    const double area = pressed_area(face, 0.12);
    EXPECT_GT(area, 1.03 * last) << modulus;
    last = area;
  }
  EXPECT_LE(last, 1.02 * pressed_area(level_rigid(), 3.0));
}

TEST(GrippedFace, ALevelFlatTouchesAtOnceAndAPitchedOneGrowsFromItsEnd) {
  const double all = pressed_area(level_rigid(), 3.0);
  EXPECT_NEAR(pressed_area(level_rigid(), 0.02), all, 0.02 * all);
  const GrippedFace face = face_of(kRigid, pitched(0.4));
  double last = 0.0;
  for (const double force : {0.02, 0.05, 0.1, 0.2, 0.4, 0.7}) {
    const double area = pressed_area(face, force);
    EXPECT_GT(area, last);
    last = area;
    EXPECT_LT(centroid(face, face.map(face.at_normal_force(force)).pressure_MPa).x(), 0.0)
        << "the end at +x stands off";
  }
  EXPECT_LE(last, 1.02 * all);
  // Between two states of the table the rim moves on, too.
  const double growth = pressed_area(face, 0.4) - pressed_area(face, 0.2);
  double before = pressed_area(face, 0.2);
  for (int k = 1; k <= 10; ++k) {
    const double area = pressed_area(face, 0.2 * std::pow(2.0, 0.1 * k));
    EXPECT_GE(area, before);
    EXPECT_LT(area - before, 0.3 * growth);
    before = area;
  }
}

TEST(GrippedFace, CoverageGrowsUntilTheRoughnessIsPressedFlat) {
  double last = 0.0;
  for (const double force : {0.05, 0.2, 0.5, 1.0, 2.0, 5.0}) {
    const FaceMap map = level_rigid().map(level_rigid().at_normal_force(force));
    const double share = cv::sum(map.coverage)[0] * level_rigid().grid().pixel_area() / (kLength * kFlat);
    EXPECT_GT(share, last);
    last = share;
  }
  EXPECT_NEAR(last, 1.0, 0.03);
  GrippedFaceSettings smooth;
  smooth.rms_slope = 0.0;
  const GrippedFace face = face_of(kRigid, {}, smooth);
  EXPECT_NEAR(cv::sum(face.map(face.at_normal_force(0.05)).coverage)[0] * face.grid().pixel_area(), kLength * kFlat,
              0.02 * kLength * kFlat);
}

TEST(GrippedFace, ShearCarriesTheContactAlongByItsCompliance) {
  const GripPoint point = level_rigid().at_normal_force(3.0);
  EXPECT_NEAR(point.shear_N / point.normal_N, std::tan(15.0 * 3.14159265358979 / 180), 1e-12);
  EXPECT_NEAR(std::hypot(point.shear_N, point.normal_N), point.force_N, 1e-12);
  // What the finger travels beyond the approach is the membrane's shear: a rigid piece has none of its own.
  const double tilt = 15.0 * 3.14159265358979 / 180;
  const double compliance =
      (point.travel_mm - point.approach_mm * std::cos(tilt)) / (point.shear_N * std::sin(tilt));  // mm/N
  // A layer in simple shear is h / (G A) if nothing beside it helps.
  const double alone = 2.0 / (0.25 / (2 * 1.49) * kLength * kFlat);
  EXPECT_LT(compliance, alone);
  EXPECT_GT(compliance, 0.3 * alone);
  const Eigen::Vector2d moved = centroid(level_rigid(), level_rigid().map(point).pressure_MPa);
  EXPECT_NEAR(moved.y(), compliance * point.shear_N, 0.01);
  EXPECT_NEAR(moved.x(), 0.0, 0.02);
}

TEST(GrippedFace, ApartTheGapIsWhatTheFingerIsAway) {
  const GrippedFace face = face_of(0.3, pitched(-0.2), gentle());
  const FaceMap touching = face.map(face.at_travel(0.0));
  const FaceMap apart = face.map(face.at_travel(-0.5));
  EXPECT_EQ(cv::countNonZero(apart.coverage), 0);
  EXPECT_EQ(cv::countNonZero(apart.pressure_MPa), 0);
  const int row = face.grid().ny / 2;
  for (const int column : {face.grid().nx / 2 - 20, face.grid().nx / 2, face.grid().nx / 2 + 20}) {
    EXPECT_NEAR(apart.gap_mm.at<float>(row, column) - touching.gap_mm.at<float>(row, column),
                0.5 * std::cos(15.0 * 3.14159265358979 / 180), 1e-5);
  }
  EXPECT_NEAR(touching.gap_mm.at<float>(row, face.grid().nx / 2), kLength / 2 * std::tan(0.2 * 3.14159265358979 / 180),
              1e-3);
}

TEST(GrippedFace, ForceRisesWithTravelAndUnloadingIsTheSame) {
  const GrippedFace face = face_of(0.5, pitched(0.1));
  double last = 0.0;
  for (int k = 1; k < 60; ++k) {
    const GripPoint point = face.at_travel(k * face.states().back().travel_mm / 60);
    EXPECT_GT(point.force_N, last);
    EXPECT_GT(point.stiffness_N_mm, 0.0);
    EXPECT_NEAR(face.at_normal_force(point.normal_N).travel_mm, point.travel_mm, 1e-9);
    last = point.force_N;
  }
  EXPECT_EQ(face.at_travel(-0.1).force_N, 0.0);
}

TEST(GrippedFace, TheSameInputGivesTheSameBytes) {
  const GrippedFace one = face_of(0.5, pitched(0.1));
  const GrippedFace other = face_of(0.5, pitched(0.1));
  const FaceMap a = one.map(one.at_normal_force(0.77));
  const FaceMap b = other.map(other.at_normal_force(0.77));
  for (const auto& [x, y] :
       {std::pair{a.coverage, b.coverage}, {a.gap_mm, b.gap_mm}, {a.pressure_MPa, b.pressure_MPa}}) {
    EXPECT_EQ(std::memcmp(x.data, y.data, x.total() * x.elemSize()), 0);
  }
}

void expect_refused(const std::function<void()>& act, const char* words) {
  try {
    act();
    ADD_FAILURE() << "not refused: " << words;
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(words));
  }
}

TEST(GrippedFace, WhatMakesNoSenseIsRefused) {
  const auto with = [](const auto& change) {
    GrippedPose pose;
    GrippedFaceSettings settings;
    ObjectSpec object = piece();
    change(pose, settings, object);
    GrippedFace(device(), gel(), object, nullptr, pose, settings);
  };
  using P = GrippedPose&;
  using S = GrippedFaceSettings&;
  using O = ObjectSpec&;
  expect_refused([&] { with([](P p, S, O) { p.place_mm = {40, 0}; }); }, "isn't over the membrane");
  expect_refused([&] { with([](P p, S, O) { p.place_mm = {15.8, 0}; }); }, "vertices of the membrane's mesh");
  expect_refused([&] { with([](P p, S, O) { p.place_mm.x() = NAN; }); }, "place_mm");
  expect_refused([&] { with([](P p, S, O) { p.pitch_deg = 6; }); }, "tilted by 6");
  expect_refused([&] { with([](P p, S, O) { p.yaw_deg = NAN; }); }, "yaw_deg");
  expect_refused([&] { with([](P, S s, O) { s.tilt_deg = 60; }); }, "tilt_deg is 60");
  expect_refused([&] { with([](P, S s, O) { s.cell_mm = 0; }); }, "cell_mm is 0");
  expect_refused([&] { with([](P, S s, O) { s.largest_force_N = 0.001; }); }, "above least_force_N");
  expect_refused([&] { with([](P, S s, O) { s.force_ratio = 1.0; }); }, "force_ratio is 1");
  expect_refused([&] { with([](P, S s, O) { s.rms_slope = -1; }); }, "rms_slope is -1");
  expect_refused([&] { with([](P, S, O o) { o.friction = 0.2; }); }, "must be at least 0.268");
  expect_refused([&] { with([](P, S, O o) { o.shape.type = ShapeKind::box; }); }, "must be of the shape hexagon");
  expect_refused([&] { with([](P, S, O o) { o.print.emplace_back(); }); }, "has a print");
  DeviceSpec dome = device();
  dome.gel.shape = DomeSpec{};
  expect_refused([&] { GrippedFace(dome, gel(), piece(), nullptr, {}); }, "a slab");
  expect_refused([] { level_rigid().at_travel(5.0); }, "more than the 6 N");
  expect_refused([] { level_rigid().at_normal_force(7.0); }, "from 0 to 6 N");
}

}  // namespace
}  // namespace touchstone::sim
