#pragma once
// How a gripped face's contact is solved on cells, from what the press did; for gripped_face.cpp only.

#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "core/dense_solvers.h"
#include "core/transform.h"
#include "fem/elements/compliance.h"
#include "fem/fine_relief/pixel_contact.h"
#include "fem/mesh/triangle_tree.h"

namespace touchstone::sim {

inline constexpr int kAlong = 6;                   ///< degree of the smooth field along the flat
inline constexpr int kAcross = 2;                  ///< across it
inline constexpr std::array kDecays = {0.5, 1.5};  ///< thicknesses over which the piece's ends have an effect
inline constexpr int kTerms =
    (kAlong + 1 + 2 * static_cast<int>(kDecays.size())) * (kAcross + 1);  ///< of the smooth field

/// Height of the flat's plane over z = 0 at a place.
class FlatPlane {
 public:
  /// Of a flat that is `below_origin` mm below the piece's origin.
  FlatPlane(const RigidTransform& gel_from_piece, double below_origin)
      : through_(gel_from_piece * Eigen::Vector3d(0, 0, -below_origin)),
        normal_(gel_from_piece.turn(Eigen::Vector3d::UnitZ())) {}
  /// mm.
  double at(double x, double y) const {
    return through_.z() - (normal_.x() * (x - through_.x()) + normal_.y() * (y - through_.y())) / normal_.z();
  }

 private:
  Eigen::Vector3d through_, normal_;
};

/// Carries forces from the gel's vertices to the elastic piece, and its displacements back.
class PieceAnswer {
 public:
  /// `vertices` are those of the gel that may touch. `body` must outlive this.
  PieceAnswer(const fem::Compliance& body, const fem::Compliance& gel, const std::vector<int>& vertices,
              const RigidTransform& gel_from_piece)
      : body_(body), turn_(gel_from_piece.rotation), weight_(body.mass * Eigen::VectorXd::Ones(body.mass.cols())) {
    const fem::TriangleTree tree(body.vertices, body.triangles);
    const RigidTransform piece_from_gel = gel_from_piece.inverse();
    const Eigen::Vector3d up = piece_from_gel.turn(Eigen::Vector3d::UnitZ());
    for (const int v : vertices) {
      hits_.push_back(tree.first_crossing(piece_from_gel * gel.vertices[static_cast<std::size_t>(v)], up));
    }
  }

  /// Displacement (gel frame, mm) of the piece's surface over each vertex, under a force (gel frame, N) at each.
  std::vector<Eigen::Vector3d> displacements(const std::vector<Eigen::Vector3d>& forces) const {
    Eigen::VectorXd traction = Eigen::VectorXd::Zero(body_.surface.rows());
    for (std::size_t k = 0; k < hits_.size(); ++k) {
      if (!hits_[k] || forces[k].isZero(0.0)) continue;
      for (int c = 0; c < 3; ++c) {
        const int u = body_.triangles[static_cast<std::size_t>(hits_[k]->triangle)][static_cast<std::size_t>(c)];
        traction.segment<3>(3 * u) += hits_[k]->barycentric[c] / weight_[u] * (turn_.transpose() * forces[k]);
      }
    }
    const Eigen::VectorXd weighted = body_.surface.times(traction);
    std::vector<Eigen::Vector3d> result(hits_.size(), Eigen::Vector3d::Zero());
    for (std::size_t k = 0; k < hits_.size(); ++k) {
      if (!hits_[k]) continue;
      for (int c = 0; c < 3; ++c) {
        const int u = body_.triangles[static_cast<std::size_t>(hits_[k]->triangle)][static_cast<std::size_t>(c)];
        result[k] += hits_[k]->barycentric[c] / weight_[u] * (turn_ * weighted.segment<3>(3 * u));
      }
    }
    return result;
  }

