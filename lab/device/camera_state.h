#pragma once
// What a virtual camera shows at one time.

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "core/transform.h"

namespace touchstone::lab {

/// One state of what is shown. Forces are on the (first) object, gel frame.
struct CameraState {
  std::string what;       ///< in words
  int frame = 0;          ///< of the scene; 0 of a device
  std::int64_t t_us = 0;  ///< in the scene's time
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_error_N = Eigen::Vector3d::Zero();  ///< one standard error, from the mesh
  Eigen::Vector3d torque_Nmm = Eigen::Vector3d::Zero();
  std::optional<RigidTransform> gel_from_object;  ///< none of an untouched device
  double contact_area_mm2 = 0.0;
  std::function<cv::Mat(std::uint64_t noise_seed)> expose;
};

/// One line of JSON: what, scene_frame, t_us, force_N, force_error_N, torque_Nmm, gel_from_object (3 rows of 4, or
/// null), contact_area_mm2; `more` (JSON members, "\"a\": 1, ") stands before them.
std::string to_json(const CameraState& state, const std::string& more = "");

}  // namespace touchstone::lab
