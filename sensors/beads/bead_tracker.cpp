#include "sensors/beads/bead_tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/units.h"
#include "sensors/beads/bead_tracker_state.h"
#include "sensors/beads/bead_window.h"
#include "sensors/beads/bit_window.h"
#include "sensors/image/grey_pixels.h"

namespace touchstone::sensors {

namespace {

void require(bool holds, const char* name, double value, const char* allowed) {
  if (!holds) fail("bead tracker: {} is {}, it must be {}", name, value, allowed);
}

void check(const BeadTrackerSettings& s) {
  require(s.grid >= 2 && s.grid <= 32, "grid", s.grid, "from 2 to 32");
  require(s.roi_a_px > 0 && s.roi_a_px <= 16384, "roi_a_px", s.roi_a_px, "from 1 to 16384");
  require(s.roi_b_px >= 6 && s.roi_b_px <= BitWindow::kMaxSide, "roi_b_px", s.roi_b_px, "from 6 to 64");
  require(s.roi_b_px * s.grid <= s.roi_a_px, "roi_b_px", s.roi_b_px, "at most a cell's side, roi_a_px / grid");
  require(s.mean_brightness > 0 && s.mean_brightness < 255, "mean_brightness", s.mean_brightness, "between 0 and 255");
  require(s.contrast > 0 && s.contrast <= 100, "contrast", s.contrast, "above 0, up to 100");
  require(s.morphology_px >= 1 && s.morphology_px % 2 == 1 && s.morphology_px < s.roi_b_px, "morphology_px",
          s.morphology_px, "odd, at least 1 and below roi_b_px");
  require(s.appearance.min_area_px >= 1 && std::isfinite(s.appearance.min_area_px), "appearance.min_area_px",
          s.appearance.min_area_px, "at least 1");
  require(s.appearance.max_area_fraction > 0 && s.appearance.max_area_fraction <= 1, "appearance.max_area_fraction",
          s.appearance.max_area_fraction, "above 0, up to 1");
  require(s.appearance.min_difference > 0 && s.appearance.min_difference < 255, "appearance.min_difference",
          s.appearance.min_difference, "between 0 and 255");
  require(s.appearance.max_elongation > 1, "appearance.max_elongation", s.appearance.max_elongation, "above 1");
  require(s.appearance.max_area_change > 1, "appearance.max_area_change", s.appearance.max_area_change, "above 1");
  require(s.appearance.least_core > 0 && s.appearance.least_core <= 1, "appearance.least_core", s.appearance.least_core,
          "above 0, up to 1");
  require(s.appearance.core_elongation > 1, "appearance.core_elongation", s.appearance.core_elongation, "above 1");
  require(s.appearance.core_shift_px >= 0, "appearance.core_shift_px", s.appearance.core_shift_px, "at least 0");
  require(s.consistency.lone_motion > 0 && s.consistency.lone_motion <= 1, "consistency.lone_motion",
          s.consistency.lone_motion, "above 0, up to 1");
  require(s.consistency.lone_displacement > 0 && s.consistency.lone_displacement <= 1, "consistency.lone_displacement",
          s.consistency.lone_displacement, "above 0, up to 1");
  require(s.consistency.first_offset > 0 && s.consistency.first_offset <= 1, "consistency.first_offset",
          s.consistency.first_offset, "above 0, up to 1");
  require(s.max_hidden_frames >= 0, "max_hidden_frames", s.max_hidden_frames, "at least 0");
  const BeadFilterSettings& f = s.filter;
  require(f.measurement_px > 0 && std::isfinite(f.measurement_px), "filter.measurement_px", f.measurement_px,
          "above 0");
  require(f.acceleration_px_per_s2 > 0 && std::isfinite(f.acceleration_px_per_s2), "filter.acceleration_px_per_s2",
          f.acceleration_px_per_s2, "above 0");
  require(f.first_velocity_px_per_s >= 0 && std::isfinite(f.first_velocity_px_per_s), "filter.first_velocity_px_per_s",
          f.first_velocity_px_per_s, "at least 0");
  if (s.first_centre_px) {
    for (const double value : *s.first_centre_px) require(std::isfinite(value), "first_centre_px", value, "finite");
  }
}

/// The largest digital number that an image type can hold.
double full_scale(const cv::Mat& image) {
  return image.depth() == CV_8U ? 255.0 : 65535.0;
}

/// later - earlier, without overflow whatever the two are. @pre later > earlier
double microseconds_between(std::int64_t earlier, std::int64_t later) {
  return static_cast<double>(static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier));
}

/// How fast a bead's usual area follows the measured one, a frame.
constexpr double kAreaLearning = 0.05;

}  // namespace

