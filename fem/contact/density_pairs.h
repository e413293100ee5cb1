#pragma once
// What tractions on the cells of one surface triangle do at those of another.

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "fem/contact/cut_hats.h"
#include "fem/contact/half_space_response.h"

namespace touchstone::fem {

/// Cells side by side, so that loops over them run on several numbers at once.
struct CellColumns {
  explicit CellColumns(const std::vector<DensityCell>& list);  ///< in their order

  int size() const { return static_cast<int>(area.size()); }

  Eigen::ArrayX3d at;        ///< mm
  Eigen::ArrayXd area;       ///< mm^2
  Eigen::ArrayXd largest;    ///< mm^-1: mean of 1/r within each
  Eigen::MatrixX3d density;  ///< mm^2, of each corner
};

/// A triangle's cells with what they add up to.
struct TriangleDensity {
  explicit TriangleDensity(const std::vector<DensityCell>& list);  ///< of these

  CellColumns cells;
  std::array<Eigen::Vector3d, 3> centre;  ///< mm, of each corner's density
  Eigen::Vector3d mass;                   ///< mm^2
};

/// One triangle among those of a contact.
struct DensityTriangle {
  /// `cut`: with its hats cut; `whole`: as if they weren't.
  DensityTriangle(const std::vector<DensityCell>& cut, const std::vector<DensityCell>& whole);

  TriangleDensity now;
  TriangleDensity whole;
  bool same_cells;  ///< of both
  bool is_cut = false;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Vector3d first = Eigen::Vector3d::Zero(), second = Eigen::Vector3d::Zero();  ///< tangents
  std::array<int, 3> place{-1, -1, -1};  ///< of its corners among the contact's vertices; -1: not one of them
};

/// Adds up a half-space's responses to densities, with hats cut and whole: mm^3/MPa, a row for each vertex if
/// `normal_only`, else three (pressure and two tangents). Of many triangles nearly all pairs are far: what one of them
/// and the others do is gathered in a few columns, which a processor's cache holds, before it goes into the whole.
class DensityPairs {
 public:
  /// Keeps the reference.
  DensityPairs(const HalfSpaceResponse& half_space, int vertices, bool normal_only);

  /// Of two triangles, each on the other, or of one on itself if they are the same object. `near`: cell by cell, else
  /// by the densities' centres. Pairs of the same `a` should follow each other.
  void add(const DensityTriangle& a, const DensityTriangle& b, bool near);

  /// All that was added. Ends the adding.
  struct Responses {
    Eigen::MatrixXd cut;
    Eigen::MatrixXd whole;
  };
  Responses take();  ///< see above

 private:
  static constexpr int kTerms = 6;

  /// The densities of two triangles' cells, and where their response goes.
  struct Weighed {
    const Eigen::MatrixX3d& a;
    const Eigen::MatrixX3d& b;
    Eigen::MatrixXd& out;
  };
  void add_cells(const DensityTriangle& a, const CellColumns& in_a, const DensityTriangle& b, const CellColumns& in_b,
                 std::span<const Weighed> sets);
  void add_far(const DensityTriangle& a, const TriangleDensity& of_a, const DensityTriangle& b,
               const TriangleDensity& of_b, Eigen::MatrixXd& columns);
  void add_block(Eigen::MatrixXd& out, int row, int column, const Eigen::Matrix3d& block, bool mirrored);

  void gather();

  /// What far pairs do at one of their ends, the other's is its transpose.
  struct Far {
    Eigen::MatrixXd columns;  ///< of the corners of `at_`: as many as of three vertices
    Eigen::MatrixXd sum;      ///< what was gathered
  };

  const HalfSpaceResponse& half_space_;
  bool normal_only_;
  Responses near_;
  Far far_cut_, far_whole_;
  const DensityTriangle* at_ = nullptr;                ///< whose far pairs stand in the columns
  std::vector<double> from_, inverse_, terms_, sums_;  // for each cell that is seen
};

}  // namespace touchstone::fem
