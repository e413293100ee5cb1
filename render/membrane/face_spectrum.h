#pragma once
// Convolutions over a membrane's face with kernels that are known by the distance.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "render/membrane/membrane_kernels.h"

namespace touchstone::render {

/// How a kernel depends on the azimuth phi of what it takes from: 1, cos(phi), sin(phi), cos(2 phi), sin(2 phi).
enum class FaceSymmetry { kEven, kAlongX, kAlongY, kAlongAxes, kAlongDiagonals };

/// A kernel's Fourier transform, made by a FaceConvolution.
struct FaceKernel {
  cv::Mat packed;        ///< as cv::dft packs it, of a kernel that isn't even about its middle
  cv::Mat real_factors;  ///< of one that is: what each number of a packed spectrum is multiplied by
};

/// Fields on a grid of square cells, taken to be zero beyond it. Single precision, by OpenCV's transforms.
class FaceConvolution {
 public:
  /// Transforms are wider than the grid by the reach, so that nothing wraps round.
  FaceConvolution(int columns, int rows, double cell_mm, double reach_mm);

  int columns() const { return columns_; }
  int rows() const { return rows_; }

  /// The kernel of shares in annuli, cut at the reach. A cell's own share is the mean over the cell.
  FaceKernel kernel(const std::vector<double>& radii_mm, const RadialShare& share, FaceSymmetry symmetry) const;

  /// Of a field, CV_32FC1, columns x rows.
  cv::Mat spectrum(const cv::Mat& field) const;
  /// sum += kernel applied to the field of that spectrum: (k * f)(x) = integral of k(d) f(x + d). An empty sum is zero.
  void add(const cv::Mat& spectrum, const FaceKernel& kernel, cv::Mat& sum) const;
  /// Back from a sum of spectra; zero if it is empty.
  cv::Mat field(const cv::Mat& sum) const;

 private:
  int columns_, rows_;
  double cell_mm_;
  int reach_;       // in cells
  cv::Size whole_;  // of the transforms
};

}  // namespace touchstone::render
