#pragma once
// What a drawn data set holds of a sample, and where it comes from.

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "core/error.h"
#include "datasets/jobs/drawn_touch.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::datasets {

/// A sample as it was pressed and seen. Pictures have the camera's size; those that weren't asked for are empty.
struct BlockRecord {
  DrawnTouch touch;
  cv::Mat frame;                                                             ///< CV_8UC3 (BGR) or CV_8UC1
  cv::Mat height;                                                            ///< CV_32FC1, mm, as sim::Touch
  cv::Mat contact;                                                           ///< CV_8UC1, as sim::Touch
  Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();  ///< on the object: N, N mm, gel frame
  Eigen::Vector3d force_error_N = Eigen::Vector3d::Zero();                   ///< one standard error, from the mesh
  Eigen::Matrix<double, 3, 4> pose = Eigen::Matrix<double, 3, 4>::Zero();    ///< gel_from_object: rotation, mm
  double contact_area_mm2 = 0.0;
  double deepest_mm = 0.0;  ///< that the surface is pressed in
  double largest_strain = 0.0;
  bool under_resolved = false;  ///< see fem::PressState
};

/// A touch that mechanics or light can't do: beside the gel, too deep, a shear that friction can't hold.
class Unpressable : public Error {
 public:
  using Error::Error;
};

/// A unit on its bench. `press` is a pure function of the unit, the touch and the object, and may be called from many
/// threads at once. @throws Unpressable; the sample is then drawn again. Other errors end the run
struct UnitBench {
  std::string light;   ///< how its pictures are lit, and how far that is off
  cv::Mat background;  ///< its frame untouched, as `frame`; with the imager's noise
  std::function<BlockRecord(const DrawnTouch& touch, const sim::ObjectSpec& object)> press;
};

/// What a drawn data set's samples come from: the simulator, or in tests something quicker.
using BenchSource = std::function<UnitBench(const PreparedDraw& prepared, const DrawnUnit& unit)>;

/// How a unit's sensor is set up. Its light isn't kept (sim::VirtualSensorSettings::light_key).
sim::VirtualSensorSettings drawn_sensor_settings(const PreparedDraw& prepared, const DrawnUnit& unit);

/// sim::VirtualSensor, with set-up results kept in `cache_folder`.
BenchSource rig_bench(const std::filesystem::path& cache_folder);

}  // namespace touchstone::datasets
