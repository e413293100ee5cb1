#pragma once
// The displacement of a flat or domed outer surface under a coarse press, at any point and free of the mesh's wiggles.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "fem/fine_relief/layer_response.h"
#include "fem/fine_relief/spline_field.h"

namespace touchstone::fem {

/// What a coarse press does to the surface, in two parts: what an endless layer does under the coarse pressure, which
/// is as rough as that pressure; and all the rest, which is smooth.
struct SmoothDisplacement {
  SplineField along;  ///< the surface's displacement along itself, mm, gel frame
  SplineField rest;   ///< component z: the normal displacement less what the endless layer does under the coarse
                      ///< pressure alone (sides of the pad, layers below, friction's pull), mm
  std::vector<double> layer;    ///< mm, into the gel: what the endless layer does under the coarse pressure, at the
                                ///< pixels of SmoothSurface::reference_grid()
  double largest_misfit = 0.0;  ///< mm, of `rest.z` to the mesh's hat means where there's pressure: the mesh's wiggles
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit, out of the gel: of what the coarse pressure comes to
  double force = 0.0;                                    ///< N, what that is
};

/// c0 + c1 x + c2 y + c3 x^2 + c4 x y + c5 y^2 about a place.
struct QuadraticField {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 6, 1> coefficients = Eigen::Matrix<double, 6, 1>::Zero();

  /// What the coefficients are multiplied by, at `d` from the middle.
  static Eigen::Matrix<double, 1, 6> terms(const Eigen::Vector2d& d) {
    return {1.0, d.x(), d.y(), d.x() * d.x(), d.x() * d.y(), d.y() * d.y()};
  }
  double at(const Eigen::Vector2d& point) const { return terms(point - middle) * coefficients; }
};

/// Of all responses that a SmoothSurface keeps; some 40 bytes each.
inline constexpr std::size_t kKeptPixels = 2'000'000;

inline constexpr double kSteepestDome = 1.4;  ///< radians of slope, at its rim: 80 degrees

/// A place of the undeformed outer surface.
struct SurfacePlace {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< mm, gel frame
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, out of the gel
  double scale = 1.0;                                 ///< mm of surface to a mm of the plane that it is laid out on
};

/// Takes the mesh's wiggles out. The coarse mesh and the endless layer (fem/fine_relief/layer_response.h) are given the
/// same P1 pressure; the difference of what they answer, as means over the hats, has no detail of the size of an edge
/// but for the mesh's own error, so smoothing splines are fitted to it (knots a quarter of the thickness or two and a
/// half edges apart, the bending below a wavelength of four knots held back) and the wiggles stay behind. Made once a
/// gel; safe to use from many threads.
///
/// A place of the surface is given by two numbers. Of a flat gel they are its x and y. A dome is laid out on the plane
/// that touches its apex, from the sphere's lowest point (stereographically): a small figure stays similar, only its
/// size changes, by `scale`, which is 1 at the apex and (1 + cos slope) / 2 elsewhere. Pressures and displacements
/// are along the surface's own normal. Two places of the sphere that are d apart in the plane are d sqrt(s s') apart in
/// space, s and s' being their scales. So the half space's response to a distance needs no change but this: pressures
/// times scale^1.5 go in, displacements times scale^0.5 come out. What a layer's base adds to it is smooth; it is that
/// of a layer `scale` times as thick. Only the difference of two pressures of equal force goes through that layer; what
/// the finite elements know of the dome stays. Domes steeper than kSteepestDome are refused.
class SmoothSurface {
 public:
  /// The compliance must outlive this. The outer surface lies in the plane z = 0, or on the sphere about (0, 0,
  /// -sphere_radius).
  /// @throws Error unless it is, or if the cap is steeper than kSteepestDome somewhere
  explicit SmoothSurface(const Compliance& gel, double sphere_radius = std::numeric_limits<double>::infinity());
  ~SmoothSurface();

  /// The coarse displacement as smooth fields.
  SmoothDisplacement displacement(const PressState& press) const;

