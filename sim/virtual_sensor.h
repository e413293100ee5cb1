#pragma once
// The way from a scene to frames and truth.

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/progress.h"
#include "fem/compliance.h"
#include "fem/press.h"
#include "fem/press_error.h"
#include "fem/vibration.h"
#include "render/direct_error.h"
#include "sim/elastic_object.h"
#include "sim/image_file.h"
#include "sim/plan.h"
#include "sim/scene.h"

namespace touchstone::sim {

/// A state some time after a frame's begin.
struct LaterState {
  double after_s = 0.0;
  std::shared_ptr<const fem::PressState> press;
};

/// What is true at one frame, at the begin of its exposure.
struct Truth {
  int frame = 0;
  std::int64_t t_us = 0;
  fem::PressState press;
  fem::PressError error;          ///< what the mesh makes of it
  std::vector<LaterState> later;  ///< where the plan has motion blur or a rolling shutter: the states on from there,
                                  ///< in order, to the first at or after the exposure's end or the motion's end
};

/// The one whose gel is pressed deepest. @pre there is one
const Truth& deepest(std::span<const Truth> truths);

/// How a camera's light is computed, and why.
struct LightChoice {
  bool direct = false;                       ///< from a light field (render/direct_renderer.h); else by path tracing
  std::string reason;                        ///< for people
  std::optional<render::DirectError> error;  ///< of direct light, where it was measured
};

/// What a camera makes of one Truth. Pictures that weren't asked for are empty.
struct Capture {
  cv::Mat frame;            ///< 8 bit BGR or grey, with noise as planned
  cv::Mat ideal;            ///< the same without noise
  cv::Mat radiance;         ///< CV_32FC(bands), W/m^2 on the sensor in each of Plan::bands
  cv::Mat height;           ///< CV_32FC1, mm: the membrane, see sim/membrane.h
  LinearImage pixel_truth;  ///< the layers of sim/pixel_truth.h that were asked for
  std::int64_t paths_traced = 0;
  std::int64_t pixels_traced = 0;
  bool direct = false;  ///< the light is direct light from a light field
  std::string light;    ///< where the plan has direct light: how this picture is lit and why, for people
};

/// Where set-up results are kept between runs: $TOUCHSTONE_CACHE, else $XDG_CACHE_HOME/touchstone, else
/// ~/.cache/touchstone.
std::filesystem::path default_cache_folder();

/// A device set up for pressing. Set-up is shared by all scenes with the same gel, mesh and beads.
std::shared_ptr<const fem::Compliance> set_up_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                                                  const Progress& progress = {});

/// The modes of the device's gel, where the plan wants inertia for a motion that vibrates; else nothing.
std::shared_ptr<const fem::GelVibration> set_up_vibration(const SceneSpec& scene, const Plan& plan,
                                                          const std::filesystem::path& cache_folder);

/// Plays a scene's motion from its start: one Truth a frame. Sequential, because friction and relaxation remember.
/// `vibration` is what set_up_vibration gives; without it vibrations are quasi-static: with it, over a key that
/// vibrates, the steady answer of the gel to a body that sticks where it touches is added to the press of the mean
/// motion. `elastic` is what set_up_elastic_objects gives.
/// @throws Error if a wanted force can't be met or the press leaves what the model can do
std::vector<Truth> play_motion(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                               const Progress& progress = {}, const fem::GelVibration* vibration = nullptr,
                               const std::vector<std::shared_ptr<const fem::Compliance>>& elastic = {});

/// The camera of a scene. Where the plan has direct light, the constructor measures whether it holds the scene's
/// tolerance; if so, pictures are made with it, but for those of a gel that went beyond where it was looked for. Else
/// the constructor renders the first frame well, and each capture traces again only the pixels that changed. `capture`
/// is a pure function of its argument and the constructor's and may be called from several threads.
class VirtualCamera {
 public:
  /// `truths` are the scene's, or those of it that pictures are made of: the first one is where the light of later
  /// frames is taken from, and the deepest one is what direct light is judged by. Of none, all pictures are whole.
  /// @throws Error with the scene's place if the scene switches direct light on and it can't be had
  VirtualCamera(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, std::span<const Truth> truths);
  /// For a scene of a single state, or one whose further ones aren't known.
  VirtualCamera(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, const Truth& first)
      : VirtualCamera(scene, plan, gel, std::span<const Truth>(&first, 1)) {}
  ~VirtualCamera();
  const LightChoice& light_choice() const;
  Capture capture(const Truth& truth) const;
  /// The same without the short cut: every pixel is traced.
  Capture capture_whole(const Truth& truth) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace touchstone::sim
