#pragma once
// Pictures of a moving scene whose Monte-Carlo noise stands still: what event pixels need, which read differences.

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "render/events/event_pixels.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"
#include "sim/sensor/direct_light.h"

namespace touchstone::sim {

/// One picture of a sequence.
struct SequencePicture {
  cv::Mat photocurrent;      ///< CV_32FC1, electrons a second
  cv::Mat log_photocurrent;  ///< CV_32FC1, natural, with the event pixels' dark current
  std::int64_t pixels_traced = 0;
  std::int64_t paths_traced = 0;

  // When each pixel was traced: what it looked like without noise then (CV_32FC(channels), logarithms) and how far the
  // image had moved (CV_64FC1, pixels since the sequence's begin).
  cv::Mat preview;
  cv::Mat traced_at_px;
  double moved_px = 0.0;
};

/// The light on a camera's pixels at the states of a press. By direct light, where the plan has it and it is near
/// enough to path tracing: all of each picture, which has no noise. Else by paths. Every pixel of every picture gets
/// the same number of paths, `light.max_samples`, made of the same random numbers: what doesn't move keeps its value to
/// the bit, what moves changes by what the same paths see. (A count that follows the noise would differ from picture to
/// picture, and with it the noise.) So a picture doesn't depend on those before it, but for pixels that are left alone:
/// those whose light can be expected to have changed by under a twentieth of the smallest threshold since they were
/// traced, by a preview without noise and by the contrast around them times the motion.
class LightSequence {
 public:
  /// @param smallest_threshold of the event pixels
  /// @param direct of this scene, its choice being direct; null: paths
  /// @pre the plan has a camera, which has event pixels
  LightSequence(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, double smallest_threshold,
                std::shared_ptr<const DirectLight> direct = nullptr);
  ~LightSequence();

  /// Of the camera, px.
  cv::Size size() const;
  /// How far the image moves between two states, pixels (sim/plan/image_motion.h).
  double motion(const fem::PressState& from, const fem::PressState& to) const;

  /// What is seen of the scene, and by which direct light (null: paths).
  const SceneView& view() const;
  const DirectLight* direct() const;  ///< likewise
  /// What irradiance frees in each pixel, CV_32FC1, electrons a second; the argument's memory is used again.
  void pixel_currents(const cv::Mat& irradiance, cv::Mat& currents) const;

  /// The first picture: all pixels are traced. @throws Error, as `next` does, where direct light doesn't reach
  SequencePicture first(const fem::PressState& press) const;
  /// A later one, `moved_px` of image motion after `before`.
  SequencePicture next(const SequencePicture& before, const fem::PressState& press, double moved_px) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace touchstone::sim
