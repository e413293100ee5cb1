#include "sensors/heights/darkness_press.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::sensors {
namespace {

constexpr double kSmallestRadius_px = 6.0;
constexpr double kFaintest = 0.03;       // darkening; less is no contact
constexpr double kWidestBall = 10.0;     // radius by the frame's larger side
constexpr double kWidestContact = 0.95;  // of the ball's radius: nearer to its equator the cap is too steep to use
constexpr double kWidestFall = 1.15;     // likewise: where the darkening of a deep press may end, the milk blurs it
constexpr double kFinding_px = 2.0;      // smoothing while a contact is looked for
constexpr double kDust = 0.1;            // darkening off the median round it, from which a pixel is dust
constexpr double kDustPart = 0.15;       // of the ball's radius: side of that median's window
constexpr int kWidestDust_px = 11;       // likewise, at most: the smallest contacts aren't dust
constexpr double kSurroundings = 1.1;    // ball radii: nothing nearer is another ball
constexpr double kStrongPart = 0.4;      // of a contact's own darkening, which marks others
constexpr double kSecondArea = 0.1;      // of the first contact, from which a second counts
constexpr double kMostUneven = 0.08;     // RMS about the rings' means by the peak: more isn't one ball
constexpr double kRimPart = 0.03;        // of a contact's radius, at least a pixel: not learnt from
constexpr double kLeastUsable = 0.8;     // of a contact's pixels

using Bends = Eigen::Matrix<double, 5, 1>;  // a polynomial in the squared distance

/// What is left of the darkening within the press's circle after the best function of the distance: RMS.
double unevenness(const cv::Mat& map, const DarkPress& press) {
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Bends right = Bends::Zero();
  double squares = 0.0;
  double weights = 0.0;
  const Eigen::Vector2d& centre = press.circle.centre;
  const double radius = press.circle.radius;
  const int v0 = std::max(0, static_cast<int>(centre.y() - radius));
  const int v1 = std::min(map.rows - 1, static_cast<int>(centre.y() + radius));
  const int u0 = std::max(0, static_cast<int>(centre.x() - radius));
  const int u1 = std::min(map.cols - 1, static_cast<int>(centre.x() + radius));
  for (int v = v0; v <= v1; ++v) {
    for (int u = u0; u <= u1; ++u) {
      const double place = std::pow(press.distance_of({u + 0.5, v + 0.5}) / radius, 2.0);
      if (place >= 1.0) continue;
      const double weight = 1.0 - place;  // fades out, so that nothing jumps when a pixel comes in
      Bends powers;
      powers[0] = 1.0;
      for (int i = 1; i < powers.size(); ++i) powers[i] = powers[i - 1] * (2.0 * place - 1.0);
      const double value = map.at<float>(v, u);
      normal += weight * powers * powers.transpose();
      right += weight * value * powers;
      squares += weight * value * value;
      weights += weight;
    }
  }
  if (weights <= 0.0) return INFINITY;
  normal.diagonal().array() += 1e-9 * weights;
  return std::sqrt(std::max(0.0, squares - right.dot(normal.ldlt().solve(right))) / weights);
}

/// Moves the press's centre to the least unevenness by a pattern search.
void move_to_evenest(const cv::Mat& map, DarkPress& press) {
  double best = unevenness(map, press);
  for (double step = 4.0; step > 0.02;) {
    bool moved = false;
    for (const auto& [du, dv] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      DarkPress tried = press;  // pictures are shared
      tried.circle.centre += step * Eigen::Vector2d(du, dv);
      if (const double value = unevenness(map, tried); value < best) {
        best = value;
        press.circle.centre = tried.circle.centre;
        moved = true;
        break;
      }
    }
    if (!moved) step *= 0.5;
  }
}

/// Mean darkening of rings one pixel wide.
std::vector<double> ring_means(const cv::Mat& map, const Eigen::Vector2d& centre, double largest) {
  std::vector<double> sums(static_cast<std::size_t>(largest) + 1, 0.0);
  std::vector<double> counts(sums.size(), 0.0);
  for (int v = 0; v < map.rows; ++v) {
    for (int u = 0; u < map.cols; ++u) {
      const double distance = (Eigen::Vector2d(u + 0.5, v + 0.5) - centre).norm();
      if (distance >= static_cast<double>(sums.size())) continue;
      sums[static_cast<std::size_t>(distance)] += map.at<float>(v, u);
      counts[static_cast<std::size_t>(distance)] += 1.0;
    }
  }
  std::vector<double> means;
  for (std::size_t i = 0; i < sums.size() && (counts[i] > 0.0 || i == 0); ++i) {
    means.push_back(counts[i] > 0.0 ? sums[i] / counts[i] : 0.0);
  }
  return means;
}

/// Where the darkening falls off most steeply, or nothing if that is at the largest distance looked at.
std::optional<double> steepest_distance(const std::vector<double>& means) {
  constexpr std::size_t kReach = 1;  // rings to both sides that a slope is taken over
  if (means.size() < 2 * kReach + 4) return std::nullopt;
  const auto fall = [&](std::size_t i) { return means[i - kReach] - means[i + kReach]; };
  const std::size_t last = means.size() - 1 - kReach;
  std::size_t best = kReach;
  for (std::size_t i = kReach; i <= last; ++i) {
    if (fall(i) > fall(best)) best = i;
  }
  if (best == last || best == kReach) return std::nullopt;
  const double bend = fall(best - 1) - 2.0 * fall(best) + fall(best + 1);
  const double shift = bend < 0.0 ? 0.5 * (fall(best - 1) - fall(best + 1)) / bend : 0.0;
  return static_cast<double>(best) + 0.5 + shift;
}

void check_sizes(double ball_radius_mm, const PressScale& scale, const cv::Size& size, const std::string& name) {
  const double mm_per_px = scale.mm_per_px;
  if (!(ball_radius_mm > 0.0) || !std::isfinite(ball_radius_mm)) {
    fail("{}: ball radius {} mm: it must be above 0", name, ball_radius_mm);
  }
  const double widest_px = kWidestBall * std::max(size.width, size.height);
  if (!(mm_per_px > 0.0) || !(ball_radius_mm / mm_per_px <= widest_px)) {
    fail(
        "{}: mm_per_px {}: with it the ball's radius is {:.3g} px; allowed are at most {:.0f} px, {:.0f} times the "
        "frame",
        name, mm_per_px, ball_radius_mm / mm_per_px, widest_px, kWidestBall);
  }
  if (!(scale.camera_distance_mm >= 2.0 * ball_radius_mm)) {
    fail("{}: camera_distance_mm {}: it must be at least the ball's diameter, {} mm", name, scale.camera_distance_mm,
         2.0 * ball_radius_mm);
  }
}

/// Specks that lay on the rest picture or on the frame, or moved, get the median of what is round them.
void remove_dust(cv::Mat& map, double ball_px) {
  cv::Mat levels;
  map.convertTo(levels, CV_8U, 127.5, 127.5);
  const int half = std::clamp(static_cast<int>(0.5 * kDustPart * ball_px), 2, kWidestDust_px / 2);
  cv::medianBlur(levels, levels, 2 * half + 1);
  cv::Mat median;
  levels.convertTo(median, CV_32F, 1.0 / 127.5, -1.0);
  median.copyTo(map, cv::abs(map - median) > kDust);
}

/// The darkening and where it counts.
DarkPress measured(const cv::Mat& frame, const RestPicture& rest, const DarkeningSettings& settings, double ball_px,
                   const std::string& name) {
  if (const std::string fault = unfit_frame(frame, rest); !fault.empty()) fail("{}: the frame {}", name, fault);
  DarkeningMeter meter(rest, settings);
  const Darkening& darkening = meter.measure(frame);
  DarkPress press;
  press.name = name;
  press.map = darkening.map.clone();
  remove_dust(press.map, ball_px);
  press.usable = ~(darkening.saturated | meter.unlit());
  return press;
}

/// @throws Error if nothing is darker than at rest, or if it's brighter instead
double peak_of(const cv::Mat& smooth, const std::string& name) {
  double lowest = 0.0;
  double highest = 0.0;
  cv::minMaxLoc(smooth, &lowest, &highest);
  if (-lowest > kFaintest && -lowest > highest) {
    fail(
        "{}: where it's touched it is brighter than the rest picture (by {:.0f} %), not darker: are the rest picture "
        "and the press changed over, or is it another kind of sensor?",
        name, -100.0 * lowest);
  }
  if (highest < kFaintest) {
    fail("{}: no contact is seen: nothing is darker than the rest picture by {:.0f} % or more", name,
         100.0 * kFaintest);
  }
  return highest;
}

[[noreturn]] void fail_at_edge(const std::string& name) {
  fail(
      "{}: the contact reaches the edge of the picture; press where all of it is seen, with a ball that leaves room "
      "round its contact",
      name);
}

/// @throws Error for a second contact or one that isn't round
void check_one_ball(const DarkPress& press, const cv::Mat& smooth, double ball_px) {
  const ContactCircle& circle = press.circle;
  const std::vector<double> means = ring_means(smooth, circle.centre, circle.radius);
  const double peak = *std::max_element(means.begin(), means.end());
  if (peak < kFaintest) {
    fail("{}: nothing is pressed at ({:.0f}, {:.0f}): the frame is as the rest picture there", press.name,
         circle.centre.x(), circle.centre.y());
  }
  cv::Mat marks = smooth > kStrongPart * peak;
  cv::circle(marks, cv::Point2d(circle.centre.x() - 0.5, circle.centre.y() - 0.5),
             static_cast<int>(std::lround(kSurroundings * ball_px)), 0, cv::FILLED);
  cv::Mat labels;
  cv::Mat statistics;
  cv::Mat centroids;
  const int count = cv::connectedComponentsWithStats(marks, labels, statistics, centroids);
  for (int i = 1; i < count; ++i) {
    if (statistics.at<int>(i, cv::CC_STAT_AREA) > kSecondArea * kPi * circle.radius * circle.radius) {
      fail("{}: there's a second contact near pixel ({:.0f}, {:.0f}); calibrate with one ball a frame", press.name,
           centroids.at<double>(i, 0), centroids.at<double>(i, 1));
    }
  }
  if (const double uneven = unevenness(smooth, press); uneven > kMostUneven * peak) {
    fail(
        "{}: the contact at ({:.0f}, {:.0f}) isn't round: its darkening differs by {:.0f} % at equal distances from "
        "its middle; at most {:.0f} % may be: is it one ball, pressed straight?",
        press.name, circle.centre.x(), circle.centre.y(), 100.0 * uneven / peak, 100.0 * kMostUneven);
  }
}

void check_circle(const DarkPress& press) {
  const double mm_per_px = press.scale.mm_per_px;
  const ContactCircle& circle = press.circle;
  if (!circle.centre.allFinite() || !std::isfinite(circle.radius)) fail("{}: the circle isn't finite", press.name);
  if (circle.radius < kSmallestRadius_px) {
    fail("{}: the contact's radius is {:.1f} px; at least {:.0f} are needed: press deeper", press.name, circle.radius,
         kSmallestRadius_px);
  }
  if (circle.radius * mm_per_px >= press.ball_radius_mm) {
    fail("{}: the contact's radius, {:.1f} px = {:.3f} mm, must be below the ball's, {:.3f} mm", press.name,
         circle.radius, circle.radius * mm_per_px, press.ball_radius_mm);
  }
  const double right = press.map.cols - circle.centre.x();
  const double below = press.map.rows - circle.centre.y();
  if (std::min({circle.centre.x(), circle.centre.y(), right, below}) < circle.radius) fail_at_edge(press.name);
}

/// Of a ball whose rim of contact is at rest, mm.
double cap_depth(const DarkPress& press) {
  const double rim_mm = press.circle.radius * press.scale.mm_per_px;
  const double radius = press.ball_radius_mm;
  return radius - std::sqrt(std::max(0.0, radius * radius - rim_mm * rim_mm));
}

cv::Mat smoothed(const cv::Mat& map) {
  cv::Mat smooth;
  cv::GaussianBlur(map, smooth, {}, kFinding_px);
  return smooth;
}

/// The largest region that is darkened by half of the most.
ContactCircle rough_circle(const cv::Mat& smooth, double peak, double ball_px, const std::string& name) {
  cv::Mat labels;
  cv::Mat statistics;
  cv::Mat centroids;
  const int count = cv::connectedComponentsWithStats(smooth > 0.5 * peak, labels, statistics, centroids);
  int main = 1;
  for (int i = 2; i < count; ++i) {
    if (statistics.at<int>(i, cv::CC_STAT_AREA) > statistics.at<int>(main, cv::CC_STAT_AREA)) main = i;
  }
  TS_ASSERT(count > 1);
  const int left = statistics.at<int>(main, cv::CC_STAT_LEFT);
  const int top = statistics.at<int>(main, cv::CC_STAT_TOP);
  const int width = statistics.at<int>(main, cv::CC_STAT_WIDTH);
  const int height = statistics.at<int>(main, cv::CC_STAT_HEIGHT);
  if (left == 0 || top == 0 || left + width == smooth.cols || top + height == smooth.rows) fail_at_edge(name);
  if (std::max(width, height) > 2.0 * ball_px) {
    fail(
        "{}: what is darkened by half of the most is {} x {} px, more than the ball's {:.0f} px across: is there more "
        "than one ball, or is its radius or mm_per_px wrong?",
        name, width, height, 2.0 * ball_px);
  }
  return {{centroids.at<double>(main, 0) + 0.5, centroids.at<double>(main, 1) + 0.5}, 0.25 * (width + height)};
}

}  // namespace

