#include "render/shadow_reach.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace touchstone::render {
namespace {

constexpr float kPad = 1e-3f;  // mm: more than single precision moves anything
constexpr float kEndless = std::numeric_limits<float>::infinity();
constexpr float kUsual = 0.5f;  // rise of a ray per mm across
constexpr int kMostCells = 48;  // along the longer side

}  // namespace

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

ShadowReach::ShadowReach(const Scene& scene, bool connected) {
  Eigen::AlignedBox3d everything;
  for (const Surface& surface : scene.surfaces) {
    for (const auto& vertex : surface.mesh.vertices) everything.extend(vertex);
  }
  for (const Ball& ball : scene.balls) {
    everything.extend((ball.centre.array() - ball.radius).matrix());
    everything.extend((ball.centre.array() + ball.radius).matrix());
  }
  if (everything.isEmpty()) return;
  low_ = static_cast<float>(everything.min().z()) - kPad;
  high_ = static_cast<float>(everything.max().z()) + kPad;
  if (scene.surfaces.empty()) return;
  const TriangleMesh& mesh = scene.surfaces[0].mesh;
  if (mesh.triangles.empty() || !connected) return;

  Eigen::AlignedBox3d box;
  for (const auto& vertex : mesh.vertices) box.extend(vertex);
  const Eigen::Vector3d size = box.sizes();
  cell_ = static_cast<float>(std::max({size.x(), size.y(), 1e-3}) / kMostCells);
  left_ = static_cast<float>(box.min().x());
  bottom_ = static_cast<float>(box.min().y());
  columns_ = 1 + static_cast<int>(size.x() / double(cell_));
  rows_ = 1 + static_cast<int>(size.y() / double(cell_));
  slope_.assign(static_cast<std::size_t>(columns_) * rows_, 0.0f);
  using Map = std::vector<float>;
  const auto raise = [&](Map& map, double x0, double x1, double y0, double y1, float slope) {
    const auto cell = [&](double v, float from, int most) {
      return std::clamp(static_cast<int>(std::floor((v - double(from)) / double(cell_))), 0, most - 1);
    };
    const int i0 = cell(x0 - double(kPad), left_, columns_);
    const int i1 = cell(x1 + double(kPad), left_, columns_);
    const int j1 = cell(y1 + double(kPad), bottom_, rows_);
    for (int j = cell(y0 - double(kPad), bottom_, rows_); j <= j1; ++j) {
      for (int i = i0; i <= i1; ++i) {
        float& here = map[static_cast<std::size_t>(j) * columns_ + i];
        here = std::max(here, slope);
      }
    }
  };
  // A largest value doesn't depend on the order of looking, so the parts may be cut anywhere.
  struct Part {
    Map map;
    bool up = false, down = false, upright = false;
  };
  const Part whole = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 4096), Part{slope_},
      [&](const tbb::blocked_range<std::size_t>& range, Part part) {
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
          raise(part.map, std::min({a.x(), b.x(), c.x()}), std::max({a.x(), b.x(), c.x()}),
                std::min({a.y(), b.y(), c.y()}), std::max({a.y(), b.y(), c.y()}), slope);
        }
        return part;
      },
      [](Part one, const Part& other) {
        for (std::size_t k = 0; k < one.map.size(); ++k) one.map[k] = std::max(one.map[k], other.map[k]);
        one.up = one.up || other.up;
        one.down = one.down || other.down;
        one.upright = one.upright || other.upright;
        return one;
      });
  if (whole.upright || whole.up == whole.down) return;  // not a height field
  slope_ = whole.map;
  for (std::size_t i = 1; i < scene.surfaces.size(); ++i) {
    const TriangleMesh& other = scene.surfaces[i].mesh;
    for (const auto& t : other.triangles) {
      Eigen::AlignedBox3d part;
      for (int corner : t) part.extend(other.vertices[corner]);
      raise(slope_, part.min().x(), part.max().x(), part.min().y(), part.max().y(), kEndless);
    }
  }
  for (const Ball& ball : scene.balls) {
    raise(slope_, ball.centre.x() - ball.radius, ball.centre.x() + ball.radius, ball.centre.y() - ball.radius,
          ball.centre.y() + ball.radius, kEndless);
  }
  // The widest way that a usual ray goes across before it has left the height of everything; a cell beyond the map's
  // edge is unknown, so cells near the edge are endless.
  const int reach = 1 + static_cast<int>(std::ceil((high_ - low_) / kUsual / cell_));
  Map along(slope_.size(), 0.0f);
  around_.assign(slope_.size(), 0.0f);
  const auto widen = [&](const Map& from, Map& to, int count, int stride, int lines, int line_stride) {
    for (int line = 0; line < lines; ++line) {
      for (int k = 0; k < count; ++k) {
        float most = k < reach || k + reach >= count ? kEndless : 0.0f;
        for (int n = std::max(0, k - reach); n <= std::min(count - 1, k + reach); ++n) {
          most = std::max(most, from[static_cast<std::size_t>(line) * line_stride + std::size_t(n) * stride]);
        }
        to[static_cast<std::size_t>(line) * line_stride + std::size_t(k) * stride] = most;
      }
    }
  };
  widen(slope_, along, columns_, 1, rows_, columns_);
  widen(along, around_, rows_, columns_, columns_, 1);
  sheet_ = true;
}

