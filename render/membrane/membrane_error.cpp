#include "render/membrane/membrane_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "render/membrane/membrane_light.h"
#include "render/paths/trace_twice.h"
#include "render/sampling/sample_sequence.h"

namespace touchstone::render {
namespace {

constexpr double kWet = 1e-3;     // mm: the sheet lies that deep in the membrane, and the body that high at least
constexpr double kPanel = 200.0;  // mm behind the membrane, and 40 times as wide
constexpr double kTallest = 50.0;

void add_quad(TriangleMesh& mesh, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
              const Eigen::Vector3d& d) {
  const int first = static_cast<int>(mesh.vertices.size());
  for (const Eigen::Vector3d& corner : {a, b, c, d}) mesh.vertices.push_back(corner);
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

void add_level(TriangleMesh& mesh, double x0, double x1, double y0, double y1, double z) {
  add_quad(mesh, {x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z});
}

/// A column over each cell that has the body above it, walls only where the next one is higher or none.
TriangleMesh columns(const FaceGrid& grid, const FaceState& state) {
  const double top = std::min(state.height_mm, kTallest);
  const auto height = [&](int column, int row) {
    if (column < 0 || row < 0 || column >= grid.columns || row >= grid.rows) return top;
    const double gap = state.gap_mm.at<float>(row, column);
    return gap < top ? std::max(gap, kWet) : top;
  };
  TriangleMesh mesh;
  for (int row = 0; row < grid.rows; ++row) {
    const double y0 = grid.top_mm + row * grid.spacing_mm;
    const double y1 = y0 + grid.spacing_mm;
    for (int column = 0; column < grid.columns; ++column) {
      const double low = height(column, row);
      if (!(low < top)) continue;
      const double x0 = grid.left_mm + column * grid.spacing_mm;
      const double x1 = x0 + grid.spacing_mm;
      add_level(mesh, x0, x1, y0, y1, low);
      add_level(mesh, x0, x1, y0, y1, top);
      const auto wall = [&](double next, double xa, double ya, double xb, double yb) {
        if (next > low) add_quad(mesh, {xa, ya, low}, {xb, yb, low}, {xb, yb, next}, {xa, ya, next});
      };
      wall(height(column - 1, row), x0, y0, x0, y1);
      wall(height(column + 1, row), x1, y0, x1, y1);
      wall(height(column, row - 1), x0, y0, x1, y0);
      wall(height(column, row + 1), x0, y1, x1, y1);
    }
  }
  return mesh;
}

struct Sum {
  double difference = 0.0;
  int count = 0;
};

}  // namespace

Scene membrane_scene(const MembraneOptics& optics, const FaceGrid& grid, const FaceState& state, double behind) {
  for (const cv::Mat* map : {&state.contact, &state.gap_mm}) {
    const bool may_be_empty = map == &state.gap_mm && map->empty();
    if (!may_be_empty && (map->type() != CV_32FC1 || map->cols != grid.columns || map->rows != grid.rows)) {
      fail("membrane scene: a map of {} x {} cells; the grid has {} x {} (32-bit floats, one channel)", map->cols,
           map->rows, grid.columns, grid.rows);
    }
  }
  Scene scene;
  const auto one = [](double value) { return flat_spectrum(1, value); };
  scene.media = {Medium{}, Medium{optics.plate_index},
                 Medium{optics.index, one(optics.absorption_per_mm), one(optics.scattering_per_mm), optics.anisotropy}};
  scene.faces = {{-optics.thickness_mm - optics.plate_thickness_mm, 0, 1}, {-optics.thickness_mm, 1, 2}, {0.0, 2, 0}};
  scene.environment = one(1.0);
  TriangleMesh wet;
  for (int row = 0; row < grid.rows; ++row) {
    const double y0 = grid.top_mm + row * grid.spacing_mm;
    const auto* contact = state.contact.ptr<float>(row);
    for (int column = 0; column < grid.columns;) {
      int end = column;
      while (end < grid.columns && contact[end] >= 0.5F) ++end;
      if (end > column) {
        add_level(wet, grid.left_mm + column * grid.spacing_mm, grid.left_mm + end * grid.spacing_mm, y0,
                  y0 + grid.spacing_mm, -kWet);
      }
      column = end + 1;
    }
  }
  const Lambertian body{one(state.albedo)};
  if (!wet.triangles.empty()) scene.surfaces.push_back({std::move(wet), body});
  if (!state.gap_mm.empty()) {
    TriangleMesh mesh = columns(grid, state);
    if (!mesh.triangles.empty()) scene.surfaces.push_back({std::move(mesh), body});
  }
  if (behind != 1.0) {
    TriangleMesh panel;
    const double half = 40.0 * kPanel;
    add_level(panel, -half, half, -half, half, kPanel);
    scene.surfaces.push_back({std::move(panel), Emitter{one(behind)}});
  }
  return scene;
}

MembraneError measure_membrane_error(const cv::Mat& picture, const cv::Mat& free, const Scene& scene,
                                     const MembraneOptics& optics, const FaceGrid& grid, const Camera& camera,
                                     const MembraneErrorSettings& settings) {
  const Eigen::Vector2i size = size_of(camera);
  for (const cv::Mat* one : {&picture, &free}) {
    if (one->type() != CV_32FC1 || one->cols != size.x() || one->rows != size.y()) {
      fail("membrane error: a picture of {} x {} pixels; the camera has {} x {} (32-bit floats, one channel)",
           one->cols, one->rows, size.x(), size.y());
    }
  }
  if (settings.fields < 1 || settings.pixels < 2 || settings.samples < 1) {
    fail("membrane error: {} fields of {} pixels of {} samples; at least 1, 2 and 1 are needed", settings.fields,
         settings.pixels, settings.samples);
  }
  // Relative to the free face, so that the picture's edge counts as much as its middle.
  const cv::Mat places = seen_places(optics, camera);
  const int side = std::max(1, (std::max(size.x(), size.y()) + settings.fields - 1) / settings.fields);
  const int across = (size.x() + side - 1) / side;
  const int down = (size.y() + side - 1) / side;
  const auto sees_grid = [&](int column, int row) {
    const auto place = places.at<cv::Vec2f>(row, column);
    return place[0] > grid.left_mm && place[0] < grid.left_mm + grid.columns * grid.spacing_mm &&
           place[1] > grid.top_mm && place[1] < grid.top_mm + grid.rows * grid.spacing_mm;
  };
  MembraneError error;
  cv::Mat mask = cv::Mat::zeros(size.y(), size.x(), CV_8UC1);
  for (int row = 0; row < size.y(); ++row) {
    for (int column = 0; column < size.x(); ++column) {
      if (!sees_grid(column, row)) continue;
      const double change = 1.0 - static_cast<double>(picture.at<float>(row, column)) / free.at<float>(row, column);
      error.contrast = std::max(error.contrast, std::abs(change));
    }
  }
  if (!(error.contrast > 0.0)) fail("membrane error: the state's picture is that of the free face; it has no contrast");
  for (int field = 0; field < across * down; ++field) {
    for (int k = 0; k < settings.pixels; ++k) {
      SampleSequence numbers(settings.seed, static_cast<std::uint64_t>(field), static_cast<std::uint32_t>(k));
      const auto [u, v] = numbers.next_pair();
      const int column = field % across * side + static_cast<int>(u * side);
      const int row = field / across * side + static_cast<int>(v * side);
      if (column < size.x() && row < size.y() && sees_grid(column, row)) mask.at<unsigned char>(row, column) = 255;
    }
  }

  const auto traced = trace_twice(scene, camera, mask, settings.samples, settings.max_depth, settings.seed);
  std::vector<Sum> fields(static_cast<std::size_t>(across) * down);
  double products = 0.0;
  double square_products = 0.0;
  double differences = 0.0;
  double noise = 0.0;
  for (int row = 0; row < size.y(); ++row) {
    for (int column = 0; column < size.x(); ++column) {
      if (mask.at<unsigned char>(row, column) == 0) continue;
      const double unit = error.contrast * free.at<float>(row, column);
      const double a = (picture.at<float>(row, column) - traced[0].at<float>(row, column)) / unit;
      const double b = (picture.at<float>(row, column) - traced[1].at<float>(row, column)) / unit;
      products += a * b;
      square_products += a * b * a * b;
      differences += 0.5 * (a + b);
      noise += 0.25 * (a - b) * (a - b);
      Sum& field = fields[static_cast<std::size_t>(row / side) * across + column / side];
      field.difference += 0.5 * (a + b);
      ++field.count;
      ++error.pixels;
    }
  }
  if (error.pixels < 2) fail("membrane error: the camera doesn't see the grid");
  const double count = error.pixels;
  const double square = products / count;
  const double square_error = std::sqrt(std::max(0.0, square_products / count - square * square) / count);
  error.rms = std::sqrt(std::max(0.0, square));
  error.rms_error = square > square_error ? 0.5 * square_error / error.rms : std::sqrt(square_error);
  error.mean = differences / count;
  error.mean_error = std::sqrt(noise) / count;
  for (const Sum& field : fields) {
    if (2 * field.count < settings.pixels) continue;  // the membrane's edge
    const double mean = field.difference / field.count;
    if (std::abs(mean) > std::abs(error.worst)) {
      error.worst = mean;
      error.worst_error = std::sqrt(noise / count / field.count);
    }
  }
  return error;
}

}  // namespace touchstone::render
