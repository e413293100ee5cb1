#pragma once
// Light between states, fast: a coated gel's picture is drawn in full at some states, and moved to those between them.

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "sim/plan/image_motion.h"
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
  double mean_rms = 0.0;   ///< of all but the first, root of the mean square
};

/// Why a scene's light can't be had so; empty if it can.
std::string unfit_for_light_between(const SceneSpec& scene, const Plan& plan);

inline constexpr double kMovedStep_px = 0.2;

/// Goes from state to state in steps in which nothing moves by more than kMovedStep_px in the picture, or of a
/// microsecond; in between all is straight (state_between).
class MovedSteps {
 public:
  /// @pre the device has a camera
  explicit MovedSteps(const SceneSpec& scene);

  using Visit = std::function<void(std::int64_t t_us, const fem::PressState& press)>;
  /// Visits what lies between the last state and this one, and this one.
  void go(std::int64_t t_us, const fem::PressState& press, const Visit& visit);

 private:
  ImageScale scale_;
  double object_radius_mm_;
  std::optional<std::pair<std::int64_t, fem::PressState>> last_;
};

/// By what a scene's states are drawn in full, and how irradiance (CV_32FC(bands), W/m^2) becomes electrons a second
/// (CV_32FC1, whose memory is used again).
struct LightOfKeys {
  const SceneView& view;
  const DirectLight& direct;
  std::function<void(const cv::Mat& irradiance, cv::Mat& currents)> currents;
};

/// The first state is a key. Later ones show its points moved (render/direct/sheet_between.h). A state to which
/// something moves by more than `reach_px` in the picture, or whose slope changes by more than kReachSlope, becomes the
/// next key; between two keys pictures go over from the one, moved on, to the other, moved back, so that none jumps.
/// Where a motion stays near its key, as a small vibration does, there is no other; to the last eight keys it may come
/// back.
///
/// The same pictures for any number of threads. Keeps up to kMostWaiting pictures until it is known which key is next.
class LightBetween {
 public:
  static constexpr double kReachSlope = 0.1;
  static constexpr int kMostWaiting = 48;

  /// Takes the pictures of the states in their order: electrons a second, CV_32FC1.
  using Show = std::function<void(std::int64_t t_us, const cv::Mat& photocurrent)>;

  /// What `light` refers to must outlive this. With a reach of 0 each state is a key.
  /// @pre light.direct.has_points(); the scene is fit (unfit_for_light_between)
  LightBetween(LightOfKeys light, const fem::Compliance& gel, double reach_px, Show show);
  ~LightBetween();

  /// A later state. @throws Error where direct light doesn't reach
  void add(std::int64_t t_us, const fem::PressState& press);
  /// After the last state.
  void finish();

  const LightBetweenReport& report() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::sim
