#pragma once
// From gradients to heights: Poisson's equation on a rectangle of pixels, without iteration.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "sensors/numerics/cosine_transform.h"

namespace touchstone::sensors {

/// What is known at the picture's border.
enum class HeightBorder {
  zero,  ///< Height 0 on the outline of the picture (Dirichlet, a sine transform). For contacts that lie within the
         ///< picture: it gives the level, and a small bias of the gradients can't pile up across the picture.
  free   ///< Nothing (the normal equations' own Neumann border, a cosine transform). For contacts that run out of the
         ///< picture. Heights are known up to a constant; they are given with mean 0.
};

/// Least squares heights of gradients that noise has made inconsistent: the sum over all pairs of neighbouring pixels
/// of (difference of heights - slope between them)^2 is least. The slope between two pixels is taken from the four
/// nearest in their row or column, (-1, 13, 13, -1)/24, which is exact for cubic slopes; next to the border from two.
///
/// The five-point Laplacian is diagonal along v under a cosine transform (zero: of the rows with alternating signs,
/// which is a sine transform whose zeros lie on the outline, half a pixel outside of the pixels' centres, so that its
/// length is the picture's height and not a possibly prime height + 1); along u each term leaves a tridiagonal system
/// ([Li2015, sec. 2.2.2, step 3] does the same by sine transforms in both directions).
///
/// Memory is allocated by the constructor and, for the result, by the first call only. Fast where the height has small
/// prime factors. Single precision: about 1e-5 of the range of heights.
class PoissonSolver {
 public:
  /// @throws Error unless both sizes are 2 to 8192
  PoissonSolver(int width, int height, HeightBorder border);

  int width() const { return width_; }
  int height() const { return height_; }
  HeightBorder border() const { return border_; }

  /// `slope_u`, `slope_v`: CV_32FC1, height x width, derivatives of the height along u (right) and v (down), per unit
  /// of length; `pixel` is the pixels' distance in that unit and the result's. @pre sizes and types fit
  void integrate(const cv::Mat& slope_u, const cv::Mat& slope_v, double pixel, cv::Mat& heights);

  /// Heights whose five-point Laplacian is `divergence` (CV_32FC1). With a free border neighbours outside don't count
  /// (the sum of `divergence` should be 0); with a zero border they are the mirrored negative. @pre size and type fit
  void solve(const cv::Mat& divergence, cv::Mat& heights);

 private:
  void solve_loaded(cv::Mat& heights);

  int width_;
  int height_;
  HeightBorder border_;
  CosineTransform transform_;
  int row_;                     ///< floats a row of `picture_`: the width, rounded up
  int line_;                    ///< floats a line of `terms_`: the height, rounded up
  std::vector<float> picture_;  ///< right-hand side, then heights: v by u
  std::vector<float> terms_;    ///< their transforms: u by term
  std::vector<float> factors_;  ///< of the elimination: u by term
  std::vector<float> work_, block_;
};

}  // namespace touchstone::sensors
