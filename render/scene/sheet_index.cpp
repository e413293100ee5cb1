#include "render/scene/sheet_index.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace touchstone::render {
namespace {

constexpr double kOnEdge = 1e-9;     // a ray between two triangles meets both
constexpr float kPad = 1e-5f;        // mm: heights of a cell are kept in single precision
constexpr double kOnceOnly = 0.9;    // of the squared product of slopes at which a ray would run along the sheet
constexpr double kEdgesACell = 1.5;  // of the median edge
constexpr int kMostCells = 1024;     // a side

/// The median length of edges seen along z, of every so many triangles.
double median_edge(const TriangleMesh& mesh) {
  std::vector<double> lengths;
  const std::size_t step = std::max<std::size_t>(1, mesh.triangles.size() / 512);
  for (std::size_t k = 0; k < mesh.triangles.size(); k += step) {
    const auto& t = mesh.triangles[k];
    lengths.push_back((mesh.vertices[t[1]] - mesh.vertices[t[0]]).head<2>().norm());
  }
  if (lengths.empty()) return 1.0;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

/// meet_triangle without its optional, for the loop over a cell's triangles. [Moeller1997]
inline bool meet(const TriangleMesh& mesh, int triangle, const Eigen::Vector3d& origin,
                 const Eigen::Vector3d& direction, double beside, SheetHit& hit) {
  const auto& t = mesh.triangles[static_cast<std::size_t>(triangle)];
  const Eigen::Vector3d& a = mesh.vertices[t[0]];
  const Eigen::Vector3d e1 = mesh.vertices[t[1]] - a;
  const Eigen::Vector3d e2 = mesh.vertices[t[2]] - a;
  const Eigen::Vector3d p = direction.cross(e2);
  const double det = e1.dot(p);
  if (det == 0.0) return false;
  const Eigen::Vector3d s = origin - a;
  const double u = s.dot(p) / det;
  if (!(u >= -beside && u <= 1.0 + beside)) return false;
  const Eigen::Vector3d q = s.cross(e1);
  const double v = direction.dot(q) / det;
  if (!(v >= -beside && u + v <= 1.0 + beside)) return false;
  hit = {triangle, u, v, e2.dot(q) / det};
  return true;
}

}  // namespace

std::optional<SheetHit> meet_triangle(const TriangleMesh& mesh, int triangle, const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction, double beside) {
  SheetHit hit;
  if (!meet(mesh, triangle, origin, direction, beside, hit)) return std::nullopt;
  return hit;
}

SheetIndex::SheetIndex(const Surface& surface, const Eigen::AlignedBox2d& seen) : surface_(surface) {
  const TriangleMesh& mesh = surface.mesh;
  Eigen::AlignedBox2d all;
  for (const auto& v : mesh.vertices) all.extend(Eigen::Vector2d(v.head<2>()));
  const Eigen::AlignedBox2d box = all.intersection(seen);
  if (box.isEmpty() || mesh.triangles.empty()) return;
  const double side = box.sizes().maxCoeff();
  cell_ = std::max({kEdgesACell * median_edge(mesh), side / kMostCells, 1e-9});
  left_ = box.min().x();
  bottom_ = box.min().y();
  columns_ = 1 + static_cast<int>(box.sizes().x() / cell_);
  rows_ = 1 + static_cast<int>(box.sizes().y() / cell_);

  // Counted, then put in: each cell's triangles stand together, in their order.
  struct Cells {
    int i0, i1, j0, j1;
  };
  std::vector<Cells> of(mesh.triangles.size());
  first_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  low_ = std::numeric_limits<double>::infinity();
  high_ = -low_;
  bool up = false, down = false;
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    const auto& t = mesh.triangles[k];
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    const Eigen::Vector3d& b = mesh.vertices[t[1]];
    const Eigen::Vector3d& c = mesh.vertices[t[2]];
    const double x0 = (std::min({a.x(), b.x(), c.x()}) - left_) / cell_ - kOnEdge;
    const double x1 = (std::max({a.x(), b.x(), c.x()}) - left_) / cell_ + kOnEdge;
    const double y0 = (std::min({a.y(), b.y(), c.y()}) - bottom_) / cell_ - kOnEdge;
    const double y1 = (std::max({a.y(), b.y(), c.y()}) - bottom_) / cell_ + kOnEdge;
    if (!(x1 >= 0.0 && y1 >= 0.0 && x0 < columns_ && y0 < rows_)) {
      of[k] = {0, -1, 0, -1};
      continue;
    }
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    (normal.z() < 0.0 ? down : up) |= normal.z() != 0.0;
    const double across2 = normal.head<2>().squaredNorm();
    if (across2 > steepest2_ * (normal.z() * normal.z())) {
      steepest2_ = normal.z() != 0.0 ? across2 / (normal.z() * normal.z()) : std::numeric_limits<double>::infinity();
    }
    low_ = std::min({low_, a.z(), b.z(), c.z()});
    high_ = std::max({high_, a.z(), b.z(), c.z()});
    of[k] = {std::max(0, static_cast<int>(x0)), std::min(columns_ - 1, static_cast<int>(x1)),
             std::max(0, static_cast<int>(y0)), std::min(rows_ - 1, static_cast<int>(y1))};
    for (int j = of[k].j0; j <= of[k].j1; ++j) {
      for (int i = of[k].i0; i <= of[k].i1; ++i) ++first_[static_cast<std::size_t>(j) * columns_ + i + 1];
    }
  }
  if (up && down) steepest2_ = std::numeric_limits<double>::infinity();
  for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
  triangles_.resize(static_cast<std::size_t>(first_.back()));
  heights_.assign(first_.size() - 1, {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()});
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    if (of[k].i1 < of[k].i0 || of[k].j1 < of[k].j0) continue;
    const auto& t = mesh.triangles[k];
    const double z[3] = {mesh.vertices[t[0]].z(), mesh.vertices[t[1]].z(), mesh.vertices[t[2]].z()};
    const float low = static_cast<float>(std::min({z[0], z[1], z[2]})) - kPad;
    const float high = static_cast<float>(std::max({z[0], z[1], z[2]})) + kPad;
    for (int j = of[k].j0; j <= of[k].j1; ++j) {
      for (int i = of[k].i0; i <= of[k].i1; ++i) {
        const std::size_t cell = static_cast<std::size_t>(j) * columns_ + i;
        triangles_[static_cast<std::size_t>(next[cell]++)] = static_cast<int>(k);
        heights_[cell].low = std::min(heights_[cell].low, low);
        heights_[cell].high = std::max(heights_[cell].high, high);
      }
    }
  }
}

