#include "lab/dvs/dvs_grasps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "sim/press/elastic_object.h"
#include "sim/press/gel_setup.h"

namespace touchstone::lab {
namespace {

constexpr double kCut = 2.5;          // standard deviations
constexpr double kOvershoot = 1.2;    // of the wanted force: a finger that rings, and a step of the servo
constexpr double kOvershoot_N = 1.2;  // likewise
constexpr std::uint64_t kSeedsApart = 1000;

}  // namespace

std::span<const DvsMaterial> dvs_materials() {
  // Slopes: cut foam shows its cells under the paint; moulded rubber and silicone, and drawn steel, are smoother than
  // the membrane.
  static const std::array<DvsMaterial, 4> all = {{{"foam", "objects/hexagon-foam.yaml", 11, 0.12, 0.08},
                                                  {"rubber", "objects/hexagon-rubber.yaml", 9, 0.10, 0.04},
                                                  {"silicone", "objects/hexagon-silicone.yaml", 14, 0.10, 0.03},
                                                  {"steel", "objects/hexagon-steel.yaml", 14, 0.0, 0.02}}};
  return all;
}

DvsGraspParameters draw_dvs_grasp(int material, const sim::ObjectSpec& piece, std::uint64_t seed, std::uint64_t index,
                                  const DvsSpread& spread) {
  if (material < 0 || material >= static_cast<int>(dvs_materials().size())) {
    fail("material {} is asked for, there are {}", material, dvs_materials().size());
  }
  for (const double part : {spread.force, spread.setup, spread.pose}) {
    if (!(part >= 0.0 && part <= 1.0)) fail("a part of {} of the grasps' spread is asked for, 0 to 1 can be", part);
  }
  const DvsMaterial& of = dvs_materials()[static_cast<std::size_t>(material)];
  RandomStream numbers(seed, index, Purpose::kGrasp);
  const auto even = [&](double low, double high, double part = 1.0) {
    return low + (high - low) * (0.5 + part * (numbers.uniform() - 0.5));
  };
  const auto normal = [&](double deviation) { return deviation * std::clamp(numbers.normal(), -kCut, kCut); };
  DvsGraspParameters p;
  p.material = material;
  p.pose.place_mm.x() = even(-1.0, 1.0, spread.pose);
  p.pose.place_mm.y() = even(-2.0, 2.0, spread.pose);
  p.pose.yaw_deg = spread.pose * normal(1.5);
  p.pose.pitch_deg = spread.pose * normal(0.06);
  p.pose.roll_deg = spread.pose * normal(0.1);
  const double modulus_factor = std::exp(normal(of.modulus_spread));
  p.youngs_modulus_MPa = piece.elastic ? piece.elastic->youngs_modulus_MPa * modulus_factor : 0.0;
  p.friction = even(0.5, 1.2);
  p.rms_slope = std::hypot(kMembraneSlope, of.rms_slope) * even(0.9, 1.1);
  p.motion.clearance_mm = even(0.6, 1.4, spread.pose);
  p.motion.target_force_N = even(0.3, 3.5, spread.force);
  p.motion.closing_mm_s = even(13.0, 20.0, spread.setup);
  p.motion.opening_mm_s = even(30.0, 60.0, spread.setup);
  p.finger.ring_Hz = even(20.0, 32.0, spread.setup);
  p.finger.damping = even(0.07, 0.15, spread.setup);
  p.finger.shake_um = even(1.0, 5.0, spread.setup);
  p.light_level = even(0.8, 1.25, spread.setup);
  p.noise_seed = seed * kSeedsApart + index;
  p.motion.shake_seed = p.noise_seed;
  return p;
}

DvsGraspSetup::DvsGraspSetup(const std::filesystem::path& scenes, const std::filesystem::path& cache_folder)
    : device_(sim::read_device(scenes / "devices/dvs-grasp.yaml")), gel_(sim::set_up_gel(device_, cache_folder)) {
  for (const DvsMaterial& material : dvs_materials()) {
    pieces_.push_back(sim::read_object(scenes / material.object_file));
    // Compliance goes with 1/E, so pieces of equal shape and Poisson's ratio share one of 1 MPa.
    sim::ObjectSpec unit = pieces_.back();
    if (unit.elastic) unit.elastic->youngs_modulus_MPa = 1.0;
    elastic_.push_back(unit.elastic ? sim::set_up_elastic_object(unit, cache_folder) : nullptr);
  }
}

std::vector<DvsGraspParameters> DvsGraspSetup::draw(std::uint64_t seed, const DvsSpread& spread) const {
  std::vector<DvsGraspParameters> all;
  for (int material = 0; material < static_cast<int>(pieces_.size()); ++material) {
    for (int k = 0; k < dvs_materials()[static_cast<std::size_t>(material)].grasps; ++k) {
      all.push_back(draw_dvs_grasp(material, piece(material), seed, all.size(), spread));
    }
  }
  return all;
}

DvsGrasp DvsGraspSetup::play(const DvsGraspParameters& parameters, const sim::ReferenceForceSensorSettings& sensor,
                             const sim::GrippedFaceSettings& face) const {
  const auto at = static_cast<std::size_t>(parameters.material);
  if (parameters.material < 0 || at >= pieces_.size()) {
    fail("material {} is asked for, there are {}", parameters.material, pieces_.size());
  }
  sim::ObjectSpec piece = pieces_[at];
  piece.friction = parameters.friction;
  sim::GrippedFaceSettings settings = face;
  settings.rms_slope = parameters.rms_slope;
  settings.largest_force_N = kOvershoot * parameters.motion.target_force_N + kOvershoot_N;
  std::shared_ptr<const fem::Compliance> elastic;
  if (elastic_[at]) {
    elastic = std::make_shared<const fem::Compliance>(fem::with_modulus(*elastic_[at], parameters.youngs_modulus_MPa));
  }
  DvsGrasp grasp;
  grasp.parameters = parameters;
  grasp.face = std::make_shared<const sim::GrippedFace>(device_, *gel_, piece, elastic, parameters.pose, settings);
  grasp.run = sim::play_servo_finger(*grasp.face, parameters.finger, parameters.motion);
  grasp.readings = sim::read_reference_force(grasp.run.moments, grasp.run.first_touch_s, sensor, parameters.noise_seed);
  return grasp;
}

}  // namespace touchstone::lab
