#include "lab/studies/centroid_bound.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"

namespace touchstone::lab {
namespace {

/// Mean electrons of each pixel in one of the imager's channels, CV_64FC1.
cv::Mat electrons(const cv::Mat& irradiance, const render::ImagerResponse& response, int row) {
  const int bands = irradiance.channels();
  cv::Mat picture(irradiance.size(), CV_64FC1);
  for (int y = 0; y < irradiance.rows; ++y) {
    const auto* light = irradiance.ptr<float>(y);
    auto* out = picture.ptr<double>(y);
    for (int x = 0; x < irradiance.cols; ++x, light += bands) {
      double sum = 0.0;
      for (int b = 0; b < bands; ++b) sum += response.electrons_per_irradiance(row, b) * light[b];
      out[x] = sum;
    }
  }
  return picture;
}

/// Calls `pixel(u, v, mean electrons of all, 1 / variance)` for each raw pixel of `area` that knows something, (u, v)
/// from its corner, channel by channel with `begin(response)` before each.
template <typename Begin, typename Pixel>
void for_each_raw_pixel(const cv::Mat& irradiance, const render::Imager& imager, const cv::Rect& area,
                        const Begin& begin, const Pixel& pixel) {
  const auto channels = static_cast<int>(imager.quantum_efficiency.rows());
  const double most_DN = std::ldexp(1.0, imager.bits) - 1.0;
  const bool mosaic = channels == 3 && imager.bayer != render::BayerPattern::binned;
  for (int channel = 0; channel < channels; ++channel) {
    const render::Imager one = render::channel_imager(imager, channel);
    const render::ImagerResponse response = render::response_of(one);
    const cv::Mat e = electrons(irradiance(area), response, 0);
    begin(response);
    for (int v = 0; v < area.height; ++v) {
      for (int u = 0; u < area.width; ++u) {
        if (mosaic && render::channel_of(imager.bayer, area.x + u, area.y + v) != channel) continue;
        const double mean = e.at<double>(v, u);
        const double full = mean + response.dark_e;
        if (full >= response.full_well_e || one.black_level_DN + one.gain_DN_per_e * full >= most_DN) continue;
        pixel(u, v, e, 1.0 / std::pow(render::noise_e(response, mean), 2));
      }
    }
  }
}

void check_bands(const cv::Mat& picture, const render::Imager& imager) {
  const auto bands = static_cast<int>(imager.quantum_efficiency.cols());
  if (picture.depth() != CV_32F || picture.channels() != bands) {
    fail("the light is a picture of {} channels, the imager has {} bands", picture.channels(), bands);
  }
}

}  // namespace

Eigen::Matrix2d shift_information(const cv::Mat& irradiance, const render::Imager& imager,
                                  const Eigen::Vector2d& centre_px, double radius_px) {
  check_bands(irradiance, imager);
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  const cv::Rect whole(0, 0, irradiance.cols, irradiance.rows);
  const int x = static_cast<int>(std::floor(centre_px.x() - radius_px)) - 1;
  const int y = static_cast<int>(std::floor(centre_px.y() - radius_px)) - 1;
  const int wide = static_cast<int>(std::ceil(2.0 * radius_px)) + 3;
  const cv::Rect area = cv::Rect(x, y, wide, wide) & whole;
  if (area.width < 3 || area.height < 3) return information;
  for_each_raw_pixel(
      irradiance, imager, area, [](const render::ImagerResponse&) {},
      [&](int u, int v, const cv::Mat& e, double weight) {
        // The border has no central differences.
        if (u == 0 || v == 0 || u + 1 == area.width || v + 1 == area.height) return;
        if ((Eigen::Vector2d(area.x + u + 0.5, area.y + v + 0.5) - centre_px).norm() > radius_px) return;
        const Eigen::Vector2d gradient(0.5 * (e.at<double>(v, u + 1) - e.at<double>(v, u - 1)),
                                       0.5 * (e.at<double>(v + 1, u) - e.at<double>(v - 1, u)));
        information += weight * gradient * gradient.transpose();
      });
  return information;
}

Eigen::MatrixXd picture_information(const cv::Mat& irradiance, const std::vector<cv::Mat>& slopes,
                                    const render::Imager& imager) {
  check_bands(irradiance, imager);
  const auto n = static_cast<Eigen::Index>(slopes.size());
  TS_ASSERT(n > 0);
  for (const cv::Mat& slope : slopes) {
    check_bands(slope, imager);
    TS_ASSERT(slope.size() == irradiance.size());
  }
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd of_pixel(n);
  std::vector<cv::Mat> change(slopes.size());
  for_each_raw_pixel(
      irradiance, imager, {0, 0, irradiance.cols, irradiance.rows},
      [&](const render::ImagerResponse& response) {
        for (std::size_t k = 0; k < slopes.size(); ++k) change[k] = electrons(slopes[k], response, 0);
      },
      [&](int u, int v, const cv::Mat&, double weight) {
        for (Eigen::Index k = 0; k < n; ++k) of_pixel[k] = change[static_cast<std::size_t>(k)].at<double>(v, u);
        information += weight * of_pixel * of_pixel.transpose();
      });
  return information;
}

double least_deviation_px(const Eigen::Matrix2d& information) {
  const double determinant = information.determinant();
  if (!(determinant > 1e-12 * std::pow(information.trace(), 2))) return std::numeric_limits<double>::infinity();
  return std::sqrt(0.5 * information.trace() / determinant);  // trace of the inverse of a 2 x 2 matrix
}

}  // namespace touchstone::lab
