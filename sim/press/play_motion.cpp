#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "fem/finite_strain/finite_press.h"
#include "sim/plan/plan.h"
#include "sim/press/exposure_times.h"
#include "sim/press/gel_setup.h"
#include "sim/press/motion_track.h"
#include "sim/press/play_motion.h"
#include "sim/press/played_states.h"
#include "sim/press/shaken_press.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {
namespace {

constexpr double kStepsAPeriod = 12.0;
constexpr int kTouchParts = 4;

fem::PressTolerance press_tolerance() {
  fem::PressTolerance tolerance;
  tolerance.touch_parts = kTouchParts;
  return tolerance;
}

/// The press that the plan calls for.
class PlannedPress {
 public:
  PlannedPress(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, std::vector<fem::PressBody> bodies,
               const fem::PronySeries& relaxation) {
    if (plan.finite_strain) {
      finite_gel_ = set_up_finite_gel(scene.device);
      TS_ASSERT(finite_gel_->rest.vertices == gel.vertices);
      finite_.emplace(*finite_gel_, std::move(bodies), fem::PressTolerance{}, relaxation);
    } else {
      linear_.emplace(gel, std::move(bodies), press_tolerance(), relaxation);
    }
  }

  const fem::PressState& step(std::span<const fem::PressTarget> targets) {
    return finite_ ? finite_->step(targets) : linear_->step(targets);
  }
  const fem::PressState& state() const { return finite_ ? finite_->state() : linear_->state(); }

 private:
  std::shared_ptr<const fem::FiniteGel> finite_gel_;
  std::optional<fem::FinitePress> finite_;
  std::optional<fem::Press> linear_;
};

/// Steps a frame, so that a press that remembers follows a quasi-static vibration.
int steps_a_frame(const MotionTrack& track, const MotionSpec& motion, const Plan& plan) {
  const MotionKey& key = track.key();
  if (!key.vibration || !(plan.friction || plan.relaxation)) return 1;
  return std::max(1, static_cast<int>(std::ceil(kStepsAPeriod * key.vibration->frequency_Hz / motion.frame_rate_Hz)));
}

}  // namespace

void play_states(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                 const fem::GelVibration* vibration, const std::vector<std::shared_ptr<const fem::Compliance>>& elastic,
                 const StateVisitor& visit, const std::vector<fem::ContactShape>& shapes) {
  TS_ASSERT(elastic.size() == (plan.elastic_object ? moved_objects(scene).size() : 0));
  const MotionSpec& motion = scene.motion;
  const int kept = plan.states_a_frame;
  const std::vector<MovedObject> objects = moved_objects(scene);
  TS_ASSERT(shapes.empty() || shapes.size() == objects.size());
  const double friction = plan.friction ? scene.object.friction : 0.0;
  const fem::PronySeries relaxation = plan.relaxation ? prony_series(scene.device.gel) : fem::PronySeries{};
  std::vector<fem::PressBody> bodies;
  for (const MovedObject& moved : objects) {
    fem::PressBody body;
    body.shape = shapes.empty() ? coarse_contact_shape(moved.object, scene.device.mesh.fine_mm) : shapes[bodies.size()];
    body.friction = plan.friction ? moved.object.friction : 0.0;
    if (plan.elastic_object) body.elastic = elastic[bodies.size()];
    bodies.push_back(std::move(body));
  }
  PlannedPress press(scene, plan, gel, std::move(bodies), relaxation);
  std::optional<ShakenPress> shaken;
  if (vibration != nullptr) shaken.emplace(gel, *vibration, relaxation, friction);

  std::vector<MotionTrack> tracks;
  for (const MovedObject& moved : objects) tracks.emplace_back(moved.motion);
  std::vector<fem::PressTarget> targets;
  for (const MotionTrack& track : tracks) targets.push_back(track.start());

  int frame = 0;
  const auto at_frame = [&](const SourceLocation& where, const auto& act) {
    try {
      act();
    } catch (const Error& error) {
      fail_at(where, "frame {}: {}", frame, error.what());
    }
  };
  // A key is to blame only where there is one object.
  const bool single = objects.size() == 1;
  at_frame(motion.keys.empty() || !single ? scene.where : motion.keys.front().where,
           [&] { visit(0, kept, press.step(targets)); });

  for (frame = 1; frame < motion.frame_count(); ++frame) {
    int steps = 1;  // from one kept state to the next
    for (std::size_t b = 0; b < tracks.size(); ++b) {
      tracks[b].next_frame(press.state().bodies[b]);
      if (!shaken) steps = std::max(steps, (steps_a_frame(tracks[b], motion, plan) + kept - 1) / kept);
    }
    const MotionKey& key = tracks.front().key();
    const bool shakes = shaken && key.vibration && key.vibration->amplitude_mm > 0.0;
    at_frame(single ? key.where : scene.where, [&] {
      for (int k = 1; k <= steps * kept; ++k) {
        const double part = static_cast<double>(k) / (steps * kept);
        for (std::size_t b = 0; b < tracks.size(); ++b) {
          targets[b] = tracks[b].at(part, !shaken);
          targets[b].seconds = 1.0 / (steps * kept * motion.frame_rate_Hz);
        }
        press.step(targets);
        if (k % steps != 0) continue;
        const double seconds = tracks.front().seconds_in_key() - (1.0 - part) / motion.frame_rate_Hz;
        visit(frame, k / steps, shakes ? shaken->at(press.state(), *key.vibration, seconds) : press.state());
      }
    });
  }
}

std::vector<Truth> play_motion(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                               const Progress& progress, const fem::GelVibration* vibration,
                               const std::vector<std::shared_ptr<const fem::Compliance>>& elastic,
                               const std::vector<fem::ContactShape>& shapes) {
  const MotionSpec& motion = scene.motion;
  const ExposureTimes exposure(scene, plan);
  std::vector<Truth> truths;
  truths.reserve(motion.frame_count());
  const auto keep = [&](int frame, int part, const fem::PressState& state) {
    const double now_s = (frame - 1 + static_cast<double>(part) / plan.states_a_frame) / motion.frame_rate_Hz;
    exposure.keep(truths, now_s, state);
    if (part < plan.states_a_frame) return;
    Truth truth;
    truth.frame = frame;
    truth.t_us = frame_time_us(frame, motion.frame_rate_Hz);
    truth.press = state;
    truth.error = fem::estimate_error(gel, state);
    truths.push_back(std::move(truth));
    if (progress) progress("mechanics", frame + 1, motion.frame_count());
  };
  play_states(scene, plan, gel, vibration, elastic, keep, shapes);
  return truths;
}

}  // namespace touchstone::sim