BeadTracker::State::State(const BeadTrackerSettings& with) : settings(with) {
  check(settings);
  const auto count = static_cast<std::size_t>(settings.grid) * static_cast<std::size_t>(settings.grid);
  beads.resize(count);
  result.positions.resize(count);
  result.measured.resize(count);
  result.area_px.resize(count);
  result.status.resize(count);
  before.resize(count);
  was_found.resize(count);
  beads_before.resize(count);
  lone.resize(count);
  expected.resize(count);
  at_first.resize(count);
  found_at_first.resize(count);
  jumped.resize(count);
  cell_side = static_cast<double>(settings.roi_a_px) / settings.grid;
}

void BeadTracker::State::check_frame(const Frame& frame) const {
  const cv::Mat& image = frame.image;
  if (image.empty()) fail("bead tracker: the image at t = {} us is empty", frame.t_us);
  if (image.dims != 2 || (image.depth() != CV_8U && image.depth() != CV_16U) ||
      (image.channels() != 1 && image.channels() != 3)) {
    fail("bead tracker: the image at t = {} us is of type {}; 8 or 16 bit with 1 or 3 channels is needed", frame.t_us,
         cv::typeToString(image.type()));
  }
  if (image.cols < settings.roi_b_px || image.rows < settings.roi_b_px) {
    fail("bead tracker: the image at t = {} us is {} x {} px, smaller than one window of {} px", frame.t_us, image.cols,
         image.rows, settings.roi_b_px);
  }
  if (first) return;
  if (image.cols != cols || image.rows != rows || image.type() != type) {
    fail("bead tracker: the image at t = {} us is {} x {} px of type {}, those before were {} x {} px of type {}",
         frame.t_us, image.cols, image.rows, cv::typeToString(image.type()), cols, rows, cv::typeToString(type));
  }
  if (frame.t_us <= result.t_us) {
    fail("bead tracker: a frame at t = {} us follows one at t = {} us; times must increase", frame.t_us, result.t_us);
  }
}

/// Step i: ROI-A is centred on the beads' mean position in the frame before.
void BeadTracker::State::place_roi_a(const cv::Mat& image) {
  if (first) {
    roi_a_centre = settings.first_centre_px.value_or(Eigen::Vector2d(0.5 * image.cols, 0.5 * image.rows));
  } else {
    roi_a_centre.setZero();
    for (const Eigen::Vector2d& position : result.positions) roi_a_centre += position;
    roi_a_centre /= static_cast<double>(result.positions.size());
  }
  roi_a_centre.x() = std::clamp(roi_a_centre.x(), 0.0, static_cast<double>(image.cols));
  roi_a_centre.y() = std::clamp(roi_a_centre.y(), 0.0, static_cast<double>(image.rows));
}

/// The part of ROI-A that is in the image.
cv::Rect BeadTracker::State::roi_a(const cv::Mat& image) const {
  const int left = static_cast<int>(std::lround(roi_a_centre.x() - 0.5 * settings.roi_a_px));
  const int top = static_cast<int>(std::lround(roi_a_centre.y() - 0.5 * settings.roi_a_px));
  return cv::Rect(left, top, settings.roi_a_px, settings.roi_a_px) & cv::Rect(0, 0, image.cols, image.rows);
}

