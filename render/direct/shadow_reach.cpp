#include "render/direct/shadow_reach.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "render/scene/film_screen.h"

namespace touchstone::render {
namespace {

constexpr float kPad = 1e-3f;  // mm: more than single precision moves anything
constexpr float kEndless = std::numeric_limits<float>::infinity();
constexpr int kMostCells = 40;  // along the longer side
constexpr int kMostSlabs = 8;
constexpr std::array<int, 5> kWidths = {1, 2, 4, 8, 16};  // cells by which the map of slopes is widened

/// What the sheet does over each cell.
struct Ground {
  std::vector<float> slope;  // the most rise per mm across; endless where something else is
  std::vector<float> low, high;
  bool up = false, down = false, upright = false;

  explicit Ground(std::size_t cells) : slope(cells, 0.0f), low(cells, kEndless), high(cells, -kEndless) {}

  void join(const Ground& other) {
    for (std::size_t k = 0; k < slope.size(); ++k) {
      slope[k] = std::max(slope[k], other.slope[k]);
      low[k] = std::min(low[k], other.low[k]);
      high[k] = std::max(high[k], other.high[k]);
    }
    up = up || other.up;
    down = down || other.down;
    upright = upright || other.upright;
  }
};

/// Calls `visit` for each cell that a box touches; what lies beside the map goes to the cells at its edge.
template <typename Visit>
void over_cells(const LampBearings& map, double x0, double x1, double y0, double y1, Visit visit) {
  const auto at = [&](double v, float from, int count) {
    return static_cast<int>(std::clamp(std::floor((v - double(from)) / double(map.cell)), 0.0, count - 1.0));
  };
  const int i0 = at(x0 - double(kPad), map.left, map.columns);
  const int i1 = at(x1 + double(kPad), map.left, map.columns);
  const int j1 = at(y1 + double(kPad), map.bottom, map.rows);
  for (int j = at(y0 - double(kPad), map.bottom, map.rows); j <= j1; ++j) {
    for (int i = i0; i <= i1; ++i) visit(static_cast<std::size_t>(j) * map.columns + i);
  }
}

Ground ground_of(const LampBearings& map, const TriangleMesh& mesh) {
  const auto cells = static_cast<std::size_t>(map.columns) * map.rows;
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 4096), Ground(cells),
      [&](const tbb::blocked_range<std::size_t>& range, Ground part) {
        for (std::size_t k = range.begin(); k < range.end(); ++k) {
          const auto& t = mesh.triangles[k];
          const Eigen::Vector3d& a = mesh.vertices[t[0]];
          const Eigen::Vector3d& b = mesh.vertices[t[1]];
          const Eigen::Vector3d& c = mesh.vertices[t[2]];
          const Eigen::Vector3d normal = (b - a).cross(c - a);
          if (normal.squaredNorm() == 0.0) continue;  // no area: nothing meets it
          part.up = part.up || normal.z() > 0.0;
          part.down = part.down || normal.z() < 0.0;
          part.upright = part.upright || normal.z() == 0.0;
          const auto slope = static_cast<float>(normal.head<2>().norm() / std::abs(normal.z()));
          const auto low = static_cast<float>(std::min({a.z(), b.z(), c.z()})) - kPad;
          const auto high = static_cast<float>(std::max({a.z(), b.z(), c.z()})) + kPad;
          over_cells(map, std::min({a.x(), b.x(), c.x()}), std::max({a.x(), b.x(), c.x()}),
                     std::min({a.y(), b.y(), c.y()}), std::max({a.y(), b.y(), c.y()}), [&](std::size_t cell) {
                       part.slope[cell] = std::max(part.slope[cell], slope);
                       part.low[cell] = std::min(part.low[cell], low);
                       part.high[cell] = std::max(part.high[cell], high);
                     });
        }
        return part;
      },
      [](Ground one, const Ground& other) {
        one.join(other);
        return one;
      });
}

