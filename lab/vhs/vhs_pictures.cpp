#include "lab/vhs/vhs_pictures.h"

#include <cmath>
#include <cstdint>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/units.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_faces.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {

std::vector<VhsPicture> vhs_pictures(sim::SceneSpec scene, const std::vector<int>& frames, int paths,
                                     const std::filesystem::path& cache, const Progress& progress) {
  // VirtualCamera renders its first frame with four times as many paths.
  constexpr int kFirstFrame = 4;
  scene.light.max_samples = scene.light.min_samples = std::max(1, paths / kFirstFrame);
  scene.effects.shared_paths = sim::Switch::off;  // colours and divisions are read by means over pixels of their own
  scene.outputs = {};
  scene.outputs.radiance = true;
  const sim::Plan plan = sim::make_plan(scene);
  const auto gel = sim::set_up_gel(scene.device, cache, progress);
  const std::vector<sim::Truth> truths = sim::play_motion(scene, plan, *gel);
  std::vector<VhsPicture> pictures;
  for (const int frame : frames) {
    const sim::Truth& truth = truths.at(static_cast<std::size_t>(frame));
    const sim::VirtualCamera camera(scene, plan, *gel, truth);
    sim::Capture capture = camera.capture(truth);
    pictures.push_back({capture.frame, capture.radiance, truth.press});
    if (progress) progress("picture", std::ssize(pictures), std::ssize(frames));
  }
  return pictures;
}

VhsPicture vhs_picture(const sim::SceneSpec& scene, int paths, const std::filesystem::path& cache,
                       const Progress& progress) {
  return vhs_pictures(scene, {scene.motion.frame_count() - 1}, paths, cache, progress).front();
}

VhsView::VhsView(const sim::DeviceSpec& device, double z_mm)
    : camera_(render::make_ready(sim::camera_of(*device.camera))),
      size_(device.camera->width, device.camera->height),
      z_mm_(z_mm) {
  scene_.media.resize(3);
  scene_.media[1].index = device.plate.refractive_index;
  scene_.media[2].index = device.gel.refractive_index;
  scene_.faces = sim::flat_faces(device);
  scene_.environment = render::flat_spectrum(1, 0.0);
}

Eigen::Vector2d VhsView::pixel_of(const Eigen::Vector2d& place_mm) const {
  const auto at = render::project_through_faces(scene_, camera_, {place_mm.x(), place_mm.y(), z_mm_});
  TS_ASSERT(at);
  return *at;
}

cv::Mat VhsView::disc_mask(const Eigen::Vector2d& centre_mm, double radius_mm) const {
  const Eigen::Vector2d centre = pixel_of(centre_mm);
  const double x =
      0.5 * (pixel_of(centre_mm + Eigen::Vector2d(radius_mm, 0)) - pixel_of(centre_mm - Eigen::Vector2d(radius_mm, 0)))
                .norm();
  const double y =
      0.5 * (pixel_of(centre_mm + Eigen::Vector2d(0, radius_mm)) - pixel_of(centre_mm - Eigen::Vector2d(0, radius_mm)))
                .norm();
  cv::Mat mask(size_, CV_8UC1, cv::Scalar(0));
  for (int row = 0; row < mask.rows; ++row) {
    for (int column = 0; column < mask.cols; ++column) {
      const double dx = (column + 0.5 - centre.x()) / x;
      const double dy = (row + 0.5 - centre.y()) / y;
      if (dx * dx + dy * dy <= 1.0) mask.at<std::uint8_t>(row, column) = 255;
    }
  }
  return mask;
}

