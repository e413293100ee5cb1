#pragma once
// A ball of known size pressed into a gel that shows depth as darkness: where it touches, the membrane is the ball's
// cap. Outside it isn't: the gel sinks round the ball if it is thick, and bulges if it is thin and bonded.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sensors/heights/ball_press.h"
#include "sensors/heights/darkening.h"

namespace touchstone::sensors {

/// The pixels of a contact that are equally far from its centre.
struct PressRing {
  double inner_px = 0.0;   ///< its inner radius
  double cap_mm = 0.0;     ///< how much less deep the ball is there than in its middle, so at most 0
  double darkening = 0.0;  ///< mean of the middle half of the pixels: dust doesn't move it
  int pixels = 0;
};

/// The pixels of a contact whose offset from its centre has a part along this angle (from u towards v, radians), or
/// all.
using HalfOfContact = std::optional<double>;

/// How large a press is in the picture.
struct PressScale {
  double mm_per_px = 0.0;  ///< on the gel at rest
  /// How far before the gel a pinhole would stand that sees it as the camera does: focal length in pixels times
  /// mm_per_px. A ball's middle is nearer to it than its rim, so it looks larger and, beside the picture's middle,
  /// moved outwards: at 17 mm, 2 mm deep, by an eighth. Infinite: that is left out.
  double camera_distance_mm = std::numeric_limits<double>::infinity();
};

/// Darkening below which nothing is learnt. A gel that bulges beside a ball is brighter than that, but how bright a
/// bulge is, no ball shows; heights there are held, and must not be held far below rest.
inline constexpr double kBrightest = -0.01;

/// A measured frame of one press.
struct DarkPress {
  std::string name;            ///< for messages
  cv::Mat map;                 ///< CV_32FC1, darkening; dust is removed
  cv::Mat usable;              ///< CV_8UC1: 255 where neither saturated nor unlit
  ContactCircle circle;        ///< px
  double learnt_radius = 0.0;  ///< px: without the rim, where the membrane leaves the ball and the milky layer mixes
                               ///< what is inside with what is outside, and without what is brighter than kBrightest
  double ball_radius_mm = 0.0;
  PressScale scale;
  double depth_mm = 0.0;  ///< of the ball's lowest point below the gel at rest: as if the rim were at rest, or better

  /// How far from the contact's centre the place of the ball is that the picture's `place` shows, px on the gel at
  /// rest. Its height is counted from the rim.
  double distance_of(const Eigen::Vector2d& place) const;
};

/// Looks for the one ball that a frame shows. The centre is where the darkening depends on the distance alone; contact
/// ends where the darkening falls off most steeply, since there a ball's slope ends to grow.
/// @throws Error naming `name`: an unfit frame; nothing darker than at rest; brighter instead of darker (frame and rest
///   picture changed over); more than one contact, or one that isn't round; one that reaches the picture's edge or is
///   wider than the ball
ContactCircle find_dark_circle(const cv::Mat& frame, const RestPicture& rest, const DarkeningSettings& settings,
                               double ball_radius_mm, const PressScale& scale, const std::string& name);

/// Measures a press whose circle is known. @throws Error as find_dark_circle
DarkPress measure_press(const BallPress& press, const RestPicture& rest, const DarkeningSettings& settings,
                        const PressScale& scale);

/// Takes this depth for the press, which says where its pixels are on the ball: before a near camera the centre is
/// moved to where the darkening then depends on the distance alone. Sets which pixels are learnt from.
void set_depth(DarkPress& press, double depth_mm);

/// Calls `use(u, v, distance_px, cap_mm)` for the pixels of the contact that are learnt from.
template <typename Use>
void for_each_contact_pixel(const DarkPress& press, const HalfOfContact& half, Use use) {
  const double radius = press.learnt_radius;
  const double mm_per_px = press.scale.mm_per_px;
  const double ball_px = press.ball_radius_mm / mm_per_px;
  constexpr double kWider = 1.3;  // than the contact: what is magnified at most
  const Eigen::Vector2d towards = half ? Eigen::Vector2d(std::cos(*half), std::sin(*half)) : Eigen::Vector2d::Zero();
  const auto first = [](double place) { return std::max(0, static_cast<int>(place)); };
  const Eigen::Vector2d& centre = press.circle.centre;
  const double reach = kWider * radius;
  for (int v = first(centre.y() - reach); v < press.map.rows && v < centre.y() + reach; ++v) {
    for (int u = first(centre.x() - reach); u < press.map.cols && u < centre.x() + reach; ++u) {
      const Eigen::Vector2d place(u + 0.5, v + 0.5);
      const Eigen::Vector2d offset = place - centre;
      const double distance = press.distance_of(place);
      if (distance > radius || (half && offset.dot(towards) <= 0.0)) continue;
      use(u, v, distance, mm_per_px * (std::sqrt(ball_px * ball_px - distance * distance) - ball_px));
    }
  }
}

/// The pixels that are learnt from as rings one pixel wide, from the middle outwards.
std::vector<PressRing> rings_of(const DarkPress& press, const HalfOfContact& half = {});

}  // namespace touchstone::sensors
