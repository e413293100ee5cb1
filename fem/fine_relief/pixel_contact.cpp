#include "fem/fine_relief/pixel_contact.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace touchstone::fem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kLeastNestedPixels = 48;    // a side, for a start from wider pixels
constexpr double kNestedLooseness = 2.0;  // of their tolerance

/// Sums that don't depend on the number of threads: each row by itself, then the rows in order.
struct Sums {
  double a = 0.0;
  double b = 0.0;
  double highest = -kInfinity;
  double lowest = kInfinity;
  std::size_t count = 0;

  void add(const Sums& other) {
    a += other.a;
    b += other.b;
    highest = std::max(highest, other.highest);
    lowest = std::min(lowest, other.lowest);
    count += other.count;
  }
};

class Solver {
 public:
  Solver(const LayerResponse& layer, const PixelContact& contact, const PixelTolerance& tolerance)
      : layer_(layer),
        grid_(layer.grid()),
        gap_(contact.gap),
        share_(contact.share),
        forced_(contact.force.has_value()),
        pressure_sum_(forced_ ? *contact.force / grid_.pixel_area() : 0.0),
        tolerance_(tolerance),
        inverse_(layer.rough_inverse()),
        scratch_(layer.make_scratch()),
        inverse_scratch_(inverse_.make_scratch()),
        rows_(static_cast<std::size_t>(grid_.ny)) {}

  PixelContactAnswer solve(std::span<const double> start) {
    const std::size_t n = grid_.size();
    answer_.pressure.assign(n, 0.0);
    answer_.displacement.assign(n, 0.0);
    direction_.assign(n, 0.0);
    response_.assign(n, 0.0);
    residual_.assign(n, 0.0);
    last_residual_.assign(n, 0.0);
    takes_part_.assign(n, 0);
    if (!start.empty()) answer_.pressure.assign(start.begin(), start.end());
    begin();
    respond();
    for (;;) {
      const std::size_t count = take_gaps();
      answer_.converged = answer_.largest_gap <= tolerance_.gap_mm && answer_.largest_overlap <= tolerance_.gap_mm;
      if (answer_.converged || answer_.iterations >= tolerance_.most_iterations || count == 0) break;
      ++answer_.iterations;
      step();
    }
    finish();
    return std::move(answer_);
  }

 private:
  template <typename Row>
  Sums over_rows(const Row& row) {
    tbb::parallel_for(0, grid_.ny, [&](int j) {
      Sums sums;
      const std::size_t begin = grid_.at(0, j);
      for (std::size_t k = begin; k < begin + grid_.nx; ++k) row(k, sums);
      rows_[static_cast<std::size_t>(j)] = sums;
    });
    Sums total;
    for (const Sums& sums : rows_) total.add(sums);
    return total;
  }

  /// A pressure to begin with: what there is, brought to the force; else uniform where the body is.
  void begin() {
    const Sums found = over_rows([&](std::size_t k, Sums& s) {
      double& p = answer_.pressure[k];
      p = gap_[k] < kInfinity ? std::max(0.0, p) : 0.0;
      s.a += share(k) * p;
      s.b += gap_[k] < kInfinity ? share(k) : 0.0;
      s.lowest = std::min(s.lowest, gap_[k] / share(k));
    });
    lowest_gap_ = found.lowest;
    if (forced_ && pressure_sum_ > 0.0 && !(found.a > 0.0)) {
      const double uniform = pressure_sum_ / found.b;
      over_rows([&](std::size_t k, Sums&) { answer_.pressure[k] = gap_[k] < kInfinity ? uniform : 0.0; });
    } else if (forced_) {
      scale(found.a);
    }
  }

  void scale(double sum) {
    const double factor = sum > 0.0 ? pressure_sum_ / sum : 0.0;
    over_rows([&](std::size_t k, Sums&) { answer_.pressure[k] *= factor; });
  }

  void respond() {
    layer_.apply(answer_.pressure, answer_.displacement, *scratch_);
    ++answer_.applications;
  }

  double raw_gap(std::size_t k) const { return gap_[k] + answer_.displacement[k]; }
  double share(std::size_t k) const { return share_.empty() ? 1.0 : share_[k]; }

