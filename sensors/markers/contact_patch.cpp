#include "sensors/markers/contact_patch.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

constexpr int kRounds = 3;
constexpr double kFarOut = 1.5 * 1.5;  ///< in reach_squared

void erase_disc(cv::Mat& mask, const Eigen::Vector2d& centre, double radius) {
  const int top = std::max(static_cast<int>(std::floor(centre.y() - radius)), 0);
  const int bottom = std::min(static_cast<int>(std::ceil(centre.y() + radius)), mask.rows);
  const int left = std::max(static_cast<int>(std::floor(centre.x() - radius)), 0);
  const int right = std::min(static_cast<int>(std::ceil(centre.x() + radius)), mask.cols);
  for (int y = top; y < bottom; ++y) {
    std::uint8_t* row = mask.ptr<std::uint8_t>(y);
    for (int x = left; x < right; ++x) {
      if ((Eigen::Vector2d(x + 0.5, y + 0.5) - centre).squaredNorm() <= radius * radius) row[x] = 0;
    }
  }
}

void check(const cv::Mat& mask) {
  if (mask.empty() || mask.type() != CV_8UC1) fail("contact mask: CV_8UC1 is needed, not empty");
}

/// Whether a set pixel has fewer than three set neighbours: noise stands alone, a rim two pixels wide doesn't.
bool is_speck(const cv::Mat& mask, int x, int y) {
  int set = -1;  // itself doesn't count
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, mask.rows - 1); ++v) {
    const std::uint8_t* row = mask.ptr<std::uint8_t>(v);
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, mask.cols - 1); ++u) set += row[u] != 0 ? 1 : 0;
  }
  return set < 3;
}

/// Calls use(x, y) for the set pixels, by rows, that are no specks and aren't far out of a patch.
template <typename Use>
void for_touched(const cv::Mat& mask, const ContactPatch& patch, Use&& use) {
  for (int y = 0; y < mask.rows; ++y) {
    const std::uint8_t* row = mask.ptr<std::uint8_t>(y);
    for (int x = 0; x < mask.cols; ++x) {
      if (row[x] != 0 && patch.reach_squared({x + 0.5, y + 0.5}) <= kFarOut && !is_speck(mask, x, y)) use(x, y);
    }
  }
}

}  // namespace

void erase_markers(cv::Mat& mask, const TrackedMarkers& markers, double radius_px) {
  check(mask);
  const int strip = std::min({static_cast<int>(std::ceil(std::max(radius_px, 0.0))), mask.rows, mask.cols});
  for (int y = 0; y < mask.rows; ++y) {
    std::uint8_t* row = mask.ptr<std::uint8_t>(y);
    const bool outer = y < strip || y >= mask.rows - strip;
    std::fill_n(row, outer ? mask.cols : strip, std::uint8_t{0});
    std::fill_n(row + mask.cols - strip, strip, std::uint8_t{0});
  }
  for (std::size_t i = 0; i < markers.rest.size(); ++i) {
    erase_disc(mask, markers.rest[i], radius_px);
    erase_disc(mask, markers.positions[i], radius_px);
  }
}

std::optional<ContactPatch> contact_patch(const cv::Mat& mask, int least_px) {
  check(mask);
  ContactPatch patch;
  patch.edge.setZero();  // nothing is far out yet
  for (int round = 0; round < kRounds; ++round) {
    double count = 0.0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
    for_touched(mask, patch, [&](int x, int y) {
      const Eigen::Vector2d place(x + 0.5, y + 0.5);
      count += 1.0;
      sum += place;
      squares += place * place.transpose();
    });
    if (count < std::max(least_px, 1)) return std::nullopt;
    patch.area_px = count;
    patch.centre = sum / count;
    // An ellipse's second moments are its half axes squared over 4; each pixel is a square of 1/12.
    const Eigen::Matrix2d moments =
        squares / count - patch.centre * patch.centre.transpose() + Eigen::Matrix2d::Identity() / 12.0;
    patch.edge = (4.0 * moments).inverse();
  }
  return patch;
}

PatchMotion patch_motion(const TrackedMarkers& markers, const ContactPatch& patch) {
  const auto for_held = [&](const auto& use) {
    for (std::size_t i = 0; i < markers.rest.size(); ++i) {
      if (is_found(markers.status[i]) && patch.reach_squared(markers.positions[i]) <= 1.0) use(i);
    }
  };
  PatchMotion motion;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  // at rest
  for_held([&](std::size_t i) {
    motion.px += markers.displacement(i);
    middle += markers.rest[i];
    ++motion.markers;
  });
  if (motion.markers == 0) return motion;
  motion.px /= motion.markers;
  middle /= motion.markers;
  if (motion.markers < 3) return motion;
  // The similarity that takes places at rest to those now, by least squares: a turn and a swelling.
  double along = 0.0, across = 0.0, at_rest = 0.0, now = 0.0;
  for_held([&](std::size_t i) {
    const Eigen::Vector2d from = markers.rest[i] - middle;
    const Eigen::Vector2d to = from + markers.displacement(i) - motion.px;
    along += from.dot(to);
    across += from.x() * to.y() - from.y() * to.x();
    at_rest += from.squaredNorm();
    now += to.squaredNorm();
  });
  const double size = std::hypot(along, across);
  if (!(at_rest > 0.0) || !(size > 0.0)) return motion;
  motion.turn = std::atan2(across, along);
  const double left_over = std::max(now - size * size / at_rest, 0.0);
  motion.turn_error = std::sqrt(left_over / (2.0 * motion.markers - 4.0) * at_rest) / size;
  return motion;
}

}  // namespace touchstone::sensors
