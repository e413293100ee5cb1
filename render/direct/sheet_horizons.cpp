#include "render/direct/sheet_horizons.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/grid_places.h"

namespace touchstone::render {
namespace {

constexpr double kNearSlope = 0.15;    // there horizons change fast from place to place
constexpr double kNearPitches = 20.0;  // round what is so steep
constexpr float kNowhere = -std::numeric_limits<float>::infinity();

struct Steepest {
  Eigen::AlignedBox2d box;       // of the triangles that are steeper than the flattest light
  Eigen::AlignedBox2d near_box;  // of those that are much steeper
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  bool up = false, down = false, upright = false;
};

Steepest look_over(const TriangleMesh& sheet, const HorizonSettings& settings) {
  Steepest found;
  const double limit = double(settings.flattest) * double(settings.flattest);
  const double near_limit = std::max(limit, kNearSlope * kNearSlope);
  for (const auto& t : sheet.triangles) {
    const Eigen::Vector3d& a = sheet.vertices[t[0]];
    const Eigen::Vector3d& b = sheet.vertices[t[1]];
    const Eigen::Vector3d& c = sheet.vertices[t[2]];
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (normal.squaredNorm() == 0.0) continue;
    found.up = found.up || normal.z() > 0.0;
    found.down = found.down || normal.z() < 0.0;
    found.upright = found.upright || normal.z() == 0.0;
    for (const Eigen::Vector3d* v : {&a, &b, &c}) {
      const double height = double(settings.side) * v->z();
      found.low = std::min(found.low, height);
      found.high = std::max(found.high, height);
    }
    if (normal.head<2>().squaredNorm() <= limit * normal.z() * normal.z()) continue;
    const bool much = normal.head<2>().squaredNorm() > near_limit * normal.z() * normal.z();
    for (const Eigen::Vector3d* v : {&a, &b, &c}) {
      found.box.extend(Eigen::Vector2d(v->head<2>()));
      if (much) found.near_box.extend(Eigen::Vector2d(v->head<2>()));
    }
  }
  return found;
}

/// The sheet's heights at the grid's places, kNowhere beside it.
std::vector<float> heights_of(const TriangleMesh& sheet, float side, float left, float bottom, float pitch, int columns,
                              int rows) {
  std::vector<float> heights(static_cast<std::size_t>(columns) * rows, kNowhere);
  for (const auto& t : sheet.triangles) {
    std::array<Eigen::Vector2d, 3> corner;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& v = sheet.vertices[t[k]];
      corner[k] = {(v.x() - double(left)) / double(pitch), (v.y() - double(bottom)) / double(pitch)};
    }
    const double z = sheet.vertices[t[0]].z();
    const double z1 = sheet.vertices[t[1]].z() - z;
    const double z2 = sheet.vertices[t[2]].z() - z;
    for_places_in(corner, columns, rows, [&](int i, int j, double b, double c) {
      float& height = heights[static_cast<std::size_t>(j) * columns + i];
      height = std::max(height, side * static_cast<float>(z + b * z1 + c * z2));
    });
  }
  return heights;
}

/// `from` is [lines][places], `to` [places][lines].
void transpose(const float* from, int lines, int places, float* to) {
  constexpr int kBlock = 16;  // of either: what a cache line holds
  for (int line = 0; line < lines; line += kBlock) {
    for (int place = 0; place < places; place += kBlock) {
      for (int l = line; l < std::min(lines, line + kBlock); ++l) {
        for (int p = place; p < std::min(places, place + kBlock); ++p) {
          to[static_cast<std::size_t>(p) * lines + l] = from[static_cast<std::size_t>(l) * places + p];
        }
      }
    }
  }
}

/// [lines][places] with each line's first and last place once more before and behind it.
std::vector<float> with_ends(const std::vector<float>& from, int lines, int places) {
  std::vector<float> to;
  to.reserve(static_cast<std::size_t>(lines) * (static_cast<std::size_t>(places) + 2));
  for (int line = 0; line < lines; ++line) {
    const float* const first = from.data() + static_cast<std::size_t>(line) * places;
    to.push_back(first[0]);
    to.insert(to.end(), first, first + places);
    to.push_back(first[places - 1]);
  }
  return to;
}

}  // namespace

