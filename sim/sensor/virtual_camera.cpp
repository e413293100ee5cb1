#include "sim/sensor/virtual_camera.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <opencv2/imgproc.hpp>

#include "core/locked_work.h"
#include "core/random.h"
#include "core/random_pairs.h"
#include "core/units.h"
#include "render/cameras/camera_diffraction.h"
#include "render/cameras/rolling_shutter.h"
#include "render/paths/shared_paths.h"
#include "sim/press/exposure_times.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_imager.h"
#include "sim/scene/light_limits.h"
#include "sim/sensor/background_light.h"
#include "sim/sensor/colour_numbers.h"
#include "sim/sensor/direct_light.h"
#include "sim/sensor/key_frames.h"
#include "sim/sensor/picture_settings.h"
#include "sim/sensor/residual_light.h"
#include "sim/view/pixel_truth.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {
namespace {

constexpr int kMeteringSamples = 8;  // a pixel, of a picture that is only metered: the mean of 10^5 pixels has 1e-3

}  // namespace

struct VirtualCamera::Parts : SceneView {
  Parts(const SceneSpec& scene_of, const Plan& plan_of, const fem::Compliance& gel_of)
      : SceneView(scene_of, plan_of, gel_of),
        exposure(scene_of, plan_of),
        camera(planned_camera(scene, plan)),
        ready(render::make_ready(camera)),
        size(render::size_of(camera).x(), render::size_of(camera).y()),
        imager(sim::imager(scene.device, plan.bands, plan.sensor_noise)),
        ideal_imager(sim::imager(scene.device, plan.bands, false)),
        response(render::response_of(imager)),
        pattern(render::fixed_pattern(imager, size, scene.seed)) {
    settings = picture_settings(scene, response);
    if (scene.device.residual) lacking.emplace(*scene.device.residual, ideal_imager);
  }

  ExposureTimes exposure;
  render::Camera camera;
  render::ReadyCamera ready;
  cv::Size size;
  render::Imager imager;
  render::Imager ideal_imager;
  render::ImagerResponse response;
  render::FixedPattern pattern;
  render::RenderSettings settings;
  std::unique_ptr<const DirectLight> direct;  // where it holds; keys are then not needed
  LightChoice choice{false, "paths: the plan has no direct light", {}};
  std::optional<render::SharedPaths> shared;             // behind a wide hole; keys are then not needed
  std::vector<KeyFrame> keys;                            // the first frame's, then in the order of time
  std::map<std::int64_t, render::ControlState> control;  // by a frame's t_us; of a camera that sets itself
  std::optional<ResidualLight> lacking;                  // of a device with a residual map
  mutable std::mutex seeing_rest;
  mutable std::vector<render::FirstHit> rest_hits;  // with it, once asked for
  mutable cv::Mat missing_there;                    // of a device with a background, once asked for
  mutable Eigen::MatrixX3d of_number;               // irradiance_per_number, with it

  /// The untouched device's light.
  cv::Mat light_at_rest(const fem::PressState& press) const {
    const render::Scene rest = seen(at_rest(press), {});
    if (direct) {
      if (const auto image = direct->render(rest)) return image->irradiance;
    }
    return render::Tracer(rest).render(camera, key_frame_settings(scene, response, true)).irradiance;
  }

  /// Light with what the device's background and residual map add to it, if it has one.
  cv::Mat corrected(const cv::Mat& irradiance, const fem::PressState& press,
                    const std::optional<fem::ReliefAnswer>& relief) const {
    const bool has_background = !scene.device.background.empty();
    if (!lacking && !has_background) return irradiance;
    locked_work(seeing_rest, [&] {
      if (lacking && rest_hits.empty()) {
        rest_hits = render::first_hits(SceneView::geometry(at_rest(press), {}).inside, ready);
      }
      if (has_background && missing_there.empty()) {
        of_number = irradiance_per_number(ideal_imager);
        missing_there = missing_at_rest(scene.device.background, light_at_rest(press), ideal_imager);
      }
    });
    const cv::Mat on_background = has_background ? with_numbers(irradiance, missing_there, of_number) : irradiance;
    if (!lacking) return on_background;
    const std::vector<render::FirstHit> now = render::first_hits(SceneView::geometry(press, relief).inside, ready);
    return lacking->corrected(on_background, pressed_in(rest_hits, now, size));
  }