  /// Normal displacement (mm, negative under pressure) at the pixels of reference_grid(): the rest, and what the
  /// endless layer does under the coarse pressure. As smooth as the pressure.
  std::vector<double> normal_displacement(const PressState& press) const;
  /// The same under a finer pressure, at some distance from it: the two pressures' difference, which has no detail left
  /// there, is answered on pixels of up to four times the width. `rest` and `layer` of the press's SmoothDisplacement.
  std::vector<double> normal_displacement(const PressState& press, const SplineField& rest,
                                          std::span<const double> layer, const PixelGrid& fine,
                                          std::span<const double> pressure) const;
  const PixelGrid& reference_grid() const { return layer_->grid(); }

  /// The endless layer under `nx` x `ny` free pixels of `pitch` mm, wherever they stand, and what presses on it
  /// (`opposite` as in LayerResponse). Those that were asked for last are kept, up to kKeptPixels: making one takes as
  /// long as using it ten times.
  std::shared_ptr<const LayerResponse> response(int nx, int ny, double pitch, double opposite = 0.0) const;

  /// How far an elastic object's surface has given way (PressState::object_gives), less what an elastic half
  /// space of that `opposite` does under the coarse pressure: the least squares' quadratic over what touches, for it
  /// has no detail. `layer` of the press's SmoothDisplacement.
  QuadraticField object_rest(const PressState& press, double opposite, std::span<const double> layer) const;

  /// The place that stands at `laid_out` in the plane.
  SurfacePlace place(const Eigen::Vector2d& laid_out) const;
  /// Where the place over x and y is laid out; beside a dome the nearest one of its rim.
  Eigen::Vector2d laid_out(const Eigen::Vector2d& seen) const;
  /// Height of the undeformed surface over x and y, mm; beside a dome that of its rim.
  double rest_height(const Eigen::Vector2d& seen) const;
  bool is_flat() const;                                    ///< not a dome
  double sphere_radius() const { return sphere_radius_; }  ///< mm; infinite for a flat surface
  /// Of the dome's rim as it is laid out, mm; infinite for a flat surface.
  double rim_radius() const { return rim_radius_; }
  /// SurfacePlace::scale of each pixel.
  std::vector<double> scales(const PixelGrid& grid) const;
  /// What goes into a LayerResponse: pressure (MPa) times scale^1.5, pixel by pixel.
  static std::vector<double> load(std::span<const double> pressure, std::span<const double> scales);
  /// How the gel's vertices are laid out.
  const std::vector<Eigen::Vector2d>& vertices() const { return vertices_; }
  /// MPa, of the press on the gel at a vertex, along the surface's normal.
  double pressure(const PressState& press, std::size_t vertex) const {
    return -normals_[vertex].dot(press.traction.row(static_cast<Eigen::Index>(vertex)));
  }

  const Compliance& gel() const { return gel_; }
  double edge() const { return edge_; }  ///< mm, of the finest triangles

 private:
  std::vector<double> coarse_load(const PressState& press) const;
  std::vector<double> answer_of(const LayerResponse& layer, std::span<const double> load) const;
  Eigen::VectorXd hat_means(std::span<const double> values) const;
  std::vector<double> less_layer(const SplineField& rest, std::vector<double> answer) const;

  const Compliance& gel_;
  double edge_ = 0.0;
  double sphere_radius_, rim_radius_;
  std::vector<Eigen::Vector2d> vertices_;
  std::vector<Eigen::Vector3d> normals_;               // per vertex, the sphere's
  std::unique_ptr<LayerResponse> layer_;               // over the whole surface
  std::vector<double> scales_;                         // per pixel of its grid
  Eigen::SparseMatrix<double, Eigen::RowMajor> hats_;  // pixels x vertices: P1 values at pixel centres
  Eigen::SparseMatrix<double, Eigen::RowMajor>
      areas_;                     // the same times scale^2: what of a pixel's true area is a hat's
  Eigen::VectorXd weight_;        // per vertex, mm^2, by the mass matrix
  Eigen::VectorXd pixel_weight_;  // the same in pixels
  std::unique_ptr<SplineFit> rest_fit_, along_fit_;
  mutable std::mutex kept_mutex_;
  mutable std::vector<std::shared_ptr<const LayerResponse>> kept_;  // the last one used stands last
};

}  // namespace touchstone::fem
