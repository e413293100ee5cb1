#include "sensors/colour/colour_lattice.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/image/frame_light.h"

namespace touchstone::sensors {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kWhiteShare = 0.9;  ///< of the picture's pixels, that are no brighter than its white
constexpr double kLeastSaturation = 0.4;
constexpr double kLeastBrightness = 0.1;  ///< of white: the hue of what is darker is noise
constexpr int kLeastArea_px = 6;
constexpr double kAreaRatio =
    2.0;  ///< regions of the grid differ in area by a smaller factor, up or down, from the usual
constexpr double kNodeReach = 0.3;  ///< a node is within so many spacings of where its neighbours put it
constexpr double kLineShare = 0.3;  ///< a column counts if so much of it is seen
constexpr std::size_t kMostRegions = 4096;

struct Region {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double area_px = 0.0;
  Eigen::Vector2i node = Eigen::Vector2i::Zero();
  bool placed = false;
};

/// The level below which kWhiteShare of a channel's pixels are.
Eigen::Vector3d white_of(const cv::Mat& image) {
  std::array<std::array<int, 256>, 3> counts{};
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(y);
    for (int x = 0; x < image.cols; ++x) {
      for (std::size_t c = 0; c < 3; ++c) ++counts[c][row[3 * static_cast<std::size_t>(x) + c]];
    }
  }
  Eigen::Vector3d white;
  for (std::size_t c = 0; c < 3; ++c) {
    const double enough = kWhiteShare * static_cast<double>(image.total());
    double sum = 0.0;
    int level = 0;
    while (level < 255 && sum + counts[c][static_cast<std::size_t>(level)] < enough) {
      sum += counts[c][static_cast<std::size_t>(level++)];
    }
    white[static_cast<Eigen::Index>(c)] = level;
  }
  return white;
}

void refuse_light(const cv::Mat& image) {
  double sum = 0.0;
  for (int y = 0; y < image.rows; ++y) {
    const auto* row = image.ptr<cv::Vec3b>(y);
    for (int x = 0; x < image.cols; ++x) sum += std::max({row[x][0], row[x][1], row[x][2]});
  }
  const FrameLight light = light_of_mean(sum / (255.0 * static_cast<double>(image.total())));
  if (light != FrameLight::kNormal) fail("coloured markers: the picture at rest is {}", name_of(light));
}

std::vector<Region> coloured_regions(const cv::Mat& image) {
  const Eigen::Vector3d white = white_of(image);
  if (white.minCoeff() < 1.0) fail("coloured markers: the picture at rest is dark");
  cv::Mat mask(image.size(), CV_8U);
  for (int y = 0; y < image.rows; ++y) {
    const auto* in = image.ptr<cv::Vec3b>(y);
    std::uint8_t* out = mask.ptr<std::uint8_t>(y);
    for (int x = 0; x < image.cols; ++x) {
      const Eigen::Vector3d part(in[x][0] / white[0], in[x][1] / white[1], in[x][2] / white[2]);
      const double highest = part.maxCoeff();
      out[x] = highest > kLeastBrightness && highest - part.minCoeff() > kLeastSaturation * highest;
    }
  }
  cv::Mat labels, stats, centroids;
  const int count = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 4, CV_32S);
  std::vector<Region> regions;
  for (int i = 1; i < count && regions.size() < kMostRegions; ++i) {
    const int area = stats.at<int>(i, cv::CC_STAT_AREA);
    if (area < kLeastArea_px) continue;
    regions.push_back(
        {{centroids.at<double>(i, 0) + 0.5, centroids.at<double>(i, 1) + 0.5}, static_cast<double>(area)});
  }
  if (regions.empty()) fail("coloured markers: no coloured region is in the picture; is it grey?");
  return regions;
}

