#pragma once
// Which lamp lights a hit: one of them by chance, in proportion to what each would send.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "render/sampling/choice_by_power.h"

namespace touchstone::render {

/// A lamp by its number in the scene, and with what probability it was chosen.
struct LampChoice {
  int lamp;
  double probability;
};

/// What the choice among a scene's lamps looks at, arranged so that eight lamps are weighed at once. Without a grid a
/// lamp's weight is a rule of thumb: power, distance and, at a matt surface, the cosine after refraction as if all of
/// the path were in the lamp's medium. With a grid it is the lamp's light in the cell, lobe and refraction and
/// Fresnel's loss and all but shadow, on a surface of the receiver's normal. No lamp that shines is ever left without a
/// chance.
class LampChooser {
 public:
  /// `power`: in W, 0 for a lamp that's off; `index`: of the medium that the lamp stands in.
  void add(const Eigen::Vector3d& position, double power, double index);

  /// From a lamp's number and a place: the irradiance (W/m^2) that the lamp would send there without shadow, times the
  /// unit vector that it comes from; zero where it sends none.
  using LightAt = std::function<Eigen::Vector3d(int, const Eigen::Vector3d&)>;

  /// Lays a grid over `box`, the mean of `light_at` over a cell's corners in each. Cells close to a lamp, and what lies
  /// outside the box, stay with the rule of thumb.
  void lay_grid(const Eigen::AlignedBox3d& box, const LightAt& light_at);

  /// The lamp for a point, from a number in [0, 1). `normal`: of a matt surface, unit, on its lit side; nullptr for
  /// metal and particles. `index`: of the receiver's medium.
  /// @pre there is a lamp
  LampChoice choose(const Eigen::Vector3d& position, const Eigen::Vector3d* normal, double index, double number) const;

  /// The probability with which choose() takes lamp number `lamp`.
  double chance_of(int lamp, const Eigen::Vector3d& position, const Eigen::Vector3d* normal, double index) const;

  static constexpr int kMostWeighed = 32;  ///< of more lamps each has a chance by its power alone

 private:
  static constexpr int kLanes = 8;
  using Lanes = Eigen::Array<float, kLanes, 1>;
  struct Group {  // lamps that aren't there have no power
    Lanes x = Lanes::Zero(), y = Lanes::Zero(), z = Lanes::Zero();
    Lanes power = Lanes::Zero(), index = Lanes::Ones();
  };
  struct CellLight {  // of a group of lamps, in units of the strongest lamp's
    Lanes x = Lanes::Zero(), y = Lanes::Zero(), z = Lanes::Zero();
    Lanes length = Lanes::Zero(), least = Lanes::Zero();
  };
  struct Grid {
    Eigen::Array3d low, cells_per_mm;
    Eigen::Array3i count;
    std::vector<CellLight> lights;  // groups of a cell together, cells with x fastest
    std::vector<char> holds;        // by cell: may it be used?

    std::size_t cell(int i, int j, int k) const {
      return (static_cast<std::size_t>(k) * count.y() + j) * static_cast<std::size_t>(count.x()) + i;
    }
  };

  /// The sums of the lamps' weights up to and with each lamp's.
  struct Sums {
    std::array<float, kMostWeighed> up_to;  // the first count_ are in use
    float total = 0.0f;

    double chance(int lamp) const {
      return static_cast<double>(up_to[lamp] - (lamp > 0 ? up_to[lamp - 1] : 0.0f)) / static_cast<double>(total);
    }
  };
  /// False where no weight is of use: too many lamps, or none shines.
  bool weigh(const Eigen::Vector3d& position, const Eigen::Vector3d* normal, double index, Sums& sums) const;

  const CellLight* light_at(const Eigen::Vector3d& position) const;
  Lanes rule_of_thumb(const Group& group, const Eigen::Array3f& p, const Eigen::Vector3d* normal, float index) const;

  std::vector<Group> groups_;
  ChoiceByPower by_power_;
  int count_ = 0;
  std::optional<Grid> grid_;
};

}  // namespace touchstone::render