double DarkPress::distance_of(const Eigen::Vector2d& place) const {
  const double apparent = (place - circle.centre).norm();
  if (!std::isfinite(scale.camera_distance_mm)) return apparent;
  const Eigen::Vector2d axis(0.5 * map.cols, 0.5 * map.rows);
  const double ball = ball_radius_mm / scale.mm_per_px;
  const double depth = depth_mm / scale.mm_per_px;
  const double camera = scale.camera_distance_mm / scale.mm_per_px;
  double distance = apparent;
  for (int pass = 0; pass < 6; ++pass) {  // the height depends on the distance; each pass errs an eighth of the last
    const double height = depth - ball + std::sqrt(std::max(0.0, ball * ball - distance * distance));
    const Eigen::Vector2d at_rest = axis + (1.0 - std::max(0.0, height) / camera) * (place - axis);
    distance = (at_rest - circle.centre).norm();
  }
  return distance;
}

void set_depth(DarkPress& press, double depth_mm) {
  press.depth_mm = depth_mm;
  if (std::isfinite(press.scale.camera_distance_mm)) move_to_evenest(smoothed(press.map), press);
  press.learnt_radius = press.circle.radius - std::max(1.0, kRimPart * press.circle.radius);
  for (const PressRing& ring : rings_of(press)) {
    if (ring.darkening < kBrightest) press.learnt_radius = std::min(press.learnt_radius, ring.inner_px);
  }
}

