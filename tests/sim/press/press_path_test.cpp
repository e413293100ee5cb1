#include "sim/press/press_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "fem/finite_strain/finite_press.h"
#include "sim/press/force_law.h"
#include "sim/press/gel_setup.h"
#include "sim/press/press_path_file.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::touchstone::test::message_of;
using ::touchstone::test::TemporaryFolder;

DeviceSpec device() {
  DeviceSpec device;
  device.name = "small";
  device.gel.shape = SlabSpec{.size_x_mm = 8.0, .size_y_mm = 8.0};
  device.gel.thickness_mm = 3.0;
  device.gel.youngs_modulus_MPa = 0.3;
  device.mesh.fine_mm = 1.4;
  device.mesh.coarse_mm = 2.0;
  device.mesh.fine_half_extent_mm = {2.0, 2.0};
  return device;
}

PressPath ball_path() {
  PressPath path;
  path.shape = fem::SphereShape{5.0};
  path.friction = 0.5;
  path.place_mm = {0.1, -0.2};
  path.points = {{0.0, {0, 0, 0}}, {0.4, {0, 0, -0.4}}, {0.8, {0, 0, -0.8}}, {1.0, {0.2, 0, -0.8}}};
  return path;
}

void expect_equal(const fem::PressState& a, const fem::PressState& b) {
  EXPECT_EQ(a.gel_from_object.translation, b.gel_from_object.translation);
  EXPECT_EQ(a.gel_from_object.rotation, b.gel_from_object.rotation);
  EXPECT_EQ(a.wrench, b.wrench);
  EXPECT_EQ(a.traction, b.traction);
  EXPECT_EQ(a.surface_displacement, b.surface_displacement);
  EXPECT_EQ(a.node_state, b.node_state);
  EXPECT_EQ(a.node_owner, b.node_owner);
  EXPECT_EQ(a.bead_displacement.rows(), b.bead_displacement.rows());
  EXPECT_EQ(a.contact_vertices, b.contact_vertices);
  EXPECT_EQ(a.under_resolved, b.under_resolved);
  EXPECT_EQ(a.factorisations, b.factorisations);
  ASSERT_EQ(a.bodies.size(), 1u);
  ASSERT_EQ(b.bodies.size(), 1u);
  EXPECT_EQ(a.bodies[0].wrench, b.bodies[0].wrench);
}

TEST(PressPath, ItsStatesAreThePressesThemselves) {
  const auto gel = set_up_finite_gel(device());
  const PressPath path = ball_path();
  const PlayedPath played = play_path(*gel, path);
  ASSERT_EQ(played.at, (std::vector<double>{0.0, 0.4, 0.8, 1.0}));
  EXPECT_EQ(played.stopped, "");
  EXPECT_LT(std::abs(played.states[0].wrench[2]), 1e-9) << "it begins at the touch";
  fem::FinitePress press(*gel, shape_of(path), path.friction);
  const RigidTransform touch = *press.touching({path.rotation, {0.1, -0.2, 0.0}});
  EXPECT_NEAR(touch.translation.z(), 5.0, 0.05) << "a ball's lowest point touches z = 0";
  for (const auto& point : path.points) {
    fem::PressTarget target;
    for (int a = 0; a < 3; ++a) target.axis[a] = fem::AxisControl::at(touch.translation[a] + point.shift_mm[a]);
    press.step(target);
  }
  expect_equal(press.state(), played.states.back());
  EXPECT_LT(press.state().wrench[0], -0.01) << "friction holds against the drag";
}

TEST(PressPath, BetweenTwoStatesAllRunsStraight) {
  const auto gel = set_up_finite_gel(device());
  const PlayedPath played = play_path(*gel, ball_path());
  expect_equal(played.state(0.4), played.states[1]);
  expect_equal(played.state(1.0), played.states[3]);
  expect_equal(played.state(0.0), played.states[0]);
  const fem::PressState middle = played.state(0.6);
  EXPECT_LT((middle.surface_displacement -
             0.5 * (played.states[1].surface_displacement + played.states[2].surface_displacement))
                .norm(),
            1e-12);
  EXPECT_NEAR(middle.wrench[2], 0.5 * (played.states[1].wrench[2] + played.states[2].wrench[2]), 1e-12);
  EXPECT_NE(message_of([&] { played.state(1.1); }).find("goes from 0 to 1"), std::string::npos);
  EXPECT_NE(message_of([&] { played.state(std::nan("")); }).find("isn't on the path"), std::string::npos);
  EXPECT_NE(message_of([&] { PlayedPath{}.state(0.0); }).find("has no states"), std::string::npos);
}

