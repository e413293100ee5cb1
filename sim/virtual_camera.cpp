#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/random.h"
#include "core/units.h"
#include "render/rolling_shutter.h"
#include "sim/device_camera.h"
#include "sim/direct_light.h"
#include "sim/exposure_times.h"
#include "sim/pixel_truth.h"
#include "sim/scene_sight.h"
#include "sim/virtual_sensor.h"

namespace touchstone::sim {
namespace {

constexpr int kPreviewStride = 2;
// The first frame's light stays in every later frame where nothing changes, so it is rendered better than they are.
constexpr double kFirstFrameFraction = 0.5;
constexpr int kFirstFrameSamples = 4;

/// The electrons of all channels together, as many as the one that sees most: a lamp of one colour counts even if the
/// first samples of a pixel never chose it.
render::NoiseTarget noise_target(const render::ImagerResponse& response, double fraction) {
  const render::QuantumEfficiency& channels = response.electrons_per_irradiance;
  render::NoiseTarget target;
  target.electrons_per_irradiance = channels.colwise().sum().transpose().array();
  const double all = target.electrons_per_irradiance.sum();
  if (all > 0.0) target.electrons_per_irradiance *= channels.rowwise().sum().maxCoeff() / all;
  target.read_noise_e = response.read_noise_e;
  target.quantisation_e = response.quantisation_e / std::sqrt(12.0);
  target.fraction = fraction;
  return target;
}

/// Sets what lies within `radius` pixels of a set pixel.
void widen(cv::Mat& mask, int radius) {
  constexpr int kLargeRadius = 16;  // a lens out of focus; dilation's time grows with the square of the radius
  if (radius <= kLargeRadius) {
    cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1}));
    return;
  }
  if (cv::countNonZero(mask) == 0) return;
  cv::Mat distance;
  cv::distanceTransform(mask == 0, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  mask = (distance <= radius);
}

}  // namespace

struct VirtualCamera::Parts : SceneSight {
  Parts(const SceneSpec& scene_of, const Plan& plan_of, const fem::Compliance& gel_of)
      : SceneSight(scene_of, plan_of, gel_of),
        exposure(scene_of, plan_of),
        camera(camera_of(*scene.device.camera)),
        size(render::size_of(camera).x(), render::size_of(camera).y()),
        imager(sim::imager(scene.device, plan.bands, plan.sensor_noise)),
        ideal_imager(sim::imager(scene.device, plan.bands, false)),
        response(render::response_of(imager)),
        pattern(render::fixed_pattern(imager, size, scene.seed)) {
    settings.seed = scene.seed;
    settings.min_samples = scene.light.min_samples;
    settings.max_samples = scene.light.max_samples;
    settings.noise = noise_target(response, scene.light.noise_fraction);
  }

  ExposureTimes exposure;
  render::Camera camera;
  cv::Size size;
  render::Imager imager;
  render::Imager ideal_imager;
  render::ImagerResponse response;
  render::FixedPattern pattern;
  render::RenderSettings settings;
  std::unique_ptr<const DirectLight> direct;  // where it holds; the first frame is then not needed
  LightChoice choice{false, "paths: the plan has no direct light", {}};
  cv::Mat first_light;    // irradiance of the first frame
  cv::Mat first_error;    // its standard error
  cv::Mat first_preview;  // its preview without noise

  /// Which pixels changed against the first frame by more than the tolerance, widened by the blur of hole or lens.
  cv::Mat changed(const cv::Mat& preview) const {
    cv::Mat mask(preview.size(), CV_8U, cv::Scalar(0));
    const auto& per_irradiance = settings.noise->electrons_per_irradiance;
    const int bands = plan.bands.count();
    for (int row = 0; row < preview.rows; ++row) {
      const auto* now = preview.ptr<float>(row);
      const auto* before = first_preview.ptr<float>(row);
      auto* out = mask.ptr<unsigned char>(row);
      for (int column = 0; column < preview.cols; ++column) {
        double electrons = 0.0;
        double change = 0.0;
        for (int band = 0; band < bands; ++band) {
          const int at = bands * column + band;
          electrons += per_irradiance[band] * before[at];
          change += std::abs(per_irradiance[band] * (now[at] - before[at]));
        }
        if (change > scene.light.change_tolerance * render::noise_e(response, electrons)) out[column] = 255;
      }
    }
    const double nearest = std::max(1e-3, -scene.device.gel.thickness_mm - scene.device.camera->hole_position_mm.z());
    const int radius = 1 + static_cast<int>(std::ceil(blur_radius_px(camera, nearest) / kPreviewStride));
    widen(mask, radius);
    cv::Mat whole;
    cv::resize(mask, whole, {mask.cols * kPreviewStride, mask.rows * kPreviewStride}, 0, 0, cv::INTER_NEAREST);
    return whole(cv::Rect({0, 0}, size)).clone();
  }

