#pragma once
// A recorded frame of the untouched unit (DeviceSpec::background) as light on the sensor: rims that are darker than the
// model's, scratches, an unevenly lit corner. It is no physics: what is missing in the model's own untouched picture
// is added to every picture, wherever the membrane is.

#include <opencv2/core/mat.hpp>

#include "render/imager/imager.h"

namespace touchstone::sim {

/// What is missing in the device's own light where nothing is pressed, linear numbers of 255 (colour_numbers.h),
/// CV_32FC3. `frame`: as DeviceSpec::background; where one of its numbers is 255, nothing is missing in light that is
/// as bright or brighter. @throws Error for a grey imager @pre of one size
cv::Mat missing_at_rest(const cv::Mat& frame, const cv::Mat& rest_light, const render::Imager& imager);

}  // namespace touchstone::sim
