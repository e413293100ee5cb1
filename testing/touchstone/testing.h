#pragma once
// Virtual devices for your own tests, by GoogleTest: press this with 2 N here, take the frame, and hold what your
// estimator makes of it against the truth and the truth's own error bar.
//
//   using namespace touchstone::testing;
//   TEST(MyEstimator, ReadsTwoNewtons) {
//     const Touch held = device("gelsight-flat").press(ball(8), {.force_N = 2});
//     EXPECT_THAT(my_estimate(held.frame, held.background), IsForceOf(held, {.absolute = 0.1}));
//   }
//
// CMake: find_package(Touchstone), target_link_libraries(my_tests Touchstone::testing). docs/testing.md says more.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <ostream>
#include <string>
#include <utility>

#include "lab/device/truth_comparison.h"
#include "sim/sensor/virtual_sensor.h"

namespace cv {

/// GoogleTest would print every pixel.
inline void PrintTo(const Mat& image, std::ostream* out) {
  *out << image.cols << " x " << image.rows << " pixels of " << typeToString(image.type());
}

}  // namespace cv

namespace touchstone::testing {

using lab::Tolerance;
using sim::PressSpec;
using sim::Touch;
using sim::TouchObject;
using sim::TouchOptions;
using sim::VirtualSensor;
using sim::VirtualSensorSettings;

/// A device by its shipped name ("vhs", "gelsight-flat") or by its file. Set up when it's first asked for, which may
/// take half a minute, and kept while the program runs: all tests share it. The gel's part is kept on disk between runs
/// (in $TOUCHSTONE_CACHE or ~/.cache/touchstone).
/// @throws Error naming the file that can't be read, or the shipped devices
const VirtualSensor& device(const std::string& name_or_file, const VirtualSensorSettings& settings = {});

/// An object by its shipped name ("probe-6mm") or by its file. @throws Error as device
sim::ObjectSpec object(const std::string& name_or_file);
/// A rigid ball with Coulomb's `friction` on the gel. @throws Error for a diameter that isn't above 0
sim::ObjectSpec ball(double diameter_mm, double friction = 0.5);

/// Where $TOUCHSTONE_FAILED_FRAMES names a folder: writes frame and background there as PNG, named after the running
/// test, and says where. Matchers call it for what doesn't match.
std::string keep_frames(const Touch& held);

/// Three numbers, as programs have them.
inline Eigen::Vector3d as_vector(const Eigen::Vector3d& v) {
  return v;
}
inline Eigen::Vector3d as_vector(const cv::Vec3d& v) {
  return {v[0], v[1], v[2]};
}
inline Eigen::Vector3d as_vector(const cv::Point3d& v) {
  return {v.x, v.y, v.z};
}
inline Eigen::Vector3d as_vector(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

/// Turns a comparison with the truth into a matcher. `Compare` takes (estimate, truth) and gives a lab::Comparison.
template <typename Compare>
class TruthMatcher {
 public:
  using is_gtest_matcher = void;  ///< GoogleMock's mark of a matcher

  /// `what` names the quantity in messages: "the force".
  TruthMatcher(Touch truth, std::string what, Compare compare)
      : truth_(std::move(truth)), what_(std::move(what)), compare_(std::move(compare)) {}

  /// GoogleMock asks this; frames of what doesn't match are kept (keep_frames).
  template <typename Estimate>
  bool MatchAndExplain(const Estimate& estimate, ::testing::MatchResultListener* listener) const {
    const lab::Comparison comparison = compare_(estimate, truth_);
    *listener << comparison.message;
    if (!comparison.within && listener->IsInterested()) *listener << keep_frames(truth_);
    return comparison.within;
  }
  void DescribeTo(std::ostream* out) const { *out << "is " << what_ << " of " << truth_.what; }
  void DescribeNegationTo(std::ostream* out) const { *out << "isn't " << what_ << " of " << truth_.what; }

 private:
  Touch truth_;
  std::string what_;
  Compare compare_;
};

/// The force on the object, N, each component (an Eigen::Vector3d, cv::Vec3d, cv::Point3d or std::array<double, 3>).
inline auto IsForceOf(const Touch& truth, const Tolerance& tolerance) {
  return TruthMatcher(truth, "the force", [tolerance](const auto& estimate, const Touch& held) {
    return lab::compare_force(as_vector(estimate), held, tolerance);
  });
}

/// Its normal component, N, a number.
inline auto IsNormalForceOf(const Touch& truth, const Tolerance& tolerance) {
  return TruthMatcher(truth, "the normal force", [tolerance](double estimate, const Touch& held) {
    return lab::compare_normal_force(estimate, held, tolerance);
  });
}

/// The height map, a cv::Mat of mm in the camera's pixels, in the mean of its absolute error.
inline auto IsHeightOf(const Touch& truth, const Tolerance& tolerance) {
  return TruthMatcher(truth, "the height map", [tolerance](const cv::Mat& estimate, const Touch& held) {
    return lab::compare_heights(estimate, held, tolerance);
  });
}

/// The contact mask, a cv::Mat of 8 bits: pixels of both over pixels of either are at least `least_overlap`.
inline auto IsContactOf(const Touch& truth, double least_overlap) {
  return TruthMatcher(truth, "the contact", [least_overlap](const cv::Mat& estimate, const Touch& held) {
    return lab::compare_contact(estimate, held, least_overlap);
  });
}

/// The displacements of a vhs-like device's beads, a row a bead, mm, each component.
inline auto AreBeadsOf(const Touch& truth, const Tolerance& tolerance) {
  return TruthMatcher(truth, "the beads' displacement",
                      [tolerance](const Eigen::MatrixX3d& estimate, const Touch& held) {
                        return lab::compare_beads(estimate, held, tolerance);
                      });
}

}  // namespace touchstone::testing
