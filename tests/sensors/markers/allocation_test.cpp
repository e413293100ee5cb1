// After the first frame nothing is allocated: neither by operator new nor by OpenCV for its images.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <opencv2/core.hpp>

#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_estimator.h"
#include "sensors/markers/incipient_slip.h"
#include "sensors/markers/motion_ratio.h"
#include "sensors/reflex/reflex_loop.h"
#include "tests/sensors/beads/force_samples.h"
#include "tests/sensors/beads/rendered_beads.h"
#include "tests/sensors/heights/painted_gel.h"
#include "tests/sensors/markers/painted_markers.h"

namespace {

std::atomic<long> allocations = 0;

}  // namespace

// Not inlined: the compiler would take the pair of new and free for a mistake.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
// std::stable_sort's, whose memory comes back to the delete below.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size);
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const auto align = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(align, (size + align - 1) / align * align)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

namespace touchstone::sensors {
namespace {

/// Counts the images that OpenCV makes, which don't go through operator new.
class CountingAllocator : public cv::MatAllocator {
 public:
  cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, std::size_t* step, cv::AccessFlag flags,
                         cv::UMatUsageFlags usage) const override {
    ++allocations;
    return cv::Mat::getStdAllocator()->allocate(dims, sizes, type, data, step, flags, usage);
  }
  bool allocate(cv::UMatData* data, cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
    ++allocations;
    return cv::Mat::getStdAllocator()->allocate(data, flags, usage);
  }
  void deallocate(cv::UMatData* data) const override { cv::Mat::getStdAllocator()->deallocate(data); }
};

class Allocation : public testing::Test {
 protected:
  Allocation() { cv::Mat::setDefaultAllocator(&allocator); }
  ~Allocation() override { cv::Mat::setDefaultAllocator(nullptr); }
  CountingAllocator allocator;
};

TEST_F(Allocation, IsCounted) {
  const long before = allocations;
  const auto number = std::make_unique<int>(3);
  EXPECT_EQ(allocations, before + 1);
  const cv::Mat image(4, 4, CV_8U);
  EXPECT_GT(allocations, before + 1);
}

/// Frames with beads that are lost, found again and jump, in the dark and without any contrast.
std::vector<Frame> hard_frames(const BeadTrackerSettings& settings, double spacing, double radius_px, int type) {
  fixtures::BeadPainter painter({.radius_px = radius_px, .noise = 2.0});
  const auto rest = fixtures::grid_positions(settings.grid, spacing, {320.0, 240.0});
  std::vector<Frame> frames;
  for (int i = 0; i < 12; ++i) {
    auto beads = rest;
    for (auto& bead : beads) bead += 0.5 * i * Eigen::Vector2d(1.0, -0.7);
    if (i >= 5) beads[2] = {std::nan(""), 0.0};                     // hidden, searched for
    if (i == 7) beads[3] += 0.3 * spacing * Eigen::Vector2d(1, 1);  // jumps
    cv::Mat image = painter.paint(beads);
    if (i == 9) image.setTo(0);
    if (i == 10) image.setTo(100);
    if (CV_MAT_CN(type) == 3) cv::merge(std::vector<cv::Mat>{image, image, image}, image);
    image.convertTo(image, CV_MAT_DEPTH(type), CV_MAT_DEPTH(type) == CV_16U ? 16.0 : 1.0);
    frames.push_back({image, i * 1663});
  }
  return frames;
}

void expect_none_after_the_first(const BeadTrackerSettings& settings, const std::vector<Frame>& frames) {
  const StiffnessForceModel model = fixtures::known_model(settings.grid, MatrixForm::kAsymmetric, 1);
  BeadTracker tracker(settings);
  Eigen::Vector3d sum = estimate(model, tracker.track(frames[0])).force;
  int lost = 0;
  const long before = allocations;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const TrackedBeads& beads = tracker.track(frames[i]);
    sum += estimate(model, beads).force;
    lost += settings.grid * settings.grid - beads.found();
  }
  EXPECT_EQ(allocations, before) << "type " << frames[0].image.type() << ", grid of " << settings.grid;
  EXPECT_GT(lost, 0);
  EXPECT_TRUE(sum.allFinite());
}

