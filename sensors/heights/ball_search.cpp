#include "sensors/heights/ball_search.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/heights/ball_imprint.h"

namespace touchstone::sensors {
namespace {

constexpr double kBall_px = 15.0;     // of the search: finer shows no more of where a ball is
constexpr double kSmallestSide = 80;  // px of the search, of the picture's larger side
constexpr double kSmallest_px = 3.0;  // contact radius
constexpr double kWindow = 2.0;       // contact radii: what the imprint is compared within
constexpr std::array kContacts = {0.85, 0.7, 0.55, 0.4, 0.28, 0.2, 0.14, 0.1, 0.07, 0.05};  // by the ball's radius
constexpr int kFiner = 4;                                                                   // radial steps a pixel

/// An image each of the channels' products with the kernels, then the energy that their best linear function has.
cv::Mat energy_of(const std::vector<cv::Mat>& channels, const std::vector<cv::Mat>& kernels,
                  const Eigen::Matrix3d& inverse) {
  cv::Mat energy = cv::Mat::zeros(channels[0].size(), CV_32FC1);
  for (const cv::Mat& channel : channels) {
    std::array<cv::Mat, 3> right;
    for (std::size_t i = 0; i < 3; ++i) {
      cv::filter2D(channel, right[i], CV_32F, kernels[i], {-1, -1}, 0.0, cv::BORDER_CONSTANT);
    }
    for (int v = 0; v < energy.rows; ++v) {
      const float* const parts[] = {right[0].ptr<float>(v), right[1].ptr<float>(v), right[2].ptr<float>(v)};
      auto* const out = energy.ptr<float>(v);
      for (int u = 0; u < energy.cols; ++u) {
        const Eigen::Vector3d r(parts[0][u], parts[1][u], parts[2][u]);
        out[u] += static_cast<float>(r.dot(inverse * r));
      }
    }
  }
  return energy;
}

}  // namespace

BallSearch::BallSearch(const cv::Size& size, double ball_px, double thickness_px) : size_(size) {
  TS_ASSERT(ball_px > 0.0 && thickness_px > 0.0 && !size.empty());
  const double side = std::max(size.width, size.height);
  shrink_ = std::max(1.0, std::min(ball_px / kBall_px, side / kSmallestSide));
  ball_ = ball_px / shrink_;
  const double smaller = std::min(size.width, size.height) / shrink_;
  for (const double contact : kContacts) {
    const double radius = contact * ball_;
    const bool last_resort = contact == kContacts.back() && sizes_.empty();
    if ((radius < kSmallest_px && !sizes_.empty()) || (radius > 0.5 * smaller && !last_resort)) continue;
    const BallImprint imprint(ball_, radius, thickness_px / shrink_);
    Size made;
    made.contact = contact;
    const auto longest = static_cast<int>(std::ceil(kFiner * std::hypot(size.width, size.height) / shrink_)) + 2;
    for (int i = 0; i < longest; ++i) {
      const double r = static_cast<double>(i) / kFiner;
      const double slope = imprint.slope(r);
      const double length = std::sqrt(1.0 + slope * slope);
      made.tilt_over_r.push_back(static_cast<float>(r > 0.0 ? -slope / (r * length) : 1.0 / ball_));
      made.lift.push_back(static_cast<float>(1.0 / length - 1.0));
    }
    const int half = std::min(static_cast<int>(kWindow * radius) + 1, static_cast<int>(side / shrink_));
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
    for (int i = 0; i < 3; ++i) made.tilts.push_back(cv::Mat::zeros(2 * half + 1, 2 * half + 1, CV_32FC1));
    for (int y = -half; y <= half; ++y) {
      for (int x = -half; x <= half; ++x) {
        const double r = std::hypot(x, y);
        const auto at = static_cast<std::size_t>(std::lround(kFiner * r));
        if (r > kWindow * radius || at >= made.lift.size()) continue;
        const Eigen::Vector3d tilt(made.tilt_over_r[at] * static_cast<float>(x),
                                   made.tilt_over_r[at] * static_cast<float>(y), made.lift[at]);
        for (int i = 0; i < 3; ++i) {
          made.tilts[static_cast<std::size_t>(i)].at<float>(y + half, x + half) = static_cast<float>(tilt[i]);
        }
        products += tilt * tilt.transpose();
      }
    }
    products.diagonal().array() += 1e-9 * products.trace();
    made.inverse = products.inverse();
    sizes_.push_back(std::move(made));
  }
}

cv::Mat BallSearch::shrunk(const cv::Mat& difference) const {
  TS_ASSERT(difference.type() == CV_32FC3 && difference.size() == size_);
  if (shrink_ <= 1.0) return difference;
  cv::Mat small;
  const cv::Size size(std::max(1, static_cast<int>(std::lround(size_.width / shrink_))),
                      std::max(1, static_cast<int>(std::lround(size_.height / shrink_))));
  cv::resize(difference, small, size, 0.0, 0.0, cv::INTER_AREA);
  return small;
}

/// Over all sizes and the places where `allowed` (CV_8UC1; empty: everywhere) isn't 0.
std::optional<BallSighting> BallSearch::best_of(const cv::Mat& small, const cv::Mat& allowed) const {
  std::vector<cv::Mat> channels;
  cv::split(small, channels);
  std::optional<BallSighting> best;
  for (const Size& size : sizes_) {
    const cv::Mat energy = energy_of(channels, size.tilts, size.inverse);
    double highest = 0.0;
    cv::Point place(-1, -1);
    cv::minMaxLoc(energy, nullptr, &highest, nullptr, &place, allowed);
    if (place.x < 0 || (best && highest <= best->energy)) continue;
    best = {{(place.x + 0.5) * size_.width / small.cols, (place.y + 0.5) * size_.height / small.rows},
            size.contact,
            highest};
  }
  return best;
}

BallSighting BallSearch::find(const cv::Mat& difference) const {
  const std::optional<BallSighting> best = best_of(shrunk(difference), {});
  TS_ASSERT(best);
  return *best;
}

BallSighting BallSearch::look_at(const cv::Mat& difference, const Eigen::Vector2d& centre) const {
  const cv::Mat small = shrunk(difference);
  cv::Mat allowed = cv::Mat::zeros(small.size(), CV_8UC1);
  const int u = std::clamp(static_cast<int>(centre.x() * small.cols / size_.width), 0, small.cols - 1);
  const int v = std::clamp(static_cast<int>(centre.y() * small.rows / size_.height), 0, small.rows - 1);
  allowed.at<unsigned char>(v, u) = 255;
  BallSighting seen = *best_of(small, allowed);
  seen.centre = centre;
  return seen;
}

BallSighting BallSearch::find_second(const cv::Mat& difference, const BallSighting& first) const {
  cv::Mat rest = shrunk(difference).clone();
  const auto size =
      std::find_if(sizes_.begin(), sizes_.end(), [&](const Size& one) { return one.contact == first.contact; });
  TS_ASSERT(size != sizes_.end());
  const Eigen::Vector2d centre(first.centre.x() * rest.cols / size_.width, first.centre.y() * rest.rows / size_.height);
  const auto tilt_at = [&](const Eigen::Vector2d& offset) {
    const auto at = std::min(static_cast<std::size_t>(kFiner * offset.norm() + 0.5), size->lift.size() - 1);
    return Eigen::Vector3d(size->tilt_over_r[at] * offset.x(), size->tilt_over_r[at] * offset.y(), size->lift[at]);
  };
  // The first's own shading: fitted within its window, taken out everywhere.
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d right = Eigen::Matrix3d::Zero();
  cv::Mat allowed(rest.size(), CV_8UC1, cv::Scalar(255));
  const auto for_each = [&](auto use) {
    for (int v = 0; v < rest.rows; ++v) {
      for (int u = 0; u < rest.cols; ++u) use(u, v, Eigen::Vector2d(u + 0.5, v + 0.5) - centre);
    }
  };
  for_each([&](int u, int v, const Eigen::Vector2d& offset) {
    if (offset.norm() < kApart * ball_) allowed.at<unsigned char>(v, u) = 0;
    if (offset.norm() > kWindow * first.contact * ball_) return;
    const Eigen::Vector3d tilt = tilt_at(offset);
    const auto& pixel = rest.at<cv::Vec3f>(v, u);
    products += tilt * tilt.transpose();
    right += tilt * Eigen::RowVector3d(pixel[0], pixel[1], pixel[2]);
  });
  products.diagonal().array() += 1e-9 * (products.trace() + 1e-9);
  const Eigen::Matrix3d shading = products.inverse() * right;
  for_each([&](int u, int v, const Eigen::Vector2d& offset) {
    const Eigen::Vector3d explained = shading.transpose() * tilt_at(offset);
    auto& pixel = rest.at<cv::Vec3f>(v, u);
    for (int c = 0; c < 3; ++c) pixel[c] -= static_cast<float>(explained[c]);
  });
  return best_of(rest, allowed).value_or(BallSighting{});
}

}  // namespace touchstone::sensors