float ShadowReach::safe_steepness(float x, float y, int from) const {
  if (!sheet_ || from != 0) return kEndless;
  const int i = static_cast<int>(std::floor((x - left_) / cell_));
  const int j = static_cast<int>(std::floor((y - bottom_) / cell_));
  if (i < 0 || j < 0 || i >= columns_ || j >= rows_) return kEndless;
  return std::max(kUsual, around_[static_cast<std::size_t>(j) * columns_ + i]);
}

float ShadowReach::length(float x, float y, float z, float dx, float dy, float dz, float far, int from) const {
  // Above or below everything.
  const float limit = dz > 0.0f ? high_ : low_;
  if (dz != 0.0f) far = std::min(far, std::max(0.0f, (limit - z) / dz));
  if (!(far > 0.0f) || !sheet_ || from != 0) return std::max(0.0f, far);

  const float across = std::sqrt(dx * dx + dy * dy);
  const float climb = std::abs(dz);
  int i = static_cast<int>(std::floor((x - left_) / cell_));
  int j = static_cast<int>(std::floor((y - bottom_) / cell_));
  // Runs cell by cell; `clear` is the least that it can be above the sheet.
  float clear = 0.0f;
  float t = 0.0f;
  const int step_i = dx > 0.0f ? 1 : -1;
  const int step_j = dy > 0.0f ? 1 : -1;
  const float per_i = dx != 0.0f ? cell_ / std::abs(dx) : kEndless;
  const float per_j = dy != 0.0f ? cell_ / std::abs(dy) : kEndless;
  float next_i = dx != 0.0f ? (left_ + static_cast<float>(i + (dx > 0.0f ? 1 : 0)) * cell_ - x) / dx : kEndless;
  float next_j = dy != 0.0f ? (bottom_ + static_cast<float>(j + (dy > 0.0f ? 1 : 0)) * cell_ - y) / dy : kEndless;
  while (t < far) {
    // Beside the sheet there may be other things, which the map doesn't hold.
    if (i < 0 || j < 0 || i >= columns_ || j >= rows_) return far;
    const float until = std::min(far, std::min(next_i, next_j));
    const float slope = slope_[static_cast<std::size_t>(j) * columns_ + i];
    clear += (climb - slope * across) * (until - t);
    if (!(clear >= 0.0f)) return far;
    t = until;
    if (next_i < next_j) {
      i += step_i;
      next_i += per_i;
    } else {
      j += step_j;
      next_j += per_j;
    }
  }
  return 0.0f;
}

}  // namespace touchstone::render
