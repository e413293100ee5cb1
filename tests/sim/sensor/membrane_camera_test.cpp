// Fast pictures of a device's milky membrane, and the events that they make.

#include "sim/sensor/membrane_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "core/error.h"
#include "fem/elements/compliance.h"
#include "render/events/event_pixels.h"
#include "sim/plan/plan.h"
#include "sim/view/visible_scene.h"

namespace touchstone::sim {
namespace {

using testing::HasSubstr;

DeviceSpec grasp_device() {
  return read_device(TOUCHSTONE_SOURCE_DIR "/scenes/devices/dvs-grasp.yaml");
}

const MembraneCamera& camera() {
  static const MembraneCamera one(grasp_device(), {.cell_mm = 0.5, .walks = 1 << 16});
  return one;
}

/// A black strip of 35.5 x 3.75 mm that touches over the given share of each cell.
render::FaceState strip(double share) {
  const render::FaceGrid& grid = camera().grid();
  render::FaceState state = camera().free_face();
  state.albedo = 0.04;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const double x = grid.left_mm + (column + 0.5) * grid.spacing_mm;
      const double y = grid.top_mm + (row + 0.5) * grid.spacing_mm;
      if (std::abs(x) < 17.75 && std::abs(y) < 1.875) state.contact.at<float>(row, column) = static_cast<float>(share);
    }
  }
  return state;
}

render::EventPixelSettings noise_free(const DeviceSpec& device) {
  render::EventPixelSettings pixels = device.camera->events.value().pixels;
  pixels.threshold_spread = pixels.leak_rate_hz = pixels.shot_rate_hz = pixels.bandwidth_hz = 0.0;
  pixels.refractory_us = 0;
  return pixels;
}

TEST(MembraneCamera, GridIsTheMembrane) {
  const render::FaceGrid& grid = camera().grid();
  EXPECT_EQ(grid.columns, 80);
  EXPECT_EQ(grid.rows, 40);
  EXPECT_DOUBLE_EQ(grid.left_mm, -20.0);
  EXPECT_DOUBLE_EQ(grid.top_mm, -10.0);
  EXPECT_NEAR(camera().behind(), 0.16 / 0.53, 1e-12);
}

// 48 x 36 mm are seen, 0.2 mm a pixel [Naeini2020, sec. V.A]: neighbours' places are 0.2 mm apart.
TEST(MembraneCamera, PixelIsAFifthOfAMillimetre) {
  const DeviceSpec device = grasp_device();
  EXPECT_EQ(device.camera->width, 240);
  EXPECT_EQ(device.camera->height, 180);
  EXPECT_LT(device.camera->events->pixels.on_threshold, device.camera->events->pixels.off_threshold);
  const cv::Mat free = camera().photocurrent(camera().free_face());
  // A step of 10 mm along y: the pad's edge is where the picture jumps.
  int edge = 90;
  while (edge < 179 && free.at<float>(edge + 1, 120) > 0.8F * free.at<float>(90, 120)) ++edge;
  EXPECT_NEAR((edge + 1 - 90) * 0.2, 10.0, 0.3);
}

TEST(MembraneCamera, TouchDarkensWhatIsTouched) {
  const cv::Mat free = camera().photocurrent(camera().free_face());
  const cv::Mat touched = camera().photocurrent(strip(1.0));
  const double middle = std::log(touched.at<float>(90, 120) / free.at<float>(90, 120));
  EXPECT_LT(middle, -0.4);
  EXPECT_GT(middle, -0.7);
  const double aside = std::log(touched.at<float>(130, 120) / free.at<float>(130, 120));  // 6 mm from the strip
  EXPECT_GT(aside, -0.05);
  const double per_watt = free.at<float>(90, 120) / camera().irradiance(camera().free_face()).at<float>(90, 120);
  // 75.3 um^2 (the preset's 22 % of 18.5 um squared), 0.4 electrons a photon, 3.61e-19 J a photon at 550 nm.
  EXPECT_NEAR(per_watt, 75.3e-12 * 0.4 / 3.612e-19, 0.03 * per_watt);
}

// Ideal pixels that see light fall as a straight line of its logarithm give as many events as whole thresholds fit.
TEST(MembraneCamera, EventsAreTheIntegralOfTheLogarithm) {
  const DeviceSpec device = grasp_device();
  const render::EventPixelSettings settings = noise_free(device);
  render::EventPixels pixels(settings, {240, 180}, 1, 1);
  std::vector<Event> events;
  cv::Mat last;
  const cv::Mat first = camera().photocurrent(strip(0.0));
  constexpr int kSteps = 40;
  for (int step = 0; step <= kSteps; ++step) {  // ever darker
    last = camera().photocurrent(strip(static_cast<double>(step) / kSteps));
    pixels.advance(last, 1000 * step, events);
  }
  cv::Mat count(180, 240, CV_32S, cv::Scalar(0));
  for (const Event& event : events) {
    EXPECT_FALSE(event.on);
    ++count.at<int>(event.y, event.x);
  }
  const cv::Mat before = render::log_intensity(first, settings);
  const cv::Mat after = render::log_intensity(last, settings);
  int fired = 0;
  for (int row = 0; row < 180; ++row) {
    for (int column = 0; column < 240; ++column) {
      const double fall = before.at<float>(row, column) - after.at<float>(row, column);
      // A pixel whose fall is a whole number of thresholds within rounding may go either way.
      const double thresholds = fall / settings.off_threshold;
      if (std::abs(thresholds - std::round(thresholds)) > 1e-4) {
        EXPECT_EQ(count.at<int>(row, column), static_cast<int>(std::floor(thresholds))) << column << " " << row;
      }
      fired += count.at<int>(row, column);
    }
  }
  EXPECT_GT(fired, 2000);
}

