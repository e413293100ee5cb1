#include "sensors/lamp_model.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/height_map.h"

namespace touchstone::sensors {
namespace {

constexpr int kMostTerms = 6;
constexpr double kDarkest_DN = 4.0;  // a background below isn't divided by
constexpr double kLargestGain = 6.0;

Eigen::Vector2d centred(const Eigen::Vector2d& place, int width, int height) {
  return {(2.0 * place.x() - width) / width, (2.0 * place.y() - height) / width};
}

std::array<double, kMostTerms> powers(const Eigen::Vector2d& x) {
  return {1.0, x.x(), x.y(), x.x() * x.x(), x.x() * x.y(), x.y() * x.y()};
}

/// n - n_rest.
Eigen::Vector3d tilt(const Eigen::Vector2d& slope) {
  return normal_of(slope) - Eigen::Vector3d::UnitZ();
}

/// The tilt's derivative by the slope.
Eigen::Matrix<double, 3, 2> tilt_derivative(const Eigen::Vector2d& slope) {
  const double length = std::sqrt(1.0 + slope.squaredNorm());
  const Eigen::Vector3d raw(-slope.x(), -slope.y(), 1.0);
  Eigen::Matrix<double, 3, 2> derivative = -raw * slope.transpose() / (length * length * length);
  derivative(0, 0) -= 1.0 / length;
  derivative(1, 1) -= 1.0 / length;
  return derivative;
}

/// What the middle would most likely have shown where the lamps `here` show a colour: the linear estimate of least mean
/// square error for tilts of the usual size and colours that matt shading misses by some digital numbers. It is
/// middle * here^-1 where that is well determined, and fades out along what the lamps don't tell.
Eigen::Matrix3d likeliest_map(const Eigen::Matrix3d& middle, const Eigen::Matrix3d& here) {
  const Eigen::Vector3d usual_tilt(0.1, 0.1, 0.02);  // variances of the normals of a press
  constexpr double kMisfit_DN = 3.0;
  const Eigen::Matrix3d spread = usual_tilt.asDiagonal() * here.transpose();
  const Eigen::Matrix3d seen = here * spread + kMisfit_DN * kMisfit_DN * Eigen::Matrix3d::Identity();
  return middle * spread * seen.inverse();
}

}  // namespace

const char* name_of(LightCorrection correction) {
  switch (correction) {
    case LightCorrection::none:
      return "none";
    case LightCorrection::background:
      return "background";
    case LightCorrection::fitted:
      break;
  }
  return "fitted";
}

int term_count(int order) {
  TS_ASSERT(order >= 0 && order <= 2);
  return (order + 1) * (order + 2) / 2;
}

Eigen::Matrix3d LampModel::at(const Eigen::Vector2d& place) const {
  const auto factors = powers(centred(place, width, height));
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < terms.size(); ++k) a += factors[k] * terms[k];
  return a;
}

LampModel fit_lamps(std::span<const ColourSample> samples, const cv::Size& size, int order, double steepest) {
  const int terms = term_count(order);
  const int unknowns = 3 * terms;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(unknowns, 3);
  Eigen::VectorXd row(unknowns);
  int used = 0;
  for (const ColourSample& sample : samples) {
    if (sample.slope.norm() > steepest) continue;
    const auto factors = powers(centred(sample.place.cast<double>(), size.width, size.height));
    const Eigen::Vector3d t = tilt(sample.slope.cast<double>());
    for (int k = 0; k < terms; ++k) row.segment<3>(3 * k) = factors[static_cast<std::size_t>(k)] * t;
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row);
    right += row * sample.colour.cast<double>().transpose();
    ++used;
  }
  if (used < 10 * unknowns) {
    fail("{} calibration pixels with slopes up to {}; {} are needed to find the lamps", used, steepest, 10 * unknowns);
  }
  normal = Eigen::MatrixXd(normal.selfadjointView<Eigen::Lower>());
  // In units of each unknown's own size, so that the pivots tell how well the presses' places determine it.
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> factor(scale.asDiagonal() * normal * scale.asDiagonal());
  if (factor.info() != Eigen::Success || factor.vectorD().minCoeff() < 1e-6) {
    fail("the presses don't determine a light that varies with order {} over the picture: press in more places", order);
  }
  const Eigen::MatrixXd solution = scale.asDiagonal() * factor.solve(scale.asDiagonal() * right);
  LampModel model;
  model.width = size.width;
  model.height = size.height;
  model.order = order;
  for (int k = 0; k < terms; ++k) model.terms.push_back(solution.middleRows<3>(3 * k).transpose());
  return model;
}

Eigen::Vector2d slope_by_lamps(const Eigen::Matrix3d& a, const Eigen::Vector3d& colour, double limit) {
  constexpr int kSteps = 6;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Vector3d miss = colour - a * tilt(slope);
    const Eigen::Matrix<double, 3, 2> derivative = a * tilt_derivative(slope);
    // A little damping: far out, normals hardly change with the slope.
    Eigen::Matrix2d normal = derivative.transpose() * derivative;
    normal.diagonal().array() += 1e-3 * (a.squaredNorm() + 1e-30);
    slope += normal.inverse() * (derivative.transpose() * miss);
    if (const double length = slope.norm(); length > limit) slope *= limit / length;
  }
  return slope;
}

ColourCorrection ColourCorrection::by_background(const cv::Mat& background_mean) {
  TS_ASSERT(background_mean.type() == CV_32FC3);
  ColourCorrection correction;
  cv::Mat smooth;
  const double sigma = background_mean.cols / 32.0;  // over noise, dust and markers, not over the lamps' fall-off
  cv::GaussianBlur(background_mean, smooth, {}, sigma, sigma, cv::BORDER_REPLICATE);
  const cv::Scalar mean = cv::mean(smooth);
  correction.gains_.create(smooth.size(), CV_32FC3);
  for (int v = 0; v < smooth.rows; ++v) {
    for (int u = 0; u < smooth.cols; ++u) {
      for (int c = 0; c < 3; ++c) {
        const double gain = mean[c] / std::max<double>(smooth.at<cv::Vec3f>(v, u)[c], kDarkest_DN);
        correction.gains_.at<cv::Vec3f>(v, u)[c] =
            static_cast<float>(std::clamp(gain, 1.0 / kLargestGain, kLargestGain));
      }
    }
  }
  return correction;
}

ColourCorrection ColourCorrection::by_lamps(const cv::Mat& background_mean, const LampModel& lamps) {
  TS_ASSERT(!lamps.terms.empty());
  ColourCorrection correction = by_background(background_mean);
  correction.lamps_ = lamps;
  correction.middle_ = lamps.at({0.5 * lamps.width, 0.5 * lamps.height});
  return correction;
}

Eigen::Matrix3d ColourCorrection::at(const Eigen::Vector2d& place) const {
  if (gains_.empty()) return Eigen::Matrix3d::Identity();
  const int u = std::clamp(static_cast<int>(place.x()), 0, gains_.cols - 1);
  const int v = std::clamp(static_cast<int>(place.y()), 0, gains_.rows - 1);
  const cv::Vec3f gain = gains_.at<cv::Vec3f>(v, u);
  const Eigen::Matrix3d scale = Eigen::Vector3d(gain[0], gain[1], gain[2]).asDiagonal();
  return lamps_.terms.empty() ? scale : likeliest_map(middle_, lamps_.at(place)) * scale;
}

}  // namespace touchstone::sensors