  /// The first frame's and those before and after a time: the gel at rest, and what the frame is most like.
  std::vector<const KeyFrame*> keys_about(std::int64_t t_us) const {
    std::vector<const KeyFrame*> about;
    if (keys.empty()) return about;
    about.push_back(&keys.front());
    const auto after =
        std::upper_bound(keys.begin() + 1, keys.end(), t_us, [](auto t, const KeyFrame& key) { return t < key.t_us; });
    if (after != keys.begin() + 1) about.push_back(&*(after - 1));
    if (after != keys.end()) about.push_back(&*after);
    return about;
  }

  ChangeFinder change_finder() const {
    const double nearest = std::max(1e-3, -scene.device.gel.thickness_mm - scene.device.camera->position_mm.z());
    PointBlur blur{least_blur_radius_px(camera), blur_radius_px(camera, nearest)};
    if (const auto* spread = render::diffraction_of(camera)) {
      blur.most_px += 1e3 * spread->reach_mm() / scene.device.camera->pixel_pitch_um;
    }
    return {response, *settings.noise, scene.light.change_tolerance, blur, size};
  }

  /// What the keys about a time know of a frame, seen at one or more moments.
  KnownLight known(std::int64_t t_us, std::span<const FrameAppearance> appearances) const {
    return known_light(keys_about(t_us), appearances, change_finder(), size, plan.bands.count());
  }
  KnownLight nothing_known() const { return known_light({}, {}, change_finder(), size, plan.bands.count()); }

  /// A state's light, well done.
  KeyFrame key_frame(const Truth& truth) const {
    const render::Scene seen_now = seen(truth.press, relief(truth.press));
    const render::Tracer at_once(seen_now);
    KeyFrame key;
    key.t_us = truth.t_us;
    key.appearance = appearance_of(seen_now, at_once, ready, camera);
    KnownLight light = keys.empty() ? nothing_known() : known(truth.t_us, {&key.appearance, 1});
    key.where = keys.empty() ? cv::Rect({0, 0}, size) : cv::boundingRect(light.missing);
    if (key.where.empty()) return key;
    const render::RenderedImage image =
        at_once.render(camera, key_frame_settings(scene, response, keys.empty()), light.missing);
    add_traced(image.irradiance, image.standard_error, light);
    key.irradiance = light.irradiance(key.where).clone();
    key.standard_error = light.standard_error(key.where).clone();
    return key;
  }

  /// What needs no light.
  Capture geometry(const Truth& truth, const std::optional<fem::ReliefAnswer>& relief) const {
    Capture capture;
    if (scene.outputs.height) capture.height = membrane->height(truth.press, relief);
    if (scene.outputs.first_hits()) {
      capture.pixel_truth = pixel_truth(SceneView::geometry(truth.press, relief), camera, scene.outputs);
    }
    return capture;
  }

  Capture develop(const cv::Mat& irradiance, const cv::Mat& error, const Truth& truth,
                  const std::optional<fem::ReliefAnswer>& relief, const render::RayCounts& counts,
                  std::int64_t pixels) const {
    Capture capture = geometry(truth, relief);
    if (scene.outputs.error) add_channel(capture.pixel_truth, error, "error.irradiance");
    capture.paths_traced = static_cast<std::int64_t>(counts.paths);
    capture.pixels_traced = pixels;
    const bool automatic = plan.auto_exposure || plan.auto_white_balance;
    if (automatic) capture.control = control_of(truth, irradiance);
    const auto picture = [&](const render::Imager& fixed) {
      const render::Imager sensor = automatic ? render::controlled(fixed, capture.control) : fixed;
      return render::develop(
          render::expose(irradiance, sensor, pattern, scene.seed, static_cast<std::uint64_t>(truth.frame)), sensor);
    };
    if (scene.outputs.frames) capture.frame = picture(imager);
    if (scene.outputs.ideal) capture.ideal = picture(ideal_imager);
    if (scene.outputs.radiance) capture.radiance = irradiance;
    return capture;
  }

  /// What makes pictures of this motion cheaper than whole ones.
  void learn_light(std::span<const Truth> truths) {
    if (plan.direct_light) {
      auto made = std::make_unique<const DirectLight>(*this, camera, truths);
      choice = made->choice();
      if (choice.direct) {
        direct = std::move(made);
        return;
      }
    }
    if (plan.shared_paths) {
      std::vector<render::Scene> examples;
      for (const Truth* truth : {&truths.front(), &deepest(truths)}) {
        examples.push_back(seen(truth->press, relief(truth->press)));
      }
      shared.emplace(examples, std::get<render::PinholeCamera>(camera), settings);
      return;
    }
    keys.push_back(key_frame(truths.front()));
    // They lean on the first one alone, so that they can be made at the same time.
    std::vector<KeyFrame> later((truths.size() - 1) / kFramesPerKey);
    tbb::parallel_for(std::size_t{0}, later.size(),
                      [&](std::size_t i) { later[i] = key_frame(truths[(i + 1) * kFramesPerKey]); });
    std::move(later.begin(), later.end(), std::back_inserter(keys));
  }

