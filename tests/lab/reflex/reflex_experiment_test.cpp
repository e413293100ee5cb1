// The reflex experiments on painted pictures: a touch whose dots and forces are known in closed form.

#include "lab/reflex/reflex_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "lab/reflex/reflex_presses.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device_gel.h"
#include "tests/lab/reflex/one_band_chip.h"
#include "tests/sensors/reflex/painted_fingertip.h"

namespace touchstone::lab {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

render::MotionChipSettings chip_settings() {
  render::MotionChipSettings made = test::one_band_chip();
  made.shutter.automatic = false;
  return made;
}

/// A pinhole 16 mm before dots that a plate brings nearer, 0.47 mm a pixel, with light that grows by 5 % a mm; forces
/// by [Knoop2013, eq. 1], and shear, where the path goes on sideways by `sideways_mm` along x, of 0.5 N/mm.
ReflexTouch painted_touch(const std::string& name, double deepest_mm, double sideways_mm = 0.0,
                          double towards_rad = 0.0) {
  const render::MotionChipSettings chip = chip_settings();
  const double full = test::full_light(chip);
  const Eigen::Vector2d towards(std::cos(towards_rad), std::sin(towards_rad));
  const auto lateral_mm = [=](double place) { return std::max(place - deepest_mm, 0.0) * towards; };
  const auto press_mm = [=](double place) { return std::clamp(place, 0.0, deepest_mm); };
  const ReflexPathLight::Picture picture = [=](double place) {
    sensors::fixtures::FingertipPainter painter{.spacing_px = 4.3, .radius_px = 1.06, .ground = 3.0, .dot = 36.0};
    painter.gain = 1.0 + 0.05 * press_mm(place);
    const double dilation = sensors::fixtures::dilation_of(press_mm(place));
    const sensors::DotsMotion motion{dilation, dilation / 0.47 * lateral_mm(place)};
    const std::vector<Eigen::Vector2d> dots = painter.dots();
    cv::Mat light(18, 18, CV_32FC1);
    for (int row = 0; row < 18; ++row) {
      for (int column = 0; column < 18; ++column) {
        light.at<float>(row, column) =
            static_cast<float>(full / test::kFullLight_DN * painter.light(dots, motion, row, column));
      }
    }
    return light;
  };
  std::vector<double> at;
  std::vector<ReflexTruth> states;
  for (double place = 0.0; place <= deepest_mm + sideways_mm + 1e-9; place += 0.25) {
    at.push_back(place);
    states.push_back({place > 0.0, press_mm(place), lateral_mm(place), published_reflex_force(press_mm(place)),
                      0.5 * lateral_mm(place)});
  }
  return {name, at, states, ReflexPathLight(picture, at, chip, {.allowed = 1.0 / 63}), ""};
}

const ReflexSetup& setup() {
  static const ReflexSetup kSetup = [] {
    ReflexSetup made;
    made.chip = chip_settings();
    made.touches.push_back(painted_touch("plate", 5.0));
    for (const double depth : {2.0, 4.0}) {
      for (const double towards : {0.0, 0.5 * M_PI}) {
        made.touches.push_back(painted_touch(fmt::format("{} {:.0f}", depth, towards), depth, 1.0, towards));
      }
    }
    return made;
  }();
  return kSetup;
}

TEST(ReflexTouch, TruthIsStraightBetweenStates) {
  const ReflexTouch& touch = setup().touches[1];  // 2 mm down, then along x
  EXPECT_FALSE(touch.truth(-0.5).contact);
  EXPECT_EQ(touch.truth(-0.5).press_mm, -0.5);
  EXPECT_FALSE(touch.truth(0.0).contact);
  EXPECT_TRUE(touch.truth(1e-6).contact);
  EXPECT_NEAR(touch.truth(1.1).press_mm, 1.1, 1e-12);
  EXPECT_NEAR(touch.truth(2.6).lateral_mm.x(), 0.6, 1e-12);
  EXPECT_NEAR(touch.truth(2.6).shear_N.x(), 0.3, 1e-12);
  EXPECT_EQ(touch.truth(100.0).press_mm, 2.0);
  const double between = touch.truth(1.1).normal_N;
  EXPECT_GT(between, published_reflex_force(1.1));  // a chord of a curve that bends upwards
  EXPECT_LT(between, published_reflex_force(1.25));
}

TEST(ReflexMotion, GoesThereAndBack) {
  const ReflexMotion motion = reciprocation(-1.0, 5.0, 2.0);
  EXPECT_EQ(motion(0.0), -1.0);
  EXPECT_EQ(motion(0.5), 0.0);
  EXPECT_EQ(motion(3.0), 5.0);
  EXPECT_EQ(motion(5.5), 0.0);
  EXPECT_EQ(motion(6.0), -1.0);
  EXPECT_EQ(single_stroke(-1.0, 2.0, 2.0)(1.0), 1.0);
  EXPECT_EQ(single_stroke(-1.0, 2.0, 2.0)(9.0), 2.0);
}

TEST(ReflexExperiment, ScoresCountWhatIsMissedAndHowFarForcesAreOff) {
  sensors::ReflexModel model;
  model.tree.nodes.resize(3);
  model.tree.nodes[0] = {sensors::ChipFeature::maximum, 38.0, 1, 2, false};
  model.tree.nodes[1].force_present = true;
  model.force.coefficients[0] = 2.0;  // always 2 N
  const auto point = [](int maximum, double press_mm, double force_N) {
    ReflexPoint one;
    one.statistics.maximum = maximum;
    one.truth.contact = press_mm > 0.0;
    one.truth.press_mm = press_mm;
    one.truth.normal_N = force_N;
    return one;
  };
  const std::vector<ReflexPoint> points = {point(30, -1.0, 0.0), point(30, 0.2, 0.1), point(30, 0.4, 0.05),
                                           point(50, -0.5, 0.0), point(50, 2.0, 2.5)};
  const ReflexScore score = score_reflex(model, points);
  EXPECT_EQ(score.error_percent, 60.0);
  EXPECT_EQ(score.missed_percent, 40.0);
  EXPECT_EQ(score.false_percent, 20.0);
  EXPECT_EQ(score.missed_below_N, 0.1);
  EXPECT_EQ(score.missed_below_mm, 0.4);
  EXPECT_NEAR(score.rms_N, std::sqrt((0.01 + 0.0025 + 4.0 + 0.25) / 5.0), 1e-12);
  EXPECT_NEAR(score.rms_below_1N_N, std::sqrt((0.01 + 0.0025) / 2.0), 1e-12);
  EXPECT_EQ(score.largest_error_N, 2.0);
  EXPECT_EQ(score_reflex(model, {}).error_percent, 0.0);
}

TEST(ReflexExperiment, ReflexModeLearnsTheTouch) {
  const ReflexTouch& plate = setup().touches[0];
  const auto training = record_points(setup(), plate, reciprocation(-1.0, 5.0, 2.0), 500, 18, 1);
  ASSERT_EQ(training.size(), 500u);
  const sensors::ReflexModel model = train_reflex(training), curved = train_reflex(training, 2);
  const auto test = record_points(setup(), plate, reciprocation(-1.0, 5.0, 2.0), 500, 18, 2);
  const ReflexScore score = score_reflex(model, test);
  EXPECT_LT(score.error_percent, 10.0);
  EXPECT_LT(score.missed_below_N, 0.5);
  EXPECT_LT(score.rms_N, 1.0);
  EXPECT_LT(score_reflex(curved, test).rms_N, score.rms_N);
  // The same bytes again.
  const auto again = record_points(setup(), plate, reciprocation(-1.0, 5.0, 2.0), 500, 18, 2);
  EXPECT_EQ(score_reflex(model, again).rms_N, score.rms_N);
}

TEST(ReflexExperiment, ExploreModeFindsThePinholesDistance) {
  const ReflexTouch& plate = setup().touches[0];
  const auto pictures = record_pictures(setup(), plate, reciprocation(0.0, 5.0, 2.0), 50, 3);
  const cv::Mat rest = rest_picture(setup(), 4, 4);
  sensors::ExploreModel model;
  model.force = fit_law(plate);
  EXPECT_NEAR(model.force.scale_N, 1.1293, 0.01);
  EXPECT_NEAR(model.force.rate_per_mm, 0.4677, 0.002);
  for (const bool text : {true, false}) {
    sensors::ExploreSettings settings;
    if (text) settings = sensors::text_explore_settings();
    if (!text) settings.times = sensors::chip_pixel_times();
    const auto readings = explore(rest, pictures, settings);
    model.press = fit_press(readings, pictures, 1);
    EXPECT_NEAR(model.press.mm[0], 16.0, 0.5);
    const ExploreScore score = score_explore(model, readings, pictures);
    EXPECT_LT(score.rms_mm, 0.2);
    EXPECT_EQ(score.pictures, 50);
    EXPECT_EQ(score.absolute + score.relative + score.held, 50);
    EXPECT_EQ(score.held, 0);
  }
}

TEST(ReflexExperiment, ShearIsLearnedInBothModes) {
  const auto training = record_points(setup(), setup().touches[0], reciprocation(-1.0, 5.0, 2.0), 500, 18, 1);
  const sensors::ReflexModel reflex = train_reflex(training, 2);
  sensors::ExploreModel model;
  model.force = fit_law(setup().touches[0]);
  model.press = {1, {16.0, 0.0, 0.0}, 0.0};
  model.lateral_mm_per_px = 0.47 * Eigen::Matrix2d::Identity();
  const cv::Mat rest = rest_picture(setup(), 4, 4);
  sensors::ExploreSettings settings;
  settings.times = sensors::chip_pixel_times();
  std::vector<sensors::ShearSample> counts, shifts;
  for (std::size_t i = 1; i < setup().touches.size(); ++i) {
    const ReflexTouch& touch = setup().touches[i];
    const ReflexMotion motion = single_stroke(-0.5, touch.end(), 2.0);
    const int frames = static_cast<int>(1500.0 * (touch.end() + 0.5) / 2.0);
    const auto found = reflex_shear_samples(reflex, record_points(setup(), touch, motion, frames, 1, i), 10);
    counts.insert(counts.end(), found.begin(), found.end());
    const auto pictures = record_pictures(setup(), touch, motion, frames / kChipPixels, i);
    const auto seen = explore_shear_samples(model, explore(rest, pictures, settings), pictures);
    shifts.insert(shifts.end(), seen.begin(), seen.end());
  }
  const sensors::ShearLaw by_counts = sensors::fit_shear_law(counts), by_shift = sensors::fit_shear_law(shifts);
  EXPECT_LT(shear_rms_N(by_counts, counts), 0.5 * shear_size_N(counts));
  EXPECT_LT(shear_rms_N(by_shift, shifts), 0.2 * shear_size_N(shifts));
  EXPECT_NEAR(by_shift.force_N({1.0, 0.0}, 3.0).x(), 0.5, 0.05);  // what it was painted with
}

TEST(ReflexExperiment, AReflexIsSoonerThanExploringAndThatThanNobody) {
  const ReflexTouch& plate = setup().touches[0];
  const auto training = record_points(setup(), plate, reciprocation(-1.0, 5.0, 2.0), 500, 18, 1);
  const sensors::ReflexModel reflex = train_reflex(training);
  sensors::ExploreModel model;
  model.force = fit_law(plate);
  model.press = {1, {16.0, 0.0, 0.0}, 0.0};
  const cv::Mat rest = rest_picture(setup(), 4, 4);
  ReflexCollisionSettings settings;
  settings.collision.speed_mm_s = 10.0;
  settings.collision.actuator.most_acceleration_mm_s2 = 1e5;  // 50 N
  settings.reflex.stop_frames = 3;                            // one frame's noise is no touch
  const auto run = [&](Watcher watcher) { return collide(setup(), plate, watcher, reflex, model, rest, settings, 5); };
  const Collision fast = run(Watcher::reflex), slow = run(Watcher::explore), none = run(Watcher::nobody);
  ASSERT_TRUE(fast.reaction_ms() && slow.reaction_ms());
  EXPECT_LT(*fast.reaction_ms(), 100.0);
  EXPECT_GT(*slow.reaction_ms(), *fast.reaction_ms());
  EXPECT_LT(fast.peak_force_N, slow.peak_force_N);
  EXPECT_LT(slow.peak_force_N, none.peak_force_N);
  EXPECT_TRUE(none.beyond_law);
  EXPECT_FALSE(none.reaction_ms());
}

TEST(ReflexTouch, ATiltedPlateThatReachesTheSideDoesNotTearTheSkin) {
  // Along the side's horizontal normal the plate's face is tens of millimetres away, above the vertex half of one.
  sim::DeviceSpec device = sim::read_device(TOUCHSTONE_SOURCE_DIR "/scenes/devices/reflex.yaml");
  device.mesh.fine_mm = 1.5;
  device.mesh.coarse_mm = 2.5;
  const auto gel = sim::set_up_finite_gel(device);
  const sim::VisibleGel skin = visible_skin(*gel, sim::gel_body(device));
  const auto vertices = static_cast<Eigen::Index>(gel->outer.mesh_vertex.size());
  fem::PressState press;
  press.surface_displacement = Eigen::MatrixX3d::Zero(vertices, 3);
  press.node_state.assign(static_cast<std::size_t>(vertices), fem::NodeState::open);
  press.node_owner.assign(static_cast<std::size_t>(vertices), -1);
  const sim::GelSheet bare = skin.sheet(press, {});
  const Eigen::AngleAxisd tilt(10.0 * M_PI / 180.0, Eigen::Vector3d::UnitY());
  const fem::ContactShape plate = fem::BoxShape{{60.0, 60.0, 4.0}};
  int side = -1;  // the free side's vertex that the tilted plate comes to first
  for (int i = 0; i < vertices; ++i) {
    const Eigen::Vector3d& at = gel->mesh.vertices[gel->outer.mesh_vertex[static_cast<std::size_t>(i)]];
    if (at.z() > -8.5 || at.z() < -11.4) continue;
    const auto x_of = [&](int k) {
      return gel->mesh.vertices[gel->outer.mesh_vertex[static_cast<std::size_t>(k)]].x();
    };
    if (side < 0 || at.x() > x_of(side)) side = i;
  }
  ASSERT_GE(side, 0);
  const Eigen::Vector3d at = gel->mesh.vertices[gel->outer.mesh_vertex[static_cast<std::size_t>(side)]];
  press.node_state[static_cast<std::size_t>(side)] = fem::NodeState::stick;
  press.node_owner[static_cast<std::size_t>(side)] = 0;
  press.gel_from_object = {tilt.toRotationMatrix(), at + Eigen::Vector3d(0.0, 0.0, 0.5)};
  const sim::GelSheet sheet = skin_sheet(skin, press, plate);
  EXPECT_LT((sheet.mesh.vertices[static_cast<std::size_t>(side)] - at).norm(), 2.0);
  EXPECT_EQ(sheet.mesh.vertices.size(), bare.mesh.vertices.size());
}

TEST(ReflexTouch, TheRowsTouchesBeginWithATouch) {
  EXPECT_EQ(reflex_row_touches(true).size(), 1u);
  const auto all = reflex_row_touches(false);
  EXPECT_EQ(all.size(), 9u);
  for (const ReflexTouchSpec& spec : all) {
    EXPECT_EQ(spec.path.points.front().at, 0.0) << spec.name;
    EXPECT_EQ(spec.path.points.front().shift_mm.norm(), 0.0) << spec.name;
    for (std::size_t i = 1; i < spec.path.points.size(); ++i) {
      EXPECT_GT(spec.path.points[i].at, spec.path.points[i - 1].at) << spec.name;
    }
  }
}

TEST(ReflexTouch, ASetupNeedsATouchThatBeginsAtZero) {
  const auto device = sim::read_device(TOUCHSTONE_SOURCE_DIR "/scenes/devices/reflex.yaml");
  EXPECT_THAT([&] { set_up_reflex(device, "", {}); }, ThrowsMessage<Error>(HasSubstr("needs a touch")));
  std::vector<ReflexTouchSpec> specs = {{"late", press_down({})}};
  specs[0].path.points.erase(specs[0].path.points.begin());
  EXPECT_THAT([&] { set_up_reflex(device, "", specs); }, ThrowsMessage<Error>(HasSubstr("doesn't begin at 0")));
  specs[0].path.points = {{}};
  EXPECT_THAT([&] { set_up_reflex(device, "", specs); }, ThrowsMessage<Error>(HasSubstr("two are needed")));
}

}  // namespace
}  // namespace touchstone::lab
