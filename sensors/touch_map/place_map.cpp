#include "sensors/touch_map/place_map.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/dense_solvers.h"
#include "core/error.h"

namespace touchstone::sensors {
namespace {

using Terms = Eigen::Matrix<double, 10, 1>;

constexpr std::size_t kLeastMarks = 20;  // twice the unknowns of a coordinate

Terms terms_of(const Eigen::Vector2d& p) {
  const double x = p.x(), y = p.y();
  Terms terms;
  terms << 1.0, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
  return terms;
}

}  // namespace

Eigen::Vector2d PlaceMap::pixel_of(const Eigen::Vector2d& place) const {
  return terms.transpose() * terms_of(place);
}

PlaceMap fit_place_map(std::span<const Eigen::Vector2d> pixels, std::span<const Eigen::Vector2d> places,
                       const cv::Size& size) {
  if (pixels.size() != places.size()) fail("{} marks are seen but {} places given", pixels.size(), places.size());
  if (pixels.size() < kLeastMarks) fail("{} marks; at least {} are needed", pixels.size(), kLeastMarks);
  const auto count = static_cast<Eigen::Index>(pixels.size());
  Eigen::MatrixXd rows(count, 10);
  Eigen::MatrixXd wanted(count, 2);
  for (Eigen::Index i = 0; i < count; ++i) {
    if (!pixels[i].allFinite() || !places[i].allFinite()) fail("mark {} isn't finite", i);
    rows.row(i) = terms_of(places[i]).transpose();
    wanted.row(i) = pixels[i].transpose();
  }
  const Eigen::VectorXd scale = rows.colwise().norm().cwiseMax(1e-12);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor(rows * scale.cwiseInverse().asDiagonal());
  if (factor.rank() < 10) fail("the marks' places don't determine where pixels look: spread them over the picture");
  PlaceMap map;
  map.size = size;
  map.terms = scale.cwiseInverse().asDiagonal() * factor.solve(wanted);
  map.rms_px = std::sqrt((rows * map.terms - wanted).squaredNorm() / static_cast<double>(count));
  const Eigen::Matrix2d slope = map.terms.middleRows<2>(1);
  const double area = std::abs(slope.determinant());  // px^2 per mm^2
  if (!(area > 0.0) || !std::isfinite(area)) fail("the marks' pixels don't move with their places");
  map.mm_per_px = 1.0 / std::sqrt(area);
  return map;
}

TouchImage rectified(const cv::Mat& height_mm, const cv::Mat& contact, const PlaceMap& map) {
  TouchImage seen{height_mm, contact, map.mm_per_px};
  check(seen);
  if (height_mm.size() != map.size) {
    fail("the heights are {} x {}, the map of places is for {} x {}", height_mm.cols, height_mm.rows, map.size.width,
         map.size.height);
  }
  const PixelFrame frame = touch_frame(map.size, map.mm_per_px);
  cv::Mat from(map.size, CV_32FC2);
  for (int v = 0; v < from.rows; ++v) {
    for (int u = 0; u < from.cols; ++u) {
      const Eigen::Vector2d pixel = map.pixel_of(frame.point_of({u, v}));
      from.at<cv::Vec2f>(v, u) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
    }
  }
  TouchImage touch;
  touch.mm_per_px = map.mm_per_px;
  cv::remap(height_mm, touch.height_mm, from, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::remap(contact, touch.contact, from, cv::noArray(), cv::INTER_NEAREST, cv::BORDER_CONSTANT, 0);
  return touch;
}

}  // namespace touchstone::sensors