// The checksum is right: whoever may write into the folder can seal a file as the program does.
TEST(PressPath, AKeptFileWithNumbersThatNoPressHasIsRefused) {
  const test::TemporaryFolder folder;
  const std::string key(64, 'a');
  PlayedPath played;
  played.at = {0.0};
  fem::PressState& state = played.states.emplace_back();
  state.traction = state.surface_displacement = Eigen::MatrixX3d::Zero(1, 3);
  state.bead_displacement = Eigen::MatrixX3d::Zero(0, 3);
  state.node_state = {fem::NodeState::slip};
  const auto message = [&] {
    write_press_path(folder.path() / "path.bin", key, played);
    return message_of([&] { read_press_path(folder.path() / "path.bin", key); });
  };
  EXPECT_EQ(message(), "no error");
  state.node_state = {static_cast<fem::NodeState>(7)};
  EXPECT_EQ(message(), "it has numbers that aren't a press's");
  state.node_state = {fem::NodeState::slip};
  state.traction(0, 1) = std::nan("");
  EXPECT_EQ(message(), "it has numbers that aren't a press's");
}

TEST(PressPath, WhatIsDeeperThanTheGelEndsIt) {
  const auto gel = set_up_finite_gel(device());
  PressPath path = ball_path();
  path.points = {{0.2, {0, 0, -0.2}}, {4.0, {0, 0, -4.0}}, {5.0, {0, 0, 1.0}}};
  const PlayedPath played = play_path(*gel, path);
  EXPECT_EQ(played.states.size(), 1u);
  EXPECT_NE(played.stopped.find("at 4: "), std::string::npos) << played.stopped;
  EXPECT_NE(played.stopped.find("into a gel of 3 mm"), std::string::npos) << played.stopped;
  EXPECT_NE(message_of([&] { played.state(4.0); }).find("into a gel of 3 mm"), std::string::npos);
}

TEST(PressPath, FromTheCacheItIsTheSameToTheBit) {
  const TemporaryFolder folder;
  const PressPath path = ball_path();
  PathPlayer first(device(), folder.path());
  const PlayedPath played = first.play(path);
  EXPECT_EQ(first.played(), 1);
  PathPlayer second(device(), folder.path());
  const PlayedPath read = second.play(path);
  EXPECT_EQ(second.played(), 0);
  EXPECT_EQ(read.note, "");
  EXPECT_EQ(read.at, played.at);
  ASSERT_EQ(read.states.size(), played.states.size());
  for (std::size_t k = 0; k < read.states.size(); ++k) expect_equal(read.states[k], played.states[k]);
}

TEST(PressPath, TheCacheKnowsWhatItBelongsTo) {
  const TemporaryFolder folder;
  const PathPlayer player(device(), folder.path());
  const auto other = [&](const auto& change) {
    PressPath path = ball_path();
    change(path);
    return player.file_of(path);
  };
  const std::filesystem::path file = player.file_of(ball_path());
  EXPECT_EQ(file, other([](PressPath&) {}));
  EXPECT_NE(file, other([](PressPath& p) { p.friction = 0.4; }));
  EXPECT_NE(file, other([](PressPath& p) { p.shape = fem::SphereShape{5.1}; }));
  EXPECT_NE(file, other([](PressPath& p) { p.shape = fem::BoxShape{{5, 5, 5}}; }));
  EXPECT_NE(other([](PressPath& p) {
              p.shape = fem::RoundedCylinder{3, 0.5, 9};
            }),
            other([](PressPath& p) {
              p.shape = fem::RoundedCylinder{3, 0.4, 9};
            }));
  EXPECT_NE(file, other([](PressPath& p) { p.rotation = rotation_from_xyz({0.1, 0, 0}); }));
  EXPECT_NE(file, other([](PressPath& p) { p.place_mm.x() = 0.0; }));
  EXPECT_NE(file, other([](PressPath& p) { p.points.pop_back(); }));
  DeviceSpec stiffer = device();
  stiffer.gel.youngs_modulus_MPa = 0.31;
  EXPECT_NE(file, PathPlayer(stiffer, folder.path()).file_of(ball_path()));
}

