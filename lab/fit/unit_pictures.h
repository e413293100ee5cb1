#pragma once
// Recorded pictures as a fit compares them: means over blocks of pixels, with the imager's noise of each mean; and the
// same of simulated light.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "lab/fit/unit_fit_spec.h"
#include "render/imager/imager.h"

namespace touchstone::lab {

/// Numbers from 0 to 255 as a camera delivers them, of blocks of pixels: BGR or grey.
struct BlockPicture {
  std::string file;   ///< for messages
  int exposures = 1;  ///< that it is the mean of
  cv::Mat mean;       ///< CV_64FC(1 or 3)
  cv::Mat usable;     ///< CV_8UC(1 or 3), 255 where no pixel is nearly white or black
};

/// Reads a picture. @throws Error at `where`, naming the file, for another size or kind than the device's camera has,
/// or where more than a third of one colour is nearly white
BlockPicture read_block_picture(const std::filesystem::path& file, const sim::CameraSpec& camera, int block_px,
                                const SourceLocation& where);

/// The mean of several exposures of the same thing. @pre there is one, all of one size
BlockPicture mean_picture(const std::vector<BlockPicture>& pictures);

/// A picture in memory, as read_block_picture takes it from a file. @throws Error likewise
BlockPicture block_picture(const cv::Mat& picture, const std::string& name, const sim::CameraSpec& camera, int block_px,
                           const SourceLocation& where);

/// What the camera delivers of light (W/m^2 on the sensor, CV_32FC(bands) or CV_64FC(bands)) on average: along its tone
/// curve, without noise, rounding, saturation or JPEG. CV_64FC(1 or 3), in the light's size. With dark current.
cv::Mat mean_numbers(const cv::Mat& light, const render::Imager& imager);

/// One standard deviation, from pixel to pixel and exposure to exposure, of the mean over block_px^2 pixels that read
/// `numbers` (as mean_numbers): photons, reading, rounding, and the fixed pattern, which `exposures` don't average.
cv::Mat block_noise(const cv::Mat& numbers, const render::Imager& imager, int block_px, int exposures);

/// The device as it is simulated for the fit: its picture of blocks, without background and residual map, which would
/// make up for what is to be found.
sim::DeviceSpec with_block_camera(sim::DeviceSpec device, int block_px);

}  // namespace touchstone::lab