  render::ControlState control_of(const Truth& truth, const cv::Mat& irradiance) const {
    const auto known = control.find(truth.t_us);
    return known != control.end() ? known->second : render::settled(imager, render::metering_of(irradiance, imager));
  }

  /// What the camera's meter reads at a frame's begin.
  render::Metering metering(const Truth& truth) const {
    const render::Scene seen_now = seen(truth.press, relief(truth.press));
    const auto read = [&](const cv::Mat& irradiance) {
      return render::metering_of(corrected(irradiance, truth.press, relief(truth.press)), imager);
    };
    if (direct) {
      if (const auto image = direct->render(seen_now)) return read(image->irradiance);
    }
    render::RenderSettings few = settings;
    few.min_samples = few.max_samples = kMeteringSamples;
    return read(render::Tracer(seen_now).render(camera, few).irradiance);
  }

  /// Goes through the motion as the camera that sets itself does. Each frame shows what the ones before it led to.
  void watch(std::span<const Truth> truths) {
    if (!plan.auto_exposure && !plan.auto_white_balance) return;
    std::vector<render::Metering> read(truths.size());
    tbb::parallel_for(std::size_t{0}, truths.size(), [&](std::size_t i) { read[i] = metering(truths[i]); });
    render::ControlState state;
    for (std::size_t i = 0; i < truths.size(); ++i) {
      const double seconds =
          i == 0 ? 0.0 : static_cast<double>(truths[i].t_us - truths[i - 1].t_us) / kMicrosecondsPerSecond;
      state = i == 0 ? render::settled(imager, read[0]) : render::next_state(imager, state, read[i - 1], seconds);
      control[truths[i].t_us] = state;
    }
  }

  Capture take(const Truth& truth, bool whole) const {
    Capture capture = take_light(truth, whole);
    if (plan.direct_light && scene.outputs.light()) {
      const bool beyond = direct && !capture.direct;
      capture.light = beyond ? "paths: the gel has gone beyond the light field" : choice.reason;
    }
    return capture;
  }

  Capture take_light(const Truth& truth, bool whole) const {
    const auto now = relief(truth.press);
    if (!scene.outputs.light()) return geometry(truth, now);
    const std::vector<double> times = exposure.of(truth);
    if (direct) {
      if (auto capture = take_direct(truth, now, times)) return *std::move(capture);
      whole = true;  // there is no key to lean on
    }
    if (times.size() > 1) return take_over_time(truth, now, times, whole);
    const render::Scene seen_now = seen(truth.press, now);
    const render::Tracer at_once(seen_now);
    if (shared && !whole) {
      const render::RenderedImage image = shared->render(seen_now, at_once, settings, scene.outputs.error);
      return develop(corrected(image.irradiance, truth.press, now), image.standard_error, truth, now, image.counts,
                     size.area());
    }
    KnownLight light = nothing_known();
    if (!whole) {
      const FrameAppearance appearance = appearance_of(seen_now, at_once, ready, camera);
      light = known(truth.t_us, {&appearance, 1});
    }
    const int pixels = cv::countNonZero(light.missing);
    if (pixels == 0) {
      return develop(corrected(light.irradiance, truth.press, now), light.standard_error, truth, now, {}, 0);
    }
    const render::RenderedImage image = at_once.render(camera, settings, light.missing);
    add_traced(image.irradiance, image.standard_error, light);
    return develop(corrected(light.irradiance, truth.press, now), light.standard_error, truth, now, image.counts,
                   pixels);
  }

