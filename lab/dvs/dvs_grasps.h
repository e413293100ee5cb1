#pragma once
// The 48 grasps of [Naeini2020] (sec. V.D: foam 11, rubber 9, silicone 14, steel 14): what differs from one to the
// next, drawn from a seed, and each one played: what the membrane's face does, the finger's true force and what the
// reference sensor makes of it. No light: pictures and events are made from a grasp's faces.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sim/grasp/gripped_face.h"
#include "sim/grasp/reference_force_sensor.h"
#include "sim/grasp/servo_finger.h"

namespace touchstone::lab {

/// One of the paper's four materials.
struct DvsMaterial {
  std::string name;
  std::string object_file;      ///< below the scenes' folder
  int grasps = 0;               ///< sec. V.D
  double modulus_spread = 0.0;  ///< standard deviation of ln E between pieces and grips
  double rms_slope = 0.0;       ///< of the painted piece's face
};

/// Foam, rubber, silicone, steel: the order of the paper's classes, and of their moduli here.
std::span<const DvsMaterial> dvs_materials();

/// RMS slope of the membrane's own face: "opaque" (sec. III.A), cast in a mould that isn't polished. With it the face
/// is pressed flat at some 4 N, where the paper's sensor saturates (VI).
inline constexpr double kMembraneSlope = 0.07;

/// One grasp.
struct DvsGraspParameters {
  int material = 0;                 ///< into dvs_materials()
  double youngs_modulus_MPa = 0.0;  ///< of the piece; 0: rigid
  double friction = 0.0;
  double rms_slope = 0.0;  ///< of both faces together
  sim::GrippedPose pose;
  sim::ServoFingerSettings finger;
  sim::FingerMotion motion;
  double light_level = 1.0;      ///< of the room's light
  std::uint64_t noise_seed = 0;  ///< for all that is random in it: sensor, camera
};

/// How much of what draw_dvs_grasp can draw is drawn, about the middle of it: 1 all, 0 nothing.
struct DvsSpread {
  double force = 1.0;  ///< wanted
  double pose = 1.0;   ///< place, yaw, pitch, roll and clearance: a piece is put in by hand
  /// Speeds, ring and damping, the setup's motion, light. The paper's grasps are one gripper's, in one light, under one
  /// program; 1 is as many setups as grasps.
  double setup = 0.1;
};

/// What the paper leaves open is drawn evenly or, with (s), normally with that deviation, cut at 2.5 of them. Force
/// wanted 0.3 to 3.5 N (the servo's steps make 0.15 to 3.7 N of it). Pose: place x +-1, y +-2 mm; yaw (1.5), pitch
/// (0.06), roll (0.1 degrees: what the fingers' alignment leaves once the silicone on both has given way), clearance
/// 0.6 to 1.4 mm. Piece and face, always in full: ln E (the material's); friction 0.5 to 1.2; roughness 0.9 to 1.1
/// times. Setup: closing 13 to 20 mm/s, opening 30 to 60 mm/s; ring 20 to 32 Hz, damping 0.07 to 0.15, motion 1 to 5
/// um; light 0.8 to 1.25 times. A pure function of seed, index and what is given.
/// @throws Error for a material that isn't there, or a spread that isn't 0 to 1
DvsGraspParameters draw_dvs_grasp(int material, const sim::ObjectSpec& piece, std::uint64_t seed, std::uint64_t index,
                                  const DvsSpread& spread = {});

/// One grasp, played.
struct DvsGrasp {
  DvsGraspParameters parameters;
  std::shared_ptr<const sim::GrippedFace> face;  ///< map(at_travel(moment.travel_mm)) is the face at a moment
  sim::FingerRun run;
  std::vector<sim::ForceReading> readings;  ///< from the first touch on, window by window
};

/// The device and the four pieces, set up once. Safe to use from many threads.
class DvsGraspSetup {
 public:
  /// @throws Error for scene files that are missing or wrong
  DvsGraspSetup(const std::filesystem::path& scenes, const std::filesystem::path& cache_folder);

  const sim::DeviceSpec& device() const { return device_; }
  const sim::ObjectSpec& piece(int material) const { return pieces_[static_cast<std::size_t>(material)]; }

  /// All 48, material by material.
  /// @throws Error as draw_dvs_grasp
  std::vector<DvsGraspParameters> draw(std::uint64_t seed, const DvsSpread& spread = {}) const;
  /// @throws Error as its parts do
  DvsGrasp play(const DvsGraspParameters& parameters, const sim::ReferenceForceSensorSettings& sensor = {},
                const sim::GrippedFaceSettings& face = {}) const;

 private:
  sim::DeviceSpec device_;
  std::shared_ptr<const fem::Compliance> gel_;
  std::vector<sim::ObjectSpec> pieces_;
  std::vector<std::shared_ptr<const fem::Compliance>> elastic_;  // of 1 MPa; null for the rigid one
};

}  // namespace touchstone::lab