TEST(MembraneCamera, StaticSceneGivesNoEvent) {
  const DeviceSpec device = grasp_device();
  render::EventPixels pixels(noise_free(device), {240, 180}, 1, 1);
  std::vector<Event> events;
  for (int step = 0; step < 20; ++step) pixels.advance(camera().photocurrent(strip(1.0)), 1000 * step, events);
  EXPECT_TRUE(events.empty());
}

// On a grid that is moved by a quarter of a cell, coverage keeps its area and gaps are the nearest.
TEST(FaceState, OfAnotherGridKeepsItsArea) {
  const render::FaceGrid grid{-4.0, -2.0, 0.5, 16, 8};
  const fem::PixelGrid from{10, 6, 0.4, Eigen::Vector2d(-1.7, -0.9)};
  cv::Mat coverage(6, 10, CV_32FC1, cv::Scalar(0.0));
  cv::Mat gap(6, 10, CV_32FC1, cv::Scalar(10.0));
  coverage(cv::Rect(2, 1, 5, 3)).setTo(0.8);
  gap(cv::Rect(1, 1, 7, 4)).setTo(0.05);
  const render::FaceState state = face_state(grid, from, coverage, gap, 10.0, 0.04, 6.5);
  EXPECT_NEAR(cv::sum(state.contact)[0] * 0.25, 15 * 0.8 * 0.16, 1e-5);
  EXPECT_FLOAT_EQ(state.gap_mm.at<float>(4, 8), 0.05F);
  EXPECT_TRUE(std::isinf(state.gap_mm.at<float>(0, 0)));
  EXPECT_EQ(state.albedo, 0.04);
  EXPECT_THROW(face_state(grid, {9, 6, 0.4, Eigen::Vector2d::Zero()}, coverage, gap, 10.0, 0.04, 6.5), Error);
}

// For path tracing the room behind is a luminous panel, the last of the scene's surfaces.
TEST(RoomBehind, IsAPanel) {
  SceneSpec scene;
  scene.device = grasp_device();
  Plan plan;
  plan.bands.centres_nm = Eigen::ArrayXd::Constant(1, 550.0);
  const render::Scene with = scene_without_surface(scene, plan, {}, {}, {});
  const auto* panel = std::get_if<render::Emitter>(&with.surfaces.back().material);
  ASSERT_NE(panel, nullptr);
  EXPECT_DOUBLE_EQ(panel->radiance[0], 0.16);
  EXPECT_GT(with.surfaces.back().mesh.vertices[0].z(), 100.0);
  render::check_scene(with);
  scene.device.room_radiance_behind.reset();
  EXPECT_EQ(scene_without_surface(scene, plan, {}, {}, {}).surfaces.size() + 1, with.surfaces.size());
}

template <typename Change>
std::string refusal(const Change& change) {
  DeviceSpec device = grasp_device();
  change(device);
  try {
    const MembraneCamera made(device, {.cell_mm = 1.0, .walks = 1 << 10});
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(MembraneCamera, RefusesWhatItCannotShow) {
  EXPECT_THAT(refusal([](DeviceSpec& d) { d.camera.reset(); }), HasSubstr("no camera"));
  EXPECT_THAT(refusal([](DeviceSpec& d) { d.camera->bayer = render::BayerPattern::rggb; }), HasSubstr("colours"));
  EXPECT_THAT(refusal([](DeviceSpec& d) { d.gel.shape = DomeSpec{}; }), HasSubstr("isn't a slab"));
  EXPECT_THAT(refusal([](DeviceSpec& d) { d.lamps.emplace_back(); }), HasSubstr("has lamps"));
  EXPECT_THAT(refusal([](DeviceSpec& d) { d.coating.emplace(); }), HasSubstr("a coating, beads or films"));
  EXPECT_THAT(refusal([](DeviceSpec& d) { d.band_wavelengths_nm = {610, 540, 455}; }), HasSubstr("several bands"));
  EXPECT_THAT(refusal([](DeviceSpec& d) { d.room_radiance = 0.0; }), HasSubstr("which is dark"));
  EXPECT_THROW(MembraneCamera(grasp_device(), {.cell_mm = 0.0}), Error);
}

}  // namespace
}  // namespace touchstone::sim
