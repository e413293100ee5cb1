#pragma once
// What a ball does to a gel beside the part that it touches: the gel sinks round it.

#include <vector>

namespace touchstone::sensors {

/// The imprint of a rigid ball without friction in an incompressible elastic layer that is bonded to a stiff base: the
/// ball's cap where it touches, beyond it the surface of linear elasticity. A function of the distance r from the
/// ball's axis; the modulus cancels. Solved by Lebedev and Ufliand's integral equation [Lebedev1958].
class BallImprint {
 public:
  /// All mm. Thicknesses beyond 20 contact radii are taken as 20, which is a half-space to 1 %, and those below a fifth
  /// of it as that: the gel's surface then rests at once beyond the rim.
  /// @pre 0 < contact_radius < ball_radius, thickness > 0, all finite
  BallImprint(double ball_radius, double contact_radius, double thickness);

  /// How far the ball is pressed in beyond the first touch, mm.
  double depth() const { return depth_; }
  /// How far the surface is pressed in, mm. Slightly negative where the gel bulges; 0 beyond 8 thicknesses.
  double height(double r) const;
  /// height's derivative.
  double slope(double r) const;

 private:
  double place_of(double r) const;

  double ball_radius_;
  double contact_radius_;
  double depth_ = 0.0;
  double reach_ = 0.0;           ///< of `outside_` beyond the rim, mm
  std::vector<double> outside_;  ///< heights from the rim on, at distances from it that grow with the index's square
};

}  // namespace touchstone::sensors
