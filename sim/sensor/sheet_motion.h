#pragma once
// How a pressed gel's outer surface has moved from one state to another, smooth enough for its slope.

#include <Eigen/SparseCore>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "render/direct/sheet_between.h"

namespace touchstone::sim {

/// The surface's displacement on a lattice of the undeformed gel's x and y, three nodes to an edge of the finest
/// triangles: P1 between the mechanics' vertices, its kinks made smooth over an edge. Made once a gel; safe to use from
/// many threads.
class SheetMotion {
 public:
  /// @pre seen along z the gel's outer surface lies once over its x and y: a slab or a gentle dome
  SheetMotion(const fem::Compliance& gel, double finest_edge_mm);

  /// What is added to the displacement of `from` by that of `to`; the memory of `move` is used again.
  void between(const fem::PressState& from, const fem::PressState& to, render::SheetMove& move) const;

 private:
  render::SheetMove lattice_;                            // without its numbers
  Eigen::SparseMatrix<float, Eigen::RowMajor> weights_;  // nodes x vertices
};

}  // namespace touchstone::sim
