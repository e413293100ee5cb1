#pragma once
// The way from a scene to frames and truth.

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/progress.h"
#include "fem/compliance.h"
#include "fem/press.h"
#include "fem/press_error.h"
#include "sim/plan.h"
#include "sim/scene.h"

namespace touchstone::sim {

/// What is true at one frame.
struct Truth {
  int frame = 0;
  std::int64_t t_us = 0;
  fem::PressState press;
  fem::PressError error;  ///< what the mesh makes of it
};

/// What a camera makes of one Truth. Pictures that weren't asked for are empty.
struct Capture {
  cv::Mat frame;     ///< 8 bit BGR or grey, with noise as planned
  cv::Mat ideal;     ///< the same without noise
  cv::Mat radiance;  ///< CV_32FC3 (red, green, blue bands), W/m^2 on the sensor
  std::int64_t paths_traced = 0;
  std::int64_t pixels_traced = 0;
};

/// Where set-up results are kept between runs: $TOUCHSTONE_CACHE, else $XDG_CACHE_HOME/touchstone, else
/// ~/.cache/touchstone.
std::filesystem::path default_cache_folder();

/// A device set up for pressing. Set-up is shared by all scenes with the same gel, mesh and beads.
std::shared_ptr<const fem::Compliance> set_up_gel(const DeviceSpec& device, const std::filesystem::path& cache_folder,
                                                  const Progress& progress = {});

/// Plays a scene's motion from its start: one Truth a frame. Sequential, because friction remembers.
/// @throws Error if a wanted force can't be met or the press leaves what the model can do
std::vector<Truth> play_motion(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                               const Progress& progress = {});

/// The camera of a scene. Its constructor renders the first frame well; each capture traces again only the pixels that
/// changed. `capture` is a pure function of its arguments and may be called from several threads.
class VirtualCamera {
 public:
  VirtualCamera(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel, const Truth& first);
  ~VirtualCamera();
  Capture capture(const Truth& truth) const;
  /// The same without the short cut: every pixel is traced.
  Capture capture_whole(const Truth& truth) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace touchstone::sim
