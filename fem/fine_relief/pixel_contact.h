#pragma once
// Frictionless unilateral contact of a rigid relief with an elastic layer, pixel by pixel.

#include <optional>
#include <span>
#include <vector>

#include "fem/fine_relief/layer_response.h"

namespace touchstone::fem {

/// What presses on the layer, and how hard: `force` (N), or nothing: the relief stays where `gap` has it.
struct PixelContact {
  std::span<const double> gap;  ///< mm per pixel, from the undeformed face up to the body; infinity: no body there
  std::optional<double> force;
  /// By pixel, above 0: how far the gap opens, and how much the force does, when the body moves by one mm. Empty: 1.
  std::span<const double> share = {};
};

/// When the answer is good enough.
struct PixelTolerance {
  double gap_mm = 2e-5;  ///< the largest |gap| where there is pressure, and the deepest overlap where there is none
  int most_iterations = 1000;
};

/// Pressure p >= 0 and gap g >= 0, not both above zero anywhere: g = gap + share * shift + displacement.
struct PixelContactAnswer {
  std::vector<double> pressure;      ///< MPa
  std::vector<double> displacement;  ///< mm, into the layer
  double shift = 0.0;                ///< mm, how far the body moved away from the layer to meet the force
  double force = 0.0;                ///< N, the pressure's sum
  double force_residual = 0.0;       ///< N, the wanted force less its own
  double largest_gap = 0.0;          ///< mm, the largest |g| where p > 0
  double largest_overlap = 0.0;      ///< mm, the largest -g where p = 0
  int pixels_in_contact = 0;
  int iterations = 0;
  int applications = 0;    ///< of the layer's response
  bool converged = false;  ///< to the tolerance; if not, the best there is after `most_iterations`
};

/// Constrained conjugate gradients after [Polonsky1999], preconditioned by the layer's inverse wave by wave, which
/// takes the iterations from some 250 to 10 and makes them independent of the pixel; pixels that overlap take part in a
/// step before they have pressure [Vollebregt2014]. `start` may hold a pressure to begin with (one a pixel, e.g. the
/// answer of the frame before); where it is empty, free grids begin with the answer on pixels of twice the width, and
/// that so on. The same input gives the same bytes.
/// @throws Error for NaN in the gap or the start, a share that isn't above zero and finite, a gap of minus infinity, a
/// force that isn't finite or is below zero, and a force above zero where no pixel has a body over it
PixelContactAnswer solve_pixel_contact(const LayerResponse& layer, const PixelContact& contact,
                                       const PixelTolerance& tolerance = {}, std::span<const double> start = {});

}  // namespace touchstone::fem