/// Keeps those whose area is like that of the most others.
void keep_usual_size(std::vector<Region>& regions) {
  const auto alike = [](double a, double b) { return a < kAreaRatio * b && b < kAreaRatio * a; };
  double usual = 0.0;
  std::ptrdiff_t most = 0;
  for (const Region& one : regions) {
    const auto votes = std::count_if(regions.begin(), regions.end(),
                                     [&](const Region& other) { return alike(one.area_px, other.area_px); });
    if (votes > most) {
      most = votes;
      usual = one.area_px;
    }
  }
  std::erase_if(regions, [&](const Region& one) { return !alike(one.area_px, usual); });
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double usual_spacing(const std::vector<Region>& regions) {
  std::vector<double> nearest;
  for (const Region& one : regions) {
    double least = 1e300;
    for (const Region& other : regions) {
      if (&other != &one) least = std::min(least, (other.place - one.place).norm());
    }
    nearest.push_back(least);
  }
  return median(nearest);
}

/// The angle of the grid's lines against x, from -45 to 45 degrees.
double grid_angle(const std::vector<Region>& regions, double spacing) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Region& one : regions) {
    for (const Region& other : regions) {
      const Eigen::Vector2d between = other.place - one.place;
      if (std::abs(between.norm() - spacing) > 0.2 * spacing) continue;
      const double turned = 4.0 * std::atan2(between.y(), between.x());
      sum += Eigen::Vector2d(std::cos(turned), std::sin(turned));
    }
  }
  return 0.25 * std::atan2(sum.y(), sum.x());
}

/// The affine map from nodes to places, as columns: place = map * (column, row, 1).
Eigen::Matrix<double, 2, 3> fit_nodes(const std::vector<Region>& regions) {
  const auto placed = std::count_if(regions.begin(), regions.end(), [](const Region& one) { return one.placed; });
  Eigen::MatrixX3d nodes(placed, 3);
  Eigen::MatrixX2d places(placed, 2);
  Eigen::Index row = 0;
  for (const Region& one : regions) {
    if (!one.placed) continue;
    nodes.row(row) << one.node.x(), one.node.y(), 1.0;
    places.row(row++) = one.place.transpose();
  }
  return nodes.colPivHouseholderQr().solve(places).transpose();
}

/// Gives nodes to regions: from the middle one outwards, each from its neighbour's place.
void number_nodes(std::vector<Region>& regions, double spacing) {
  const double angle = grid_angle(regions, spacing);
  const Eigen::Vector2d along(spacing * std::cos(angle), spacing * std::sin(angle));
  const Eigen::Vector2d across(-along.y(), along.x());
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Region& one : regions) middle += one.place / static_cast<double>(regions.size());
  const auto first = std::min_element(regions.begin(), regions.end(), [&](const Region& a, const Region& b) {
    return (a.place - middle).squaredNorm() < (b.place - middle).squaredNorm();
  });
  first->placed = true;
  std::vector<std::size_t> open{static_cast<std::size_t>(first - regions.begin())};
  const auto grow = [&] {
    while (!open.empty()) {
      const Region from = regions[open.back()];
      open.pop_back();
      for (std::size_t i = 0; i < regions.size(); ++i) {
        if (regions[i].placed) continue;
        for (const Eigen::Vector2i& step :
             {Eigen::Vector2i(1, 0), Eigen::Vector2i(-1, 0), Eigen::Vector2i(0, 1), Eigen::Vector2i(0, -1)}) {
          const Eigen::Vector2d expected = from.place + step.x() * along + step.y() * across;
          if ((regions[i].place - expected).norm() > kNodeReach * spacing) continue;
          regions[i].node = from.node + step;
          regions[i].placed = true;
          open.push_back(i);
          break;
        }
      }
    }
  };
  grow();
  // What lies beyond missing regions is found by the grid as it is so far, from the nearest part outwards.
  for (bool changed = true; changed;) {
    changed = false;
    if (std::count_if(regions.begin(), regions.end(), [](const Region& one) { return one.placed; }) < 4) return;
    const Eigen::Matrix<double, 2, 3> map = fit_nodes(regions);
    const Eigen::Matrix2d square = map.leftCols<2>();
    if (!(std::abs(square.determinant()) > 0.25 * spacing * spacing)) return;
    for (std::size_t i = 0; i < regions.size(); ++i) {
      if (regions[i].placed) continue;
      const Eigen::Vector2d node = square.inverse() * (regions[i].place - map.col(2));
      const Eigen::Vector2d whole(std::round(node.x()), std::round(node.y()));
      if ((node - whole).norm() > kNodeReach) continue;
      regions[i].node = whole.cast<int>();
      regions[i].placed = true;
      open.push_back(i);
      grow();
      changed = true;
      break;
    }
  }
}

