#include "lab/vhs/vhs_distribution.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/random.h"
#include "core/random_pairs.h"
#include "fem/contact/press.h"
#include "lab/press/marker_compliance_export.h"
#include "lab/press/mechanics_press.h"
#include "lab/press/pressed_marker.h"
#include "render/cameras/first_hits.h"
#include "sensors/tractions/seen_markers.h"
#include "sim/press/gel_setup.h"

namespace touchstone::lab {
namespace {

constexpr double kBallRadius_mm = 1.5;
constexpr double kFriction = 0.5;
constexpr double kStep_N = 0.25;  // of the largest force, a step

/// Where the camera sees the beads, px from the picture's centre.
std::vector<Eigen::Vector2d> seen_at(const sim::DeviceSpec& device, const std::vector<Eigen::Vector3d>& beads) {
  const render::Scene faces = bare_faces(device.gel.thickness_mm, device.gel.refractive_index,
                                         device.plate.thickness_mm, device.plate.refractive_index);
  const render::ReadyCamera camera = camera_before(std::get<sim::PinholeSpec>(device.camera->optics).hole_to_sensor_mm,
                                                   -device.camera->position_mm.z());
  const Eigen::Vector2d middle = 0.5 * render::size_of(camera).cast<double>();
  std::vector<Eigen::Vector2d> px;
  for (const Eigen::Vector3d& bead : beads) {
    const auto um = render::project_through_faces(faces, camera, bead);
    if (!um) fail("a bead at ({}, {}, {}) mm can't be seen", bead.x(), bead.y(), bead.z());
    px.emplace_back((*um - middle) / device.camera->pixel_pitch_um);
  }
  return px;
}

/// Pressure (MPa) estimated for the patch at a place of the gel's face; 0 beside the patches.
double pressure_at(const sensors::MarkerCompliance& c, const sensors::TractionField& field, const Eigen::Vector2d& at) {
  const Eigen::Vector2d index = (at - c.first_patch) / c.patch_side;
  const Eigen::Vector2i cell = index.array().round().cast<int>();
  if ((cell.array() < 0).any() || (cell.array() >= c.patch_grid.array()).any()) return 0.0;
  return -field.traction(2, cell.y() * c.patch_grid.x() + cell.x());
}

/// Along the line between two points: the least pressure of its middle third over the lower of the two largest in the
/// outer thirds, and beyond by half a third.
double dip_between(const sensors::MarkerCompliance& c, const sensors::TractionField& field, const Eigen::Vector2d& a,
                   const Eigen::Vector2d& b) {
  double at_a = 0.0, at_b = 0.0, between = std::numeric_limits<double>::infinity();
  for (int i = -10; i <= 70; ++i) {
    const double part = i / 60.0;
    const double pressure = pressure_at(c, field, a + part * (b - a));
    if (part < 1.0 / 3.0) {
      at_a = std::max(at_a, pressure);
    } else if (part <= 2.0 / 3.0) {
      between = std::min(between, pressure);
    } else {
      at_b = std::max(at_b, pressure);
    }
  }
  const double lower = std::min(at_a, at_b);
  return lower > 0.0 ? between / lower : 1.0;
}

}  // namespace

sensors::ViewParallax bead_parallax(const sim::DeviceSpec& device) {
  if (!device.beads) fail_at(device.where, "the device has no beads");
  if (!device.camera || !std::holds_alternative<sim::PinholeSpec>(device.camera->optics)) {
    fail_at(device.where, "the device has no pinhole camera");
  }
  const Eigen::Vector3d hole = device.camera->position_mm;
  if ((device.camera->look_at_mm - hole).head<2>().norm() > 1e-9) {
    fail_at(device.where, "the camera doesn't look straight at the gel");
  }
  const double air = -hole.z() - device.gel.thickness_mm - device.plate.thickness_mm;
  const double gel = device.gel.thickness_mm - device.beads->depth_mm;
  sensors::ViewParallax parallax;
  parallax.viewing_distance_mm =
      device.gel.refractive_index * (air + device.plate.thickness_mm / device.plate.refractive_index) + gel;
  parallax.axis_mm = hole.head<2>();
  return parallax;
}

DistributionSetup set_up_distribution(sim::DeviceSpec device, int grid, double spacing_mm,
                                      const std::filesystem::path& cache, const Progress& progress) {
  DistributionSetup setup;
  setup.device = std::move(device);
  setup.parallax = bead_parallax(setup.device);
  setup.device.beads->grid = grid;
  setup.device.beads->spacing_mm = spacing_mm;
  setup.gel = sim::set_up_gel(setup.device, cache, progress);
  setup.compliance = sensors::as_seen(export_marker_compliance(setup.device, *setup.gel), setup.parallax);
  setup.rest_px = seen_at(setup.device, setup.compliance.marker_rest);
  return setup;
}

DistributionTrial press_points(const DistributionSetup& setup, sensors::TractionInversion& inversion,
                               const std::vector<LoadPoint>& points, double noise_px, std::uint64_t seed) {
  double largest = 0.0;
  std::vector<fem::PressBody> bodies;
  for (const LoadPoint& point : points) {
    largest = std::max(largest, point.force_N);
    bodies.push_back({.shape = fem::SphereShape{kBallRadius_mm}, .friction = kFriction, .elastic = nullptr});
  }
  fem::Press press(*setup.gel, std::move(bodies), {}, {}, fem::PressOutput::forces);
  const int steps = std::max(1, static_cast<int>(std::ceil(largest / kStep_N)));
  for (int step = 1; step <= steps; ++step) {
    std::vector<fem::PressTarget> targets;
    for (const LoadPoint& point : points) {
      targets.push_back(press_target(point.place.x(), point.place.y(), 0.0));
      targets.back().axis[2] = fem::AxisControl::with_force(point.force_N * step / steps);
    }
    press.step(targets);
  }

  std::vector<Eigen::Vector3d> beads = setup.compliance.marker_rest;
  for (std::size_t i = 0; i < beads.size(); ++i) {
    beads[i] += press.state().bead_displacement.row(static_cast<Eigen::Index>(i)).transpose();
  }
  RandomStream random(seed, 0, Purpose::kImagerNoise);
  sensors::TrackedBeads tracked;
  tracked.positions = seen_at(setup.device, beads);
  for (Eigen::Vector2d& place : tracked.positions) {
    place += noise_px * normal_pair(random);
  }
  tracked.status.assign(beads.size(), sensors::BeadStatus::kFound);
  const sensors::BeadView view = sensors::view_of(setup.rest_px, setup.compliance);
  const sensors::TractionField field =
      inversion.invert(sensors::bead_field(tracked, setup.rest_px, view, setup.compliance));

  DistributionTrial trial;
  trial.estimated_N.assign(points.size(), 0.0);
  std::vector<Eigen::Vector2d> moment(points.size(), Eigen::Vector2d::Zero());
  for (int p = 0; p < setup.compliance.patches(); ++p) {
    const Eigen::Vector2d at = setup.compliance.patch_centre(p);
    std::size_t nearest = 0;
    for (std::size_t k = 1; k < points.size(); ++k) {
      if ((at - points[k].place).norm() < (at - points[nearest].place).norm()) nearest = k;
    }
    const double force = -field.traction(2, p) * setup.compliance.patch_area();
    trial.estimated_N[nearest] += force;
    moment[nearest] += force * at;
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    trial.place_mm.push_back(trial.estimated_N[k] > 0.0 ? (moment[k] / trial.estimated_N[k] - points[k].place).norm()
                                                        : std::numeric_limits<double>::quiet_NaN());
    trial.total_N += trial.estimated_N[k];
    trial.true_total_N += press.state().bodies[k].wrench[2];
  }
  if (points.size() == 2) trial.dip = dip_between(setup.compliance, field, points[0].place, points[1].place);
  return trial;
}

}  // namespace touchstone::lab
