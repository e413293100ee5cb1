#include "sim/scene/device_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/transform.h"
#include "core/units.h"

namespace touchstone::sim {

RigidTransform pose_of(const CameraSpec& camera) {
  // The camera looks out of the gel, along +z: with +y of the gel frame down the picture, +x runs to its right and
  // nothing is mirrored. A camera that looks straight along y has +z down instead.
  const Eigen::Vector3d view = (camera.look_at_mm - camera.position_mm).normalized();
  const Eigen::Vector3d down = std::abs(view.y()) > 0.999 ? Eigen::Vector3d(0, 0, 1) : Eigen::Vector3d(0, 1, 0);
  const double roll = camera.roll_deg * kRadiansPerDegree;
  return look_at(camera.position_mm, camera.look_at_mm, Eigen::AngleAxisd(roll, view) * down);
}

render::PinholeCamera pinhole_camera(const CameraSpec& camera) {
  const auto& hole = std::get<PinholeSpec>(camera.optics);
  render::PinholeCamera out;
  out.width = camera.width;
  out.height = camera.height;
  out.pixel_pitch_um = camera.pixel_pitch_um;
  out.hole_diameter_um = hole.hole_diameter_um;
  out.foil_thickness_um = hole.foil_thickness_um;
  out.distance_mm = hole.hole_to_sensor_mm;
  out.gel_from_camera = pose_of(camera);
  return out;
}

namespace {

/// The list as OpenCV orders it; what isn't there is 0.
render::LensDistortion distortion_of(const std::vector<double>& list) {
  const auto at = [&list](std::size_t i) { return i < list.size() ? list[i] : 0.0; };
  return {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)};
}

render::LensCamera lens_camera(const CameraSpec& camera, const LensSpec& lens) {
  render::LensCamera out;
  out.width = camera.width;
  out.height = camera.height;
  out.pixel_pitch_um = camera.pixel_pitch_um;
  out.distortion = distortion_of(lens.distortion);
  out.vignetting = lens.vignetting;
  if (lens.focus_distance_mm) out.focus_distance_mm = *lens.focus_distance_mm;
  if (lens.camera_matrix) {
    const Eigen::Vector4d& matrix = *lens.camera_matrix;
    out.matrix = {matrix[0], matrix[1], matrix[2], matrix[3]};
  } else {
    const double focal = *lens.focal_length_mm;
    if (lens.sensor_distance_mm) out.focus_distance_mm = render::focus_of_sensor(focal, *lens.sensor_distance_mm);
    out.matrix =
        render::matrix_of_lens(focal, out.focus_distance_mm, camera.pixel_pitch_um, camera.width, camera.height);
  }
  out.aperture_mm = render::focal_length_mm(out) / lens.f_number;
  out.gel_from_camera = pose_of(camera);
  return out;
}

}  // namespace

render::Camera camera_of(const CameraSpec& camera) {
  const auto* lens = std::get_if<LensSpec>(&camera.optics);
  if (lens == nullptr) return pinhole_camera(camera);
  render::LensCamera out = lens_camera(camera, *lens);
  check_camera(out);
  return out;
}

render::DiffractingAperture aperture_of(const DeviceSpec& device, const render::Spectrum& wavelengths_nm) {
  const CameraSpec& camera = *device.camera;
  const render::Camera geometric = camera_of(camera);
  render::DiffractingAperture aperture;
  aperture.wavelengths_nm = wavelengths_nm;
  double pitch_mm = 1e-3 * camera.pixel_pitch_um;
  if (const auto* lens = std::get_if<render::LensCamera>(&geometric)) {
    aperture.diameter_mm = lens->aperture_mm;
    aperture.to_sensor_mm = render::sensor_distance_mm(*lens);
    aperture.in_focus = true;
  } else {
    const auto& hole = std::get<render::PinholeCamera>(geometric);
    aperture.diameter_mm = 1e-3 * hole.hole_diameter_um;
    aperture.foil_mm = 1e-3 * hole.foil_thickness_um;
    aperture.to_sensor_mm = hole.distance_mm;
    const double gel = device.gel.thickness_mm;
    const double plate = device.plate.thickness_mm;
    const double air = std::max(0.0, -camera.position_mm.z() - gel - plate);
    aperture.per_object_mm = 1.0 / (air + plate / device.plate.refractive_index + gel / device.gel.refractive_index);
  }
  aperture.farthest_mm = 0.5 * pitch_mm * std::hypot(camera.width, camera.height);
  return aperture;
}

render::Camera diffracting_camera(const DeviceSpec& device, const render::Spectrum& wavelengths_nm) {
  render::Camera camera = camera_of(*device.camera);
  const auto spread = std::make_shared<const render::DiffractionSpread>(aperture_of(device, wavelengths_nm));
  std::visit([&](auto& one) { one.diffraction = spread; }, camera);
  return camera;
}

double blur_disc_px(const render::Camera& camera, double distance_mm) {
  if (const auto* lens = std::get_if<render::LensCamera>(&camera)) {
    return 1e3 * render::blur_circle_mm(*lens, distance_mm) / lens->pixel_pitch_um;
  }
  const auto& pinhole = std::get<render::PinholeCamera>(camera);
  return pinhole.hole_diameter_um * (1.0 + pinhole.distance_mm / distance_mm) / pinhole.pixel_pitch_um;
}

double blur_radius_px(const render::Camera& camera, double nearest_mm) {
  // A lens's disc grows with the distance from the plane of focus on either side.
  const double far = std::holds_alternative<render::LensCamera>(camera)
                         ? blur_disc_px(camera, std::numeric_limits<double>::infinity())
                         : 0.0;
  return 0.5 * std::max(blur_disc_px(camera, nearest_mm), far);
}

double least_blur_radius_px(const render::Camera& camera) {
  const auto* pinhole = std::get_if<render::PinholeCamera>(&camera);
  if (pinhole == nullptr) return 0.0;
  const double corner = 0.5 * std::hypot(pinhole->width, pinhole->height) * pinhole->pixel_pitch_um;
  const double hidden_um = pinhole->foil_thickness_um * corner / (1e3 * pinhole->distance_mm);
  return 0.5 * std::max(0.0, pinhole->hole_diameter_um - hidden_um) / pinhole->pixel_pitch_um;
}

}  // namespace touchstone::sim