  /// By direct light; nothing if at one of the moments the gel has gone where the light field doesn't reach.
  std::optional<Capture> take_direct(const Truth& truth, const std::optional<fem::ReliefAnswer>& now,
                                     const std::vector<double>& times) const {
    std::optional<render::RollingExposure> sum;
    if (times.size() > 1) sum.emplace(times, shutter_timing(), size, plan.bands.count());
    render::RayCounts counts;
    cv::Mat irradiance;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const bool later = times[i] > 0.0;
      const fem::PressState press = later ? state_after(truth, times[i]) : truth.press;
      const std::optional<fem::ReliefAnswer> contact = later ? relief(press) : now;
      const auto image = direct->render(seen(press, contact), direct->part_of(i, intervals_of_row(times)));
      if (!image) return std::nullopt;
      counts.paths += image->primary;
      counts.primary += image->primary;
      irradiance = corrected(image->irradiance, press, contact);
      if (sum) sum->add(i, irradiance);
    }
    if (sum) irradiance = sum->irradiance();
    Capture capture =
        develop(irradiance, {}, truth, now, counts, static_cast<std::int64_t>(times.size()) * size.area());
    capture.direct = true;
    return capture;
  }

  /// How many steps between moments a row's exposure lasts.
  double intervals_of_row(const std::vector<double>& times) const {
    if (times.size() < 2) return 1.0;
    return std::max(1.0, shutter_timing().exposure_s / times.back() * static_cast<double>(times.size() - 1));
  }

  render::ShutterTiming shutter_timing() const {
    render::ShutterTiming timing;
    if (plan.motion_blur) timing.exposure_s = scene.device.camera->exposure_us / kMicrosecondsPerSecond;
    if (plan.rolling_shutter) timing.line_time_s = scene.device.camera->row_time_us / kMicrosecondsPerSecond;
    return timing;
  }

  /// Light of the moments `times` (s) after the frame's begin, each row's mean over its own exposure. The moments have
  /// samples of their own, so that their noise is averaged, too.
  Capture take_over_time(const Truth& truth, const std::optional<fem::ReliefAnswer>& now,
                         const std::vector<double>& times, bool whole) const {
    const bool shares = shared && !whole;
    std::vector<render::Scene> scenes;
    std::vector<FrameAppearance> appearances;
    for (const double time : times) {
      const fem::PressState press = state_after(truth, time);
      scenes.push_back(seen(press, relief(press)));
      if (!whole && !shares)
        appearances.push_back(appearance_of(scenes.back(), render::Tracer(scenes.back()), ready, camera));
    }
    KnownLight light = whole || shares ? nothing_known() : known(truth.t_us, appearances);
    const int pixels = cv::countNonZero(light.missing);
    // Over so short a time the correction is that of its beginning.
    if (pixels == 0) {
      return develop(corrected(light.irradiance, truth.press, now), light.standard_error, truth, now, {}, 0);
    }
    const render::ShutterTiming timing = shutter_timing();
    render::RenderSettings of_moment = settings;
    of_moment.noise = noise_target(response, light_limits(scene).noise_fraction * std::sqrt(intervals_of_row(times)));
    render::RollingExposure sum(times, timing, size, plan.bands.count());
    render::RayCounts counts;
    for (std::size_t i = 0; i < times.size(); ++i) {
      RandomStream seeds(scene.seed, i, Purpose::kMotion);
      of_moment.seed = next_seed(seeds);
      const render::Tracer tracer(scenes[i]);
      const render::RenderedImage image = shares ? shared->render(scenes[i], tracer, of_moment, scene.outputs.error)
                                                 : tracer.render(camera, of_moment, light.missing);
      sum.add(i, image.irradiance, image.standard_error);
      counts += image.counts;
    }
    add_traced(sum.irradiance(), sum.standard_error(), light);
    return develop(corrected(light.irradiance, truth.press, now), light.standard_error, truth, now, counts,
                   static_cast<std::int64_t>(times.size()) * pixels);
  }
};

VirtualCamera::VirtualCamera(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                             std::span<const Truth> truths) {
  TS_ASSERT(plan.camera && scene.device.camera);
  auto parts = std::make_unique<Parts>(scene, plan, gel);
  if (scene.outputs.light() && !truths.empty()) {
    if (!plan.scattering) parts->learn_light(truths);
    parts->watch(truths);
  }
  parts_ = std::move(parts);
}

VirtualCamera::~VirtualCamera() = default;

const LightChoice& VirtualCamera::light_choice() const {
  return parts_->choice;
}

Capture VirtualCamera::capture(const Truth& truth) const {
  // A preview knows nothing of scattered light.
  return parts_->take(truth, parts_->plan.scattering);
}

Capture VirtualCamera::capture_whole(const Truth& truth) const {
  return parts_->take(truth, true);
}

}  // namespace touchstone::sim
