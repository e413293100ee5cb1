#include "sim/sensor/event_stream.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>

#include "core/units.h"
#include "render/events/event_pixels.h"
#include "sim/press/play_motion.h"
#include "sim/press/played_states.h"
#include "sim/press/state_between.h"
#include "sim/scene/device_camera.h"
#include "sim/sensor/light_between.h"
#include "sim/sensor/light_sequence.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {
namespace {

constexpr double kFinestMotion_px = 0.02;
constexpr int kMostParts = 16;  // of one cut; what changes suddenly within a part is cut again

/// A state with its picture.
struct Moment {
  std::int64_t t_us = 0;
  fem::PressState press;
  SequencePicture picture;
};

/// A scene's event pixels, and where their events go.
class EventOutput {
 public:
  EventOutput(const SceneSpec& scene, std::uint64_t noise_seed, const EventSink& sink)
      : pixels_(scene.device.camera->events.value().pixels, {scene.device.camera->width, scene.device.camera->height},
                scene.seed, noise_seed),
        sink_(sink) {}

  double smallest_threshold() const { return pixels_.smallest_threshold(); }

  /// Shows the light at a time, and counts the events that it gives.
  void advance(const cv::Mat& photocurrent, std::int64_t t_us, EventStreamReport& report) {
    events_.clear();
    pixels_.advance(photocurrent, t_us, events_);
    report.events += static_cast<std::int64_t>(events_.size());
    if (!events_.empty()) sink_(events_);
  }

 private:
  render::EventPixels pixels_;
  const EventSink& sink_;
  std::vector<Event> events_;
};

class EventWatch {
 public:
  EventWatch(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, std::uint64_t noise_seed,
             std::shared_ptr<const DirectLight> direct, const EventSink& sink)
      : output_(scene, noise_seed, sink),
        smallest_threshold_(output_.smallest_threshold()),
        step_(scene.light.event_step * smallest_threshold_),
        light_(scene, plan, gel, smallest_threshold_, std::move(direct)) {}

  void begin(Moment& moment) {
    moment.picture = light_.first(moment.press);
    count(moment.picture);
    show(moment, moment);
  }

  /// All that is seen after `before` until `after`, whose picture is made.
  void go_on(const Moment& before, Moment& after) {
    after.picture = light_.next(before.picture, after.press, light_.motion(before.press, after.press));
    count(after.picture);
    watch(before, after);
  }

  EventStreamReport report() const { return report_; }

 private:
  void watch(const Moment& before, const Moment& after) {
    const int parts = parts_between(before, after);
    if (parts == 1) {
      show(before, after);
      return;
    }
    const std::int64_t span_us = after.t_us - before.t_us;
    Moment last = before;
    for (int k = 1; k <= parts; ++k) {
      if (k == parts) {
        watch(last, after);
        return;
      }
      Moment next;
      next.t_us = before.t_us + span_us * k / parts;
      next.press = state_between(before.press, after.press,
                                 static_cast<double>(next.t_us - before.t_us) / static_cast<double>(span_us));
      next.picture = light_.next(last.picture, next.press, light_.motion(last.press, next.press));
      count(next.picture);
      watch(last, next);
      last = std::move(next);
    }
  }

  /// Into how many parts the time between two pictures is to be cut.
  int parts_between(const Moment& before, const Moment& after) const {
    const double wanted =
        1.0 + render::needed_subdivisions(before.picture.log_photocurrent, after.picture.log_photocurrent, step_);
    const double worth = std::floor(light_.motion(before.press, after.press) / kFinestMotion_px);
    const auto whole_us = static_cast<double>(after.t_us - before.t_us);
    return std::max(1, static_cast<int>(std::min({wanted, worth, whole_us, static_cast<double>(kMostParts)})));
  }

  void show(const Moment& before, const Moment& now) {
    output_.advance(now.picture.photocurrent, now.t_us, report_);
    cv::Mat change;
    cv::absdiff(before.picture.log_photocurrent, now.picture.log_photocurrent, change);
    report_.coarse_steps += cv::countNonZero(change > smallest_threshold_);
  }

  void count(const SequencePicture& picture) {
    ++report_.pictures;
    report_.pixels_traced += picture.pixels_traced;
    report_.paths_traced += picture.paths_traced;
  }

