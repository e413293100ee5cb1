#include "render/lamps/lamp_choice.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::render {

void LampChooser::add(const Eigen::Vector3d& position, double power, double index) {
  if (count_ % kLanes == 0) groups_.emplace_back();
  Group& group = groups_.back();
  const int lane = count_++ % kLanes;
  group.x[lane] = static_cast<float>(position.x());
  group.y[lane] = static_cast<float>(position.y());
  group.z[lane] = static_cast<float>(position.z());
  group.power[lane] = static_cast<float>(power);
  group.index[lane] = static_cast<float>(index);
  by_power_.add(power);
}

void LampChooser::lay_grid(const Eigen::AlignedBox3d& box, const LightAt& light_at) {
  grid_.reset();
  if (count_ < 2 || count_ > kMostWeighed || box.isEmpty() || !box.sizes().allFinite()) return;
  constexpr double kCellsAlong = 24.0;  // the longest side
  const double side = std::max(1e-6, box.sizes().maxCoeff() / kCellsAlong);
  Grid grid;
  grid.count = (box.sizes().array() / side).ceil().cast<int>().max(1);
  const Eigen::Array3d size = box.sizes().array().max(1e-6) / grid.count.cast<double>();
  grid.low = box.min().array();
  grid.cells_per_mm = 1.0 / size;
  const Eigen::Array3i corners = grid.count + 1;
  const auto corner_number = [&](int i, int j, int k) {
    return (static_cast<std::size_t>(k) * corners.y() + j) * static_cast<std::size_t>(corners.x()) + i;
  };
  const auto place = [&](double i, double j, double k) {
    return Eigen::Vector3d((grid.low + Eigen::Array3d(i, j, k) * size).matrix());
  };
  const auto cells = static_cast<std::size_t>(grid.count.prod());
  grid.lights.resize(cells * groups_.size());
  grid.holds.assign(cells, 1);
  double strongest = 0.0;
  for (const Group& group : groups_) strongest = std::max(strongest, static_cast<double>(group.power.maxCoeff()));
  if (!(strongest > 0.0)) return;

  std::vector<Eigen::Vector3d> at_corners(static_cast<std::size_t>(corners.prod()));
  for (int lamp = 0; lamp < count_; ++lamp) {
    const Group& group = groups_[lamp / kLanes];
    const int lane = lamp % kLanes;
    const Eigen::Vector3d stands = Eigen::Vector3f(group.x[lane], group.y[lane], group.z[lane]).cast<double>();
    const double power = group.power[lane] / strongest;
    for (int k = 0; k < corners.z(); ++k) {
      for (int j = 0; j < corners.y(); ++j) {
        for (int i = 0; i < corners.x(); ++i) {
          at_corners[corner_number(i, j, k)] = light_at(lamp, place(i, j, k)) / strongest;
        }
      }
    }
    for (int k = 0; k < grid.count.z(); ++k) {
      for (int j = 0; j < grid.count.y(); ++j) {
        for (int i = 0; i < grid.count.x(); ++i) {
          const std::size_t cell = grid.cell(i, j, k);
          Eigen::Vector3d mean = Eigen::Vector3d::Zero();
          for (int c = 0; c < 8; ++c) mean += at_corners[corner_number(i + c % 2, j + c / 2 % 2, k + c / 4)] / 8.0;
          const double distance2 = (place(i + 0.5, j + 0.5, k + 0.5) - stands).squaredNorm();
          if (distance2 < 4.0 * size.matrix().squaredNorm() || !mean.allFinite()) grid.holds[cell] = 0;
          CellLight& light = grid.lights[cell * groups_.size() + lamp / kLanes];
          light.x[lane] = static_cast<float>(mean.x());
          light.y[lane] = static_cast<float>(mean.y());
          light.z[lane] = static_cast<float>(mean.z());
          light.length[lane] = static_cast<float>(mean.norm());
          // A slope, a place or a lens that the corners don't stand for; then lamps get at least a part of what they
          // would send if they shone the same to all sides.
          constexpr double kSquareMillimetresPerSquareMetre = 1e6;
          const double to_all_sides = power * kSquareMillimetresPerSquareMetre / (4.0 * kPi * distance2);
          light.least[lane] = static_cast<float>(0.05 * mean.norm() + 0.05 * to_all_sides);
        }
      }
    }
  }
  grid_ = std::move(grid);
}

