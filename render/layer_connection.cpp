#include "render/layer_connection.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "render/fresnel.h"

namespace touchstone::render {

std::optional<LayerPath> solve_layer_path(std::span<const Layer> layers, double lateral) {
  const int count = static_cast<int>(layers.size());
  TS_ASSERT(count > 0 && count <= kMaxLayers);

  // The least index among layers that have any thickness: the only one whose angle may reach 90 degrees.
  double least = 0.0;
  for (const Layer& layer : layers) {
    if (layer.thickness > 0.0 && (least == 0.0 || layer.index < least)) least = layer.index;
  }
  if (least == 0.0) return std::nullopt;

  double ratio[kMaxLayers];
  double bend[kMaxLayers];  // 1 - ratio^2
  double slope_at_zero = 0.0;
  for (int k = 0; k < count; ++k) {
    ratio[k] = least / layers[k].index;
    bend[k] = 1.0 - ratio[k] * ratio[k];
    slope_at_zero += layers[k].thickness * ratio[k];
  }

  constexpr int kMostSteps = 100;      // a very thin layer of least index needs some 40
  double t = lateral / slope_at_zero;  // Newton's first step, from 0
  for (int step = 0;; ++step) {
    double reach = 0.0;
    double slope = 0.0;
    for (int k = 0; k < count; ++k) {
      const double stretch = 1.0 / std::sqrt(1.0 + bend[k] * t * t);
      const double rate = layers[k].thickness * ratio[k] * stretch;
      reach += rate * t;
      slope += rate * stretch * stretch;
    }
    const double increment = (lateral - reach) / slope;
    t += increment;
    if (!(t < 1e12)) return std::nullopt;
    if (std::abs(increment) <= 1e-7 * t || t <= 0.0) break;  // convergence is quadratic: the next error is below 1e-14
    if (step == kMostSteps) return std::nullopt;
  }
  t = std::max(t, 0.0);

  LayerPath path;
  double a = 0.0;
  double b = 0.0;
  for (int k = 0; k < count; ++k) {
    const double rest = 1.0 + bend[k] * t * t;  // may be below 0 only in a layer without thickness
    if (!(rest > 0.0)) return std::nullopt;
    const double tangent = ratio[k] * t / std::sqrt(rest);
    const double cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
    path.tangent[k] = tangent;
    path.cosine[k] = cosine;
    const double part = layers[k].thickness / (layers[k].index * cosine);
    a += part;
    b += part / (cosine * cosine);
  }
  const double n_source = layers[0].index;
  path.jacobian = 1.0 / (path.cosine[count - 1] * n_source * a * n_source * path.cosine[0] * b);

  double through_s = 1.0;
  double through_p = 1.0;
  for (int k = 0; k + 1 < count; ++k) {
    if (layers[k].index == layers[k + 1].index) continue;
    const FresnelFace face = fresnel(layers[k].index, layers[k + 1].index, path.cosine[k]);
    through_s *= 1.0 - face.reflectance_s;
    through_p *= 1.0 - face.reflectance_p;
  }
  path.transmittance = 0.5 * (through_s + through_p);
  return path;
}

}  // namespace touchstone::render
