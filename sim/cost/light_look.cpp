#include "sim/cost/light_look.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>

#include "core/error.h"
#include "render/paths/shared_paths.h"
#include "sim/cost/work_clock.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_imager.h"
#include "sim/scene/light_limits.h"
#include "sim/sensor/direct_light.h"
#include "sim/sensor/key_frames.h"
#include "sim/sensor/picture_settings.h"

namespace touchstone::sim {
namespace {

constexpr double kLongestLook_s = 10.0;
constexpr double kLookAccuracy = 0.02;  // of the light field that direct light is judged on where that takes longer
constexpr int kLookedAt = 256;          // pixels, at first
constexpr double kLeastLook_s = 0.05;   // until so much was seen
constexpr int kMeteringPaths = 8;       // a pixel, as VirtualCamera's

/// `count` pixels spread evenly over a picture.
cv::Mat spread(cv::Size size, int count) {
  cv::Mat mask = cv::Mat::zeros(size, CV_8UC1);
  const double step = std::max(1.0, std::sqrt(static_cast<double>(size.area()) / count));
  for (double row = 0.5 * step; row < size.height; row += step) {
    for (double column = 0.5 * step; column < size.width; column += step) {
      mask.at<unsigned char>(static_cast<int>(row), static_cast<int>(column)) = 255;
    }
  }
  return mask;
}

class Look {
 public:
  Look(const SceneView& view, const fem::Compliance& gel, std::span<const Truth> truths,
       const std::optional<fem::ReliefAnswer>& relief, double moments, double load, int frames)
      : view_(view),
        gel_(gel),
        truths_(truths),
        moments_(moments),
        load_(load),
        frames_(frames),
        camera_(planned_camera(view.scene, view.plan)),
        size_(render::size_of(camera_).x(), render::size_of(camera_).y()),
        response_(render::response_of(imager(view.scene.device, view.plan.bands, view.plan.sensor_noise))),
        deepest_(deepest(truths)),
        relief_(relief) {
    const WorkClock clock;
    scene_ = view.seen(deepest_.press, relief);
    seen_s_ = clock.seconds();
    const Truth& first = truths.front();
    const WorkClock again;
    first_ = view.seen(first.press, view.relief(first.press));
    seen_s_ = load_ * seen_s_ + (1.0 - load_) * again.seconds();
  }

  LightLook look() {
    LightLook found;
    if (!view_.plan.direct_light || !direct(found)) {
      if (view_.plan.shared_paths) {
        shared(found);
      } else {
        traced(found);
      }
    }
    if (view_.plan.auto_exposure || view_.plan.auto_white_balance) {
      found.metering_s = seen_s_ + (holds_ ? found.moment_s : kMeteringPaths * path_s() * size_.area());
    }
    return found;
  }

 private:
  /// Seconds of a pixel, a mean over the picture.
  double pixel_s(const render::Tracer& tracer, const render::RenderSettings& settings) const {
    for (int count = kLookedAt;; count *= 4) {
      const cv::Mat mask = spread(size_, count);
      const int pixels = std::max(1, cv::countNonZero(mask));
      const WorkClock clock;
      tracer.render(camera_, settings, mask);
      const double seconds = clock.seconds();
      if (seconds > kLeastLook_s || count >= size_.area()) return seconds / pixels;
    }
  }

  /// Seconds of a path of the deepest state.
  double path_s() const {
    constexpr int kPaths = 64;
    render::RenderSettings settings;
    settings.seed = view_.scene.seed;
    settings.min_samples = settings.max_samples = kPaths;
    settings.max_depth = render::DirectErrorSettings{}.max_depth;
    return pixel_s(render::Tracer(scene_), settings) / kPaths;
  }

  /// False if it won't be taken.
  bool direct(LightLook& found) {
    try {
      WorkClock clock;
      const DirectWork work = count_direct_work(view_, camera_, truths_, relief_);
      const double place_s = std::max(0.0, clock.seconds() - 2.0 * seen_s_) / std::max(1.0, work.field.looked_at);
      const double path = path_s();
      found.set_up_s += 2.0 * seen_s_ + work.field.places * place_s;
      if (!work.field.fits) return false;
      const double paths_s = (work.rest_paths + work.error_paths) * path;
      const bool quick = found.set_up_s + paths_s < kLongestLook_s;
      // Where that is quick, light is found as the run will find it; else on a coarse field, without bounced light.
      std::optional<SceneView> plain;
      if (!quick) {
        Plan without = view_.plan;
        without.interreflection = false;
        plain.emplace(view_.scene, without, gel_, view_);
      }
      DirectLightSettings wanted;
      wanted.field_accuracy = quick ? 0.0 : kLookAccuracy;
      wanted.relief = &relief_;
      const WorkClock finding;
      const DirectLight light(plain ? *plain : view_, camera_, truths_, wanted);
      if (quick) {
        found.set_up_s = finding.seconds();
      } else {
        found.set_up_s += paths_s;
      }
      if (!light.choice().direct) return false;
      const double drawn_s = mean_over_moments([&](const render::Scene& scene) {
        light.render(quick ? scene : without_bounces(scene), light.part_of(0, moments_ - 1.0));
      });
      found.moment_s = seen_s_ + drawn_s;
      found.how = light.choice().reason;
      holds_ = true;
      return true;
    } catch (const Error&) {
      return false;
    }
  }

