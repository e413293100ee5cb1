#pragma once
// The light that the reflex fingertip's skin sends to the chip behind it.
//
// Nothing in the fingertip casts shadows and its walls are black, so the light is direct light with the little that
// bounces off the skin at rest (render/direct/direct_renderer.h), on a grid finer than the chip's pixels. It is smooth
// in the skin's motion: what lies between two near states is a line to a fraction of a number. Whose skin it is doesn't
// matter: any sheet whose vertices have the rest's triangles, from finite presses or linear ones.

#include <memory>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

#include "fem/contact/press.h"
#include "fem/finite_strain/finite_gel.h"
#include "render/direct/direct_error.h"
#include "render/paths/path_tracer.h"
#include "sim/plan/scene_bands.h"
#include "sim/scene/device.h"
#include "sim/view/visible_gel.h"

namespace touchstone::lab {

/// How finely the chip's pixels are sampled.
struct ReflexLightSettings {
  double lamp_level = 1.0;  ///< of the lamps' power; 0: they're off
  /// A pixel is cut into side x side, 1 to 16. With 8 the lens's blur is just below 4 of them, up to where rims of dots
  /// get 16 rays a part (DirectSettings::edge_side): 0.5 to 1.2 % off path tracing (root mean square). Of 4 and of 16,
  /// it's 2 %, and less smooth.
  int side = 8;
  /// Through each of them, 1 to 64. With 1 the lens's blur is that of the skin at rest. More sample pixel and lens, at
  /// many times the cost: 64 through 4x4 parts come as near to path tracing as 1 through 8x8.
  int rays = 1;
  std::uint64_t seed = 1;  ///< of the rays
};

/// A finite gel's skin for cameras.
sim::VisibleGel visible_skin(const fem::FiniteGel& gel, const fem::GelBody& body);

/// The skin of a press, laid onto what presses it.
sim::GelSheet skin_sheet(const sim::VisibleGel& skin, const fem::PressState& press, const fem::ContactShape& object);

/// A device's pictures of its skin. Pure functions of the constructor's arguments and theirs; safe to use from many
/// threads.
class ReflexLight {
 public:
  /// `rest` is the skin that nothing presses; `reached` are skins that go as far as any that will be looked at, the
  /// first of which the light's error is measured on.
  /// @throws Error for a device without coating or camera, or that direct light can't draw
  ReflexLight(const sim::DeviceSpec& device, const sim::GelSheet& rest, std::span<const sim::GelSheet> reached,
              const ReflexLightSettings& settings = {});
  ~ReflexLight();
  ReflexLight(ReflexLight&&) noexcept;

  /// As it was given.
  const sim::DeviceSpec& device() const;
  /// The scene's bands, in the order of the pictures' channels.
  const sim::SceneBands& bands() const;
  /// Against path tracing, in the parts of pixels that are drawn.
  const render::DirectError& error() const;

  /// Irradiance on the sensor, W/m^2, CV_32FC(bands) of the camera's size.
  /// @throws Error for a skin beyond those that were reached
  cv::Mat irradiance(const sim::GelSheet& skin) const;
  /// The same by path tracing, of so many paths a pixel.
  cv::Mat traced(const sim::GelSheet& skin, int paths, std::uint64_t seed) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::lab