/// The most within `width` cells along both axes, no less than zero. Cells at the map's edge hold what lies beside it
/// (over_cells).
std::vector<float> widened(const LampBearings& map, const std::vector<float>& from, int width) {
  const auto along = [&](const std::vector<float>& source, int count, int stride, int lines, int line_stride) {
    std::vector<float> to(source.size());
    for (int line = 0; line < lines; ++line) {
      const float* in = source.data() + static_cast<std::size_t>(line) * line_stride;
      for (int k = 0; k < count; ++k) {
        float most = 0.0f;
        for (int n = std::max(0, k - width); n <= std::min(count - 1, k + width); ++n) {
          most = std::max(most, in[static_cast<std::size_t>(n) * stride]);
        }
        to[static_cast<std::size_t>(line) * line_stride + static_cast<std::size_t>(k) * stride] = most;
      }
    }
    return to;
  };
  return along(along(from, map.columns, 1, map.rows, map.columns), map.rows, map.columns, map.columns, 1);
}

Eigen::AlignedBox3d box_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& vertex : mesh.vertices) box.extend(vertex);
  return box;
}

/// The box round a lamp's luminous face, seen along z.
Eigen::AlignedBox2d outline(const Lamp& lamp) {
  const Eigen::Vector2d middle = lamp_position(lamp).head<2>();
  Eigen::Vector2d half = Eigen::Vector2d::Constant(lamp_extent(lamp));
  if (const auto* guide = std::get_if<GuideLamp>(&lamp)) {
    const Eigen::Vector2d ahead = guide->direction.head<2>().normalized();
    half = 0.5 * guide->width * Eigen::Vector2d(std::abs(ahead.y()), std::abs(ahead.x()));
  } else if (disc_radius(lamp) > 0.0) {
    const Eigen::Vector3d out = lamp_direction(lamp).normalized();
    half = disc_radius(lamp) * (1.0 - out.head<2>().array().square()).max(0.0).sqrt();
  }
  return {Eigen::Vector2d(middle - half), Eigen::Vector2d(middle + half)};
}

/// Tells what needn't be asked for shadows: walls whose shadows the light field has, and what stands round the sheet,
/// seen along z and less a rim that pressing moves, and so can't hide lamps within.
class WallsRound {
 public:
  WallsRound(const LampBearings& bearings, const Eigen::AlignedBox3d& sheet)
      : known_(bearings.walls),
        inner_(Eigen::Vector2d(sheet.min().head<2>().array() + kRim),
               Eigen::Vector2d(sheet.max().head<2>().array() - kRim)) {
    const Eigen::AlignedBox2d outer(Eigen::Vector2d(sheet.min().head<2>().array() - kRim),
                                    Eigen::Vector2d(sheet.max().head<2>().array() + kRim));
    enclosed_ = !bearings.shining.isEmpty() && !inner_.isEmpty() && outer.contains(bearings.shining);
  }

  bool contain(const TriangleMesh& mesh, const std::array<int, 3>& triangle) const {
    const std::array<Eigen::Vector3d, 3> corners = {mesh.vertices[triangle[0]], mesh.vertices[triangle[1]],
                                                    mesh.vertices[triangle[2]]};
    if (known_.hold(corners)) return true;
    Eigen::AlignedBox3d part;
    for (const Eigen::Vector3d& corner : corners) part.extend(corner);
    return enclosed_ && ((part.max().head<2>().array() <= inner_.min().array()).any() ||
                         (part.min().head<2>().array() >= inner_.max().array()).any());
  }

 private:
  static constexpr double kRim = 0.05;  // mm
  const UprightWalls& known_;
  Eigen::AlignedBox2d inner_;
  bool enclosed_ = false;
};

}  // namespace

bool is_sheet_alone(const LampBearings& bearings, const Scene& scene) {
  if (scene.surfaces.empty() || !scene.balls.empty()) return false;
  const WallsRound walls(bearings, box_of(scene.surfaces[0].mesh));
  return std::all_of(scene.surfaces.begin() + 1, scene.surfaces.end(), [&](const Surface& surface) {
    if (is_film(surface)) return true;
    return std::ranges::all_of(surface.mesh.triangles,
                               [&](const std::array<int, 3>& t) { return walls.contain(surface.mesh, t); });
  });
}