/// Step ii. Returns whether there is light to see beads by.
bool BeadTracker::State::adjust_brightness(const cv::Mat& image) {
  result.mean_grey = mean_grey(image, roi_a(image));
  result.light = light_of_mean(result.mean_grey / full_scale(image));
  if (result.light != FrameLight::kNormal) return false;
  scale.set(settings.mean_brightness / result.mean_grey);
  return true;
}

Eigen::Vector2d BeadTracker::State::cell_centre(std::size_t bead) const {
  const auto grid = static_cast<std::size_t>(settings.grid);
  const std::size_t row = bead / grid, column = bead % grid;
  const double half = 0.5 * settings.roi_a_px;
  return {roi_a_centre.x() - half + (static_cast<double>(column) + 0.5) * cell_side,
          roi_a_centre.y() - half + (static_cast<double>(row) + 0.5) * cell_side};
}

bool BeadTracker::State::in_cell(std::size_t bead, const Eigen::Vector2d& where) const {
  return (where - cell_centre(bead)).cwiseAbs().maxCoeff() <= 0.5 * cell_side;
}

/// Steps iii to vii in the window round `where`, which is moved once if it cuts what it finds.
std::optional<BeadMeasurement> BeadTracker::State::measure_near(const cv::Mat& image, std::size_t bead,
                                                                const Eigen::Vector2d& where) {
  BeadSearch search{settings, where, beads[bead].usual_area_px, false};
  if (!read_window(image, scale, where, settings.roi_b_px, 1, window)) return std::nullopt;
  std::optional<BeadMeasurement> found = measure_bead(window, search);
  if (!found || !found->cut) return found;
  search.near = found->centroid;
  if (!read_window(image, scale, search.near, settings.roi_b_px, 1, window)) return std::nullopt;
  found = measure_bead(window, search);
  return found && !found->cut ? found : std::nullopt;
}

/// Looks for a bead anywhere in its cell, on every n-th pixel where the cell is large, then measures it as usual.
std::optional<BeadMeasurement> BeadTracker::State::search_cell(const cv::Mat& image, std::size_t bead) {
  const int side = static_cast<int>(std::ceil(cell_side));
  const int stride = (side + BitWindow::kMaxSide - 1) / BitWindow::kMaxSide;
  const Eigen::Vector2d centre = cell_centre(bead);
  if (!read_window(image, scale, centre, side, stride, window)) return std::nullopt;
  const BeadSearch search{settings, centre, beads[bead].usual_area_px, true};
  const std::optional<BeadMeasurement> coarse = measure_bead(window, search);
  if (!coarse) return std::nullopt;
  const std::optional<BeadMeasurement> fine = measure_near(image, bead, coarse->centroid);
  return fine && in_cell(bead, fine->centroid) ? fine : std::nullopt;
}

void BeadTracker::State::reset_to_cell(std::size_t bead) {
  beads[bead].reset = true;
  beads[bead].filtering = false;
  beads[bead].usual_area_px = 0.0;
  result.status[bead] = BeadStatus::kReset;
  result.positions[bead] = cell_centre(bead);
  result.measured[bead] = result.positions[bead];
  result.area_px[bead] = 0.0;
}

void BeadTracker::State::hold_or_reset(std::size_t bead) {
  Bead& state = beads[bead];
  ++state.hidden_frames;
  if (state.reset || state.hidden_frames > settings.max_hidden_frames) {
    reset_to_cell(bead);
    return;
  }
  state.filtering = false;
  result.status[bead] = BeadStatus::kHidden;
  result.measured[bead] = result.positions[bead];
  result.area_px[bead] = 0.0;
}

/// Step ix.
void BeadTracker::State::accept(std::size_t bead, const BeadMeasurement& measurement, BeadStatus status, double dt) {
  Bead& state = beads[bead];
  if (state.filtering && status == BeadStatus::kFound) {
    state.filter.predict(settings.filter, dt);
    state.filter.correct(settings.filter, measurement.centroid);
  } else {
    state.filter.start(settings.filter, measurement.centroid);  // no motion is known across the gap
  }
  state.filtering = true;
  state.reset = false;
  state.hidden_frames = 0;
  if (!measurement.is_core) {
    if (state.usual_area_px == 0.0) state.usual_area_px = measurement.area_px;
    state.usual_area_px += kAreaLearning * (measurement.area_px - state.usual_area_px);
  }
  result.status[bead] = status;
  result.positions[bead] = state.filter.position;
  result.measured[bead] = measurement.centroid;
  result.area_px[bead] = measurement.area_px;
}