std::optional<HorizonSettings> flattest_light(const LightField& field, const Eigen::AlignedBox2d& seen) {
  constexpr int kMostAsked = 48;       // nodes along an axis: the field is smooth
  constexpr float kLeastPart = 0.25f;  // of a beam's own tangent: its lower edge isn't below
  HorizonSettings found;
  found.side = 0.0f;
  found.flattest = std::numeric_limits<float>::infinity();
  const int beams = field.beam_count();
  Eigen::Array3i low, high, step;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = field.nodes[axis] - 1;
    low[axis] = 0;
    high[axis] = last;
    if (axis < 2) {
      const auto node = [&](double at) { return (at - field.reach.min()[axis]) / field.step[axis]; };
      low[axis] = std::clamp(static_cast<int>(std::floor(node(seen.min()[axis]))), 0, last);
      high[axis] = std::clamp(static_cast<int>(std::ceil(node(seen.max()[axis]))), 0, last);
    }
    step[axis] = std::max(1, (high[axis] - low[axis]) / kMostAsked);
  }
  const auto tangent = [](const float* flow) { return std::abs(flow[2]) / std::hypot(flow[0], flow[1]); };
  for (int z = low.z(); z <= high.z(); z += step.z()) {
    for (int y = low.y(); y <= high.y(); y += step.y()) {
      for (int x = low.x(); x <= high.x(); x += step.x()) {
        const std::size_t node = static_cast<std::size_t>(x) +
                                 static_cast<std::size_t>(field.nodes.x()) *
                                     (y + static_cast<std::size_t>(field.nodes.y()) * static_cast<std::size_t>(z));
        for (int beam = 0; beam < beams; ++beam) {
          const float* const flow = field.flow.data() + 4 * (node * beams + beam);
          if (!(flow[3] > 0.0f)) continue;
          const float side = flow[2] < 0.0f ? 1.0f : -1.0f;
          if (flow[2] == 0.0f || (found.side != 0.0f && side != found.side)) return std::nullopt;
          found.side = side;
          const float own = tangent(flow);
          float edge = own;
          if (const int steeper = field.beside[beam].steeper; steeper >= 0) {
            edge = own - 0.5f * std::max(0.0f, tangent(flow + 4 * (steeper - beam)) - own);
          }
          found.flattest = std::min(found.flattest, std::max(edge, kLeastPart * own));
        }
      }
    }
  }
  if (found.side == 0.0f || !(found.flattest > 0.0f)) return std::nullopt;
  return found;
}

std::optional<SheetHorizons> SheetHorizons::find(const TriangleMesh& sheet, const HorizonSettings& settings) {
  const Steepest steep = look_over(sheet, settings);
  if (steep.upright || (steep.up && steep.down)) return std::nullopt;
  SheetHorizons made;
  if (steep.box.isEmpty()) return made;
  // Light that is hidden from a place meets the sheet, where it comes down, behind something steeper than itself.
  const auto wider = [](const Eigen::AlignedBox2d& box, double by) {
    return Eigen::AlignedBox2d(Eigen::Vector2d(box.min().array() - by), Eigen::Vector2d(box.max().array() + by));
  };
  Eigen::AlignedBox2d all;
  for (const auto& v : sheet.vertices) all.extend(Eigen::Vector2d(v.head<2>()));
  const double reach = (steep.high - steep.low) / double(settings.flattest);
  Eigen::AlignedBox2d asked = wider(steep.box, reach).intersection(all);
  if (!settings.seen.isEmpty()) asked = asked.intersection(settings.seen);
  if (asked.isEmpty()) return made;
  const Eigen::AlignedBox2d far = asked.merged(steep.box);
  const Eigen::AlignedBox2d near = wider(steep.near_box, kNearPitches * double(settings.pitch)).intersection(all);
  const float pitch_far = settings.pitch * static_cast<float>(settings.far_pitches);
  if (!steep.near_box.isEmpty()) made.near_ = Grid(sheet, settings, near, settings.pitch);
  if (!made.near_.holds(static_cast<float>(far.min().x()), static_cast<float>(far.min().y())) ||
      !made.near_.holds(static_cast<float>(far.max().x()), static_cast<float>(far.max().y()))) {
    made.far_ = Grid(sheet, settings, far, pitch_far);
  }
  return made;
}

