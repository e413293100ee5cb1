#pragma once
// Which lamp lights a hit: one of them by chance, in proportion to what each would send.

#include <Eigen/Core>
#include <array>
#include <vector>

namespace touchstone::render {

struct LampChoice {
  int lamp;
  double probability;
};

/// What the choice among a scene's lamps looks at, arranged so that eight lamps are weighed at once.
class LampChooser {
 public:
  /// `power`: any unit, 0 for a lamp that's off; `index`: of the medium that the lamp stands in.
  void add(const Eigen::Vector3d& position, double power, double index);

  /// The lamp for a point, from a number in [0, 1): by power, distance and, at a matt surface of unit normal `normal`,
  /// by the cosine after refraction as if all of the way were in the lamp's medium; `index` is that of the receiver's
  /// medium. Without a normal (nullptr: metal, a particle) by power and distance. Shadow, Fresnel's loss and lobe play
  /// no part, so no lamp that shines is left without a chance.
  /// @pre there is a lamp
  LampChoice choose(const Eigen::Vector3d& position, const Eigen::Vector3d* normal, double index, double number) const;

 private:
  static constexpr int kLanes = 8;
  static constexpr int kMostWeighed = 32;  // of more lamps each has the same chance
  using Lanes = Eigen::Array<float, kLanes, 1>;
  struct Group {  // lamps that aren't there have no power
    Lanes x = Lanes::Zero(), y = Lanes::Zero(), z = Lanes::Zero();
    Lanes power = Lanes::Zero(), index = Lanes::Ones();
  };
  std::vector<Group> groups_;
  int count_ = 0;
};

}  // namespace touchstone::render