 private:
  const fem::Compliance& body_;
  Eigen::Matrix3d turn_;
  Eigen::VectorXd weight_;
  std::vector<std::optional<fem::TriangleTree::Hit>> hits_;
};

/// The contact of one state on the map's cells.
class CellContact {
 public:
  /// `cells`: places in `grid` that the flat is over; `at_cells`, `at_vertices`: where they and the gel's `vertices`
  /// are on the flat, -1 to 1 along and across it; `half_length`: its, mm.
  CellContact(const fem::ElasticMaterial& both, const fem::Compliance& gel, const fem::PixelGrid& grid,
              const std::vector<int>& cells, const std::vector<int>& vertices,
              const std::vector<Eigen::Vector2d>& at_vertices, const std::vector<Eigen::Vector2d>& at_cells,
              double half_length)
      : gel_(gel), vertices_(vertices), terms_at_cells_(terms(at_cells, half_length / gel.thickness)) {
    // The part of the grid that holds the flat, with nothing round it.
    int left = grid.nx, right = 0, bottom = grid.ny, top = 0;
    for (const int cell : cells) {
      left = std::min(left, cell % grid.nx);
      right = std::max(right, cell % grid.nx);
      bottom = std::min(bottom, cell / grid.nx);
      top = std::max(top, cell / grid.nx);
    }
    part_ = {right - left + 1, top - bottom + 1, grid.pitch, grid.centre(left, bottom)};
    layer_ = std::make_unique<const fem::LayerResponse>(both, gel.thickness, part_, fem::GridEdges::free);
    for (const int cell : cells) cells_.push_back(part_.at(cell % grid.nx - left, cell / grid.nx - bottom));
    fit_.compute(terms(at_vertices, half_length / gel.thickness));
    // P1 values at the part's pixels.
    const fem::TriangleTree tree(gel.vertices, gel.triangles);
    std::vector<Eigen::Triplet<double>> hats;
    for (int j = 0; j < part_.ny; ++j) {
      for (int i = 0; i < part_.nx; ++i) {
        const Eigen::Vector2d at = part_.centre(i, j);
        const auto hit = tree.first_crossing({at.x(), at.y(), 0.0}, -Eigen::Vector3d::UnitZ());
        if (!hit) continue;
        const auto& triangle = gel.triangles[static_cast<std::size_t>(hit->triangle)];
        for (int k = 0; k < 3; ++k) {
          hats.emplace_back(static_cast<int>(part_.at(i, j)), triangle[static_cast<std::size_t>(k)],
                            hit->barycentric[k]);
        }
      }
    }
    hats_.resize(static_cast<Eigen::Index>(part_.size()), static_cast<Eigen::Index>(gel.vertices.size()));
    hats_.setFromTriplets(hats.begin(), hats.end());
  }

  /// Heights of the flat over the cells.
  std::vector<double> heights(const FlatPlane& plane) const {
    std::vector<double> result;
    for (const std::size_t pixel : cells_) {
      const Eigen::Vector2d at = centre(pixel);
      result.push_back(plane.at(at.x(), at.y()));
    }
    return result;
  }

