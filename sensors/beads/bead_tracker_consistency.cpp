// How the tracker's beads are compared with each other: jumps of all, and what doesn't move as its neighbours do.

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>

#include "sensors/beads/bead_tracker_state.h"

namespace touchstone::sensors {

namespace {

/// The median of some numbers, which are put in another order. @pre there is one
double median_of(double* numbers, std::size_t count) {
  double* const middle = numbers + count / 2;
  std::nth_element(numbers, middle, numbers + count);
  if (count % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(numbers, middle));
}

}  // namespace

/// Takes all beads for moved by `step` since the frame before. Changes nothing and returns false if one isn't there.
bool BeadTracker::State::follow_jump(const cv::Mat& image, const Eigen::Vector2d& step) {
  for (std::size_t bead = 0; bead < beads.size(); ++bead) {
    const Eigen::Vector2d where = before[bead] + step;
    const std::optional<BeadMeasurement> found = measure_near(image, bead, where);
    if (!found || (found->centroid - where).norm() > 0.25 * cell_side) return false;
    jumped[bead] = *found;
  }
  for (std::size_t bead = 0; bead < beads.size(); ++bead) accept(bead, jumped[bead], BeadStatus::kFoundAgain, 0.0);
  return true;
}

/// All beads may have moved by more than half a cell since the frame before: then cells hold a neighbour's bead, and
/// those at one side hold none. What the middlemost cell that isn't empty holds is one of its nine nearest beads.
void BeadTracker::State::recover_after_jump(const cv::Mat& image) {
  const int n = settings.grid;
  int lost = 0;
  std::optional<std::size_t> middle;
  for (std::size_t bead = 0; bead < beads.size(); ++bead) {
    if (was_found[bead] && !is_found(result.status[bead])) ++lost;
    if (!is_found(result.status[bead])) continue;
    const auto from_middle = [&](std::size_t i) { return (cell_centre(i) - roi_a_centre).squaredNorm(); };
    if (!middle || from_middle(bead) < from_middle(*middle)) middle = bead;
  }
  if (lost < n) return;
  if (!middle) {  // half a cell along both axes: parts of four beads in each
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        if (follow_jump(image, cell_side * Eigen::Vector2d(x, y))) return;
      }
    }
    return;
  }
  const Eigen::Vector2d there = result.measured[*middle];
  const int row = static_cast<int>(*middle) / n;
  const int column = static_cast<int>(*middle) % n;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, n - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, n - 1); ++c) {
      if (follow_jump(image, there - before[static_cast<std::size_t>(r * n + c)])) return;
    }
  }
}

/// Component by component the median motion of the beads around this one; nothing if fewer than two were seen in both
/// frames.
std::optional<Eigen::Vector2d> BeadTracker::State::motion_of_neighbours(std::size_t bead, Since since) const {
  const bool recent = since == Since::kFrameBefore;
  const std::vector<Eigen::Vector2d>& from = recent ? before : at_first;
  const std::vector<std::uint8_t>& seen = recent ? was_found : found_at_first;
  const int n = settings.grid;
  const int row = static_cast<int>(bead) / n;
  const int column = static_cast<int>(bead) % n;
  std::array<double, 8> x, y;
  std::size_t count = 0;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, n - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, n - 1); ++c) {
      const auto other = static_cast<std::size_t>(r * n + c);
      if (other == bead || !seen[other] || !is_found(result.status[other])) continue;
      x[count] = result.measured[other].x() - from[other].x();
      y[count++] = result.measured[other].y() - from[other].y();
    }
  }
  if (count < 2) return std::nullopt;
  return Eigen::Vector2d(median_of(x.data(), count), median_of(y.data(), count));
}

/// Looks for a bead where its neighbours have it, as if what was found in this frame hadn't been.
void BeadTracker::State::take_instead(const cv::Mat& image, std::size_t bead, double dt) {
  beads[bead] = beads_before[bead];
  const std::optional<BeadMeasurement> found = measure_near(image, bead, expected[bead]);
  if (found && (found->centroid - expected[bead]).norm() <= settings.consistency.lone_motion * cell_side &&
      in_cell(bead, found->centroid)) {
    accept(bead, *found, was_found[bead] ? BeadStatus::kFound : BeadStatus::kFoundAgain, dt);
  } else {
    result.positions[bead] = expected[bead];
    hold_or_reset(bead);
  }
}

