// A camera as a device's file has it.

#include <cmath>

#include "core/pixel_grab.h"
#include "core/units.h"
#include "sim/scene/camera_pipeline.h"
#include "sim/scene/camera_preset.h"
#include "sim/scene/device.h"
#include "sim/scene/device_camera.h"

namespace touchstone::render {

EnumNames<BayerPattern> enum_names(BayerPattern) {
  return {{"none", BayerPattern::none}, {"rggb", BayerPattern::rggb}, {"bggr", BayerPattern::bggr},
          {"grbg", BayerPattern::grbg}, {"gbrg", BayerPattern::gbrg}, {"binned", BayerPattern::binned}};
}

}  // namespace touchstone::render

namespace touchstone::sim {
namespace {

/// `camera.type` of the file.
enum class CameraType { pinhole, lens };

EnumNames<CameraType> enum_names(CameraType) {
  return {{"pinhole", CameraType::pinhole}, {"lens", CameraType::lens}};
}

constexpr double kFarthestLook_mm = 1e6;  // farther points leave the camera no direction: squares overflow

void hole_fields(YamlReader& in, PinholeSpec& hole, Eigen::Vector3d& position_mm) {
  in.required("hole_diameter_um", hole.hole_diameter_um, Allowed::above(0.0));
  in.optional("foil_thickness_um", hole.foil_thickness_um, Allowed::at_least(0.0));
  in.required("hole_to_sensor_mm", hole.hole_to_sensor_mm, Allowed::above(0.0));
  in.required("hole_position_mm", position_mm);
}

void lens_fields(YamlReader& in, LensSpec& lens, Eigen::Vector3d& position_mm) {
  const Allowed length = Allowed::above(0.0);
  in.exactly_one_of({"focal_length_mm", "camera_matrix"});
  in.optional("focal_length_mm", lens.focal_length_mm, length);
  in.optional("camera_matrix", lens.camera_matrix);
  in.required("f_number", lens.f_number, Allowed::within(0.5, 1000.0));
  in.optional("focus_distance_mm", lens.focus_distance_mm, length);
  in.not_beside("sensor_distance_mm", {"camera_matrix", "focus_distance_mm"});  // either of them tells it
  in.optional("sensor_distance_mm", lens.sensor_distance_mm, length);
  in.optional("distortion", lens.distortion);
  std::optional<VignettingSpec> vignetting;
  in.optional("vignetting", vignetting);
  if (vignetting) lens.vignetting = vignetting->vignetting;
  in.required("lens_position_mm", position_mm);
  const std::size_t numbers = lens.distortion.size();
  if (in.has("distortion") && numbers != 4 && numbers != 5 && numbers != 8) {
    fail_at(in.where("distortion"), "distortion: {} numbers; allowed are 4, 5 or 8: k1 k2 p1 p2 [k3 [k4 k5 k6]]",
            numbers);
  }
}

/// What a camera makes of its sensor's numbers.
void pipeline_fields(YamlReader& in, CameraSpec& camera) {
  std::optional<render::HotPixels> hot;
  in.optional("hot_pixels", hot);
  if (hot) camera.hot_pixels = *hot;
  in.optional("auto_exposure", camera.auto_exposure);
  in.optional("auto_white_balance", camera.auto_white_balance);
  std::optional<ToneCurveSpec> tone;
  in.optional("tone_curve", tone);
  if (tone) camera.tone_curve = tone->curve;
  in.optional("jpeg", camera.jpeg);
}

/// A matrix of another resolution has its principal point at the same multiple of both sides.
void check_principal_point(const YamlReader& in, const CameraSpec& camera) {
  constexpr double kLowest = 0.3, kHighest = 0.8;  // of lenses that belong to their sensor: 0.4 to 0.6
  const auto* lens = std::get_if<LensSpec>(&camera.optics);
  if (lens == nullptr || !lens->camera_matrix) return;
  const Eigen::Vector2d point = lens->camera_matrix->tail<2>();
  const Eigen::Array2d share = (point.array() + 0.5) / Eigen::Array2d(camera.width, camera.height);
  const bool outside = (share < 0.0).any() || (share > 1.0).any();
  if (!outside && !(share < kLowest).all() && !(share > kHighest).all()) return;
  fail_at(in.where("camera_matrix"),
          "camera.camera_matrix: the principal point ({:g}, {:g}) is {} the picture of {} x {} pixels; a matrix of "
          "another resolution is to be scaled, all four numbers of it",
          point.x(), point.y(), outside ? "outside" : "in a corner of", camera.width, camera.height);
}

/// What the pipeline's blocks say together with the rest.
void check_pipeline(const YamlReader& in, const CameraSpec& camera) {
  if (camera.auto_white_balance && camera.bayer == render::BayerPattern::none) {
    fail_at(in.where("auto_white_balance"), "camera.auto_white_balance: the camera is grey (`bayer: none`)");
  }
  if (!camera.auto_exposure) return;
  const double longest_us = camera.auto_exposure->highest * camera.exposure_us;
  const double frame_us = kMicrosecondsPerSecond / camera.frame_rate_Hz;
  if (camera.exposure_us == 0.0) {
    fail_at(in.where("auto_exposure"), "camera.auto_exposure: exposure_us is 0, which no factor changes");
  }
  if (longest_us > frame_us) {
    fail_at(in.where("auto_exposure"),
            "camera.auto_exposure: exposure_factors go to {}: {} us, which is longer than a frame of {} us at {} Hz",
            camera.auto_exposure->highest, longest_us, frame_us, camera.frame_rate_Hz);
  }
}

/// That the lens or hole can be made.
void check_optics(const YamlReader& in, const CameraSpec& camera) {
  const auto check = [](const CameraSpec& one, const SourceLocation& where) {
    try {
      camera_of(one);
    } catch (const Error& error) {
      fail_at(where, "{}", error.what());
    }
  };
  CameraSpec plain = camera;
  auto* lens = std::get_if<LensSpec>(&plain.optics);
  const bool vignetting = lens != nullptr && lens->vignetting;
  if (vignetting) lens->vignetting.reset();
  check(plain, in.where());
  if (vignetting) check(camera, in.where("vignetting"));
}

}  // namespace

void fields(YamlReader& in, CameraSpec& camera) {
  const bool preset = read_preset(in, camera);
  const auto needed = [&](const char* key, auto& value, Allowed allowed) {
    preset ? in.optional(key, value, allowed) : in.required(key, value, allowed);
  };
  auto type = CameraType::pinhole;
  in.optional("type", type);
  needed("width", camera.width, Allowed::within(1, 8192));
  needed("height", camera.height, Allowed::within(1, 8192));
  in.optional("frame_rate_Hz", camera.frame_rate_Hz, Allowed::above(0.0));
  needed("pixel_pitch_um", camera.pixel_pitch_um, Allowed::within(0.01, 10'000.0));
  const double whole_area = camera.pixel_pitch_um * camera.pixel_pitch_um;
  if (!preset || in.has("pixel_pitch_um")) camera.active_area_um2 = whole_area;
  in.optional("active_area_um2", camera.active_area_um2, Allowed::above_up_to(0.0, whole_area));
  if (type == CameraType::lens) {
    lens_fields(in, camera.optics.emplace<LensSpec>(), camera.position_mm);
  } else {
    hole_fields(in, camera.optics.emplace<PinholeSpec>(), camera.position_mm);
  }
  in.required("look_at_mm", camera.look_at_mm);
  in.optional("roll_deg", camera.roll_deg, Allowed::within(-180.0, 180.0));
  in.required("exposure_us", camera.exposure_us, Allowed::at_least(0.0));
  in.optional("row_time_us", camera.row_time_us, Allowed::at_least(0.0));
  in.optional("bits", camera.bits, Allowed::within(1, 16));
  in.optional("bayer", camera.bayer);
  if (camera.bayer == render::BayerPattern::none && !preset) camera.quantum_efficiency_green = 1.0;
  for (auto [key, efficiency] : {std::pair{"quantum_efficiency_red", &camera.quantum_efficiency_red},
                                 std::pair{"quantum_efficiency_green", &camera.quantum_efficiency_green},
                                 std::pair{"quantum_efficiency_blue", &camera.quantum_efficiency_blue}}) {
    in.optional(key, *efficiency, Allowed::within(0.0, 1.0));
    efficiency->where = in.where(key);
  }
  in.optional("white_balance", camera.white_balance, Allowed::above(0.0));
  needed("full_well_e", camera.full_well_e, Allowed::within(1.0, 1e9));
  in.optional("gain_dB", camera.gain_dB, Allowed::within(0.0, 48.0));
  in.optional("read_noise_e", camera.read_noise_e, Allowed::at_least(0.0));
  in.optional("dark_current_e_per_s", camera.dark_current_e_per_s, Allowed::at_least(0.0));
  in.optional("prnu", camera.prnu, Allowed::within(0.0, 0.5));
  in.optional("dsnu_e", camera.dsnu_e, Allowed::at_least(0.0));
  in.optional("black_level_DN", camera.black_level_DN, Allowed::at_least(0.0));
  pipeline_fields(in, camera);
  in.optional("motion_chip", camera.motion_chip);
  in.not_beside("motion_chip", {"tone_curve", "jpeg", "auto_exposure", "auto_white_balance"});  // it has its own
  in.optional("events", camera.events);
  if (camera.motion_chip && (camera.width != kChipSide || camera.height != kChipSide)) {
    fail_at(in.where("motion_chip"), "camera.motion_chip: a picture of {}x{} pixels; the chip has {}x{}", camera.width,
            camera.height, kChipSide, kChipSide);
  }
  if (camera.events && camera.bayer == render::BayerPattern::binned) {
    fail_at(in.where("events"),
            "camera.events: event pixels are single ones; `bayer: binned` tells of means over several");
  }
  const double frame_us = kMicrosecondsPerSecond / camera.frame_rate_Hz;
  if (camera.exposure_us > frame_us) {
    fail_at(in.where("exposure_us"), "exposure_us: {} is longer than a frame of {} us at {} Hz", camera.exposure_us,
            frame_us, camera.frame_rate_Hz);
  }
  if (camera.row_time_us * camera.height > frame_us) {
    fail_at(in.where("row_time_us"), "row_time_us: {} for each of {} rows is longer than a frame of {} us at {} Hz",
            camera.row_time_us, camera.height, frame_us, camera.frame_rate_Hz);
  }
  check_pipeline(in, camera);
  check_principal_point(in, camera);
  const double distance_mm = (camera.look_at_mm - camera.position_mm).norm();
  if (distance_mm < 1e-6) {
    fail_at(in.where("look_at_mm"), "camera.look_at_mm: is the camera's own position; the camera has no direction");
  }
  if (!(distance_mm <= kFarthestLook_mm)) {
    fail_at(in.where("look_at_mm"), "camera.look_at_mm: is {:.4g} mm from the camera; allowed is at most {} mm",
            distance_mm, kFarthestLook_mm);
  }
  check_optics(in, camera);
}

}  // namespace touchstone::sim
