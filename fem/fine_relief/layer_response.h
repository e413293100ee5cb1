#pragma once
// The face of an elastic layer, bonded to a rigid plate below, under a pressure given pixel by pixel.

#include <Eigen/Core>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "fem/elements/elastic_material.h"

namespace touchstone::fem {

/// Square pixels on the face z = 0 of the gel frame. Pixel (i, j) has its centre at first + pitch * (i, j) and stands
/// at index j * nx + i in arrays. Lengths in mm.
struct PixelGrid {
  int nx = 0;
  int ny = 0;
  double pitch = 0.0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();  ///< centre of pixel (0, 0)

  std::size_t size() const { return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny); }
  std::size_t at(int i, int j) const { return static_cast<std::size_t>(j) * nx + static_cast<std::size_t>(i); }
  Eigen::Vector2d centre(int i, int j) const { return first + pitch * Eigen::Vector2d(i, j); }
  std::vector<double> columns_x() const;  ///< of the pixels' centres, mm
  std::vector<double> rows_y() const;     ///< along y
  double pixel_area() const { return pitch * pitch; }
  bool operator==(const PixelGrid&) const = default;
};

/// Pixels of a free grid may have this part of the thickness.
inline constexpr double kWidestPixel = 0.25;

/// The most pixels that a side may have.
inline constexpr int kMostPixelsASide = 2048;

/// @throws Error unless there are 1 to kMostPixelsASide pixels a side, and pitch and place are finite, the pitch above
/// 0
void check(const PixelGrid& grid);

/// How the layer goes on beyond the grid: without pressure, or repeated.
enum class GridEdges { free, periodic };

/// Linear map from pressure (MPa) to displacement into the layer (mm), frictionless. Immutable: many threads may use
/// one response, each with its own scratch. The transforms' order is fixed, so the same input gives the same bytes.
///
/// Free: pressure is constant in each pixel, displacement is at pixel centres, by real-space influence coefficients:
/// Love's solution of the half space under a loaded rectangle ([Love1929]; [Johnson1985, eq. 3.25]) and the layer's
/// smooth correction, averaged over the pixel to second order. The convolution is made by Fourier transforms on a grid
/// twice as large, where nothing wraps round: it has no padding error.
/// Periodic: the grid is one period, and each of its waves is answered by layer_compliance
/// (fem/fine_relief/layer_kernel.h).
class LayerResponse {
 public:
  /// Memory for one application of a response.
  class Scratch;

  /// `opposite` (1/MPa): (1 - nu^2) / E of an elastic half space that presses on the layer and gives way, too; the
  /// displacement is then of both, towards each other. Of periodic grids its mean isn't counted, as it has no end.
  /// @throws Error for a material, thickness or grid that isn't allowed, or if pixels of a free grid are wider than
  /// kWidestPixel allows (then the layer's correction isn't smooth over a pixel)
  LayerResponse(const ElasticMaterial& material, double thickness, const PixelGrid& grid, GridEdges edges,
                double opposite = 0.0);
  ~LayerResponse();
  LayerResponse(const LayerResponse&) = delete;
  LayerResponse& operator=(const LayerResponse&) = delete;

  const PixelGrid& grid() const { return grid_; }
  GridEdges edges() const { return edges_; }
  const ElasticMaterial& material() const { return material_; }
  double thickness() const { return thickness_; }
  double opposite() const { return opposite_; }

  /// An approximate inverse, from displacement to pressure, to speed up iterations: each wave of a slightly larger cell
  /// by itself. Symmetric positive definite.
  /// Made at the first call.
  const LayerResponse& rough_inverse() const;
  /// The same layer under pixels of twice the width, the first of them over the first four of these. Made at the first
  /// call. @pre a free grid; pixels of a quarter of kWidestPixel or less are always fine enough
  const LayerResponse& on_wider_pixels() const;

  /// Memory for apply(), one for each thread.
  std::unique_ptr<Scratch> make_scratch() const;
  /// @pre both spans have a value per pixel, and the scratch is of this response; they may be the same array
  void apply(std::span<const double> pressure, std::span<double> displacement, Scratch& scratch) const;

 private:
  struct Transform;
  struct Inverse {};
  LayerResponse(const LayerResponse& of, Inverse);
  void fill_free();
  void fill_periodic();

  PixelGrid grid_;
  GridEdges edges_;
  ElasticMaterial material_;
  double thickness_;
  double opposite_;
  std::unique_ptr<const Transform> transform_;
  std::unique_ptr<double[]> symbol_;  // real: of the padded grid's half spectrum, over the number of its pixels
  mutable std::once_flag inverse_made_, wider_made_;
  mutable std::unique_ptr<const LayerResponse> inverse_, wider_;
};

/// Memory of one transform, which threads don't share. It belongs to the response that made it.
class LayerResponse::Scratch {
 public:
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

 private:
  friend class LayerResponse;
  explicit Scratch(std::size_t doubles);
  double* data_;
};

}  // namespace touchstone::fem
