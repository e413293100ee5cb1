#include "render/materials/layer_connection.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::render {

bool solve_layer_path(std::span<const Layer> layers, double lateral, LayerPath& path) {
  const int count = static_cast<int>(layers.size());
  TS_ASSERT(count > 0 && count <= kMaxLayers);

  // The least index among layers that have any thickness: the only one whose angle may reach 90 degrees.
  double least = 0.0;
  for (const Layer& layer : layers) {
    if (layer.thickness > 0.0 && (least == 0.0 || layer.index < least)) least = layer.index;
  }
  if (least == 0.0) return false;

  double reach_slope[kMaxLayers];  // thickness times ratio: what the layer adds to the slope at t = 0
  double ratio[kMaxLayers];        // least index to the layer's
  double bend[kMaxLayers];         // 1 - ratio^2
  double slope_at_zero = 0.0;
  double slope_far_out = 0.0;  // for large t the curve nears the line slope_far_out t + limit from below
  double limit = 0.0;
  for (int k = 0; k < count; ++k) {
    ratio[k] = least / layers[k].index;
    bend[k] = 1.0 - ratio[k] * ratio[k];
    reach_slope[k] = layers[k].thickness * ratio[k];
    slope_at_zero += reach_slope[k];
    if (bend[k] > 1e-6) {
      limit += reach_slope[k] / std::sqrt(bend[k]);
    } else if (bend[k] > -1e-6) {
      slope_far_out += reach_slope[k];
    }
  }

  constexpr int kMostSteps = 100;  // a very thin layer of least index needs some 40
  // Newton's first steps from 0 and from far out; the curve is concave, so both end before the root.
  double t = lateral / slope_at_zero;
  if (lateral > limit) t = std::max(t, (lateral - limit) / slope_far_out);
  for (int step = 0;; ++step) {
    double reach_per_t = 0.0;
    double slope = 0.0;
    double turn = 0.0;  // the second derivative is -3 t times this
    for (int k = 0; k < count; ++k) {
      const double stretch2 = 1.0 / (1.0 + bend[k] * t * t);
      const double rate = reach_slope[k] * std::sqrt(stretch2);
      const double rate3 = rate * stretch2;
      reach_per_t += rate;
      slope += rate3;
      turn += rate3 * stretch2 * bend[k];
    }
    const double rest = lateral - reach_per_t * t;
    // Halley's step where the curve bends little up to Newton's root, else Newton's own, which can't diverge.
    const double curving = 1.5 * t * turn * rest;  // in units of slope^2
    const double slope2 = slope * slope;
    const double increment = std::abs(curving) < 0.5 * slope2 ? rest * slope / (slope2 - curving) : rest / slope;
    t += increment;
    if (!(t < 1e12)) return false;
    if (t <= 0.0) break;
    if (std::abs(increment) <= 1e-5 * t) break;  // convergence is cubic: the next error is below 1e-14
    if (step == kMostSteps) return false;
  }
  t = std::max(t, 0.0);

  // With S = 1 / cos in the layer of least index, cos_k = sqrt(1 + bend_k t^2) / S, so the sums of the Jacobian are
  // those of the slope: A = n_0 S / n_m sum of reach_slope_k / root_k, B with S^3 and root_k^3.
  const double secant2 = 1.0 + t * t;
  const double secant = std::sqrt(secant2);
  const double cosine = 1.0 / secant;
  double a = 0.0;
  double b = 0.0;
  for (int k = 0; k < count; ++k) {
    const double rest = 1.0 + bend[k] * t * t;  // may be below 0 only in a layer without thickness
    if (!(rest > 0.0)) return false;
    const double root = std::sqrt(rest);
    const double inverse = 1.0 / root;
    path.tangent[k] = ratio[k] * t * inverse;
    path.cosine[k] = root * cosine;
    const double part = reach_slope[k] * inverse;
    a += part;
    b += part * inverse * inverse;
  }
  const double source = layers[0].index / least;
  path.jacobian = 1.0 / (path.cosine[count - 1] * source * a * source * path.cosine[0] * b * secant2 * secant2);

  // (1 - R) of a face is 4 x y / (x + y)^2 with x = n_1 cos_1, y = n_2 cos_2 (s) or x = n_2 cos_1, y = n_1 cos_2 (p).
  double numerator = 1.0;
  double below_s = 1.0;
  double below_p = 1.0;
  for (int k = 0; k + 1 < count; ++k) {
    const double n_1 = layers[k].index;
    const double n_2 = layers[k + 1].index;
    if (n_1 == n_2) continue;
    const double c_1 = path.cosine[k];
    const double c_2 = path.cosine[k + 1];
    const double s = n_1 * c_1 + n_2 * c_2;
    const double p = n_2 * c_1 + n_1 * c_2;
    numerator *= 4.0 * n_1 * c_1 * n_2 * c_2;
    below_s *= s * s;
    below_p *= p * p;
  }
  path.transmittance = 0.5 * numerator * (below_s + below_p) / (below_s * below_p);
  return true;
}

}  // namespace touchstone::render
