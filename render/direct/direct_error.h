#pragma once
// How far direct pictures are from what they stand for, measured on some hundred pixels: for a plan that chooses.

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "render/direct/direct_renderer.h"
#include "render/direct/rest_light.h"

namespace touchstone::render {

/// How many pixels and paths the measurement takes.
struct DirectErrorSettings {
  int pixels = 400;    ///< looked at, one in each of as many fields of the picture
  int samples = 64;    ///< paths a pixel, twice; choose_direct takes four times as many where these aren't enough
  int max_depth = 16;  ///< RenderSettings::max_depth
  std::uint64_t seed = 0;
  /// What a picture (CV_32FC(bands)) is to whoever judges it, CV_32FC, for DirectChoice::seen_error: such as its
  /// electrons in units of their noise.
  std::function<cv::Mat(const cv::Mat&)> seen = {};
};

/// Parts of the picture's root mean square, each with its standard error.
struct DirectError {
  double rms = 0.0, rms_error = 0.0;    ///< root mean square difference
  double mean = 0.0, mean_error = 0.0;  ///< direct minus traced
  int pixels = 0;
};

/// What the root mean square difference isn't above, and not below, with two standard errors of its square, which is
/// what is measured: a difference that can't be distinguished from zero has a root whose own error says little.
double largest_rms(const DirectError& error);
/// What the root mean square difference isn't below, likewise: 0 where noise alone may explain the difference.
double smallest_rms(const DirectError& error);

/// A picture against path tracing of `scene`, all bands. The paths' own noise is not in the result: what is averaged is
/// the product of the differences from two renderings with independent numbers, whose noise has the mean zero.
/// @throws Error as Tracer, or if the picture isn't CV_32FC(bands) of the camera's size, or settings are out of range
DirectError measure_direct_error(const cv::Mat& picture, const Scene& scene, const Camera& camera,
                                 const DirectErrorSettings& settings = {});
/// The same of two pictures that are traced already (trace_twice), at the pixels that `mask` (CV_8UC1) has.
/// @pre all are CV_32F of one size and as many channels
DirectError direct_error_beside(const std::array<cv::Mat, 2>& traced, const cv::Mat& picture, const cv::Mat& mask);
/// The same in the pictures' own unit, not in parts of their root mean square.
DirectError plain_error_beside(const std::array<cv::Mat, 2>& traced, const cv::Mat& picture, const cv::Mat& mask);

/// A renderer that has been found good enough, or the reason why there's none.
struct DirectChoice {
  std::unique_ptr<DirectRenderer> renderer;  ///< null where direct light won't do; `reason` then says why
  std::string reason;
  DirectError error;  ///< of `first`, if it was drawn, with the last number of rays that was tried
  /// The same as DirectErrorSettings::seen has it, in its unit, where that is given: it decides then.
  std::optional<DirectError> seen_error;
  /// What DirectChoiceSettings::paths would leave, in the unit of the error that decides, where they are given and
  /// direct light isn't within the tolerance.
  std::optional<double> paths_noise;
  int samples = 0;  ///< the number of rays that was tried last, or is taken
  /// What the renderer was made of, for further ones that draw the same pictures: with the camera and `rest` without
  /// interreflection, and set_bounced_light with `rest`.
  LightField field;
  cv::Mat bounced;
};

/// What choose_direct may choose, and how accurate it has to be.
struct DirectChoiceSettings {
  double tolerance = 0.015;  ///< of the root mean square difference: what largest_rms may be, of the error that decides
  bool whatever = false;     ///< the error is measured, but any will do: of several numbers of rays the last
  /// A pixel, that are traced where direct light isn't chosen. Where nothing is within the tolerance but direct light
  /// is nearer than the noise of so many paths, it's chosen. 0: it isn't then.
  int paths = 0;
  DirectSettings direct;
  /// Rays a pixel that are tried in turn, in place of direct.samples, until the tolerance holds; empty: those alone.
  /// Light field and paths serve them all.
  std::vector<int> samples;
  GuideCut guides;
  double field_accuracy = 0.0;  ///< LightFieldSettings::accuracy; 0: half of the tolerance, 1e-4 to 1e-2
  double lit_radius = 0.0;      ///< LightFieldSettings::lit_radius
  DirectErrorSettings error;
  RestLightSettings rest;  ///< used where the scene asks for interreflection
};

/// Of the light field that choose_direct makes.
LightFieldSettings light_field_settings(const Scene& rest, const Eigen::AlignedBox3d& reach,
                                        const DirectChoiceSettings& settings);

/// Makes a renderer for the fixture of `rest` and measures it on `first`, a pressed state: the choice between direct
/// light and paths by measurement. Where the scene asks for interreflection, the bounced light of `rest` is carried
/// along. `reach` is the box that lit things stay in (LightField::reach).
/// @throws Error if scenes, camera or settings are faulty; what is merely unfit for direct light is in `reason`
DirectChoice choose_direct(const Scene& rest, const Scene& first, const Camera& camera,
                           const Eigen::AlignedBox3d& reach, const DirectChoiceSettings& settings = {});

}  // namespace touchstone::render
