#include "sim/sensor/sheet_motion.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/grid_places.h"

namespace touchstone::sim {
namespace {

constexpr double kNodesAnEdge = 3.0;
constexpr int kMostNodes = 512;  // a side
constexpr int kSmoothings = 2;   // by 1/4, 1/2, 1/4 along both axes: a standard deviation of one node's pitch in all
constexpr int kRowsATask = 2048;

using Weights = Eigen::SparseMatrix<float, Eigen::RowMajor>;

/// Mean of a node and those beside it along one axis, at a border of those that are there.
Weights smoothing(int nx, int ny, bool along_x) {
  std::vector<Eigen::Triplet<float>> entries;
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const int at = along_x ? i : j;
      const int last = (along_x ? nx : ny) - 1;
      const int apart = along_x ? 1 : nx;
      const int node = j * nx + i;
      const bool below = at > 0;
      const bool above = at < last;
      const float side = 0.25f;
      entries.emplace_back(node, node, 1.0f - side * static_cast<float>(int(below) + int(above)));
      if (below) entries.emplace_back(node, node - apart, side);
      if (above) entries.emplace_back(node, node + apart, side);
    }
  }
  Weights matrix(nx * ny, nx * ny);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

SheetMotion::SheetMotion(const fem::Compliance& gel, double finest_edge_mm) {
  Eigen::Vector2d low = gel.vertices.front().head<2>();
  Eigen::Vector2d high = low;
  for (const Eigen::Vector3d& vertex : gel.vertices) {
    low = low.cwiseMin(vertex.head<2>());
    high = high.cwiseMax(vertex.head<2>());
  }
  const Eigen::Vector2d size = high - low;
  lattice_.pitch = std::max(finest_edge_mm / kNodesAnEdge, size.maxCoeff() / (kMostNodes - 4));
  lattice_.nx = static_cast<int>(std::ceil(size.x() / lattice_.pitch)) + 3;
  lattice_.ny = static_cast<int>(std::ceil(size.y() / lattice_.pitch)) + 3;
  lattice_.first = low - Eigen::Vector2d::Constant(lattice_.pitch);
  const auto vertices = static_cast<Eigen::Index>(gel.vertices.size());
  const Eigen::Index nodes = Eigen::Index{lattice_.nx} * lattice_.ny;

  std::vector<Eigen::Triplet<float>> entries;
  std::vector<char> taken(static_cast<std::size_t>(nodes), 0);
  for (const auto& t : gel.triangles) {
    std::array<Eigen::Vector2d, 3> corner;
    for (int k = 0; k < 3; ++k) corner[k] = (gel.vertices[t[k]].head<2>() - lattice_.first) / lattice_.pitch;
    for_places_in(corner, lattice_.nx, lattice_.ny, [&](int i, int j, double b, double c) {
      const int node = j * lattice_.nx + i;
      if (taken[node] != 0) return;
      taken[node] = 1;
      entries.emplace_back(node, t[0], static_cast<float>(1.0 - b - c));
      entries.emplace_back(node, t[1], static_cast<float>(b));
      entries.emplace_back(node, t[2], static_cast<float>(c));
    });
  }
  for (int node = 0; node < static_cast<int>(nodes); ++node) {  // beside the surface: as the nearest vertex
    if (taken[node] != 0) continue;
    const Eigen::Vector2d place =
        lattice_.first + lattice_.pitch * Eigen::Vector2d(node % lattice_.nx, node / lattice_.nx);
    int nearest = 0;
    double least = (gel.vertices[0].head<2>() - place).squaredNorm();
    for (int v = 1; v < static_cast<int>(vertices); ++v) {
      const double distance = (gel.vertices[v].head<2>() - place).squaredNorm();
      if (distance < least) {
        least = distance;
        nearest = v;
      }
    }
    entries.emplace_back(node, nearest, 1.0f);
  }
  weights_.resize(nodes, vertices);
  weights_.setFromTriplets(entries.begin(), entries.end());
  for (int k = 0; k < kSmoothings; ++k) {
    for (const bool along_x : {true, false}) {
      weights_ = Weights(smoothing(lattice_.nx, lattice_.ny, along_x) * weights_);
    }
  }
}

void SheetMotion::between(const fem::PressState& from, const fem::PressState& to, render::SheetMove& move) const {
  TS_ASSERT(from.surface_displacement.rows() == weights_.cols() && to.surface_displacement.rows() == weights_.cols());
  const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> change =
      (to.surface_displacement - from.surface_displacement).cast<float>();
  move.first = lattice_.first;
  move.pitch = lattice_.pitch;
  move.nx = lattice_.nx;
  move.ny = lattice_.ny;
  const auto nodes = static_cast<int>(weights_.rows());
  move.moved.resize(static_cast<std::size_t>(nodes) * 3);
  tbb::parallel_for(0, (nodes + kRowsATask - 1) / kRowsATask, [&](int task) {
    for (int node = task * kRowsATask; node < std::min(nodes, (task + 1) * kRowsATask); ++node) {
      Eigen::RowVector3f sum = Eigen::RowVector3f::Zero();
      for (Weights::InnerIterator it(weights_, node); it; ++it) sum += it.value() * change.row(it.col());
      Eigen::Map<Eigen::RowVector3f>(move.moved.data() + 3 * static_cast<std::size_t>(node)) = sum;
    }
  });
}

}  // namespace touchstone::sim
