#include "render/direct/rest_light.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/units.h"
#include "render/paths/path_tracer.h"

namespace touchstone::render {
namespace {

/// Pixels per mm on the surface in the picture's middle, seen through faces as if they weren't there.
double pixels_per_mm(const Camera& camera, const Scene& rest) {
  Eigen::AlignedBox3d box;
  for (const Surface& surface : rest.surfaces) {
    for (const auto& vertex : surface.mesh.vertices) box.extend(vertex);
  }
  if (box.isEmpty()) return 1.0;
  return std::visit(
      [&](const auto& one) {
        const RigidTransform camera_from_gel = one.gel_from_camera.inverse();
        const Eigen::Vector3d middle = camera_from_gel * box.center();
        if (!(middle.z() > 1e-3)) return 1.0;
        return (project(one, middle + Eigen::Vector3d(0.5, 0, 0)) - project(one, middle - Eigen::Vector3d(0.5, 0, 0)))
            .norm();
      },
      camera);
}

/// Standard deviation that the light is smoothed with.
double smoothing_px(const Scene& rest, const Camera& camera, const RestLightSettings& settings) {
  return settings.smooth_mm * pixels_per_mm(camera, rest);
}

void check(const RestLightSettings& settings) {
  if (settings.samples < 1 || settings.samples > 1 << 20) {
    fail("rest light: samples is {}; it must be from 1 to 1048576", settings.samples);
  }
  if (settings.paths < 1) fail("rest light: paths is {}; it must be at least 1", settings.paths);
  if (!(settings.smooth_mm >= 0.0 && settings.smooth_mm <= 1e3)) {
    fail("rest light: smooth_mm is {}; it must be from 0 to 1000", settings.smooth_mm);
  }
}

}  // namespace

int rest_light_samples(const Scene& rest, const Camera& camera, const RestLightSettings& settings) {
  const double sigma = smoothing_px(rest, camera, settings);
  const double window = std::max(1.0, 4.0 * kPi * sigma * sigma);  // as many pixels a Gaussian's mean is as good as
  return std::min(settings.samples, static_cast<int>(std::ceil(settings.paths / window)));
}

cv::Mat trace_rest(const Scene& rest, const Camera& camera, const RestLightSettings& settings) {
  check(settings);
  Scene whole = rest;
  whole.interreflection = true;
  RenderSettings paths;
  paths.seed = settings.seed;
  paths.min_samples = paths.max_samples = rest_light_samples(rest, camera, settings);
  paths.max_depth = settings.max_depth;
  return Tracer(whole).render(camera, paths).irradiance;
}

cv::Mat measure_rest_light(DirectRenderer& renderer, const Scene& rest, const Camera& camera,
                           const RestLightSettings& settings) {
  return measure_rest_light(renderer, rest, camera, trace_rest(rest, camera, settings), settings);
}

cv::Mat measure_rest_light(DirectRenderer& renderer, const Scene& rest, const Camera& camera, const cv::Mat& traced,
                           const RestLightSettings& settings) {
  check(settings);
  Scene direct = rest;
  direct.interreflection = false;
  const auto bands = static_cast<int>(rest.environment.size());
  const Eigen::Vector2i size = size_of(camera);

  renderer.set_bounced_light({});
  const cv::Mat plain = renderer.render(direct).irradiance;
  cv::Mat unit(size.y(), size.x(), CV_32FC(bands));
  unit.reshape(1).setTo(1.0f);
  renderer.set_bounced_light(unit);
  cv::Mat response = renderer.render(direct).irradiance - plain;
  renderer.set_bounced_light({});

  const double sigma = smoothing_px(rest, camera, settings);
  cv::Mat added = traced - plain;

  if (sigma > 0.1) {
    cv::GaussianBlur(added, added, cv::Size(), sigma, sigma, cv::BORDER_REFLECT);
    cv::GaussianBlur(response, response, cv::Size(), sigma, sigma, cv::BORDER_REFLECT);
  }
  cv::Mat light = cv::Mat::zeros(size.y(), size.x(), CV_32FC(bands));
  double most = 0.0;
  cv::minMaxLoc(response.reshape(1), nullptr, &most);
  for (int row = 0; row < light.rows; ++row) {
    const float* above = added.ptr<float>(row);
    const float* below = response.ptr<float>(row);
    float* out = light.ptr<float>(row);
    for (int k = 0; k < light.cols * bands; ++k) {
      // Where next to nothing is lit (a black object, the picture's dark corner) a quotient would be noise.
      if (double(below[k]) > 1e-4 * most) out[k] = std::max(0.0f, above[k] / below[k]);
    }
  }
  return light;
}

}  // namespace touchstone::render
