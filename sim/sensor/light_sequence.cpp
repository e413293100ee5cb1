#include "sim/sensor/light_sequence.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/error.h"
#include "sim/plan/image_motion.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/light_limits.h"
#include "sim/sensor/photocurrent.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {
namespace {

constexpr double kSameLight = 0.05;  // of the smallest threshold

}  // namespace

struct LightSequence::Parts {
  Parts(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, double smallest_threshold,
        std::shared_ptr<const DirectLight> direct_of)
      : direct(std::move(direct_of)),
        view(scene, plan, gel),
        camera(camera_of(*scene.device.camera)),
        size(render::size_of(camera).x(), render::size_of(camera).y()),
        currents(scene.device, plan.bands),
        pixels(scene.device.camera->events.value().pixels),
        tolerance(kSameLight * smallest_threshold),
        scale(scene.device),
        object_radius_mm(largest_object_radius(scene)) {
    settings.seed = scene.seed;
    settings.min_samples = settings.max_samples = scene.light.max_samples.value_or(kUsualMaxSamples);
    const double nearest = std::max(1e-3, -scene.device.gel.thickness_mm - scene.device.camera->position_mm.z());
    blur_px = blur_radius_px(camera, nearest);
  }

  std::shared_ptr<const DirectLight> direct;
  SceneView view;
  render::Camera camera;
  cv::Size size;
  Photocurrents currents;
  render::EventPixelSettings pixels;
  double tolerance;  // of logarithms
  ImageScale scale;
  double object_radius_mm;
  double blur_px = 0.0;
  render::RenderSettings settings;

  /// Logarithms of all channels' photocurrents in a preview.
  cv::Mat log_preview(const render::Tracer& tracer) const {
    const cv::Mat light = tracer.preview(camera, 1);
    const int channels = currents.channels();
    cv::Mat logs(light.size(), CV_32FC(channels));
    for (int row = 0; row < light.rows; ++row) {
      const auto* in = light.ptr<float>(row);
      auto* out = logs.ptr<float>(row);
      for (int column = 0; column < light.cols; ++column, in += light.channels()) {
        for (int channel = 0; channel < channels; ++channel) {
          *out++ = static_cast<float>(std::log(currents.of(channel, in) + pixels.dark_intensity));
        }
      }
    }
    return logs;
  }

  /// The largest difference of a preview's logarithms within the reach of a pixel's own area and the blur.
  cv::Mat contrast(const cv::Mat& preview) const {
    const int radius = 1 + static_cast<int>(std::ceil(blur_px));
    const cv::Mat square = cv::getStructuringElement(cv::MORPH_RECT, {2 * radius + 1, 2 * radius + 1});
    cv::Mat high;
    cv::Mat low;
    cv::dilate(preview, high, square);
    cv::erode(preview, low, square);
    return high - low;
  }

  /// The pixels whose light may have changed by more than the tolerance.
  cv::Mat changed(const SequencePicture& before, const cv::Mat& preview, double moved_px) const {
    cv::Mat mask(size, CV_8U, cv::Scalar(0));
    const cv::Mat steep = contrast(preview);
    const int channels = preview.channels();
    const double per_px = 1.0 / std::max(1.0, blur_px);  // an edge takes so long to pass what a pixel sees
    for (int row = 0; row < size.height; ++row) {
      const auto* now = preview.ptr<float>(row);
      const auto* then = before.preview.ptr<float>(row);
      const auto* around = steep.ptr<float>(row);
      const auto* traced_at = before.traced_at_px.ptr<double>(row);
      auto* out = mask.ptr<unsigned char>(row);
      for (int column = 0; column < size.width; ++column) {
        const double moved = std::min(1.0, per_px * (moved_px - traced_at[column]));
        for (int i = column * channels; i < (column + 1) * channels; ++i) {
          if (std::abs(now[i] - then[i]) > tolerance || moved * around[i] > tolerance) out[column] = 255;
        }
      }
    }
    const int radius = 1 + static_cast<int>(std::ceil(blur_px));
    cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_RECT, {2 * radius + 1, 2 * radius + 1}));
    return mask;
  }

  /// The whole picture by direct light.
  SequencePicture direct_picture(const fem::PressState& press) const {
    const auto image = direct->render(view.seen(press, view.relief(press)));
    if (!image) fail("events: the gel has gone where the light field of direct light doesn't reach");
    SequencePicture picture;
    picture.photocurrent = cv::Mat(size, CV_32FC1, cv::Scalar(0.0));
    put_light(image->irradiance, cv::Mat(size, CV_8U, cv::Scalar(255)), picture);
    picture.paths_traced = static_cast<std::int64_t>(image->primary);
    return picture;
  }

  void put_light(const cv::Mat& irradiance, const cv::Mat& mask, SequencePicture& picture) const {
    const int bands = irradiance.channels();
    for (int row = 0; row < size.height; ++row) {
      const auto* light = irradiance.ptr<float>(row);
      const auto* set = mask.ptr<unsigned char>(row);
      auto* current = picture.photocurrent.ptr<float>(row);
      for (int column = 0; column < size.width; ++column) {
        if (set[column] == 0) continue;
        current[column] = static_cast<float>(currents.at(column, row, light + column * bands));
      }
    }
    picture.log_photocurrent = render::log_intensity(picture.photocurrent, pixels);
    picture.pixels_traced = cv::countNonZero(mask);
  }
};

