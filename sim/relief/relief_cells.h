#pragma once
// Cells of a random foam or grain: a power diagram [Aurenhammer1987] of scattered points on a tile that wraps round.

#include <Eigen/Core>
#include <vector>

#include "core/random.h"

namespace touchstone::sim {

/// A point of the diagram, with its weight: a place belongs to the point of the least d^2 - weight.
struct CellPoint {
  Eigen::Vector2d place;  ///< mm
  double weight = 0.0;    ///< mm^2: the larger, the more of its neighbours' area it takes
};

/// Points scattered on a periodic rectangle, none nearer to another than `closeness` times the mean distance
/// 1/sqrt(density), in as far as a few tries a point succeed (up to 0.7 they do).
std::vector<Eigen::Vector2d> scatter(const Eigen::Vector2d& size, double per_mm2, double closeness,
                                     RandomStream& random);

/// Where a place lies in the cells.
struct CellPlace {
  int cell = 0;                ///< the index of its cell's point
  int neighbour = 0;           ///< the nearest other cell's
  double wall = 0.0;           ///< mm to the straight wall between both
  double second_wall = 0.0;    ///< mm to the wall with the second nearest other cell: small near corners
  Eigen::Vector2d from_point;  ///< mm, from the cell's point
};

/// The diagram of some points; it wraps round the rectangle's sides.
class CellDiagram {
 public:
  /// @pre there are at least 4 points on the rectangle
  CellDiagram(const Eigen::Vector2d& size, std::vector<CellPoint> points);

  /// Which cell a place is in, and how near its walls are.
  CellPlace at(const Eigen::Vector2d& place) const;
  const std::vector<CellPoint>& points() const { return points_; }

 private:
  Eigen::Vector2d size_;
  std::vector<CellPoint> points_;
  int columns_, rows_;
  std::vector<std::vector<int>> buckets_;
};

}  // namespace touchstone::sim