ContactCircle find_dark_circle(const cv::Mat& frame, const RestPicture& rest, const DarkeningSettings& settings,
                               double ball_radius_mm, const PressScale& scale, const std::string& name) {
  check_sizes(ball_radius_mm, scale, frame.size(), name);
  const double ball_px = ball_radius_mm / scale.mm_per_px;
  DarkPress press = measured(frame, rest, settings, ball_px, name);
  press.ball_radius_mm = ball_radius_mm;
  press.scale = scale;
  const cv::Mat smooth = smoothed(press.map);
  press.circle = rough_circle(smooth, peak_of(smooth, name), ball_px, name);
  for (int pass = 0; pass < 3; ++pass) {  // each makes the other better
    press.depth_mm = cap_depth(press);
    move_to_evenest(smooth, press);
    const std::vector<double> means = ring_means(press.map, press.circle.centre, 1.3 * ball_px);
    const std::optional<double> rim = steepest_distance(means);
    if (!rim || *rim > kWidestFall * ball_px) {
      fail(
          "{}: the darkening round ({:.0f}, {:.0f}) doesn't end within the ball's radius of {:.0f} px: is the radius "
          "or mm_per_px wrong, or does a second contact join it?",
          name, press.circle.centre.x(), press.circle.centre.y(), ball_px);
    }
    press.circle.radius = std::min(*rim, kWidestContact * ball_px);
  }
  check_circle(press);
  check_one_ball(press, smooth, ball_px);
  return press.circle;
}