double transfer_at(const sim::DeviceSpec& device, const VhsView& view, const Eigen::Vector2d& place_mm, double per_mm) {
  constexpr int kAcross = 80;  // places in the hole, on a grid
  const sim::CameraSpec& camera = *device.camera;
  const auto& pinhole = std::get<sim::PinholeSpec>(camera.optics);
  const double radius = 0.5 * pinhole.hole_diameter_um / kMicrometresPerMillimetre;
  const double half_foil = 0.5 * pinhole.foil_thickness_um / kMicrometresPerMillimetre;
  const double pitch = camera.pixel_pitch_um / kMicrometresPerMillimetre;
  const Eigen::Vector2d pixel = view.pixel_of(place_mm);
  // The sensor point, before read-out turns the picture upright.
  const Eigen::Vector2d sensor =
      -pitch * (pixel - 0.5 * Eigen::Vector2d(static_cast<double>(camera.width), static_cast<double>(camera.height)));
  const double distance = pinhole.hole_to_sensor_mm;
  const double thicknesses[] = {-camera.position_mm.z() - device.gel.thickness_mm - device.plate.thickness_mm,
                                device.plate.thickness_mm, device.gel.thickness_mm};
  const double indices[] = {1.0, device.plate.refractive_index, device.gel.refractive_index};
  double sum = 0.0;
  int count = 0;
  for (int i = 0; i < kAcross; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      const Eigen::Vector2d hole =
          radius * Eigen::Vector2d(2.0 * (i + 0.5) / kAcross - 1.0, 2.0 * (j + 0.5) / kAcross - 1.0);
      const Eigen::Vector2d slope = (hole - sensor) / distance;
      if ((hole + half_foil * slope).norm() > radius || (hole - half_foil * slope).norm() > radius) continue;
      const double sine = slope.norm() / std::sqrt(1.0 + slope.squaredNorm());
      Eigen::Vector2d at = hole;
      for (int k = 0; k < 3; ++k) {
        const double bent = sine / indices[k];
        if (slope.norm() > 0.0) at += thicknesses[k] * bent / std::sqrt(1.0 - bent * bent) * slope.normalized();
      }
      sum += std::cos(2.0 * kPi * per_mm * (at.x() - place_mm.x()));
      ++count;
    }
  }
  return sum / count;
}

PinholeOptics optics_of(const sim::DeviceSpec& device) {
  const sim::CameraSpec& camera = *device.camera;
  const auto& pinhole = std::get<sim::PinholeSpec>(camera.optics);
  PinholeOptics optics;
  optics.hole_mm = pinhole.hole_diameter_um / kMicrometresPerMillimetre;
  optics.to_sensor_mm = pinhole.hole_to_sensor_mm;
  const double air = -camera.position_mm.z() - device.gel.thickness_mm - device.plate.thickness_mm;
  optics.to_object_mm = air + device.plate.thickness_mm / device.plate.refractive_index +
                        device.gel.thickness_mm / device.gel.refractive_index;
  optics.pixel_mm = camera.pixel_pitch_um / kMicrometresPerMillimetre;
  return optics;
}

RuleProfile profile_along_x(const cv::Mat& picture, const VhsView& view, double from_mm, double to_mm, double y_mm,
                            double half_height_mm) {
  TS_ASSERT(picture.type() == CV_32FC1);
  constexpr double kStep_mm = 0.01;
  constexpr int kRows = 31;
  const int steps = static_cast<int>(std::llround((to_mm - from_mm) / kStep_mm));
  cv::Mat maps[2] = {cv::Mat(kRows, steps, CV_32FC1), cv::Mat(kRows, steps, CV_32FC1)};
  for (int row = 0; row < kRows; ++row) {
    const double y = y_mm + half_height_mm * (2.0 * row / (kRows - 1) - 1.0);
    for (int k = 0; k < steps; ++k) {
      const Eigen::Vector2d at = view.pixel_of({from_mm + (k + 0.5) * kStep_mm, y});
      for (int axis = 0; axis < 2; ++axis) maps[axis].at<float>(row, k) = static_cast<float>(at[axis] - 0.5);
    }
  }
  cv::Mat along;
  cv::remap(picture, along, maps[0], maps[1], cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::Mat mean;
  cv::reduce(along, mean, 0, cv::REDUCE_AVG);
  RuleProfile profile;
  profile.from_mm = from_mm + 0.5 * kStep_mm;
  profile.step_mm = kStep_mm;
  for (int k = 0; k < steps; ++k) profile.values.push_back(mean.at<float>(0, k));
  return profile;
}

}  // namespace touchstone::lab
