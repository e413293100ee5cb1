#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/units.h"
#include "render/path_tracer.h"
#include "sim/device_camera.h"
#include "sim/pixel_truth.h"
#include "sim/virtual_sensor.h"
#include "sim/visible_scene.h"

namespace touchstone::sim {
namespace {

constexpr int kPreviewStride = 2;
// The first frame's light stays in every later frame where nothing changes, so it is rendered better than they are.
constexpr double kFirstFrameFraction = 0.5;
constexpr int kFirstFrameSamples = 4;

/// The response of the channel that the eye and most trackers lean on: green of three, or the grey one.
render::NoiseTarget noise_target(const render::ImagerResponse& response, double fraction) {
  render::NoiseTarget target;
  const int channel = response.electrons_per_irradiance.rows() == 1 ? 0 : 1;
  target.electrons_per_irradiance = response.electrons_per_irradiance.row(channel).transpose().array();
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

struct VirtualCamera::Parts {
  Parts(const SceneSpec& scene_of, const Plan& plan_of, const fem::Compliance& gel_of)
      : scene(scene_of),
        plan(plan_of),
        gel(gel_of),
        membrane(plan.fine_relief || scene.outputs.height ? std::make_unique<Membrane>(scene, plan, gel_of) : nullptr),
        objects(visible_objects(scene)),
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

  SceneSpec scene;
  Plan plan;
  VisibleGel gel;
  std::unique_ptr<const Membrane> membrane;  // if it's called for
  std::vector<VisibleObject> objects;
  render::Camera camera;
  cv::Size size;
  render::Imager imager;
  render::Imager ideal_imager;
  render::ImagerResponse response;
  render::FixedPattern pattern;
  render::RenderSettings settings;
  cv::Mat first_light;    // irradiance of the first frame
  cv::Mat first_error;    // its standard error
  cv::Mat first_preview;  // its preview without noise

  std::optional<fem::ReliefAnswer> relief(const Truth& truth) const {
    return membrane ? membrane->relief(truth.press) : std::nullopt;
  }

  render::Tracer tracer(const Truth& truth, const std::optional<fem::ReliefAnswer>& relief) const {
    if (relief && relief->grid.size() > 0) {
      return render::Tracer(visible_scene(scene, plan, objects, *membrane, truth.press, *relief));
    }
    return render::Tracer(visible_scene(scene, plan, objects, gel, truth.press));
  }

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
      const SeenGeometry seen = relief && relief->grid.size() > 0
                                    ? seen_geometry(scene, plan, objects, *membrane, truth.press, *relief)
                                    : seen_geometry(scene, plan, objects, gel, truth.press);
      capture.pixel_truth = pixel_truth(seen, std::get<render::PinholeCamera>(camera), scene.outputs);
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
};

VirtualCamera::VirtualCamera(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, const Truth& first) {
  TS_ASSERT(plan.camera && scene.device.camera);
  auto parts = std::make_unique<Parts>(scene, plan, gel);
  if (!scene.outputs.light() || plan.scattering) {
    parts_ = std::move(parts);
    return;
  }
  render::RenderSettings settings = parts->settings;
  const render::Tracer tracer = parts->tracer(first, parts->relief(first));
  settings.noise->fraction *= kFirstFrameFraction;
  settings.max_samples *= kFirstFrameSamples;
  const render::RenderedImage image = tracer.render(parts->camera, settings);
  parts->first_light = image.irradiance;
  parts->first_error = image.standard_error;
  parts->first_preview = tracer.preview(parts->camera, kPreviewStride);
  parts_ = std::move(parts);
}

VirtualCamera::~VirtualCamera() = default;

Capture VirtualCamera::capture(const Truth& truth) const {
  // A preview knows nothing of scattered light.
  if (parts_->plan.scattering) return capture_whole(truth);
  const auto relief = parts_->relief(truth);
  if (!parts_->scene.outputs.light()) return parts_->geometry(truth, relief);
  const render::Tracer tracer = parts_->tracer(truth, relief);
  const cv::Mat mask = parts_->changed(tracer.preview(parts_->camera, kPreviewStride));
  const int pixels = cv::countNonZero(mask);
  if (pixels == 0) return parts_->develop(parts_->first_light, parts_->first_error, truth, relief, {}, 0);
  const render::RenderedImage image = tracer.render(parts_->camera, parts_->settings, mask);
  cv::Mat light = parts_->first_light.clone();
  image.irradiance.copyTo(light, mask);
  cv::Mat error = parts_->first_error.clone();
  image.standard_error.copyTo(error, mask);
  return parts_->develop(light, error, truth, relief, image.counts, pixels);
}

Capture VirtualCamera::capture_whole(const Truth& truth) const {
  const auto relief = parts_->relief(truth);
  if (!parts_->scene.outputs.light()) return parts_->geometry(truth, relief);
  const render::RenderedImage image = parts_->tracer(truth, relief).render(parts_->camera, parts_->settings);
  return parts_->develop(image.irradiance, image.standard_error, truth, relief, image.counts, image.irradiance.total());
}

}  // namespace touchstone::sim