DarkPress measure_press(const BallPress& given, const RestPicture& rest, const DarkeningSettings& settings,
                        const PressScale& scale) {
  check_sizes(given.ball_radius_mm, scale, given.frame.size(), given.name);
  const double ball_px = given.ball_radius_mm / scale.mm_per_px;
  DarkPress press = measured(given.frame, rest, settings, ball_px, given.name);
  TS_ASSERT(given.circle);
  press.circle = *given.circle;
  press.ball_radius_mm = given.ball_radius_mm;
  press.scale = scale;
  check_circle(press);
  const cv::Mat smooth = smoothed(press.map);
  peak_of(smooth, press.name);
  check_one_ball(press, smooth, ball_px);
  set_depth(press, cap_depth(press));
  if (press.learnt_radius < kSmallestRadius_px - 1.0) {
    fail(
        "{}: the contact at ({:.0f}, {:.0f}) is brighter than the rest picture {:.0f} px from its middle already; it "
        "must be darker over {:.0f} px at least",
        press.name, press.circle.centre.x(), press.circle.centre.y(), press.learnt_radius, kSmallestRadius_px);
  }
  int usable = 0;
  int pixels = 0;
  for_each_contact_pixel(press, {}, [&](int u, int v, double, double) {
    usable += press.usable.at<unsigned char>(v, u) != 0 ? 1 : 0;
    ++pixels;
  });
  if (usable < kLeastUsable * pixels) {
    fail("{}: {:.0f} % of the contact's pixels are saturated, or unlit in the rest picture; at most {:.0f} % may be",
         press.name, 100.0 - 100.0 * usable / pixels, 100.0 - 100.0 * kLeastUsable);
  }
  return press;
}

std::vector<PressRing> rings_of(const DarkPress& press, const HalfOfContact& half) {
  std::vector<std::vector<float>> values(static_cast<std::size_t>(press.circle.radius) + 1);
  std::vector<double> caps(values.size(), 0.0);
  for_each_contact_pixel(press, half, [&](int u, int v, double distance, double cap_mm) {
    if (press.usable.at<unsigned char>(v, u) == 0) return;
    const auto ring = static_cast<std::size_t>(distance);
    values[ring].push_back(press.map.at<float>(v, u));
    caps[ring] += cap_mm;
  });
  std::vector<PressRing> rings;
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::vector<float>& ring = values[i];
    if (ring.empty()) continue;
    std::sort(ring.begin(), ring.end());
    const std::size_t cut = ring.size() / 4;
    double sum = 0.0;
    for (std::size_t k = cut; k < ring.size() - cut; ++k) sum += static_cast<double>(ring[k]);
    rings.push_back({static_cast<double>(i), caps[i] / static_cast<double>(ring.size()),
                     sum / static_cast<double>(ring.size() - 2 * cut), static_cast<int>(ring.size())});
  }
  return rings;
}

}  // namespace touchstone::sensors
