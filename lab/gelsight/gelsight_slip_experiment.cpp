#include "lab/gelsight/gelsight_slip_experiment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "lab/gelsight/gelsight_force_experiment.h"
#include "lab/gelsight/gelsight_height_experiment.h"

namespace touchstone::lab {

namespace {

constexpr int kStatesAFrame = 4;
constexpr int kBackgroundFrame = 1000000;  ///< its noise is no other frame's
constexpr int kPressFrames = 4;
constexpr int kHoldFrames = 3;
constexpr int kLoadFrames = 10;
constexpr double kClear_mm = 0.02;
constexpr double kUnsheared = 0.05;     ///< of the limit
constexpr double kStillSticking = 0.9;  ///< of what sticks before the drag: with less, partial slip has begun
constexpr double kRoll_mm = 1.2;
/// How far a sliding object goes at most before it slides, mm for each N that friction holds, and mm at least.
constexpr double kSlide_mm_per_N = 3.0;
constexpr double kLeastSlide_mm = 0.6;

sim::MotionSpec motion_of(const SlipCase& what, const sim::GelSpec& gel, double frame_rate_Hz) {
  sim::MotionSpec motion;
  motion.frame_rate_Hz = kStatesAFrame * frame_rate_Hz;
  const double travel = what.motion == SlipMotion::roll
                            ? kRoll_mm
                            : std::max(kSlide_mm_per_N * what.object.friction * what.normal_N, kLeastSlide_mm);
  const double from = -0.5 * travel;
  motion.start_mm = {from, 0, sim::first_touch({}, what.object, gel) + kClear_mm};
  const auto states_for = [&](double length_mm) {
    return std::max(static_cast<int>(std::lround(length_mm / what.speed_mm_per_s * motion.frame_rate_Hz)), 1);
  };
  sim::MotionKey press, hold;
  press.frames = kPressFrames * kStatesAFrame;
  press.z = sim::AxisKey{std::nullopt, what.normal_N};
  hold.frames = kHoldFrames * kStatesAFrame;
  motion.keys = {press, hold};
  switch (what.motion) {
    case SlipMotion::slide: {
      sim::MotionKey slide;
      slide.frames = states_for(travel);
      slide.x = sim::AxisKey{from + travel, std::nullopt};
      motion.keys.push_back(slide);
      break;
    }
    case SlipMotion::hold:
      motion.keys.push_back(hold);
      motion.keys.push_back(hold);
      break;
    case SlipMotion::load: {
      sim::MotionKey load;
      load.frames = kLoadFrames * kStatesAFrame;
      load.x = sim::AxisKey{std::nullopt, what.part_of_limit * what.object.friction * what.normal_N};
      motion.keys.push_back(load);
      motion.keys.push_back(hold);
      break;
    }
    case SlipMotion::roll: {
      sim::MotionKey roll;
      roll.frames = states_for(travel);
      roll.x = sim::AxisKey{from + travel, std::nullopt};
      roll.angles_deg = Eigen::Vector3d(0, travel / what.object.shape.radius_mm * 180.0 / std::numbers::pi, 0);
      motion.keys.push_back(roll);
      break;
    }
  }
  return motion;
}

std::size_t as_count(int number) {
  return static_cast<std::size_t>(number);
}

double share_sticking(const fem::PressState& state) {
  const auto count = [&](fem::NodeState one) {
    return static_cast<double>(std::count(state.node_state.begin(), state.node_state.end(), one));
  };
  const double sticking = count(fem::NodeState::stick);
  const double touching = sticking + count(fem::NodeState::slip);
  return touching > 0 ? sticking / touching : 1.0;
}

double load_of(const fem::PressState& state, double friction) {
  const double limit = friction * state.wrench[2];
  return limit > 0 ? state.wrench.head<2>().norm() / limit : 0.0;
}

const char* name_of(SlipMotion motion) {
  switch (motion) {
    case SlipMotion::slide:
      return "slide";
    case SlipMotion::hold:
      return "hold";
    case SlipMotion::load:
      return "load";
    case SlipMotion::roll:
      return "roll";
  }
  return "?";
}

}  // namespace

std::string SlipCase::name() const {
  std::string text = fmt::format("{} {}, mu {:g}, {:g} N", name_of(motion), object.name, object.friction, normal_N);
  if (motion == SlipMotion::slide || motion == SlipMotion::roll) text += fmt::format(", {:g} mm/s", speed_mm_per_s);
  if (motion == SlipMotion::load) text += fmt::format(", {:g} of the limit", part_of_limit);
  return text;
}

SlipRun run_slip_case(const sim::VirtualSensor& sensor, const SlipCase& what, const SlipEstimators& estimators,
                      std::uint64_t seed, int frames_after) {
  SlipRun run;
  run.what = what;
  const sim::TouchObject object = sensor.object(what.object);
  const double frame_rate_Hz = sensor.device().camera->frame_rate_Hz;
  std::vector<sim::Truth> truths = sensor.play(object, motion_of(what, sensor.device().gel, frame_rate_Hz));
  const std::size_t first_drag = as_count((kPressFrames + kHoldFrames) * kStatesAFrame);
  if (what.motion == SlipMotion::slide) {
    const auto sliding = std::find_if(truths.begin() + static_cast<std::ptrdiff_t>(first_drag), truths.end(),
                                      [](const sim::Truth& truth) { return share_sticking(truth.press) == 0.0; });
    if (sliding == truths.end()) fail("{}: doesn't slide on its path", what.name());
    const auto onset = static_cast<std::size_t>(sliding - truths.begin());
    const auto time_of = [&](std::size_t state) {
      return static_cast<double>(state) / (kStatesAFrame * frame_rate_Hz);
    };
    run.onset_s = time_of(onset);
    const double at_rest = share_sticking(truths[first_drag].press);
    std::size_t partial = first_drag;
    while (share_sticking(truths[partial].press) > kStillSticking * at_rest) ++partial;
    run.partial_s = time_of(partial);
    truths.resize(std::min(truths.size(), onset + as_count(frames_after * kStatesAFrame) + 1));
  }

  sensors::TouchReader reader({.background = sensor.background(seed, kBackgroundFrame),
                               .markers = marker_settings(sensor),
                               .height = estimators.heights,
                               .normal = sensors::normal_line(estimators.forces, what.object.name),
                               .shear = sensors::shear_line(estimators.forces)},
                              estimators.settings);
  for (std::size_t i = 0; i < truths.size(); i += kStatesAFrame) {
    const fem::PressState& state = truths[i].press;
    const cv::Mat image = sensor.capture(object, state, seed, static_cast<int>(i), false).frame;
    const sensors::TouchReading& touch = reader.read({image, static_cast<std::int64_t>(i)});
    SlipFrame frame;
    frame.t_s = static_cast<double>(i) / (kStatesAFrame * frame_rate_Hz);
    frame.load = load_of(state, what.object.friction);
    frame.sticking = share_sticking(state);
    frame.force_ratio = touch.force_ratio;
    frame.motion_ratio = touch.motion_ratio;
    frame.rule = touch.rule_slip;
    frame.rim = touch.rim;
    frame.markers_found = touch.markers_found;
    run.frames.push_back(frame);
  }
  return run;
}

double SlipScore::median_delay_ms() const {
  if (delays_ms.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> sorted = delays_ms;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[half] : 0.5 * (sorted[half - 1] + sorted[half]);
}

double SlipScore::false_alarms_percent() const {
  return quiet_frames > 0 ? 100.0 * false_frames / quiet_frames : 0.0;
}

std::string to_csv(const std::vector<SlipRun>& runs) {
  std::string text =
      "case,partial_s,onset_s,t_s,load,sticking,force_ratio,motion_ratio,rule,lag,lag_error,slide_px,shear_px,state,"
      "markers\n";
  const auto known = [](const std::optional<double>& value) { return value ? fmt::format("{:.4f}", *value) : ""; };
  for (const SlipRun& run : runs) {
    for (const SlipFrame& frame : run.frames) {
      text += fmt::format("\"{}\",{},{},{:.4f},{:.4f},{:.4f},{},{},{},{},{:.4f},{:.3f},{:.3f},{},{}\n", run.what.name(),
                          known(run.partial_s), known(run.onset_s), frame.t_s, frame.load, frame.sticking,
                          known(frame.force_ratio), known(frame.motion_ratio), frame.rule ? 1 : 0, known(frame.rim.lag),
                          frame.rim.lag_error, frame.rim.slide_px, frame.rim.shear_px,
                          sensors::name_of(frame.rim.state), frame.markers_found);
    }
  }
  return text;
}

SlipScore score(const std::vector<SlipRun>& runs, SlipDetector detector, double least_warning_s) {
  const auto reports = [&](const SlipFrame& frame) {
    return detector == SlipDetector::rule ? frame.rule : frame.rim.slips();
  };
  SlipScore result;
  for (const SlipRun& run : runs) {
    const auto loaded = run.onset_s ? std::find_if(run.frames.begin(), run.frames.end(),
                                                   [](const SlipFrame& frame) { return frame.load > kUnsheared; })
                                    : run.frames.end();
    for (auto frame = run.frames.begin(); frame != loaded; ++frame) {
      ++result.quiet_frames;
      if (reports(*frame)) ++result.false_frames;
    }
    if (!run.onset_s) {
      ++result.quiet_runs;
      if (std::any_of(run.frames.begin(), run.frames.end(), reports)) ++result.false_runs;
      continue;
    }
    ++result.slides;
    constexpr double kRounding_s = 1e-9;
    const bool predictable = run.partial_s && *run.onset_s - *run.partial_s >= least_warning_s - kRounding_s;
    if (predictable) ++result.predictable;
    const auto found = std::find_if(loaded, run.frames.end(), reports);
    if (found == run.frames.end()) continue;
    ++result.found;
    const double delay_s = found->t_s - *run.onset_s;
    if (delay_s <= 0.0) {
      ++result.found_before;
      if (predictable) ++result.predicted;
    }
    result.delays_ms.push_back(1e3 * delay_s);
  }
  return result;
}

}  // namespace touchstone::lab
