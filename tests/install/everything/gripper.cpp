#include "gripper.h"

#include <core/error.h>
#include <sim/files/image_file.h>
#include <sim/press/gel_setup.h>
#include <sim/sensor/virtual_sensor.h>

#include <opencv2/core.hpp>

using namespace touchstone;

double grip(const std::string& device_file, const std::string& object_file, double force_N,
            const std::string& picture) {
  const sim::VirtualSensor sensor(sim::read_device(device_file), sim::default_cache_folder());
  const sim::Touch touch = sensor.press(sim::read_object(object_file), {.force_N = force_N});
  sim::write_png(picture, touch.frame);
  if (cv::norm(sim::read_image(picture), touch.frame, cv::NORM_INF) != 0.0) fail("{}: isn't the frame", picture);
  if (cv::norm(touch.frame, touch.background, cv::NORM_INF) < 20.0) fail("{}: the press can't be seen", picture);
  return touch.force_N().z();
}
