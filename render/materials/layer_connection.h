#pragma once
// Light from a point through a stack of flat layers to another point: the one refracted path between them, exactly.

#include <optional>
#include <span>

namespace touchstone::render {

/// The most layers that a connection may cross.
inline constexpr int kMaxLayers = 16;

/// A layer between two parallel faces, seen in order from the source to the receiver. Thickness in mm, >= 0.
struct Layer {
  double thickness = 0.0;
  double index = 1.0;
};

/// The refracted path from a source to a receiver. `tangent[k]` and `cosine[k]` belong to the angle from the faces'
/// normal in layer k.
struct LayerPath {
  double tangent[kMaxLayers];
  double cosine[kMaxLayers];
  double jacobian = 0.0;       ///< d omega at the source / d area perpendicular to the ray at the receiver, 1/mm^2
  double transmittance = 1.0;  ///< of unpolarised light through all faces, Fresnel's loss only, s and p kept apart
};

/// Solves Snell's law for the path that covers the lateral distance `lateral` (mm, >= 0) through the layers.
///
/// With t the tangent of the angle in the layer of least index n_m, and r = n_m / n_k, layer k's tangent is
/// r t / sqrt(1 + (1 - r^2) t^2): concave and increasing, so Newton's method on f(t) = sum h_k tan_k - lateral runs up
/// to the root without overshoot. It starts from the better of the tangents at 0 and far out, and takes Halley's step
/// (cubic convergence) where the curve bends little, so two steps are the rule. The Jacobian is that of the axially
/// symmetric bundle about the source's normal: 1 / [c_K A B], A = n_0 sum h_k/(n_k c_k),
/// B = n_0 c_0 sum h_k/(n_k c_k^3), K the receiver's layer; for one layer it is 1 / distance^2.
/// False where no light arrives: no thickness at all, or an angle so flat that the layers can't carry it.
bool solve_layer_path(std::span<const Layer> layers, double lateral, LayerPath& path);

/// The same by value; nullopt where no light arrives.
inline std::optional<LayerPath> solve_layer_path(std::span<const Layer> layers, double lateral) {
  std::optional<LayerPath> path(std::in_place);
  if (!solve_layer_path(layers, lateral, *path)) path.reset();
  return path;
}

}  // namespace touchstone::render