/// Compares each bead's motion since the frame before with its neighbours'.
void BeadTracker::State::reject_lone_motions(const cv::Mat& image, double dt) {
  const double most = settings.consistency.lone_motion * cell_side;
  if (result.found() == static_cast<int>(beads.size()) && spread_of_motions(before) <= most)
    return;  // as nearly always
  for (std::size_t bead = 0; bead < beads.size(); ++bead) {
    lone[bead] = 0;
    if (beads_before[bead].reset || result.status[bead] == BeadStatus::kReset) continue;
    const std::optional<Eigen::Vector2d> motion = motion_of_neighbours(bead, Since::kFrameBefore);
    if (!motion) continue;
    expected[bead] = before[bead] + *motion;
    lone[bead] = !is_found(result.status[bead]) || (result.measured[bead] - expected[bead]).norm() > most ? 1 : 0;
  }
  for (std::size_t bead = 0; bead < beads.size(); ++bead) {
    if (lone[bead]) take_instead(image, bead, dt);
  }
}

/// Compares each bead's motion since the first frame with its neighbours': what is followed may be something else, near
/// which the bead came by.
void BeadTracker::State::reject_lone_displacements(const cv::Mat& image) {
  const double most = settings.consistency.lone_displacement * cell_side;
  if (spread_of_motions(at_first) <= most) return;
  for (std::size_t bead = 0; bead < beads.size(); ++bead) {
    if (!is_found(result.status[bead]) || !found_at_first[bead]) continue;
    const std::optional<Eigen::Vector2d> motion = motion_of_neighbours(bead, Since::kFirstFrame);
    if (!motion) continue;
    const Eigen::Vector2d there = at_first[bead] + *motion;
    if ((result.measured[bead] - there).norm() <= most) continue;
    const std::optional<BeadMeasurement> found = measure_near(image, bead, there);
    if (found && (found->centroid - there).norm() <= settings.consistency.lone_motion * cell_side) {
      accept(bead, *found, BeadStatus::kFoundAgain, 0.0);
    }
  }
}

/// A bound of how far two beads' motions since then differ.
double BeadTracker::State::spread_of_motions(const std::vector<Eigen::Vector2d>& from) const {
  Eigen::Array2d low = Eigen::Array2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::size_t bead = 0; bead < beads.size(); ++bead) {
    const Eigen::Array2d motion = result.measured[bead] - from[bead];
    low = low.min(motion);
    high = high.max(motion);
  }
  return (high - low).matrix().norm();
}

/// The median step from a bead to the next one of the grid, of those found. @pre one of the two is 1, the other 0
Eigen::Vector2d BeadTracker::State::median_step(int down, int right) const {
  const int n = settings.grid;
  std::array<double, 32 * 32> x, y;
  std::size_t count = 0;
  for (int row = 0; row + down < n; ++row) {
    for (int column = 0; column + right < n; ++column) {
      const auto here = static_cast<std::size_t>(row * n + column);
      const auto next = here + static_cast<std::size_t>(down * n + right);
      if (!is_found(result.status[here]) || !is_found(result.status[next])) continue;
      x[count] = result.measured[next].x() - result.measured[here].x();
      y[count++] = result.measured[next].y() - result.measured[here].y();
    }
  }
  if (count == 0) return {right * cell_side, down * cell_side};
  return {median_of(x.data(), count), median_of(y.data(), count)};
}

/// In the first frame beads stand in a nearly regular grid: of several things in a cell that look like a bead the one
/// that fits it is taken.
void BeadTracker::State::reject_off_grid(const cv::Mat& image) {
  const int n = settings.grid;
  const Eigen::Vector2d right = median_step(0, 1), down = median_step(1, 0);
  std::array<double, 32 * 32> x, y;
  std::size_t count = 0;
  const auto from_first = [&](std::size_t bead) {
    const auto [row, column] = std::div(static_cast<int>(bead), n);
    return Eigen::Vector2d(row * down + column * right);
  };
  for (std::size_t bead = 0; bead < beads.size(); ++bead) {
    if (!is_found(result.status[bead])) continue;
    const Eigen::Vector2d of_first = result.measured[bead] - from_first(bead);
    x[count] = of_first.x();
    y[count++] = of_first.y();
  }
  if (count < 3) return;
  const Eigen::Vector2d of_first(median_of(x.data(), count), median_of(y.data(), count));
  for (std::size_t bead = 0; bead < beads.size(); ++bead) {
    expected[bead] = of_first + from_first(bead);
    const bool fits = is_found(result.status[bead]) &&
                      (result.measured[bead] - expected[bead]).norm() <= settings.consistency.first_offset * cell_side;
    if (fits) continue;
    beads[bead] = beads_before[bead];
    const std::optional<BeadMeasurement> found = measure_near(image, bead, expected[bead]);
    if (found && (found->centroid - expected[bead]).norm() <= settings.consistency.lone_motion * cell_side) {
      accept(bead, *found, BeadStatus::kFoundAgain, 0.0);
    } else if (is_found(result.status[bead])) {
      accept(bead, {.centroid = result.measured[bead], .area_px = result.area_px[bead]}, result.status[bead], 0.0);
    }
  }
}

}  // namespace touchstone::sensors
