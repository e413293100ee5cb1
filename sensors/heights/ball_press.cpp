#include "sensors/heights/ball_press.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::sensors {
namespace {

constexpr double kWidestBall = 10.0;  // radius by the frame's larger side: of a flatter ball no outline is found

constexpr double kSmallestRadius_px = 4.0;
constexpr double kFaintest_percent = 15.0;  // less is no contact
constexpr float kDarkest_DN = 10.0F;        // a darker background doesn't count for less
constexpr double kStrongPart = 0.5;         // of a contact's own brightening, which marks others
constexpr double kSecondArea = 0.15;        // of the first contact, from which a second counts
constexpr double kSurroundings = 1.1;       // ball radii: nothing nearer is another ball
constexpr double kWidest = 3.4;             // ball radii: what one ball can brighten
constexpr double kFitPart = 0.85;           // of the contact's radius: where colours are compared with a ball's,
constexpr double kFitPartOfBall = 0.5;      // and of the ball's: steeper parts may lie in a lamp's shadow

enum class Change { brighter, either };

/// By how many percent of the background a pixel has changed, summed over the channels, smoothed against noise. Flanks
/// are brighter in the colour of the lamp that they face; the shadows that a contact casts are only darker.
cv::Mat change_of(const cv::Mat& difference, const Background& background, Change kind) {
  cv::Mat change(difference.size(), CV_32FC1);
  for (int v = 0; v < difference.rows; ++v) {
    const auto* in = difference.ptr<cv::Vec3f>(v);
    const auto* rest = background.mean.ptr<cv::Vec3f>(v);
    auto* out = change.ptr<float>(v);
    for (int u = 0; u < difference.cols; ++u) {
      out[u] = 0.0F;
      for (int c = 0; c < 3; ++c) {
        const float part = kind == Change::either ? std::abs(in[u][c]) : std::max(in[u][c], 0.0F);
        out[u] += 100.0F * part / std::max(rest[u][c], kDarkest_DN);
      }
    }
  }
  cv::GaussianBlur(change, change, {}, 1.5);
  return change;
}

/// Calls `use(u, v, offset)` for each pixel of the picture whose centre is within `radius` of `centre`.
template <typename Use>
void for_each_pixel(const cv::Size& size, const Eigen::Vector2d& centre, double radius, Use use) {
  const int v0 = std::max(0, static_cast<int>(std::floor(centre.y() - radius - 1.0)));
  const int v1 = std::min(size.height - 1, static_cast<int>(std::ceil(centre.y() + radius)));
  const int u0 = std::max(0, static_cast<int>(std::floor(centre.x() - radius - 1.0)));
  const int u1 = std::min(size.width - 1, static_cast<int>(std::ceil(centre.x() + radius)));
  for (int v = v0; v <= v1; ++v) {
    for (int u = u0; u <= u1; ++u) {
      const Eigen::Vector2d offset = Eigen::Vector2d(u + 0.5, v + 0.5) - centre;
      if (offset.norm() <= radius) use(u, v, offset);
    }
  }
}

/// The value that a share of the values is below.
float quantile(std::vector<float> values, double share) {
  TS_ASSERT(!values.empty());
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// @throws Error if there's a second contact: two balls of one size touch the gel at least their diameter apart
void refuse_second_contact(const cv::Mat& brightening, const ContactCircle& circle, double ball_px, float strong,
                           const std::string& name) {
  cv::Mat marks = brightening > kStrongPart * static_cast<double>(strong);
  for_each_pixel(marks.size(), circle.centre, kSurroundings * ball_px,
                 [&](int u, int v, const Eigen::Vector2d&) { marks.at<unsigned char>(v, u) = 0; });
  cv::Mat labels;
  cv::Mat statistics;
  cv::Mat centroids;
  const int count = cv::connectedComponentsWithStats(marks, labels, statistics, centroids);
  for (int i = 1; i < count; ++i) {
    if (statistics.at<int>(i, cv::CC_STAT_AREA) > kSecondArea * kPi * circle.radius * circle.radius) {
      fail("{}: there's a second contact near pixel ({:.0f}, {:.0f}); calibrate with one ball a frame", name,
           centroids.at<double>(i, 0), centroids.at<double>(i, 1));
    }
  }
}

/// What is left of the colours within the circle after the best matt shading of a ball at `centre`: sum of squares a
/// pixel.
double shading_misfit(const cv::Mat& difference, const Eigen::Vector2d& centre, double radius_px, double ball_px) {
  // Regress the three channels on the ball's normals.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d right = Eigen::Matrix3d::Zero();
  double squares = 0.0;
  double weights = 0.0;
  for_each_pixel(difference.size(), centre, radius_px, [&](int u, int v, const Eigen::Vector2d& offset) {
    // Fades out towards the rim, so that the misfit doesn't jump when a pixel comes in.
    const double weight = 1.0 - offset.squaredNorm() / (radius_px * radius_px);
    const double depth = std::sqrt(ball_px * ball_px - offset.squaredNorm());
    const Eigen::Vector3d tilt(offset.x() / ball_px, offset.y() / ball_px, depth / ball_px - 1.0);
    const cv::Vec3f& pixel = difference.at<cv::Vec3f>(v, u);
    const Eigen::Vector3d colour(pixel[0], pixel[1], pixel[2]);
    normal += weight * tilt * tilt.transpose();
    right += weight * tilt * colour.transpose();
    squares += weight * colour.squaredNorm();
    weights += weight;
  });
  if (weights <= 0.0) return INFINITY;
  normal.diagonal().array() += 1e-9;
  const Eigen::Matrix3d solution = normal.ldlt().solve(right);
  return (squares - (solution.transpose() * right).trace()) / weights;
}

/// Moves the centre to the least misfit by a pattern search down to a hundredth of a pixel.
Eigen::Vector2d best_centre(const cv::Mat& difference, Eigen::Vector2d centre, double radius_px, double ball_px) {
  double best = shading_misfit(difference, centre, radius_px, ball_px);
  for (double step = 2.0; step > 0.01;) {
    bool moved = false;
    for (const auto& [du, dv] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const Eigen::Vector2d tried = centre + step * Eigen::Vector2d(du, dv);
      if (const double misfit = shading_misfit(difference, tried, radius_px, ball_px); misfit < best) {
        best = misfit;
        centre = tried;
        moved = true;
        break;
      }
    }
    if (!moved) step *= 0.5;
  }
  return centre;
}

/// Where circles round `centre` have changed most in the mean: contact ends there and the slope falls off again.
double rim_radius(const cv::Mat& change, const Eigen::Vector2d& centre, double largest) {
  constexpr double kBin = 0.5;
  std::vector<double> sums(static_cast<std::size_t>(largest / kBin) + 1, 0.0);
  std::vector<double> counts(sums.size(), 0.0);
  for_each_pixel(change.size(), centre, largest, [&](int u, int v, const Eigen::Vector2d& offset) {
    const auto bin = std::min(static_cast<std::size_t>(offset.norm() / kBin), sums.size() - 1);
    sums[bin] += change.at<float>(v, u);
    counts[bin] += 1.0;
  });
  const auto ring = [&](std::size_t i) {  // over three bins, against the grid's own unevenness
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t j = i > 0 ? i - 1 : 0; j <= std::min(i + 1, sums.size() - 1); ++j) {
      sum += sums[j];
      count += counts[j];
    }
    return count > 0.0 ? sum / count : 0.0;
  };
  std::size_t best = 0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (ring(i) > ring(best)) best = i;
  }
  double shift = 0.0;
  if (best > 0 && best + 1 < sums.size()) {
    const double bend = ring(best - 1) - 2.0 * ring(best) + ring(best + 1);
    if (bend < 0.0) shift = 0.5 * (ring(best - 1) - ring(best + 1)) / bend;
  }
  return kBin * (static_cast<double>(best) + 0.5 + shift);
}

}  // namespace