bool is_connected(const TriangleMesh& mesh) {
  std::vector<int> above(mesh.vertices.size());
  std::iota(above.begin(), above.end(), 0);
  const auto root = [&](int v) {
    while (above[v] != v) v = above[v] = above[above[v]];
    return v;
  };
  for (const auto& t : mesh.triangles) {
    above[root(t[1])] = root(t[0]);
    above[root(t[2])] = root(t[0]);
  }
  int first = -1;
  for (const auto& t : mesh.triangles) {
    const int r = root(t[0]);
    if (first < 0) first = r;
    if (r != first) return false;
  }
  return true;
}

LampBearings::LampBearings(const LightField& field, bool soft)
    : lamps(field.beam_count()), longest(field.beam_count(), 0.0f), walls(field.walls) {
  const Eigen::Vector3d size = field.reach.sizes();
  cell = static_cast<float>(std::max(size.x(), size.y()) / kMostCells);
  left = static_cast<float>(field.reach.min().x());
  bottom = static_cast<float>(field.reach.min().y());
  columns = 1 + static_cast<int>(size.x() / double(cell));
  rows = 1 + static_cast<int>(size.y() / double(cell));
  floor = static_cast<float>(field.reach.min().z());
  slabs = std::clamp(static_cast<int>(std::ceil(size.z() / (0.5 * double(cell)))), 1, kMostSlabs);
  slab = static_cast<float>(size.z() / slabs);
  bearings.resize(static_cast<std::size_t>(slabs) * columns * rows * lamps);
  for (const Lamp& lamp : field.fixture.lamps) shining.extend(outline(lamp));
  // A ray to another point of a lens takes the field's direction at a place that is set off by up to the lens's radius
  // and what it takes along a slanting ray (DirectBatch::choose_lens_points).
  std::vector<float> set_off(lamps, 0.0f);
  for (int lamp = 0; soft && lamp < lamps; ++lamp) {
    set_off[lamp] = static_cast<float>(disc_radius(field.lamp(lamp)));
  }
  tbb::parallel_for(0, slabs * rows, [&](int line) {
    const int row = line % rows;
    const float middle_z = floor + (static_cast<float>(line / rows) + 0.5f) * slab;
    const float y = bottom + (static_cast<float>(row) + 0.5f) * cell;
    // What the lamps send to 27 places of the cell, and beside it as far as lenses ask.
    for (int column = 0; column < columns; ++column) {
      const float x = left + (static_cast<float>(column) + 0.5f) * cell;
      const auto find_direction = [&](float px, float py, float pz, int lamp, Eigen::Vector3f& to) {
        to = -look_up_flow(field, find_cell(field, px, py, pz), lamp);
        return to.squaredNorm() > 0.0f && to.z() != 0.0f;
      };
      for (int lamp = 0; lamp < lamps; ++lamp) {
        Bearing& made = bearings[(static_cast<std::size_t>(line) * columns + column) * lamps + lamp];
        Eigen::Vector3f to;
        if (!find_direction(x, y, middle_z, lamp, to)) continue;
        made.side = to.z() > 0.0f ? 1.0f : -1.0f;
        const Eigen::Vector2f middle = to.head<2>() / std::abs(to.z());
        made.x = middle.x();
        made.y = middle.y();
        made.length = middle.norm();
        const Eigen::Vector3d& real = lamp_position(field.lamp(lamp));
        const double sent_across = (Eigen::Vector3d(x, y, middle_z) - real).head<2>().norm();
        const double sent_along = std::max(1e-6, std::abs(double(middle_z) - real.z()));
        const float off =
            0.5f * cell + set_off[lamp] * (1.0f + static_cast<float>(std::min(31.0, 2.0 * sent_across / sent_along)));
        const auto step = [](int n) { return static_cast<float>(n - 1); };
        float spread = 0.0f;
        float swing = 0.0f;
        const auto swings = [&](const Eigen::Vector3f& other) {
          const Eigen::Vector2f flat = other.head<2>();
          const bool known = flat.squaredNorm() > 0.0f && middle.squaredNorm() > 0.0f;
          return known ? (flat.normalized() - middle.normalized()).norm() : 2.0f;
        };
        for (int k = 0; k < 27 && std::isfinite(spread); ++k) {
          const bool lit = find_direction(x + off * step(k % 3), y + off * step(k / 3 % 3),
                                          middle_z + 0.5f * slab * step(k / 9), lamp, to);
          spread = lit && to.z() * made.side > 0.0f
                       ? std::max(spread, (to.head<2>() / std::abs(to.z()) - middle).norm())
                       : kEndless;
          swing = std::max(swing, lit ? swings(to) : 2.0f);
        }
        // Rays go to all of a beam, half as far as the next one's middle.
        float wide = 0.0f;
        float wide_swing = 0.0f;
        const BesideBeam& beside = field.beside[lamp];
        for (const auto& [one, other] : {std::pair{beside.flatter, beside.steeper}, {beside.left, beside.right}}) {
          float most = 0.0f;
          float most_swing = 0.0f;
          for (const int next : {one, other}) {
            if (next < 0) continue;
            const bool lit = find_direction(x, y, middle_z, next, to);
            most = lit && to.z() * made.side > 0.0f ? std::max(most, (to.head<2>() / std::abs(to.z()) - middle).norm())
                                                    : kEndless;
            most_swing = std::max(most_swing, lit ? swings(to) : 2.0f);
          }
          wide += 0.55f * most;
          wide_swing += 0.55f * most_swing;
        }
        made.swing = std::min(1.5f * swing + wide_swing + 1e-3f, 2.0f);
        made.spread = 1.5f * spread + wide + 1e-3f;  // a half more for what lies between those places
      }
    }
  });
  for (std::size_t k = 0; k < bearings.size(); ++k) {
    longest[k % lamps] = std::max(longest[k % lamps], bearings[k].length + bearings[k].spread);
  }
}

