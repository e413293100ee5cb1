#include "sensors/beads/bit_window.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/wide_clones.h"

namespace touchstone::sensors {

namespace {

using Row = std::uint64_t;

std::size_t index(int y) {
  return static_cast<std::size_t>(y);
}

/// Each row, shifted and joined with its neighbours above and below. A border of one row on either side lets all rows
/// be worked on alike, several at a time.
using BorderedRows = std::array<Row, BitWindow::kMaxSide + 2>;

TS_WIDE_CLONES void erode_once(Row* rows, int height, Row first, Row last) {
  BorderedRows across;
  across[0] = across[static_cast<std::size_t>(height) + 1] = ~Row{0};
  Row* middle = across.data() + 1;
  for (int y = 0; y < height; ++y) middle[y] = rows[y] & ((rows[y] << 1) | first) & ((rows[y] >> 1) | last);
  for (int y = 0; y < height; ++y) rows[y] = middle[y - 1] & middle[y] & middle[y + 1];
}

TS_WIDE_CLONES void dilate_once(Row* rows, int height, Row full) {
  BorderedRows across;
  across[0] = across[static_cast<std::size_t>(height) + 1] = 0;
  Row* middle = across.data() + 1;
  for (int y = 0; y < height; ++y) middle[y] = (rows[y] | (rows[y] << 1) | (rows[y] >> 1)) & full;
  for (int y = 0; y < height; ++y) rows[y] = middle[y - 1] | middle[y] | middle[y + 1];
}

/// All bits of `mask` that are joined to bits of `seed` by runs of the mask: run by run, as there are few.
Row fill_runs(Row seed, Row mask) {
  Row filled = 0;
  for (seed &= mask; seed != 0; seed &= ~filled) {
    const Row lowest = seed & (~seed + 1);
    const Row up = (mask ^ (mask + lowest)) & mask;  // the carry clears the run from here on
    const Row gaps_below = ~mask & (lowest - 1);
    const Row down = (lowest - 1) & (gaps_below == 0 ? ~Row{0} : ~Row{0} << (64 - std::countl_zero(gaps_below)));
    filled |= up | down;
  }
  return filled;
}

Row with_neighbours(Row row) {
  return row | (row << 1) | (row >> 1);
}

}  // namespace

void erode(BitWindow& window, int radius) {
  const Row full = window.full_row();
  for (int step = 0; step < radius; ++step) erode_once(window.rows.data(), window.height, Row{1}, full & ~(full >> 1));
}

void dilate(BitWindow& window, int radius) {
  for (int step = 0; step < radius; ++step) dilate_once(window.rows.data(), window.height, window.full_row());
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

  // Sweep down and up until a sweep adds nothing; a convex region needs one of each.
  int low = first;
  int high = first;  // rows low..high hold something
  const auto grow = [&](int y, int from) {
    const Row mask = window.rows[index(y)];
    const Row before = region.rows[index(y)];
    const Row reached = (with_neighbours(region.rows[index(from)]) & mask) | before;
    if (reached == before) return false;
    region.rows[index(y)] = fill_runs(reached, mask);
    return true;
  };
  const auto sweep_down = [&] {
    bool grew = false;
    for (int y = low + 1; y < window.height; ++y) {
      const bool added = grow(y, y - 1);
      grew = grew || added;
      if (y > high && !added) break;
      high = std::max(high, y);
    }
    return grew;
  };
  const auto sweep_up = [&] {
    bool grew = false;
    for (int y = high - 1; y >= 0; --y) {
      const bool added = grow(y, y + 1);
      grew = grew || added;
      if (y < low && !added) break;
      low = std::min(low, y);
    }
    return grew;
  };
  sweep_down();
  while (sweep_up() && sweep_down()) {
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
