#include "sim/sensor/colour_numbers.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <variant>

#include "core/error.h"
#include "render/imager/tone_curve.h"

namespace touchstone::sim {
namespace {

constexpr double kFullScale = 255.0;
constexpr double kLeastDeterminant = 1e-9;  // of colours' correlations: 1 where they're orthogonal

}  // namespace

Eigen::Matrix3Xd numbers_per_irradiance(const render::Imager& imager) {
  if (imager.quantum_efficiency.rows() != 3)
    fail("what is learned from a unit's frames is for colour cameras, and this one is grey");
  const double full_scale = std::pow(2.0, imager.bits) - 1.0 - imager.black_level_DN;
  Eigen::Matrix3Xd out(3, imager.quantum_efficiency.cols());
  for (int c = 0; c < 3; ++c) {
    const render::Imager channel = render::channel_imager(imager, c);
    const render::ImagerResponse response = render::response_of(channel);
    out.row(c) = imager.white_balance[c] * channel.gain_DN_per_e * kFullScale / full_scale *
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

Eigen::MatrixX3d irradiance_per_number(const render::Imager& imager) {
  const Eigen::Matrix3Xd numbers = numbers_per_irradiance(imager);
  const Eigen::Matrix3d square = numbers * numbers.transpose();
  const double scale = square.diagonal().prod();
  if (!(square.determinant() > kLeastDeterminant * scale)) {
    fail("the camera's three colours don't tell the device's {} bands apart", numbers.cols());
  }
  return numbers.transpose() * square.inverse();
}

cv::Mat linear_of_delivered(const cv::Mat& delivered, const render::ToneCurve& curve) {
  TS_ASSERT(delivered.channels() == 3);
  const bool is_linear = std::holds_alternative<render::LinearTone>(curve);
  cv::Mat numbers, out(delivered.size(), CV_32FC3);
  delivered.convertTo(numbers, CV_32F);
  for (int v = 0; v < numbers.rows; ++v) {
    for (int u = 0; u < numbers.cols; ++u) {
      const cv::Vec3f from = numbers.at<cv::Vec3f>(v, u);
      for (int c = 0; c < 3; ++c) {
        const double number = from[2 - c];
        out.at<cv::Vec3f>(v, u)[c] = static_cast<float>(
            is_linear ? number : kFullScale * render::linear_of(curve, std::clamp(number / kFullScale, 0.0, 1.0)));
      }
    }
  }
  return out;
}

cv::Mat with_numbers(const cv::Mat& light, const cv::Mat& numbers, const Eigen::MatrixX3d& irradiance_per_number) {
  TS_ASSERT(light.size() == numbers.size() && light.channels() == irradiance_per_number.rows());
  TS_ASSERT(light.depth() == CV_32F && numbers.type() == CV_32FC3);
  cv::Mat out = light.clone();
  const int bands = light.channels();
  for (int v = 0; v < out.rows; ++v) {
    const float* from = numbers.ptr<float>(v);
    float* to = out.ptr<float>(v);
    for (int u = 0; u < out.cols; ++u) {
      for (int b = 0; b < bands; ++b) {
        double sum = double(to[u * bands + b]);
        for (int c = 0; c < 3; ++c) sum += irradiance_per_number(b, c) * double(from[3 * u + c]);
        to[u * bands + b] = static_cast<float>(std::max(sum, 0.0));
      }
    }
  }
  return out;
}

}  // namespace touchstone::sim