  EventOutput output_;
  double smallest_threshold_;
  double step_;
  LightSequence light_;
  EventStreamReport report_;
};

/// The same by light that is moved from state to state.
class MovedWatch {
 public:
  MovedWatch(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, std::uint64_t noise_seed,
             std::shared_ptr<const DirectLight> direct, const EventSink& sink)
      : output_(scene, noise_seed, sink),
        dark_(static_cast<float>(scene.device.camera->events->pixels.dark_intensity)),
        coarse_(static_cast<float>(std::exp(output_.smallest_threshold()))),
        light_(scene, plan, gel, output_.smallest_threshold(), std::move(direct)),
        between_(LightOfKeys{light_.view(), *light_.direct(),
                             [this](const cv::Mat& irradiance, cv::Mat& currents) {
                               light_.pixel_currents(irradiance, currents);
                             }},
                 gel, [this](std::int64_t t_us, const cv::Mat& light) { show(t_us, light); }) {}

  void go_on(std::int64_t t_us, const fem::PressState& press) { between_.add(t_us, press); }

  EventStreamReport finish() {
    between_.finish();
    report_.pictures = between_.report().pictures;
    report_.keys = between_.report().keys;
    report_.worst_key_rms = between_.report().worst_rms;
    return report_;
  }

 private:
  void show(std::int64_t t_us, const cv::Mat& light) {
    output_.advance(light, t_us, report_);
    if (!last_.empty()) report_.coarse_steps += coarse_steps(last_, light);
    light.copyTo(last_);
  }

  std::int64_t coarse_steps(const cv::Mat& before, const cv::Mat& now) const {
    std::int64_t count = 0;
    for (int row = 0; row < now.rows; ++row) {
      const auto* a = before.ptr<float>(row);
      const auto* b = now.ptr<float>(row);
      int here = 0;
      for (int column = 0; column < now.cols; ++column) {
        const float was = a[column] + dark_;
        const float is = b[column] + dark_;
        here += static_cast<int>(is > coarse_ * was) | static_cast<int>(was > coarse_ * is);
      }
      count += here;
    }
    return count;
  }

  EventOutput output_;
  float dark_, coarse_;  // coarse_: a ratio of light
  LightSequence light_;
  LightBetween between_;
  cv::Mat last_;
  EventStreamReport report_;
};

/// Direct light of a scene, where the plan has it and it holds; null: paths.
std::shared_ptr<const DirectLight> direct_light(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                                                const fem::GelVibration* vibration,
                                                const std::vector<std::shared_ptr<const fem::Compliance>>& elastic) {
  if (!plan.direct_light) return nullptr;
  const std::vector<Truth> truths = play_motion(scene, plan, gel, {}, vibration, elastic);
  const SceneView view(scene, plan, gel);
  auto direct = std::make_shared<const DirectLight>(view, camera_of(*scene.device.camera), truths);
  return direct->choice().direct ? direct : nullptr;
}

}  // namespace

EventStreamReport watch_events(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                               std::uint64_t noise_seed, const EventSink& sink, const Progress& progress,
                               const fem::GelVibration* vibration,
                               const std::vector<std::shared_ptr<const fem::Compliance>>& elastic) {
  TS_ASSERT(plan.events);
  const auto play = [&](const auto& visit) {
    play_states(scene, plan, gel, vibration, elastic, [&](int frame, int part, const fem::PressState& state) {
      const double frames = frame - 1 + static_cast<double>(part) / plan.states_a_frame;
      visit(frame == 0, std::llround(frames * kMicrosecondsPerSecond / scene.motion.frame_rate_Hz), state);
      if (progress && part == plan.states_a_frame) progress("events", frame + 1, scene.motion.frame_count());
    });
  };
  std::shared_ptr<const DirectLight> direct = direct_light(scene, plan, gel, vibration, elastic);
  const bool moved = direct && direct->has_points() && unfit_for_light_between(scene, plan).empty();
  if (moved) {
    MovedWatch watch(scene, plan, gel, noise_seed, std::move(direct), sink);
    play([&](bool, std::int64_t t_us, const fem::PressState& state) { watch.go_on(t_us, state); });
    return watch.finish();
  }
  EventWatch watch(scene, plan, gel, noise_seed, std::move(direct), sink);
  Moment last;
  play([&](bool first, std::int64_t t_us, const fem::PressState& state) {
    Moment now;
    now.t_us = t_us;
    now.press = state;
    if (first) {
      watch.begin(now);
    } else {
      watch.go_on(last, now);
    }
    last = std::move(now);
  });
  return watch.report();
}

}  // namespace touchstone::sim
