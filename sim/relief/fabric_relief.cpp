#include "sim/relief/fabric_relief.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/units.h"
#include "sim/relief/relief_fibres.h"
#include "sim/relief/relief_tile.h"

namespace touchstone::sim {
namespace {

constexpr double kMicrometre = 1e-3;
constexpr int kHerringboneEnds = 8;
constexpr double kSlubLength = 2.0;       // mm, over which a yarn's thickness changes
constexpr double kFibreRoughness = 0.07;  // mm, correlation length
constexpr double kLeastShare = 0.4;       // of its mean that an irregular yarn's size keeps

/// The random parts of the surface have streams of their own, so that one doesn't move another.
enum Part : std::uint64_t { kYarns, kFuzz, kRoughness, kPile };

int modulo(int a, int n) {
  return ((a % n) + n) % n;
}

/// Picks and ends after which the weave repeats.
Eigen::Vector2i weave_repeat(const FabricRelief& relief) {
  switch (relief.weave) {
    case Weave::plain:
      return {2, 2};
    case Weave::basket:
      return {4, 4};
    case Weave::twill:
      return Eigen::Vector2i::Constant(relief.over + relief.under);
    case Weave::herringbone:
      return {2 * kHerringboneEnds, relief.over + relief.under};
    case Weave::satin:
      return Eigen::Vector2i::Constant(relief.harness);
    default:
      return {1, 1};
  }
}

/// What varies along one yarn.
struct Yarn {
  std::function<double(double)> sway, width, thickness;  // of the place along it, the latter two as factors
  double twist_phase = 0.0;
};

Yarn random_yarn(const FabricRelief& relief, double period, double pitch, RandomStream& random) {
  const double own = 1.0 + 0.5 * relief.irregularity * random.normal();
  const auto wave = random_wave(period, kSlubLength, random), other = random_wave(period, kSlubLength, random);
  const auto side = random_wave(period, kSlubLength, random);
  const double spread = relief.irregularity;
  return {.sway = [=](double s) { return 0.25 * spread * pitch * side(s); },
          .width = [=](double s) { return std::max(kLeastShare, own * (1.0 + spread * wave(s))); },
          .thickness = [=](double s) { return std::max(kLeastShare, own * (1.0 + 0.5 * spread * other(s))); },
          .twist_phase = 2.0 * kPi * random.uniform()};
}

/// Height of a yarn's surface above its middle line, at `across` (mm) from it; `s` mm along it.
double yarn_top(const FabricRelief& relief, const Yarn& yarn, double width, double s, double across, double period) {
  const double share = across / (0.5 * width * yarn.width(s));
  if (std::abs(share) >= 1.0) return -1e9;
  double top = 0.5 * relief.thickness_mm * yarn.thickness(s) * std::sqrt(1.0 - share * share);
  if (relief.twist_mm > 0.0) {
    // Ridges at 45 degrees or less, a whole number of turns a period.
    const double turns = std::max(1.0, std::round(period / relief.twist_mm));
    const double phase = 2.0 * kPi * (turns * s / period + across / width) + yarn.twist_phase;
    top += 0.5 * relief.twist_um * kMicrometre * std::cos(phase) * (1.0 - share * share);
  }
  return top;
}

/// From -1 to 1: how a yarn lies that is at `low` at the last crossing and at `high` at the next, at the fraction `t`
/// between them.
double between_crossings(double low, double high, double t) {
  return low + (high - low) * 0.5 * (1.0 - std::cos(kPi * t));
}

/// Lays the yarns of one direction, `axis` the one along which they run: 1 the warp, 0 the weft.
void lay_yarns(const FabricRelief& relief, int axis, const Eigen::Vector2i& yarns, const Eigen::Vector2d& pitch,
               ReliefTile& tile, RandomStream& random) {
  const int across_axis = 1 - axis;
  const double period = tile.size()[axis];
  const double width = relief.yarn_mm[across_axis];
  const double crimp = relief.thickness_mm * (axis == 1 ? relief.warp_crimp : 1.0 - relief.warp_crimp);
  const int along = axis == 1 ? tile.ny : tile.nx;
  const double step_along = tile.spacing[axis], step_across = tile.spacing[across_axis];
  for (int k = 0; k < yarns[across_axis]; ++k) {
    const Yarn yarn = random_yarn(relief, period, pitch[across_axis], random);
    for (int a = 0; a < along; ++a) {
      const double s = a * step_along;
      // Crossing number c has its middle at (c + 0.5) pitch.
      const double place = s / pitch[axis] - 0.5;
      const int before = static_cast<int>(std::floor(place));
      const auto level = [&](int crossing) {
        const int other = modulo(crossing, yarns[axis]);
        const bool above = axis == 1 ? warp_is_over(relief, k, other) : !warp_is_over(relief, other, k);
        return above ? crimp : -crimp;
      };
      const double middle = between_crossings(level(before), level(before + 1), place - before);
      const double centre = (k + 0.5) * pitch[across_axis] + yarn.sway(s);
      const double half = 0.5 * width * yarn.width(s);
      const int first = static_cast<int>(std::ceil((centre - half) / step_across));
      const int last = static_cast<int>(std::floor((centre + half) / step_across));
      for (int b = first; b <= last; ++b) {
        const double top = middle + yarn_top(relief, yarn, width, s, b * step_across - centre, period);
        float& height = tile.heights[axis == 1 ? tile.at(b, a) : tile.at(a, b)];
        height = std::max(height, static_cast<float>(top));
      }
    }
  }
}

/// A whole number of repeats, at least `size` long.
int whole_count(double size, double pitch, int repeat) {
  return repeat * std::max(1, static_cast<int>(std::ceil(size / (pitch * repeat))));
}

ReliefTile woven(const FabricRelief& relief) {
  const Eigen::Vector2i repeat = weave_repeat(relief);
  const Eigen::Vector2i yarns(whole_count(relief.size_mm, relief.pitch_mm.x(), repeat.x()),
                              whole_count(relief.size_mm, relief.pitch_mm.y(), repeat.y()));
  const Eigen::Vector2d size(yarns.x() * relief.pitch_mm.x(), yarns.y() * relief.pitch_mm.y());
  // Through the gaps the lower sides of the yarns can't be reached: the floor is a yarn's thickness below the middle.
  ReliefTile tile(size, static_cast<float>(-relief.thickness_mm));
  RandomStream random = relief_stream(relief.seed, kYarns);
  lay_yarns(relief, 0, yarns, relief.pitch_mm, tile, random);
  lay_yarns(relief, 1, yarns, relief.pitch_mm, tile, random);
  return tile;
}

/// Jersey: the yarn of a course goes to and fro as x = W/(2 pi) (t + a sin 2t), y = h cos t, z = d cos 2t, so that the
/// heads of its loops lie behind the feet of the next course's.
ReliefTile knitted(const FabricRelief& relief) {
  constexpr double kBulge = 1.15;
  constexpr double kReach = 0.95;  // of a loop's head, in courses
  const double wale = relief.pitch_mm.x(), course = relief.pitch_mm.y();
  const int wales = whole_count(relief.size_mm, wale, 1), courses = whole_count(relief.size_mm, course, 1);
  ReliefTile tile({wales * wale, courses * course}, static_cast<float>(-relief.thickness_mm));
  RandomStream random = relief_stream(relief.seed, kYarns);
  const double depth = 0.5 * relief.thickness_mm;
  const double length = wales * wale;  // along x
  for (int row = 0; row < courses; ++row) {
    const Yarn yarn = random_yarn(relief, length, course, random);
    const double path = 2.2 * kReach * course + wale;  // of the yarn, about, in one loop
    const int steps = static_cast<int>(wales * path / (0.75 * kTilePitch));
    const double turns = relief.twist_mm > 0.0 ? std::round(wales * path / relief.twist_mm) : 0.0;
    for (int k = 0; k < steps; ++k) {
      const double share = static_cast<double>(k) / steps;
      const double t = 2.0 * kPi * wales * share;
      const double x = wale / (2.0 * kPi) * (t + kBulge * std::sin(2.0 * t));
      const Eigen::Vector2d centre(x, (row + 0.5) * course + kReach * course * std::cos(t) + yarn.sway(x));
      const double middle = -depth * std::cos(2.0 * t);
      const double radius = 0.5 * relief.yarn_mm.x() * yarn.width(x);
      const double top = 0.5 * relief.thickness_mm * yarn.thickness(x);
      const double phase = 2.0 * kPi * turns * share + yarn.twist_phase;
      tile.raise(centre, radius, [&](const Eigen::Vector2d& offset) {
        const double rest = 1.0 - offset.squaredNorm() / (radius * radius);
        if (rest <= 0.0) return -1e9;
        const double ridge = 0.5 * relief.twist_um * kMicrometre * std::cos(phase) * rest;
        return middle + top * std::sqrt(rest) + (turns > 0.0 ? ridge : 0.0);
      });
    }
  }
  return tile;
}

ReliefTile ribbed(const FabricRelief& relief) {
  const int ribs = whole_count(relief.size_mm, relief.pitch_mm.x(), 1);
  ReliefTile tile({ribs * relief.pitch_mm.x(), relief.size_mm}, 0.0F);
  RandomStream random = relief_stream(relief.seed, kPile);
  const double tuft = 0.6 * relief.yarn_mm.x();
  const std::vector<float> tufts = smooth_field(tile, {tuft, 1.5 * tuft}, random);
  std::vector<Yarn> sides;
  for (int k = 0; k < ribs; ++k) sides.push_back(random_yarn(relief, tile.size().y(), relief.pitch_mm.x(), random));
  for (int j = 0; j < tile.ny; ++j) {
    for (int i = 0; i < tile.nx; ++i) {
      const double place = i * tile.spacing.x() / relief.pitch_mm.x();
      const int rib = std::min(static_cast<int>(place), ribs - 1);
      const double s = j * tile.spacing.y();
      const double off = (place - rib - 0.5) * relief.pitch_mm.x() - sides[rib].sway(s);
      const double share = off / (0.5 * relief.pitch_mm.x());
      const double profile = std::sqrt(std::max(0.0, 1.0 - share * share));
      const std::size_t at = tile.at(i, j);
      const double height = profile * sides[rib].thickness(s) + relief.irregularity * tufts[at] * (0.3 + 0.7 * profile);
      tile.heights[at] = static_cast<float>(relief.thickness_mm * height);
    }
  }
  return tile;
}

ReliefTile felted(const FabricRelief& relief) {
  ReliefTile tile(Eigen::Vector2d::Constant(relief.size_mm), 0.0F);
  RandomStream random = relief_stream(relief.seed, kPile);
  const Fibres fibres{.per_mm2 = relief.fuzz_per_mm2,
                      .length_mm = 4.0,
                      .diameter_mm = relief.yarn_mm.x(),
                      .curl_per_mm = 1.5,
                      .alignment = 0.0};
  lay_fibres(
      tile, fibres, [&](double k) { return relief.thickness_mm * std::sqrt(k); }, random);
  roughen(tile, relief.irregularity * relief.thickness_mm, 1.0, random);
  return tile;
}

ReliefTile cloth(const FabricRelief& relief) {
  switch (relief.weave) {
    case Weave::knit:
      return knitted(relief);
    case Weave::corduroy:
      return ribbed(relief);
    case Weave::felt:
      return felted(relief);
    default:
      return woven(relief);
  }
}

}  // namespace

EnumNames<Weave> enum_names(Weave) {
  return {{"plain", Weave::plain},       {"basket", Weave::basket},
          {"twill", Weave::twill},       {"herringbone", Weave::herringbone},
          {"satin", Weave::satin},       {"knit", Weave::knit},
          {"corduroy", Weave::corduroy}, {"felt", Weave::felt}};
}

void fields(YamlReader& in, FabricRelief& relief) {
  in.required("weave", relief.weave);
  const bool felt = relief.weave == Weave::felt;
  const bool twilled = relief.weave == Weave::twill || relief.weave == Weave::herringbone;
  if (!felt) in.required("pitch_mm", relief.pitch_mm, Allowed::within(0.1, 5.0));
  in.required("yarn_mm", relief.yarn_mm, Allowed::within(0.01, 5.0));
  in.required("thickness_mm", relief.thickness_mm, Allowed::above_up_to(0.0, 3.0));
  in.optional("warp_crimp", relief.warp_crimp, Allowed::within(0.0, 1.0));
  if (twilled) {
    in.optional("over", relief.over, Allowed::within(1, 8));
    in.optional("under", relief.under, Allowed::within(1, 8));
  }
  if (relief.weave == Weave::satin) {
    in.optional("harness", relief.harness, Allowed::within(5, 16));
    in.optional("step", relief.step, Allowed::within(2, 14));
  }
  in.optional("twist_mm", relief.twist_mm, Allowed::within(0.0, 10.0));
  in.optional("twist_um", relief.twist_um, Allowed::within(0.0, 500.0));
  in.optional("irregularity", relief.irregularity, Allowed::within(0.0, 0.5));
  in.optional("fuzz_per_mm2", relief.fuzz_per_mm2, Allowed::within(0.0, 500.0));
  in.optional("roughness_um", relief.roughness_um, Allowed::within(0.0, 200.0));
  in.optional("size_mm", relief.size_mm, Allowed::within(4.0, 60.0));
  in.optional("seed", relief.seed);
  if (relief.weave == Weave::satin &&
      (relief.step > relief.harness - 2 || std::gcd(relief.step, relief.harness) != 1)) {
    fail_at(in.where("step"),
            "a satin of {} can't be shifted by {}: the step must be from 2 to {} and have no divisor "
            "in common with it",
            relief.harness, relief.step, relief.harness - 2);
  }
}

bool warp_is_over(const FabricRelief& relief, int end, int pick) {
  const int repeat = relief.over + relief.under;
  switch (relief.weave) {
    case Weave::basket:
      return modulo(end / 2 + pick / 2, 2) == 0;
    case Weave::twill:
      return modulo(pick - end, repeat) < relief.over;
    case Weave::herringbone: {
      const int place = modulo(end, 2 * kHerringboneEnds);
      const int folded = place < kHerringboneEnds ? place : 2 * kHerringboneEnds - 1 - place;
      return modulo(pick - folded, repeat) < relief.over;
    }
    case Weave::satin:
      return modulo(pick - end * relief.step, relief.harness) != 0;
    default:
      return modulo(end + pick, 2) == 0;
  }
}

fem::ReliefMap relief_map(const FabricRelief& relief) {
  ReliefTile tile = cloth(relief);
  if (relief.weave != Weave::felt) {
    RandomStream fuzz = relief_stream(relief.seed, kFuzz);
    add_fuzz(tile, {.per_mm2 = relief.fuzz_per_mm2, .length_mm = 1.2, .diameter_mm = 0.022, .curl_per_mm = 2.0}, fuzz);
  }
  RandomStream random = relief_stream(relief.seed, kRoughness);
  roughen(tile, relief.roughness_um * kMicrometre, kFibreRoughness, random);
  return tile.map();
}

double finest_detail(const FabricRelief&) {
  return kTileDetail;
}

}  // namespace touchstone::sim
