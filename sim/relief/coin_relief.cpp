#include "sim/relief/coin_relief.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/random.h"
#include "core/units.h"
#include "sim/relief/wave_reliefs.h"

namespace touchstone::sim {
namespace {

constexpr double kPitch_mm = 0.04;
constexpr double kStroke_mm = 0.28;  // of glyphs, as letters on coins are
constexpr double kFlank_mm = 0.12;   // over which a struck edge rises
constexpr double kRim_mm = 0.8;
constexpr double kBeadRing_mm = 0.5;  // between the rim and the beads' centres
constexpr double kBead_mm = 0.3;      // radius
constexpr double kBeadPitch_mm = 1.0;
constexpr double kGlyph_mm = 1.5;     // height of a glyph's cell; it is two thirds as wide
constexpr int kHarmonics = 5;         // of the head's outline
constexpr double kStrandsAMm2 = 1.6;  // times the head's radius squared, bumps included

double smooth_step(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// A square of heights, mm, with shapes set onto it: where they overlap, the higher one shows.
class Canvas {
 public:
  explicit Canvas(double half_side)
      : points_(2 * static_cast<int>(std::ceil(half_side / kPitch_mm)) + 1),
        first_(-0.5 * kPitch_mm * (points_ - 1)),
        heights_(static_cast<std::size_t>(points_) * points_, 0.0F) {}

  /// Calls height(point) for the points within `reach` of `middle`.
  template <typename Height>
  void raise(const Eigen::Vector2d& middle, double reach, const Height& height) {
    const auto index = [&](double x) {
      return std::clamp(static_cast<int>(std::ceil((x - first_) / kPitch_mm)), 0, points_);
    };
    for (int j = index(middle.y() - reach); j < index(middle.y() + reach); ++j) {
      for (int i = index(middle.x() - reach); i < index(middle.x() + reach); ++i) {
        float& here = heights_[static_cast<std::size_t>(j) * points_ + i];
        here =
            std::max(here, static_cast<float>(height(Eigen::Vector2d(first_ + kPitch_mm * i, first_ + kPitch_mm * j))));
      }
    }
  }

  fem::ReliefMap map() && {
    return {points_,
            points_,
            Eigen::Vector2d::Constant(first_),
            Eigen::Vector2d::Constant(kPitch_mm),
            {false, false},
            std::move(heights_)};
  }

 private:
  int points_;
  double first_;
  std::vector<float> heights_;
};

void stroke(Canvas& canvas, const Eigen::Vector2d& a, const Eigen::Vector2d& b, double height) {
  const Eigen::Vector2d along = b - a;
  const double square = std::max(along.squaredNorm(), 1e-12);
  const double reach = 0.5 * (along.norm() + kStroke_mm);
  canvas.raise(0.5 * (a + b), reach, [&](const Eigen::Vector2d& p) {
    const double t = std::clamp((p - a).dot(along) / square, 0.0, 1.0);
    return height * smooth_step((0.5 * kStroke_mm - (p - a - t * along).norm()) / kFlank_mm);
  });
}

/// Two to four strokes between the points of a 3 x 2 lattice that stands upright at `middle`, its top towards `up`.
void glyph(Canvas& canvas, RandomStream& random, const Eigen::Vector2d& middle, const Eigen::Vector2d& up,
           double height) {
  const Eigen::Vector2d right(up.y(), -up.x());
  const auto corner = [&](int i) -> Eigen::Vector2d {
    const double across = (i % 2 - 0.5) * (2.0 / 3.0 * kGlyph_mm - kStroke_mm);
    const double along = (i / 2 - 1) * 0.5 * (kGlyph_mm - kStroke_mm);
    return middle + across * right + along * up;
  };
  const auto pick = [&](int count) { return static_cast<int>(count * random.uniform()); };
  int from = pick(6);
  const int strokes = 2 + pick(3);
  for (int i = 0; i < strokes; ++i) {
    const int to = (from + 1 + pick(5)) % 6;
    stroke(canvas, corner(from), corner(to), height);
    from = to;
  }
}

/// A dome with a wavy outline, bumps for features and strands that run along arcs.
void head(Canvas& canvas, RandomStream& random, double radius, double height) {
  const auto within = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  std::array<double, kHarmonics> size{}, phase{};
  for (int k = 0; k < kHarmonics; ++k) {
    size[k] = within(0.02, 0.18 / (1 + k));
    phase[k] = within(-kPi, kPi);
  }
  const auto outline = [&](const Eigen::Vector2d& p) {
    const double angle = std::atan2(p.y(), p.x());
    double reach = 0.82;
    for (int k = 0; k < kHarmonics; ++k) reach += size[k] * std::cos((k + 1) * angle + phase[k]);
    return radius * reach;
  };
  constexpr double kDome = 0.5;  // of the height; the rest is for what stands on it
  const auto dome = [&](const Eigen::Vector2d& p) {
    const double edge = outline(p) - p.norm();
    return height * kDome * smooth_step(edge / (2.0 * kFlank_mm)) * (0.6 + 0.4 * smooth_step(edge / radius));
  };
  const double reach = 1.6 * radius;
  canvas.raise({0, 0}, reach, dome);
  const int strands = static_cast<int>(std::lround(kStrandsAMm2 * radius * radius));
  for (int i = 0; i < strands; ++i) {
    // Every second one is a short bump, the others are strands.
    const double turn = within(-kPi, kPi), away = radius * within(0.05, 0.75);
    const Eigen::Vector2d middle = away * Eigen::Vector2d(std::cos(turn), std::sin(turn));
    const double bow = within(0.8, 2.5), half = i % 2 ? within(0.05, 0.2) : within(0.5, 1.2);
    const double width = within(0.12, 0.25), tall = height * (1.0 - kDome) * within(0.5, 1.0);
    const double heading = within(-kPi, kPi);
    const Eigen::Vector2d centre = middle - bow * Eigen::Vector2d(std::cos(heading), std::sin(heading));
    canvas.raise(middle, 3.0, [&](const Eigen::Vector2d& p) {
      const Eigen::Vector2d arm = p - centre;
      const double off = std::abs(std::remainder(std::atan2(arm.y(), arm.x()) - heading, 2.0 * kPi)) * bow;
      const double side = std::hypot(arm.norm() - bow, std::max(0.0, off - half)) / width;
      return side < 3.0 && p.norm() < outline(p) ? dome(p) + tall * std::exp(-0.5 * side * side) * (dome(p) > 0.0)
                                                 : 0.0;
    });
  }
}

}  // namespace

void fields(YamlReader& in, CoinRelief& relief) {
  in.required("diameter_mm", relief.diameter_mm, Allowed::within(8.0, 60.0));
  in.required("rim_um", relief.rim_um, Allowed::above_up_to(0.0, kHighestRelief_um));
  in.required("art_um", relief.art_um, Allowed::above_up_to(0.0, kHighestRelief_um));
  in.required("seed", relief.seed);
}

fem::ReliefMap relief_map(const CoinRelief& relief) {
  const double radius = 0.5 * relief.diameter_mm;
  const double rim = relief.rim_um / kMicrometresPerMillimetre, art = relief.art_um / kMicrometresPerMillimetre;
  RandomStream random(static_cast<std::uint64_t>(relief.seed), 0, Purpose::kRelief);
  Canvas canvas(radius + kPitch_mm);
  canvas.raise({0, 0}, radius, [&](const Eigen::Vector2d& p) {
    const double inside = radius - p.norm();  // flat on top, rounded towards both sides
    return rim * smooth_step(inside / kFlank_mm) * smooth_step((kRim_mm - inside) / (2.0 * kFlank_mm));
  });
  const double bead_ring = radius - kRim_mm - kBeadRing_mm;
  const int beads = static_cast<int>(std::lround(2.0 * kPi * bead_ring / kBeadPitch_mm));
  for (int i = 0; i < beads; ++i) {
    const double angle = 2.0 * kPi * i / beads;
    const Eigen::Vector2d middle = bead_ring * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    canvas.raise(middle, kBead_mm, [&](const Eigen::Vector2d& p) {
      const double share = (p - middle).squaredNorm() / (kBead_mm * kBead_mm);
      return share < 1.0 ? 0.8 * art * std::sqrt(1.0 - share) : 0.0;
    });
  }
  // Glyphs stand on the ring inside the beads, their tops outwards; a third of it is left bare.
  const double glyph_ring = bead_ring - kBead_mm - 0.65 * kGlyph_mm;
  const double step = 0.9 * kGlyph_mm / glyph_ring, bare = 2.0 * kPi / 3.0;
  const double first = 2.0 * kPi * random.uniform();
  for (double angle = 0.0; angle < 2.0 * kPi - bare; angle += step) {
    const bool space = random.uniform() < 0.15;
    const Eigen::Vector2d up(std::cos(first + angle), std::sin(first + angle));
    if (!space) glyph(canvas, random, glyph_ring * up, up, 0.8 * art);
  }
  head(canvas, random, glyph_ring - 0.6 * kGlyph_mm, art);
  return std::move(canvas).map();
}

double finest_detail(const CoinRelief&) {
  return kStroke_mm;
}

}  // namespace touchstone::sim