SheetHorizons::Grid::Grid(const TriangleMesh& sheet, const HorizonSettings& settings, const Eigen::AlignedBox2d& box,
                          float pitch_mm)
    : left(static_cast<float>(box.min().x())),
      bottom(static_cast<float>(box.min().y())),
      pitch(std::max(pitch_mm, static_cast<float>(box.sizes().maxCoeff() / (settings.most_places - 1)))),
      columns(2 + static_cast<int>(box.sizes().x() / double(pitch))),
      rows(2 + static_cast<int>(box.sizes().y() / double(pitch))) {
  const std::vector<float> by_place = heights_of(sheet, settings.side, left, bottom, pitch, columns, rows);
  std::vector<float> by_column(by_place.size());
  transpose(by_place.data(), rows, columns, by_column.data());
  const Heights heights = {with_ends(by_place, rows, columns), with_ends(by_column, columns, rows)};
  const std::size_t places = by_place.size();
  std::vector<float> planes(places * kAzimuths);  // [azimuth][place], as they are found
  tbb::parallel_for(0, kAzimuths, [&](int number) { sweep(heights, number, planes.data() + number * places); });
  horizons.resize(planes.size());
  std::vector<char> high(places, 0);
  // Some places at a time, as many as lie side by side in a cache line of a plane.
  constexpr std::size_t kTogether = 16;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, (places + kTogether - 1) / kTogether, 64),
                    [&](const auto& range) {
                      for (std::size_t first = range.begin() * kTogether;
                           first < std::min(places, range.end() * kTogether); first += kTogether) {
                        const std::size_t count = std::min(kTogether, places - first);
                        for (std::size_t number = 0; number < kAzimuths; ++number) {
                          const float* const from = planes.data() + number * places + first;
                          float* const to = horizons.data() + first * kAzimuths + number;
                          for (std::size_t k = 0; k < count; ++k) {
                            to[k * kAzimuths] = from[k];
                            high[first + k] |= from[k] > settings.flattest;
                          }
                        }
                      }
                    });
  shaded.assign(places, 0);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      if (high[static_cast<std::size_t>(j) * columns + i] == 0) continue;
      for (int b = std::max(0, j - 1); b <= std::min(rows - 1, j + 1); ++b) {
        for (int a = std::max(0, i - 1); a <= std::min(columns - 1, i + 1); ++a) {
          shaded[static_cast<std::size_t>(b) * columns + a] = 1;
        }
      }
    }
  }
}

