#include "sensors/heights/ball_press.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "core/error.h"
#include "core/units.h"
#include "sensors/heights/ball_search.h"
#include "sensors/numerics/quantile.h"

namespace touchstone::sensors {
namespace {

constexpr double kWidestBall = 10.0;  // radius by the frame's larger side: of a flatter ball no outline is found

constexpr double kSmallestRadius_px = 4.0;
constexpr double kFaintest_percent = 15.0;  // less is no contact
constexpr float kDarkest_DN = 10.0F;        // a darker background doesn't count for less
constexpr double kSecond = 0.3;             // of the first contact's energy, from which there is a second one
// Of the search for the circle:
constexpr double kLineBall_px = 60.0;  // ball radius: larger pictures are shrunk
constexpr double kFine_px = 1.0;       // the line's blur
constexpr double kBroad_px = 3.0;      // what is taken off, and no line
constexpr double kAround = 0.22;       // ball radii that the centre may lie off the first guess
constexpr double kNarrowest = 0.72;    // radii that are tried, by the first guess's
constexpr double kWidest = 1.3;
constexpr double kMostOfBall = 0.97;  // contact radius by the ball's
// Of the ball's radius: samples farther out have slopes above 2, which a pixel changes much.
constexpr double kFarthestOut = 0.9;

/// By how many percent of the background a pixel is brighter, summed over the channels, smoothed against noise. Flanks
/// are brighter in the colour of the lamp that they face; the shadows that a contact casts are only darker.
cv::Mat brightening_of(const cv::Mat& difference, const Background& background) {
  cv::Mat change(difference.size(), CV_32FC1);
  for (int v = 0; v < difference.rows; ++v) {
    const auto* in = difference.ptr<cv::Vec3f>(v);
    const auto* rest = background.mean.ptr<cv::Vec3f>(v);
    auto* out = change.ptr<float>(v);
    for (int u = 0; u < difference.cols; ++u) {
      out[u] = 0.0F;
      for (int c = 0; c < 3; ++c) {
        out[u] += 100.0F * std::max(in[u][c], 0.0F) / std::max(rest[u][c], kDarkest_DN);
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

/// Where the picture is a fine line: its relative change less the same more blurred. In real light the rim is bright in
/// all channels, in matt shading it's bright or dark, by the side; so the brightest channel counts, and all of them
/// whatever their sign. The root lets a whole circle count for more than a bright arc.
cv::Mat lines_of(const cv::Mat& difference, const Background& background, double shrink) {
  cv::Mat change(difference.size(), CV_32FC3);
  for (int v = 0; v < difference.rows; ++v) {
    const auto* in = difference.ptr<cv::Vec3f>(v);
    const auto* rest = background.mean.ptr<cv::Vec3f>(v);
    auto* out = change.ptr<cv::Vec3f>(v);
    for (int u = 0; u < difference.cols; ++u) {
      for (int c = 0; c < 3; ++c) out[u][c] = in[u][c] / std::max(rest[u][c], kDarkest_DN);
    }
  }
  if (shrink > 1.0) cv::resize(change, change, {}, 1.0 / shrink, 1.0 / shrink, cv::INTER_AREA);
  cv::Mat fine;
  cv::Mat broad;
  cv::GaussianBlur(change, fine, {}, kFine_px, kFine_px, cv::BORDER_REPLICATE);
  cv::GaussianBlur(change, broad, {}, kBroad_px, kBroad_px, cv::BORDER_REPLICATE);
  fine -= broad;
  cv::Mat lines(fine.size(), CV_32FC1);
  for (int v = 0; v < fine.rows; ++v) {
    for (int u = 0; u < fine.cols; ++u) {
      const auto& pixel = fine.at<cv::Vec3f>(v, u);
      const float brightest = std::max({pixel[0], pixel[1], pixel[2]});
      const float all = std::abs(pixel[0]) + std::abs(pixel[1]) + std::abs(pixel[2]);
      lines.at<float>(v, u) = std::sqrt(std::max(brightest + all, 0.0F));
    }
  }
  return lines;
}

/// The mean of an image along the part of a circle that lies in it, between pixels bilinear; 0 if that's less than
/// half.
double mean_along(const cv::Mat& image, const ContactCircle& circle) {
  constexpr int kPoints = 180;
  double sum = 0.0;
  int inside = 0;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2.0 * kPi * i / kPoints;
    const double x = circle.centre.x() + circle.radius * std::cos(angle) - 0.5;
    const double y = circle.centre.y() + circle.radius * std::sin(angle) - 0.5;
    const int u = static_cast<int>(std::floor(x));
    const int v = static_cast<int>(std::floor(y));
    if (u < 0 || v < 0 || u + 1 >= image.cols || v + 1 >= image.rows) continue;
    ++inside;
    const double s = x - u;
    const double t = y - v;
    sum += (1.0 - t) * ((1.0 - s) * image.at<float>(v, u) + s * image.at<float>(v, u + 1)) +
           t * ((1.0 - s) * image.at<float>(v + 1, u) + s * image.at<float>(v + 1, u + 1));
  }
  return 2 * inside > kPoints ? sum / inside : 0.0;
}

/// The circle along which the lines are strongest, first on whole pixels, then by a pattern search.
ContactCircle strongest_circle(const cv::Mat& lines, const ContactCircle& first, double around, double largest) {
  ContactCircle best = first;
  double strongest = -1.0;
  const double low = std::max(2.0, kNarrowest * first.radius);
  const double high = std::min(kWidest * first.radius, largest);
  const int reach = std::max(2, static_cast<int>(around));
  for (double radius = low; radius <= high; radius += 1.0) {
    for (int dv = -reach; dv <= reach; ++dv) {
      for (int du = -reach; du <= reach; ++du) {
        const ContactCircle tried{first.centre + Eigen::Vector2d(du, dv), radius};
        if (const double here = mean_along(lines, tried); here > strongest) {
          strongest = here;
          best = tried;
        }
      }
    }
  }
  for (double step = 0.5; step > 0.02;) {
    bool moved = false;
    for (const auto& [du, dv, dr] : {std::tuple{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
      const ContactCircle tried{best.centre + step * Eigen::Vector2d(du, dv),
                                std::min(best.radius + step * dr, largest)};
      if (const double here = mean_along(lines, tried); here > strongest) {
        strongest = here;
        best = tried;
        moved = true;
        break;
      }
    }
    if (!moved) step *= 0.5;
  }
  return best;
}

/// @throws Error for a scale or a ball that can't be, by itself or with the picture's size
void require_possible_ball(const cv::Size& size, double ball_radius_mm, const PressSettings& settings,
                           const std::string& name) {
  if (!(ball_radius_mm > 0.0) || !std::isfinite(ball_radius_mm)) {
    fail("{}: ball radius {} mm: it must be above 0", name, ball_radius_mm);
  }
  if (!(settings.gel_thickness_mm > 0.0) || !std::isfinite(settings.gel_thickness_mm)) {
    fail("{}: gel_thickness_mm {}: it must be above 0", name, settings.gel_thickness_mm);
  }
  const double widest_px = kWidestBall * std::max(size.width, size.height);
  if (!(settings.mm_per_px > 0.0) || !(ball_radius_mm / settings.mm_per_px <= widest_px)) {
    fail(
        "{}: mm_per_px {}: with it the ball's radius is {:.3g} px; allowed are at most {:.0f} px, {:.0f} times the "
        "frame",
        name, settings.mm_per_px, ball_radius_mm / settings.mm_per_px, widest_px, kWidestBall);
  }
}

/// @throws Error for a circle that isn't whole in the picture or can't be the ball's
void require_possible_circle(const BallPress& press, const PressSettings& settings) {
  const ContactCircle& circle = *press.circle;
  if (!circle.centre.allFinite() || !std::isfinite(circle.radius)) fail("{}: the circle isn't finite", press.name);
  if (circle.radius < kSmallestRadius_px) {
    fail("{}: contact radius {:.1f} px: at least {:.0f} are needed to estimate slopes", press.name, circle.radius,
         kSmallestRadius_px);
  }
  if (circle.radius * settings.mm_per_px >= press.ball_radius_mm) {
    fail("{}: the contact's radius, {:.1f} px = {:.3f} mm, must be below the ball's, {:.3f} mm", press.name,
         circle.radius, circle.radius * settings.mm_per_px, press.ball_radius_mm);
  }
  const double right = press.frame.cols - circle.centre.x();
  const double below = press.frame.rows - circle.centre.y();
  if (std::min({circle.centre.x(), circle.centre.y(), right, below}) < circle.radius) {
    fail("{}: the press at ({:.1f}, {:.1f}) of radius {:.1f} px reaches over the edge of the picture of {} x {}",
         press.name, circle.centre.x(), circle.centre.y(), circle.radius, press.frame.cols, press.frame.rows);
  }
}

/// What 90 % of the circle's pixels are brighter by, at most.
float strength_of(const cv::Mat& brightening, const ContactCircle& circle) {
  std::vector<float> within;
  for_each_pixel(brightening.size(), circle.centre, circle.radius,
                 [&](int u, int v, const Eigen::Vector2d&) { within.push_back(brightening.at<float>(v, u)); });
  return within.empty() ? 0.0F : quantile_of(within, 0.9);
}

}  // namespace

Eigen::Vector2d ball_slope(const Eigen::Vector2d& offset_mm, double ball_radius_mm) {
  const double rest = ball_radius_mm * ball_radius_mm - offset_mm.squaredNorm();
  TS_ASSERT(rest > 0.0);
  return -offset_mm / std::sqrt(rest);
}

ContactCircle find_contact_circle(const cv::Mat& difference, const Background& background, double ball_radius_mm,
                                  const PressSettings& settings, const std::string& name) {
  require_possible_ball(difference.size(), ball_radius_mm, settings, name);
  const double ball_px = ball_radius_mm / settings.mm_per_px;
  const BallSearch search(difference.size(), ball_px, settings.gel_thickness_mm / settings.mm_per_px);
  const BallSighting seen = search.find(difference);
  const double shrink = std::max(1.0, ball_px / kLineBall_px);
  const ContactCircle guess{seen.centre / shrink, seen.contact * ball_px / shrink};
  ContactCircle circle = strongest_circle(lines_of(difference, background, shrink), guess, kAround * ball_px / shrink,
                                          kMostOfBall * ball_px / shrink);
  circle.centre *= shrink;
  circle.radius *= shrink;
  if (strength_of(brightening_of(difference, background), circle) < kFaintest_percent) {
    fail("{}: no contact is seen: the frame is as the background", name);
  }
  if (circle.radius < kSmallestRadius_px) {
    fail("{}: the contact's radius is {:.1f} px; at least {:.0f} are needed: press deeper", name, circle.radius,
         kSmallestRadius_px);
  }
  const double to_edge = std::min(
      {circle.centre.x(), circle.centre.y(), difference.cols - circle.centre.x(), difference.rows - circle.centre.y()});
  if (to_edge < circle.radius) {
    fail("{}: the contact touches the edge of the picture; press where all of it is seen", name);
  }
  return circle;
}

SeenPress see_press(const BallPress& press, const Background& background, const cv::Vec3d& gain,
                    const PressSettings& settings) {
  const std::string fault = frame_fault(press.frame, background.mean.size());
  if (!fault.empty()) fail("{}: the frame {}", press.name, fault);
  require_possible_ball(press.frame.size(), press.ball_radius_mm, settings, press.name);
  SeenPress seen;
  if (press.circle) require_possible_circle(press, settings);
  seen.difference = difference_to(background, press.frame, gain);
  seen.found = !press.circle.has_value();
  seen.circle = press.circle
                    ? *press.circle
                    : find_contact_circle(seen.difference, background, press.ball_radius_mm, settings, press.name);
  if (strength_of(brightening_of(seen.difference, background), seen.circle) < kFaintest_percent) {
    fail("{}: nothing is pressed at ({:.0f}, {:.0f}): the frame is as the background there", press.name,
         seen.circle.centre.x(), seen.circle.centre.y());
  }
  const BallSearch search(press.frame.size(), press.ball_radius_mm / settings.mm_per_px,
                          settings.gel_thickness_mm / settings.mm_per_px);
  const BallSighting first = search.look_at(seen.difference, seen.circle.centre);
  const BallSighting second = search.find_second(seen.difference, first);
  if (second.energy > kSecond * first.energy) {
    fail("{}: there's a second contact near pixel ({:.0f}, {:.0f}); calibrate with one ball a frame", press.name,
         second.centre.x(), second.centre.y());
  }
  return seen;
}

std::vector<ColourSample> samples_of(const BallPress& press, const SeenPress& seen, const PressSettings& settings) {
  std::vector<ColourSample> samples;
  int lost = 0;
  int pixels = 0;
  for_each_pixel(press.frame.size(), seen.circle.centre, seen.circle.radius - settings.rim_px,
                 [&](int u, int v, const Eigen::Vector2d& offset) {
                   if (offset.norm() > kFarthestOut * press.ball_radius_mm / settings.mm_per_px) return;
                   ++pixels;
                   const int saturated = saturated_channels(press.frame.at<cv::Vec3b>(v, u));
                   if (saturated > 1) {
                     ++lost;
                     return;
                   }
                   const auto& pixel = seen.difference.at<cv::Vec3f>(v, u);
                   ColourSample sample;
                   sample.place = Eigen::Vector2d(u + 0.5, v + 0.5).cast<float>();
                   sample.colour = {pixel[0], pixel[1], pixel[2]};
                   sample.slope = ball_slope(offset * settings.mm_per_px, press.ball_radius_mm).cast<float>();
                   sample.saturated = saturated > 0;
                   samples.push_back(sample);
                 });
  if (lost > settings.most_lost * pixels) {
    fail("{}: {:.0f} % of the contact's pixels have two channels at 255; at most {:.0f} % may: lower exposure or gain",
         press.name, 100.0 * lost / pixels, 100.0 * settings.most_lost);
  }
  return samples;
}

}  // namespace touchstone::sensors