  /// Sets the shift, how well the laws of contact are met, and which pixels take part in the next step: those with
  /// pressure, and those that overlap without. Returns how many there are.
  std::size_t take_gaps() {
    answer_.shift = 0.0;
    if (forced_) {
      const Sums mean = over_rows([&](std::size_t k, Sums& s) {
        if (answer_.pressure[k] > 0.0) {
          s.a += share(k) * raw_gap(k);
          s.b += share(k) * share(k);
        }
      });
      if (mean.b > 0.0) answer_.shift = -mean.a / mean.b;
    }
    const double shift = answer_.shift;
    const Sums state = over_rows([&](std::size_t k, Sums& s) {
      residual_[k] = 0.0;
      takes_part_[k] = 0;
      if (!(gap_[k] < kInfinity)) return;
      const double g = raw_gap(k) + share(k) * shift;
      if (answer_.pressure[k] > 0.0) {
        s.highest = std::max(s.highest, std::abs(g));
        ++s.count;
      } else {
        s.lowest = std::min(s.lowest, g);
        if (!(g < 0.0)) return;
        s.a += 1.0;
      }
      takes_part_[k] = 1;
      residual_[k] = g;
    });
    answer_.largest_gap = std::max(0.0, state.highest);
    answer_.largest_overlap = std::max(0.0, -state.lowest);
    answer_.pixels_in_contact = static_cast<int>(state.count);
    return state.count + static_cast<std::size_t>(state.a);
  }

  /// Takes from the pixels that take part what changes the force, if that is given (their mean, where all shares are
  /// one), and makes the others zero.
  void project(std::vector<double>& values) {
    double mean = 0.0;
    if (forced_) {
      const Sums sum = over_rows([&](std::size_t k, Sums& s) {
        if (takes_part_[k]) {
          s.a += share(k) * values[k];
          s.b += share(k) * share(k);
        }
      });
      mean = sum.b > 0.0 ? sum.a / sum.b : 0.0;
    }
    over_rows([&](std::size_t k, Sums&) { values[k] = takes_part_[k] ? values[k] - share(k) * mean : 0.0; });
  }

  /// One step along the conjugate direction (Polak and Ribiere's [Polak1969], which begins anew by itself where the set
  /// changed).
  void step() {
    auto& p = answer_.pressure;
    inverse_.apply(residual_, response_, *inverse_scratch_);
    project(response_);
    const Sums products = over_rows([&](std::size_t k, Sums& s) {
      s.a += response_[k] * residual_[k];
      s.b += response_[k] * last_residual_[k];
    });
    const double conjugate = last_square_ > 0.0 ? std::max(0.0, (products.a - products.b) / last_square_) : 0.0;
    last_square_ = products.a;
    over_rows([&](std::size_t k, Sums&) {
      direction_[k] = takes_part_[k] ? response_[k] + conjugate * direction_[k] : 0.0;
      last_residual_[k] = residual_[k];
    });
    project(direction_);
    layer_.apply(direction_, response_, *scratch_);
    ++answer_.applications;
    const Sums along = over_rows([&](std::size_t k, Sums& s) {
      s.a += residual_[k] * direction_[k];
      s.b += response_[k] * direction_[k];
    });
    const double length = along.b > 0.0 ? along.a / along.b : 0.0;

    const Sums after = over_rows([&](std::size_t k, Sums& s) {
      if (takes_part_[k]) {
        const double next = p[k] - length * direction_[k];
        s.count += next < 0.0;
        p[k] = std::max(0.0, next);
      }
      s.a += share(k) * p[k];
    });
    if (forced_ && !(after.a > 0.0)) {
      last_square_ = 0.0;
      begin();
      respond();
      return;
    }
    const double factor = forced_ ? pressure_sum_ / after.a : 1.0;
    if (after.count > 0) {
      if (forced_) over_rows([&](std::size_t k, Sums&) { p[k] *= factor; });
      respond();
    } else {
      over_rows([&](std::size_t k, Sums&) {
        answer_.displacement[k] = factor * (answer_.displacement[k] - length * response_[k]);
        p[k] *= factor;
      });
    }
  }

  void finish() {
    const Sums sum = over_rows([&](std::size_t k, Sums& s) { s.a += share(k) * answer_.pressure[k]; });
    answer_.force = sum.a * grid_.pixel_area();
    if (!forced_) return;
    answer_.force_residual = std::abs(answer_.force - pressure_sum_ * grid_.pixel_area());
    if (answer_.pixels_in_contact == 0) {
      answer_.shift = lowest_gap_ < kInfinity ? std::max(0.0, -lowest_gap_) : 0.0;
      answer_.largest_overlap = 0.0;
      answer_.converged = true;
    }
  }

  const LayerResponse& layer_;
  const PixelGrid grid_;
  std::span<const double> gap_, share_;
  bool forced_;
  double pressure_sum_;  // over the pixels, MPa
  PixelTolerance tolerance_;
  const LayerResponse& inverse_;
  std::unique_ptr<LayerResponse::Scratch> scratch_, inverse_scratch_;
  std::vector<Sums> rows_;
  std::vector<double> direction_, response_, residual_, last_residual_;
  std::vector<char> takes_part_;
  double lowest_gap_ = kInfinity;
  double last_square_ = 0.0;
  PixelContactAnswer answer_;
};

}  // namespace