Eigen::Vector2f SheetHorizons::heading(float azimuth) {
  if (azimuth < 0.0f) azimuth += 4.0f;
  if (azimuth >= 4.0f) azimuth -= 4.0f;
  const int quarter = std::clamp(static_cast<int>(azimuth), 0, 3);
  const float share = azimuth - static_cast<float>(quarter);
  const Eigen::Vector2f from[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  return ((1.0f - share) * from[quarter] + share * from[(quarter + 1) % 4]).normalized();
}

/// Along the axis that the heading is nearer to a line has a sample a place, between two of the other axis; a place
/// lies between two lines. All lines' samples of one step lie equally between the other axis's places, which stand
/// beside each other in memory: what isn't the hull's own runs over them.
void SheetHorizons::Grid::sweep(const Heights& heights, int number, float* plane) const {
  const Eigen::Vector2f to = heading(4.0f * static_cast<float>(number) / kAzimuths);
  const bool along_x = std::abs(to.x()) >= std::abs(to.y());
  const int count = along_x ? columns : rows;
  const int across = along_x ? rows : columns;
  const float ahead = along_x ? to.x() : to.y();
  const float aside = (along_x ? to.y() : to.x()) / std::abs(ahead);  // places a step
  const float step = pitch * std::sqrt(1.0f + aside * aside);
  const std::vector<float>& by_step =
      along_x ? heights.by_column : heights.by_row;  // [step][place, one more each side]
  const std::size_t stride = static_cast<std::size_t>(across) + 2;
  // Line l is at place first + l + aside i of step i: low places on, and a share of the way to the next.
  const float drift = aside * static_cast<float>(count - 1);
  const int first = static_cast<int>(std::floor(std::min(0.0f, -drift)));
  const int last = across + static_cast<int>(std::ceil(std::max(0.0f, -drift)));
  const int lines = last - first + 1;
  std::vector<float> by_column(along_x ? static_cast<std::size_t>(columns) * rows : 0);
  float* const made = along_x ? by_column.data() : plane;  // [step][place]
  struct Corner {
    int at;
    float height;
  };
  std::vector<Corner> hulls(static_cast<std::size_t>(lines) * count);
  std::vector<int> corners(static_cast<std::size_t>(lines), 0);
  std::vector<float> height(static_cast<std::size_t>(lines));
  std::vector<float> of_lines(static_cast<std::size_t>(lines) + 2, 0.0f);
  float* const found = of_lines.data() + 1;  // by line
  for (int i = count - 1; i >= 0; --i) {
    const int k = ahead > 0.0f ? i : count - 1 - i;
    const float moved = aside * static_cast<float>(i);
    const auto low = static_cast<int>(std::floor(moved));
    const float share = moved - static_cast<float>(low);
    // Lines that pass the grid at this step: from just before its first place to just behind its last.
    const int from = std::max(0, -1 - first - low);
    const int end = std::min(lines, across - first - low);
    const float* const row = by_step.data() + static_cast<std::size_t>(k) * stride + 1 + first + low;
    for (int line = from; line < end; ++line) {
      // Beside the sheet heights are infinite, and 0 of infinity isn't 0.
      const float rise = share == 0.0f ? 0.0f : share * (row[line + 1] - row[line]);
      height[static_cast<std::size_t>(line)] = row[line] + rise;
    }
    std::fill_n(found, lines, 0.0f);
    for (int line = from; line < end; ++line) {
      const float here = height[static_cast<std::size_t>(line)];
      if (!(here > kNowhere)) continue;  // beside the sheet
      Corner* const hull = hulls.data() + static_cast<std::size_t>(line) * count;
      int& size = corners[static_cast<std::size_t>(line)];
      const auto is_below = [&](const Corner& one, const Corner& other) {  // as seen from here
        return (one.height - here) * static_cast<float>(other.at - i) <=
               (other.height - here) * static_cast<float>(one.at - i);
      };
      while (size > 1 && is_below(hull[size - 1], hull[size - 2])) --size;
      if (size > 0) {
        const Corner& seen = hull[size - 1];
        found[line] = std::max(0.0f, (seen.height - here) / (step * static_cast<float>(seen.at - i)));
      }
      hull[size++] = {i, here};
    }
    // Place j lies between lines j - first - low - 1 and the next one, but for a share of 0, where it is on the next.
    const float* const at = found + (-first - low - 1);
    float* const out = made + static_cast<std::size_t>(k) * across;
    for (int j = 0; j < across; ++j) out[j] = at[j + 1] + share * (at[j] - at[j + 1]);
  }
  if (along_x) transpose(made, columns, rows, plane);
}

void SheetHorizons::at(float x, float y, float* out) const {
  const Grid& grid = near_.holds(x, y) ? near_ : far_;
  if (grid.columns == 0) {
    std::fill_n(out, kAround, 0.0f);
    return;
  }
  const float u = std::clamp((x - grid.left) / grid.pitch, 0.0f, static_cast<float>(grid.columns - 1));
  const float v = std::clamp((y - grid.bottom) / grid.pitch, 0.0f, static_cast<float>(grid.rows - 1));
  const int i = std::min(static_cast<int>(u), grid.columns - 2);
  const int j = std::min(static_cast<int>(v), grid.rows - 2);
  const float a = u - static_cast<float>(i);
  const float b = v - static_cast<float>(j);
  const float weights[4] = {(1.0f - a) * (1.0f - b), a * (1.0f - b), (1.0f - a) * b, a * b};
  const float* const first = grid.horizons.data() + (static_cast<std::size_t>(j) * grid.columns + i) * kAzimuths;
  const float* const from[4] = {first, first + kAzimuths, first + static_cast<std::size_t>(grid.columns) * kAzimuths,
                                first + (static_cast<std::size_t>(grid.columns) + 1) * kAzimuths};
  for (int k = 0; k < kAzimuths; ++k) {
    out[k + 1] = weights[0] * from[0][k] + weights[1] * from[1][k] + weights[2] * from[2][k] + weights[3] * from[3][k];
  }
  out[0] = out[kAzimuths];
  out[kAzimuths + 1] = out[1];
  out[kAzimuths + 2] = out[2];
}

}  // namespace touchstone::render
