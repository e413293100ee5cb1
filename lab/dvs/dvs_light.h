#pragma once
// The light that a grasp of lab/dvs/dvs_grasps.h puts on the event camera's pixels.
//
// What the membrane shows depends on the finger's travel alone (sim/grasp/gripped_face.h), and to and fro it passes the
// same travels. So a grasp's light is pictures at some travels, the logarithm running straight between two: as many as
// bring that near to pictures made in between.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <utility>
#include <vector>

#include "lab/dvs/dvs_grasps.h"
#include "render/events/event_pixels.h"
#include "render/membrane/face_state.h"
#include "sim/sensor/membrane_camera.h"

namespace touchstone::lab {

/// What stands before the membrane when the finger is at a travel. @throws Error as sim::GrippedFace::at_travel
render::FaceState dvs_face(const DvsGraspSetup& setup, const sim::MembraneCamera& camera, const DvsGrasp& grasp,
                           double travel_mm);

/// Of any travel that a grasp's finger makes. Immutable.
class DvsTravelLight {
 public:
  /// Refines until a picture in the middle between two is off by `allowed` at most, in any pixel's natural logarithm of
  /// the photocurrent (plus `pixels`' dark one); that picture is then taken as well.
  /// @throws Error as dvs_face and render::log_intensity
  DvsTravelLight(const DvsGraspSetup& setup, const sim::MembraneCamera& camera, const DvsGrasp& grasp,
                 const render::EventPixelSettings& pixels, double allowed);

  /// The travels of the pictures that were made, mm, rising; at least two.
  const std::vector<double>& travels_mm() const { return travels_; }
  /// Grows with the travel, at least by as much as any pixel's logarithm changes.
  double path_at(double travel_mm) const;
  /// CV_32FC1, logarithms.
  cv::Mat log_at(double travel_mm) const;
  /// CV_32FC1, electrons a second.
  cv::Mat photocurrent_at(double travel_mm) const;

 private:
  std::pair<std::size_t, double> place_of(double travel_mm) const;

  double dark_;
  std::vector<double> travels_;
  std::vector<cv::Mat> logs_;
  std::vector<double> path_;
};

}  // namespace touchstone::lab
