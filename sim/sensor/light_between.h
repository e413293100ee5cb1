#pragma once
// Light between states, fast: a coated gel's picture is drawn in full at some states, and moved to those between them.

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "sim/plan/plan.h"
#include "sim/sensor/direct_light.h"
#include "sim/view/scene_view.h"

namespace touchstone::sim {

/// What the pictures of a LightBetween took, and how far off they were found to be.
struct LightBetweenReport {
  std::int64_t keys = 0;      ///< states drawn in full
  std::int64_t pictures = 0;  ///< of states, moved from one key or two
  /// Where a key is made its picture is known two ways: drawn, and moved from the key before. Logarithms of the light.
  double worst_rms = 0.0;  ///< over the pixels, of the key that was worst
};

/// Why a scene's light can't be had so; empty if it can.
std::string unfit_for_light_between(const SceneSpec& scene, const Plan& plan);

/// By what a scene's states are drawn in full, and how irradiance (CV_32FC(bands), W/m^2) becomes electrons a second
/// (CV_32FC1, whose memory is used again).
struct LightOfKeys {
  const SceneView& view;
  const DirectLight& direct;
  std::function<void(const cv::Mat& irradiance, cv::Mat& currents)> currents;
};

/// Goes from each state that is played to the next in steps in which nothing moves by more than kMovedStep_px in the
/// picture, or of a microsecond; in between all is straight (state_between).
///
/// The first state is a key. Later ones show its points moved (render/direct/sheet_between.h). A state to which
/// something moves by more than the scene's event_reach_px, or whose slope changes by more than kReachSlope, becomes
/// the next key; between two keys pictures go over from the one, moved on, to the other, moved back, so that none
/// jumps. Where a motion stays near its key, as a small vibration does, there is no other; to the last eight keys it
/// may come back.
///
/// The same pictures for any number of threads. Keeps up to kMostWaiting pictures until it is known which key is next.
class LightBetween {
 public:
  static constexpr double kMovedStep_px = 0.2;
  static constexpr double kReachSlope = 0.1;
  static constexpr int kMostWaiting = 48;

  /// Takes the pictures of the states in their order: electrons a second, CV_32FC1.
  using Show = std::function<void(std::int64_t t_us, const cv::Mat& photocurrent)>;

  /// What `light` refers to must outlive this. With a reach of 0 each state is a key.
  /// @pre light.direct.has_points(); the scene is fit (unfit_for_light_between)
  LightBetween(LightOfKeys light, const fem::Compliance& gel, Show show);
  ~LightBetween();

  /// The first state, or what is seen after the last one until this. @throws Error where direct light doesn't reach
  void add(std::int64_t t_us, const fem::PressState& press);
  /// After the last state.
  void finish();

  const LightBetweenReport& report() const;  ///< of the states so far

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::sim