/// A file that was cut, changed, or belongs elsewhere is made anew and says so.
TEST(PressPath, ADamagedCacheIsntUsed) {
  const TemporaryFolder folder;
  PressPath path = ball_path();
  path.points = {{0.3, {0, 0, -0.3}}};
  PathPlayer player(device(), folder.path());
  const PlayedPath played = player.play(path);
  const std::string whole = read_whole_file(player.file_of(path));
  PressPath another = path;
  another.friction = 0.4;
  const std::string stranger = [&] {
    player.play(another);
    return read_whole_file(player.file_of(another));
  }();
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 1);
  std::string nameless = whole;
  nameless[0] = 'X';
  // Sealed anew, but the first matrix has other sizes: its rows and columns follow the mark and the key.
  const auto resized = [&](std::int64_t rows, std::int64_t columns) {
    std::string changed = whole.substr(0, whole.size() - 64);
    std::memcpy(changed.data() + 8 + 64, &rows, sizeof(rows));
    std::memcpy(changed.data() + 8 + 64 + sizeof(rows), &columns, sizeof(columns));
    return changed + sha256_of(changed);
  };
  for (const auto& [content, why] : {std::pair{whole.substr(0, 40), std::string("it ends early")},
                                     {nameless, "it isn't a path's presses"},
                                     {flipped, "its checksum is wrong"},
                                     {whole.substr(0, whole.size() - 8), "its checksum is wrong"},
                                     {stranger, "it belongs to another gel or path"},
                                     {resized(17, 2), "its matrices don't fit each other"},
                                     {resized(1'000'000'000, 1), "it ends early"}}) {
    write_whole_file(player.file_of(path), content);
    const PlayedPath anew = player.play(path);
    EXPECT_NE(anew.note.find(why), std::string::npos) << anew.note;
    expect_equal(anew.states.at(0), played.states.at(0));
    EXPECT_EQ(player.play(path).note, "") << "it was repaired";
  }
  std::filesystem::remove_all(folder.path());
  std::ofstream(folder.path()) << "a file where the folder was";
  EXPECT_NE(player.play(path).note.find("couldn't be kept"), std::string::npos);
  std::filesystem::remove(folder.path());
}

TEST(PressPath, WhatMakesNoSenseIsRefused) {
  const auto gel = set_up_finite_gel(device());
  const auto message = [&](const auto& change) {
    PressPath path = ball_path();
    change(path);
    return message_of([&] { play_path(*gel, path); });
  };
  EXPECT_NE(message([](PressPath& p) { p.points.clear(); }).find("no points"), std::string::npos);
  EXPECT_NE(message([](PressPath& p) { p.points[1].at = 0.0; }).find("isn't beyond"), std::string::npos);
  EXPECT_NE(message([](PressPath& p) { p.points[1].at = INFINITY; }).find("isn't finite"), std::string::npos);
  EXPECT_NE(message([](PressPath& p) { p.points[2].shift_mm.y() = NAN; }).find("isn't finite"), std::string::npos);
  EXPECT_NE(message([](PressPath& p) { p.place_mm.x() = NAN; }).find("isn't finite"), std::string::npos);
  EXPECT_NE(message([](PressPath& p) { p.place_mm.x() = 100; }).find("isn't over the gel"), std::string::npos);
  EXPECT_NE(message([](PressPath& p) { p.shape = fem::SphereShape{-1}; }), "no error");
  EXPECT_NE(message([](PressPath& p) { p.friction = -1; }).find("friction"), std::string::npos);
  EXPECT_NE(message([](PressPath& p) { p.rotation(0, 0) = 2; }).find("rotation"), std::string::npos);
  DeviceSpec by_error = device();
  by_error.mesh.force_error = 0.01;
  EXPECT_NE(message_of([&] { PathPlayer(by_error, ""); }).find("fine_mm"), std::string::npos);
}

// Force laws.

ForceLaw quadratic() {
  ForceLaw law;
  for (int k = 0; k <= 20; ++k) {
    law.depth_mm.push_back(0.1 * k);
    law.force_N.push_back(0.01 * k * k);
  }
  return law;
}

TEST(ForceLaw, RunsStraightBetweenItsPointsAndItsEnergyIsItsWork) {
  const ForceLaw law = quadratic();
  EXPECT_EQ(law.force(-1.0), 0.0);
  EXPECT_EQ(law.energy(0.0), 0.0);
  EXPECT_EQ(law.stiffness(-0.1), 0.0);
  EXPECT_NEAR(law.force(1.0), 1.0, 1e-12);
  EXPECT_NEAR(law.force(1.05), 0.5 * (1.0 + 1.21), 1e-12);
  EXPECT_NEAR(law.force(2.0), 4.0, 1e-12);
  for (const double depth : {0.05, 0.33, 1.0, 1.97}) {
    EXPECT_NEAR(law.depth(law.force(depth)), depth, 1e-12);
    constexpr double kStep = 1e-4;
    EXPECT_NEAR((law.energy(depth + kStep) - law.energy(depth - kStep)) / (2 * kStep), law.force(depth), 2e-4);
  }
  EXPECT_NEAR(law.stiffness(1.05), 2.1, 1e-9);
  EXPECT_NE(message_of([&] { law.force(2.01); }).find("depths from 0 to 2 mm"), std::string::npos);
  EXPECT_NE(message_of([&] { law.energy(std::nan("")); }).find("depths"), std::string::npos);
  EXPECT_NE(message_of([&] { law.stiffness(3.0); }).find("depths"), std::string::npos);
  EXPECT_NE(message_of([&] { law.depth(-1.0); }).find("forces"), std::string::npos);
  ForceLaw flat = law;
  flat.force_N[5] = flat.force_N[4];
  EXPECT_NE(message_of([&] { flat.depth(1.0); }).find("doesn't rise at 0.4 mm"), std::string::npos);
}

TEST(ForceLaw, ComesOfAStraightPressOnly) {
  PressPath path = ball_path();
  PlayedPath played;
  for (const PathPoint& point : path.points) {
    played.at.push_back(point.at);
    played.states.emplace_back();
    played.states.back().wrench[2] = -point.shift_mm.z();
  }
  EXPECT_NE(message_of([&] { force_law(path, played, 0.01, 0.02); }).find("sideways"), std::string::npos);
  played.at.pop_back();
  played.states.pop_back();
  const ForceLaw law = force_law(path, played, 0.01, 0.02);
  EXPECT_EQ(law.depth_mm, (std::vector<double>{0.0, 0.4, 0.8}));
  EXPECT_EQ(law.force_N, (std::vector<double>{0.0, 0.4, 0.8}));
  EXPECT_EQ(law.error(0.0), 0.0);
  EXPECT_EQ(law.error(0.4), 0.02);
  EXPECT_EQ(force_law(path, played, 0.1, 0.02).error(0.8), 0.1 * 0.8);
  EXPECT_NE(message_of([&] { force_law(path, played, -0.1, 0.0); }).find("an error of the force law"),
            std::string::npos);
  path.points[2].shift_mm.z() = -0.1;
  EXPECT_NE(message_of([&] { force_law(path, played, 0.0, 0.0); }).find("goes down"), std::string::npos);
  EXPECT_NE(message_of([&] { force_law(path, PlayedPath{}, 0.0, 0.0); }).find("there are none"), std::string::npos);
}

TEST(RelaxingForce, WithoutASeriesItIsTheLaw) {
  RelaxingForce force(quadratic(), {});
  EXPECT_EQ(force.step(1.0, 0.1), quadratic().force(1.0));
  EXPECT_EQ(force.after(0.5, 100.0), quadratic().force(0.5));
  EXPECT_EQ(force.law().depth_mm.size(), 21u);
}

TEST(RelaxingForce, RelaxesAsTheSeriesAndNeverPulls) {
  const fem::PronySeries series = {{0.2, 0.1}, {0.3, 2.0}};
  RelaxingForce force(quadratic(), series);
  const double start = force.step(1.5, 0.0);
  EXPECT_EQ(start, quadratic().force(1.5)) << "a sudden press is the elastic one";
  EXPECT_NEAR(force.after(1.5, 0.7), fem::relaxation_at(series, 0.7) * start, 1e-12);
  for (int k = 0; k < 7; ++k) force.step(1.5, 0.1);
  EXPECT_NEAR(force.after(1.5, 0.0), fem::relaxation_at(series, 0.7) * start, 1e-12) << "steps don't matter";
  EXPECT_EQ(force.step(0.0, 0.0), 0.0);
  EXPECT_EQ(force.step(0.3, 0.0), 0.0) << "the gel is still further in";
  EXPECT_GT(force.step(0.3, 10.0), 0.0);
  EXPECT_NE(message_of([&] { force.step(0.3, -1.0); }).find("at least 0"), std::string::npos);
  EXPECT_NE(message_of([&] { force.step(9.0, 1.0); }).find("depths"), std::string::npos);
  EXPECT_THROW(RelaxingForce(quadratic(), {{1.2, 1.0}}), Error);
}

/// It is fem::FinitePress's own: the same law, the same series, the same path.
TEST(RelaxingForce, IsTheForceOfAPressThatRelaxes) {
  const auto gel = set_up_finite_gel(device());
  const fem::PronySeries series = {{0.3, 0.5}};
  PressPath path = ball_path();
  path.points = {{0.2, {0, 0, -0.2}}, {0.4, {0, 0, -0.4}}, {0.6, {0, 0, -0.6}}};
  RelaxingForce cheap(force_law(path, play_path(*gel, path), 0.0, 0.0), series);
  fem::FinitePress press(*gel, shape_of(path), path.friction, {}, series);
  const RigidTransform touch = *press.touching({path.rotation, {0.1, -0.2, 0.0}});
  for (const auto& [depth, seconds] : {std::pair{0.2, 0.1}, {0.4, 0.1}, {0.6, 0.1}, {0.6, 1.0}}) {
    fem::PressTarget target;
    for (int a = 0; a < 3; ++a) target.axis[a] = fem::AxisControl::at(touch.translation[a]);
    target.axis[2].value -= depth;
    target.seconds = seconds;
    const double full = press.step(target).wrench[2];
    EXPECT_NEAR(cheap.step(depth, seconds), full, 1e-6 * full);
  }
}

}  // namespace
}  // namespace touchstone::sim
