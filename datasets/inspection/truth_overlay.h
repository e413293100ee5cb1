#pragma once
// What is true, drawn over the picture in which it should be seen.

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "datasets/inspection/inspected_set.h"
#include "sim/scene/device.h"

namespace touchstone::datasets {

/// Where a device's camera sees a point of the gel frame, through plate and gel; nothing if it doesn't.
class GelView {
 public:
  /// @throws Error if the device has no camera
  explicit GelView(const sim::DeviceSpec& device);
  std::optional<cv::Point2d> operator()(const Eigen::Vector3d& point) const;

 private:
  struct Parts;
  std::shared_ptr<const Parts> parts_;
};

/// Segments of the rim of what touches, in pixels: the edges that one triangle with all corners in contact has alone.
std::vector<std::pair<cv::Point2d, cv::Point2d>> contact_rim(const InspectedGel& gel, const GelView& view);

/// The picture (8 bit, grey or BGR; enlarged to at least 480 px a row) with, in colour: the rim of the contact and the
/// beads' centres, where `view` is given; the outline of `contact` (a mask of the picture's size, may be empty); the
/// object's origin as a cross; the force on the gel's plane as an arrow from there, of a length in proportion to the
/// force, and its three components in words.
cv::Mat draw_truth(const cv::Mat& picture, const InspectedSample& sample, const InspectedGel& gel,
                   const std::optional<GelView>& view, const cv::Mat& contact);

}  // namespace touchstone::datasets