Eigen::Vector2d ball_slope(const Eigen::Vector2d& offset_mm, double ball_radius_mm) {
  const double rest = ball_radius_mm * ball_radius_mm - offset_mm.squaredNorm();
  TS_ASSERT(rest > 0.0);
  return -offset_mm / std::sqrt(rest);
}

std::vector<ColourSample> samples_of(const BallPress& press, const Background& background, double mm_per_px,
                                     const PressSampling& how) {
  TS_ASSERT(mm_per_px > 0.0);
  const std::string fault = frame_fault(press.frame, background.mean.size());
  if (!fault.empty()) fail("{}: the frame {}", press.name, fault);
  const ContactCircle& circle = press.circle;
  if (!circle.centre.allFinite() || !std::isfinite(circle.radius)) fail("{}: the circle isn't finite", press.name);
  if (!(press.ball_radius_mm > 0.0) || !std::isfinite(press.ball_radius_mm)) {
    fail("{}: ball radius {} mm: it must be above 0", press.name, press.ball_radius_mm);
  }
  if (circle.radius < kSmallestRadius_px) {
    fail("{}: contact radius {:.1f} px: at least {:.0f} are needed to estimate slopes", press.name, circle.radius,
         kSmallestRadius_px);
  }
  if (circle.radius * mm_per_px >= press.ball_radius_mm) {
    fail("{}: the contact's radius, {:.1f} px = {:.3f} mm, must be below the ball's, {:.3f} mm", press.name,
         circle.radius, circle.radius * mm_per_px, press.ball_radius_mm);
  }
  const double right = press.frame.cols - circle.centre.x();
  const double below = press.frame.rows - circle.centre.y();
  if (std::min({circle.centre.x(), circle.centre.y(), right, below}) < circle.radius) {
    fail("{}: the press at ({:.1f}, {:.1f}) of radius {:.1f} px reaches over the edge of the picture of {} x {}",
         press.name, circle.centre.x(), circle.centre.y(), circle.radius, press.frame.cols, press.frame.rows);
  }

  const cv::Mat difference = difference_to(background, press.frame);
  const cv::Mat brightening = change_of(difference, background, Change::brighter);
  std::vector<float> within;
  for_each_pixel(brightening.size(), circle.centre, circle.radius,
                 [&](int u, int v, const Eigen::Vector2d&) { within.push_back(brightening.at<float>(v, u)); });
  const float strong = quantile(within, 0.9);
  if (strong < kFaintest_percent)
    fail("{}: nothing is pressed at ({:.0f}, {:.0f}): the frame is as the background there", press.name,
         circle.centre.x(), circle.centre.y());
  refuse_second_contact(brightening, circle, press.ball_radius_mm / mm_per_px, strong, press.name);

  std::vector<ColourSample> samples;
  int saturated = 0;
  int pixels = 0;
  for_each_pixel(press.frame.size(), circle.centre, circle.radius - how.rim_px,
                 [&](int u, int v, const Eigen::Vector2d& offset) {
                   ++pixels;
                   const auto& raw = press.frame.at<cv::Vec3b>(v, u);
                   if (raw[0] == 255 || raw[1] == 255 || raw[2] == 255) {
                     ++saturated;
                     return;
                   }
                   const auto& pixel = difference.at<cv::Vec3f>(v, u);
                   ColourSample sample;
                   sample.place = Eigen::Vector2d(u + 0.5, v + 0.5).cast<float>();
                   sample.colour = {pixel[0], pixel[1], pixel[2]};
                   sample.slope = ball_slope(offset * mm_per_px, press.ball_radius_mm).cast<float>();
                   samples.push_back(sample);
                 });
  if (saturated > how.most_saturated * pixels) {
    fail("{}: {:.0f} % of the contact's pixels are saturated; at most {:.0f} % may be: lower exposure or gain",
         press.name, 100.0 * saturated / pixels, 100.0 * how.most_saturated);
  }
  return samples;
}

