#pragma once
// What the reflex fingertip's chip reports while its skin moves: pictures at some states of a motion, between which the
// light runs straight, shown to the chip frame by frame.

#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "core/motion_chip.h"
#include "core/pixel_grab.h"
#include "render/imager/motion_chip.h"

namespace touchstone::lab {

/// How finely the path is cut into pictures.
struct ReflexPathLightSettings {
  /// How far the light of any pixel between two pictures may be off, in parts of the light that makes the largest
  /// number at the longest exposure; what a step of 6 bits is, is 1/63.
  double allowed = 0.4 / 63;
  double least_step = 1e-3;  ///< states nearer to each other than this aren't refined
  int most_pictures = 2000;
};

/// The light of all states of a motion that one parameter describes: how deep a plate is, how far along a path.
class ReflexPathLight {
 public:
  /// A state's irradiance, CV_32FC1, 18x18, W/m^2.
  using Picture = std::function<cv::Mat(double parameter)>;

  /// Makes pictures at `corners` (rising, at least two: where the motion has its states, or its course corners), and
  /// between them until the one in the middle of two is off by the allowed at most; that one is then taken as well.
  /// @throws Error for corners that don't rise, pictures that the chip couldn't be shown, or more than most_pictures
  ReflexPathLight(const Picture& picture, std::span<const double> corners, const render::MotionChipSettings& chip,
                  const ReflexPathLightSettings& settings = {});

  const std::vector<double>& parameters() const { return parameters_; }
  /// The largest difference that was found between a picture and the straight line at its place, where it was within
  /// the allowed; in parts as ReflexPathLightSettings::allowed. An estimate from above of twice what is left in
  /// between: that picture was taken, and a curve's distance from its chord falls to a quarter when it's halved.
  double largest_off() const { return largest_off_; }
  /// Outside of the parameters the nearest picture. Fills `light`.
  void light_at(double parameter, cv::Mat& light) const;

 private:
  std::vector<double> parameters_;
  std::vector<cv::Mat> pictures_;
  double largest_off_ = 0.0;
};

/// The parameter at a time, s.
using ReflexMotion = std::function<double(double t_s)>;

/// The statistics of the chip's next frames; one in `every`, the last of as many. Frames are made all the same.
std::vector<ChipStatistics> record_statistics(const ReflexPathLight& path_light, const ReflexMotion& motion,
                                              render::MotionChip& chip, int frames, int every = 1);

/// Pictures as they're got out of the chip, a pixel a frame.
std::vector<GrabbedImage> record_images(const ReflexPathLight& path_light, const ReflexMotion& motion,
                                        render::MotionChip& chip, int images);

}  // namespace touchstone::lab
