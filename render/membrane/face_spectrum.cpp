#include "render/membrane/face_spectrum.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::render {
namespace {

bool is_even(FaceSymmetry symmetry) {
  return symmetry != FaceSymmetry::kAlongX && symmetry != FaceSymmetry::kAlongY;
}

double factor_of(FaceSymmetry symmetry, double x, double y) {
  const double square = x * x + y * y;
  if (square == 0.0) return symmetry == FaceSymmetry::kEven ? 1.0 : 0.0;
  switch (symmetry) {
    case FaceSymmetry::kEven:
      return 1.0;
    case FaceSymmetry::kAlongX:
      return x / std::sqrt(square);
    case FaceSymmetry::kAlongY:
      return y / std::sqrt(square);
    case FaceSymmetry::kAlongAxes:
      return (x * x - y * y) / square;
    case FaceSymmetry::kAlongDiagonals:
      return 2.0 * x * y / square;
  }
  return 0.0;
}

/// The spectrum of a kernel that is even has no imaginary parts: where OpenCV packs the real and the imaginary part of
/// a field's spectrum, both are multiplied by the kernel's real part.
cv::Mat real_factors(const cv::Mat& packed) {
  cv::Mat out(packed.size(), CV_32FC1);
  const int rows = packed.rows;
  const int columns = packed.cols;
  const auto down = [&](int column) {  // packed along the column
    out.at<float>(0, column) = packed.at<float>(0, column);
    for (int row = 1; row + 1 < rows; row += 2) {
      out.at<float>(row, column) = out.at<float>(row + 1, column) = packed.at<float>(row, column);
    }
    if (rows % 2 == 0) out.at<float>(rows - 1, column) = packed.at<float>(rows - 1, column);
  };
  down(0);
  if (columns % 2 == 0) down(columns - 1);
  for (int row = 0; row < rows; ++row) {
    for (int column = 1; column + 1 < columns; column += 2) {
      out.at<float>(row, column) = out.at<float>(row, column + 1) = packed.at<float>(row, column);
    }
  }
  return out;
}

}  // namespace

FaceConvolution::FaceConvolution(int columns, int rows, double cell_mm, double reach_mm)
    : columns_(columns), rows_(rows), cell_mm_(cell_mm), reach_(static_cast<int>(std::ceil(reach_mm / cell_mm))) {
  const auto length = [&](int cells) { return cv::getOptimalDFTSize(cells + std::min(reach_, cells)); };
  whole_ = {length(columns), length(rows)};
}

FaceKernel FaceConvolution::kernel(const std::vector<double>& radii_mm, const RadialShare& share,
                                   FaceSymmetry symmetry) const {
  TS_ASSERT(radii_mm.size() == share.in_annulus.size());
  std::vector<double> density(radii_mm.size());  // per mm^2
  for (std::size_t k = 0; k < radii_mm.size(); ++k) {
    const double inner = k == 0 ? 0.0 : radii_mm[k - 1];
    density[k] = share.in_annulus[k] / (kPi * (radii_mm[k] * radii_mm[k] - inner * inner));
  }
  const auto density_at = [&](double radius) {
    const auto k =
        static_cast<std::size_t>(std::upper_bound(radii_mm.begin(), radii_mm.end(), radius) - radii_mm.begin());
    return k < density.size() ? density[k] : 0.0;
  };
  cv::Mat wrapped(whole_, CV_32FC1, cv::Scalar(0.0));
  const int reach_x = std::min(reach_, columns_ - 1);
  const int reach_y = std::min(reach_, rows_ - 1);
  constexpr int kNear = 5;  // cells, in which the kernel is steep
  for (int dy = -reach_y; dy <= reach_y; ++dy) {
    for (int dx = -reach_x; dx <= reach_x; ++dx) {
      const int parts = std::max(std::abs(dx), std::abs(dy)) <= kNear ? 32 : 4;
      double sum = 0.0;
      for (int j = 0; j < parts; ++j) {
        for (int i = 0; i < parts; ++i) {
          const double x = (dx + (i + 0.5) / parts - 0.5) * cell_mm_;
          const double y = (dy + (j + 0.5) / parts - 0.5) * cell_mm_;
          sum += density_at(std::hypot(x, y)) * factor_of(symmetry, x, y);
        }
      }
      const double mean = sum * cell_mm_ * cell_mm_ / (parts * parts);
      // (k * f)(x) = sum k(d) f(x + d) is the convolution with k(-d).
      const int column = dx > 0 ? whole_.width - dx : -dx;
      const int row = dy > 0 ? whole_.height - dy : -dy;
      wrapped.at<float>(row, column) = static_cast<float>(mean);
    }
  }
  FaceKernel out;
  cv::Mat packed;
  cv::dft(wrapped, packed);
  if (is_even(symmetry)) {
    out.real_factors = real_factors(packed);
  } else {
    out.packed = packed;
  }
  return out;
}

cv::Mat FaceConvolution::spectrum(const cv::Mat& field) const {
  TS_ASSERT(field.type() == CV_32FC1 && field.cols == columns_ && field.rows == rows_);
  cv::Mat whole(whole_, CV_32FC1, cv::Scalar(0.0));
  field.copyTo(whole(cv::Rect(0, 0, columns_, rows_)));
  cv::Mat packed;
  cv::dft(whole, packed, 0, rows_);
  return packed;
}

void FaceConvolution::add(const cv::Mat& spectrum, const FaceKernel& kernel, cv::Mat& sum) const {
  cv::Mat product;
  if (kernel.packed.empty()) {
    product = spectrum.mul(kernel.real_factors);
  } else {
    cv::mulSpectrums(spectrum, kernel.packed, product, 0);
  }
  if (sum.empty()) {
    sum = product;
  } else {
    sum += product;
  }
}

cv::Mat FaceConvolution::field(const cv::Mat& sum) const {
  if (sum.empty()) return cv::Mat(rows_, columns_, CV_32FC1, cv::Scalar(0.0));
  cv::Mat whole;
  cv::dft(sum, whole, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT, rows_);
  return whole(cv::Rect(0, 0, columns_, rows_));
}

}  // namespace touchstone::render