  static render::Scene without_bounces(render::Scene scene) {
    scene.interreflection = false;
    return scene;
  }

  /// Seconds that `work` takes with a moment's scene: between the first one's and the deepest one's.
  template <typename Work>
  double mean_over_moments(const Work& work) const {
    const auto timed = [&](const render::Scene& scene) {
      const WorkClock clock;
      work(scene);
      return clock.seconds();
    };
    const double deepest_s = load_ > 0.0 ? timed(scene_) : 0.0;
    return load_ * deepest_s + (1.0 - load_) * (load_ < 1.0 ? timed(first_) : 0.0);
  }

  void shared(LightLook& found) const {
    found.how = "shared paths";
    const render::RenderSettings settings = picture_settings(view_.scene, response_);
    const render::Scene examples[] = {first_, scene_};
    const WorkClock clock;
    const render::SharedPaths paths(examples, std::get<render::PinholeCamera>(camera_), settings);
    found.set_up_s += 2.0 * seen_s_ + clock.seconds();
    found.moment_s = seen_s_ + mean_over_moments([&](const render::Scene& scene) {
                       paths.render(scene, render::Tracer(scene), settings, view_.scene.outputs.error);
                     });
  }

  /// Pixels that changed since the first frame are traced.
  void traced(LightLook& found) const {
    found.how = view_.plan.scattering ? "paths, all pixels of each frame" : "paths, where a pixel has changed";
    const WorkClock making;
    const render::Tracer tracer(scene_);
    const double made_s = seen_s_ + making.seconds();
    render::RenderSettings settings = picture_settings(view_.scene, response_);
    // Moments have noise of their own, which is averaged.
    settings.noise =
        noise_target(response_, light_limits(view_.scene).noise_fraction * std::sqrt(std::max(1.0, moments_ - 1)));
    const double a_pixel = pixel_s(tracer, settings);
    if (view_.plan.scattering) {
      found.moment_s = made_s + a_pixel * size_.area();
      return;
    }
    const render::Tracer rest_tracer(first_);
    found.set_up_s += made_s + pixel_s(rest_tracer, key_frame_settings(view_.scene, response_, true)) * size_.area();
    const render::ReadyCamera ready = render::make_ready(camera_);
    const FrameAppearance before = appearance_of(first_, rest_tracer, ready, camera_);
    const WorkClock looking;
    const FrameAppearance now = appearance_of(scene_, tracer, ready, camera_);
    const double nearest =
        std::max(1e-3, -view_.scene.device.gel.thickness_mm - view_.scene.device.camera->position_mm.z());
    const ChangeFinder finder(response_, *settings.noise, view_.scene.light.change_tolerance,
                              {least_blur_radius_px(camera_), blur_radius_px(camera_, nearest)}, size_);
    const int changed = cv::countNonZero(finder.changed(before, now));
    found.moment_s = made_s + looking.seconds() + load_ * a_pixel * changed;
    const auto keys = static_cast<double>((frames_ - 1) / static_cast<int>(kFramesPerKey));
    found.set_up_s += keys * (made_s + pixel_s(tracer, key_frame_settings(view_.scene, response_, false)) * changed);
  }

  const SceneView& view_;
  const fem::Compliance& gel_;
  std::span<const Truth> truths_;
  double moments_;
  double load_;
  int frames_;
  render::Camera camera_;
  cv::Size size_;
  render::ImagerResponse response_;
  const Truth& deepest_;
  const std::optional<fem::ReliefAnswer>& relief_;
  render::Scene first_, scene_;  // at the first frame and at the deepest
  double seen_s_ = 0.0;          // of making it
  bool holds_ = false;           // direct light does
};

}  // namespace

LightLook look_at_light(const SceneView& view, const fem::Compliance& gel, std::span<const Truth> truths,
                        const std::optional<fem::ReliefAnswer>& relief, double moments, double load, int frames) {
  TS_ASSERT(view.scene.outputs.light() && !truths.empty());
  return Look(view, gel, truths, relief, moments, load, frames).look();
}

}  // namespace touchstone::sim