void BeadTracker::State::follow(const cv::Mat& image, std::size_t bead, bool visible, double dt) {
  if (!visible) return hold_or_reset(bead);
  if (const auto measurement = measure_near(image, bead, result.positions[bead])) {
    if (in_cell(bead, measurement->centroid)) return accept(bead, *measurement, BeadStatus::kFound, dt);
    return reset_to_cell(bead);  // step viii
  }
  if (const auto measurement = search_cell(image, bead)) {
    return accept(bead, *measurement, BeadStatus::kFoundAgain, dt);
  }
  hold_or_reset(bead);
}

int TrackedBeads::found() const {
  return static_cast<int>(std::count_if(status.begin(), status.end(), is_found));
}

const char* name_of(BeadStatus status) {
  switch (status) {
    case BeadStatus::kFound:
      return "found";
    case BeadStatus::kFoundAgain:
      return "found again";
    case BeadStatus::kHidden:
      return "hidden";
    case BeadStatus::kReset:
      return "reset";
  }
  return "?";
}

BeadTracker::BeadTracker(const BeadTrackerSettings& settings) : state_(std::make_unique<State>(settings)) {}
BeadTracker::~BeadTracker() = default;
BeadTracker::BeadTracker(BeadTracker&&) noexcept = default;
BeadTracker& BeadTracker::operator=(BeadTracker&&) noexcept = default;

const BeadTrackerSettings& BeadTracker::settings() const {
  return state_->settings;
}

void BeadTracker::restart() {
  *state_ = State(BeadTrackerSettings(state_->settings));
}

const TrackedBeads& BeadTracker::track(const Frame& frame) {
  State& s = *state_;
  s.check_frame(frame);
  const cv::Mat& image = frame.image;
  s.place_roi_a(image);
  double dt = 0.0;
  const bool first = s.first;
  if (s.first) {
    s.rows = image.rows;
    s.cols = image.cols;
    s.type = image.type();
    for (std::size_t bead = 0; bead < s.beads.size(); ++bead) s.reset_to_cell(bead);
    s.first = false;
    std::fill(s.was_found.begin(), s.was_found.end(), std::uint8_t{1});
  } else {
    for (std::size_t bead = 0; bead < s.beads.size(); ++bead)
      s.was_found[bead] = is_found(s.result.status[bead]) ? 1 : 0;
    dt = microseconds_between(s.result.t_us, frame.t_us) / kMicrosecondsPerSecond;
  }
  s.result.t_us = frame.t_us;
  std::copy(s.result.positions.begin(), s.result.positions.end(), s.before.begin());
  std::copy(s.beads.begin(), s.beads.end(), s.beads_before.begin());
  const bool visible = s.adjust_brightness(image);
  for (std::size_t bead = 0; bead < s.beads.size(); ++bead) s.follow(image, bead, visible, dt);
  if (visible) s.recover_after_jump(image);
  if (visible && s.settings.consistency.on) {
    if (first) {
      s.reject_off_grid(image);
    } else {
      s.reject_lone_motions(image, dt);
      s.reject_lone_displacements(image);
    }
  }
  if (first) {
    std::copy(s.result.measured.begin(), s.result.measured.end(), s.at_first.begin());
    for (std::size_t bead = 0; bead < s.beads.size(); ++bead) {
      s.found_at_first[bead] = is_found(s.result.status[bead]) ? 1 : 0;
    }
  }
  if (visible && s.result.found() == 0) {
    double low = 0.0, high = 0.0;
    cv::minMaxIdx(image(s.roi_a(image)).reshape(1), &low, &high);
    if (low == high) s.result.light = FrameLight::kFlat;
  }
  return s.result;
}

}  // namespace touchstone::sensors
