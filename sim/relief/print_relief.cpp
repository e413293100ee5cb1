#include "sim/relief/print_relief.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/units.h"
#include "sim/relief/wave_reliefs.h"

namespace touchstone::sim {
namespace {

constexpr int kPointsAStroke = 10;
constexpr double kSoftEdge = 1.0 / 3.0;  // of the pen's radius
constexpr int kGlyphWidth = 4;           // of the grid that glyphs are drawn on
constexpr int kGlyphHeight = 6;
constexpr int kAdvance = 6;

/// A letter as pen strokes: points "xy" on a grid of 4 x 6 with y up, a blank between the points of a stroke, a bar
/// between strokes.
struct Glyph {
  char letter;
  std::string_view strokes;
};

constexpr Glyph kGlyphs[] = {
    {'A', "00 26 40|12 32"},
    {'B', "00 06 36 45 44 33 03|33 42 41 30 00"},
    {'C', "45 36 16 05 01 10 30 41"},
    {'D', "00 06 26 44 42 20 00"},
    {'E', "46 06 00 40|03 33"},
    {'F', "46 06 00|03 33"},
    {'G', "45 36 16 05 01 10 30 41 43 23"},
    {'H', "00 06|40 46|03 43"},
    {'I', "16 36|26 20|10 30"},
    {'J', "36 31 20 10 01"},
    {'K', "00 06|46 03 40"},
    {'L', "06 00 40"},
    {'M', "00 06 23 46 40"},
    {'N', "00 06 40 46"},
    {'O', "10 01 05 16 36 45 41 30 10"},
    {'P', "00 06 36 45 44 33 03"},
    {'Q', "10 01 05 16 36 45 41 30 10|22 40"},
    {'R', "00 06 36 45 44 33 03|23 40"},
    {'S', "45 36 16 05 04 13 33 42 41 30 10 01"},
    {'T', "06 46|26 20"},
    {'U', "06 01 10 30 41 46"},
    {'V', "06 20 46"},
    {'W', "06 10 23 30 46"},
    {'X', "00 46|06 40"},
    {'Y', "06 23 46|23 20"},
    {'Z', "06 46 00 40"},
    {'0', "10 01 05 16 36 45 41 30 10|01 45"},
    {'1', "05 26 20|00 40"},
    {'2', "05 16 36 45 44 00 40"},
    {'3', "05 16 36 45 44 33 13|33 42 41 30 10 01"},
    {'4', "40 46 02 42"},
    {'5', "46 06 04 34 43 41 30 10 01"},
    {'6', "45 36 16 05 01 10 30 41 42 33 03"},
    {'7', "06 46 10"},
    {'8', "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33"},
    {'9', "01 10 30 41 45 36 16 05 04 13 43"},
    {'.', "20 20"},
    {'-', "03 43"},
    {'$', "45 36 16 05 04 13 33 42 41 30 10 01|26 20"},
    {' ', ""},
};

const Glyph* glyph_of(char letter) {
  const auto* const found =
      std::find_if(std::begin(kGlyphs), std::end(kGlyphs), [&](const Glyph& glyph) { return glyph.letter == letter; });
  return found == std::end(kGlyphs) ? nullptr : found;
}

struct Segment {
  Eigen::Vector2d from, to;
};

/// All strokes, mm, the text centred on the origin.
std::vector<Segment> segments_of(const PrintRelief& relief) {
  const double unit = relief.letter_mm / kGlyphHeight;
  const double width = kAdvance * static_cast<double>(relief.text.size()) - (kAdvance - kGlyphWidth);
  std::vector<Segment> segments;
  for (std::size_t i = 0; i < relief.text.size(); ++i) {
    const Glyph* const glyph = glyph_of(relief.text[i]);
    TS_ASSERT(glyph != nullptr);
    const Eigen::Vector2d corner(kAdvance * static_cast<double>(i) - 0.5 * width, -0.5 * kGlyphHeight);
    bool pen_down = false;
    Eigen::Vector2d last = Eigen::Vector2d::Zero();
    for (std::size_t at = 0; at + 1 < glyph->strokes.size(); at += 3) {
      const Eigen::Vector2d point =
          unit * (corner + Eigen::Vector2d(glyph->strokes[at] - '0', kGlyphHeight - (glyph->strokes[at + 1] - '0')));
      if (pen_down) segments.push_back({last, point});
      last = point;
      pen_down = at + 2 < glyph->strokes.size() && glyph->strokes[at + 2] == ' ';
    }
  }
  return segments;
}

double distance_to(const Segment& segment, const Eigen::Vector2d& x) {
  const Eigen::Vector2d along = segment.to - segment.from;
  const double length = along.squaredNorm();
  const double t = length > 0.0 ? std::clamp((x - segment.from).dot(along) / length, 0.0, 1.0) : 0.0;
  return (segment.from + t * along - x).norm();
}

}  // namespace

void fields(YamlReader& in, PrintRelief& relief) {
  in.required("amplitude_um", relief.amplitude_um, Allowed::above_up_to(0.0, kHighestRelief_um));
  in.required("text", relief.text);
  relief.where = in.where("text");
  in.optional("letter_mm", relief.letter_mm, Allowed::within(0.1, 100.0));
  in.optional("stroke_mm", relief.stroke_mm, Allowed::within(0.01, 10.0));
  if (relief.text.empty() || relief.text.size() > 64) {
    fail_at(relief.where, "relief.text: has {} letters; 1 to 64 are allowed", relief.text.size());
  }
  for (const char letter : relief.text) {
    if (glyph_of(letter) == nullptr) {
      fail_at(relief.where, "relief.text: there's no letter '{}'; there are A to Z, 0 to 9, blanks and . - $", letter);
    }
  }
}

fem::ReliefMap relief_map(const PrintRelief& relief) {
  const std::vector<Segment> segments = segments_of(relief);
  const double amplitude = relief.amplitude_um / kMicrometresPerMillimetre;
  const double pen = 0.5 * relief.stroke_mm;
  const double spacing = relief.stroke_mm / kPointsAStroke;
  const double unit = relief.letter_mm / kGlyphHeight;
  const double half_x = 0.5 * unit * kAdvance * static_cast<double>(relief.text.size()) + pen;
  const double half_y = 0.5 * relief.letter_mm + pen;
  const int nx = 2 * static_cast<int>(std::ceil(half_x / spacing)) + 1;
  const int ny = 2 * static_cast<int>(std::ceil(half_y / spacing)) + 1;
  std::vector<float> nearest(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny), static_cast<float>(pen));
  for (const Segment& segment : segments) {
    const auto range = [&](int axis, int count) {
      const double low = std::min(segment.from[axis], segment.to[axis]) - pen;
      const double high = std::max(segment.from[axis], segment.to[axis]) + pen;
      const int middle = (count - 1) / 2;
      return std::array{std::max(0, static_cast<int>(std::floor(low / spacing)) + middle),
                        std::min(count - 1, static_cast<int>(std::ceil(high / spacing)) + middle)};
    };
    const auto [i0, i1] = range(0, nx);
    const auto [j0, j1] = range(1, ny);
    for (int j = j0; j <= j1; ++j) {
      for (int i = i0; i <= i1; ++i) {
        const Eigen::Vector2d x(spacing * (i - (nx - 1) / 2), spacing * (j - (ny - 1) / 2));
        float& distance =
            nearest[static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i)];
        distance = std::min(distance, static_cast<float>(distance_to(segment, x)));
      }
    }
  }
  std::vector<float> heights(nearest.size());
  for (int j = 0; j < ny; ++j) {
    const auto row = static_cast<std::ptrdiff_t>(j) * nx;
    std::transform(nearest.begin() + row, nearest.begin() + row + nx, heights.begin() + row, [&](float distance) {
      const double inside = std::clamp((pen - static_cast<double>(distance)) / (kSoftEdge * pen), 0.0, 1.0);
      return static_cast<float>(amplitude * inside * inside * (3.0 - 2.0 * inside));
    });
  }
  const Eigen::Vector2d first(-spacing * ((nx - 1) / 2), -spacing * ((ny - 1) / 2));
  return {nx, ny, first, {spacing, spacing}, {false, false}, std::move(heights)};
}

double finest_detail(const PrintRelief& relief) {
  return relief.stroke_mm;
}

}  // namespace touchstone::sim