int LampBearings::cell_at(float x, float y) const {
  const int i = static_cast<int>(std::floor((x - left) / cell));
  const int j = static_cast<int>(std::floor((y - bottom) / cell));
  return i < 0 || j < 0 || i >= columns || j >= rows ? -1 : j * columns + i;
}

int LampBearings::slab_at(float z) const {
  return static_cast<int>(std::clamp((z - floor) / slab, 0.0f, static_cast<float>(slabs - 1)));
}

ShadowReach::ShadowReach(const LampBearings& bearings, const Scene& scene, bool connected)
    : bearings_(bearings), all_(bearings.lamps == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bearings.lamps) - 1) {
  const Eigen::AlignedBox3d sheet = scene.surfaces.empty() ? Eigen::AlignedBox3d() : box_of(scene.surfaces[0].mesh);
  const WallsRound walls(bearings, sheet);
  // Of the sheet and what stands on the map for columns, and of everything.
  Eigen::AlignedBox3d solid = sheet;
  for (std::size_t i = 1; i < scene.surfaces.size(); ++i) {
    if (is_film(scene.surfaces[i])) continue;
    const TriangleMesh& other = scene.surfaces[i].mesh;
    for (const auto& t : other.triangles) {
      if (walls.contain(other, t)) continue;
      for (int corner : t) solid.extend(other.vertices[corner]);
    }
  }
  Eigen::AlignedBox3d everything = solid;
  for (const Ball& ball : scene.balls) {
    everything.extend((ball.centre.array() - ball.radius).matrix());
    everything.extend((ball.centre.array() + ball.radius).matrix());
  }
  if (everything.isEmpty()) return;
  low_ = static_cast<float>(everything.min().z()) - kPad;
  high_ = static_cast<float>(everything.max().z()) + kPad;
  if (scene.surfaces.empty() || scene.surfaces[0].mesh.triangles.empty() || !connected) return;

  const LampBearings& map = bearings_;
  Ground ground = ground_of(map, scene.surfaces[0].mesh);
  if (ground.upright || ground.up == ground.down) return;  // not a height field
  only_sheet_ = scene.balls.empty();
  for (std::size_t i = 1; i < scene.surfaces.size(); ++i) {
    if (is_film(scene.surfaces[i])) continue;
    const TriangleMesh& other = scene.surfaces[i].mesh;
    for (const auto& t : other.triangles) {
      if (walls.contain(other, t)) continue;
      Eigen::AlignedBox3d part;
      for (int corner : t) part.extend(other.vertices[corner]);
      only_sheet_ = false;
      over_cells(map, part.min().x(), part.max().x(), part.min().y(), part.max().y(),
                 [&](std::size_t cell) { ground.slope[cell] = kEndless; });
    }
  }
  // How far what stands in a cell reaches down, and up; no less than to z = 0 (see widened).
  std::vector<float> down(ground.slope.size());
  std::vector<float> up(ground.slope.size());
  for (std::size_t k = 0; k < ground.slope.size(); ++k) {
    const bool column = std::isinf(ground.slope[k]);
    down[k] = column ? kEndless : -ground.low[k];
    up[k] = column ? kEndless : ground.high[k];
  }
  std::array<std::vector<float>, kWidths.size()> slopes, downs, ups;
  tbb::parallel_for(std::size_t{0}, 3 * kWidths.size(), [&](std::size_t k) {
    const std::size_t width = k / 3;
    if (k % 3 == 0) slopes[width] = widened(map, ground.slope, kWidths[width]);
    if (k % 3 == 1) downs[width] = widened(map, down, kWidths[width]);
    if (k % 3 == 2) ups[width] = widened(map, up, kWidths[width]);
  });
  const float solid_low = static_cast<float>(solid.min().z()) - kPad;
  const float solid_high = static_cast<float>(solid.max().z()) + kPad;

  // May a ray from this cell to this lamp meet the sheet? `clear` is the least that it can be above it.
  const auto meets_ground = [&](int column, int row, const LampBearings::Bearing& to) {
    const std::size_t here = static_cast<std::size_t>(row) * map.columns + column;
    const float height = to.side < 0.0f ? ground.high[here] - solid_low : solid_high - ground.low[here];
    const float most = to.length + to.spread;  // across a mm of height, of the flattest ray
    // In steps of half a cell along the heading; a ray may stray from it by its swing, and by where it began.
    const float step = 0.5f * map.cell;
    const int steps = static_cast<int>(std::ceil(std::min(1e3f, height * most / step))) + 1;
    const float dx = to.length > 0.0f ? 0.5f * to.x / to.length : 0.0f;
    const float dy = to.length > 0.0f ? 0.5f * to.y / to.length : 0.0f;
    float clear = 0.0f;
    for (int k = 0; k < steps; ++k) {
      const float along = static_cast<float>(k) + 0.5f;
      const float drift = 1.0f + to.swing * 0.5f * (along + 0.5f);
      std::size_t width = 0;
      while (width < kWidths.size() && !(drift <= static_cast<float>(kWidths[width]))) ++width;
      if (width == kWidths.size()) return true;
      const auto cell = [](float at, int count) {
        return static_cast<int>(std::clamp(at, 0.0f, static_cast<float>(count - 1)));
      };
      const int i = cell(static_cast<float>(column) + 0.5f + along * dx, map.columns);
      const int j = cell(static_cast<float>(row) + 0.5f + along * dy, map.rows);
      const std::size_t there = static_cast<std::size_t>(j) * map.columns + i;
      // Nothing there may reach as far as the ray has risen at least, or it has risen more than the sheet has.
      const float risen = static_cast<float>(k) * step / most;
      const float apart = to.side < 0.0f ? risen - ground.high[here] - downs[width][there]
                                         : risen + ground.low[here] - ups[width][there];
      clear += step * (1.0f / most - slopes[width][there]);
      if (apart > 0.0f) clear = std::max(clear, apart);
      if (!(clear >= 0.0f)) return true;
    }
    return false;
  };
  // May it meet this ball? Seen along z the ray's foot must lie in the ellipse that the ball covers, which is swept
  // along the lamp's bearing by the heights that the sheet has in the cell.
  const auto meets_ball = [&](int column, int row, const LampBearings::Bearing& to, const Ball& ball) {
    const std::size_t here = static_cast<std::size_t>(row) * map.columns + column;
    const auto r = static_cast<float>(ball.radius);
    const auto z = static_cast<float>(ball.centre.z());
    const float near = to.side > 0.0f ? z - ground.high[here] : ground.low[here] - z;
    const float far = to.side > 0.0f ? z - ground.low[here] : ground.high[here] - z;
    if (far + r < 0.0f) return false;
    const float x = static_cast<float>(ball.centre.x()) - map.left - (static_cast<float>(column) + 0.5f) * map.cell;
    const float y = static_cast<float>(ball.centre.y()) - map.bottom - (static_cast<float>(row) + 0.5f) * map.cell;
    const float ex = to.length > 0.0f ? to.x / to.length : 1.0f;
    const float ey = to.length > 0.0f ? to.y / to.length : 0.0f;
    const float most = to.length + to.spread;
    const float margin = 0.71f * map.cell + to.spread * (std::abs(far) + r) + kPad;
    const float half = r * std::sqrt(1.0f + most * most) + margin;
    // Across the bearing the ellipse is as wide as the ball, but directions that differ turn it.
    const float narrow = margin + r * (1.0f + to.spread * (1.0f + most) / std::max(to.length, 1e-6f));
    const float along = x * ex + y * ey;
    return std::abs(x * ey - y * ex) <= std::min(narrow, half) && along >= to.length * near - half &&
           along <= to.length * far + half;
  };

  doubt_.assign(static_cast<std::size_t>(map.columns) * map.rows, 0);
  tbb::parallel_for(0, map.rows, [&](int row) {
    const float y = map.bottom + (static_cast<float>(row) + 0.5f) * map.cell;
    for (int lamp = 0; lamp < map.lamps; ++lamp) {
      const std::uint64_t bit = std::uint64_t{1} << lamp;
      // Of all slabs in which the sheet lies over a cell.
      const auto any_bearing = [&](int column, auto&& meets) {
        const std::size_t here = static_cast<std::size_t>(row) * map.columns + column;
        if (!(ground.low[here] <= ground.high[here])) return false;  // no sheet there, no place to ask for
        const int last = map.slab_at(ground.high[here]);
        for (int slab = map.slab_at(ground.low[here]); slab <= last; ++slab) {
          const LampBearings::Bearing& to = map.bearing(slab, row, column, lamp);
          if (to.side == 0.0f || !std::isfinite(to.spread) || meets(to)) return true;
        }
        return false;
      };
      std::uint64_t* doubt = doubt_.data() + static_cast<std::size_t>(row) * map.columns;
      for (int column = 0; column < map.columns; ++column) {
        const auto meets = [&](const LampBearings::Bearing& to) { return meets_ground(column, row, to); };
        if (any_bearing(column, meets)) doubt[column] |= bit;
      }
      for (const Ball& ball : scene.balls) {
        const auto r = static_cast<float>(ball.radius);
        const float height = high_ - low_ + r;
        const float reach =
            std::min(1e6f, map.longest[lamp] * height + r * (2.0f + map.longest[lamp]) + 2.0f * map.cell);
        if (std::abs(static_cast<float>(ball.centre.y()) - y) > reach) continue;
        const float middle = (static_cast<float>(ball.centre.x()) - map.left) / map.cell;
        const float most = static_cast<float>(map.columns - 1);
        const int first = static_cast<int>(std::clamp(std::floor(middle - reach / map.cell), 0.0f, most));
        const int last = static_cast<int>(std::clamp(std::ceil(middle + reach / map.cell), 0.0f, most));
        for (int column = first; column <= last; ++column) {
          if ((doubt[column] & bit) != 0) continue;
          const auto meets = [&](const LampBearings::Bearing& to) { return meets_ball(column, row, to, ball); };
          if (any_bearing(column, meets)) doubt[column] |= bit;
        }
      }
    }
  });
  sheet_ = true;
}

std::uint64_t ShadowReach::doubtful(float x, float y, int from) const {
  if (!sheet_ || from != 0) return all_;
  const int cell = bearings_.cell_at(x, y);
  return cell < 0 ? all_ : doubt_[cell];
}

}  // namespace touchstone::render