ContactCircle find_contact_circle(const cv::Mat& frame, const Background& background, double ball_radius_mm,
                                  double mm_per_px, const std::string& name) {
  const std::string fault = frame_fault(frame, background.mean.size());
  if (!fault.empty()) fail("{}: the frame {}", name, fault);
  if (!(ball_radius_mm > 0.0) || !std::isfinite(ball_radius_mm)) {
    fail("{}: ball radius {} mm: it must be above 0", name, ball_radius_mm);
  }
  const double widest_px = kWidestBall * std::max(frame.cols, frame.rows);
  if (!(mm_per_px > 0.0) || !(ball_radius_mm / mm_per_px <= widest_px)) {
    fail(
        "{}: mm_per_px {}: with it the ball's radius is {:.3g} px; allowed are at most {:.0f} px, {:.0f} times the "
        "frame",
        name, mm_per_px, ball_radius_mm / mm_per_px, widest_px, kWidestBall);
  }
  const cv::Mat difference = difference_to(background, frame);
  const cv::Mat brightening = change_of(difference, background, Change::brighter);
  const cv::Mat change = change_of(difference, background, Change::either);
  double highest = 0.0;
  cv::minMaxLoc(brightening, nullptr, &highest);
  if (highest < kFaintest_percent) fail("{}: no contact is seen: the frame is as the background", name);

  cv::Mat marks = brightening > 0.35 * highest;
  std::vector<std::vector<cv::Point>> outlines;
  // A ball's middle is as bright as the gel at rest: only outlines count, and gaps in the ring are closed.
  const double ball_px = ball_radius_mm / mm_per_px;
  const int closing = std::max(3, 2 * static_cast<int>(0.1 * ball_px) + 1);
  cv::morphologyEx(marks, marks, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_ELLIPSE, {closing, closing}));
  cv::findContours(marks, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<cv::Point> all;
  // Sickles of one ball belong together: they lie within the ball's own outline.
  const auto largest = std::max_element(outlines.begin(), outlines.end(), [](const auto& a, const auto& b) {
    return cv::contourArea(a) < cv::contourArea(b);
  });
  TS_ASSERT(largest != outlines.end());
  const cv::Rect main = cv::boundingRect(*largest);
  const Eigen::Vector2d main_centre(main.x + 0.5 * main.width, main.y + 0.5 * main.height);
  for (const auto& outline : outlines) {
    const cv::Rect box = cv::boundingRect(outline);
    const Eigen::Vector2d centre(box.x + 0.5 * box.width, box.y + 0.5 * box.height);
    if ((centre - main_centre).norm() < 1.5 * ball_px) all.insert(all.end(), outline.begin(), outline.end());
  }
  const cv::Rect box = cv::boundingRect(all);
  if (box.x == 0 || box.y == 0 || box.x + box.width == frame.cols || box.y + box.height == frame.rows) {
    fail("{}: the contact touches the edge of the picture; press where all of it is seen", name);
  }
  if (std::max(box.width, box.height) > kWidest * ball_px) {
    fail("{}: the contact is {} x {} px, more than a ball of {:.2f} mm radius can make: is there more than one?", name,
         box.width, box.height, ball_radius_mm);
  }
  ContactCircle circle;
  circle.centre = {box.x + 0.5 * box.width, box.y + 0.5 * box.height};
  circle.radius = std::min(0.25 * (box.width + box.height), 0.95 * ball_px);
  for (int pass = 0; pass < 3; ++pass) {  // each makes the other better
    circle.centre =
        best_centre(difference, circle.centre, std::min(kFitPart * circle.radius, kFitPartOfBall * ball_px), ball_px);
    circle.radius = std::min(rim_radius(change, circle.centre, 0.98 * ball_px), 0.97 * ball_px);
    if (circle.radius < kSmallestRadius_px) {
      fail("{}: the contact's radius is {:.1f} px; at least {:.0f} are needed: press deeper", name, circle.radius,
           kSmallestRadius_px);
    }
  }
  std::vector<float> within;
  for_each_pixel(brightening.size(), circle.centre, circle.radius,
                 [&](int u, int v, const Eigen::Vector2d&) { within.push_back(brightening.at<float>(v, u)); });
  refuse_second_contact(brightening, circle, ball_px, quantile(within, 0.9), name);
  return circle;
}

}  // namespace touchstone::sensors
