#pragma once
// The vhs sensor as a camera: what is laid onto its gel, seen and found again.

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/progress.h"
#include "fem/contact/press.h"
#include "lab/vhs/pinhole_transfer.h"
#include "lab/vhs/rule_reading.h"
#include "render/cameras/first_hits.h"
#include "sim/scene/scene.h"

namespace touchstone::lab {

/// One picture with the light and the press behind it.
struct VhsPicture {
  cv::Mat frame;       ///< as the camera delivers it, BGR
  cv::Mat irradiance;  ///< CV_32FC(bands), W/m^2 on the sensor
  fem::PressState press;
};

/// Pictures of a scene at some of its frames, each traced by itself with `paths` paths a pixel.
std::vector<VhsPicture> vhs_pictures(sim::SceneSpec scene, const std::vector<int>& frames, int paths,
                                     const std::filesystem::path& cache, const Progress& progress);
/// At its last frame.
VhsPicture vhs_picture(const sim::SceneSpec& scene, int paths, const std::filesystem::path& cache,
                       const Progress& progress);

/// Where points of a level face at height `z_mm` (gel frame) that touches the gel appear.
class VhsView {
 public:
  /// By the device's camera, through plate and gel. @pre it has one
  VhsView(const sim::DeviceSpec& device, double z_mm);
  /// Pixels, centres at + 0.5; also beside the picture.
  Eigen::Vector2d pixel_of(const Eigen::Vector2d& place_mm) const;
  /// 255 within a disc on the face.
  cv::Mat disc_mask(const Eigen::Vector2d& centre_mm, double radius_mm) const;

 private:
  render::Scene scene_;  // its flat faces
  render::ReadyCamera camera_;
  cv::Size size_;
  double z_mm_;
};

/// The device's pinhole as closed forms take it, for a face at the gel's outer surface. @pre the device has a pinhole
PinholeOptics optics_of(const sim::DeviceSpec& device);

/// Contrast that geometry leaves of a sine along x of `per_mm` (with its dark places at multiples of 1 / per_mm) at a
/// place of the touched face: the mean of its phase over the hole as the foil leaves it open, each ray bent at the
/// faces by Snell's law. On the axis and for a thin foil it is transfer_of_disc without the pixel.
double transfer_at(const sim::DeviceSpec& device, const VhsView& view, const Eigen::Vector2d& place_mm, double per_mm);

/// Mean over |y - y_mm| <= half_height_mm of a picture (CV_32FC1) along x.
RuleProfile profile_along_x(const cv::Mat& picture, const VhsView& view, double from_mm, double to_mm, double y_mm,
                            double half_height_mm);

}  // namespace touchstone::lab
