#pragma once
// What a drawn data set holds of a sample, and where it comes from.

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/frame.h"
#include "core/motion_chip.h"
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
  Eigen::MatrixX3d beads_mm;    ///< displacements, a row a bead, marker or vertex
  Eigen::MatrixX3d markers_mm;
  Eigen::MatrixX3d traction_MPa;
  std::vector<Event> events;
  ChipStatistics statistics;
};

/// A touch that mechanics or light can't do: beside the gel, too deep, a shear that friction can't hold.
class Unpressable : public Error {
 public:
  /// The reason in words, as of any Error.
  using Error::Error;
};

/// A unit set up for pressing. `press` is a pure function of the unit, the touch and the object, and may be called from
/// many threads at once. @throws Unpressable; the sample is then drawn again. Other errors end the run
struct UnitSensor {
  std::string light;   ///< how its pictures are lit, and how far that is off
  cv::Mat background;  ///< its frame untouched, as `frame`; with the imager's noise; empty where no picture is wanted
  Eigen::MatrixX3d bead_places_mm, marker_places_mm, gel_vertices_mm;  ///< at rest, of those that are wanted
  std::function<BlockRecord(const DrawnTouch& touch, const sim::ObjectSpec& object)> press;
};

/// What a drawn data set's samples come from: the simulator, or in tests something quicker.
using SensorSource = std::function<UnitSensor(const PreparedDraw& prepared, const DrawnUnit& unit)>;

/// How a unit's sensor is set up. Its light isn't kept (sim::VirtualSensorSettings::light_key).
sim::VirtualSensorSettings drawn_sensor_settings(const PreparedDraw& prepared, const DrawnUnit& unit);

/// sim::VirtualSensor, with set-up results kept in `cache_folder`.
SensorSource virtual_sensors(const std::filesystem::path& cache_folder);

}  // namespace touchstone::datasets
