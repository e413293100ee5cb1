#pragma once
// Force at several points at once, estimated from beads: balls are pressed on the vhs sensor's gel together, each with
// a force of its own; where the camera sees the beads is inverted with the gel's compliance.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "sensors/colour/marker_change.h"
#include "sensors/tractions/bead_field.h"
#include "sensors/tractions/traction_inversion.h"
#include "sim/scene/device.h"

namespace touchstone::lab {

/// The sensor, made anew with another grid of beads.
struct DistributionSetup {
  sim::DeviceSpec device;
  std::shared_ptr<const fem::Compliance> gel;
  sensors::MarkerCompliance compliance;  ///< of displacements as seen
  sensors::ViewParallax parallax;
  std::vector<Eigen::Vector2d> rest_px;
};

/// The parallax by which the device's camera sees its beads (the figure of [Lin2019] for a sensor; see ViewParallax).
/// @throws Error for a device without a pinhole camera straight before the gel, or without beads
sensors::ViewParallax bead_parallax(const sim::DeviceSpec& device);

/// Sets up the gel with a grid of so many beads a side.
DistributionSetup set_up_distribution(sim::DeviceSpec device, int grid, double spacing_mm,
                                      const std::filesystem::path& cache, const Progress& progress = {});

/// A ball of 1.5 mm radius with friction 0.5 that is pressed on straight down.
struct LoadPoint {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< mm, gel frame
  double force_N = 0.0;
};

/// What one press of some points gave.
struct DistributionTrial {
  std::vector<double> estimated_N;  ///< of each point: over the patches nearest to it
  std::vector<double> place_mm;     ///< how far the estimated force's centre is from the true one, of each point
  double total_N = 0.0;             ///< estimated, true minus estimated being the error
  double true_total_N = 0.0;
  double dip = 0.0;  ///< of two points: least pressure between them over the lower of the pressures at them; 1: no dip
};

/// Presses, sees the beads with independent noise of `noise_px` along x and y, and inverts.
DistributionTrial press_points(const DistributionSetup& setup, sensors::TractionInversion& inversion,
                               const std::vector<LoadPoint>& points, double noise_px, std::uint64_t seed);

}  // namespace touchstone::lab