TEST_F(Allocation, NoneAfterTheFirstFrame) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3}) {
    for (const CentroidKind centroid : {CentroidKind::kBinary, CentroidKind::kWeighted}) {
      const BeadTrackerSettings three = {.centroid = centroid};
      expect_none_after_the_first(three, hard_frames(three, 70.0, 9.0, type));
    }
    const BeadTrackerSettings ten = {.grid = 10, .roi_a_px = 430, .roi_b_px = 20};
    expect_none_after_the_first(ten, hard_frames(ten, 43.0, 5.0, type));
  }
}

TEST_F(Allocation, NoneForMarkersAndSlipAfterTheFirstFrame) {
  const auto rest = fixtures::marker_grid();
  std::vector<Frame> frames;
  for (int i = 0; i < 12; ++i) {
    auto places = rest;
    for (auto& place : places) place += 0.8 * i * Eigen::Vector2d(1.0, -0.5);
    if (i == 5) places[20].setConstant(std::nan(""));
    frames.push_back({fixtures::paint_markers({.noise = 2.0}, places, static_cast<std::uint64_t>(1 + i)), i});
    if (i == 8) frames.back().image.setTo(0);
  }
  MarkerTracker tracker({});
  IncipientSlipDetector detector;
  cv::Mat contact;
  double sum = 0.0;
  const auto update = [&](std::size_t i) {
    const TrackedMarkers& markers = tracker.track(frames[i]);
    sum += motion_ratio(frames[0].image, frames[i > 0 ? i - 1 : 0].image, frames[i].image, {}, &contact).motion_px;
    erase_markers(contact, markers, 4.0);
    contact(cv::Rect(100, 60, 120, 120)).setTo(255);
    sum += detector.update(markers, contact_patch(contact, 50)).motion_px;
  };
  update(0);
  const long before = allocations;
  for (std::size_t i = 1; i < frames.size(); ++i) update(i);
  EXPECT_EQ(allocations, before);
  EXPECT_GT(sum, 0.0);
}

TEST_F(Allocation, NoneForAHeightMapAfterTheFirst) {
  fixtures::GelPainter painter(120, 90, 0.053, {});
  HeightCalibrationSettings calibration;
  calibration.mm_per_px = 0.053;
  calibration.table.most_cells = 20000;
  const HeightModel model = calibrate_height(painter.presses(2, 2, 1.0, 0.7), painter.background(), calibration).model;
  const std::vector<cv::Mat> frames = {painter.rest(), painter.press({{3.0, 2.5}, 2.0, 1.0}).frame};
  for (const HeightBorder border : {HeightBorder::zero, HeightBorder::free}) {
    HeightEstimator estimator(model, {.border = border});
    int contact = estimator.estimate(frames[0]).contact_pixels;
    const long before = allocations;
    for (const cv::Mat& frame : frames) contact += estimator.estimate(frame).contact_pixels;
    EXPECT_EQ(allocations, before);
    EXPECT_GT(contact, 0);
  }
}

TEST_F(Allocation, NoneForAReflex) {
  ReflexModel model;
  model.tree.nodes.resize(3);
  model.tree.nodes[0] = {ChipFeature::maximum, 38.0, 1, 2, false};
  model.tree.nodes[1].force_present = true;
  model.force.coefficients[1] = 0.1;
  model.shear = ShearLaw{Eigen::Matrix2d::Identity(), Eigen::Matrix2d::Identity(), 0.0};
  ReflexLoop loop(model, {.stop_above_N = 1.0});
  const long before = allocations;
  double sum = 0.0;
  for (int i = 0; i < 100; ++i) {
    const ReflexDecision decision = loop.next(
        {.t_us = 667 * i, .dx = 1, .maximum = i % 64, .minimum = 0, .squal = i % 50, .average = 0.5 * (i % 64)});
    sum += decision.force_N + decision.shear_N.x();
  }
  EXPECT_EQ(allocations, before);
  EXPECT_GT(sum, 0.0);
}

}  // namespace
}  // namespace touchstone::sensors
