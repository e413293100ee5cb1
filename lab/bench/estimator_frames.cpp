#include "lab/bench/estimator_frames.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/error.h"
#include "core/random.h"
#include "core/random_pairs.h"
#include "core/seconds_since.h"
#include "core/units.h"
#include "lab/bench/bench_scene.h"
#include "render/cameras/first_hits.h"
#include "sim/plan/plan.h"
#include "sim/press/exposure_times.h"
#include "sim/press/play_motion.h"
#include "sim/scene/device_camera.h"
#include "sim/sensor/residual_light.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/view/scene_view.h"

namespace touchstone::lab {
namespace {

constexpr double kShallowest = 0.5;  // of the depth
constexpr double kDeepest = 2.0;     // likewise
constexpr double kDrag = 1.0 / 3.0;  // of a press's own depth
constexpr double kMostFrameRate_Hz = 30.0;
constexpr double kStep_mm = 0.1;

/// What is true of pixels.
class PixelTruth {
 public:
  PixelTruth(const sim::SceneSpec& scene, const sim::Plan& plan, const fem::Compliance& gel,
             const fem::PressState& press)
      : view_(scene, plan, gel),
        ready_(render::make_ready(sim::camera_of(*scene.device.camera))),
        rest_(view_.geometry(sim::at_rest(press), {})),
        rest_hits_(render::first_hits(rest_.inside, ready_)) {}

  void add_to(TouchFrame& touch, const fem::PressState& press) const {
    const sim::SeenGeometry seen = view_.geometry(press, view_.relief(press));
    const std::vector<render::FirstHit> hits = render::first_hits(seen.inside, ready_);
    touch.height = sim::pressed_in(rest_hits_, hits, touch.frame.size());
    touch.contact = sim::in_contact(rest_hits_, hits, seen.sheet, touch.frame.size());
  }

  double mm_per_px() const {
    const auto middle = render::project_through_faces(rest_.inside, ready_, {0.0, 0.0, 0.0});
    const auto right = render::project_through_faces(rest_.inside, ready_, {kStep_mm, 0.0, 0.0});
    if (!middle || !right) fail("the camera doesn't see the gel's middle");
    return kStep_mm / (*right - *middle).norm();
  }

 private:
  sim::SceneView view_;
  render::ReadyCamera ready_;
  sim::SeenGeometry rest_;
  std::vector<render::FirstHit> rest_hits_;
};

}  // namespace

std::vector<sim::PressSpec> drawn_presses(std::size_t count, const Eigen::Vector2d& reach_mm, double depth_mm,
                                          bool dragged, std::uint64_t seed) {
  std::vector<sim::PressSpec> presses;
  for (std::size_t k = 0; k < count; ++k) {
    RandomStream random(seed, k, Purpose::kStudy);
    sim::PressSpec press;
    press.place_mm = (2.0 * uniform_pair(random).array() - 1.0).matrix().cwiseProduct(reach_mm);
    press.depth_mm = depth_mm * (kShallowest + (kDeepest - kShallowest) * random.uniform());
    const double angle = 2.0 * kPi * random.uniform();
    if (dragged) press.drag_mm = kDrag * *press.depth_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    presses.push_back(press);
  }
  return presses;
}

sim::SceneSpec frame_scene(const FrameRecipe& recipe, const FrameOrder& order, const sim::PressSpec& press) {
  const BenchPresses presses{order.object, sim::first_touch(press, order.object, recipe.device.gel), {press}};
  sim::SceneSpec scene = bench_scene(recipe.device, presses, press, order.seed);
  scene.motion.frame_rate_Hz = std::min(scene.motion.frame_rate_Hz, kMostFrameRate_Hz);
  scene.motion.keys.front().frames = order.steps_down;
  scene.outputs.radiance = false;
  scene.effects = recipe.effects;
  scene.light = recipe.light;
  return scene;
}

FrameSet make_frames(const FrameRecipe& recipe, const fem::Compliance& gel, const FrameOrder& order,
                     const Progress& progress) {
  TS_ASSERT(!order.presses.empty() && order.rest_frames > 0);
  const auto deepest = std::max_element(order.presses.begin(), order.presses.end(),
                                        [](const auto& a, const auto& b) { return *a.depth_mm < *b.depth_mm; });
  const sim::SceneSpec scene = frame_scene(recipe, order, *deepest);
  const sim::Plan plan = sim::make_plan(scene);

  FrameSet set;
  std::vector<sim::Truth> truths;
  std::vector<std::size_t> press_of;
  const auto add = [&](sim::Truth truth, std::size_t press) {
    truth.frame = static_cast<int>(truths.size());
    truth.t_us = sim::frame_time_us(truth.frame, scene.motion.frame_rate_Hz);
    truths.push_back(std::move(truth));
    press_of.push_back(press);
  };
  double begun = core_seconds();
  for (std::size_t k = 0; k < order.presses.size(); ++k) {
    if (progress) {
      progress("mechanics", static_cast<std::int64_t>(k), static_cast<std::int64_t>(order.presses.size()));
    }
    std::vector<sim::Truth> states = sim::play_motion(frame_scene(recipe, order, order.presses[k]), plan, gel);
    if (k == 0) {
      for (int i = 0; i < order.rest_frames; ++i) add(states.front(), k);  // with other noise each
    }
    for (auto state = std::next(states.begin()); state != states.end(); ++state) add(std::move(*state), k);
  }
  const auto rest = static_cast<std::size_t>(order.rest_frames);
  const auto frames = static_cast<double>(truths.size());
  set.each_s = (core_seconds() - begun) / frames;

  begun = core_seconds();
  const sim::VirtualCamera camera(scene, plan, gel, truths);
  set.once_s = core_seconds() - begun;
  std::optional<PixelTruth> pixels;
  if (order.heights) pixels.emplace(scene, plan, gel, truths.front().press);
  if (pixels) set.mm_per_px = pixels->mm_per_px();
  double worked = 0.0;
  for (std::size_t k = 0; k < truths.size(); ++k) {
    if (progress) progress("pictures", static_cast<std::int64_t>(k), static_cast<std::int64_t>(truths.size()));
    begun = core_seconds();
    sim::Capture capture = camera.capture(truths[k]);
    worked += core_seconds() - begun;
    if (k == 0 && worked * frames > order.most_seconds) {
      fail("left out: its frames would take some {:.0f} s", worked * frames);
    }
    set.light = capture.direct ? "direct light" : plan.shared_paths ? "shared paths" : "paths";
    if (k < rest) {
      set.rest.push_back(std::move(capture.frame));
      continue;
    }
    TouchFrame touch;
    touch.press = press_of[k];
    touch.frame = std::move(capture.frame);
    touch.force_N = truths[k].press.wrench.head<3>();
    if (pixels) pixels->add_to(touch, truths[k].press);
    set.touches.push_back(std::move(touch));
  }
  set.each_s += worked / frames;
  return set;
}

}  // namespace touchstone::lab
