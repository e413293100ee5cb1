#include "sim/sensor/residual_light.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/error.h"

namespace touchstone::sim {
namespace {

constexpr int kPixelsATask = 512;
constexpr double kLeastDeterminant = 1e-9;  // of colours' correlations: 1 where they're orthogonal

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

Eigen::Matrix3Xd numbers_per_irradiance(const render::Imager& imager) {
  if (imager.quantum_efficiency.rows() != 3) fail("a residual map is for a colour camera, and this one is grey");
  constexpr double kDelivered = 255.0;
  const double full_scale = std::pow(2.0, imager.bits) - 1.0 - imager.black_level_DN;
  Eigen::Matrix3Xd out(3, imager.quantum_efficiency.cols());
  for (int c = 0; c < 3; ++c) {
    const render::Imager channel = render::channel_imager(imager, c);
    const render::ImagerResponse response = render::response_of(channel);
    out.row(c) = imager.white_balance[c] * channel.gain_DN_per_e * kDelivered / full_scale *
                 response.electrons_per_irradiance.row(0);
  }
  return out;
}

cv::Mat linear_numbers(const cv::Mat& light, const Eigen::Matrix3Xd& numbers_per_irradiance) {
  TS_ASSERT(light.depth() == CV_32F && light.channels() == numbers_per_irradiance.cols());
  cv::Mat numbers(light.size(), CV_32FC3);
  const int bands = light.channels();
  for (int v = 0; v < light.rows; ++v) {
    const float* from = light.ptr<float>(v);
    float* to = numbers.ptr<float>(v);
    for (int u = 0; u < light.cols; ++u) {
      for (int c = 0; c < 3; ++c) {
        double sum = 0.0;
        for (int b = 0; b < bands; ++b) sum += numbers_per_irradiance(c, b) * double(from[u * bands + b]);
        to[3 * u + c] = static_cast<float>(sum);
      }
    }
  }
  return numbers;
}

ResidualLight::ResidualLight(ResidualMap map, const render::Imager& imager) : map_(std::move(map)) {
  const Eigen::Matrix3Xd numbers = numbers_per_irradiance(imager);
  const Eigen::Matrix3d square = numbers * numbers.transpose();
  const double scale = square.diagonal().prod();
  if (!(square.determinant() > kLeastDeterminant * scale)) {
    fail("residual map: the camera's three colours don't tell the device's {} bands apart", numbers.cols());
  }
  irradiance_per_number_ = numbers.transpose() * square.inverse();
}

cv::Mat ResidualLight::corrected(const cv::Mat& light, const cv::Mat& height) const {
  TS_ASSERT(light.size() == height.size() && light.channels() == irradiance_per_number_.rows());
  const cv::Mat numbers = residual_numbers(map_, height);
  cv::Mat out = light.clone();
  const int bands = light.channels();
  for (int v = 0; v < out.rows; ++v) {
    const float* from = numbers.ptr<float>(v);
    float* to = out.ptr<float>(v);
    for (int u = 0; u < out.cols; ++u) {
      for (int b = 0; b < bands; ++b) {
        double sum = double(to[u * bands + b]);
        for (int c = 0; c < 3; ++c) sum += irradiance_per_number_(b, c) * double(from[3 * u + c]);
        to[u * bands + b] = static_cast<float>(std::max(sum, 0.0));
      }
    }
  }
  return out;
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

}  // namespace touchstone::sim