LightSequence::LightSequence(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                             double smallest_threshold, std::shared_ptr<const DirectLight> direct)
    : parts_(std::make_unique<const Parts>(scene, plan, gel, smallest_threshold, std::move(direct))) {
  TS_ASSERT(!parts_->direct || parts_->direct->choice().direct);
}

LightSequence::~LightSequence() = default;

cv::Size LightSequence::size() const {
  return parts_->size;
}

double LightSequence::motion(const fem::PressState& from, const fem::PressState& to) const {
  return image_motion(parts_->scale, from, to, parts_->object_radius_mm);
}

const SceneView& LightSequence::view() const {
  return parts_->view;
}

const DirectLight* LightSequence::direct() const {
  return parts_->direct.get();
}

void LightSequence::pixel_currents(const cv::Mat& irradiance, cv::Mat& currents) const {
  currents.create(parts_->size, CV_32FC1);
  parts_->currents.put(irradiance, currents);
}

SequencePicture LightSequence::first(const fem::PressState& press) const {
  if (parts_->direct) return parts_->direct_picture(press);
  const render::Tracer tracer = parts_->view.tracer(press);
  SequencePicture picture;
  picture.photocurrent = cv::Mat(parts_->size, CV_32FC1, cv::Scalar(0.0));
  picture.preview = parts_->log_preview(tracer);
  picture.traced_at_px = cv::Mat(parts_->size, CV_64FC1, cv::Scalar(0.0));
  const cv::Mat all(parts_->size, CV_8U, cv::Scalar(255));
  const render::RenderedImage image = tracer.render(parts_->camera, parts_->settings);
  parts_->put_light(image.irradiance, all, picture);
  picture.paths_traced = static_cast<std::int64_t>(image.counts.paths);
  return picture;
}

SequencePicture LightSequence::next(const SequencePicture& before, const fem::PressState& press,
                                    double moved_px) const {
  if (parts_->direct) {
    SequencePicture picture = parts_->direct_picture(press);
    picture.moved_px = before.moved_px + moved_px;
    return picture;
  }
  SequencePicture picture = before;
  picture.pixels_traced = picture.paths_traced = 0;
  picture.moved_px = before.moved_px + moved_px;
  const render::Tracer tracer = parts_->view.tracer(press);
  const cv::Mat preview = parts_->log_preview(tracer);
  const cv::Mat mask = parts_->changed(before, preview, picture.moved_px);
  if (cv::countNonZero(mask) == 0) return picture;
  picture.photocurrent = before.photocurrent.clone();
  picture.preview = before.preview.clone();
  preview.copyTo(picture.preview, mask);
  picture.traced_at_px = before.traced_at_px.clone();
  picture.traced_at_px.setTo(picture.moved_px, mask);
  const render::RenderedImage image = tracer.render(parts_->camera, parts_->settings, mask);
  parts_->put_light(image.irradiance, mask, picture);
  picture.paths_traced = static_cast<std::int64_t>(image.counts.paths);
  return picture;
}

}  // namespace touchstone::sim
