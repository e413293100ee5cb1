#pragma once
// The displacement of a flat outer surface under a coarse press, at any point and free of the mesh's wiggles.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>
#include <span>
#include <vector>

#include "fem/compliance.h"
#include "fem/layer_response.h"
#include "fem/press.h"
#include "fem/spline_field.h"

namespace touchstone::fem {

/// What a coarse press does to the surface, in two parts: what an endless layer does under the coarse pressure, which
/// is as rough as that pressure; and all the rest, which is smooth.
struct SmoothDisplacement {
  SplineField along;  ///< components x and y: the surface's tangential displacement, mm
  SplineField rest;   ///< component z: the normal displacement less what the endless layer does under the coarse
                      ///< pressure alone (sides of the pad, layers below, friction's pull), mm
  double largest_misfit = 0.0;  ///< mm, of `rest.z` to the mesh's hat means where there's pressure: the mesh's wiggles
  double force = 0.0;           ///< N, of the coarse pressure
};

/// Takes the mesh's wiggles out. The coarse mesh and the endless layer (fem/layer_response.h) are given the same P1
/// pressure; the difference of what they answer, as means over the hats, has no detail of the size of an edge but for
/// the mesh's own error, so smoothing splines are fitted to it (knots a quarter of the thickness or two and a half
/// edges apart, the bending below a wavelength of four knots held back) and the wiggles stay behind. Made once a gel;
/// safe to use from many threads.
class SmoothSurface {
 public:
  /// The compliance must outlive this.
  /// @throws Error unless the gel's outer surface lies in the plane z = 0
  explicit SmoothSurface(const Compliance& gel);
  ~SmoothSurface();

  SmoothDisplacement displacement(const PressState& press) const;

  /// Normal displacement (mm, negative under pressure) at the pixels of reference_grid(): the rest, and what the
  /// endless layer does under the coarse pressure; or, if a finer pressure is given, under that one. As smooth as the
  /// pressure.
  std::vector<double> normal_displacement(const PressState& press, const PixelGrid& fine = {},
                                          std::span<const double> pressure = {}) const;
  const PixelGrid& reference_grid() const { return layer_->grid(); }

  const Compliance& gel() const { return gel_; }
  double edge() const { return edge_; }  ///< mm, of the finest triangles

 private:
  std::vector<double> coarse_pressure(const PressState& press) const;
  std::vector<double> layer_answer(std::span<const double> pressure) const;

  const Compliance& gel_;
  double edge_ = 0.0;
  std::unique_ptr<LayerResponse> layer_;               // over the whole surface
  Eigen::SparseMatrix<double, Eigen::RowMajor> hats_;  // pixels x vertices: P1 values at pixel centres
  Eigen::VectorXd weight_;                             // per vertex, mm^2, by the mass matrix
  Eigen::VectorXd pixel_weight_;                       // the same in pixels
  std::unique_ptr<SplineFit> rest_fit_, along_fit_;
};

}  // namespace touchstone::fem