const LampChooser::CellLight* LampChooser::light_at(const Eigen::Vector3d& position) const {
  if (!grid_) return nullptr;
  const Eigen::Array3d place = (position.array() - grid_->low) * grid_->cells_per_mm;
  const Eigen::Array3d end = grid_->count.cast<double>();
  if (!((place >= 0.0).all() && (place <= end).all())) return nullptr;
  const Eigen::Array3i at = place.cast<int>().min(grid_->count - 1);
  const std::size_t cell = grid_->cell(at.x(), at.y(), at.z());
  return grid_->holds[cell] != 0 ? &grid_->lights[cell * groups_.size()] : nullptr;
}

LampChooser::Lanes LampChooser::rule_of_thumb(const Group& group, const Eigen::Array3f& p,
                                              const Eigen::Vector3d* normal, float index) const {
  const Lanes x = group.x - p.x();
  const Lanes y = group.y - p.y();
  const Lanes z = group.z - p.z();
  const Lanes lateral2 = x * x + y * y;
  const Lanes nearness = 1.0f / (lateral2 + z * z).max(1e-12f);  // 1 / distance^2
  Lanes weights = group.power * nearness;
  if (normal == nullptr) return weights;

  constexpr float kLeastCosine = 0.05f;
  const Eigen::Array3f n = normal->cast<float>();
  const Lanes bend = group.index * (1.0f / index);
  const Lanes shrink = bend * nearness.sqrt();
  const Lanes height = (1.0f - bend * bend * lateral2 * nearness).max(0.0f).sqrt();
  const Lanes upright = height * z / z.abs().max(1e-30f);  // with the sense of z
  return weights * ((n.x() * x + n.y() * y) * shrink + n.z() * upright).max(kLeastCosine);
}

bool LampChooser::weigh(const Eigen::Vector3d& position, const Eigen::Vector3d* normal, double index,
                        Sums& sums) const {
  if (count_ > kMostWeighed) return false;
  float total = 0.0f;
  const CellLight* cell = light_at(position);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    Lanes weights;
    if (cell == nullptr) {
      weights = rule_of_thumb(groups_[g], position.cast<float>(), normal, static_cast<float>(index));
    } else if (normal == nullptr) {
      weights = cell[g].length + cell[g].least;
    } else {
      const Eigen::Array3f n = normal->cast<float>();
      weights = (cell[g].x * n.x() + cell[g].y * n.y() + cell[g].z * n.z()).max(cell[g].least);
    }
    for (int lane = 0; lane < kLanes; ++lane) sums.up_to[kLanes * g + lane] = total += weights[lane];
  }
  sums.total = total;
  return total > 0.0f && std::isfinite(total);
}

LampChoice LampChooser::choose(const Eigen::Vector3d& position, const Eigen::Vector3d* normal, double index,
                               double number) const {
  TS_ASSERT(count_ > 0);
  if (count_ == 1) return {0, 1.0};
  Sums sums;
  if (!weigh(position, normal, index, sums)) {
    const auto [lamp, probability] = by_power_.choose(number);
    return {lamp, probability};
  }
  const float at = std::min(static_cast<float>(number), 1.0f - 0x1p-24f) * sums.total;
  int lamp = 0;
  for (int i = 0; i + 1 < count_; ++i) lamp += at >= sums.up_to[i] ? 1 : 0;
  while (lamp > 0 && !(sums.chance(lamp) > 0.0)) --lamp;  // rounding may have run past the last lamp that shines
  return {lamp, sums.chance(lamp)};
}

double LampChooser::chance_of(int lamp, const Eigen::Vector3d& position, const Eigen::Vector3d* normal,
                              double index) const {
  TS_ASSERT(lamp >= 0 && lamp < count_);
  if (count_ == 1) return 1.0;
  Sums sums;
  return weigh(position, normal, index, sums) ? sums.chance(lamp) : by_power_.probability(lamp);
}

}  // namespace touchstone::render