  /// What needs no light.
  Capture geometry(const Truth& truth, const std::optional<fem::ReliefAnswer>& relief) const {
    Capture capture;
    if (scene.outputs.height) capture.height = membrane->height(truth.press, relief);
    if (scene.outputs.first_hits()) {
      capture.pixel_truth = pixel_truth(SceneSight::geometry(truth.press, relief), camera, scene.outputs);
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
    const auto picture = [&](const render::Imager& sensor) {
      return render::develop(
          render::expose(irradiance, sensor, pattern, scene.seed, static_cast<std::uint64_t>(truth.frame)), sensor);
    };
    if (scene.outputs.frames) capture.frame = picture(imager);
    if (scene.outputs.ideal) capture.ideal = picture(ideal_imager);
    if (scene.outputs.radiance) capture.radiance = irradiance;
    return capture;
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
      whole = true;  // there is no first frame to lean on
    }
    if (times.size() > 1) return take_over_time(truth, now, times, whole);
    const render::Tracer at_once = tracer(truth.press, now);
    const cv::Mat mask = whole ? all_pixels() : changed(at_once.preview(camera, kPreviewStride));
    const int pixels = cv::countNonZero(mask);
    if (pixels == 0) return develop(first_light, first_error, truth, now, {}, 0);
    const render::RenderedImage image = at_once.render(camera, settings, mask);
    return develop(with_first(image.irradiance, first_light, mask), with_first(image.standard_error, first_error, mask),
                   truth, now, image.counts, pixels);
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
      const auto image = direct->render(seen(press, later ? relief(press) : now));
      if (!image) return std::nullopt;
      counts.paths += image->primary;
      counts.primary += image->primary;
      irradiance = image->irradiance;
      if (sum) sum->add(i, irradiance);
    }
    if (sum) irradiance = sum->irradiance();
    Capture capture =
        develop(irradiance, {}, truth, now, counts, static_cast<std::int64_t>(times.size()) * size.area());
    capture.direct = true;
    return capture;
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
    std::vector<fem::PressState> states;
    std::vector<std::optional<fem::ReliefAnswer>> reliefs;  // which cost more than a tracer
    for (const double time : times) {
      states.push_back(state_after(truth, time));
      reliefs.push_back(relief(states.back()));
    }
    cv::Mat mask = whole ? all_pixels() : cv::Mat(size, CV_8U, cv::Scalar(0));
    for (std::size_t i = 0; i < times.size() && !whole; ++i) {
      mask |= changed(tracer(states[i], reliefs[i]).preview(camera, kPreviewStride));
    }
    const int pixels = cv::countNonZero(mask);
    if (pixels == 0) return develop(first_light, first_error, truth, now, {}, 0);
    const render::ShutterTiming timing = shutter_timing();
    render::RenderSettings of_moment = settings;
    const double intervals_of_row = timing.exposure_s / times.back() * static_cast<double>(times.size() - 1);
    of_moment.noise = noise_target(response, scene.light.noise_fraction * std::sqrt(std::max(1.0, intervals_of_row)));
    render::RollingExposure sum(times, timing, size, plan.bands.count());
    render::RayCounts counts;
    for (std::size_t i = 0; i < times.size(); ++i) {
      RandomStream seeds(scene.seed, i, Purpose::kMotion);
      of_moment.seed = (std::uint64_t{seeds()} << 32) | seeds();
      const render::RenderedImage image = tracer(states[i], reliefs[i]).render(camera, of_moment, mask);
      sum.add(i, image.irradiance, image.standard_error);
      counts += image.counts;
    }
    return develop(with_first(sum.irradiance(), first_light, mask), with_first(sum.standard_error(), first_error, mask),
                   truth, now, counts, static_cast<std::int64_t>(times.size()) * pixels);
  }

  cv::Mat all_pixels() const { return {size, CV_8U, cv::Scalar(255)}; }

  /// The picture where the mask is set, the first frame's elsewhere.
  static cv::Mat with_first(const cv::Mat& picture, const cv::Mat& first, const cv::Mat& mask) {
    cv::Mat out = first.clone();
    picture.copyTo(out, mask);
    return out;
  }
};

VirtualCamera::VirtualCamera(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                             std::span<const Truth> truths) {
  TS_ASSERT(plan.camera && scene.device.camera && !truths.empty());
  auto parts = std::make_unique<Parts>(scene, plan, gel);
  if (!scene.outputs.light() || plan.scattering) {
    parts_ = std::move(parts);
    return;
  }
  if (plan.direct_light) {
    auto direct = std::make_unique<const DirectLight>(*parts, parts->camera, truths);
    parts->choice = direct->choice();
    if (direct->choice().direct) {
      parts->direct = std::move(direct);
      parts_ = std::move(parts);
      return;
    }
  }
  render::RenderSettings settings = parts->settings;
  const render::Tracer tracer = parts->tracer(truths.front().press);
  settings.noise->fraction *= kFirstFrameFraction;
  settings.max_samples *= kFirstFrameSamples;
  const render::RenderedImage image = tracer.render(parts->camera, settings);
  parts->first_light = image.irradiance;
  parts->first_error = image.standard_error;
  parts->first_preview = tracer.preview(parts->camera, kPreviewStride);
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
