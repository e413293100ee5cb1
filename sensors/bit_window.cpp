#include "sensors/bit_window.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace touchstone::sensors {

namespace {

using Row = std::uint64_t;

std::size_t index(int y) {
  return static_cast<std::size_t>(y);
}

/// Combines each row with the `radius` rows above and below it.
template <typename Combine>
void combine_rows(BitWindow& window, int radius, Combine combine) {
  for (int step = 0; step < radius; ++step) {
    Row above = window.rows[0];
    for (int y = 0; y < window.height; ++y) {
      const Row here = window.rows[index(y)];
      const Row below = y + 1 < window.height ? window.rows[index(y + 1)] : here;
      window.rows[index(y)] = combine(here, combine(above, below));
      above = here;
    }
  }
}

/// All bits of `mask` that are joined to bits of `seed` by runs of the mask (Kogge-Stone fill, both ways).
Row fill_runs(Row seed, Row mask) {
  Row left = seed & mask;
  Row right = left;
  Row left_mask = mask;
  Row right_mask = mask;
  for (int shift = 1; shift < 64; shift *= 2) {
    left |= left_mask & (left << shift);
    left_mask &= left_mask << shift;
    right |= right_mask & (right >> shift);
    right_mask &= right_mask >> shift;
  }
  return left | right;
}

Row with_neighbours(Row row) {
  return row | (row << 1) | (row >> 1);
}

}  // namespace

void erode(BitWindow& window, int radius) {
  const Row full = window.full_row();
  const Row first = Row{1};
  const Row last = full & ~(full >> 1);
  for (int y = 0; y < window.height; ++y) {
    Row& row = window.rows[index(y)];
    for (int step = 0; step < radius; ++step) row &= ((row << 1) | first) & ((row >> 1) | last);
  }
  combine_rows(window, radius, [](Row a, Row b) { return a & b; });
}

void dilate(BitWindow& window, int radius) {
  const Row full = window.full_row();
  for (int y = 0; y < window.height; ++y) {
    Row& row = window.rows[index(y)];
    for (int step = 0; step < radius; ++step) row = with_neighbours(row) & full;
  }
  combine_rows(window, radius, [](Row a, Row b) { return a | b; });
}

void open_regions(BitWindow& window, int radius) {
  erode(window, radius);
  dilate(window, radius);
}

void close_regions(BitWindow& window, int radius) {
  dilate(window, radius);
  erode(window, radius);
}

bool take_region(BitWindow& window, BitWindow& region) {
  int first = 0;
  while (first < window.height && window.rows[index(first)] == 0) ++first;
  if (first == window.height) return false;

  region.width = window.width;
  region.height = window.height;
  std::fill_n(region.rows.begin(), window.height, Row{0});
  const Row seed = window.rows[index(first)];
  region.rows[index(first)] = fill_runs(seed & (~seed + 1), seed);

  // Sweep down and up until nothing is added; a convex region needs one sweep of each.
  int low = first;
  int high = first;  // rows low..high hold something
  for (bool grew = true; grew;) {
    grew = false;
    const auto grow = [&](int y, int from) {
      const Row mask = window.rows[index(y)];
      const Row before = region.rows[index(y)];
      const Row reached = (with_neighbours(region.rows[index(from)]) & mask) | before;
      if (reached == before) return false;
      region.rows[index(y)] = fill_runs(reached, mask);
      grew = true;
      return true;
    };
    for (int y = low + 1; y < window.height; ++y) {
      const bool added = grow(y, y - 1);
      if (y > high && !added) break;
      high = std::max(high, y);
    }
    for (int y = high - 1; y >= 0; --y) {
      const bool added = grow(y, y + 1);
      if (y < low && !added) break;
      low = std::min(low, y);
    }
  }
  for (int y = low; y <= high; ++y) window.rows[index(y)] &= ~region.rows[index(y)];
  return true;
}

RegionMoments moments_of(const BitWindow& region) {
  std::int64_t n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
  for (std::int64_t y = 0; y < region.height; ++y) {
    Row bits = region.rows[static_cast<std::size_t>(y)];
    std::int64_t count = 0, row_x = 0, row_xx = 0;
    while (bits != 0) {  // run by run: sums of integers over a run are closed forms
      const std::int64_t begin = std::countr_zero(bits);
      const std::int64_t length = std::countr_one(bits >> begin);
      const std::int64_t end = begin + length;
      count += length;
      row_x += (begin + end - 1) * length / 2;
      row_xx += ((end - 1) * end * (2 * end - 1) - (begin - 1) * begin * (2 * begin - 1)) / 6;
      bits = end >= 64 ? 0 : bits & (~Row{0} << end);
    }
    n += count;
    sx += row_x;
    sxx += row_xx;
    sy += count * y;
    sxy += row_x * y;
    syy += count * y * y;
  }
  RegionMoments moments;
  moments.area = static_cast<int>(n);
  const double count = static_cast<double>(n);
  const double mean_x = static_cast<double>(sx) / count;
  const double mean_y = static_cast<double>(sy) / count;
  moments.centroid = {mean_x + 0.5, mean_y + 0.5};
  constexpr double kPixel = 1.0 / 12.0;  // second moment of a unit square
  const double xx = static_cast<double>(sxx) / count - mean_x * mean_x + kPixel;
  const double yy = static_cast<double>(syy) / count - mean_y * mean_y + kPixel;
  const double xy = static_cast<double>(sxy) / count - mean_x * mean_y;
  const double mean = 0.5 * (xx + yy);
  const double half_difference = std::hypot(0.5 * (xx - yy), xy);
  moments.elongation = (mean + half_difference) / std::max(mean - half_difference, 0.5 * kPixel);
  return moments;
}

}  // namespace touchstone::sensors