/// First and last line (column if `axis` is 0) that is seen along enough of its length.
std::pair<int, int> range_of_lines(const std::vector<Region>& regions, int axis) {
  int low = 0, high = 0;
  for (const Region& one : regions) {
    if (!one.placed) continue;
    low = std::min(low, one.node[axis]);
    high = std::max(high, one.node[axis]);
  }
  std::vector<int> counts(static_cast<std::size_t>(high - low + 1), 0);
  for (const Region& one : regions) {
    if (one.placed) ++counts[static_cast<std::size_t>(one.node[axis] - low)];
  }
  const double enough = kLineShare * *std::max_element(counts.begin(), counts.end());
  int first = low, last = high;
  while (first < last && counts[static_cast<std::size_t>(first - low)] < enough) ++first;
  while (last > first && counts[static_cast<std::size_t>(last - low)] < enough) --last;
  return {first, last};
}

}  // namespace

int ColourLattice::count_seen() const {
  return std::accumulate(seen.begin(), seen.end(), 0);
}

ColourLattice find_colour_lattice(const cv::Mat& image, const Eigen::Vector2i& grid, double spacing_px) {
  refuse_light(image);
  std::vector<Region> regions = coloured_regions(image);
  keep_usual_size(regions);
  if (regions.size() < 4) {
    fail("coloured markers: {} regions of one size are seen, a grid of {} x {} was asked", regions.size(), grid.x(),
         grid.y());
  }
  ColourLattice lattice;
  lattice.spacing_px = usual_spacing(regions);
  if (spacing_px > 0.0 && std::abs(lattice.spacing_px - spacing_px) > 0.25 * spacing_px) {
    fail("coloured markers: neighbours are {:.1f} px apart, {:.1f} px were expected", lattice.spacing_px, spacing_px);
  }
  number_nodes(regions, lattice.spacing_px);
  const auto [left, right] = range_of_lines(regions, 0);
  const auto [top, bottom] = range_of_lines(regions, 1);
  const Eigen::Vector2i seen_grid(right - left + 1, bottom - top + 1);
  if (seen_grid != grid) {
    fail("coloured markers: a grid of {} x {} (columns x rows) is seen, {} x {} was asked", seen_grid.x(),
         seen_grid.y(), grid.x(), grid.y());
  }
  const Eigen::Matrix<double, 2, 3> map = fit_nodes(regions);
  const auto count = static_cast<std::size_t>(grid.x()) * static_cast<std::size_t>(grid.y());
  lattice.seen.assign(count, 0);
  for (int row = 0; row < grid.y(); ++row) {
    for (int column = 0; column < grid.x(); ++column) {
      lattice.places.emplace_back(map * Eigen::Vector3d(column + left, row + top, 1.0));
    }
  }
  for (const Region& one : regions) {
    const Eigen::Vector2i node = one.node - Eigen::Vector2i(left, top);
    if (!one.placed || (node.array() < 0).any() || (node.array() >= grid.array()).any()) continue;
    const auto i = static_cast<std::size_t>(node.y() * grid.x() + node.x());
    lattice.places[i] = one.place;
    lattice.seen[i] = 1;
  }
  if (lattice.count_seen() < kLeastLatticeSeen * static_cast<double>(count)) {
    fail("coloured markers: {} of {} regions are seen, at least {:.0f} % are needed", lattice.count_seen(), count,
         100.0 * kLeastLatticeSeen);
  }
  lattice.spacing_px = std::sqrt(std::abs(map.leftCols<2>().determinant()));
  return lattice;
}

}  // namespace touchstone::sensors
