#include "fem/fine_relief/layer_response.h"

#include <fftw3.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <new>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/locked_work.h"
#include "fem/fine_relief/layer_kernel.h"

namespace touchstone::fem {
namespace {

constexpr int kColumnsAtOnce = 8;

/// FFTW's planner isn't safe for threads; its transforms are.
std::mutex& planner() {
  static std::mutex mutex;
  return mutex;
}

/// The least number not under `least` whose prime factors FFTW is quick with.
int quick_length(int least) {
  for (int n = least;; ++n) {
    int rest = n;
    for (const int prime : {2, 3, 5, 7}) {
      while (rest % prime == 0) rest /= prime;
    }
    if (rest == 1) return n;
  }
}

/// Potential of a uniform rectangle with one corner at the origin: its mixed second derivative is 1/r.
double corner(double x, double y) {
  return x * std::asinh(y / std::abs(x)) + y * std::asinh(x / std::abs(y));
}

}  // namespace

std::vector<double> PixelGrid::columns_x() const {
  std::vector<double> x;
  for (int i = 0; i < nx; ++i) x.push_back(centre(i, 0).x());
  return x;
}

std::vector<double> PixelGrid::rows_y() const {
  std::vector<double> y;
  for (int j = 0; j < ny; ++j) y.push_back(centre(0, j).y());
  return y;
}

void check(const PixelGrid& grid) {
  if (grid.nx < 1 || grid.ny < 1 || grid.nx > kMostPixelsASide || grid.ny > kMostPixelsASide) {
    fail("a grid of {} x {} pixels is wanted; a side may have 1 to {}", grid.nx, grid.ny, kMostPixelsASide);
  }
  if (!(grid.pitch > 0.0) || !std::isfinite(grid.pitch)) {
    fail("the pixel pitch is {} mm; it must be above 0 and finite", grid.pitch);
  }
  if (!grid.first.allFinite()) fail("the pixel grid stands at ({}, {}) mm", grid.first.x(), grid.first.y());
}

/// Two-dimensional transform of real rows, in place: each row of `width` numbers is stored with space for its
/// width/2 + 1 waves. One-dimensional plans by ourselves, so that rows that hold no pressure are left out and the rest
/// can be shared among threads without changing a bit of the answer.
struct LayerResponse::Transform {
  int width, height;   // of the padded grid
  int rows;            // that carry pressure, and whose displacement is wanted
  std::size_t stride;  // complex numbers from row to row
  fftw_plan row_forward, row_back, columns_forward, columns_back;

  Transform(int width_of, int height_of, int rows_of) : width(width_of), height(height_of), rows(rows_of) {
    const std::size_t waves = width / 2 + 1;
    stride = (waves + kColumnsAtOnce - 1) / kColumnsAtOnce * kColumnsAtOnce;
    if (stride % 64 == 0) stride += kColumnsAtOnce;  // columns would fall on each other in the processor's cache
    const std::unique_ptr<Scratch> scratch(new Scratch(doubles()));
    double* const real = scratch->data_;
    auto* const complex = reinterpret_cast<fftw_complex*>(real);
    const int step = static_cast<int>(stride);
    const std::lock_guard lock(planner());
    row_forward = fftw_plan_dft_r2c_1d(width, real, complex, FFTW_ESTIMATE);
    row_back = fftw_plan_dft_c2r_1d(width, complex, real, FFTW_ESTIMATE);
    columns_forward = fftw_plan_many_dft(1, &height, kColumnsAtOnce, complex, nullptr, step, 1, complex, nullptr, step,
                                         1, FFTW_FORWARD, FFTW_ESTIMATE);
    columns_back = fftw_plan_many_dft(1, &height, kColumnsAtOnce, complex, nullptr, step, 1, complex, nullptr, step, 1,
                                      FFTW_BACKWARD, FFTW_ESTIMATE);
    TS_ASSERT(row_forward && row_back && columns_forward && columns_back);
  }
  ~Transform() {
    const std::lock_guard lock(planner());
    for (fftw_plan plan : {row_forward, row_back, columns_forward, columns_back}) fftw_destroy_plan(plan);
  }
  Transform(const Transform&) = delete;
  Transform& operator=(const Transform&) = delete;

  std::size_t doubles() const { return 2 * stride * static_cast<std::size_t>(height); }
  double* row(double* data, int j) const { return data + 2 * stride * static_cast<std::size_t>(j); }

