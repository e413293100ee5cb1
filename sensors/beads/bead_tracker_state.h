#pragma once
// What BeadTracker keeps from frame to frame, and the steps of a frame: those of [VisioHaptic2024] in bead_tracker.cpp,
// those that compare beads with each other in bead_tracker_consistency.cpp.

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "sensors/beads/bead_filter.h"
#include "sensors/beads/bead_tracker.h"
#include "sensors/beads/bead_window.h"

namespace touchstone::sensors {

/// All that a tracker remembers.
struct BeadTracker::State {
  /// What is known of one bead from the frames before.
  struct Bead {
    BeadFilter filter;
    bool filtering = false;  ///< `filter` holds the state of the frame before
    bool reset = true;       ///< at its cell's centre, not yet found there
    int hidden_frames = 0;
    double usual_area_px = 0.0;  ///< 0 = not known
  };

  explicit State(const BeadTrackerSettings& with);  ///< @throws Error as BeadTracker

  BeadTrackerSettings settings;
  double cell_side = 0.0;
  bool first = true;
  int rows = 0, cols = 0, type = 0;  ///< of the first frame
  Eigen::Vector2d roi_a_centre = Eigen::Vector2d::Zero();
  std::vector<Bead> beads;
  std::vector<Eigen::Vector2d> before;  ///< positions in the frame before; in the first one the cells' centres
  std::vector<std::uint8_t> was_found;  ///< in the frame before; in the first one all
  std::vector<Bead> beads_before;
  std::vector<std::uint8_t> lone;         ///< whether what was found doesn't go along with the neighbours
  std::vector<Eigen::Vector2d> expected;  ///< where the neighbours have each bead
  std::vector<Eigen::Vector2d> at_first;  ///< measured in the first frame
  std::vector<std::uint8_t> found_at_first;
  std::vector<BeadMeasurement> jumped;  ///< what follow_jump works on
  BrightnessScale scale;
  GreyWindow window;
  TrackedBeads result;

  void check_frame(const Frame& frame) const;
  void place_roi_a(const cv::Mat& image);
  cv::Rect roi_a(const cv::Mat& image) const;
  bool adjust_brightness(const cv::Mat& image);
  Eigen::Vector2d cell_centre(std::size_t bead) const;
  bool in_cell(std::size_t bead, const Eigen::Vector2d& where) const;
  std::optional<BeadMeasurement> measure_near(const cv::Mat& image, std::size_t bead, const Eigen::Vector2d& where);
  std::optional<BeadMeasurement> search_cell(const cv::Mat& image, std::size_t bead);
  void follow(const cv::Mat& image, std::size_t bead, bool visible, double dt);
  void accept(std::size_t bead, const BeadMeasurement& measurement, BeadStatus status, double dt);
  void hold_or_reset(std::size_t bead);
  /// What a displacement is measured from.
  enum class Since { kFrameBefore, kFirstFrame };
  std::optional<Eigen::Vector2d> motion_of_neighbours(std::size_t bead, Since since) const;
  Eigen::Vector2d median_step(int down, int right) const;
  void take_instead(const cv::Mat& image, std::size_t bead, double dt);
  double spread_of_motions(const std::vector<Eigen::Vector2d>& from) const;
  void reject_lone_motions(const cv::Mat& image, double dt);
  void reject_lone_displacements(const cv::Mat& image);
  void reject_off_grid(const cv::Mat& image);
  bool follow_jump(const cv::Mat& image, const Eigen::Vector2d& step);
  void recover_after_jump(const cv::Mat& image);
  void reset_to_cell(std::size_t bead);
};

}  // namespace touchstone::sensors
