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
  /// Pixels, centres at + 0.5.
  std::optional<cv::Point2d> operator()(const Eigen::Vector3d& point) const;
  /// How far a bead about `centre` reaches in the picture, px: nothing if the camera doesn't see it or has no beads.
  std::optional<double> bead_radius_px(const Eigen::Vector3d& centre) const;

 private:
  struct Parts;
  std::shared_ptr<const Parts> parts_;
};

/// Segments of the rim of what touches, in pixels. Between a vertex that touches and one that doesn't the rim is
/// halfway: it's known to half an edge.
std::vector<std::pair<cv::Point2d, cv::Point2d>> contact_rim(const InspectedGel& gel, const GelView& view);

/// The point of the gel's displaced surface below or above `place`; of the undeformed plane z = 0 where there is none.
Eigen::Vector3d surface_point(const InspectedGel& gel, const Eigen::Vector2d& place);

/// The picture (8 bit, grey or BGR; enlarged to at least 480 px a row) with, in colour: the rim of the contact, that of
/// `contact` (a mask of the picture's size, may be empty) but where beads hide it, else contact_rim; the beads' centres
/// as circles; the gel's surface at the object's origin as a cross; the force along the gel as an arrow from there, of
/// `arrow_px_per_N` of the enlarged picture's pixels a newton, and the force's three components in words. Where things
/// appear is only known with `view`: without it there are the mask's rim and the words alone.
cv::Mat draw_truth(const cv::Mat& picture, const InspectedSample& sample, const InspectedGel& gel,
                   const std::optional<GelView>& view, const cv::Mat& contact, double arrow_px_per_N);

/// How long arrows may be, so that the largest of these forces along the gel fills a quarter of a small picture's width
/// and forces that are next to nothing stay so.
double arrow_scale_px_per_N(const std::vector<InspectedSample>& samples);

}  // namespace touchstone::datasets
