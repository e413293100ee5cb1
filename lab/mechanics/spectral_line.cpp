#include "lab/mechanics/spectral_line.h"

#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::lab {

std::vector<std::complex<double>> spectral_lines(std::span<const double> signal) {
  const std::size_t count = signal.size();
  if (count == 0) return {};
  double mean = 0.0;
  for (double value : signal) mean += value / static_cast<double>(count);
  cv::Mat swing(1, static_cast<int>(count), CV_64F);
  for (std::size_t i = 0; i < count; ++i) swing.at<double>(0, static_cast<int>(i)) = signal[i] - mean;
  cv::Mat spectrum;
  cv::dft(swing, spectrum, cv::DFT_COMPLEX_OUTPUT);
  std::vector<std::complex<double>> lines(count / 2 + 1);
  for (std::size_t k = 1; k < lines.size(); ++k) {
    // Both halves of the spectrum make one cosine; the line in the middle is its own other half.
    const double halves = 2 * k == count ? 1.0 : 2.0;
    const auto& value = spectrum.at<cv::Vec2d>(0, static_cast<int>(k));
    lines[k] = halves / static_cast<double>(count) * std::complex(value[0], value[1]);
  }
  return lines;
}

std::size_t strongest_line(std::span<const std::complex<double>> lines) {
  TS_ASSERT(!lines.empty());
  std::size_t strongest = 0;
  for (std::size_t k = 1; k < lines.size(); ++k) {
    if (std::abs(lines[k]) > std::abs(lines[strongest])) strongest = k;
  }
  return strongest;
}

}  // namespace touchstone::lab