  /// How contact was solved on the cells, in one state.
  struct Answer {
    std::vector<double> pressure, gap;  // per cell, MPa and mm
    std::vector<double> start;          // to begin the next state with
  };
  /// `pressure` and `apart` per vertex of the gel: the press's pressure (MPa), and how far it moves the two faces apart
  /// (mm, hat means).
  Answer solve(const FlatPlane& plane, const Eigen::VectorXd& pressure, const Eigen::VectorXd& apart, double force,
               const std::vector<double>& start) const {
    const Eigen::VectorXd coarse = hats_ * pressure;
    Eigen::VectorXd layer(coarse.size());
    const auto scratch = layer_->make_scratch();
    const auto pixels = static_cast<std::size_t>(coarse.size());
    layer_->apply({coarse.data(), pixels}, {layer.data(), pixels}, *scratch);
    Eigen::VectorXd rest(static_cast<Eigen::Index>(vertices_.size()));
    for (std::size_t k = 0; k < vertices_.size(); ++k) {
      const Eigen::Vector3d& at = gel_.vertices[static_cast<std::size_t>(vertices_[k])];
      rest[static_cast<Eigen::Index>(k)] = apart[vertices_[k]] - interpolated(layer, at.head<2>());
    }
    const Eigen::VectorXd coefficients = fit_.solve(rest);
    const Eigen::VectorXd smooth = terms_at_cells_ * coefficients;

    std::vector<double> gap(part_.size(), std::numeric_limits<double>::infinity());
    const std::vector<double> height = heights(plane);
    for (std::size_t k = 0; k < cells_.size(); ++k) gap[cells_[k]] = height[k] + smooth[static_cast<Eigen::Index>(k)];
    fem::PixelContactAnswer solved = fem::solve_pixel_contact(*layer_, {gap, force}, {}, start);
    Answer answer;
    for (const std::size_t pixel : cells_) {
      answer.pressure.push_back(solved.pressure[pixel]);
      answer.gap.push_back(gap[pixel] + solved.shift + solved.displacement[pixel]);
    }
    answer.start = std::move(solved.pressure);
    return answer;
  }

 private:
  Eigen::Vector2d centre(std::size_t pixel) const {
    const auto at = static_cast<int>(pixel);
    return part_.centre(at % part_.nx, at / part_.nx);
  }
  /// Legendre's polynomials across times those along and times what decays from either end. `half_length`: of the flat,
  /// in thicknesses.
  static Eigen::MatrixXd terms(const std::vector<Eigen::Vector2d>& places, double half_length) {
    Eigen::MatrixXd result(static_cast<Eigen::Index>(places.size()), kTerms);
    for (Eigen::Index row = 0; row < result.rows(); ++row) {
      const double x = std::clamp(places[static_cast<std::size_t>(row)].x(), -1.0, 1.0);
      const double y = std::clamp(places[static_cast<std::size_t>(row)].y(), -1.0, 1.0);
      for (int n = 0; n < kTerms; ++n) {
        const int along = n / (kAcross + 1);
        const int end = along - kAlong - 1;  // from 0 on: an end's
        const double value =
            end < 0
                ? std::legendre(static_cast<unsigned>(along), x)
                : std::exp(-(1.0 - (end % 2 == 0 ? x : -x)) * half_length / kDecays[static_cast<std::size_t>(end) / 2]);
        result(row, n) = value * std::legendre(static_cast<unsigned>(n % (kAcross + 1)), y);
      }
    }
    return result;
  }
  double interpolated(const Eigen::VectorXd& values, const Eigen::Vector2d& place) const {
    const double x = std::clamp((place.x() - part_.first.x()) / part_.pitch, 0.0, part_.nx - 1.0);
    const double y = std::clamp((place.y() - part_.first.y()) / part_.pitch, 0.0, part_.ny - 1.0);
    const int i = std::min(static_cast<int>(x), std::max(0, part_.nx - 2));
    const int j = std::min(static_cast<int>(y), std::max(0, part_.ny - 2));
    const auto at = [&](int a, int b) {
      return values[static_cast<Eigen::Index>(part_.at(std::min(a, part_.nx - 1), std::min(b, part_.ny - 1)))];
    };
    const double u = x - i;
    const double v = y - j;
    return (1.0 - v) * ((1.0 - u) * at(i, j) + u * at(i + 1, j)) +
           v * ((1.0 - u) * at(i, j + 1) + u * at(i + 1, j + 1));
  }

  const fem::Compliance& gel_;
  const std::vector<int>& vertices_;
  fem::PixelGrid part_;
  std::unique_ptr<const fem::LayerResponse> layer_;
  std::vector<std::size_t> cells_;  // pixels of the part
  Eigen::SparseMatrix<double, Eigen::RowMajor> hats_;
  Eigen::MatrixXd terms_at_cells_;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> fit_;
};

}  // namespace touchstone::sim