namespace {

/// Four pixels in one: the mean of the values below infinity.
std::vector<double> halved(const PixelGrid& fine, const PixelGrid& coarse, std::span<const double> gap) {
  std::vector<double> result(coarse.size(), kInfinity);
  for (int j = 0; j < coarse.ny; ++j) {
    for (int i = 0; i < coarse.nx; ++i) {
      double sum = 0.0;
      int count = 0;
      for (int b = 2 * j; b < std::min(2 * j + 2, fine.ny); ++b) {
        for (int a = 2 * i; a < std::min(2 * i + 2, fine.nx); ++a) {
          if (!(gap[fine.at(a, b)] < kInfinity)) continue;
          sum += gap[fine.at(a, b)];
          ++count;
        }
      }
      if (count > 0) result[coarse.at(i, j)] = sum / count;
    }
  }
  return result;
}

/// Bilinear between the coarse pixels' centres.
std::vector<double> doubled(const PixelGrid& coarse, const PixelGrid& fine, const std::vector<double>& pressure) {
  std::vector<double> result(fine.size());
  tbb::parallel_for(0, fine.ny, [&](int j) {
    const int near_j = j / 2;
    const int far_j = std::clamp(near_j + (j % 2 == 0 ? -1 : 1), 0, coarse.ny - 1);
    for (int i = 0; i < fine.nx; ++i) {
      const int near_i = i / 2;
      const int far_i = std::clamp(near_i + (i % 2 == 0 ? -1 : 1), 0, coarse.nx - 1);
      result[fine.at(i, j)] = 0.5625 * pressure[coarse.at(near_i, near_j)] +
                              0.1875 * pressure[coarse.at(far_i, near_j)] +
                              0.1875 * pressure[coarse.at(near_i, far_j)] + 0.0625 * pressure[coarse.at(far_i, far_j)];
    }
  });
  return result;
}

/// A pressure to begin with, from wider pixels; empty where they would be too few or too wide.
std::vector<double> nested_start(const LayerResponse& layer, const PixelContact& contact,
                                 const PixelTolerance& tolerance) {
  const PixelGrid& fine = layer.grid();
  if (layer.edges() != GridEdges::free || 2.0 * fine.pitch > kWidestPixel * layer.thickness() ||
      std::min(fine.nx, fine.ny) < kLeastNestedPixels) {
    return {};
  }
  const LayerResponse& wide = layer.on_wider_pixels();
  const PixelGrid& coarse = wide.grid();
  const std::vector<double> gap = halved(fine, coarse, contact.gap);
  const std::vector<double> share = contact.share.empty() ? std::vector<double>() : halved(fine, coarse, contact.share);
  PixelTolerance loose = tolerance;
  loose.gap_mm *= kNestedLooseness;
  return doubled(coarse, fine, solve_pixel_contact(wide, {gap, contact.force, share}, loose).pressure);
}

}  // namespace

PixelContactAnswer solve_pixel_contact(const LayerResponse& layer, const PixelContact& contact,
                                       const PixelTolerance& tolerance, std::span<const double> start) {
  const std::size_t n = layer.grid().size();
  TS_ASSERT(contact.gap.size() == n && (start.empty() || start.size() == n));
  TS_ASSERT(contact.share.empty() || contact.share.size() == n);
  bool body = false;
  for (std::size_t k = 0; k < n; ++k) {
    if (std::isnan(contact.gap[k]) || contact.gap[k] == -kInfinity) {
      fail("the gap at pixel {} is {}; it must be a number or infinity", k, contact.gap[k]);
    }
    body = body || contact.gap[k] < kInfinity;
    if (!contact.share.empty() && !(contact.share[k] > 0.0 && contact.share[k] < kInfinity)) {
      fail("the share at pixel {} is {}; it must be above 0 and finite", k, contact.share[k]);
    }
    if (!start.empty() && !std::isfinite(start[k])) fail("the pressure to begin with at pixel {} is {}", k, start[k]);
  }
  if (contact.force) {
    if (!std::isfinite(*contact.force) || *contact.force < 0.0) {
      fail("a force of {} N is wanted on the relief; it must be finite and at least 0", *contact.force);
    }
    if (*contact.force > 0.0 && !body) fail("a force of {} N is wanted where no body is over the grid", *contact.force);
  }
  if (!start.empty()) return Solver(layer, contact, tolerance).solve(start);
  return Solver(layer, contact, tolerance).solve(nested_start(layer, contact, tolerance));
}

}  // namespace touchstone::fem
