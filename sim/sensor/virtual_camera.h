#pragma once
// The camera of a scene: from truth to pictures.

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>

#include "render/direct/direct_error.h"
#include "render/imager/automatic_control.h"
#include "sim/files/image_file.h"
#include "sim/plan/plan.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// How a camera's light is computed, and why.
struct LightChoice {
  bool direct = false;  ///< from a light field (render/direct/direct_renderer.h); else as `reason` says
  std::string reason;   ///< for people
  std::optional<render::DirectError> error;  ///< of what isn't path tracing, where it was measured
};

/// What a camera makes of one Truth. Pictures that weren't asked for are empty.
struct Capture {
  cv::Mat frame;            ///< 8 bit BGR or grey, with noise as planned
  cv::Mat ideal;            ///< the same without noise
  cv::Mat radiance;         ///< CV_32FC(bands), W/m^2 on the sensor in each of Plan::bands
  cv::Mat height;           ///< CV_32FC1, mm: the membrane, see sim/view/membrane.h
  LinearImage pixel_truth;  ///< the layers of sim/view/pixel_truth.h that were asked for
  std::int64_t paths_traced = 0;
  std::int64_t pixels_traced = 0;
  bool direct = false;           ///< the light is direct light from a light field
  std::string light;             ///< where the plan has direct light: how this picture is lit and why, for people
  render::ControlState control;  ///< how the camera has set itself for the frame (render/imager/automatic_control.h)
};

/// The camera of a scene. Where the plan has direct light, the constructor measures whether it holds the scene's
/// tolerance; if so, pictures are made with it, but for those of a gel that went beyond where it was looked for. Else
/// the constructor renders the first frame well, and each capture traces again only the pixels that changed. `capture`
/// is a pure function of its argument and the constructor's and may be called from several threads.
///
/// A camera that sets itself (auto exposure, auto white balance) carries its state from frame to frame. The constructor
/// meters a preview of each of `truths`, goes through them in the order of time, and keeps the state of each: so
/// pictures may be made in any order, on any machine, and a run that goes on after a stop makes the same ones. It has
/// watched the first state for long. A state that isn't among them is shown as if it had been watched for long.
class VirtualCamera {
 public:
  /// `truths` are the scene's, or those of it that pictures are made of, in the order of time: the first one is where
  /// the light of later frames is taken from, and the deepest one is what direct light is judged by. Of none, all
  /// pictures are whole. Of a camera that sets itself, they are all of the motion's up to the last that is wanted.
  /// @throws Error with the scene's place if the scene switches direct light on and it can't be had
  VirtualCamera(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, std::span<const Truth> truths);
  /// For a scene of a single state, or one whose further ones aren't known.
  VirtualCamera(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, const Truth& first)
      : VirtualCamera(scene, plan, gel, std::span<const Truth>(&first, 1)) {}
  ~VirtualCamera();
  /// How its pictures are lit, and why so.
  const LightChoice& light_choice() const;
  /// The picture of one state. A pure function of the constructor's arguments and the state.
  Capture capture(const Truth& truth) const;
  /// The same without the short cut: every pixel is traced.
  Capture capture_whole(const Truth& truth) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace touchstone::sim