std::optional<SheetHit> SheetIndex::first(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                          double far) const {
  if (columns_ == 0) return std::nullopt;
  const TriangleMesh& mesh = surface_.mesh;
  // The part of the ray that is as high as the sheet, and over the grid.
  double from = 0.0;
  double to = far;
  const auto keep = [&](double at, double along, double least, double most) {
    if (along == 0.0) {
      if (at < least || at > most) to = -1.0;
      return;
    }
    const double one = (least - at) / along;
    const double other = (most - at) / along;
    from = std::max(from, std::min(one, other));
    to = std::min(to, std::max(one, other));
  };
  keep(origin.z(), direction.z(), low_ - double(kPad), high_ + double(kPad));
  keep(origin.x(), direction.x(), left_, left_ + cell_ * columns_);
  keep(origin.y(), direction.y(), bottom_, bottom_ + cell_ * rows_);
  if (!(from <= to)) return std::nullopt;

  const Eigen::Vector3d start = origin + from * direction;
  const auto cell_of = [&](double at, double first, int count) {
    return std::clamp(static_cast<int>((at - first) / cell_), 0, count - 1);
  };
  int i = cell_of(start.x(), left_, columns_);
  int j = cell_of(start.y(), bottom_, rows_);
  const int step_i = direction.x() > 0.0 ? 1 : -1;
  const int step_j = direction.y() > 0.0 ? 1 : -1;
  constexpr double kNever = std::numeric_limits<double>::infinity();
  // Distances along the ray to the next border of a column and of a row, and from one to the next.
  double next_i = direction.x() == 0.0 ? kNever : (left_ + cell_ * (i + (step_i > 0)) - origin.x()) / direction.x();
  double next_j = direction.y() == 0.0 ? kNever : (bottom_ + cell_ * (j + (step_j > 0)) - origin.y()) / direction.y();
  const double stride_i = direction.x() == 0.0 ? kNever : cell_ / std::abs(direction.x());
  const double stride_j = direction.y() == 0.0 ? kNever : cell_ / std::abs(direction.y());

  // A height field that is nowhere as steep as the ray is met once.
  const bool once = direction.head<2>().squaredNorm() * steepest2_ < kOnceOnly * direction.z() * direction.z();
  std::optional<SheetHit> nearest;
  double most = to;
  for (double here = from;;) {
    const double leave = std::min({next_i, next_j, to});
    const std::size_t cell = static_cast<std::size_t>(j) * columns_ + i;
    const double z0 = origin.z() + here * direction.z();
    const double z1 = origin.z() + leave * direction.z();
    if (std::max(z0, z1) >= double(heights_[cell].low) && std::min(z0, z1) <= double(heights_[cell].high)) {
      for (int k = first_[cell]; k < first_[cell + 1]; ++k) {
        const int triangle = triangles_[static_cast<std::size_t>(k)];
        SheetHit hit;
        if (!meet(mesh, triangle, origin, direction, kOnEdge, hit)) continue;
        if (!(hit.distance >= 0.0 && hit.distance <= most)) continue;
        if (nearest && hit.distance == most) continue;  // of two that share the place the first
        most = hit.distance;
        nearest = hit;
        if (once) return nearest;
      }
    }
    // What is met in a later cell is farther away.
    if (leave >= to || most <= leave) return nearest;
    here = leave;
    if (next_i <= next_j) {
      i += step_i;
      next_i += stride_i;
      if (i < 0 || i >= columns_) return nearest;
    } else {
      j += step_j;
      next_j += stride_j;
      if (j < 0 || j >= rows_) return nearest;
    }
  }
}

SheetNormals normals_at(const Surface& surface, const SheetHit& hit) {
  const auto& corners = surface.mesh.triangles[static_cast<std::size_t>(hit.triangle)];
  const Eigen::Vector3d& a = surface.mesh.vertices[corners[0]];
  SheetNormals found;
  found.face = (surface.mesh.vertices[corners[1]] - a).cross(surface.mesh.vertices[corners[2]] - a);
  found.shading = found.face;
  if (surface.normals.empty()) return found;
  const Eigen::Vector3d smooth = (1.0 - hit.u - hit.v) * surface.normals[corners[0]] +
                                 hit.u * surface.normals[corners[1]] + hit.v * surface.normals[corners[2]];
  // As RayScene has it: a fold sharper than that isn't a smooth surface.
  const double length = smooth.norm();
  if (length > 0.1 && smooth.dot(found.face) > 0.5 * length * found.face.norm()) found.shading = smooth;
  return found;
}

}  // namespace touchstone::render
