#include "sim/sensor/residual_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/error.h"
#include "sim/sensor/colour_numbers.h"

namespace touchstone::sim {
namespace {

constexpr int kPixelsATask = 512;

double clamped(const cv::Mat& height, int v, int u) {
  return height.at<float>(std::clamp(v, 0, height.rows - 1), std::clamp(u, 0, height.cols - 1));
}

Eigen::MatrixXd centres_of(const ResidualMap& map) {
  Eigen::MatrixXd centres(map.features(), static_cast<Eigen::Index>(map.centres.size()));
  for (std::size_t k = 0; k < map.centres.size(); ++k) {
    centres.col(static_cast<Eigen::Index>(k)) =
        Eigen::Map<const Eigen::VectorXd>(map.centres[k].data(), centres.rows());
  }
  return centres;
}

}  // namespace

Eigen::MatrixXd residual_features(const ResidualMap& map, const cv::Mat& height, int stride) {
  TS_ASSERT(height.type() == CV_32FC1 && stride > 0);
  cv::Mat known = height.clone();
  cv::patchNaNs(known, 0.0);
  const int columns = (height.cols + stride - 1) / stride;
  const int rows = (height.rows + stride - 1) / stride;
  Eigen::MatrixXd features(map.features(), static_cast<Eigen::Index>(columns) * rows);
  Eigen::Index first = 0;
  for (const double width_mm : map.neighbourhoods_mm) {
    const double sigma = width_mm / map.mm_per_px;
    cv::Mat smooth;
    cv::GaussianBlur(known, smooth, {0, 0}, sigma, sigma, cv::BORDER_REPLICATE);
    const double per_slope = 0.5 / map.mm_per_px / map.slope_scale;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const int v = row * stride, u = column * stride;
        const Eigen::Index pixel = static_cast<Eigen::Index>(row) * columns + column;
        features(first, pixel) = per_slope * (clamped(smooth, v, u + 1) - clamped(smooth, v, u - 1));
        features(first + 1, pixel) = per_slope * (clamped(smooth, v + 1, u) - clamped(smooth, v - 1, u));
        features(first + 2, pixel) = smooth.at<float>(v, u) / map.height_scale_mm;
      }
    }
    first += 3;
  }
  if (map.place_scale_mm) {
    const double scale = map.mm_per_px / *map.place_scale_mm;
    for (Eigen::Index pixel = 0; pixel < features.cols(); ++pixel) {
      const int u = static_cast<int>(pixel % columns) * stride, v = static_cast<int>(pixel / columns) * stride;
      features(first, pixel) = scale * (u + 0.5 - 0.5 * height.cols);
      features(first + 1, pixel) = scale * (v + 0.5 - 0.5 * height.rows);
    }
  }
  return features;
}

Eigen::MatrixXd residual_bumps(const Eigen::MatrixXd& centres, const Eigen::MatrixXd& features, bool place) {
  TS_ASSERT(centres.rows() == features.rows());
  const Eigen::Index shape = features.rows() - (place ? 2 : 0);
  // exp(a + b) - exp(a) with a = -(|p|^2 + |c|^2) / 2 and b = p.c is exactly zero at p = 0.
  Eigen::ArrayXXd along = (centres.topRows(shape).transpose() * features.topRows(shape)).array();
  const Eigen::ArrayXd of_centres = 0.5 * centres.topRows(shape).colwise().squaredNorm().transpose().array();
  const Eigen::ArrayXd of_features = 0.5 * features.topRows(shape).colwise().squaredNorm().transpose().array();
  Eigen::ArrayXXd bumps(along.rows(), along.cols());
  for (Eigen::Index i = 0; i < along.cols(); ++i) {
    Eigen::ArrayXd near = -of_centres - of_features[i];
    if (place) {
      near -=
          0.5 * (centres.bottomRows(2).colwise() - features.col(i).tail(2)).colwise().squaredNorm().transpose().array();
    }
    bumps.col(i) = (near + along.col(i)).exp() - near.exp();
  }
  return bumps.matrix();
}

cv::Mat residual_numbers(const ResidualMap& map, const cv::Mat& height) {
  TS_ASSERT(height.cols == map.width_px && height.rows == map.height_px);
  cv::Mat numbers = cv::Mat::zeros(height.size(), CV_32FC3);
  if (map.centres.empty()) return numbers;
  const Eigen::MatrixXd centres = centres_of(map);
  Eigen::Matrix3Xd weights(3, centres.cols());
  for (Eigen::Index k = 0; k < weights.cols(); ++k) weights.col(k) = map.weights_DN[static_cast<std::size_t>(k)];
  const Eigen::MatrixXd features = residual_features(map, height);
  const auto pixels = static_cast<int>(features.cols());
  tbb::parallel_for(0, (pixels + kPixelsATask - 1) / kPixelsATask, [&](int task) {
    const int first = task * kPixelsATask;
    const int count = std::min(kPixelsATask, pixels - first);
    const Eigen::Matrix3Xd part =
        weights * residual_bumps(centres, features.middleCols(first, count), map.place_scale_mm.has_value());
    for (int i = 0; i < count; ++i) {
      for (int c = 0; c < 3; ++c) numbers.ptr<float>()[3 * (first + i) + c] = static_cast<float>(part(c, i));
    }
  });
  return numbers;
}

ResidualLight::ResidualLight(ResidualMap map, const render::Imager& imager)
    : map_(std::move(map)), irradiance_per_number_(irradiance_per_number(imager)) {}

cv::Mat ResidualLight::corrected(const cv::Mat& light, const cv::Mat& height) const {
  TS_ASSERT(light.size() == height.size());
  return with_numbers(light, residual_numbers(map_, height), irradiance_per_number_);
}

cv::Mat pressed_in(const std::vector<render::FirstHit>& rest, const std::vector<render::FirstHit>& now, cv::Size size) {
  TS_ASSERT(rest.size() == now.size() && now.size() == static_cast<std::size_t>(size.area()));
  cv::Mat height(size, CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i].object != 0 || rest[i].object != 0) continue;
    height.ptr<float>()[i] = static_cast<float>(rest[i].position.z() - now[i].position.z());
  }
  return height;
}

cv::Mat in_contact(const std::vector<render::FirstHit>& rest, const std::vector<render::FirstHit>& now,
                   const GelSheet& sheet, cv::Size size) {
  TS_ASSERT(rest.size() == now.size() && now.size() == static_cast<std::size_t>(size.area()));
  cv::Mat contact(size, CV_8U, cv::Scalar(0));
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i].object != 0 || rest[i].object != 0) continue;
    if (sheet.touched[static_cast<std::size_t>(now[i].triangle)] >= 0) contact.ptr<std::uint8_t>()[i] = 255;
  }
  return contact;
}

}  // namespace touchstone::sim