  template <typename Action>
  void for_rows(int count, const Action& action) const {
    tbb::parallel_for(0, count, action);
  }
  /// Calls action(first column) for each block of columns.
  template <typename Action>
  void for_columns(const Action& action) const {
    const int blocks = (width / 2 + kColumnsAtOnce) / kColumnsAtOnce;
    tbb::parallel_for(0, blocks, [&](int block) { action(block * kColumnsAtOnce); });
  }
};

LayerResponse::Scratch::Scratch(std::size_t doubles) : data_(fftw_alloc_real(doubles)) {
  if (data_ == nullptr) throw std::bad_alloc();
  std::fill(data_, data_ + doubles, 0.0);
}

LayerResponse::Scratch::~Scratch() {
  fftw_free(data_);
}

LayerResponse::LayerResponse(const ElasticMaterial& material, double thickness, const PixelGrid& grid, GridEdges edges,
                             double opposite)
    : grid_(grid), edges_(edges), material_(material), thickness_(thickness), opposite_(opposite) {
  if (!(opposite >= 0.0) || !std::isfinite(opposite)) {
    fail("what presses on the layer gives way by {} per MPa; it must be at least 0 and finite", opposite);
  }
  fem::check(material);
  fem::check(grid);
  if (!(thickness > 0.0) || !std::isfinite(thickness)) {
    fail("the layer's thickness is {} mm; it must be above 0 and finite", thickness);
  }
  if (edges == GridEdges::periodic) {
    transform_ = std::make_unique<Transform>(grid.nx, grid.ny, grid.ny);
    fill_periodic();
    return;
  }
  if (grid.pitch > kWidestPixel * thickness) {
    fail("pixels of {} mm are too wide for a layer of {} mm; they may have a quarter of it", grid.pitch, thickness);
  }
  transform_ = std::make_unique<Transform>(quick_length(2 * grid.nx - 1), quick_length(2 * grid.ny - 1), grid.ny);
  fill_free();
}

LayerResponse::LayerResponse(const LayerResponse& of, Inverse)
    : grid_(of.grid_), edges_(of.edges_), material_(of.material_), thickness_(of.thickness_), opposite_(of.opposite_) {
  const bool free = edges_ == GridEdges::free;
  transform_ = std::make_unique<Transform>(free ? quick_length(grid_.nx) : grid_.nx,
                                           free ? quick_length(grid_.ny) : grid_.ny, grid_.ny);
  fill_periodic();
  const Transform& t = *transform_;
  const double pixels = static_cast<double>(t.width) * t.height;
  for (int j = 0; j < t.height; ++j) {
    for (int i = 0; i <= t.width / 2; ++i) {
      double& symbol = symbol_[t.stride * static_cast<std::size_t>(j) + i];
      symbol = 1.0 / (pixels * pixels * symbol);
    }
  }
  // The mean is what a nearly incompressible layer answers with next to nothing; it's treated as the longest wave.
  if (t.width > 1) {
    symbol_[0] = symbol_[1];
  } else if (t.height > 1) {
    symbol_[0] = symbol_[t.stride];
  }
}

LayerResponse::~LayerResponse() = default;

const LayerResponse& LayerResponse::rough_inverse() const {
  work_once(inverse_made_, [&] { inverse_.reset(new LayerResponse(*this, Inverse{})); });
  return *inverse_;
}

const LayerResponse& LayerResponse::on_wider_pixels() const {
  TS_ASSERT(edges_ == GridEdges::free);
  work_once(wider_made_, [&] {
    const PixelGrid wider{(grid_.nx + 1) / 2, (grid_.ny + 1) / 2, 2.0 * grid_.pitch,
                          grid_.first + Eigen::Vector2d::Constant(0.5 * grid_.pitch)};
    wider_ = std::make_unique<const LayerResponse>(material_, thickness_, wider, GridEdges::free, opposite_);
  });
  return *wider_;
}

void LayerResponse::fill_periodic() {
  const Transform& t = *transform_;
  symbol_ = std::make_unique<double[]>(t.stride * static_cast<std::size_t>(t.height));
  const double pixels = static_cast<double>(t.width) * t.height;
  tbb::parallel_for(0, t.height, [&](int j) {
    const double ky = 2.0 * std::numbers::pi / (t.height * grid_.pitch) * std::min(j, t.height - j);
    for (int i = 0; i <= t.width / 2; ++i) {
      const double kx = 2.0 * std::numbers::pi / (t.width * grid_.pitch) * i;
      const double k = std::hypot(kx, ky);
      const double half_space = k > 0.0 ? 2.0 * opposite_ / k : 0.0;
      symbol_[t.stride * static_cast<std::size_t>(j) + i] =
          (layer_compliance(material_, thickness_, k) + half_space) / pixels;
    }
  });
}

void LayerResponse::fill_free() {
  const Transform& t = *transform_;
  const int nx = grid_.nx;
  const int ny = grid_.ny;
  const double pitch = grid_.pitch;
  const LayerCorrection correction(material_.poisson_ratio, std::hypot(nx, ny) * pitch / thickness_);
  const double nu = std::min(material_.poisson_ratio, kLargestPoissonRatio);
  const double half_space = (1.0 - nu * nu) / (std::numbers::pi * material_.youngs_modulus);
  const double area = grid_.pixel_area();

  std::vector<double> corners(static_cast<std::size_t>(nx + 1) * (ny + 1));
  tbb::parallel_for(0, ny + 1, [&](int j) {
    for (int i = 0; i <= nx; ++i) {
      corners[static_cast<std::size_t>(j) * (nx + 1) + i] = corner((i - 0.5) * pitch, (j - 0.5) * pitch);
    }
  });
  Scratch scratch(t.doubles());
  tbb::parallel_for(0, ny, [&](int j) {
    for (int i = 0; i < nx; ++i) {
      const double r = std::hypot(i, j) * pitch;
      const double rho = r / thickness_;
      const auto at = [&](int di, int dj) { return corners[static_cast<std::size_t>(j + dj) * (nx + 1) + i + di]; };
      double influence = 0.0;
      if (rho <= LayerCorrection::kReach) {
        const double mean_of_correction =
            correction.value(rho) + area / (24.0 * thickness_ * thickness_) * correction.laplacian(rho);
        influence = half_space * (at(1, 1) - at(0, 1) - at(1, 0) + at(0, 0) + area / thickness_ * mean_of_correction);
      }
      if (opposite_ > 0.0) influence += opposite_ / std::numbers::pi * (at(1, 1) - at(0, 1) - at(1, 0) + at(0, 0));
      for (const int y : {j, (t.height - j) % t.height}) {
        for (const int x : {i, (t.width - i) % t.width}) t.row(scratch.data_, y)[x] = influence;
      }
    }
  });
  t.for_rows(t.height, [&](int j) {
    double* const row = t.row(scratch.data_, j);
    fftw_execute_dft_r2c(t.row_forward, row, reinterpret_cast<fftw_complex*>(row));
  });
  symbol_ = std::make_unique<double[]>(t.stride * static_cast<std::size_t>(t.height));
  const double pixels = static_cast<double>(t.width) * t.height;
  t.for_columns([&](int first) {
    auto* const column = reinterpret_cast<fftw_complex*>(scratch.data_) + first;
    fftw_execute_dft(t.columns_forward, column, column);
    for (int j = 0; j < t.height; ++j) {
      for (int c = 0; c < kColumnsAtOnce; ++c) {
        const std::size_t place = t.stride * static_cast<std::size_t>(j);
        symbol_[place + first + c] = column[place + c][0] / pixels;  // even, so real
      }
    }
  });
}

std::unique_ptr<LayerResponse::Scratch> LayerResponse::make_scratch() const {
  return std::unique_ptr<Scratch>(new Scratch(transform_->doubles()));
}

void LayerResponse::apply(std::span<const double> pressure, std::span<double> displacement, Scratch& scratch) const {
  TS_ASSERT(pressure.size() == grid_.size() && displacement.size() == grid_.size());
  const Transform& t = *transform_;
  double* const data = scratch.data_;
  t.for_rows(t.rows, [&](int j) {
    double* const row = t.row(data, j);
    std::copy_n(pressure.data() + grid_.at(0, j), grid_.nx, row);
    std::fill(row + grid_.nx, row + 2 * t.stride, 0.0);
    fftw_execute_dft_r2c(t.row_forward, row, reinterpret_cast<fftw_complex*>(row));
  });
  t.for_columns([&](int first) {
    auto* const column = reinterpret_cast<fftw_complex*>(data) + first;
    for (int j = t.rows; j < t.height; ++j) {
      std::fill_n(reinterpret_cast<double*>(column + t.stride * static_cast<std::size_t>(j)), 2 * kColumnsAtOnce, 0.0);
    }
    fftw_execute_dft(t.columns_forward, column, column);
    const double* const symbol = symbol_.get() + first;
    for (int j = 0; j < t.height; ++j) {
      const std::size_t place = t.stride * static_cast<std::size_t>(j);
      for (int c = 0; c < kColumnsAtOnce; ++c) {
        column[place + c][0] *= symbol[place + c];
        column[place + c][1] *= symbol[place + c];
      }
    }
    fftw_execute_dft(t.columns_back, column, column);
  });
  t.for_rows(t.rows, [&](int j) {
    double* const row = t.row(data, j);
    fftw_execute_dft_c2r(t.row_back, reinterpret_cast<fftw_complex*>(row), row);
    std::copy_n(row, grid_.nx, displacement.data() + grid_.at(0, j));
  });
}

}  // namespace touchstone::fem
