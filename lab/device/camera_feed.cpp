#include "lab/device/camera_feed.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "datasets/sets/sample_source.h"
#include "render/imager/automatic_control.h"
#include "sim/plan/plan.h"
#include "sim/scene/device_imager.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

/// The camera's electronics, shared by all states of a scene.
struct Electronics {
  render::Imager imager;
  render::FixedPattern pattern;
  std::uint64_t seed = 0;
};

void take_truth(const sim::Truth& truth, CameraState& state) {
  state.frame = truth.frame;
  state.t_us = truth.t_us;
  state.force_N = truth.press.wrench.head<3>();
  state.torque_Nmm = truth.press.wrench.tail<3>();
  state.force_error_N = truth.error.force;
  state.gel_from_object = truth.press.gel_from_object;
  state.contact_area_mm2 = truth.press.contact_area;
}

}  // namespace

SceneFeed feed_of_scene(const sim::SceneSpec& scene_of, const std::filesystem::path& cache_folder,
                        const std::optional<std::pair<int, int>>& first_last, std::int64_t most_bytes,
                        const Progress& progress) {
  sim::SceneSpec scene = scene_of;
  const sim::OutputSpec wanted = scene.outputs;
  if (!scene.device.camera) fail_at(scene.where, "device {}: has no camera to serve", scene.device.name);
  scene.outputs = {.frames = true, .radiance = true, .events = wanted.events, .where = wanted.where};
  const int frames = scene.motion.frame_count();
  const auto [first, last] = first_last.value_or(std::pair(0, frames - 1));
  if (first < 0 || last < first || last >= frames) {
    fail("frames {} to {}: the scene has frames 0 to {}", first, last, frames - 1);
  }
  const sim::Plan plan = sim::make_plan(scene);
  const cv::Size size(scene.device.camera->width, scene.device.camera->height);
  const std::int64_t bytes_a_frame =
      std::int64_t{size.area()} * plan.bands.count() * static_cast<std::int64_t>(sizeof(float));
  const std::int64_t count = last - first + 1;
  if (count * bytes_a_frame > most_bytes) {
    fail("the light of {} frames takes {} MB; allowed are {} MB, which is {} frames of this scene", count,
         count * bytes_a_frame / 1'000'000, most_bytes / 1'000'000, most_bytes / bytes_a_frame);
  }
  const datasets::SampleSource source = datasets::simulator(cache_folder);
  const auto gel = source.set_up_gel(scene.device, progress);
  const std::vector<sim::Truth> all = source.play_motion(scene, plan, *gel, progress);
  const std::span<const sim::Truth> truths(all.data() + first, static_cast<std::size_t>(count));
  // What a camera that sets itself shows depends on all that it has seen before.
  const bool automatic = plan.auto_exposure || plan.auto_white_balance;
  const datasets::SampleSource::Camera camera =
      source.set_up_camera(scene, plan, gel, automatic ? std::span(all.data(), truths.data() + count) : truths);

  auto electronics = std::make_shared<Electronics>();
  electronics->imager = sim::imager(scene.device, plan.bands, plan.sensor_noise);
  electronics->pattern = render::fixed_pattern(electronics->imager, size, scene.seed);
  electronics->seed = scene.seed;

  SceneFeed feed;
  feed.device = scene.device.name;
  feed.frame_rate_Hz = scene.motion.frame_rate_Hz;
  feed.size = size;
  feed.states.resize(truths.size());
  std::atomic<std::int64_t> done{0};
  tbb::parallel_for(std::size_t{0}, truths.size(), [&](std::size_t i) {
    auto state = std::make_shared<CameraState>();
    take_truth(truths[i], *state);
    state->what = fmt::format("{}, {} in frame {}", scene.device.name, scene.object.name, truths[i].frame);
    const sim::Capture capture = camera(truths[i]);
    state->expose = [light = capture.radiance, imager = render::controlled(electronics->imager, capture.control),
                     electronics](std::uint64_t noise_seed) {
      return render::develop(render::expose(light, imager, electronics->pattern, electronics->seed, noise_seed),
                             imager);
    };
    feed.states[i] = std::move(state);
    if (progress) progress("light", ++done, count);
  });

  const std::int64_t begin_us = truths.front().t_us;
  const std::int64_t frame_us = std::llround(kMicrosecondsPerSecond / feed.frame_rate_Hz);
  feed.period_us = truths.back().t_us - begin_us + frame_us;
  if (plan.events) {
    feed.has_events = true;
    source.watch_events(
        scene, plan, *gel, scene.seed,
        [&](std::span<const Event> events) {
          for (Event event : events) {
            event.t_us -= begin_us;
            if (event.t_us >= 0 && event.t_us < feed.period_us) feed.events.push_back(event);
          }
        },
        progress);
  }
  return feed;
}

CameraState camera_state(const sim::Touch& held) {
  CameraState state;
  state.what = held.what;
  state.force_N = held.force_N();
  state.force_error_N = held.error.force;
  state.torque_Nmm = held.torque_Nmm();
  state.contact_area_mm2 = held.press.contact_area;
  if (!held.press.bodies.empty()) state.gel_from_object = held.press.gel_from_object;
  state.expose = held.expose;
  return state;
}

}  // namespace touchstone::lab
